#!/usr/bin/python3
"""Walks with a phone in a shopping mall: each is localized in the map that the other walks made (WiFi and magnetic field).

The rule is chosen on every second walk and scored on the others. Writes the page, its table and its picture.
"""
import argparse
import itertools
import json
import math
import pathlib
import statistics
import sys

import matplotlib
import numpy as np
import yaml

import replays
import vector_field_slam_recordings as recordings

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of the backend

MAGNETIC = ["mag_vertical_uT", "mag_horizontal_uT"]  # the norm is made of these two
NEAR_M = 20.0       # the map is what was read so near to the odometry's path ...
FEWEST = 50         # ... and at least at so many places
FEWEST_READINGS = 10
ACCESS_POINTS, ALIKE = 6, 0.95
COMMON = {
    "mode": "localization", "particles": 500, "likelihood_noise_scale": 1.0, "slice_size": 10,
    "odom_alpha1": 0.02, "odom_alpha2": 0.003, "odom_alpha3": 0.2, "odom_alpha4": 0.0,
    "odom_calibration": {"translation_stddev": 0.15},
}
YAW_STDDEV = 0.3    # between the phone's heading and that of the walk at its start
OFFSET = {"field_offset": {"stddev": 0.5, "memory": 100.0}}
STARTS = {"exact start": 0.0, "start +- 2 m, 0.1 rad": 1.0}
FIELDS = {"magnetic": ("magnetic",), "WiFi": ("wifi",), "WiFi and magnetic": ("wifi", "magnetic")}
CANDIDATES = {f"{fields}, exponent {exponent}{', level estimated' if offset else ''}":
              (FIELDS[fields], {"likelihood_exponent": exponent, **offset})
              for fields, exponent, offset in itertools.product(FIELDS, (1.0, 0.25), ({}, OFFSET))}


def fresh(values):
    """A phone repeats what it heard of an access point until it hears it anew: a repeated value is no reading."""
    values, last = values.copy(), math.nan
    for i, value in enumerate(values):
        if value == last:
            values[i] = math.nan
        elif not math.isnan(value):
            last = value
    return values


class Walk:
    def __init__(self, folder):
        self.name, self.folder = folder.name, folder
        self.odometry, self.truth = (recordings.read_poses(folder / f"{kind}.csv") for kind in ("odom", "truth"))
        names, table = recordings.read_measurements(folder / "measurements.csv")
        self.stamps = table[:, 0]
        self.places = recordings.at(self.truth, self.stamps)[:, 1:3]
        self.fields = {name: fresh(column) if name.startswith("ap") else column
                       for name, column in zip(names, table[:, 1:].T)}

    def table(self, names):
        return np.stack([self.fields[name] for name in names], axis=1)

    def dead_reckoned(self):
        """The odometry's places from the true start."""
        x, y, yaw = self.truth[0, 1:]
        turn = yaw - self.odometry[0, 3]
        moved = (self.odometry[:, 1] + 1j * self.odometry[:, 2] - complex(*self.odometry[0, 1:3])) * np.exp(1j * turn)
        return np.stack([moved.real + x, moved.imag + y], axis=1)


def distances(a, b):
    return np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])


def write_survey(file, names, places, values):
    seen = np.isfinite(values).any(axis=1)
    return recordings.write_table(file, ",".join(["x_m", "y_m", *names]), np.c_[places, values][seen])


def access_points(walks):
    """The most read ones, leaving out what is nearly the same as one taken before (one antenna has many names)."""
    names = [name for name in walks[0].fields if name.startswith("ap")]
    values = np.concatenate([walk.table(names) for walk in walks])
    taken = []
    for i in sorted(range(len(names)), key=lambda i: -np.isfinite(values[:, i]).sum()):
        both = [np.isfinite(values[:, i]) & np.isfinite(values[:, j]) for j in taken]
        if all(np.corrcoef(values[k, i], values[k, j])[0, 1] < ALIKE for j, k in zip(taken, both)):
            taken.append(i)
    return [names[i] for i in taken[:ACCESS_POINTS]]


def between_walks(walks, name, radius):
    """Noise of a field from one walk to another: RMS of the differences within a radius, over the root of two."""
    squares = []
    for a, b in itertools.combinations(walks, 2):
        i, j = np.nonzero(distances(a.places, b.places) < radius)
        difference = a.fields[name][i] - b.fields[name][j]
        squares.extend(difference[np.isfinite(difference)] ** 2)
    return math.sqrt(statistics.mean(squares) / 2.0), len(squares)


class Mall:
    def __init__(self, data, output):
        self.output = output
        self.output.mkdir(parents=True, exist_ok=True)
        self.walks = [Walk(folder) for folder in sorted(data.glob("path*"))]
        self.choosing, self.reported = self.walks[::2], self.walks[1::2]
        self.names = {"magnetic": MAGNETIC, "wifi": access_points(self.choosing)}
        self.fields = {}
        for kind, kernel, radius in (("magnetic", "squared_exponential", 1.0), ("wifi", "matern32", 3.0)):
            self.learn(kind, kernel, radius)

    def learn(self, kind, kernel, radius):
        """Hyperparameters from the walks that choose; noise is what differs between them where they meet."""
        file, names = self.output / f"{kind}.yaml", self.names[kind]
        if not file.exists():
            survey = write_survey(self.output / f"{kind}.csv", names, np.concatenate([w.places for w in self.choosing]),
                                  np.concatenate([w.table(names) for w in self.choosing]))
            replays.run("rosrun", "gp_localize", "learn_hyperparameters", "--survey", survey, "--kernel", kernel,
                        "--starts", 2, "--support", 400, "--output", file)
        for name, learned in yaml.safe_load(file.read_text())["fields"].items():
            noise, pairs = between_walks(self.choosing, name, radius)
            learned["noise_stddev"] = max(noise, learned["noise_stddev"])
            self.fields[name] = learned
            print(f"{name}: {learned}, noise {noise:.2f} from {pairs} pairs", file=sys.stderr)

    def survey(self, walk):
        """What the others read near the odometry's path; the fields that were read there."""
        names = MAGNETIC + self.names["wifi"]
        others = [other for other in self.walks if other is not walk]
        places = np.concatenate([other.places for other in others])
        values = np.concatenate([other.table(names) for other in others])
        distance = distances(places, walk.dead_reckoned()).min(axis=1)
        near = distance <= max(NEAR_M, np.sort(distance)[FEWEST])
        read = [i for i in range(len(names)) if np.isfinite(values[near, i]).sum() >= FEWEST_READINGS]
        kept = [names[i] for i in read]
        return write_survey(self.output / f"{walk.name}_others.csv", kept, places[near], values[near][:, read]), kept

    def covered(self, walk):
        """Share of the walk within 2 m of another one."""
        others = np.concatenate([other.places for other in self.walks if other is not walk])
        return float((distances(walk.places, others).min(axis=1) < 2.0).mean())

    def bag(self, walk):
        """The walk with repeated WiFi values taken out."""
        folder = self.output / walk.name
        folder.mkdir(exist_ok=True)
        names = MAGNETIC + self.names["wifi"]
        for kind, poses in (("odom", walk.odometry), ("truth", walk.truth)):
            recordings.write_table(folder / f"{kind}.csv", recordings.POSES, poses)
        values = walk.table(names)
        seen = np.isfinite(values).any(axis=1)
        recordings.write_table(folder / "measurements.csv", ",".join(["stamp_s", *names]),
                               np.c_[walk.stamps, values][seen])
        return replays.recording(folder, self.output)

    def configuration(self, walk, kinds, changes, start, seed):
        survey, mapped = self.survey(walk)
        names = [name for kind in kinds for name in self.names[kind] if name in mapped]
        rough = STARTS[start]
        x, y, yaw = walk.truth[0, 1:] + rough * np.random.default_rng(seed).normal(0.0, [2.0, 2.0, 0.1])
        xy, angle = max(4.0 * rough, 1e-4), YAW_STDDEV**2 + 0.01 * rough
        low, high = walk.dead_reckoned().min(axis=0) - NEAR_M, walk.dead_reckoned().max(axis=0) + NEAR_M
        return {**COMMON, **changes, "fields": {name: self.fields[name] for name in names},
                "survey": str(survey), "initial_pose_x": float(x), "initial_pose_y": float(y),
                "initial_pose_a": float(yaw), "initial_cov_xx": xy, "initial_cov_yy": xy, "initial_cov_aa": angle,
                "map_resolution": 2.0,
                "support": {"selection": "survey", "size": 150, "jitter": 1e-6,
                            "region": [float(v) for v in (*low, *high)]}}

    def errors(self, walk, candidate, start, seed):
        if not self.configuration(walk, CANDIDATES[candidate][0], {}, start, seed)["fields"]:
            return None
        label = "_".join([walk.name, candidate, start, str(seed)])
        folder = self.output / "".join(c if c.isalnum() or c == "_" else "-" for c in label)
        result = folder / "result.json"
        if not result.exists():
            folder.mkdir(exist_ok=True)
            config = folder / "config.yaml"
            config.write_text(yaml.safe_dump(self.configuration(walk, *CANDIDATES[candidate], start, seed)))
            run = self.bag(walk)
            run.replay(config, seed, folder)
            trajectories, _ = run.evaluate(folder)
            result.write_text(json.dumps(trajectories))
        return json.loads(result.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("--data", "--output", "--page"):
        parser.add_argument(name, type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    if not list(arguments.data.glob("path*")):
        print(f"skipped: {arguments.data} is not there", file=sys.stderr)
        return
    mall = Mall(arguments.data, arguments.output)
    for candidate in CANDIDATES:
        for walk in mall.choosing:
            r = mall.errors(walk, candidate, "exact start", 1) or {}
            print(candidate, walk.name, f"{mall.covered(walk):.2f}", *(f"{k} {v['position_error_rmse_m']:.2f}" for k, v in r.items()), flush=True)


if __name__ == "__main__":
    main()
