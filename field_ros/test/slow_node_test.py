#!/usr/bin/python3
"""Overload, and what diagnostics say about it and about silence."""
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

STEP_S, LAG_S = 0.2, 0.05  # step_time and max_pose_lag of slow_node.test


class SlowNode(unittest.TestCase):
    def setUp(self):
        self.lags, self.reports = [], []
        self.newest = None
        self.odom = rospy.Publisher('odom', Odometry, queue_size=1000)
        self.field = rospy.Publisher('field', FieldMeasurement, queue_size=1000)
        self.pose = rospy.Subscriber('toy/pose', PoseWithCovarianceStamped, self.take_pose)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.take_report)
        self.wait(lambda: self.odom.get_num_connections() and self.field.get_num_connections()
                  and self.pose.get_num_connections())

    def take_pose(self, message):
        self.lags.append((self.newest - message.header.stamp).to_sec())

    def take_report(self, array):
        self.reports.append({s.name.rpartition(': ')[2]: (s.level, s.message, {v.key: v.value for v in s.values})
                             for s in array.status})

    def wait(self, condition):
        for _ in range(400):
            if condition():
                return
            rospy.sleep(0.05)
        self.fail('nothing came within 20 s')

    def drive(self, seconds):
        """Odometry at 100 Hz and measurements at 25 Hz, in real time: five times what a step of 0.2 s allows."""
        rate = rospy.Rate(100)
        for tick in range(int(seconds * 100)):
            stamp = rospy.Time.now()
            odometry = Odometry()
            odometry.header.stamp = stamp
            odometry.pose.pose.orientation.w = 1.0
            self.newest = stamp
            self.odom.publish(odometry)
            if tick % 4 == 0:
                field = FieldMeasurement(names=['light'], values=[3.0])
                field.header.stamp = stamp
                self.field.publish(field)
            rate.sleep()

    def level(self, name):
        return self.reports[-1][name][0]

    def test_the_pose_stays_within_one_step_and_silence_is_stale(self):
        self.drive(4.0)
        lags = sorted(self.lags)
        self.assertGreater(len(lags), 10)
        # When a step begins, its measurement is at most LAG_S older than the newest one that has come, which
        # is 0.04 s old at most; the pose comes one step later. One in ten may meet a stalled machine.
        self.assertLess(lags[int(0.9 * len(lags))], LAG_S + STEP_S + 0.1, lags)
        self.assertGreater(lags[0], 0.9 * STEP_S - 0.05, 'the toy was not slow')
        self.wait(lambda: any('shed' in r['input'][1] and r['input'][0] == DiagnosticStatus.WARN
                              for r in self.reports))
        shed = int(self.reports[-1]['input'][2]['dropped shed'])
        self.assertGreater(shed, 40)  # of 100; 20 can be used
        self.assertEqual(['shed'], [k[8:] for k in self.reports[-1]['input'][2] if k.startswith('dropped')])
        # input_timeout: 1 s
        self.wait(lambda: self.level('input') == self.level('estimator') == DiagnosticStatus.STALE)
        self.drive(1.5)
        self.wait(lambda: self.level('estimator') != DiagnosticStatus.STALE or self.drive(0.5))


if __name__ == '__main__':
    rospy.init_node('slow_node_test')
    rostest.rosrun('field_ros', 'slow_node', SlowNode)
