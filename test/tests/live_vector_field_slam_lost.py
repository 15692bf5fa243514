#!/usr/bin/python3
"""A robot kidnapped on a loaded map: vector_field_slam says so, searches the map and is right again."""
import shutil
import tempfile
import unittest

import numpy as np
import yaml
from field_msgs.srv import SaveState

from support.live import Diagnostics, start_test_node
from support.robot import TwoFieldRobot
from support.runner import main

ERROR = 2  # diagnostic_msgs/DiagnosticStatus
MOST_ERROR_M = 0.6
CONFIGURATION = yaml.safe_dump({
    "cell_size": 0.5, "sensor_model": "scalar", "start_measurements": 4,
    "channels": {name: {"noise_stddev": 0.1, "interpolation_stddev": 0.1, "prior_stddev": 3.0}
                 for name in ("light", "sound")},
    "odom_alpha1": 0.01, "odom_alpha2": 0.01, "odom_alpha3": 0.01, "odom_alpha4": 0.01})


class Lost(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """The map of three laps as a state, which the robot of the test loads."""
        cls.folder = tempfile.mkdtemp(prefix="field_system_tests_")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        surveyor = TwoFieldRobot(CONFIGURATION, estimator="vector_field_slam", state_directory=cls.folder)
        surveyor.drive(60.0)
        answer = surveyor.node.service("save_state", SaveState)(name="map")
        surveyor.node.stop()
        if not answer.success:
            raise AssertionError(answer.message)

    def setUp(self):
        self.robot = TwoFieldRobot(CONFIGURATION, estimator="vector_field_slam", state_directory=self.folder,
                                   load_state="map", localize_only=True)
        self.addCleanup(self.robot.node.stop)
        self.diagnostics = Diagnostics(self.robot.node.name)
        self.robot.drive(20.0)
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        self.assertLess(self.robot.errors(self.robot.start + 10.0).max(), MOST_ERROR_M)

    def test_a_kidnapped_robot_is_called_lost_and_found_again(self):
        self.robot.kidnapped_s = 10.0  # to the other side of the circle, while nobody looks
        for _ in range(20):
            self.robot.drive(1.0)
            if self.diagnostics.next_report()["lost"] != "no":
                break
        level, text, values = self.diagnostics.reports()[-1]["estimator"]
        self.assertEqual(level, ERROR, values)
        self.assertIn("lost: searching the map", text)
        self.robot.drive(40.0)
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        errors = self.robot.errors(self.robot.now() - 5.0)
        print("errors after the search", np.round(errors, 2))
        self.assertLess(errors.max(), MOST_ERROR_M)


if __name__ == "__main__":
    start_test_node("live_vector_field_slam_lost")
    main("live_vector_field_slam_lost")
