#!/usr/bin/python3
"""docs/results/vector_field_slam.md: simulated runs from the experiment's CSV files, and replays of recordings."""
import argparse
import csv
import json
import math
import pathlib
import statistics
import subprocess

import matplotlib
matplotlib.use("Agg")
import numpy as np
import yaml
from matplotlib import pyplot

import vector_field_slam_recordings as recordings

NAMES = {"odometry": "odometry alone", "raw": "direct triangulation", "ekf": "`solver: ekf`",
         "eseif": "`solver: eseif` (default)",
         "eseif_shared_nodes": "`relocation: shared_nodes`",
         "eseif_underweighted": "`underweighting: 4`", "ekf_underweighted": "`solver: ekf`, `underweighting: 4`",
         "eseif_linear": "`solver: eseif`, `underweighting: 0`",
         "eseif_paper": "the paper's: `relocation: blank`, `recovery_rings: 0`, `underweighting: 0`",
         "eseif_background": "default with `background_period: 100`",
         "eseif_corrected_at_once": "`solver: batch`, online estimates",
         "batch": "`solver: batch`, whole trajectory at the end"}
VARIANTS = {"eseif": {"solver": "eseif", "background_period": 0}, "ekf": {"solver": "ekf", "background_period": 0},
            "eseif_linear": {"solver": "eseif", "background_period": 0, "underweighting": 0.0},
            "eseif_paper": {"solver": "eseif", "background_period": 0, "relocation": "blank", "recovery_rings": 0,
                            "underweighting": 0.0},
            "eseif_corrected_at_once": {"solver": "batch"}}
COLOURS = {"odometry": "tab:gray", "raw": "tab:brown", "ekf": "tab:blue", "eseif": "tab:red", "eseif_paper": "tab:orange",
           "batch": "tab:green", "eseif_corrected_at_once": "tab:purple"}


def mean(values):
    values = [v for v in values if v is not None and math.isfinite(v)]
    return statistics.mean(values) if values else math.nan


def cell(value, scale=1.0, digits=1):
    return "-" if math.isnan(value) else f"{scale * value:.{digits}f}"


# ---- simulated runs

def read(file):
    runs = {}
    with open(file) as f:
        for row in csv.DictReader(f):
            runs.setdefault(row["solver"], []).append(row)
    return runs


def simulated_table(runs):
    lines = ["| solver | error, aligned [cm] | unaligned [cm] | inside the 90 % ellipse, aligned | unaligned "
             "| NEES of (x, y), aligned; 2 is ideal | unaligned | runs |", "|---|---|---|---|---|---|---|---|"]
    for solver, name in NAMES.items():
        rows = runs.get(solver, [])
        if not rows:
            continue

        def column(key, scale, digits):
            return cell(mean([float(r[key]) for r in rows]), scale, digits)

        lines.append(f"| {name} | {column('aligned_m', 100, 1)} | {column('unaligned_m', 100, 1)} | "
                     f"{column('share_inside', 100, 0)} % | {column('share_unaligned', 100, 0)} % | "
                     f"{column('nees_position', 1, 1)} | {column('nees_unaligned', 1, 1)} | {len(rows)} |".replace("- %", "-"))
    return "\n".join(lines)


def by_run(runs):
    """The same for each world of its own."""
    worlds = list(dict.fromkeys(row["run"] for row in runs["odometry"]))
    return "\n\n".join(f"{world}:\n\n" + simulated_table({solver: [r for r in rows if r["run"] == world]
                                                          for solver, rows in runs.items()}) for world in worlds)


def plot_simulated(runs, file, label):
    figure, axes = pyplot.subplots(figsize=(7, 4))
    for solver in COLOURS:
        by_run = {}
        for row in runs.get(solver, []):
            by_run.setdefault(row["run"], []).append(100.0 * float(row["aligned_m"]))
        axes.plot(range(1, len(by_run) + 1), [mean(v) for v in by_run.values()], "o-", label=solver,
                  color=COLOURS[solver])
    axes.set(xlabel=label, ylabel="mean position error, aligned [cm]", yscale="log")
    axes.legend(ncol=4, fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16))
    axes.grid(True, alpha=0.3)
    save(figure, file)


def save(figure, file):
    figure.tight_layout()
    figure.savefig(file, dpi=80)
    pyplot.close(figure)


# ---- recordings

class Run:
    """One recording with its odometry and readings, as a bag, and what came of it by variant."""

    def __init__(self, work, name, config, odometry, fields, readings, truth, sort=False, **changes):
        self.folder, self.config, self.truth, self.odometry, self.changes = work / name, config, truth, odometry, changes
        self.folder.mkdir(parents=True, exist_ok=True)
        self.bag = self.folder / "run.bag"
        if self.bag.exists():
            return
        files = [recordings.write_table(self.folder / f"{kind}.csv", header, rows) for kind, header, rows in (
            ("odom", recordings.POSES, odometry), ("measurements", "stamp_s," + ",".join(fields), readings),
            ("truth", recordings.POSES, truth))]
        run("field_bags", "csv_to_bag", "--odom", files[0], "--measurements", files[1], "--truth", files[2], "--output",
            self.bag, *(["--sort"] if sort else []))

    def replay(self, variant):
        """Folder of the replay's files; of the batch, its trajectory at the end takes the estimate's place."""
        output = self.folder / variant
        if (output / "summary.json").exists():
            return output
        values = yaml.safe_load(self.config.read_text())
        values.update(VARIANTS[variant], **self.changes)
        for key, value in zip(("initial_pose_x", "initial_pose_y", "initial_pose_a"), self.truth[0, 1:]):
            values[key] = float(value)
        config = self.folder / f"{variant}.yaml"
        config.write_text(yaml.safe_dump(values))
        run("vector_field_slam", "vector_field_slam_replay", "--bag", self.bag, "--config", config, "--output", output)
        return output

    def errors(self, variant):
        """Of a variant or of odometry alone: aligned, unaligned, share, nees, nis."""
        file = self.folder / f"{variant}.json"
        if not file.exists():
            estimate = (f"odom:{self.bag}:/odom" if variant == "odometry" else self.replay(variant) / "estimate.csv")
            found = {align: self.evaluate(estimate, align) for align in ("none", "best")}
            none = found["none"]
            result = {"aligned": found["best"]["position_error_mean_m"], "unaligned": none["position_error_mean_m"],
                      "share": none.get("share_inside_90_ellipse"), "nees": none.get("nees")}
            if variant != "odometry":
                summary = json.loads((self.folder / variant / "summary.json").read_text())
                result["nis"] = summary["nis_per_dof"]
            file.write_text(json.dumps(result))
        return json.loads(file.read_text())

    def evaluate(self, estimate, align):
        answer = self.folder / "eval.json"
        source = self.folder / "truth.csv"
        if str(estimate).startswith("odom:"):  # odometry is a baseline: laid from the true start
            some = self.replay("eseif") / "estimate.csv"
            run("field_core", "field_eval", "--truth", source, "--estimate", some, "--baseline", f"odometry={estimate}",
                "--align", align, "--json", answer)
        else:
            run("field_core", "field_eval", "--truth", source, "--estimate", estimate, "--align", align, "--json", answer)
        found = {t["name"]: t for t in json.loads(answer.read_text())["trajectories"]}
        return found["odometry" if str(estimate).startswith("odom:") else "estimate"]


def run(package, program, *arguments):
    command = ["nice", "rosrun", package, program] + [str(a) for a in arguments]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(" ".join(command) + "\n" + done.stderr)


def plaza(data, work, config, seeds):
    """As recorded, and with the odometry's heading drifting by 0.5 degree per metre, to the left or (even seeds) right, and noise
    of 1 cm and 0.3 degree per square root of a metre."""
    folder = data / "plaza1"
    odometry, truth = (recordings.read_poses(folder / f"{n}.csv") for n in ("odom", "truth"))
    fields, readings = recordings.read_measurements(folder / "measurements.csv")
    yield "as recorded", [Run(work, "plaza1", config, odometry, fields, readings, truth, True)]
    # A drift of k rad/m over L = 10 m, by random turns of variance 2 alpha2 d^2 each step of d (between readings): alpha2 =
    # k^2 L / (2 d).
    drift = math.radians(0.5)
    step = np.hypot(*np.diff(odometry[:, 1:3], axis=0).T).sum() / len(readings)
    runs = []
    for seed in range(1, seeds + 1):
        drifting = recordings.with_heading_drift(odometry, drift if seed % 2 else -drift)
        drifting = recordings.with_noise(drifting, np.random.default_rng(seed), 0.01, 0.005)
        runs.append(Run(work, f"plaza1_drift_{seed}", config, drifting, fields, readings, truth, True,
                        odom_alpha2=float(drift**2 * 10.0 / (2.0 * step))))
    yield "drifting", runs


def utias(data, work, config, seeds):
    """Wheel odometry of five robots under simulated beacons, read twice a second."""
    for robot in range(1, 6):
        folder = data / "utias_ds6" / f"robot{robot}"
        odometry, truth = (recordings.read_poses(folder / f"{n}.csv") for n in ("odom", "truth"))
        stamps = np.arange(truth[0, 0], truth[-1, 0], 0.5)
        runs = []
        for seed in range(1, seeds + 1):
            z = recordings.beacon_readings(recordings.at(truth, stamps), np.random.default_rng(seed))
            runs.append(Run(work, f"robot{robot}_{seed}", config, odometry, ["a_x", "a_y", "b_x", "b_y"],
                            np.c_[stamps, z], truth))
        yield f"robot {robot}", runs


def walks(data, work, config, seeds):
    """Magnetometer walks; odometry is the visual-inertial pose with noise on its increments."""
    for name in ("eight", "square", "library", "mall"):
        table = np.genfromtxt(data / "mag_arkit" / f"{name}.csv", delimiter=",", names=True)
        truth = np.c_[table["t_s"], table["x_m"], table["y_m"], table["theta_rad"]]
        readings = np.c_[table["t_s"], table["bf_uT"], table["bl_uT"], table["bu_uT"]]
        runs = []
        for seed in range(1, seeds + 1):
            odometry = recordings.with_noise(truth, np.random.default_rng(seed), 0.05, 0.05)
            runs.append(Run(work, f"{name}_{seed}", config, odometry, ["mag_x", "mag_y", "mag_z"], readings, truth))
        yield name, runs


def recorded_table(groups, variants):
    names = {**NAMES, "eseif": "`solver: eseif`"}  # with what the recording's configuration says
    lines = ["| run | solver | mean error [m] | aligned [m] | odometry's by this | inside the 90 % ellipse | NEES (x, y, yaw), 3 is ideal "
             "| NIS per dof | runs |", "|---|---|---|---|---|---|---|---|---|"]
    for name, runs in groups:
        alone = mean([r.errors("odometry")["unaligned"] for r in runs])
        for variant in ("odometry",) + variants:
            found = [r.errors(variant) for r in runs]

            def column(key, scale=1.0, digits=2):
                return cell(mean([e.get(key) for e in found]), scale, digits)

            error = mean([e["unaligned"] for e in found])
            share = column("share", 100, 0) if variant != "odometry" else "-"
            lines.append(f"| {name} | {names[variant]} | {error:.2f} | {column('aligned')} | {alone / error:.1f} | "
                         f"{share} | {column('nees', 1, 1) if variant != 'odometry' else '-'} | {column('nis')} | {len(runs)} |")
    return "\n".join(lines)


def plot_paths(groups, variants, file):
    """The first run of each group: truth, odometry alone, estimates."""
    figure, all_axes = pyplot.subplots(1, len(groups), figsize=(4.2 * len(groups), 4.2), squeeze=False)
    for axes, (name, runs) in zip(all_axes[0], groups):
        first = runs[0]
        axes.plot(first.truth[:, 1], first.truth[:, 2], color="black", linewidth=0.8, label="truth")
        x, y, yaw = first.truth[0, 1:]
        odometry = first.odometry - np.r_[0.0, first.odometry[0, 1:3], 0.0]
        turn = yaw - first.odometry[0, 3]
        c, s = math.cos(turn), math.sin(turn)
        axes.plot(x + c * odometry[:, 1] - s * odometry[:, 2], y + s * odometry[:, 1] + c * odometry[:, 2],
                  color=COLOURS["odometry"], linewidth=0.6, label="odometry")
        for variant in variants:
            poses = np.loadtxt(first.replay(variant) / "estimate.csv", delimiter=",", skiprows=1)
            axes.plot(poses[:, 1], poses[:, 2], color=COLOURS[variant], linewidth=0.6, label=variant)
        axes.set(title=name, aspect="equal", xlabel="x [m]", ylabel="y [m]")
        margin = 0.2 * np.ptp(first.truth[:, 1:3], axis=0).max()
        low, high = first.truth[:, 1:3].min(axis=0) - margin, first.truth[:, 1:3].max(axis=0) + margin
        axes.set_xlim(low[0], high[0])
        axes.set_ylim(low[1], high[1])
    all_axes[0][0].legend(fontsize=7)
    save(figure, file)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", required=True, type=pathlib.Path)
    parser.add_argument("--work", required=True, type=pathlib.Path, help="nine.csv and iec.csv, and what replays leave")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    data, work, output = arguments.data, arguments.work, arguments.output
    output.mkdir(parents=True, exist_ok=True)
    root = pathlib.Path(__file__).resolve().parent.parent
    text = (root / "tools" / "vector_field_slam_results.md.in").read_text()
    values = {}
    for name, label in (("nine", "run (rising multipath)"), ("iec", "run (corner and heading)")):
        runs = read(work / f"{name}.csv")
        plot_simulated(runs, output / f"vector_field_slam_{name}.png", label)
        values[name] = simulated_table(runs)
    values["hall"] = by_run(read(work / "hall.csv"))
    parts = {"plaza": ("plaza1", ("eseif_corrected_at_once", "eseif", "ekf", "eseif_paper"), plaza),
             "utias": ("utias_ds6", ("eseif", "ekf", "eseif_paper"), utias),
             "walks": ("mag_arkit", ("eseif", "ekf", "eseif_linear"), walks)}
    for part, (recording, variants, make) in parts.items():
        if not (data / recording).is_dir():
            values[part] = f"(not run: no recording `{recording}`)"
            continue
        groups = list(make(data, work, root / "config" / "recordings" / f"{recording}.vector_field_slam.yaml", arguments.seeds))
        values[part] = recorded_table(groups, variants)
        plot_paths(groups, variants[:2], output / f"vector_field_slam_{part}.png")
    (output / "vector_field_slam.md").write_text(text.format(**values))


if __name__ == "__main__":
    main()
