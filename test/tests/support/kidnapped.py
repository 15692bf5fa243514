"""A robot that is put elsewhere on a known map: what the live_lost tests of the nodes share."""
import pathlib
import shutil
import tempfile

import numpy as np
from field_msgs.srv import SaveState
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Empty

from support import messages
from support.live import Diagnostics, wait_for
from support.robot import TwoFieldRobot

ERROR = 2  # diagnostic_msgs/DiagnosticStatus
MOST_ERROR_M = 0.6


class OnKnownMap:
    """A robot on the map of a surveyor, which it loads as a state; after one lap all is well."""

    estimator = None
    configuration = None
    survey_s = 0.0  # how long the surveyor drives
    parameters = {}  # of the robot, beside those of the configuration

    @classmethod
    def survey_parameters(cls):
        """Of the surveyor."""
        return {}

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="field_system_tests_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        surveyor = TwoFieldRobot(cls.configuration, estimator=cls.estimator, state_directory=str(cls.folder),
                                 **cls.survey_parameters())
        if cls.survey_s > 0.0:
            surveyor.drive(cls.survey_s)
        answer = surveyor.node.service("save_state", SaveState)(name="map")
        surveyor.node.stop()
        if not answer.success:
            raise AssertionError(answer.message)

    def setUp(self):
        self.robot = TwoFieldRobot(self.configuration, estimator=self.estimator, state_directory=str(self.folder),
                                   load_state="map", recovery="recovers" in self.id(), **self.parameters)
        self.addCleanup(self.robot.node.stop)
        self.diagnostics = Diagnostics(self.robot.node.name)
        self.robot.drive(20.0)
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        self.assertLess(self.robot.errors(self.robot.start + 10.0).max(), MOST_ERROR_M)

    def kidnap(self, seconds=10.0):
        """To the other side of the circle, while nobody looks; drives on from there."""
        self.robot.kidnapped_s = 10.0
        self.robot.drive(seconds)

    def found(self, last_s=2.0):
        """The last seconds' errors after two more laps."""
        self.robot.drive(40.0)
        errors = self.robot.errors(self.robot.now() - last_s)
        print(self.id(), np.round(errors, 2))
        return errors


class LostAndFound(OnKnownMap):
    """The verdict, and the ways back, through the services and messages that every node has."""

    verdict_s = global_s = 10.0  # driven as a kidnapped robot before the verdict is asked for, before the search

    def test_a_kidnapped_robot_is_called_lost_until_it_is_told_where_it_is(self):
        self.kidnap(self.verdict_s)
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
        self.kidnap(self.global_s)
        self.robot.node.service("global_localization", Empty)()
        self.assertLess(self.found().max(), MOST_ERROR_M)

    def test_it_recovers_by_itself(self):
        self.kidnap()
        self.assertLess(self.found().max(), MOST_ERROR_M)
        self.diagnostics.next_report()
        self.assertGreaterEqual(self.diagnostics.count("recoveries"), 1)
