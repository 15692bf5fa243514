"""The table and the picture of docs/results/gp_localize.md. A row stays until it is measured again over as many seeds."""
import matplotlib

import replays

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  after the choice of the backend

HEADER = ["run", "fields", "start", "method", "seeds", "median of mean error [m]", "mean +- sd", "min to max",
          "better than the paper's (12-13), same seed", "in 90 % ellipse", "says lost"]
MARK = "<!-- written by tools/reproduce_gp_localize.sh -->\n"


def key_of(row):
    """What a row is about: run, fields, start, method. Of odometry there are two rows, whatever the scale is."""
    run, fields, start, method = row[:4]
    return run, fields, start, " ".join(method.split()[:2]) if method.startswith("odometry ") else method


def rows_of(text):
    """Of the page's table."""
    lines = [line for line in text.partition(MARK)[2].splitlines() if line.startswith("| ")]
    return [[cell.strip() for cell in line[1:line.rindex("|")].split("|")] for line in lines[2:]]


def merged(kept, measured, order):
    """Rows in `order` (of keys): the measured ones, and those kept that none over as many seeds replaces. What is not in
    `order` could not be measured again and goes."""
    rows = {key_of(row): row for row in kept}
    for row in measured:
        before = rows.get(key_of(row))
        if before is None or int(row[4] or 1) >= int(before[4] or 1):
            rows[key_of(row)] = row
    return [rows[key] for key in order if key in rows]


def plot_errors(rows, file):
    """One panel per run, fields and start with methods to compare: median, mean +- standard deviation and extremes over
    the seeds of the mean error; odometry as a line."""
    odometry = {row[0]: float(row[5]) for row in rows if row[3] == "odometry alone"}
    panels = {}
    for row in rows:
        if row[4]:
            panels.setdefault(" ".join(row[:3]), []).append(row)
    panels = {title: some for title, some in panels.items() if len(some) > 1} or panels
    heights = [1.0 + 0.2 * len(some) for some in panels.values()]
    figure, axes = plt.subplots(len(panels), 1, figsize=(9, sum(heights)), squeeze=False,
                                gridspec_kw={"height_ratios": heights})
    for axis, (title, some) in zip(axes[:, 0], panels.items()):
        for y, row in enumerate(some):
            mean, spread = (float(number) for number in row[6].split(" +- "))
            least, most = (float(number) for number in row[7].split(" to "))
            axis.plot([least, most], [y, y], color="tab:blue", linewidth=1)
            axis.plot([mean - spread, mean + spread], [y, y], color="tab:blue", linewidth=5, solid_capstyle="butt")
            axis.plot(float(row[5]), y, "|", color="black", markersize=9)
        axis.axvline(odometry[some[0][0]], color="tab:red", linewidth=1)
        axis.set_title(f"{title} (red: odometry alone)", fontsize=9)
        axis.set_yticks(range(len(some)), [f"{row[3]} ({row[4]})" for row in some])
        axis.set_ylim(len(some) - 0.3, -0.7)  # as in the table, from above
        axis.set_xlim(left=0)
        axis.tick_params(labelsize=8)
    axes[-1, 0].set_xlabel("mean position error [m]: median, mean +- sd, extremes (number of seeds)", fontsize=8)
    figure.tight_layout()
    figure.savefig(file, dpi=110)
    plt.close(figure)


def write(page, measured, order):
    """Puts measured rows on the page; the text before the table stays. Returns the table."""
    page.parent.mkdir(parents=True, exist_ok=True)
    text = page.read_text() if page.exists() else "# GP-Localize: the paper's experiments\n\n"
    rows = merged(rows_of(text), measured, order)
    plot_errors(rows, page.parent / "gp_localize_errors.png")
    table = replays.table(HEADER, rows)
    pictures = [f"\n![{name}](gp_localize_{name}.png)\n" for name in ("errors", "step_times")
                if (page.parent / f"gp_localize_{name}.png").exists()]
    page.write_text(text.partition(MARK)[0] + MARK + "\n" + table + "".join(pictures))
    return table
