#!/usr/bin/python3
"""Replays the bundled bags and the published recordings over several seeds; writes a Markdown table."""
import argparse
import concurrent.futures
import os
import pathlib
import statistics
import sys

import replays

BAGS = ["office_wifi", "hall_light", "warehouse_magnetic"]
RECORDINGS = ["gpl_pioneer", "gpl_ieq", "gpl_wss"]
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


def rows_of(run, seeds, output, pool):
    """Rows of one run; the replays go on side by side, each on one core."""
    output.mkdir(parents=True, exist_ok=True)
    variants = [("a map per particle", run.variant(output, map_hypotheses="particle")),
                ("the paper's sample paths", run.variant(output, map_hypotheses="sample_paths"))]

    def errors_of(job):
        method, config, seed = job
        directory = output / f"{config.stem}_{seed}"
        run.replay(config, seed, directory)
        field = next(iter(run.fields)) if seed == 1 else None
        print(f"{run.name}, {method}, seed {seed}", file=sys.stderr)
        return run.evaluate(directory, field, f"{run.name}: {method}")[0]

    jobs = [(method, config, seed) for method, config in variants for seed in range(1, seeds + 1)]
    errors = list(pool.map(errors_of, jobs))
    scaled = errors[0]["odometry, best scale"]
    text = row(run.name, "odometry alone", [errors[0]["odometry"]])
    text += row(run.name, f"odometry x {scaled['translation_scale']:.3f}", [scaled])
    for number, (method, _) in enumerate(variants):
        estimates = [e["estimate"] for e in errors[number * seeds:(number + 1) * seeds]]
        text += row(run.name, method, estimates)
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    runs = [replays.bundled(name) for name in BAGS]
    for name in RECORDINGS:
        folder = arguments.data / name
        if folder.is_dir():
            runs.append(replays.recording(folder, arguments.output))
        else:
            print(f"skipped: {folder} is not there", file=sys.stderr)
    with concurrent.futures.ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        table = HEADER + "".join(
            rows_of(run, arguments.seeds, arguments.output / run.name, pool) for run in runs)
    (arguments.output / "results.md").write_text(table)
    print(table)


if __name__ == "__main__":
    main()
