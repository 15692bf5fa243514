#!/usr/bin/python3
"""rosbag play --clock of the beacons into field_launch's vector_field_slam.launch: topics, tf, services, errors.

The node is started by launch/live_vector_field_slam.test. One playing, in setUpClass; the cases look at what came.
"""
import unittest

import numpy as np
import tf2_ros
import yaml
import rospy
from field_msgs.msg import FieldMap
from field_msgs.srv import PredictField
from geometry_msgs.msg import Point, PoseWithCovarianceStamped
from nav_msgs.msg import Path
from visualization_msgs.msg import MarkerArray

from support import trajectories, workspace
from support.live import Collector, Diagnostics, Process, published_topics, start_test_node, wait_for
from support.robot import check_pose
from support.runner import main

BAG, NODE = "beacons", "/vector_field_slam"
RATE, SECONDS = 20, 300
# Replays of these 300 s: see test_vector_field_slam_bags.
MEAN_ERROR_M, MOST_ERROR_M = (0.01, 0.3), 0.9


class LiveVectorFieldSlam(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.fields = list(yaml.safe_load(workspace.config(BAG, estimator=NODE[1:]).read_text())["channels"])
        cls.truth = trajectories.from_bag(workspace.bag(BAG), "/ground_truth")
        cls.collectors = {name: Collector(NODE + "/" + name, message_type) for name, message_type in (
            ("pose", PoseWithCovarianceStamped), ("path", Path), ("vectors", MarkerArray))}
        cls.diagnostics = Diagnostics(NODE[1:])
        cls.buffer = tf2_ros.Buffer(rospy.Duration(1000))
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        for collector in cls.collectors.values():
            connections = collector.subscriber.get_num_connections
            wait_for(lambda: connections() > 0, "the node's topics")
        player = Process(*"rosrun rosbag play --clock --quiet --rate".split(), RATE, "--duration", SECONDS,
                         workspace.bag(BAG))
        code, _, err = player.finish(timeout=240)
        if code != 0:
            raise AssertionError(err)
        end = cls.truth[0, 0] + SECONDS - 3.0
        wait_for(lambda: cls.poses()[-1].header.stamp.to_sec() > end, "the last poses")
        cls.diagnostics.next_report()

    @classmethod
    def poses(cls):
        return cls.collectors["pose"].wait()

    def test_every_topic_has_its_type(self):
        wanted = {NODE + "/pose": "geometry_msgs/PoseWithCovarianceStamped", NODE + "/path": "nav_msgs/Path",
                  NODE + "/field_map": "field_msgs/FieldMap", NODE + "/cloud": "sensor_msgs/PointCloud2",
                  NODE + "/vectors": "visualization_msgs/MarkerArray", "/tf": "tf2_msgs/TFMessage",
                  "/diagnostics": "diagnostic_msgs/DiagnosticArray"}
        for field in self.fields:
            wanted[f"{NODE}/grid/{field}"] = wanted[f"{NODE}/grid/{field}_stddev"] = "nav_msgs/OccupancyGrid"
        published = published_topics()
        self.assertEqual({t: published.get(t) for t in wanted}, wanted)

    def test_all_poses_are_sound_and_near_the_truth(self):
        poses = self.poses()
        self.assertGreater(len(poses), 0.95 * 2 * SECONDS)  # two measurements a second
        for message in poses:
            check_pose(self, message)
        rows = np.array([[m.header.stamp.to_sec(), m.pose.pose.position.x, m.pose.pose.position.y] for m in poses])
        self.assertTrue((np.diff(rows[:, 0]) > 0).all())
        errors = trajectories.position_errors(self.truth, rows)
        print(f"mean {errors.mean():.3f} m, largest {errors.max():.3f} m, final {errors[-1]:.3f} m")
        self.assertGreater(errors.mean(), MEAN_ERROR_M[0])
        self.assertLess(errors.mean(), MEAN_ERROR_M[1])
        self.assertLess(errors.max(), MOST_ERROR_M)

    def test_tf_leads_from_map_to_base_link(self):
        found = self.buffer.lookup_transform("map", "base_link", rospy.Time(0))
        there = trajectories.at(self.truth, [found.header.stamp.to_sec()])[0][:2]
        t = found.transform.translation
        self.assertLess(np.hypot(t.x - there[0], t.y - there[1]), MOST_ERROR_M)

    def test_a_map_of_every_channel_and_its_nodes(self):
        maps = Collector(NODE + "/field_map", FieldMap)
        wait_for(lambda: {m.name for m in maps.all()} == set(self.fields), "a map of every channel")
        for message in maps.all():
            variance = np.array(message.variance)
            self.assertTrue(np.isfinite(message.mean).all() and (variance > 0).all())
        markers = self.collectors["vectors"].wait()[-1].markers
        self.assertGreater(len(markers), 0)
        self.assertTrue(all(m.header.frame_id == "map" for m in markers))

    def test_predict_field(self):
        rospy.wait_for_service(NODE + "/predict_field", timeout=30)
        x, y = (getattr(self.poses()[-1].pose.pose.position, a) for a in "xy")
        answer = rospy.ServiceProxy(NODE + "/predict_field", PredictField)(names=[], points=[Point(x, y, 0.0)])
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(sorted(answer.names), sorted(self.fields))
        # Where the robot is, the map is known to little more than the noise (0.01) and the bend of a cell.
        self.assertTrue(all(0.0 < v < 0.2**2 for v in answer.variance), answer.variance)

    def test_diagnostics(self):
        values = self.diagnostics.values()
        self.assertEqual(values["lost"], "no")
        self.assertEqual(int(values["numerical errors"]), 0)
        self.assertGreater(int(values["applied"]), 0.9 * 2 * SECONDS)


if __name__ == "__main__":
    start_test_node("live_vector_field_slam")
    main("live_vector_field_slam")
