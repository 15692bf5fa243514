"""What demo.py and results.py share: replaying a bag, and evaluating the replay."""
import csv
import json
import pathlib
import statistics
import subprocess
import sys

import yaml


def run(*command):
    """Runs a program of the suite; its one-line error is the user's answer."""
    command = [str(part) for part in command]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"'{' '.join(command)}' failed with exit code {done.returncode}")
    return done.stdout


def find(package):
    return pathlib.Path(run("rospack", "find", package).strip())


class Run:
    """A recording with its configuration, if one is shipped."""

    def __init__(self, name, bag, config=None, node="gp_localize"):
        self.name, self.bag, self.config, self.node = name, bag, config, node
        values = yaml.safe_load(config.read_text()) if config else {"fields": {}}
        self.fields = values.get("fields") or values.get("channels")

    def variant(self, directory, name, **changes):
        """The shipped configuration with some values changed; `name`.yaml is written to directory."""
        values = {**yaml.safe_load(self.config.read_text()), **changes}
        file = directory / f"{name}.yaml"
        file.write_text(f"# {self.config.name} with {changes}\n" + yaml.safe_dump(values))
        return file

    def replay(self, config, seed, directory):
        run("rosrun", self.node, f"{self.node}_replay", "--bag", self.bag, "--config", config,
            "--output", directory, "--seed", seed)

    def evaluate(self, directory, field=None, title=None):
        """field_eval's numbers by trajectory, odometry beside the estimate; a picture if a field is
        named. Returns them and the duration."""
        file = directory / "errors.json"
        picture = []
        if field:
            picture = ["--plot", directory / "errors.png", "--map", directory / f"field_{field}.csv",
                       "--map-unit", str(self.fields[field].get("unit", "1")), "--title", title]
        run("rosrun", "field_core", "field_eval", "--truth", f"{self.bag}:/ground_truth",
            "--estimate", directory / "estimate.csv",
            "--baseline", f"odometry=odom:{self.bag}:/odom",
            "--baseline", f"odometry, best scale=scaled:{self.bag}:/odom", "--json", file, *picture)
        result = json.loads(file.read_text())
        return {t["name"]: t for t in result["trajectories"]}, result["duration_s"]


def bundled(name, node="gp_localize"):
    """A bundled bag under the configuration of a node; None if there is none."""
    config = find("field_config") / "bags" / f"{name}.{node}.yaml"
    bag = find("field_bags") / "bags" / f"{name}.bag"
    return Run(name, bag, config, node) if config.exists() else None


def recording(folder, directory):
    """A recording in the suite's CSV format, as a bag in directory; its configuration where one is shipped."""
    bag = directory / f"{folder.name}.bag"
    run("rosrun", "field_bags", "csv_to_bag", "--odom", folder / "odom.csv", "--measurements",
        folder / "measurements.csv", "--truth", folder / "truth.csv", "--output", bag)
    config = find("field_config") / "recordings" / f"{folder.name}.gp_localize.yaml"
    return Run(folder.name, bag, config if config.exists() else None)


def speed(directory, duration):
    """Steps per second, and how many times faster than real time."""
    with open(directory / "timing.csv") as f:
        seconds = [float(row["step_s"]) for row in csv.DictReader(f)]
    return 1.0 / statistics.mean(seconds), duration / sum(seconds)


def table(header, rows):
    """Of texts, in Markdown."""
    lines = ["| " + " | ".join(row) + " |" for row in [header, ["---"] * len(header)] + rows]
    return "\n".join(lines) + "\n"
