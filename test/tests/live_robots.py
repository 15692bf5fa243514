#!/usr/bin/python3
"""Two robots in namespaces, each with a node of its own: topics, services and tf frames do not mix.

The nodes are started by launch/live_robots.test with field_config's gp_localize.yaml (field: light).
"""
import unittest

import numpy as np
import rospy
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from support import messages
from support.live import Collector, Diagnostics, start_test_node, wait_for
from support.runner import main

STEPS = 20


class Robots(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.transforms = Collector("/tf", TFMessage)
        cls.poses, cls.odom, cls.field = {}, {}, {}
        for robot in ("robot1", "robot2"):
            cls.poses[robot] = Collector(f"/{robot}/gp_localize/pose", PoseWithCovarianceStamped)
            cls.odom[robot] = rospy.Publisher(f"/{robot}/odom", Odometry, queue_size=100)
            cls.field[robot] = rospy.Publisher(f"/{robot}/field", FieldMeasurement, queue_size=100)
            wait_for(lambda: cls.odom[robot].get_num_connections() and cls.field[robot].get_num_connections()
                     and cls.poses[robot].subscriber.get_num_connections(), f"the node of {robot}")
        for step in range(STEPS):
            cls.drive("robot1", step, x=0.1 * step)
            cls.drive("robot2", step, x=-0.2 * step)
        for robot in cls.poses:
            cls.poses[robot].wait(STEPS)

    @classmethod
    def drive(cls, robot, step, x):
        odometry = messages.odometry(100.0 + step, x)
        odometry.header.frame_id, odometry.child_frame_id = f"{robot}/odom", f"{robot}/base_link"
        cls.odom[robot].publish(odometry)
        cls.field[robot].publish(messages.measurement(100.0 + step, frame=f"{robot}/base_link", light=7.3))

    def test_each_node_follows_its_own_robot(self):
        for robot, end in (("robot1", 0.1 * (STEPS - 1)), ("robot2", -0.2 * (STEPS - 1))):
            # The start is uncertain by 0.5 m, and the field is flat: the mean has moved by the odometry's way.
            first, last = (self.poses[robot].all()[i].pose.pose.position.x for i in (0, -1))
            self.assertAlmostEqual(last - first, end, delta=0.8)

    def test_one_map_and_an_odometry_frame_for_each(self):
        edges = {(t.header.frame_id, t.child_frame_id) for m in self.transforms.all() for t in m.transforms}
        self.assertEqual(edges, {("map", "robot1/odom"), ("map", "robot2/odom")})

    def test_services_and_diagnostics_are_each_robots_own(self):
        before = np.array(self.poses["robot2"].last().pose.covariance)
        rospy.wait_for_service("/robot1/global_localization", 20.0)
        rospy.ServiceProxy("/robot1/global_localization", Empty)()
        wait_for(lambda: self.poses["robot1"].last().pose.covariance[0] > 10.0, "robot1 to be anywhere")
        np.testing.assert_array_equal(before, self.poses["robot2"].last().pose.covariance)
        for robot in ("robot1", "robot2"):
            diagnostics = Diagnostics(f"{robot}/gp_localize")
            diagnostics.next_report()
            self.assertEqual(diagnostics.dropped(), {})
            self.assertEqual(diagnostics.count("applied"), STEPS)


if __name__ == "__main__":
    start_test_node("live_robots")
    main("live_robots")
