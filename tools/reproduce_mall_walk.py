#!/usr/bin/python3
"""Walks with a phone in a shopping mall: each is localized in the map that the others made (WiFi, magnetic field).

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
KINDS = {"magnetic": ("magnetic",), "WiFi": ("wifi",), "WiFi and magnetic": ("wifi", "magnetic")}
KERNEL = {"magnetic": "squared_exponential", "wifi": "matern32"}
NOISE = {"magnetic": 3.0, "wifi": 6.0}  # uT, dB: from one walk to another, not within one
NEAR_M, FEWEST, FEWEST_READINGS = 20.0, 50, 10  # the map is what was read so near to the odometry's path
ACCESS_POINTS, ALIKE = 6, 0.95
MAPPED_M, MAPPED_SHARE = 3.0, 1.0 / 3.0  # of the odometry's path, near to the map's places: a mapped walk
COMMON = {
    "mode": "localization", "particles": 400, "likelihood_noise_scale": 1.0, "lost": {"recovery_share": 0.0},
    "odom_alpha1": 0.02, "odom_alpha2": 0.003, "odom_alpha3": 0.2, "odom_alpha4": 0.0,
    "odom_calibration": {"translation_stddev": 0.15},
    "map_resolution": 2.0,
}
YAW_STDDEV = 0.3    # between the phone's heading and that of the walk at its start
SUPPORT = 200
EXPONENTS = (0.25, 0.5, 1.0)
STARTS = {"exact start": 0.0, "start +- 2 m, 0.1 rad": 1.0}


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

    def start(self, rough=0.0, seed=0):
        """The true start, or one off by a draw."""
        return self.truth[0, 1:] + rough * np.random.default_rng(seed).normal(0.0, [2.0, 2.0, 0.1])

    def dead_reckoned(self, start=None):
        """The odometry's places from a start, the true one by default."""
        x, y, yaw = self.start() if start is None else start
        moved = self.odometry[:, 1] + 1j * self.odometry[:, 2] - complex(*self.odometry[0, 1:3])
        moved *= np.exp(1j * (yaw - self.odometry[0, 3]))
        return np.stack([moved.real + x, moved.imag + y], axis=1)

    def length(self):
        return float(np.hypot(*np.diff(self.truth[:, 1:3], axis=0).T).sum())


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


class Mall:
    def __init__(self, data, output):
        self.output = output
        self.output.mkdir(parents=True, exist_ok=True)
        self.walks = [Walk(folder) for folder in sorted(data.glob("path*"))]
        self.choosing, self.reported = self.walks[::2], self.walks[1::2]
        self.names = {"magnetic": MAGNETIC, "wifi": access_points(self.choosing)}
        self.fields = {name: field for kind in KERNEL for name, field in self.learn(kind).items()}

    def learn(self, kind):
        """Hyperparameters from the walks that choose, with the noise between walks."""
        file, names = self.output / f"{kind}.yaml", self.names[kind]
        if not file.exists():
            survey = write_survey(self.output / f"{kind}.csv", names, np.concatenate([w.places for w in self.choosing]),
                                  np.concatenate([w.table(names) for w in self.choosing]))
            replays.run("rosrun", "gp_localize", "learn_hyperparameters", "--survey", survey, "--kernel", KERNEL[kind],
                        "--starts", 2, "--support", 400, "--output", file)
        learned = yaml.safe_load(file.read_text())["fields"]
        return {name: {**field, "noise_stddev": NOISE[kind]} for name, field in learned.items()}

    def survey(self, walk):
        """What the others read near the odometry's path; the fields that were read there."""
        names = MAGNETIC + self.names["wifi"]
        others = [other for other in self.walks if other is not walk]
        places = np.concatenate([other.places for other in others])
        values = np.concatenate([other.table(names) for other in others])
        distance = distances(places, walk.dead_reckoned()).min(axis=1)
        near = distance <= max(NEAR_M, np.sort(distance)[FEWEST])  # or the nearest, where there is little
        read = [i for i in range(len(names)) if np.isfinite(values[near, i]).sum() >= FEWEST_READINGS]
        kept = [names[i] for i in read]
        return write_survey(self.output / f"{walk.name}_others.csv", kept, places[near], values[near][:, read]), kept

    def others(self, walk):
        return np.concatenate([other.places for other in self.walks if other is not walk])

    def mapped(self, walk):
        """Share of the odometry's path that is near to the map's places: known before anything is localized."""
        return float((distances(walk.dead_reckoned(), self.others(walk)).min(axis=1) < MAPPED_M).mean())

    def covered(self, walk):
        """Share of the walk itself within 2 m of another: only to read the results by."""
        return float((distances(walk.places, self.others(walk)).min(axis=1) < 2.0).mean())

    def bag(self, walk):
        """The walk with repeated WiFi values taken out."""
        folder = self.output / walk.name
        bag = self.output / f"{walk.name}.bag"
        if bag.exists():
            return replays.Run(walk.name, bag)
        folder.mkdir(exist_ok=True)
        names = MAGNETIC + self.names["wifi"]
        for kind, poses in (("odom", walk.odometry), ("truth", walk.truth)):
            recordings.write_table(folder / f"{kind}.csv", recordings.POSES, poses)
        values = walk.table(names)
        seen = np.isfinite(values).any(axis=1)
        recordings.write_table(folder / "measurements.csv", ",".join(["stamp_s", *names]),
                               np.c_[walk.stamps, values][seen])
        return replays.recording(folder, self.output)

    def configuration(self, walk, kinds, exponent, rough, seed):
        survey, read = self.survey(walk)
        fields = {name: dict(self.fields[name]) for kind in KINDS[kinds] for name in self.names[kind] if name in read}
        for name in set(fields).intersection(MAGNETIC):  # the level around here; no position is needed
            fields[name]["mean"] = float(np.nanmean(walk.fields[name]))
        if kinds == "WiFi":  # a reading that says nothing makes the same steps: errors are then over the same times
            fields[MAGNETIC[0]] = {**self.fields[MAGNETIC[0]], "noise_stddev": 1e6}
        x, y, yaw = (float(v) for v in walk.start(rough, seed))
        xy, angle = max(4.0 * rough, 1e-4), YAW_STDDEV**2 + 0.01 * rough
        path = walk.dead_reckoned()
        region = [float(v) for v in (*(path.min(axis=0) - NEAR_M), *(path.max(axis=0) + NEAR_M))]
        return {
            **COMMON, "likelihood_exponent": exponent, "fields": fields, "survey": str(survey),
            "initial_pose_x": x, "initial_pose_y": y, "initial_pose_a": yaw,
            "initial_cov_xx": xy, "initial_cov_yy": xy, "initial_cov_aa": angle,
            "support": {"selection": "survey", "size": SUPPORT, "jitter": 1e-6, "region": region}}

    def folder(self, walk, kinds, exponent, start, seed):
        label = "_".join([walk.name, kinds, str(exponent), start, str(seed)])
        return self.output / "".join(c if c.isalnum() or c == "_" else "-" for c in label)

    def errors(self, walk, kinds, exponent, start, seed):
        """field_eval's numbers of one replay; kept in a file."""
        folder = self.folder(walk, kinds, exponent, start, seed)
        result = folder / "result.json"
        if not result.exists():
            folder.mkdir(exist_ok=True)
            config, run = folder / "config.yaml", self.bag(walk)
            config.write_text(yaml.safe_dump(self.configuration(walk, kinds, exponent, STARTS[start], seed)))
            run.replay(config, seed, folder)
            result.write_text(json.dumps(run.evaluate(folder)[0]))
        return json.loads(result.read_text())


def rms(result, name):
    return result[name]["position_error_rmse_m"]


def choose(mall):
    """The candidate with the least mean ratio to odometry's RMS on the choosing walks, and the table of all."""
    rows, scores = [], {}

    def score(kinds, exponent, errors):
        ratio = statistics.mean(error / rms(result, "odometry") for error, result in zip(errors, results))
        rows.append([kinds, exponent, *(f"{error:.2f}" for error in errors), f"{ratio:.2f}"])
        print(*rows[-1], file=sys.stderr, flush=True)
        return ratio

    for kinds, exponent in itertools.product(KINDS, EXPONENTS):
        results = [mall.errors(walk, kinds, exponent, "exact start", 1) for walk in mall.choosing]
        scores[kinds, exponent] = score(kinds, str(exponent), [rms(result, "estimate") for result in results])
    for name in ("odometry", "odometry, best scale"):
        score(name, "", [rms(result, name) for result in results])
    header = ["fields", "exponent", *(walk.name for walk in mall.choosing), "mean ratio to odometry"]
    return min(scores, key=scores.get), [header] + rows


def rough_odometry(walk, seed):
    """RMS of odometry from the start that the filter is given."""
    away = walk.dead_reckoned(walk.start(1.0, seed)) - recordings.at(walk.truth, walk.odometry[:, 0])[:, 1:3]
    return math.sqrt((away**2).sum(axis=1).mean())


def report(mall, chosen, seeds):
    """By walk that did not choose: whether it is mapped, its errors by name, and its row of the page."""
    found = {}
    for walk in mall.reported:
        mapped, seeded = mall.mapped(walk), range(1, seeds + 1)
        exact, rough = ([mall.errors(walk, *chosen, start, seed) for seed in seeded] for start in STARTS)
        errors = {}
        for kind, key in (("RMS", "position_error_rmse_m"), ("mean", "position_error_mean_m")):
            errors[kind] = [exact[0]["odometry"][key], exact[0]["odometry, best scale"][key],
                            statistics.median(r["estimate"][key] for r in exact)]
        errors["rough"] = [statistics.median(rough_odometry(walk, seed) for seed in seeded), None,
                           statistics.median(rms(r, "estimate") for r in rough)]
        inside = statistics.mean(r["estimate"]["share_inside_90_ellipse"] for r in exact)
        spread = [rms(r, "estimate") for r in exact]
        row = [walk.name, f"{walk.length():.0f}", f"{100 * mapped:.0f} %", f"{100 * mall.covered(walk):.0f} %",
               *map(number, errors["RMS"]), f"{min(spread):.2f} to {max(spread):.2f}", f"{100 * inside:.0f} %",
               number(errors["rough"][0]), number(errors["rough"][2])]
        print(*row, file=sys.stderr, flush=True)
        found[walk.name] = (mapped >= MAPPED_SHARE, errors, row)
    return found


def number(value):
    return "-" if value is None else f"{value:.2f}"


def summary(found):
    """Medians over the walks of: odometry, best scale, the filter, and its ratio to odometry."""
    rows = []
    for name, kind in (("RMS, exact start", "RMS"), ("mean, exact start", "mean"),
                       ("RMS, start +- 2 m, 0.1 rad", "rough")):
        for group in ("all", "mapped"):
            some = [errors[kind] for mapped, errors, _ in found.values() if mapped or group == "all"]
            columns = [*zip(*some)] if some else []
            ratio = statistics.median(filtered / odometry for odometry, _, filtered in some) if some else None
            rows.append([name, f"{group} ({len(some)})",
                         *(number(None if None in column else statistics.median(column)) for column in columns),
                         number(ratio)])
    return rows


def plot(mall, chosen, found, file):
    """RMS by walk; the reported walk that has most of a map, over the places of the others."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5))
    names = list(found)
    at = np.arange(len(names))
    for i, label, colour in ((0, "odometry", "tab:red"), (1, "odometry, best scale", "tab:orange"),
                             (2, "gp_localize", "tab:blue")):
        left.bar(at + 0.25 * (i - 1), [found[name][1]["RMS"][i] for name in names], 0.25, label=label, color=colour)
    left.set_xticks(at)
    left.set_xticklabels([name + ("\nmapped" if found[name][0] else "") for name in names], rotation=45, fontsize=8)
    left.set_ylabel("RMS position error [m], exact start")
    left.legend()
    walk = max(mall.reported, key=mall.mapped)
    folder = mall.folder(walk, *chosen, "exact start", 1)
    estimate = np.loadtxt(folder / "estimate.csv", delimiter=",", skiprows=1)
    right.plot(*mall.others(walk).T, ".", color="0.75", markersize=3, label="the others' places")
    right.plot(*walk.truth[:, 1:3].T, color="black", label="truth")
    right.plot(*walk.dead_reckoned().T, color="tab:red", label="odometry")
    right.plot(*estimate[:, 1:3].T, color="tab:blue", label="gp_localize")
    low, high = walk.places.min(axis=0) - 12.0, walk.places.max(axis=0) + 12.0
    right.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]", title=walk.name)
    right.set_aspect("equal")
    right.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


MARK = "<!-- written by tools/reproduce_mall_walk.sh -->\n"


def write_page(page, mall, chosen, candidates, found, seeds):
    page.parent.mkdir(parents=True, exist_ok=True)
    plot(mall, chosen, found, page.with_suffix(".png"))
    text = [f"{len(mall.choosing)} walks chose, {len(mall.reported)} are reported. "
            f"Chosen: {chosen[0]}, exponent {chosen[1]}.\n",
            "Choosing walks: RMS position error [m], exact start, one seed:\n",
            replays.table(candidates[0], candidates[1:]),
            f"Reported walks, medians over walks of the position error [m] (of each the median of {seeds} seeds). "
            "Mapped: a third of the odometry's path or more is near the map.\n",
            replays.table(["error", "walks", "odometry", "odometry, best scale", "gp_localize",
                           "median ratio to odometry"], summary(found)),
            "RMS position error [m] by walk:\n",
            replays.table(["walk", "length [m]", "odometry's path within 3 m of the map", "truth within 2 m",
                           "odometry", "odometry, best scale", "gp_localize", "over seeds", "in 90 % ellipse",
                           "odometry, rough start", "gp_localize, rough start"], [row for *_, row in found.values()]),
            f"![RMS by walk, and the walk that has most of a map]({page.stem}.png)\n"]
    before = page.read_text().split(MARK)[0] if page.exists() else "# Walks in a shopping mall\n\n"
    page.write_text(before + MARK + "\n" + "\n".join(text))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("--data", "--output", "--page"):
        parser.add_argument(name, type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    if len(list(arguments.data.glob("path*"))) < 4:
        print(f"skipped: {arguments.data} has no walks (path*)", file=sys.stderr)
        return
    mall = Mall(arguments.data, arguments.output)
    chosen, candidates = choose(mall)
    found = report(mall, chosen, arguments.seeds)
    write_page(arguments.page, mall, chosen, candidates, found, arguments.seeds)
    print(arguments.page.read_text())


if __name__ == "__main__":
    main()
