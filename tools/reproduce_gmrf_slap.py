#!/usr/bin/python3
"""Tables and pictures of docs/results/gmrf_slap.md: gmrf_slap_simulation over seeds, beliefs, robots, grids and real fields."""
import argparse
import csv
import math
import os
import pathlib
import statistics
import subprocess

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of the backend
import numpy as np  # noqa: E402
from matplotlib.patches import Ellipse  # noqa: E402

BELIEFS = {"trajectories": "trajectories (default)", "lattice": "weights on sites", "gaussian": "the paper's Gaussian (eq. 7)"}
ROBOTS = (2, 5)
SIDES = (31, 101, 301)
NOISE_M, SIDE, SEEDS = 10.0, 31, 20
# A field drawn from the paper's prior has this standard deviation: real ones are scaled to it, nothing else is told.
FIELD_STDDEV = (4.0 * math.pi * 0.1 * 50.0) ** -0.5
RASTERS = {"volcano": ("volcano_dem_10m.csv", "x", "y", "z", "elevation of Maunga Whau"),
           "jacksboro": ("jacksboro_dem_stride2.csv", "x_m", "y_m", "elev_m", "elevation near Jacksboro"),
           "walker": ("walker_exhaustive.csv", "X", "Y", "V", "Walker Lake, V")}


class Runs:
    def __init__(self, folder, seeds):
        self.folder, self.seeds = folder, seeds
        folder.mkdir(parents=True, exist_ok=True)

    def simulate(self, name, **options):
        """Rows of the program's CSV by case; done once, in a file that says what was asked."""
        file = self.folder / f"{name}.csv"
        arguments = [f"{k}={v}" for k, v in {"seeds": self.seeds, **options}.items()]
        head = "# " + " ".join(arguments)
        if not file.exists() or file.read_text().splitlines()[0] != head:
            print(name, *arguments, flush=True)
            done = subprocess.run(["rosrun", "gmrf_slap", "gmrf_slap_simulation", *arguments],
                                  stdout=subprocess.PIPE, text=True, check=True)
            partial = file.with_suffix(f".{os.getpid()}.partial")
            partial.write_text(head + "\n" + done.stdout)
            partial.rename(file)
        cases = {}
        for row in csv.DictReader(file.read_text().splitlines()[1:]):
            cases.setdefault(int(row["case"]), []).append({k: float(v) for k, v in row.items()})
        return cases

    def dump(self, name):
        return str(self.folder / name)


def mean(rows, key):
    return statistics.mean(r[key] for r in rows)


def ratio(case, reference, key="squared_error"):
    """Of the means over seeds, with the standard error that seeds leave (of paired differences)."""
    base = mean(reference, key)
    differences = [a[key] - b[key] for a, b in zip(case, reference)]
    value = f"{mean(case, key) / base:.2f}"
    if len(differences) < 2:
        return value
    return f"{value} ± {statistics.stdev(differences) / math.sqrt(len(differences)) / base:.2f}"


def counted(rows):
    return f"{len(rows)} seed{'s' if len(rows) > 1 else ''}"


def share(rows, key):
    return f"{100.0 * mean(rows, key):.0f} %"


def estimator_cells(rows):
    return (f"{mean(rows, 'position_error_m'):.2f} m | {share(rows, 'field_coverage')}, {share(rows, 'position_coverage')} | "
            f"{mean(rows, 'true_theta'):.2f} | {1e3 * mean(rows, 'step_s'):.1f} ms")


HEAD = ("| {} | squared field error | to case 1 | position error, last tenth | inside 90 %: field, position | "
        "true theta | step |\n|---|---|---|---|---|---|---|")


def taken_as_exact_row(label, cases):
    """Case 2: noisy positions taken as exact."""
    return (f"| {label} | {1e3 * mean(cases[2], 'squared_error'):.2f}e-3 | {ratio(cases[2], cases[1])} | ({NOISE_M:.0f} m) | "
            f"{share(cases[2], 'field_coverage')}, - | {mean(cases[2], 'true_theta'):.2f} | - |")


def estimated_row(label, cases):
    """Case 3: positions estimated."""
    return (f"| {label} | {1e3 * mean(cases[3], 'squared_error'):.2f}e-3 | {ratio(cases[3], cases[1])} | "
            f"{estimator_cells(cases[3])} |")


def paper_section(runs):
    lines = [HEAD.format("")]
    shown = False
    for belief, name in BELIEFS.items():
        more = {"dump": runs.dump("paper_")} if belief == "trajectories" else {}
        cases = runs.simulate(f"paper_{belief}", belief=belief, cases="123" if not shown else "13", **more)
        if not shown:
            lines.append(f"| case 1, exact positions | {1e3 * mean(cases[1], 'squared_error'):.2f}e-3 | 1 | - | "
                         f"{share(cases[1], 'field_coverage')}, - | {mean(cases[1], 'true_theta'):.2f} | - |")
            lines.append(taken_as_exact_row("case 2, noisy positions taken as exact", cases))
        shown = True
        lines.append(estimated_row(f"case 3, {name}", cases))
    return "\n".join(lines)


def robots_section(runs, counts):
    lines = [HEAD.format("robots")]
    for count in counts:
        cases = runs.simulate(f"robots_{count}", robots=count, cases="123")
        label = f"{count} ({counted(cases[3])})"
        lines.append(taken_as_exact_row(f"{label}, case 2", cases))
        lines.append(estimated_row(f"{label}, case 3", cases))
    return "\n".join(lines)


def grids_section(runs, sides):
    lines = [HEAD.format("sites, engine: local")]
    for side in sides:
        cases = runs.simulate(f"grid_{side}", side=side, engine="local",
                              known_start=1, cases="13", score_every=100)
        lines.append(estimated_row(f"{side} x {side} ({counted(cases[3])})", cases))
    return "\n".join(lines)


def raster(data, name):
    """SIDE x SIDE values from the middle of a raster, scaled to mean 0 and FIELD_STDDEV."""
    file, *names, _ = RASTERS[name]
    with open(data / "rasters_r" / file) as f:
        table = np.array([[float(row[n]) for n in names] for row in csv.DictReader(f) if row[names[2]] not in ("", "NA")])
    xs, ys = np.unique(table[:, 0]), np.unique(table[:, 1])
    grid = np.full((len(ys), len(xs)), np.nan)
    grid[np.searchsorted(ys, table[:, 1]), np.searchsorted(xs, table[:, 0])] = table[:, 2]
    stride = min(len(xs), len(ys)) // SIDE
    top, left = (len(ys) - SIDE * stride) // 2, (len(xs) - SIDE * stride) // 2
    part = grid[top:top + SIDE * stride, left:left + SIDE * stride]
    part = np.nanmean(part.reshape(SIDE, stride, SIDE, stride), axis=(1, 3))
    return FIELD_STDDEV * (part - part.mean()) / part.std()


def real_section(runs, data):
    if not (data / "rasters_r").is_dir():
        return "skipped: the rasters are not there"
    lines = [HEAD.format("field")]
    for name, (*_, text) in RASTERS.items():
        file = runs.folder / f"raster_{name}.csv"
        file.write_text("value\n" + "".join(f"{v:.9g}\n" for v in raster(data, name).ravel()))
        cases = runs.simulate(f"real_{name}", field=str(file), cases="123", dump=runs.dump(f"real_{name}_"))
        for case in (2, 3):
            rows = cases[case]
            cells = estimator_cells(rows) if case == 3 else (
                f"({NOISE_M:.0f} m) | {share(rows, 'field_coverage')}, - | - | -")
            lines.append(f"| {text}, case {case} | {1e3 * mean(rows, 'squared_error'):.2f}e-3 | "
                         f"{ratio(rows, cases[1])} | {cells} |")
    return "\n".join(lines)


def columns(path):
    with open(path) as f:
        rows = list(csv.reader(f))
    values = np.array(rows[1:], dtype=float)
    return {name: values[:, i] for i, name in enumerate(rows[0])}


def draw_fields(prefix, file):
    """Figure 1 of the paper: prediction, its variance, squared error, by case."""
    figure, axes = plt.subplots(3, 4, figsize=(11, 8), sharex=True, sharey=True)
    truth = columns(f"{prefix}1_field.csv")
    extent = [truth["x_m"].min() - 0.5, truth["x_m"].max() + 0.5] * 2
    side = round(math.sqrt(len(truth["truth"])))
    limits = {"mean": (truth["truth"].min(), truth["truth"].max()), "variance": (0, None), "error": (0, None)}
    fields = {}
    for case in (1, 2, 3):
        fields[case] = columns(f"{prefix}{case}_field.csv")
        fields[case]["error"] = (fields[case]["mean"] - fields[case]["truth"]) ** 2
    for key in ("variance", "error"):
        limits[key] = (0.0, max(fields[c][key].max() for c in (1, 3)))
    for row, (key, title) in enumerate((("mean", "prediction"), ("variance", "variance"), ("error", "squared error"))):
        for case in (1, 2, 3):
            axis = axes[row, case - 1]
            image = axis.imshow(fields[case][key].reshape(side, side), origin="lower", extent=extent, vmin=limits[key][0],
                                vmax=limits[key][1], cmap="viridis" if key == "mean" else "magma")
            axis.set_title(f"case {case}: {title}", fontsize=9)
            figure.colorbar(image, ax=axis, fraction=0.046)
    path = columns(f"{prefix}3_path.csv")
    image = axes[0, 3].imshow(truth["truth"].reshape(side, side), origin="lower", extent=extent, vmin=limits["mean"][0],
                              vmax=limits["mean"][1])
    axes[0, 3].set_title("true field", fontsize=9)
    figure.colorbar(image, ax=axes[0, 3], fraction=0.046)
    axes[1, 3].plot(path["true_x_m"], path["true_y_m"], "k.-", ms=3, lw=0.5, label="true")
    axes[1, 3].plot(path["estimated_x_m"], path["estimated_y_m"], "b.", ms=3, label="estimated, case 3")
    axes[1, 3].set_title("where it was measured", fontsize=9)
    axes[1, 3].set_aspect("equal")
    axes[1, 3].legend(fontsize=6)
    axes[1, 3].set(xlim=extent[:2], ylim=extent[2:])
    axes[2, 3].axis("off")
    figure.tight_layout()
    figure.savefig(file, dpi=80)
    plt.close(figure)


def draw_path(prefix, file, first=10, last=30):
    """Figure 2 of the paper: true, estimated (68 %) and observed positions of some steps."""
    path = columns(f"{prefix}3_path.csv")
    some = (path["step"] >= first) & (path["step"] <= last)
    path = {k: v[some] for k, v in path.items()}
    figure, axis = plt.subplots(figsize=(6, 5.5))
    axis.plot(path["true_x_m"], path["true_y_m"], "rD-", ms=4, lw=1, label="true")
    axis.plot(path["estimated_x_m"], path["estimated_y_m"], "bo", ms=4, label="estimated")
    axis.plot(path["observed_x_m"], path["observed_y_m"], "g*", ms=6, label="observed")
    for i in range(len(path["step"])):
        covariance = np.array([[path["cov_xx"][i], path["cov_xy"][i]], [path["cov_xy"][i], path["cov_yy"][i]]])
        values, vectors = np.linalg.eigh(covariance)
        scale = 2.0 * np.sqrt(-2.0 * math.log(1.0 - 0.68) * values)
        axis.add_patch(Ellipse((path["estimated_x_m"][i], path["estimated_y_m"][i]), scale[1], scale[0],
                               angle=math.degrees(math.atan2(vectors[1, 1], vectors[0, 1])), fill=False, ec="b", lw=0.6))
    axis.set(xlabel="x [m]", ylabel="y [m]", title=f"steps {first} to {last}, 68 % regions")
    axis.set_aspect("equal")
    axis.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


PAGE = """# gmrf_slap: simulated runs and real fields

Made by `{command}`: {seeds} seeds, `gmrf_slap_simulation` (the paper's section III: a robot on a 31 x 31 torus, 100
steps of 2 m, observed with {noise:.0f} m of noise, the field drawn from the prior with kappa = 50, alpha = 0.1, measured with a noise of 0.1;
five hyperparameter vectors, uniform). The same seed is the same field, drive and noise in all cases. Squared errors are means over
sites and steps; "to case 1" is the ratio of the means with its standard error over seeds. The start is unknown. Times are one
core's, while the machine did other work.

The paper reports 1 : 1.99 : 1.18, for one run.

## Section III
{paper}

![prediction, variance and squared error by case](gmrf_slap_fields.png)

![true, estimated and observed positions](gmrf_slap_path.png)
{robots}{grids}{real}"""


def limits(arguments):
    """Options by which this run does less than the whole."""
    if arguments.seeds != SEEDS:
        yield f"--seeds {arguments.seeds}"
    for name, values, everything in (("--robots", arguments.robots, ROBOTS), ("--sides", arguments.sides, SIDES)):
        if values != list(everything):
            yield " ".join([name, *map(str, values)])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=pathlib.Path, required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--page", type=pathlib.Path, required=True)
    parser.add_argument("--seeds", type=int, default=SEEDS)
    parser.add_argument("--only", nargs="*", default=["paper", "robots", "grids", "real"])
    parser.add_argument("--robots", nargs="*", type=int, default=list(ROBOTS), choices=ROBOTS)
    parser.add_argument("--sides", nargs="*", type=int, default=list(SIDES), choices=SIDES)
    arguments = parser.parse_args()
    runs = Runs(arguments.output, arguments.seeds)
    pictures = arguments.page.parent
    pictures.mkdir(parents=True, exist_ok=True)
    parts = dict.fromkeys(("paper", "robots", "grids", "real"), "")
    if "paper" in arguments.only:
        parts["paper"] = "\n" + paper_section(runs)
        draw_fields(runs.dump("paper_"), pictures / "gmrf_slap_fields.png")
        draw_path(runs.dump("paper_"), pictures / "gmrf_slap_path.png")
    if "robots" in arguments.only and arguments.robots:
        parts["robots"] = "\n## Several robots, trajectories\n\n" + robots_section(runs, arguments.robots) + "\n"
    if "grids" in arguments.only:
        parts["grids"] = ("\n## Large grids, trajectories, known start, field looked at after the last step\n\n"
                          + grids_section(runs, arguments.sides) + "\n")
    if "real" in arguments.only:
        parts["real"] = ("\n## Real fields on a bounded 31 x 31 grid, trajectories\n\nThe middle of each raster, averaged to 31 x 31 "
                         "sites and scaled to the mean and spread of the simulated field; the five hyperparameter vectors are the "
                         "same. No true theta is known: that column is the weight of the first.\n\n"
                         + real_section(runs, arguments.data) + "\n")
        if (arguments.data / "rasters_r").is_dir():
            draw_fields(runs.dump("real_volcano_"), pictures / "gmrf_slap_volcano.png")
            parts["real"] += "\n![volcano: prediction, variance and squared error by case](gmrf_slap_volcano.png)\n"
    command = " ".join(["tools/reproduce_gmrf_slap.sh", *limits(arguments)])
    if set(arguments.only) == set(parts):
        arguments.page.write_text(PAGE.format(command=command, seeds=arguments.seeds, noise=NOISE_M, **parts))
    else:
        print("\n".join(parts.values()))


if __name__ == "__main__":
    main()
