#!/usr/bin/python3
"""~pause, /initialpose, global_localization and ~reset of vector_field_slam and gmrf_slap (gp_localize's: live_services)."""
import unittest

import numpy as np
import yaml
from field_msgs.srv import PredictField
from geometry_msgs.msg import Point, PoseWithCovarianceStamped
from std_srvs.srv import Empty, SetBool

from support import messages, recordings
from support.live import Diagnostics, start_test_node, wait_for
from support.robot import Robot, covariance_of
from support.runner import main

MOST_ERROR_M = 0.6
ODOMETRY = {f"odom_alpha{i}": 0.01 for i in (1, 2, 3, 4)}
START = {"initial_cov_xx": 0.01, "initial_cov_yy": 0.01, "initial_cov_aa": 0.001}
CONFIGURATIONS = {
    "vector_field_slam": yaml.safe_dump({
        "cell_size": 0.5, "sensor_model": "scalar", "start_measurements": 4,
        "channels": {"light": {"noise_stddev": 0.1, "interpolation_stddev": 0.1, "prior_stddev": 3.0}}, **ODOMETRY}),
    "gmrf_slap": yaml.safe_dump({
        "fields": {"light": {"mean": 5.0, "measurement_stddev": 0.2,
                             "hyperparameters": [{"bandwidth": 2.0, "stddev": 2.0}]}},
        "grid": {"origin": [-5.0, -3.0], "spacing": 0.5, "size": [21, 21]}, "lag": 10, **ODOMETRY, **START})}


class Controls:
    """The cases; a class below for each node."""
    estimator = None

    def setUp(self):
        self.robot = Robot(CONFIGURATIONS[self.estimator], estimator=self.estimator)
        self.addCleanup(self.robot.node.stop)
        self.robot.drive(25.0)
        self.assertLess(self.robot.errors().max(), MOST_ERROR_M)

    def variance(self, seconds):
        x, y, _ = recordings.circle(seconds)
        answer = self.robot.node.service("predict_field", PredictField)(names=[], points=[Point(x, y, 0.0)])
        self.assertTrue(answer.success, answer.message)
        return answer.variance[0]

    def spread(self):
        return np.sqrt(np.trace(covariance_of(self.robot.poses.last())[:2, :2]))

    def test_pause_keeps_the_map_and_follows_odometry(self):
        pause, diagnostics = self.robot.node.service("pause", SetBool), Diagnostics(self.robot.node.name)
        self.assertTrue(pause(data=True).success)
        before, learned = diagnostics.next_report()["applied"], self.variance(10.0)
        for tick in range(1, 51):
            self.robot.odom.publish(messages.odometry(self.robot.now() + tick / 10.0,
                                                      *recordings.circle(self.robot.driven + tick / 10.0)))
        self.robot.measure(self.robot.driven + 4.95)
        wait_for(lambda: diagnostics.dropped().get("paused", 0) == 1, "the measurement to be dropped")
        self.assertEqual((diagnostics.next_report()["applied"], self.variance(10.0)), (before, learned))
        self.robot.driven += 5.0
        self.assertTrue(pause(data=False).success)
        self.robot.drive(10.0)
        self.assertLess(self.robot.errors(self.robot.now() - 5.0).max(), MOST_ERROR_M)

    def test_initialpose_moves_the_robot_and_keeps_the_map(self):
        known = self.variance(10.0)
        publisher = self.robot.node.publisher("initialpose", PoseWithCovarianceStamped)
        publisher.publish(messages.initialpose(self.robot.now(), 1.25, 2.5, 0.4, variance=0.04))

        def moved():
            p = self.robot.poses.last().pose.pose.position
            return np.hypot(p.x - 1.25, p.y - 2.5) < 0.15
        wait_for(moved, "the pose that was given")
        self.assertLess(self.variance(10.0), 2.0 * known)

    def test_global_localization_gives_the_pose_up(self):
        before = self.spread()
        self.robot.node.service("global_localization", Empty)()
        wait_for(lambda: self.spread() > 1.0 > before, lambda: f"a wide belief; its spread is {self.spread()}")

    def test_reset_forgets_map_and_pose(self):
        learned, diagnostics = self.variance(10.0), Diagnostics(self.robot.node.name)
        self.robot.node.service("reset", Empty)()
        wait_for(lambda: self.variance(10.0) > 5.0 * learned, "the map to be forgotten")
        self.robot.restart_clock(self.robot.start + 1000.0)
        diagnostics.next_report()  # odometry has come by then, which measurements could overtake
        self.robot.drive(10.0)
        self.assertLess(self.robot.errors().max(), MOST_ERROR_M)


class VectorFieldSlam(Controls, unittest.TestCase):
    estimator = "vector_field_slam"


class GmrfSlap(Controls, unittest.TestCase):
    estimator = "gmrf_slap"


if __name__ == "__main__":
    start_test_node("live_controls")
    main("live_controls")
