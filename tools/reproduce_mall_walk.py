#!/usr/bin/python3
"""Pedestrians in a mall: maps of the magnetic field and of WiFi from some walks, localization in the others.

Every fourth walk is localized in; the rest are the survey, from which hyperparameters are learned too. The heading at the
start is not known: the phone's frame and the direction to the next surveyed waypoint differ by 0.3 rad (rms over the
walks), so the filter starts with that uncertainty. Nothing is fitted to the walk itself.
"""
import argparse
import csv
import json
import math
import pathlib
import statistics

import yaml

import replays

MAGNETIC = ["mag_norm_uT", "mag_vertical_uT"]
ACCESS_POINTS = 10  # those heard most often in the survey
CONFIG = {"particles": 1000, "mode": "localization", "likelihood_noise_scale": 2.0,
          "odom_alpha1": 0.005, "odom_alpha2": 0.005, "odom_alpha3": 0.02, "odom_alpha4": 0.005,
          "odom_calibration": {"translation_stddev": 0.15, "drift_stddev": 0.01},
          "initial_cov_xx": 0.25, "initial_cov_yy": 0.25, "initial_cov_aa": 0.09}
VARIANTS = {"known map": {}, "known map, level of each field estimated": {"field_offset": {"stddev": 0.5}},
            "known map, heavy tails": {"outlier_share": 0.1}}


def rows(path):
    with open(path) as f:
        return list(csv.DictReader(f))


def survey(walks, file):
    """Readings of these walks where they were taken; returns the fields that are used."""
    readings = []
    for walk in walks:
        for pose, reading in zip(rows(walk / "truth.csv"), rows(walk / "measurements.csv")):
            readings.append({**reading, "x_m": pose["x_m"], "y_m": pose["y_m"]})
    heard = {name: sum(bool(r[name]) for r in readings) for name in readings[0] if name.startswith("ap")}
    fields = MAGNETIC + sorted(sorted(heard, key=heard.get)[-ACCESS_POINTS:])
    with open(file, "w") as f:
        f.write(",".join(["x_m", "y_m"] + fields) + "\n")
        for r in readings:
            if any(r[name] for name in fields):
                f.write(",".join(r[name] for name in ["x_m", "y_m"] + fields) + "\n")
    return fields


def replay(walk, seed, variant, common, output):
    directory = output / f"{walk.name}_{''.join(c if c.isalnum() else '-' for c in variant)}_{seed}"
    result = directory / "result.json"
    if not result.exists():
        directory.mkdir(parents=True, exist_ok=True)
        start = rows(walk / "truth.csv")[0]
        config = directory / "config.yaml"
        config.write_text(yaml.safe_dump({**common, **VARIANTS[variant], "initial_pose_x": float(start["x_m"]),
                                          "initial_pose_y": float(start["y_m"]),
                                          "initial_pose_a": float(start["yaw_rad"])}))
        run = replays.recording(walk, output)
        run.replay(config, seed, directory)
        result.write_text(json.dumps(run.evaluate(directory)[0]))
    return json.loads(result.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--variants", nargs="+", choices=VARIANTS, default=list(VARIANTS))
    for name in ("--data", "--output"):
        parser.add_argument(name, type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    walks = sorted((arguments.data / "mall_walk").glob("path*"))
    localized = walks[3::4]
    arguments.output.mkdir(parents=True, exist_ok=True)
    file, hyper = arguments.output / "survey.csv", arguments.output / "hyper.yaml"
    names = survey([w for w in walks if w not in localized], file)
    if not hyper.exists():
        replays.run("rosrun", "gp_localize", "learn_hyperparameters", "--survey", file, "--fields", ",".join(names),
                    "--starts", 2, "--output", hyper)
    poses = rows(file)
    box = [min(float(p["x_m"]) for p in poses) - 5, min(float(p["y_m"]) for p in poses) - 5,
           max(float(p["x_m"]) for p in poses) + 5, max(float(p["y_m"]) for p in poses) + 5]
    common = {**CONFIG, "fields": yaml.safe_load(hyper.read_text())["fields"], "survey": str(file),
              "support": {"selection": "survey", "size": 200, "region": box}}
    lines = ["| walk | odometry, rms [m] | " + " | ".join(f"{v}, rms [m]" for v in arguments.variants) + " |",
             "| --- |" + " --- |" * (1 + len(arguments.variants))]
    means = {}
    for walk in localized:
        cells = []
        for variant in arguments.variants:
            results = [replay(walk, seed, variant, common, arguments.output)
                       for seed in range(1, arguments.seeds + 1)]
            odometry = results[0]["odometry"]["position_error_rmse_m"]
            error = statistics.median(r["estimate"]["position_error_rmse_m"] for r in results)
            cells.append(f"{error:.2f}")
            means.setdefault(variant, []).append(error)
        means.setdefault("odometry", []).append(odometry)
        lines.append(f"| {walk.name} | {odometry:.2f} | " + " | ".join(cells) + " |")
        print(lines[-1], flush=True)
    rms = {name: math.sqrt(statistics.mean(e * e for e in errors)) for name, errors in means.items()}
    lines.append(f"| all | {rms['odometry']:.2f} | " + " | ".join(f"{rms[v]:.2f}" for v in arguments.variants) + " |")
    (arguments.output / "table.md").write_text("\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
