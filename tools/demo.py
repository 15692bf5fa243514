#!/usr/bin/python3
"""Replays bundled bags through gp_localize; prints one table and draws the pictures."""
import argparse
import concurrent.futures
import os
import pathlib
import sys

import replays

# bag, the field whose map is drawn
BAGS = [("office_wifi", "ap1"), ("hall_light", "light_lux"), ("warehouse_magnetic", "mag_norm")]
COLUMNS = ["mean", "RMSE", "95 %", "final", "in 90 %", "steps/s", "x real time"]
SEED = 1


def row_of(name, errors, speed=("-", "-")):
    cells = [f"{errors[f'position_error_{k}_m']:.2f}" for k in ("mean", "rmse", "p95", "final")]
    inside = errors.get("share_inside_90_ellipse")
    cells.append("-" if inside is None else f"{100 * inside:.0f} %")
    return [name] + cells + [s if s == "-" else f"{s:.0f}" for s in speed]


def replay(name, field, output):
    """The shipped configuration, and the paper's shared sample paths under the same parameters."""
    output.mkdir(parents=True, exist_ok=True)
    run = replays.bundled(name)
    variants = [("gp_localize, a map per particle", run.config, output / "particle_maps"),
                ("gp_localize, the paper's paths",
                 run.variant(output, map_hypotheses="sample_paths"), output / "sample_paths")]
    rows = []
    for title, config, directory in variants:
        run.replay(config, SEED, directory)
        errors, duration = run.evaluate(directory, field, f"{name}: {title}")
        if not rows:
            best = errors["odometry, best scale"]
            rows.append(row_of("odometry alone", errors["odometry"]))
            rows.append(row_of(f"odometry x {best['translation_scale']:.3f}, best in hindsight", best))
        rows.append(row_of(title, errors["estimate"], replays.speed(directory, duration)))
        print(f"{name}: {title}: {directory}/errors.png", file=sys.stderr)
    return rows


def print_table(results):
    width = max(len(row[0]) for rows in results.values() for row in rows) + 2
    print("\n" + "position error [m]".ljust(width) + "".join(c.rjust(13) for c in COLUMNS))
    for name, rows in results.items():
        print(f"\n{name}")
        for row in rows:
            print(("  " + row[0]).ljust(width) + "".join(c.rjust(13) for c in row[1:]))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    output = parser.parse_args().output
    with concurrent.futures.ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        rows = pool.map(lambda bag: replay(*bag, output / bag[0]), BAGS)
        print_table(dict(zip([name for name, _ in BAGS], rows)))
    print(f"\npictures and all numbers: {output}")


if __name__ == "__main__":
    main()
