#!/usr/bin/python3
"""A robot kidnapped on a loaded map: vector_field_slam says so, searches the map and is right again."""
import unittest

import yaml

from support.kidnapped import ERROR, MOST_ERROR_M, OnKnownMap
from support.live import start_test_node
from support.runner import main


class VectorFieldSlam(OnKnownMap, unittest.TestCase):
    estimator = "vector_field_slam"
    survey_s = 60.0  # three laps
    parameters = {"localize_only": True}
    configuration = yaml.safe_dump({
        "cell_size": 0.5, "sensor_model": "scalar", "start_measurements": 4,
        "channels": {name: {"noise_stddev": 0.1, "interpolation_stddev": 0.1, "prior_stddev": 3.0}
                     for name in ("light", "sound")},
        "odom_alpha1": 0.01, "odom_alpha2": 0.01, "odom_alpha3": 0.01, "odom_alpha4": 0.01})

    def test_a_kidnapped_robot_is_called_lost_and_found_again(self):
        self.kidnap(1.0)
        for _ in range(19):
            if self.diagnostics.next_report()["lost"] != "no":
                break
            self.robot.drive(1.0)
        level, text, values = self.diagnostics.reports()[-1]["estimator"]
        self.assertEqual(level, ERROR, values)
        self.assertIn("lost: searching the map", text)
        errors = self.found(last_s=5.0)
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        self.assertLess(errors.max(), MOST_ERROR_M)


if __name__ == "__main__":
    start_test_node("live_vector_field_slam_lost")
    main("live_vector_field_slam_lost")
