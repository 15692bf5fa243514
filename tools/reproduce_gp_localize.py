#!/usr/bin/python3
"""The experiments of the GP-Localize paper (tables 1 and 2, traffic, Pioneer, figure 4b) and on known maps, over many seeds.

One rule makes every configuration: hyperparameters by learn_hyperparameters on other data than the run, one support point per
rectangle of length scales over a neutral box, the same odometry noise, likelihood and particles for all.
"""
import argparse
import concurrent.futures
import csv
import json
import math
import os
import pathlib
import statistics
import sys

import matplotlib
import yaml

import gp_localize_page
import gp_localize_traffic
import replays

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of the backend

COMMON = {"particles": 400, "sample_paths": 400, "slice_size": 30, "likelihood_noise_scale": 1.0,
          "likelihood_exponent": 0.25, "diversity": {"paths": 100},
          "map_resolution": 2.0,  # nobody looks at these maps
          "odom_alpha1": 0.00025, "odom_alpha2": 0.00025, "odom_alpha3": 0.005, "odom_alpha4": 0.00025}
# Noise, and the common factor of noise and signal, are learned further during the run.
LEARNED = {"particles": 1000, "candidates": {"noise": [0.25, 1.0], "shared": True}, "variance_dof": 16}
SCALE = {"odom_calibration": {"translation_stddev": 0.2}}
PAPER = {"map_hypotheses": "sample_paths", "slice_size": 10, "likelihood_noise_scale": 2.0, "likelihood_exponent": 1.0}
REFERENCE = "the paper (eq. 12-13)"
ONE_RULE = "a map per particle, scale estimated if need be"
CORRELATED_SURVEY = "map of the other run, correlated, learned further"
METHODS = {
    REFERENCE: PAPER,
    "the paper (eq. 10-11)": {**PAPER, "observation_model": "online_pitc_assimilated"},
    "a map per particle": LEARNED,
    "a map per particle, scale estimated": {**LEARNED, **SCALE},
    ONE_RULE: {**LEARNED, "odom_calibration": {"translation_stddev": 0.2, "calibrated_probability": 0.5}},
    "a map per particle, fixed hyperparameters": {},
    "a map per particle, fixed hyperparameters, scale estimated": SCALE,
    "fields correlated, fixed hyperparameters, scale estimated": SCALE,
    "SoD-Truncate": {**PAPER, "observation_model": "sod_truncate", "subset_size": 10},
    "SoD-Even": {**PAPER, "observation_model": "sod_even", "subset_size": 40},
}
KNOWN = {"mode": "localization", "likelihood_exponent": 1.0}
KNOWN_MAP = {
    "known map (survey)": KNOWN,
    "known map, odometry noise of 100 %": {**KNOWN, "odom_alpha3": 1.0},
    "known map, scale estimated": {**KNOWN, **SCALE},
    "survey, map learned further, scale estimated": {**KNOWN, **SCALE, "mode": "lifelong"},
}
# The fields of a run are one group, learned together.
CORRELATED = "fields correlated, fixed hyperparameters, scale estimated"
# The map of the other run, made under other lighting.
OTHER_MAP = {
    "map of the other run": {"mode": "localization"},
    "map of the other run, level estimated": {"mode": "localization", "field_offset": {"stddev": 0.5, "memory": 100.0}},
    "map of the other run, heavy tails": {"mode": "localization", "outlier_share": 0.1},
    # Where a map says which way is which, the start's heading need not be believed blindly.
    CORRELATED_SURVEY: {**LEARNED, "candidates": {**LEARNED["candidates"], "survey_correlation": [0.3, 0.6, 0.9]},
                        "initial_cov_aa": 0.0025},
}
# Figure 4b: time per step on the Pioneer run, 100 particles and paths.
TIMED = {"GP-Localize (eq. 12-13)": "online_pitc", "GP-Localize (eq. 10-11)": "online_pitc_assimilated",
         "SoD-Truncate": "sod_truncate", "SoD-Even": "sod_even", "full GP": "full_gp", "offline PITC": "offline_pitc",
         "FITC": "fitc", "a map per particle": "particle"}
STARTS = {"exact start": (1e-4, 1e-4), "start +- 2 m, 0.1 rad": (4.0, 0.01)}
# The paper's section 4.3 has a page of its own.
TRAFFIC = "traffic"
WSS = [f"ap{i}_snr" for i in range(1, 7)]
# name: folder, sets of fields, box, survey for hyperparameters or (run, its field) to learn them from
RUNS = {
    "pioneer": ("gpl_pioneer", [["light_pct"]], [-10.5, -3.5, 8.5, 21.5], ("gpl_pioneer2", "light_frac")),
    "pioneer2": ("gpl_pioneer2", [["light_frac"]], [-10.5, -3.5, 8.5, 21.5], ("gpl_pioneer", "light_pct")),
    "ieq": ("gpl_ieq", [["temperature_C", "light_lux"], ["temperature_C"], ["light_lux"]],
            [-11.5, -9.0, 11.0, 8.0], "field_survey.csv"),
    "wss": ("gpl_wss", [WSS] + [[ap] for ap in WSS], [-22.0, -7.5, 23.5, 5.0], "field_survey.csv"),
}


def column(path, name):
    with open(path) as f:
        return [float(row[name]) for row in csv.DictReader(f) if row[name]]


def pose(folder):
    with open(folder / "truth.csv") as f:
        row = next(csv.DictReader(f))
    return [float(row[key]) for key in ("x_m", "y_m", "yaw_rad")]


class Experiment:
    """One recording with the hyperparameters that were learned for it."""

    def __init__(self, name, data, output):
        folder, self.field_sets, self.region, self.source = RUNS[name]
        self.name, self.data, self.folder = name, data, data / folder
        self.output = output / name
        self.output.mkdir(parents=True, exist_ok=True)
        self.run = replays.recording(self.folder, self.output)
        if isinstance(self.source, str):
            self.survey, self.known_map = self.folder / self.source, KNOWN_MAP
            self.fields = self.learn("--survey", self.survey)
        else:
            self.survey, self.known_map = self.output / "other_run.csv", OTHER_MAP
            self.fields = self.from_other_run()

    def learn(self, *arguments, name="hyper"):
        file = self.output / f"{name}.yaml"
        if not file.exists():
            replays.run("rosrun", "gp_localize", "learn_hyperparameters", *arguments, "--output", file)
        return yaml.safe_load(file.read_text())["fields"]

    def group(self, names):
        """`fields` and `coregionalization` of a configuration; the exact likelihood of all measurements."""
        self.learn("--survey", self.survey, "--fields", ",".join(names), "--coregionalize", "all=" + ",".join(names),
                   "--exact-up-to", 800, "--starts", 3, name="correlated")
        return yaml.safe_load((self.output / "correlated.yaml").read_text())

    def from_other_run(self):
        """Length scales and the ratio of noise to signal from the other run, and its readings as a survey. The level of
        the light is another one: mean and spread are those of this run's own readings, for which no position is needed."""
        other, field = self.source
        bag = replays.recording(self.data / other, self.output).bag
        learned = self.learn("--bag", bag, "--fields", field)[field]
        mine = self.field_sets[0][0]
        here = column(self.folder / "measurements.csv", mine)
        there = column(self.data / other / "measurements.csv", field)
        ratio = statistics.pstdev(here) / statistics.pstdev(there)
        x, y = (column(self.data / other / "truth.csv", axis) for axis in ("x_m", "y_m"))
        level = [statistics.mean(here) + ratio * (value - statistics.mean(there)) for value in there]
        rows = [f"{a},{b},{value:.6g}" for a, b, value in zip(x, y, level)]
        self.survey.write_text("\n".join([f"x_m,y_m,{mine}", *rows]) + "\n")
        learned.update(mean=statistics.mean(here), signal_stddev=ratio * learned["signal_stddev"],
                       noise_stddev=ratio * learned["noise_stddev"])
        return {mine: learned}

    def configuration(self, names, method, start):
        fields = {name: self.fields[name] for name in names}
        x0, y0, x1, y1 = self.region
        lengths = [min(field["length_scales"][axis] for field in fields.values()) for axis in (0, 1)]
        points = math.ceil((x1 - x0) * (y1 - y0) / (lengths[0] * lengths[1]))
        x, y, yaw = pose(self.folder)
        position, angle = STARTS[start]
        values = dict(COMMON, fields=fields, initial_pose_x=x, initial_pose_y=y, initial_pose_a=yaw,
                      initial_cov_xx=position, initial_cov_yy=position, initial_cov_aa=angle,
                      support={"selection": "grid", "size": min(120, max(40, points)), "region": self.region})
        values.update({**METHODS, **self.known_map}[method])
        values["initial_cov_aa"] = max(values["initial_cov_aa"], angle)
        if method == CORRELATED:
            values.update(self.group(names))
            values["support"]["size"] = min(values["support"]["size"], 400 // len(names))
        if method in self.known_map:
            values["survey"] = str(self.survey)
        return values

    def folder_of(self, names, method, start, seed):
        text = "_".join([fields_label(names), method, start, str(seed)])
        return self.output / "".join(c if c.isalnum() or c == "_" else "-" for c in text)

    def is_done(self, *job):
        return (self.folder_of(*job) / "result.json").exists()

    def errors(self, names, method, start, seed):
        """field_eval's numbers of one replay; kept in a file."""
        directory = self.folder_of(names, method, start, seed)
        result = directory / "result.json"
        if not result.exists():
            directory.mkdir(exist_ok=True)
            config = directory / "config.yaml"
            config.write_text(yaml.safe_dump(self.configuration(names, method, start)))
            self.run.replay(config, seed, directory)
            trajectories, _ = self.run.evaluate(directory)
            summary = json.loads((directory / "summary.json").read_text())
            trajectories["estimate"]["lost_share"] = summary["lost"] / summary["steps"]
            result.write_text(json.dumps(trajectories))
        return json.loads(result.read_text())

    def step_times(self, model, seed):
        """Seconds of each step, with 100 particles and paths."""
        directory = self.output / f"timing_{model}_{seed}"
        if not (directory / "timing.csv").exists():
            directory.mkdir(exist_ok=True)
            values = self.configuration(self.field_sets[0], "a map per particle, fixed hyperparameters", "exact start")
            values.update(particles=100, sample_paths=100)
            if model != "particle":
                values.update(map_hypotheses="sample_paths", observation_model=model,
                              subset_size=10 if model == "sod_truncate" else 40)
            config = directory / "config.yaml"
            config.write_text(yaml.safe_dump(values))
            self.run.replay(config, seed, directory)
        return column(directory / "timing.csv", "step_s")


def rows_of(name):
    """(fields, method, start) of a run in the order of the page."""
    _, field_sets, _, source = RUNS[name]
    for names in field_sets:
        for start in STARTS:
            for method in METHODS:
                if method != CORRELATED or len(names) > 1:
                    yield names, method, start
            for method in KNOWN_MAP if isinstance(source, str) else OTHER_MAP:
                yield names, method, start


def fields_label(names):
    return "all" if len(names) > 1 else names[0]


def page_order():
    """Keys of all rows of the page."""
    for name in RUNS:
        yield name, "", "", "odometry alone"
        yield name, "", "", "odometry x"
        for names, method, start in rows_of(name):
            yield name, fields_label(names), start, method


def means_of(results):
    return {seed: r["estimate"]["position_error_mean_m"] for seed, r in results.items()}


def cells(experiment, names, method, start, results, reference):
    """`results` and `reference` by seed: of the method, and of the paper's with the same fields and start."""
    means = means_of(results)
    inside = statistics.mean(r["estimate"]["share_inside_90_ellipse"] for r in results.values())
    lost = statistics.mean(r["estimate"]["lost_share"] for r in results.values())
    wins = "-"
    both = [seed for seed in means if seed in reference]
    if both and method != REFERENCE:
        wins = f"{sum(means[seed] < reference[seed] for seed in both)}/{len(both)}"
    means = list(means.values())
    spread = statistics.stdev(means) if len(means) > 1 else 0.0
    return [experiment.name, fields_label(names), start, method, str(len(means)), f"{statistics.median(means):.2f}",
            f"{statistics.mean(means):.2f} +- {spread:.2f}", f"{min(means):.2f} to {max(means):.2f}", wins,
            f"{100 * inside:.0f} %", f"{100 * lost:.0f} %"]


def odometry_rows(experiment, result):
    scaled = result["odometry, best scale"]
    return [[experiment.name, "", "", "odometry alone", "", f"{result['odometry']['position_error_mean_m']:.2f}"] +
            [""] * 5,
            [experiment.name, "", "", f"odometry x {scaled['translation_scale']:.3f}", "",
             f"{scaled['position_error_mean_m']:.2f}"] + [""] * 5]


def measure(experiment, seeds, pool, wanted):
    """Rows of the page. Seeds go on side by side; `wanted` says which replays."""
    rows, reference = [], {}
    for names, method, start in rows_of(experiment.name):
        chosen = [seed for seed in range(1, seeds + 1) if wanted(names, method, start, seed)]
        if not chosen:
            continue
        results = dict(zip(chosen, pool.map(lambda seed: experiment.errors(names, method, start, seed), chosen)))
        if not rows:
            rows += odometry_rows(experiment, results[chosen[0]])
        key = (tuple(names), start)
        if method == REFERENCE:
            reference[key] = means_of(results)
        rows.append(cells(experiment, names, method, start, results, reference.get(key, {})))
        print(" ".join(rows[-1]), file=sys.stderr)
    return rows


def plot_times(experiment, seeds, file):
    """Figure 4b of the paper, and the medians of the first and the last 100 steps. One replay at a time: they are timed."""
    figure, axis = plt.subplots(figsize=(8, 4))
    for label, model in TIMED.items():
        runs = [experiment.step_times(model, seed) for seed in range(1, seeds + 1)]
        steps = [1e3 * statistics.median(step) for step in zip(*runs)]
        print(f"{label}: {statistics.median(steps[:100]):.3g} ms, at the end {statistics.median(steps[-100:]):.3g} ms",
              file=sys.stderr)
        axis.semilogy(steps, label=label, linewidth=0.8)
    axis.set_xlabel("step")
    axis.set_ylabel("time of a step [ms]")
    axis.legend(fontsize=8, ncol=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", nargs="+", choices=[*RUNS, TRAFFIC], default=[*RUNS, TRAFFIC])
    parser.add_argument("--methods", nargs="+", help="only these methods", default=[*METHODS, *KNOWN_MAP, *OTHER_MAP])
    parser.add_argument("--starts", nargs="+", help="only these starts", default=list(STARTS))
    parser.add_argument("--multiple", action="store_true", help="only all fields together")
    parser.add_argument("--done", action="store_true", help="the page from the replays that are kept; no new ones")
    parser.add_argument("--times", type=int, default=3, help="seeds of the time-per-step figure; 0: no figure")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    for name in ("--data", "--output", "--page"):
        parser.add_argument(name, type=pathlib.Path, required=True)
    arguments = parser.parse_args()

    def wanted(names, method, start, seed):
        first = names == experiment.field_sets[0]
        chosen = method in arguments.methods and start in arguments.starts and (first or not arguments.multiple)
        return chosen and (not arguments.done or experiment.is_done(names, method, start, seed))

    rows = []
    with concurrent.futures.ThreadPoolExecutor(max_workers=arguments.workers) as pool:
        if TRAFFIC in arguments.only:
            gp_localize_traffic.reproduce(arguments.data, arguments.output / TRAFFIC,
                                          arguments.page.with_name("gp_localize_traffic.md"), arguments.seeds, pool)
        for name in (name for name in arguments.only if name != TRAFFIC):
            if not (arguments.data / RUNS[name][0]).is_dir():
                print(f"skipped: {arguments.data / RUNS[name][0]} is not there", file=sys.stderr)
                continue
            experiment = Experiment(name, arguments.data, arguments.output)
            rows += measure(experiment, arguments.seeds, pool, wanted)
            if name == "pioneer" and arguments.times:
                plot_times(experiment, arguments.times, arguments.page.with_name("gp_localize_step_times.png"))
    if rows:
        print(gp_localize_page.write(arguments.page, rows, page_order()))


if __name__ == "__main__":
    main()
