#!/usr/bin/python3
"""Talks to the toy node: every test waits for an answer, never for a time."""
import unittest

import rospy
import rostest
import tf2_msgs.msg
from diagnostic_msgs.msg import DiagnosticArray
from field_msgs.msg import FieldMap, FieldMeasurement
from field_msgs.srv import PredictField, SaveState
from geometry_msgs.msg import Point, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from std_srvs.srv import Empty, SetBool


def odometry(stamp, x):
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = 'odom'
    message.child_frame_id = 'base_link'
    message.pose.pose.position.x = x
    message.pose.pose.orientation.w = 1.0
    return message


def measurement(stamp, names, values):
    message = FieldMeasurement(names=names, values=values)
    message.header.stamp = rospy.Time.from_sec(stamp)
    return message


class ToyNode(unittest.TestCase):
    stamp = 100.0

    def setUp(self):
        self.poses, self.transforms = [], []
        self.odom = rospy.Publisher('odom', Odometry, queue_size=100)
        self.field = rospy.Publisher('field', FieldMeasurement, queue_size=100)
        self.subscribers = [
            rospy.Subscriber('toy/pose', PoseWithCovarianceStamped, self.poses.append),
            rospy.Subscriber('/tf', tf2_msgs.msg.TFMessage, self.transforms.append)]
        self.wait(lambda: self.odom.get_num_connections() and self.field.get_num_connections()
                  and all(s.get_num_connections() for s in self.subscribers))

    def wait(self, condition):
        for _ in range(400):
            if condition():
                return
            rospy.sleep(0.05)
        self.fail('nothing came within 20 s')

    def drive(self, message=None, x=1.0):
        """One metre in one second with a measurement in the middle; returns the pose that follows."""
        count = len(self.poses)
        start = ToyNode.stamp
        ToyNode.stamp += 1.0
        self.odom.publish(odometry(start, start))
        self.odom.publish(odometry(start + 0.9, start + 0.9))
        self.field.publish(message or measurement(start + 0.45, ['light'], [3.0]))
        if message is None:
            self.wait(lambda: len(self.poses) > count)
            return self.poses[-1]
        return None

    def diagnostics(self, key):
        """Values of a key of the input status, as they come."""
        seen = []

        def take(array):
            for status in array.status:
                seen.extend(item.value for item in status.values if item.key == key)
        subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, take)
        self.wait(lambda: seen)
        subscriber.unregister()
        return seen[-1]

    def test_pose_tf_and_maps(self):
        pose = self.drive()
        self.assertEqual('map', pose.header.frame_id)
        self.wait(lambda: self.transforms)
        transform = self.transforms[-1].transforms[0]
        self.assertEqual(('map', 'odom'), (transform.header.frame_id, transform.child_frame_id))
        # Post-dated by transform_tolerance after some odometry: stamps n or n + 0.9, plus 0.1.
        self.assertAlmostEqual(0.0, (transform.header.stamp.to_sec() * 10) % 1.0, places=3)
        field_map = rospy.wait_for_message('toy/field_map', FieldMap, 20)
        self.assertEqual(('light', 16), (field_map.name, len(field_map.mean)))
        for topic in ('toy/grid/light', 'toy/grid/light_stddev'):
            self.assertEqual(16, len(rospy.wait_for_message(topic, OccupancyGrid, 20).data))

    def test_bad_messages_are_counted_and_the_node_lives(self):
        self.drive()
        now = ToyNode.stamp
        self.drive(measurement(now, ['light'], [1.0, 2.0]))
        self.drive(measurement(now, ['light'] * 1000000, [1.0] * 1000000))
        self.drive(measurement(now, [], []))
        bad = odometry(now, float('nan'))
        self.odom.publish(bad)
        self.drive()
        for reason in ('length_mismatch', 'too_many_fields', 'empty_measurement', 'non_finite_pose'):
            self.assertEqual('1', self.diagnostics('dropped ' + reason), reason)

    def test_odometry_at_100_hz_and_a_field_at_1_hz(self):
        count, start = len(self.poses), ToyNode.stamp
        ToyNode.stamp += 4.0
        for tick in range(400):
            self.odom.publish(odometry(start + 0.01 * tick, start + 0.01 * tick))
            if tick % 100 == 50:
                self.field.publish(measurement(start + 0.01 * tick + 0.005, ['light'], [3.0]))
        self.wait(lambda: len(self.poses) == count + 4)
        stamps = [pose.header.stamp.to_sec() - start for pose in self.poses[count:]]
        # Between two odometry messages: none waits for the next measurement, none is thrown away.
        for got, wanted in zip(stamps, (0.505, 1.505, 2.505, 3.505)):
            self.assertAlmostEqual(wanted, got, places=5)

    def test_services(self):
        self.drive()
        predict = rospy.ServiceProxy('toy/predict_field', PredictField)
        answer = predict(names=[], points=[Point(0, 0, 0), Point(1, 1, 0)])
        self.assertTrue(answer.success)
        self.assertEqual((['light'], 2), (answer.names, len(answer.mean)))
        answer = predict(names=['smell'], points=[])
        self.assertFalse(answer.success)
        self.assertIn('light', answer.message)
        self.assertFalse(rospy.ServiceProxy('toy/save_state', SaveState)('../x').success)
        self.assertTrue(rospy.ServiceProxy('toy/pause', SetBool)(True).success)
        self.assertTrue(rospy.ServiceProxy('toy/pause', SetBool)(False).success)
        rospy.ServiceProxy('global_localization', Empty)()
        self.wait(lambda: self.poses and self.poses[-1].pose.covariance[0] >= 100.0)
        rospy.ServiceProxy('toy/reset', Empty)()
        self.wait(lambda: self.poses[-1].pose.covariance[0] == 1.0)


if __name__ == '__main__':
    rospy.init_node('toy_node_test')
    rostest.rosrun('field_ros', 'toy_node', ToyNode)
