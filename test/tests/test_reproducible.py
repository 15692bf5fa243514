#!/usr/bin/python3
"""The same bag, configuration and seed give the same bytes; another seed gives others."""
import filecmp

import yaml

from support import recordings, workspace
from support.programs import ProgramTest, replay
from support.runner import main

# Wall-clock times are the one thing that may differ.
TIMED = {"timing.csv"}


def differing(one, other):
    """Names of files that are not the same bytes in both folders."""
    names = {p.name for p in one.iterdir()} | {p.name for p in other.iterdir()}
    _, mismatched, missing = filecmp.cmpfiles(one, other, names - TIMED, shallow=False)
    return sorted(mismatched + missing)


class Reproducible(ProgramTest):
    def run_twice_and_differently(self, bag, config):
        runs = {name: self.folder / name for name in ("once", "again", "other")}
        self.must(replay(bag, config, runs["once"], "--seed", 7))
        self.must(replay(bag, config, runs["again"], "--seed", 7))
        self.must(replay(bag, config, runs["other"], "--seed", 8))
        self.assertGreaterEqual(len(list(runs["once"].iterdir())), 5)
        self.assertEqual(differing(runs["once"], runs["again"]), [])
        changed = differing(runs["once"], runs["other"])
        self.assertIn("estimate.csv", changed)
        self.assertIn("estimate.tum", changed)
        self.assertTrue(any(name.startswith("field_") for name in changed))

    def test_bundled_bags(self):
        for name in workspace.configured_bags():
            with self.subTest(name):
                self.run_twice_and_differently(workspace.bag(name), workspace.config(name))

    def test_the_papers_shared_sample_paths(self):
        values = yaml.safe_load(workspace.config("hall_light").read_text())
        values.update(map_hypotheses="sample_paths", particles=100, sample_paths=100)
        config = self.write("paths.yaml", yaml.safe_dump(values))
        self.run_twice_and_differently(workspace.bag("hall_light"), config)

    def test_seed_of_the_configuration_is_the_one_of_the_command_line(self):
        bag = recordings.write_bag(self.folder / "circle.bag", recordings.circling())
        plain = self.write("plain.yaml", recordings.tiny_config())
        seeded = self.write("seeded.yaml", recordings.tiny_config(seed=7))
        self.must(replay(bag, seeded, self.folder / "file"))
        self.must(replay(bag, plain, self.folder / "option", "--seed", 7))
        self.assertEqual(differing(self.folder / "file", self.folder / "option"), [])


if __name__ == "__main__":
    main("reproducible")
