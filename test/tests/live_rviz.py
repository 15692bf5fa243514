#!/usr/bin/python3
"""rviz configurations, rendered without a screen over a bag: are all layers there, by their pixels?

The nodes are started by launch/live_rviz.test.
"""
import pathlib
import tempfile
import unittest

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped

from support import workspace
from support.live import Collector, Process, start_test_node, wait_for
from support.runner import main
from support.screen import (BACKGROUND, FIELD, LEGEND, Screen, at_least, config, drawn, near, only, see_alone,
                            wait_for_pixels)

BAG = "office_wifi"
TRUTH = (255, 255, 255)
PATHS = {"gp_localize": (255, 140, 0), "gmrf_slap": (230, 90, 230), "vector_field_slam": (0, 220, 220)}


# Least pixels of each display alone: a particle is a few, a pose about 300, a map several 10,000.
LAYERS = {"gp_localize": {"Field": 20000, "Field standard deviation": 20000, "Field as points": 5000, "Particles": 20,
                          "Path": 150, "Pose": 100, "Ground truth": 100, "Vectors and ellipses": 50},
          "gmrf_slap": {"Field": 20000, "Field standard deviation": 20000, "Field as points": 5000,
                        "Candidate positions": 20, "Path": 150, "Pose": 100, "Ground truth": 100,
                        "Vectors and ellipses": 50},
          "compare": {f"{what} of {node}": count for node in PATHS
                      for what, count in (("Field", 20000), ("Path", 150), ("Pose", 100))}}


class Rviz(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="field_system_tests_")
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.screen = Screen()
        cls.addClassCleanup(cls.screen.stop)
        poses = Collector("/gp_localize/pose", PoseWithCovarianceStamped)
        # Again and again: rviz gets a path only while the robot drives.
        player = Process("rosrun", "rosbag", "play", "--clock", "--quiet", "--rate", "20", "--delay", "1", "--loop",
                         workspace.bag(BAG))
        cls.addClassCleanup(player.stop)
        wait_for(lambda: len(poses.all()) > 5, "the nodes to begin")

    def shown(self, name, **layers):
        rviz = self.screen.rviz(config(name))
        self.addCleanup(rviz.stop)
        image = wait_for_pixels(self.screen, {**FIELD, "truth": at_least(30, TRUTH, 45), **layers})
        self.assertEqual(image.shape, (900, 1400, 3))
        return image

    def test_gp_localize(self):
        image = self.shown("gp_localize", path=at_least(150, PATHS["gp_localize"], 40),
                           particles=at_least(20, (255, 85, 0), 30))
        text = near(image[LEGEND], (235, 235, 235), 30)
        self.assertGreater(int(text.sum()), 150, "the legend has neither name nor numbers")
        self.assertTrue(np.any(text[:40]), "the legend has no title")

    def test_each_layer_alone(self):
        """Pixels of one display are not taken for those of another."""
        for name, layers in LAYERS.items():
            for layer, count in layers.items():
                with self.subTest(f"{name}: {layer}"):
                    see_alone(self.screen, name, layer, count, self.folder)

    def test_without_layers_the_ground_is_empty(self):
        rviz = self.screen.rviz(only("gp_localize", None, self.folder))
        self.addCleanup(rviz.stop)
        image = wait_for_pixels(self.screen, {"ground": at_least(1000000, BACKGROUND)})
        self.assertFalse(drawn(1)(image), "what test_each_layer_alone sees is not the layer's")

    def test_gmrf_slap(self):
        self.shown("gmrf_slap", path=at_least(150, PATHS["gmrf_slap"], 40), candidates=at_least(20, (255, 85, 0), 30))

    def test_compare(self):
        self.shown("compare", **{f"path of {n}": at_least(100, PATHS[n], 40) for n in PATHS})


if __name__ == "__main__":
    start_test_node("live_rviz")
    main("live_rviz")
