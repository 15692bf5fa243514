#!/usr/bin/python3
"""Replays bundled bags through gp_localize; prints one table and draws the pictures."""
import argparse
import csv
import json
import pathlib
import statistics
import subprocess
import sys

import yaml

# bag, the field whose map is drawn
BAGS = [("office_wifi", "ap1"), ("hall_light", "light_lux"), ("warehouse_magnetic", "mag_norm")]
COLUMNS = ["mean", "RMSE", "95 %", "final", "in 90 %", "steps/s", "x real time"]
SEED = 1


def run(*command):
    """Runs a program of the suite; its one-line error is the user's answer."""
    done = subprocess.run(list(command), stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"demo: '{' '.join(map(str, command))}' failed with exit code {done.returncode}")
    return done.stdout


def find(package):
    return pathlib.Path(run("rospack", "find", package).strip())


def variants(config, directory):
    """The shipped configuration, and the paper's shared sample paths under the same parameters."""
    yield "gp_localize, a map per particle", config
    values = yaml.safe_load(config.read_text())
    values["map_hypotheses"] = "sample_paths"
    paper = directory / "sample_paths.yaml"
    paper.write_text("# written by demo.py: the shipped configuration with the paper's sample paths\n"
                     + yaml.safe_dump(values))
    yield "gp_localize, the paper's paths", paper


def speed(directory, duration):
    with open(directory / "timing.csv") as f:
        seconds = [float(row["step_s"]) for row in csv.DictReader(f)]
    return 1.0 / statistics.mean(seconds), duration / sum(seconds)


def row_of(name, errors, directory=None, duration=None):
    cells = [f"{errors[k]:.2f}" for k in ("position_error_mean_m", "position_error_rmse_m",
                                          "position_error_p95_m", "position_error_final_m")]
    inside = errors.get("share_inside_90_ellipse")
    cells.append("-" if inside is None else f"{100 * inside:.0f} %")
    if directory is None:
        return [name] + cells + ["-", "-"]
    per_second, real_time = speed(directory, duration)
    return [name] + cells + [f"{per_second:.0f}", f"{real_time:.0f}"]


def evaluate(bag, field, unit, output, title):
    """field_eval over one replay, with odometry beside it; returns the numbers by name."""
    file = output / "errors.json"
    run("rosrun", "field_core", "field_eval", "--truth", f"{bag}:/ground_truth",
        "--estimate", output / "estimate.csv",
        "--baseline", f"odometry=odom:{bag}:/odom", "--baseline", f"best=scaled:{bag}:/odom",
        "--json", file, "--plot", output / "errors.png", "--map", output / f"field_{field}.csv",
        "--map-unit", unit, "--title", title)
    result = json.loads(file.read_text())
    return {t["name"]: t for t in result["trajectories"]}, result["duration_s"]


def replay(name, field, output):
    bag = find("field_bags") / "bags" / f"{name}.bag"
    config = find("field_config") / "bags" / f"{name}.gp_localize.yaml"
    unit = str(yaml.safe_load(config.read_text())["fields"][field].get("unit", "1"))
    rows = []
    output.mkdir(parents=True, exist_ok=True)
    for number, (title, file) in enumerate(variants(config, output)):
        directory = output / ("particle_maps", "sample_paths")[number]
        run("rosrun", "gp_localize", "gp_localize_replay", "--bag", bag, "--config", file,
            "--output", directory, "--seed", str(SEED))
        errors, duration = evaluate(bag, field, unit, directory, f"{name}: {title}, field {field}")
        if not rows:
            best = errors["best"]
            rows.append(row_of("odometry alone", errors["odometry"]))
            rows.append(row_of(f"odometry x {best['translation_scale']:.3f} (best in hindsight)", best))
        rows.append(row_of(title, errors["estimate"], directory, duration))
        print(f"{name}: {title}: {directory}/errors.png", file=sys.stderr)
    return rows


def print_table(results):
    width = max(len(row[0]) for rows in results.values() for row in rows) + 2
    print("\nposition error [m]".ljust(width + 1) + "".join(c.rjust(13) for c in COLUMNS))
    for name, rows in results.items():
        print(f"\n{name}")
        for row in rows:
            print(("  " + row[0]).ljust(width) + "".join(c.rjust(13) for c in row[1:]))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    output = parser.parse_args().output
    print_table({name: replay(name, field, output / name) for name, field in BAGS})
    print(f"\npictures and all numbers: {output}")


if __name__ == "__main__":
    main()
