#!/usr/bin/python3
"""gmrf_slap lost and found on a loaded map: the kidnapped robot, the verdict, global localization, recovery."""
import shutil
import tempfile
import unittest

import numpy as np
import yaml
from field_msgs.srv import SaveState
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Empty

from support import messages
from support.live import Diagnostics, start_test_node, wait_for
from support.robot import TwoFieldRobot
from support.runner import main

MOST_ERROR_M = 0.6
CONFIG = yaml.safe_dump({
    "fields": {
        "light": {"mean": 5.0, "measurement_stddev": 0.2, "hyperparameters": [{"bandwidth": 2.0, "stddev": 2.0}]},
        "sound": {"mean": 40.0, "measurement_stddev": 0.3, "hyperparameters": [{"bandwidth": 2.0, "stddev": 3.0}]}},
    "grid": {"origin": [-5.0, -3.0], "spacing": 0.5, "size": [21, 21]},
    "particles": 1500, "lag": 10, "likelihood_noise_scale": 2.0,
    "odom_alpha1": 0.01, "odom_alpha2": 0.01, "odom_alpha3": 0.01, "odom_alpha4": 0.01,
    "initial_cov_xx": 0.01, "initial_cov_yy": 0.01, "initial_cov_aa": 0.001, "lost_window": 6})


class Lost(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """Two laps make the map, which the robots of the tests load."""
        cls.folder = tempfile.mkdtemp(prefix="field_system_tests_")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        surveyor = TwoFieldRobot(CONFIG, estimator="gmrf_slap", state_directory=cls.folder)
        surveyor.drive(40.0)
        answer = surveyor.node.service("save_state", SaveState)(name="map")
        surveyor.node.stop()
        if not answer.success:
            raise AssertionError(answer.message)

    def setUp(self):
        self.robot = TwoFieldRobot(CONFIG, estimator="gmrf_slap", state_directory=self.folder, load_state="map",
                                   recovery="recovers" in self.id())
        self.addCleanup(self.robot.node.stop)
        self.diagnostics = Diagnostics(self.robot.node.name)
        self.robot.drive(20.0)
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        self.assertLess(self.robot.errors(self.robot.start + 10.0).max(), MOST_ERROR_M)

    def kidnap(self, seconds=10.0):
        """To the other side of the circle, while nobody looks."""
        self.robot.kidnapped_s = 10.0
        self.robot.drive(seconds)

    def found(self):
        """The last seconds' errors after two more laps."""
        self.robot.drive(40.0)
        return self.robot.errors(self.robot.now() - 2.0)

    def test_a_kidnapped_robot_is_called_lost_until_it_is_told_where_it_is(self):
        # Not for long: a robot that maps learns the fields anew where it believes to be, and no longer looks lost.
        self.kidnap(2.0)
        report = self.diagnostics.next_report()
        self.assertNotEqual(report["lost"], "no", report)
        initialpose = self.robot.node.publisher("initialpose", PoseWithCovarianceStamped)
        initialpose.publish(messages.initialpose(self.robot.now(), *self.robot.truth(self.robot.driven)))
        wait_for(lambda: self.diagnostics.values()["lost"] == "no", "the verdict to be taken back")
        since = self.robot.now()
        self.robot.drive(5.0)
        self.assertLess(self.robot.errors(since + 0.1).max(), MOST_ERROR_M)

    def test_global_localization_finds_the_kidnapped_robot(self):
        self.kidnap(4.0)
        self.robot.node.service("global_localization", Empty)()
        errors = self.found()
        print("errors after global_localization", np.round(errors, 2))
        self.assertLess(errors.max(), MOST_ERROR_M)

    def test_it_recovers_by_itself(self):
        self.kidnap()
        errors = self.found()
        print("errors after recovery", np.round(errors, 2), self.diagnostics.next_report()["recoveries"])
        self.assertGreaterEqual(self.diagnostics.count("recoveries"), 1)
        self.assertLess(errors.max(), MOST_ERROR_M)


if __name__ == "__main__":
    start_test_node("live_lost_gmrf_slap")
    main("live_lost_gmrf_slap")
