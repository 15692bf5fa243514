#!/usr/bin/python3
"""What each parameter does to the error and to the time of a step: the bundled bags, replayed with one parameter
changed at a time. Writes a picture per node and a page of tables."""
import argparse
import concurrent.futures
import copy
import csv
import os
import pathlib
import statistics

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import yaml

import replays

COLOURS = {"office_wifi": "#0072b2", "hall_light": "#d55e00", "warehouse_magnetic": "#009e73", "beacons": "#cc79a7"}


def put(values, path, change):
    """Sets values[a][b] of path "a/b" to change(old); "*" stands for every key, a list is changed item by item."""
    head, _, rest = path.partition("/")
    for key in list(values) if head == "*" else [head]:
        if rest:
            inner = values.setdefault(key, {})
            for item in inner if isinstance(inner, list) else [inner]:
                put(item, rest, change)
        elif isinstance(values.get(key), list):
            values[key] = [change(v) for v in values[key]]
        else:
            values[key] = change(values.get(key))


def to(path):
    """A sweep that puts the number itself."""
    return lambda values, x: put(values, path, lambda _: x)


def times(*paths):
    """A sweep that multiplies what is configured."""
    def change(values, x):
        for path in paths:
            put(values, path, lambda old: old * x)
    return change


def spacing(values, x):
    """Another lattice over the same ground."""
    grid = values["grid"]
    extent = [(n - 1) * grid["spacing"] for n in grid["size"]]
    grid["spacing"] = x
    grid["size"] = [int(round(e / x)) + 1 for e in extent]


ODOMETRY = times(*(f"odom_alpha{i}" for i in (1, 2, 3, 4)))

# node: bags, seeds matter, [(title, change, values)]
SWEEPS = {
    "gp_localize": (["office_wifi", "hall_light"], True, [
        ("particles", to("particles"), [50, 100, 200, 400, 800, 1600]),
        ("support/size", to("support/size"), [10, 20, 40, 80, 160]),
        ("slice_size", to("slice_size"), [2, 5, 10, 20, 50]),
        ("likelihood_noise_scale", to("likelihood_noise_scale"), [1, 1.4, 2, 3, 4]),
        ("odom_alpha1..4, times", ODOMETRY, [0.1, 0.3, 1, 3, 10]),
        ("length_scales, times", times("fields/*/length_scales"), [0.5, 0.7, 1, 1.4, 2]),
        ("diversity/paths", to("diversity/paths"), [0, 25, 50, 100])]),
    "gmrf_slap": (["office_wifi"], True, [
        ("particles", to("particles"), [50, 100, 200, 400, 800]),
        ("grid/spacing [m]", spacing, [1.0, 1.25, 1.5, 2.0, 3.0]),
        ("lag", to("lag"), [1, 10, 30, 60, 120]),
        ("likelihood_noise_scale", to("likelihood_noise_scale"), [1, 1.4, 2, 3, 4]),
        ("odom_alpha1..4, times", ODOMETRY, [0.1, 0.3, 1, 3, 10]),
        ("bandwidth, times", times("fields/*/hyperparameters/bandwidth"), [0.5, 0.7, 1, 1.4, 2])]),
    "vector_field_slam": (["beacons", "warehouse_magnetic"], False, [
        ("cell_size [m]", to("cell_size"), [0.5, 0.75, 1, 1.5, 2]),
        ("interpolation_stddev, times", times("channels/*/interpolation_stddev"), [0.1, 0.3, 1, 3, 10]),
        ("noise_stddev, times", times("channels/*/noise_stddev"), [0.1, 0.3, 1, 3, 10]),
        ("prior_stddev, times", times("channels/*/prior_stddev"), [0.1, 0.3, 1, 3, 10]),
        ("odom_alpha1..4, times", ODOMETRY, [0.1, 0.3, 1, 3, 10]),
        ("recovery_rings", to("recovery_rings"), [1, 2])]),
}


def measure(run, change, x, seeds, directory):
    """Mean position error of each seed [m], share inside the 90 % ellipse and median time of a step [ms]."""
    directory.mkdir(parents=True, exist_ok=True)
    values = copy.deepcopy(yaml.safe_load(run.config.read_text()))
    change(values, x)
    config = directory / "config.yaml"
    config.write_text(yaml.safe_dump(values))
    errors, shares, steps = [], [], []
    for seed in range(1, seeds + 1):
        result = directory / str(seed)
        if not (result / "errors.json").exists():
            run.replay(config, seed, result)
        estimate = run.evaluate(result)[0]["estimate"]
        errors.append(estimate["position_error_mean_m"])
        shares.append(estimate["share_inside_90_ellipse"])
        with open(result / "timing.csv") as file:
            steps.append(1e3 * statistics.median(float(row["step_s"]) for row in csv.DictReader(file)))
    return errors, statistics.mean(shares), min(steps)


def draw(node, sweeps, found, file):
    columns = (len(sweeps) + 1) // 2
    figure, axes = plt.subplots(2, columns, figsize=(4 * columns, 6.4), constrained_layout=True)
    for axis in axes.flat[len(sweeps):]:
        axis.set_axis_off()
    for i, (axis, (title, _, values)) in enumerate(zip(axes.flat, sweeps)):
        cost = axis.twinx()
        if i % columns == 0:
            axis.set_ylabel("mean position error [m]")
        if i % columns == columns - 1 or i == len(sweeps) - 1:
            cost.set_ylabel("dotted: step [ms]")
        for bag, by_title in found.items():
            errors = [by_title[title][x][0] for x in values]
            means = [statistics.mean(e) for e in errors]
            axis.plot(values, means, "o-", color=COLOURS[bag], ms=4, label=bag)
            axis.fill_between(values, [min(e) for e in errors], [max(e) for e in errors], color=COLOURS[bag], alpha=0.15)
            cost.plot(values, [by_title[title][x][2] for x in values], ":", color=COLOURS[bag], lw=1.5)
        if min(values) > 0:
            axis.set_xscale("log")
        axis.set_xticks(values, [f"{x:g}" for x in values])
        axis.minorticks_off()
        axis.set_yscale("log")
        axis.yaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        low, high = axis.get_ylim()
        within_a_decade = matplotlib.ticker.FormatStrFormatter("%g") if high < 10 * low else matplotlib.ticker.NullFormatter()
        axis.yaxis.set_minor_formatter(within_a_decade)
        axis.tick_params(axis="y", which="minor", labelsize=7)
        cost.set_ylim(bottom=0)
        axis.set_title(title, fontsize=10)
        axis.grid(alpha=0.3)
    axes.flat[0].legend(fontsize=8)
    figure.suptitle(f"{node}: one parameter at a time, the others as shipped", fontsize=11)
    figure.savefig(file, dpi=90)
    plt.close(figure)


def table(sweeps, found):
    text = "| parameter | value |" + "".join(f" {bag}: error [m] | in 90 % | step [ms] |" for bag in found) + "\n"
    text += "|---|---|" + "---|---|---|" * len(found) + "\n"
    for title, _, values in sweeps:
        for x in values:
            cells = [title, f"{x:g}"]
            for by_title in found.values():
                errors, share, step = by_title[title][x]
                spread = f" ({min(errors):.2f} to {max(errors):.2f})" if len(errors) > 1 else ""
                cells += [f"{statistics.mean(errors):.2f}{spread}", f"{100 * share:.0f} %", f"{step:.3g}"]
            text += "| " + " | ".join(cells) + " |\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="of the particle filters")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="replays side by side")
    parser.add_argument("--nodes", nargs="+", default=list(SWEEPS), choices=list(SWEEPS))
    parser.add_argument("--output", type=pathlib.Path, required=True, help="replays; those that are done are kept")
    parser.add_argument("--docs", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    for node in arguments.nodes:
        bags, random, sweeps = SWEEPS[node]
        seeds = arguments.seeds if random else 1
        jobs = [(bag, title, change, x) for bag in bags for title, change, values in sweeps for x in values]

        def done(job, node=node, seeds=seeds):
            bag, title, change, x = job
            name = "".join(c if c.isalnum() else "_" for c in title)
            return measure(replays.bundled(bag, node), change, x, seeds, arguments.output / node / bag / f"{name}_{x:g}")
        with concurrent.futures.ThreadPoolExecutor(max_workers=arguments.jobs) as pool:
            results = list(pool.map(done, jobs))
        found = {bag: {title: {} for title, _, _ in sweeps} for bag in bags}
        for (bag, title, _, x), result in zip(jobs, results):
            found[bag][title][x] = result
        draw(node, sweeps, found, arguments.docs / "images" / f"tuning_{node}.png")
        head = (f"# {node}: one parameter at a time\n\nWritten by `tools/tuning.sh`"
                f"{f' ({seeds} seeds: mean, smallest and largest)' if random else ''}; the picture is "
                f"[here](../images/tuning_{node}.png). The time is the median step of the fastest replay.\n\n")
        (arguments.docs / "results" / f"tuning_{node}.md").write_text(head + table(sweeps, found))


if __name__ == "__main__":
    main()
