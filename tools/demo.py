#!/usr/bin/python3
"""Replays bundled bags through the estimators; prints one table and draws the pictures."""
import argparse
import concurrent.futures
import os
import pathlib
import sys

import replays

# bag, the field whose map is drawn
BAGS = [("office_wifi", "ap1"), ("hall_light", "light_lux"), ("warehouse_magnetic", "mag_norm"),
        ("beacons", "spot1_x")]
COLUMNS = ["mean", "RMSE", "95 %", "final", "in 90 %", "steps/s", "x real time"]
SEED = 1


def row_of(name, errors, speed=("-", "-")):
    cells = [f"{errors[f'position_error_{k}_m']:.2f}" for k in ("mean", "rmse", "p95", "final")]
    inside = errors.get("share_inside_90_ellipse")
    cells.append("-" if inside is None else f"{100 * inside:.0f} %")
    return [name] + cells + [s if s == "-" else f"{s:.0f}" for s in speed]


def variants(bag, node, output):
    """Title, run, configuration and folder of what is shown: the shipped configuration, and for
    gp_localize the paper's shared sample paths under the same parameters."""
    run = replays.bundled(bag, node)
    if run is None:
        return
    if node != "gp_localize":
        yield node, run, run.config, output / node
        return
    output.mkdir(parents=True, exist_ok=True)
    yield "gp_localize, a map per particle", run, run.config, output / "particle_maps"
    yield ("gp_localize, the paper's paths", run,
           run.variant(output, "sample_paths", map_hypotheses="sample_paths"), output / "sample_paths")


def replay(bag, field, nodes, output):
    """The rows of one bag."""
    rows = []
    for node in nodes:
        for title, run, config, directory in variants(bag, node, output):
            run.replay(config, SEED, directory)
            errors, duration = run.evaluate(directory, field, f"{bag}: {title}")
            if not rows:
                best = errors["odometry, best scale"]
                scale = f"odometry x {best['translation_scale']:.3f}, best in hindsight"
                rows += [row_of("odometry alone", errors["odometry"]), row_of(scale, best)]
            rows.append(row_of(title, errors["estimate"], replays.speed(directory, duration)))
            print(f"{bag}: {title}: {directory}/errors.png", file=sys.stderr)
    return rows


def print_table(results):
    width = max(len(row[0]) for rows in results.values() for row in rows) + 2
    print("\n" + "position error [m]".ljust(width) + "".join(c.rjust(13) for c in COLUMNS))
    for name, rows in results.items():
        if not rows:
            continue
        print(f"\n{name}")
        for row in rows:
            print(("  " + row[0]).ljust(width) + "".join(c.rjust(13) for c in row[1:]))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--nodes", nargs="+", default=["gp_localize"], help="estimators to replay")
    arguments = parser.parse_args()
    output = arguments.output
    with concurrent.futures.ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        rows = pool.map(lambda bag: replay(*bag, arguments.nodes, output / bag[0]), BAGS)
        print_table(dict(zip([name for name, _ in BAGS], rows)))
    print(f"\npictures and all numbers: {output}")


if __name__ == "__main__":
    main()
