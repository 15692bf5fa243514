#!/usr/bin/python3
"""A camera as field sensor: the run of the GMRF SLAP paper's section IV (../shared/data/slap_camera) through gmrf_slap_replay.

Writes docs/results/slap_camera.md. Usage: tools/reproduce_slap_camera.py [--data DIR] [--seeds N]   (source the workspace first)
"""
import argparse
import csv
import math
import pathlib
import statistics
import subprocess

import genpy
import numpy as np
import rosbag
import yaml
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

ROOT = pathlib.Path(__file__).resolve().parent.parent
RING = (147.5, 120.5, 40, 80)
TRAIN = 300               # samples of 463 that may be looked at; the others are only scored
REVISIT_M, APART = 0.1, 30
LEAST_CORRELATION = 0.5   # of a feature between visits of one place
PIXEL_M = 1.0 / 124.0
PAPER_NOISE_M = 60.0 * PIXEL_M
CONFIG = {
    "measurement_stddev": 0.5, "likelihood_noise_scale": 2.0, "particles": 200, "lag": 40,
    "hyperparameters": [{"bandwidth": b, "stddev": 1.0} for b in (0.3, 0.6, 1.2)],
    "odom_alpha1": 0.01, "odom_alpha2": 0.02, "odom_alpha3": 0.1, "odom_alpha4": 0.001,
    "initial_pose_a": -math.pi / 2, "initial_cov_xx": 1e-4, "initial_cov_yy": 1e-4, "initial_cov_aa": 1e-3,
    "map_resolution": 0.1,
}


def table(path):
    with open(path) as f:
        rows = list(csv.DictReader(f))
    return {k: np.array([float(r[k]) if r[k] else math.nan for r in rows]) for k in rows[0] if k != "jpg"}


def static_features(values, places):
    """Names of the channels that agree between visits of one place, in the training part alone."""
    distance = np.linalg.norm(places[:, None] - places[None, :], axis=2)
    i, j = np.nonzero(distance < REVISIT_M)
    pairs = j - i > APART
    i, j = i[pairs], j[pairs]
    correlations = {n: np.corrcoef(v[i], v[j])[0, 1] for n, v in values.items() if v[:TRAIN].std() > 0}
    return [n for n, c in correlations.items() if c > LEAST_CORRELATION], correlations, len(i)


def write_bag(path, time, odometry, features, positions):
    def stamped(message, index, frame):
        message.header.stamp, message.header.frame_id = genpy.Time(0, round(1e9 * (100.0 + time[index]))), frame
        return message

    with rosbag.Bag(str(path), "w") as bag:
        for k in range(len(time)):
            odom = stamped(Odometry(), k, "odom")
            odom.child_frame_id = "base_link"
            odom.pose.pose.position.x, odom.pose.pose.position.y, yaw = odometry[k]
            odom.pose.pose.orientation.z, odom.pose.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            bag.write("/odom", odom, odom.header.stamp)
            if k in positions:
                seen = stamped(PoseWithCovarianceStamped(), k, "map")
                (seen.pose.pose.position.x, seen.pose.pose.position.y), stddev = positions[k]
                seen.pose.covariance[0] = seen.pose.covariance[7] = stddev ** 2
                bag.write("/position", seen, seen.header.stamp)
            message = stamped(FieldMeasurement(), k, "base_link")
            message.names, message.values = list(features), [float(v[k]) for v in features.values()]
            bag.write("/field", message, message.header.stamp)


class Camera:
    def __init__(self, data, output, seeds):
        self.output, self.seeds = output, seeds
        output.mkdir(parents=True, exist_ok=True)
        frames, odom = table(data / "frames.csv"), table(data / "odom_simulated.csv")
        measurements = output / "measurements.csv"
        if not measurements.exists():
            subprocess.run([ROOT / "field_ros/scripts/camera_features.py", "--folder", data / "frames", "--frames",
                            data / "frames.csv", "--ring", *map(str, RING), "--output", measurements], check=True)
        self.time = frames["time_s"]
        self.truth = np.stack([frames["x_m"], frames["y_m"]], axis=1)
        self.odometry = np.stack([odom["x_m"], odom["y_m"], odom["yaw_rad"]], axis=1)
        values = {k: v for k, v in table(measurements).items() if k != "stamp_s"}
        self.kept, self.correlations, self.pairs = static_features(values, self.truth[:TRAIN])
        self.features = {n: (values[n] - values[n][:TRAIN].mean()) / values[n][:TRAIN].std() for n in self.kept}
        low, high = self.truth[:TRAIN].min(axis=0) - 0.3, self.truth[:TRAIN].max(axis=0) + 0.3
        self.grid = {"origin": [float(v) for v in low], "spacing": 0.1,
                     "size": [int(math.ceil(v)) + 1 for v in (high - low) / 0.1]}

    def dead_reckoning(self, start=0):
        """Errors of the commands alone, from the true position (and the odometry's own heading) at a sample."""
        moved = self.odometry[start:, :2] - self.odometry[start, :2] + self.truth[start]
        return np.linalg.norm(moved - self.truth[start:], axis=1)

    def run(self, name, seed, positions, features=True):
        bag, config, out = (self.output / f"{name}_{seed}{s}" for s in (".bag", ".yaml", ""))
        chosen = self.features if features else {"none": np.zeros(len(self.time))}
        write_bag(bag, self.time, self.odometry, chosen, positions)
        fields = {n: {} if features else {"measurement_stddev": 1e6} for n in chosen}
        for n in fields:
            fields[n]["unit"] = "1"
        config.write_text(yaml.safe_dump({**CONFIG, "fields": fields, "grid": self.grid}))
        subprocess.run(["rosrun", "gmrf_slap", "gmrf_slap_replay", "--bag", bag, "--config", config,
                        "--output", out, "--seed", str(seed)], check=True)
        estimate = np.loadtxt(out / "estimate.csv", delimiter=",", skiprows=1)
        rows = np.searchsorted(self.time + 100.0, estimate[:, 0] - 1e-4)
        errors = np.full(len(self.time), np.nan)
        errors[rows] = np.linalg.norm(estimate[:, 1:3] - self.truth[rows], axis=1)
        return errors

    def many(self, name, positions_of, features=True):
        return np.array([self.run(name, s, positions_of(np.random.default_rng(s)), features)
                         for s in range(1, self.seeds + 1)])

    def paper_positions(self, random):
        return {k: (self.truth[k] + random.normal(0.0, PAPER_NOISE_M, 2), PAPER_NOISE_M) for k in range(0, 400, 10)}

    def known_positions(self, _):
        return {k: (self.truth[k], 0.01) for k in range(TRAIN)}


def cells(errors):
    def cell(part):
        values = np.nanmean(part, axis=1)
        spread = f" ± {statistics.stdev(values):.3f}" if len(values) > 1 else ""
        return f"{values.mean():.3f}{spread}"
    return f"{cell(errors)} | {cell(errors[:, TRAIN:])}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=pathlib.Path, default=ROOT.parent / "shared/data")
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    camera = Camera(arguments.data / "slap_camera", ROOT / "out/slap_camera", arguments.seeds)
    commands, later = camera.dead_reckoning()[None], camera.dead_reckoning(TRAIN)
    rows = {
        "commands alone": cells(commands),
        "commands, from the true position at the start of the test part": f"- | {later.mean():.3f}",
        "commands + positions (60 px, every 10th of the first 400), no features":
            cells(camera.many("positions", camera.paper_positions, features=False)),
        "the same + features (the paper's protocol)": cells(camera.many("paper", camera.paper_positions)),
        "commands + features, nothing else (SLAM from the start)": cells(camera.many("slam", lambda _: {})),
        "map from known positions in the training part, then commands + features":
            "- | " + cells(camera.many("map", camera.known_positions)).split(" | ")[1],
    }
    body = "\n".join(f"| {name} | {text} |" for name, text in rows.items())
    ranked = sorted(camera.correlations.items(), key=lambda item: -item[1])
    page = ROOT / "docs/results/slap_camera.md"
    page.write_text(f"""# A camera as field sensor

Made by `tools/reproduce_slap_camera.py`: one run of 112.5 s (463 panoramic images, arena 2.0 x 1.5 m, tracked by a ceiling camera) of the
authors of the GMRF SLAP paper. Odometry is the two-wheel model driven by the commands: there are no encoders. Features come from
`field_ros/scripts/camera_features.py` (16 FFT magnitudes, 16 histogram bins), standardized by the first {TRAIN} samples.

Only features that are static fields are used: those whose values at two visits of one place (within {REVISIT_M} m, more than {APART}
samples apart) in the first {TRAIN} samples correlate by more than {LEAST_CORRELATION} ({camera.pairs} pairs). Kept: {', '.join(camera.kept)}. The samples
after that are only scored.

| position error [m], mean over samples ({arguments.seeds} seeds ± their standard deviation) | whole run | samples {TRAIN} to 462 |
|---|---|---|
{body}

Correlations between visits: {', '.join(f'{n} {c:.2f}' for n, c in ranked)}.
""")
    print(page.read_text())


if __name__ == "__main__":
    main()
