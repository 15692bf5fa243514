#!/usr/bin/python3
"""A node's state survives it: killed and started again it goes on with pose and map."""
import pathlib
import shutil
import tempfile
import unittest

from field_msgs.srv import PredictField, SaveState
from geometry_msgs.msg import Point

from support import recordings
from support.live import Diagnostics, Node, advertised_by, start_test_node, wait_for
from support.robot import QUEUES, Robot
from support.runner import main

MOST_ERROR_M = 0.6
PLACES = [Point(0.0, 4.0, 0.0), Point(1.0, 1.0, 0.0)]


class State(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="field_system_tests_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def robot(self, **parameters):
        robot = Robot(state_directory=str(self.folder), **parameters)
        self.addCleanup(robot.node.stop)
        return robot

    def prediction(self, robot):
        answer = robot.node.service("predict_field", PredictField)(names=[], points=PLACES)
        return answer.mean, answer.variance

    def refused(self, **parameters):
        """Standard error of a node that does not start."""
        node = Node(recordings.tiny_config(), **QUEUES, state_directory=str(self.folder), **parameters)
        code, _, err = node.finish()
        self.assertEqual(code, 1, err)
        self.assertEqual([t for t in advertised_by(node.name) if "rosout" not in t and "logger" not in t], [])
        return err

    def test_killed_and_started_again_it_resumes(self):
        resume = {"save_period": 0.05, "save_name": "robot", "resume": True}
        robot = self.robot(**resume)
        robot.drive(20.0)
        diagnostics = Diagnostics(robot.node.name)
        saved = wait_for(lambda: diagnostics.count("states saved"), "an automatic saving")
        robot.drive(2.0)
        wait_for(lambda: diagnostics.count("states saved") > saved, "another one, of the last steps")
        before, pose = self.prediction(robot), robot.poses.last()
        robot.node.kill()
        again = self.robot(start=1000.0, **resume)
        self.assertEqual(self.prediction(again), before)
        # Odometry began anew where the robot stands: the same drive goes on.
        again.driven = robot.driven
        again.drive(10.0)
        self.assertEqual(again.received()[0].header.frame_id, pose.header.frame_id)
        self.assertLess(again.errors().max(), MOST_ERROR_M)

    def test_stopped_it_saves_its_last_step(self):
        robot = self.robot(save_period=3600.0)
        robot.drive(10.0)
        before = self.prediction(robot)
        self.assertEqual(robot.node.stop(), 0)
        self.assertEqual([p.name for p in self.folder.iterdir()], ["last.bag"])
        self.assertEqual(self.prediction(self.robot(load_state="last", save_name="other")), before)

    def test_what_does_not_fit_stops_the_node_before_it_starts(self):
        robot = self.robot()
        robot.drive(2.0)
        self.assertTrue(robot.node.service("save_state", SaveState)(name="site").success)
        err = self.refused(load_state="site", slice_size=7)
        self.assertIn("site.bag", err)
        self.assertIn("slice_size: 10 in the state, 7 here", err)
        self.assertIn("nowhere.bag", self.refused(load_state="nowhere"))
        self.assertIn("letters, digits", self.refused(load_state="../site"))


if __name__ == "__main__":
    start_test_node("live_state")
    main("live_state")
