#!/usr/bin/python3
"""The rviz configuration of vector_field_slam over a magnetic bag: arrows and their ellipses are there, by their pixels.

The node is started by launch/live_rviz_vectors.test.
"""
import pathlib
import tempfile
import unittest

from geometry_msgs.msg import PoseWithCovarianceStamped
from visualization_msgs.msg import Marker, MarkerArray

from support import workspace
from support.live import Collector, Process, start_test_node, wait_for
from support.runner import main
from support.screen import FIELD, Screen, at_least, config, see_alone, wait_for_pixels

ARROWS = (255, 120, 89)
PATH = (0, 220, 220)
# Least pixels of each display alone.
LAYERS = {"Field": 20000, "Field standard deviation": 20000, "Field as points": 5000, "Path": 150, "Pose": 100,
          "Ground truth": 100, "Vectors and ellipses": 300}


class RvizVectors(unittest.TestCase):
    def test_vector_field_slam(self):
        screen = Screen()
        self.addCleanup(screen.stop)
        poses = Collector("/vector_field_slam/pose", PoseWithCovarianceStamped)
        vectors = Collector("/vector_field_slam/vectors", MarkerArray)
        player = Process("rosrun", "rosbag", "play", "--clock", "--quiet", "--rate", "20", "--delay", "1", "--loop",
                         workspace.bag("warehouse_magnetic"))
        self.addCleanup(player.stop)
        wait_for(lambda: len(poses.all()) > 5, "the node to begin")
        rviz = screen.rviz(config("vector_field_slam"))
        self.addCleanup(rviz.stop)
        wait_for_pixels(screen, {**FIELD, "path": at_least(150, PATH, 40), "arrows": at_least(300, ARROWS, 60)})
        rviz.stop()
        with tempfile.TemporaryDirectory(prefix="field_system_tests_") as folder:
            for layer, count in LAYERS.items():
                with self.subTest(layer):
                    see_alone(screen, "vector_field_slam", layer, count, pathlib.Path(folder))
        shown = [m for message in vectors.all() for m in message.markers]
        arrows = [m for m in shown if m.ns == "mag" and m.type == Marker.ARROW]
        ellipses = [m for m in shown if m.ns == "mag 90 %"]
        self.assertGreater(len(arrows), 10)
        self.assertEqual({(m.id, m.header.stamp) for m in arrows}, {(m.id, m.header.stamp) for m in ellipses})
        self.assertTrue(all(m.header.frame_id == "map" for m in arrows))


if __name__ == "__main__":
    start_test_node("live_rviz_vectors")
    main("live_rviz_vectors")
