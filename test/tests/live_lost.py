#!/usr/bin/python3
"""Lost and found: the kidnapped robot, the verdict in /diagnostics, automatic recovery."""
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
from field_msgs.srv import SaveState
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Empty

from support import messages, recordings
from support.live import Diagnostics, start_test_node, wait_for
from support.robot import TwoFieldRobot
from support.runner import main

ERROR = 2  # diagnostic_msgs/DiagnosticStatus
MOST_ERROR_M = 0.6
# Enough particles to be found again among all poses of 10 m x 10 m, and gp_localize's own verdict (it takes
# precedence over the node's) from three seconds. Its own recovery is off: the node's is tested.
KNOWN_MAP = recordings.tiny_config(particles=1500, mode="localization", support={"size": 49},
                                   fields={"sound": {"mean": 40.0, "signal_stddev": 3.0, "noise_stddev": 0.3,
                                                     "length_scales": [1.5, 1.5]}},
                                   lost={"nis": 3.0, "window": 6, "recovery_share": 0.0})


def survey(folder):
    """Both fields everywhere in the region. Where nothing is known, nothing contradicts a pose."""
    file = pathlib.Path(folder) / "survey.csv"
    places = [(x / 2.0, y / 2.0) for x in range(-10, 11) for y in range(-10, 11)]
    file.write_text("x_m,y_m,light,sound\n" + "".join(
        f"{x},{y},{recordings.light_at(x, y)},{recordings.sound_at(x, y)}\n" for x, y in places))
    return file


class Lost(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        """That map as a state, which the robots of the tests load."""
        cls.folder = tempfile.mkdtemp(prefix="field_system_tests_")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        surveyor = TwoFieldRobot(KNOWN_MAP, state_directory=cls.folder, survey=str(survey(cls.folder)))
        answer = surveyor.node.service("save_state", SaveState)(name="map")
        surveyor.node.stop()
        if not answer.success:
            raise AssertionError(answer.message)

    def setUp(self):
        self.robot = TwoFieldRobot(KNOWN_MAP, state_directory=self.folder, load_state="map",
                           recovery="recovers" in self.id())
        self.addCleanup(self.robot.node.stop)
        self.diagnostics = Diagnostics(self.robot.node.name)
        self.robot.drive(20.0)
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        self.assertLess(self.robot.errors(self.robot.start + 10.0).max(), MOST_ERROR_M)

    def kidnap(self):
        """To the other side of the circle, while nobody looks."""
        self.robot.kidnapped_s = 10.0
        self.robot.drive(10.0)

    def found(self):
        """The last second's errors after another lap."""
        self.robot.drive(40.0)
        return self.robot.errors(self.robot.now() - 2.0)

    def test_a_kidnapped_robot_is_called_lost_until_it_is_told_where_it_is(self):
        self.kidnap()
        report = self.diagnostics.next_report()
        self.assertNotEqual(report["lost"], "no", report)
        level, text, _ = self.diagnostics.reports()[-1]["estimator"]
        self.assertEqual(level, ERROR)
        self.assertIn("/initialpose", text)
        initialpose = self.robot.node.publisher("initialpose", PoseWithCovarianceStamped)
        initialpose.publish(messages.initialpose(self.robot.now(), *self.robot.truth(self.robot.driven)))
        wait_for(lambda: self.diagnostics.values()["lost"] == "no", "the verdict to be taken back")
        since = self.robot.now()
        self.robot.drive(5.0)
        self.assertLess(self.robot.errors(since + 0.1).max(), MOST_ERROR_M)

    def test_global_localization_finds_the_kidnapped_robot(self):
        self.kidnap()
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
    start_test_node("live_lost")
    main("live_lost")
