#!/usr/bin/python3
"""Time that jumps back, as when a bag is played in a loop, starts the node again: cleanly."""
import unittest

from field_msgs.srv import PredictField
from geometry_msgs.msg import Point
from nav_msgs.msg import Path

from support.live import Collector, Diagnostics, start_test_node, wait_for
from support.robot import Robot
from support.runner import main

MOST_ERROR_M = 0.6


def stamps_and_poses(poses):
    return [(m.header.stamp.to_nsec(), m.pose.pose.position.x, m.pose.pose.position.y,
             m.pose.pose.orientation.z, tuple(m.pose.covariance)) for m in poses]


class Clock(unittest.TestCase):
    def start(self, stamp=100.0):
        self.robot = Robot(start=stamp)
        self.addCleanup(self.robot.node.stop)
        self.diagnostics = Diagnostics(self.robot.node.name)

    def restart(self, stamp, resets):
        self.robot.restart_clock(stamp)
        wait_for(lambda: self.diagnostics.count("clock resets") == resets, f"{resets} resets in /diagnostics")

    def variance_at(self, x, y):
        predict = self.robot.node.service("predict_field", PredictField)
        answer = predict(names=["light"], points=[Point(x, y, 0.0)])
        self.assertTrue(answer.success, answer.message)
        return answer.variance[0]

    def test_a_looped_recording_gives_the_same_poses_again(self):
        self.start()
        never_visited, prior = (4.5, -4.5), self.variance_at(0.0, 4.0)
        self.robot.drive(20.0)
        first = stamps_and_poses(self.robot.poses.all())
        learned = self.variance_at(0.0, 4.0)
        self.assertLess(learned, 0.5 * prior, "nothing was learned on the way")
        self.assertGreater(self.variance_at(*never_visited), 2.0 * learned)
        for loop in (1, 2):
            with self.subTest(loop=loop):
                self.restart(100.0, resets=loop)
                self.robot.drive(19.9)
                again = stamps_and_poses(self.robot.received())
                # A reset starts from the same seed: not similar, the same.
                self.assertEqual(again, first)
        self.assertEqual(self.diagnostics.next_report()["clock resets"], "2")
        self.assertEqual(self.diagnostics.dropped(), {})

    def test_an_earlier_clock_and_a_path_without_the_old_poses(self):
        self.start()
        paths = Collector(self.robot.node.topic("path"), Path)
        wait_for(lambda: paths.subscriber.get_num_connections() > 0, "~path")
        self.robot.drive(10.0)
        wait_for(lambda: paths.last() and len(paths.last().poses) >= 20, "a path of 20 poses")
        self.restart(50.0, resets=1)
        self.robot.drive(5.0)
        self.assertEqual(len(self.robot.errors()), 10)
        self.assertLess(self.robot.errors().max(), MOST_ERROR_M)
        newest = wait_for(lambda: paths.last().header.stamp.to_sec() < 60.0 and paths.last(), "a path of the new clock")
        self.assertTrue(all(50.0 <= p.header.stamp.to_sec() < 60.0 for p in newest.poses))

    def test_a_clock_that_starts_at_zero(self):
        self.start(stamp=0.0)
        self.robot.drive(5.0)
        self.assertEqual(len(self.robot.errors()), 10)
        self.assertLess(self.robot.errors().max(), MOST_ERROR_M)
        self.assertEqual(self.diagnostics.next_report()["clock resets"], "0")
        self.assertEqual(self.diagnostics.dropped(), {})


if __name__ == "__main__":
    start_test_node("live_clock")
    main("live_clock")
