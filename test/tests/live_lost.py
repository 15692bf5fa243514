#!/usr/bin/python3
"""Lost and found: the kidnapped robot, the verdict in /diagnostics, automatic recovery."""
import unittest

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Empty

from support import messages, recordings
from support.live import Diagnostics, start_test_node, wait_for
from support.robot import Robot
from support.runner import main

ERROR = 2  # diagnostic_msgs/DiagnosticStatus
MOST_ERROR_M = 0.6
# Enough particles to be found again among all poses of 10 m x 10 m; a verdict from three seconds.
CONFIGURATION = recordings.tiny_config(particles=600, map_hypotheses="sample_paths", sample_paths=20)


class Lost(unittest.TestCase):
    def setUp(self):
        self.robot = Robot(CONFIGURATION, lost_window=6, lost_nis=4.0, **self.parameters())
        self.addCleanup(self.robot.node.stop)
        self.diagnostics = Diagnostics(self.robot.node.name)
        self.robot.drive(40.0)  # twice around: the map along the circle is known
        self.assertEqual(self.diagnostics.next_report()["lost"], "no")
        self.assertLess(self.robot.errors(self.robot.start + 20.0).max(), MOST_ERROR_M)

    def parameters(self):
        return {"recovery": "recovers" in self.id()}

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
        self.assertNotEqual(self.diagnostics.next_report()["lost"], "no")
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
