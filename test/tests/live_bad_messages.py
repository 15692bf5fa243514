#!/usr/bin/python3
"""Bad messages: the node lives on, localizes on, and counts each by its reason in /diagnostics."""
import unittest

from geometry_msgs.msg import PoseWithCovarianceStamped

from support import messages, recordings
from support.live import Diagnostics, start_test_node, wait_for
from support.robot import Robot
from support.runner import main

NAN, INF = float("nan"), float("inf")
# On exact odometry and a known start the filter stays within a few standard deviations (0.1 m) of it.
MOST_ERROR_M = 0.6


class BadMessages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # A frame that tf does not know is given up at once.
        cls.robot = Robot(sensor_transform_timeout=0.0)
        cls.initialpose = cls.robot.node.publisher("initialpose", PoseWithCovarianceStamped)
        cls.expected = {}
        cls.diagnostics = Diagnostics(cls.robot.node.name)
        cls.robot.drive(10.0)

    @classmethod
    def tearDownClass(cls):
        cls.robot.node.stop()

    def send(self, publisher, message, reason, copies=3):
        """Sends copies of a bad message, which are to be counted under this reason, and goes on."""
        for _ in range(copies):
            publisher.publish(message)
        self.expected[reason] = self.expected.get(reason, 0) + copies
        with self.subTest(reason):
            self.goes_on()

    def tearDown(self):
        """All that was dropped since the start of the node, and nothing else, is in the report."""
        dropped = self.diagnostics.dropped
        wait_for(lambda: dropped() == self.expected, lambda: f"{self.expected} in /diagnostics; it says {dropped()}",
                 timeout=10.0)

    def goes_on(self):
        since = self.robot.now()
        self.robot.drive(2.0)
        self.assertEqual(len(self.robot.errors(since + 0.01)), 4)
        self.assertLess(self.robot.errors(since).max(), MOST_ERROR_M)
        self.robot.check_poses(self, since)

    def odometry(self, **position):
        """The odometry message that would come next."""
        time = self.robot.driven + 0.1
        message = messages.odometry(self.robot.start + time, *recordings.circle(time))
        for name, value in position.items():
            setattr(message.pose.pose.position, name, value)
        return message

    def measurement(self, **fields):
        return messages.measurement(self.robot.now(), **(fields or {"light": 5.0}))

    def test_odometry_poses(self):
        self.send(self.robot.odom, self.odometry(x=NAN), "non_finite_pose")
        self.send(self.robot.odom, self.odometry(y=-INF), "non_finite_pose")
        message = self.odometry()
        message.pose.pose.orientation.z = NAN
        self.send(self.robot.odom, message, "non_finite_pose")

    def test_odometry_quaternions(self):
        for scale in (0.0, 0.5, 2.0):
            message = self.odometry()
            message.pose.pose.orientation.z *= scale
            message.pose.pose.orientation.w *= scale
            self.send(self.robot.odom, message, "bad_quaternion")

    def test_odometry_frames(self):
        message = self.odometry()
        message.header.frame_id = "wheel_odom"
        self.send(self.robot.odom, message, "unknown_frame")
        message = self.odometry()
        message.child_frame_id = "trailer"
        self.send(self.robot.odom, message, "unknown_frame")

    def test_odometry_covariances(self):
        for value in (NAN, -1.0):
            message = self.odometry()
            message.pose.covariance = [value] * 36
            self.send(self.robot.odom, message, "bad_covariance")

    def test_odometry_stamps(self):
        # Slightly back: out of order. One message far back or ahead: a stray, not a restarted clock.
        self.send(self.robot.odom, messages.odometry(self.robot.now() - 0.3), "odometry_out_of_order")
        self.send(self.robot.odom, messages.odometry(self.robot.start - 50.0), "odometry_stray_stamp", copies=1)
        self.send(self.robot.odom, messages.odometry(1e6), "odometry_stray_stamp", copies=1)
        self.assertEqual(self.diagnostics.count("clock resets"), 0)

    def test_measurement_frame(self):
        message = self.measurement()
        message.header.frame_id = "no_such_sensor"
        self.send(self.robot.field, message, "unknown_frame")

    def test_empty_measurements(self):
        message = self.measurement()
        message.names, message.values = [], []
        self.send(self.robot.field, message, "empty_measurement")
        self.send(self.robot.field, self.measurement(light=NAN), "nothing_observed")
        self.send(self.robot.field, self.measurement(humidity=40.0), "no_known_field")

    def test_array_lengths(self):
        for values, variances in (([], []), ([1.0, 2.0], []), ([5.0], [0.1, 0.1])):
            message = self.measurement()
            message.values, message.variances = values, variances
            self.send(self.robot.field, message, "length_mismatch")

    def test_a_million_fields(self):
        message = self.measurement()
        message.names = [f"f{i}" for i in range(10**6)]
        message.values = [1.0] * 10**6
        self.send(self.robot.field, message, "too_many_fields", copies=1)
        message.names = ["light"]
        self.send(self.robot.field, message, "too_many_fields", copies=1)

    def test_values(self):
        self.send(self.robot.field, self.measurement(light=INF), "infinite_value")
        self.send(self.robot.field, self.measurement(light=5.0, humidity=-INF), "infinite_value")
        message = self.measurement()
        message.names, message.values = ["light", "light"], [5.0, 6.0]
        self.send(self.robot.field, message, "duplicate_field")

    def test_variances(self):
        for variance in (-0.1, NAN, INF):
            message = self.measurement()
            message.variances = [variance]
            self.send(self.robot.field, message, "negative_variance")

    def test_measurement_stamps(self):
        self.send(self.robot.field, messages.measurement(self.robot.now() - 5.0, light=5.0),
                  "older_than_processed")
        self.send(self.robot.field, messages.measurement(0.0, light=5.0), "zero_stamp")

    def test_initialposes(self):
        x, y, yaw = recordings.circle(self.robot.driven)
        self.send(self.initialpose, messages.initialpose(self.robot.now(), NAN, y, yaw), "non_finite_pose", 1)
        self.send(self.initialpose, messages.initialpose(self.robot.now(), x, y, yaw, -0.1), "bad_covariance", 1)
        message = messages.initialpose(self.robot.now(), x, y, yaw)
        message.pose.covariance = [(-1.0)**i * i for i in range(36)]
        self.send(self.initialpose, message, "bad_covariance", 1)
        message = messages.initialpose(self.robot.now(), x, y, yaw)
        message.header.frame_id = "odom"
        self.send(self.initialpose, message, "unknown_frame", 1)

    def test_reports_say_what_to_do(self):
        known = len(self.diagnostics.reports())
        self.send(self.robot.field, self.measurement(light=INF), "infinite_value", 1)
        wait_for(lambda: any("NaN" in r["input"][1] for r in self.diagnostics.reports()[known:]),
                 "a report that names the remedy for an infinite value")
        report = next(r for r in self.diagnostics.reports()[known:] if "NaN" in r["input"][1])
        self.assertEqual(report["input"][0], 1)  # WARN
        self.assertIn("infinite_value", report["input"][1])


if __name__ == "__main__":
    start_test_node("live_bad_messages")
    main("live_bad_messages")
