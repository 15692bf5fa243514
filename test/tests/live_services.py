#!/usr/bin/python3
"""The services of the live node: predict_field, save_state, load_state, reset, pause, global_localization."""
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
import rosbag
from field_msgs.srv import LoadState, PredictField, SaveState
from geometry_msgs.msg import Point, PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Empty, SetBool

from support import maps, messages, recordings
from support.live import Collector, Diagnostics, start_test_node, wait_for
from support.robot import Robot, covariance_of
from support.runner import main

MOST_ERROR_M = 0.6
CONFIGURATION = recordings.tiny_config(fields={"sound": {"mean": 40.0, "signal_stddev": 3.0, "noise_stddev": 1.0,
                                                         "length_scales": [2.0, 2.0]}})


class Services(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="field_system_tests_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.states = self.folder / "states"
        self.robot = Robot(CONFIGURATION, state_directory=str(self.states))
        self.addCleanup(self.robot.node.stop)
        self.predict = self.robot.node.service("predict_field", PredictField)

    def prediction(self, *points, names=()):
        answer = self.predict(names=list(names), points=[Point(x, y, 0.0) for x, y in points])
        self.assertTrue(answer.success, answer.message)
        return answer

    def newest(self):
        return self.robot.poses.last()

    def test_predict_field(self):
        self.robot.drive(40.0)  # twice around
        visited = [recordings.circle(t)[:2] for t in (2.0, 7.0, 12.0, 17.0)]
        answer = self.prediction(*visited, names=["light"])
        self.assertEqual(answer.names, ["light"])
        truth = [recordings.light_at(x, y) for x, y in visited]
        # noise 0.2, map hypotheses a few centimetres apart: well within 3 x 0.3.
        np.testing.assert_allclose(answer.mean, truth, atol=0.9)
        self.assertTrue(all(0.2**2 <= v < 1.0 for v in answer.variance), answer.variance)
        far = self.prediction((40.0, 40.0), names=["light"])
        self.assertAlmostEqual(far.mean[0], 5.0, delta=1e-3)
        self.assertAlmostEqual(far.variance[0], 2.0**2 + 0.2**2, delta=1e-2)

    def test_predict_field_names(self):
        both = self.prediction((0.0, 0.0), (1.0, 2.0), (-1.0, 0.5))
        self.assertEqual(sorted(both.names), ["light", "sound"])
        self.assertEqual((len(both.mean), len(both.variance)), (6, 6))
        rows = {name: both.mean[3 * i:3 * i + 3] for i, name in enumerate(both.names)}
        np.testing.assert_allclose(rows["light"], 5.0, atol=1e-6)  # nothing measured yet: the mean
        np.testing.assert_allclose(rows["sound"], 40.0, atol=1e-6)
        swapped = self.prediction((0.0, 0.0), names=["sound", "light"])
        self.assertEqual(swapped.names, ["sound", "light"])
        np.testing.assert_allclose(swapped.mean, [40.0, 5.0], atol=1e-6)
        self.assertEqual(len(self.prediction(names=["light"]).mean), 0)

    def test_predict_field_refuses(self):
        for names, points, texts in ((["smell"], [Point(0, 0, 0)], ("smell", "light", "sound")),
                                     ([], [Point(float("nan"), 0, 0)], ("point 1", "not finite")),
                                     (["light"], [Point(0, 0, 0), Point(0, float("inf"), 0)], ("point 2",))):
            with self.subTest(texts[0]):
                answer = self.predict(names=names, points=points)
                self.assertFalse(answer.success)
                for text in texts:
                    self.assertIn(text, answer.message)
                self.assertEqual(len(answer.names) + len(answer.mean) + len(answer.variance), 0)

    def test_grids_show_what_is_not_known(self):
        self.robot.drive(20.0)
        latched = Collector(self.robot.node.topic("grid/light"), OccupancyGrid)
        # Drawn every map_publish_period: the first to come may be from before the drive.
        grid = wait_for(lambda: any(v > 0 for m in latched.all() for v in m.data) and latched.last(),
                        "a grid that knows something")
        x, y = maps.cell_centres(grid.info)
        data = np.array(grid.data).reshape(maps.grid_shape(grid.info))
        near = [np.argmin(np.hypot(x - a, y - b)) for a, b, _ in map(recordings.circle, (2.0, 7.0, 12.0, 17.0))]
        self.assertTrue((data.ravel()[near] >= 0).all(), "unknown where the robot was")
        self.assertTrue((data[:4, :4] == maps.UNKNOWN).all(), "known in a corner 4 m off the path")

    def test_save_drive_on_load(self):
        save, load = (self.robot.node.service(f"{n}_state", t) for n, t in (("save", SaveState), ("load", LoadState)))
        self.robot.drive(20.0)
        saved_pose, saved_map = self.newest(), self.prediction((0.0, 4.0), (1.0, 1.0))
        answer = save(name="after_one_lap")
        self.assertTrue(answer.success, answer.message)
        self.assertEqual([p.name for p in self.states.iterdir()], ["after_one_lap.bag"])
        with rosbag.Bag(str(self.states / "after_one_lap.bag")) as bag:
            self.assertEqual([m._type for _, m, _ in bag.read_messages()], ["field_msgs/EstimatorState"])
        self.robot.drive(7.0)
        self.assertNotEqual(self.prediction((0.0, 4.0), (1.0, 1.0)).mean, saved_map.mean)
        answer = load(name="after_one_lap")
        self.assertTrue(answer.success, answer.message)
        restored = self.prediction((0.0, 4.0), (1.0, 1.0))
        self.assertEqual((restored.mean, restored.variance), (saved_map.mean, saved_map.variance))
        pose = wait_for(lambda: self.newest().pose.pose == saved_pose.pose.pose and self.newest(), "the saved pose")
        self.assertEqual(pose.pose.covariance, saved_pose.pose.covariance)

    def test_states_are_names_not_paths(self):
        save, load = (self.robot.node.service(f"{n}_state", t) for n, t in (("save", SaveState), ("load", LoadState)))
        for name in ("../outside", "a/b", "/tmp/absolute", "..", "", ".hidden", "a b", "x" * 1000):
            for call in (save, load):
                with self.subTest(f"{call.resolved_name} {name[:20]!r}"):
                    answer = call(name=name)
                    self.assertFalse(answer.success)
                    self.assertIn("letters, digits", answer.message)
        self.assertEqual(list(self.folder.rglob("*.bag")), [])
        answer = load(name="never_saved")
        self.assertFalse(answer.success)
        self.assertIn("never_saved", answer.message)

    def test_a_damaged_state_changes_nothing(self):
        save, load = (self.robot.node.service(f"{n}_state", t) for n, t in (("save", SaveState), ("load", LoadState)))
        self.robot.drive(10.0)
        self.assertTrue(save(name="good").success)
        recordings.cut(self.states / "good.bag", self.states / "half.bag", 0.5)
        recordings.write_bag(self.states / "foreign.bag", recordings.circling(duration=1.0))
        before = self.prediction((0.0, 4.0))
        for name in ("half", "foreign"):
            answer = load(name=name)
            self.assertFalse(answer.success)
            self.assertIn(f"{name}.bag", answer.message)
        after = self.prediction((0.0, 4.0))
        self.assertEqual((after.mean, after.variance), (before.mean, before.variance))
        since = self.robot.now()
        self.robot.drive(5.0)
        self.assertLess(self.robot.errors(since).max(), MOST_ERROR_M)

    def test_reset_forgets_the_map_and_starts_again(self):
        untouched = self.prediction((0.0, 0.0), (1.0, 1.0), (0.0, 4.0))
        self.robot.drive(20.0)
        first = [(m.pose.pose, m.pose.covariance) for m in self.robot.poses.all()]
        self.robot.node.service("reset", Empty)()
        again = self.prediction((0.0, 0.0), (1.0, 1.0), (0.0, 4.0))
        self.assertEqual((again.mean, again.variance), (untouched.mean, untouched.variance))
        self.robot.restart_clock(500.0)
        self.robot.drive(19.9)
        again = [(m.pose.pose, m.pose.covariance) for m in self.robot.received() if m.header.stamp.to_sec() >= 500.0]
        self.assertEqual(again, first)

    def test_pause_follows_odometry_and_drops_measurements(self):
        pause, diagnostics = self.robot.node.service("pause", SetBool), Diagnostics(self.robot.node.name)
        self.robot.drive(10.0)
        self.assertTrue(pause(data=True).success)
        before, applied = diagnostics.dropped().get("paused", 0), diagnostics.next_report()["applied"]
        for _ in range(5):
            self.robot.measure(self.robot.driven)
        wait_for(lambda: diagnostics.dropped().get("paused", 0) == before + 5, "five measurements dropped")
        self.assertEqual(diagnostics.next_report()["applied"], applied)
        self.assertEqual(diagnostics.reports()[-1]["estimator"][1], "paused")
        self.assertTrue(pause(data=False).success)
        since = self.robot.now()
        self.robot.drive(5.0)
        self.assertLess(self.robot.errors(since).max(), MOST_ERROR_M)

    def test_global_localization_and_initialpose(self):
        self.robot.drive(10.0)
        particles = Collector(self.robot.node.topic("particlecloud"), PoseArray)
        wait_for(lambda: particles.subscriber.get_num_connections() > 0, "~particlecloud")
        initialpose = self.robot.node.publisher("initialpose", PoseWithCovarianceStamped)
        self.robot.node.service("global_localization", Empty)()
        # Uniform over 10 m: variance 100 / 12 = 8.3; 50 particles are within a third of that.
        wait_for(lambda: covariance_of(self.newest())[0, 0] > 4.0, "particles all over the region")
        self.assertLess(covariance_of(self.newest())[0, 0], 13.0)
        cloud = wait_for(particles.last, "the scattered particles")
        self.assertEqual(len(cloud.poses), 50)
        x, y, yaw = recordings.circle(self.robot.driven)
        initialpose.publish(messages.initialpose(self.robot.now(), x, y, yaw))
        wait_for(lambda: covariance_of(self.newest())[0, 0] < 0.1, "a belief around the pose estimate")
        self.assertLess(np.hypot(self.newest().pose.pose.position.x - x, self.newest().pose.pose.position.y - y), 0.1)
        since = self.robot.now()
        self.robot.drive(10.0)
        self.assertLess(self.robot.errors(since).max(), MOST_ERROR_M)


if __name__ == "__main__":
    start_test_node("live_services")
    main("live_services")
