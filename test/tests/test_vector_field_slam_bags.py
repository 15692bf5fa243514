#!/usr/bin/python3
"""Each bag with a configuration of vector_field_slam through its replay and field_eval, and real radio ranges.

Bounds: half of and a bit more than twice what the shipped configurations give (README.md, "Where the bounds come
from"). The lower ones are there because a localizer that is too good has seen the truth.
"""
import json
import typing
import unittest

import numpy as np

from support import trajectories, workspace
from support.programs import ProgramTest, replay, run
from support.runner import main

NODE = "vector_field_slam"


class Bounds(typing.NamedTuple):
    mean_error_m: tuple        # least, most: map frame, no alignment
    aligned_error_m: tuple     # least, most: after the rigid motion that fits best
    share_of_odometry: float   # most: mean error / odometry's
    final_error_m: float       # most


BOUNDS = {
    "beacons": Bounds((0.05, 0.4), (0.02, 0.12), 0.5, 0.6),
    "office_wifi": Bounds((0.5, 4.5), (0.3, 2.8), 0.6, 4.0),
    "warehouse_magnetic": Bounds((0.15, 1.4), (0.08, 0.7), 0.4, 3.0),
}
# Mean error [m] as recorded (odometry alone: 1.58) and with a drift of 0.5 degree per metre (30.0).
PLAZA = {"recorded": (0.3, 1.5), "drifting": (0.5, 5.0)}


def evaluate(truth, estimate, bag, align, json_file):
    done = run("field_core", "field_eval", "--truth", truth, "--estimate", estimate, "--baseline",
               f"odometry=odom:{bag}:/odom", "--align", align, "--json", json_file)
    if done.returncode != 0:
        raise AssertionError(done.stderr)
    return {t["name"]: t["position_error_mean_m"] for t in json.loads(json_file.read_text())["trajectories"]}


class VectorFieldSlamBags(ProgramTest):
    def test_every_configured_bag_has_bounds(self):
        self.assertEqual(workspace.configured_bags(NODE), sorted(BOUNDS))

    def assert_within(self, value, least, most):
        self.assertGreaterEqual(value, least)
        self.assertLessEqual(value, most)

    def check(self, name):
        bag, bounds = workspace.bag(name), BOUNDS[name]
        self.must(replay(bag, workspace.config(name, estimator=NODE), self.output, estimator=NODE))
        truth, estimate = f"{bag}:/ground_truth", self.output / "estimate.csv"
        errors = evaluate(truth, estimate, bag, "none", self.folder / "none.json")
        aligned = evaluate(truth, estimate, bag, "best", self.folder / "best.json")
        print(name, errors, "aligned", aligned)
        self.assert_within(errors["estimate"], *bounds.mean_error_m)
        self.assert_within(aligned["estimate"], *bounds.aligned_error_m)
        self.assertLess(errors["estimate"], bounds.share_of_odometry * errors["odometry"])
        _, rows = trajectories.read_csv(estimate)
        found = trajectories.position_errors(trajectories.from_bag(bag, "/ground_truth"), rows)
        self.assertAlmostEqual(found.mean(), errors["estimate"], delta=1e-4)  # by a computation of our own
        self.assertLess(found[-1], bounds.final_error_m)
        for xx, xy, xa, yy, ya, aa in rows[:, 4:]:
            np.linalg.cholesky([[xx, xy, xa], [xy, yy, ya], [xa, ya, aa]])  # raises unless SPD
        summary = json.loads((self.output / "summary.json").read_text())
        self.assertEqual((summary["estimator"], summary["numerical_errors"]), (NODE, 0))

    def test_beacons(self):
        self.check("beacons")

    def test_office_wifi(self):
        self.check("office_wifi")

    def test_warehouse_magnetic(self):
        self.check("warehouse_magnetic")


@unittest.skipUnless(workspace.recordings(), "no recordings: set FIELD_DATA_DIR to their folder")
class Plaza(ProgramTest):
    """Ranges to four radio beacons, one at a time."""

    def localize(self, odometry, *changes):
        folder = workspace.recordings() / "plaza1"
        if not folder.is_dir():
            self.skipTest(f"no recording {folder}")
        bag, config = self.folder / "plaza1.bag", self.folder / "plaza1.yaml"
        shipped = workspace.config("plaza1", "recordings", NODE).read_text().splitlines()
        keys = [c.split(":")[0] for c in changes]
        config.write_text("\n".join([line for line in shipped if line.split(":")[0] not in keys] + list(changes)) + "\n")
        self.must(run("field_bags", "csv_to_bag", "--odom", odometry or folder / "odom.csv", "--measurements",
                      folder / "measurements.csv", "--sort", "--output", bag))
        self.must(replay(bag, config, self.output, estimator=NODE))
        return evaluate(folder / "truth.csv", self.output / "estimate.csv", bag, "none", self.folder / "errors.json")

    def check(self, errors, bounds, share):
        print("plaza1", errors)
        self.assertGreater(errors["estimate"], bounds[0])
        self.assertLess(errors["estimate"], bounds[1])
        self.assertLess(errors["estimate"], share * errors["odometry"])

    def test_as_recorded_it_is_better_than_odometry(self):
        self.check(self.localize(None), PLAZA["recorded"], 1.0)

    def test_with_a_drifting_heading_it_is_five_times_better(self):
        folder = workspace.recordings() / "plaza1"
        if not folder.is_dir():
            self.skipTest(f"no recording {folder}")
        poses = np.loadtxt(folder / "odom.csv", delimiter=",", skiprows=1)
        steps = np.diff(poses[:, 1:3], axis=0)
        heading = poses[:, 3].copy()
        heading[1:] += np.radians(0.5) * np.cumsum(np.hypot(*steps.T))
        turned = heading[:-1] - poses[:-1, 3]
        c, s = np.cos(turned), np.sin(turned)
        x = np.r_[0.0, np.cumsum(c * steps[:, 0] - s * steps[:, 1])]
        y = np.r_[0.0, np.cumsum(s * steps[:, 0] + c * steps[:, 1])]
        drifting = self.folder / "odom.csv"
        np.savetxt(drifting, np.c_[poses[:, 0], x, y, (heading + np.pi) % (2 * np.pi) - np.pi], delimiter=",",
                   header="stamp_s,x_m,y_m,yaw_rad", comments="", fmt="%.6f")
        # A drift of k over L = 10 m by random turns, two in each step of d = 0.53 m: alpha2 = k^2 L / (2 d).
        self.check(self.localize(drifting, "odom_alpha2: 0.00072"), PLAZA["drifting"], 0.2)


if __name__ == "__main__":
    main("vector_field_slam_bags")
