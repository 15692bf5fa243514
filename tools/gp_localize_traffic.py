"""The traffic experiment of the GP-Localize paper (section 4.3): gp_localize_traffic over seeds, as a page with pictures."""
import csv
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of the backend

MARK = "<!-- written by tools/reproduce_gp_localize.sh -->\n"
# What the page calls them, and the paper's figure.
METHODS = {
    "motion_only": ("transition model alone (exact)", ""),
    "gp_localize": ("GP-Localize, the paper's shared paths (eq. 12-13)", "2.8"),
    "sod_truncate": ("SoD-Truncate, shared paths", "7.3"),
    "sod_even": ("SoD-Even, shared paths", "6.2"),
    "own_gp_localize": ("a map per particle (eq. 12-13)", ""),
    "own_sod_truncate": ("a map per particle, SoD-Truncate", ""),
    "own_sod_even": ("a map per particle, SoD-Even", ""),
    "other_day": ("known map of another weekday (exact filter)", ""),
    "known_field": ("known field (exact filter)", ""),
}
VEHICLES = {"generated": "drawn from the learned transition model", "trips": "on trips between random detectors"}
# SoD-Even costs more than all others together: side by side.
GROUPS = {"even": ["sod_even"], "quick": [m for m in METHODS if m != "sod_even"]}


def program(folder, file, **options):
    """The program's output, kept in a file that says what was asked; done once. Its own files are renamed with it."""
    arguments = [f"{key}={value}" for key, value in options.items()]
    head = "# " + " ".join(a for a in arguments if not a.startswith(("data=", "dump")))
    path = folder / file
    if not path.exists() or path.read_text().splitlines()[0] != head:
        done = subprocess.run(["rosrun", "gp_localize", "gp_localize_traffic", *arguments], stdout=subprocess.PIPE,
                              text=True, check=True)
        partial = path.with_suffix(f".{os.getpid()}.partial")
        partial.write_text(head + "\n" + done.stdout)
        partial.rename(path)
    return path.read_text().split("\n", 1)[1]


def rows_of(text):
    return list(csv.DictReader(text.splitlines()))


def table(header, rows):
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def mean_sd(values):
    return f"{statistics.mean(values):.2f} +- {statistics.stdev(values) if len(values) > 1 else 0.0:.2f}"


def results_table(results):
    """`results[vehicle][method]`: rows of the program, one per seed."""
    rows = []
    for vehicle, methods in results.items():
        reference = {r["seed"]: float(r["segments"]) for r in methods.get("gp_localize", [])}
        for method, (name, paper) in METHODS.items():
            runs = methods.get(method)
            if not runs:
                continue
            errors = [float(r["segments"]) for r in runs]
            paired = [float(r["segments"]) - reference[r["seed"]] for r in runs if r["seed"] in reference]
            worse = "-" if method == "gp_localize" else f"{sum(d < 0 for d in paired)} of {len(paired)}"
            rows.append([vehicle, name, str(len(runs)), f"{statistics.median(errors):.2f}", mean_sd(errors),
                         f"{min(errors):.2f} to {max(errors):.2f}", worse,
                         f"{statistics.mean(float(r['kilometres']) for r in runs):.2f}",
                         f"{100 * statistics.mean(float(r['exact']) for r in runs):.0f} %",
                         paper if vehicle == "generated" else ""])
    return table(["vehicle", "method", "seeds", "median of mean error [segments]", "mean +- sd", "min to max",
                  "better than GP-Localize, same seed", "mean error [km]", "right node", "the paper [segments]"], rows)


def plot(results, steps, network, file):
    """The network with the first seed's route; errors of all seeds by method; mean error by step of some."""
    figure, axes = plt.subplots(1, 3, figsize=(16, 5))
    for row in network:
        x, y = [float(row["x1_km"]), float(row["x2_km"])], [float(row["y1_km"]), float(row["y2_km"])]
        if row["what"] == "edge":
            axes[0].plot(x, y, color="0.7", linewidth=0.8, zorder=1)
    nodes = [row for row in network if row["what"] == "node"]
    seen = axes[0].scatter([float(r["x1_km"]) for r in nodes], [float(r["y1_km"]) for r in nodes],
                           c=[float(r["visits"]) for r in nodes], s=14, cmap="viridis_r", zorder=2)
    figure.colorbar(seen, ax=axes[0], label="readings of the first vehicle")
    axes[0].set_aspect("equal")
    axes[0].set_xlabel("x [km]")
    axes[0].set_ylabel("y [km]")
    methods = results["generated"]
    names = [m for m in METHODS if m in methods]
    axes[1].boxplot([[float(r["segments"]) for r in methods[m]] for m in names], vert=False,
                    labels=[METHODS[m][0] for m in names])
    axes[1].set_xlim(left=0)
    axes[1].tick_params(labelsize=7)
    axes[1].set_xlabel("mean error [segments], generated vehicles")
    for method in ("motion_only", "gp_localize", "sod_truncate", "own_gp_localize", "known_field"):
        by_step = {}
        for row in steps:
            if row["method"] == method:
                by_step.setdefault(int(row["step"]), []).append(float(row["segments"]))
        axes[2].plot(sorted(by_step), [statistics.mean(by_step[s]) for s in sorted(by_step)], linewidth=0.9,
                     label=METHODS[method][0])
    axes[2].set_xlabel("step")
    axes[2].set_ylabel("mean error over seeds [segments]")
    axes[2].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(file, dpi=90)
    plt.close(figure)


def reproduce(data, output, page, seeds, pool):
    """Writes `page`, and its picture beside it. `pool` runs the program."""
    folder = data / "traffic_metr_la"
    if not folder.is_dir():
        print(f"skipped: {folder} is not there", file=sys.stderr)
        return
    output = pathlib.Path(output)
    output.mkdir(parents=True, exist_ok=True)
    jobs = {(vehicle, group): pool.submit(program, output, f"{vehicle}_{group}.csv", data=folder, vehicle=vehicle,
                                          seeds=seeds, methods=",".join(methods),
                                          dump=output / f"{vehicle}_{group}_steps.csv")
            for vehicle in VEHICLES for group, methods in GROUPS.items()}
    described = pool.submit(program, output, "field.csv", data=folder, describe=1, dump_map=output / "network.csv")
    results = {}
    for (vehicle, _), job in jobs.items():
        for row in rows_of(job.result()):
            results.setdefault(vehicle, {}).setdefault(row["method"], []).append(row)
    graph, field = (rows_of(part) for part in described.result().strip().split("\n\n"))
    steps = rows_of((output / "generated_quick_steps.csv").read_text())
    picture = page.with_suffix(".png")
    plot(results, steps, rows_of((output / "network.csv").read_text()), output / picture.name)
    shutil.copy(output / picture.name, picture)
    text = (f"{graph[0]['nodes']} detectors, {graph[0]['edges']} edges, diameter {graph[0]['diameter']} segments.\n\n" +
            results_table(results) + f"\n![network, errors by method, errors by step]({picture.name})\n\n" +
            "The field by maximum likelihood on the training day; error of a detector's speed from all others (leave one\n"
            "out), that day and on the day of the test:\n\n" +
            table(["domain", "kernel", "log likelihood", "mean [mph]", "signal [mph]", "noise [mph]",
                   "left out, training [mph]", "left out, test [mph]", "length scales"],
                  [list(row.values()) for row in field]))
    before = page.read_text().split(MARK)[0] if page.exists() else "# GP-Localize on a road network\n\n"
    page.write_text(before + MARK + "\n" + text)
    print(text)
