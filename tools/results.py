#!/usr/bin/python3
"""Replays the bundled bags and the published recordings over several seeds; writes a Markdown table."""
import argparse
import concurrent.futures
import os
import pathlib
import statistics
import sys

import replays

NODES = ["gp_localize", "vector_field_slam", "gmrf_slap"]
BAGS = ["office_wifi", "hall_light", "warehouse_magnetic", "beacons"]
RECORDINGS = ["gpl_pioneer", "gpl_ieq", "gpl_wss"]
# What the paper's shared sample paths cannot have; the calibration works with both.
PAPER = {"map_hypotheses": "sample_paths", "variance_dof": 0, "candidates": {}}
HEADER = ("| run | method | mean error [m] | min to max over seeds | RMSE [m] | 95 % [m] | in 90 % ellipse |\n"
          "|---|---|---|---|---|---|---|\n")


def row(run, method, all_errors):
    means = [e["position_error_mean_m"] for e in all_errors]
    inside = [e.get("share_inside_90_ellipse") for e in all_errors]
    cells = [run, method, f"{statistics.mean(means):.2f}",
             f"{min(means):.2f} to {max(means):.2f}" if len(means) > 1 else "-",
             f"{statistics.mean(e['position_error_rmse_m'] for e in all_errors):.2f}",
             f"{statistics.mean(e['position_error_p95_m'] for e in all_errors):.2f}",
             "-" if None in inside else f"{100 * statistics.mean(inside):.0f} %"]
    return "| " + " | ".join(cells) + " |\n"


def variants_of(run, output):
    """(what the row says, configuration) of one node on one recording."""
    if run.node != "gp_localize":
        return [(run.node, run.config)]
    return [("gp_localize, a map per particle", run.config),
            ("gp_localize, the paper's sample paths", run.variant(output, "sample_paths", **PAPER))]


def rows_of(runs, seeds, output, pool):
    """Rows of one recording under each node; the replays go on side by side, each on one core."""
    output.mkdir(parents=True, exist_ok=True)

    def errors_of(job):
        run, method, config, seed = job
        directory = output / f"{run.node}_{config.stem}_{seed}"
        run.replay(config, seed, directory)
        field = next(iter(run.fields)) if seed == 1 else None
        print(f"{run.name}, {method}, seed {seed}", file=sys.stderr)
        return run.evaluate(directory, field, f"{run.name}: {method}")[0]

    variants = [(run, method, config) for run in runs for method, config in variants_of(run, output)]
    jobs = [(run, method, config, seed) for run, method, config in variants
            for seed in (range(1, seeds + 1) if run.node != "vector_field_slam" else [1])]
    errors = list(pool.map(errors_of, jobs))
    name, scaled = runs[0].name, errors[0]["odometry, best scale"]
    text = row(name, "odometry alone", [errors[0]["odometry"]])
    text += row(name, f"odometry x {scaled['translation_scale']:.3f}", [scaled])
    for _, method, _ in variants:
        text += row(name, method, [e["estimate"] for job, e in zip(jobs, errors) if job[1] == method])
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    recordings = [[run for node in NODES if (run := replays.bundled(name, node))] for name in BAGS]
    for name in RECORDINGS:
        folder = arguments.data / name
        if folder.is_dir():
            recordings.append([replays.recording(folder, arguments.output)])
        else:
            print(f"skipped: {folder} is not there", file=sys.stderr)
    with concurrent.futures.ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        table = HEADER + "".join(
            rows_of(runs, arguments.seeds, arguments.output / runs[0].name, pool) for runs in recordings)
    (arguments.output / "results.md").write_text(table)
    print(table)


if __name__ == "__main__":
    main()
