#!/usr/bin/python3
"""Tables and plot of docs/results/vector_field_slam.md from the experiments' CSV files."""
import argparse
import csv
import math
import pathlib
import statistics

import matplotlib
matplotlib.use("Agg")
from matplotlib import pyplot

NAMES = {"odometry": "odometry alone", "raw": "direct triangulation", "ekf": "`solver: ekf`",
         "eseif": "`solver: eseif` (default)",
         "eseif_shared_nodes": "`relocation: shared_nodes`",
         "eseif_paper": "the paper's: `relocation: blank`, `recovery_rings: 0`",
         "eseif_background": "default with `background_period: 100`",
         "eseif_corrected_at_once": "`solver: batch`, online estimates",
         "batch": "`solver: batch`, whole trajectory at the end"}


def read(file):
    runs = {}
    with open(file) as f:
        for row in csv.DictReader(f):
            runs.setdefault(row["solver"], []).append(row)
    return runs


def mean(rows, key):
    values = [float(r[key]) for r in rows]
    return statistics.mean(values) if values else math.nan


def table(runs):
    lines = ["| solver | aligned [cm] | unaligned [cm] | inside the 90 % ellipse | NEES of (x, y), 2 is ideal | step [us] |",
             "|---|---|---|---|---|---|"]
    for solver, name in NAMES.items():
        rows = runs.get(solver, [])
        if not rows:
            continue

        def cell(key, scale, digits):
            value = scale * mean(rows, key)
            return "-" if math.isnan(value) else f"{value:.{digits}f}"

        lines.append(f"| {name} | {cell('aligned_m', 100, 1)} | {cell('unaligned_m', 100, 1)} | "
                     f"{cell('share_inside', 100, 0)} | {cell('nees_position', 1, 1)} | {cell('step_s', 1e6, 0)} |")
    return "\n".join(lines)


def plot(runs, file):
    figure, axes = pyplot.subplots(figsize=(7, 4))
    for solver in ("odometry", "raw", "ekf", "eseif", "eseif_paper", "batch"):
        by_run = {}
        for row in runs.get(solver, []):
            by_run.setdefault(row["run"], []).append(100.0 * float(row["aligned_m"]))
        axes.plot(range(1, len(by_run) + 1), [statistics.mean(v) for v in by_run.values()], "o-", label=solver)
    axes.set(xlabel="run (rising multipath)", ylabel="mean position error, aligned [cm]", yscale="log")
    axes.legend(ncol=2)
    axes.grid(True, alpha=0.3)
    figure.tight_layout()
    figure.savefig(file, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nine", required=True)
    parser.add_argument("--iec", required=True)
    parser.add_argument("--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    nine, iec = read(arguments.nine), read(arguments.iec)
    plot(nine, arguments.output / "vector_field_slam_nine.png")
    count = {name: len(runs["odometry"]) for name, runs in (("nine", nine), ("iec", iec))}
    (arguments.output / "vector_field_slam.md").write_text(f"""# vector_field_slam: simulated runs

Made by `tools/reproduce_vector_field_slam.sh`; the simulation is `vector_field_slam/test/simulated_run.hpp`. Errors are means over
all samples and runs; aligned: after the rigid motion (no scale) that fits best. Times are those of this machine while it did other
work, estimator only. The paper's figures (real runs, aligned with scale): odometry 26 cm, raw 47, EKF 11, ESEIF 10, batch 8.

## Nine runs of rising multipath ({count['nine']} simulated)

{table(nine)}

![errors by run](vector_field_slam_nine.png)

## IEC room, 5 x 4 m, 21 minutes ({count['iec']} simulated)

The room is empty here, with reflections at its walls only; the twelve runs differ in their seed, not in corner and heading.

{table(iec)}
""")


if __name__ == "__main__":
    main()
