#!/usr/bin/python3
"""Draws the paths over the learned field, and the position error over time.

Called by `field_eval --plot`; --data is the JSON that field_eval writes (see plot_data in
apps/report.hpp). Exit codes: 0 drawn, 1 bad data, 2 bad arguments.
"""
import argparse
import csv
import json
import os
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib import patheffects  # noqa: E402

# Okabe and Ito's palette: told apart by colour-blind readers as well.
TRUTH, ESTIMATE = "#000000", "#D55E00"
BASELINES = ["#0072B2", "#009E73", "#CC79A7", "#56B4E9"]
STYLES = [(0, (4, 1.6)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)), "-."]


def read_map(path):
    """Grid of a field: x and y (1-d, ascending), mean and variance (rows of y)."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(stream))
    except OSError as error:
        raise ValueError(f"cannot read '{path}': {error.strerror}; check --map") from error
    missing = {"x_m", "y_m", "mean", "variance"} - set(rows[0] if rows else [])
    if missing:
        raise ValueError(f"{path}: no column {', '.join(sorted(missing))}; "
                         "a field map has x_m,y_m,mean,variance")
    try:
        data = np.array([[float(r[k]) for k in ("x_m", "y_m", "mean", "variance")] for r in rows])
    except (TypeError, ValueError) as error:
        raise ValueError(f"{path}: {error}; correct the row or remove it") from error
    # Coordinates are rounded to a micrometre, so that equal grid lines are equal numbers.
    x, column = np.unique(data[:, 0].round(6), return_inverse=True)
    y, row = np.unique(data[:, 1].round(6), return_inverse=True)
    grids = np.full((2, len(y), len(x)), np.nan)
    grids[:, row, column] = data[:, 2:].T
    return x, y, grids[0], grids[1]


def style_of(index):
    """Colour, line style and width of a trajectory: truth, estimate, then baselines."""
    if index == 0:
        return dict(color=TRUTH, linestyle="-", linewidth=1.6, zorder=4)
    if index == 1:
        return dict(color=ESTIMATE, linestyle="-", linewidth=1.8, zorder=5)
    k = (index - 2) % len(BASELINES)
    return dict(color=BASELINES[k], linestyle=STYLES[k], linewidth=1.5, zorder=3)


def limits(trajectories, grid):
    """Axis limits: the map, or all paths but those that drift far off, with a margin."""
    if grid is not None:
        x, y = grid[0], grid[1]
    else:
        near = trajectories[:2]
        x = np.concatenate([t["x_m"] for t in near])
        y = np.concatenate([t["y_m"] for t in near])
    margin = 0.04 * max(np.ptp(x), np.ptp(y), 1.0)
    low, high = [x.min() - margin, y.min() - margin], [x.max() + margin, y.max() + margin]
    for t in trajectories:  # a baseline may widen the view by a third of it on each side, no more
        for axis, key in enumerate(("x_m", "y_m")):
            room = (high[axis] - low[axis]) / 3.0
            low[axis] = max(min(low[axis], t[key].min() - margin), low[axis] - room)
            high[axis] = min(max(high[axis], t[key].max() + margin), high[axis] + room)
    return low, high


def crowding(truth):
    """How often the path crosses its own region: 1 for a path once around, 0.5 for one of many."""
    if len(truth["x_m"]) < 2:
        return 1.0
    steps = np.hypot(np.diff(truth["x_m"]), np.diff(truth["y_m"]))
    diagonal = np.hypot(np.ptp(truth["x_m"]), np.ptp(truth["y_m"]))
    return 0.5 if steps.sum() > 8.0 * max(diagonal, 1e-9) else 1.0


def draw_paths(axes, trajectories, on_map):
    """All paths, with start and end of the truth marked. White behind truth and estimate keeps them
    readable; baselines stay in the background, and a run of many laps is drawn with thin lines."""
    thin = crowding(trajectories[0])
    for index, t in enumerate(trajectories):
        line = style_of(index)
        line["linewidth"] *= thin * (0.7 if index > 1 and on_map else 1.0)
        rim = [patheffects.withStroke(linewidth=line["linewidth"] + 1.2, foreground="white",
                                      alpha=0.85)] if on_map and index < 2 else []
        alpha = 0.7 if index > 1 and on_map else 1.0
        axes.plot(t["x_m"], t["y_m"], label=t["name"], path_effects=rim, alpha=alpha, **line)
    truth = trajectories[0]
    if len(truth["x_m"]):
        marker = dict(color=TRUTH, markeredgecolor="white", linestyle="none", zorder=6)
        axes.plot(truth["x_m"][0], truth["y_m"][0], marker="o", markersize=8, label="start", **marker)
        axes.plot(truth["x_m"][-1], truth["y_m"][-1], marker="s", markersize=8, label="end", **marker)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def draw_field(figure, axes, grid, values, colours, label):
    """One panel of the map with its colour bar."""
    x, y = grid[0], grid[1]
    image = axes.pcolormesh(x, y, np.ma.masked_invalid(values), cmap=colours, shading="nearest",
                            rasterized=True)
    # Inside the panel's own frame, so that the bar is as high as a map of any aspect.
    bar = figure.colorbar(image, cax=axes.inset_axes([1.02, 0.0, 0.035, 1.0]))
    bar.set_label(label)
    bar.outline.set_visible(False)


def draw_errors(axes, trajectories):
    """Position error over time; the filter's own two sigma as a band from zero."""
    top = 0.0
    for index, t in enumerate(trajectories[1:], start=1):
        line = style_of(index)
        axes.plot(t["time_s"], t["error_m"], label=f"{t['name']}, RMSE {t['rmse_m']:.2f} m", **line)
        top = max(top, t["error_m"].max(initial=0.0) if index == 1 else
                  min(t["error_m"].max(initial=0.0), 3.0 * top))
        if "two_sigma_m" in t:
            axes.fill_between(t["time_s"], 0.0, t["two_sigma_m"], color=line["color"], alpha=0.18,
                              linewidth=0, label=f"{t['name']}, its own 2 sigma", zorder=1)
            top = max(top, min(np.nanmax(t["two_sigma_m"]), 3.0 * top))
    axes.set_ylim(0.0, 1.25 * top if top > 0 else 1.0)  # room for the legend
    times = trajectories[1]["time_s"]
    if times[-1] > times[0]:
        axes.set_xlim(times[0], times[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("position error [m]")
    axes.legend(loc="upper left", ncol=2, fontsize=9, framealpha=0.9)


def figure_size(low, high, panels):
    """Panels as wide as their region asks for, within a page."""
    aspect = (high[1] - low[1]) / (high[0] - low[0])
    width = 14.0 if panels == 2 else 9.0
    paths = min(max((width - 2.2 * panels) / panels * aspect, 2.4), 8.0)
    return (width, paths + 4.6), [paths + 0.7, 2.9]


def draw(data, grid, name, unit, title):
    """The whole figure."""
    trajectories = data["trajectories"]
    for t in trajectories:
        for key in ("time_s", "x_m", "y_m", "error_m", "two_sigma_m"):
            if key in t:
                t[key] = np.array(t[key], dtype=float)
    low, high = limits(trajectories, grid)
    panels = 1 if grid is None else 2
    size, heights = figure_size(low, high, panels)
    figure = plt.figure(figsize=size, constrained_layout=True)
    layout = figure.add_gridspec(2, panels, height_ratios=heights)
    axes = [figure.add_subplot(layout[0, k]) for k in range(panels)]
    if grid is not None:
        unit_text = f" [{unit}]" if unit else ""
        draw_field(figure, axes[0], grid, grid[2], "viridis", f"{name}, mean{unit_text}")
        draw_field(figure, axes[1], grid, np.sqrt(np.maximum(grid[3], 0.0)), "magma",
                   f"{name}, standard deviation{unit_text}")
        axes[0].set_title(f"Learned field: {name}")
        axes[1].set_title("Uncertainty of the learned field")
    else:
        axes[0].set_title("Paths")
        axes[0].grid(True, alpha=0.25)
    for panel in axes:
        draw_paths(panel, trajectories, grid is not None)
        panel.set_xlim(low[0], high[0])
        panel.set_ylim(low[1], high[1])
    below = figure.add_subplot(layout[1, :])
    draw_errors(below, trajectories)
    below.grid(True, alpha=0.25)
    below.set_title("Position error over time")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncol=min(len(labels), 6), frameon=False,
                  bbox_to_anchor=(0.5, -0.045))
    aligned = "" if data["alignment"] == "none" else f" (alignment: {data['alignment']})"
    figure.suptitle((title or "Estimate against truth") + aligned, fontsize=15, fontweight="bold")
    return figure


def save(figure, output):
    """Whole or not at all: drawn to a temporary name beside the picture, then renamed."""
    stem, ending = os.path.splitext(output)
    temporary = f"{stem}.{os.getpid()}.part{ending}"
    try:
        figure.savefig(temporary, dpi=140, bbox_inches="tight", facecolor="white")
        os.replace(temporary, output)
    except OSError as error:
        raise ValueError(f"cannot write '{output}': {error.strerror}; check that the folder exists "
                         "and may be written") from error
    finally:
        if os.path.exists(temporary):
            os.remove(temporary)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", required=True, help="JSON written by field_eval")
    parser.add_argument("--output", required=True, help="picture to write")
    parser.add_argument("--map", help="field_<name>.csv with columns x_m,y_m,mean,variance")
    parser.add_argument("--map-unit", default="", help="unit of the field")
    parser.add_argument("--title", default="", help="title of the picture")
    arguments = parser.parse_args()
    plt.rcParams.update({"font.size": 11, "axes.spines.top": False, "axes.spines.right": False,
                         "axes.titlesize": 12, "legend.handlelength": 2.4})
    with open(arguments.data, encoding="utf-8") as stream:
        data = json.load(stream)
    grid, name = None, ""
    if arguments.map:
        grid = read_map(arguments.map)
        stem = os.path.splitext(os.path.basename(arguments.map))[0]
        name = re.sub(r"^field_", "", stem)
    save(draw(data, grid, name, arguments.map_unit, arguments.title), arguments.output)


if __name__ == "__main__":
    try:
        main()
    except ValueError as problem:
        sys.exit(str(problem))
