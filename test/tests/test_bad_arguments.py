#!/usr/bin/python3
"""Misuse of a command line is exit code 2; a wrong world, state or output is exit code 1."""
from support import recordings, workspace
from support.programs import BAD_ARGUMENTS, ProgramTest, replay, run
from support.runner import main

PROGRAMS = {
    "gp_localize_replay": ("gp_localize", ["--bag", "--config", "--output", "--seed", "--odom-topic",
                                           "--field-topic", "--predict", "--load-state", "--save-state"]),
    "field_eval": ("field_core", ["--truth", "--estimate", "--baseline", "--align", "--json", "--plot"]),
    "csv_to_bag": ("field_bags", ["--odom", "--measurements", "--truth", "--output"]),
    "field_simulate": ("field_bags", ["--world", "--seed", "--output"]),
    "bag_trajectory": ("field_ros", ["bag", "topic"]),
}


class CommandLines(ProgramTest):
    def test_help_names_every_option_of_the_contract(self):
        for name, (package, options) in PROGRAMS.items():
            with self.subTest(name):
                text = self.must(run(package, name, "--help"))
                for option in options:
                    self.assertIn(option, text)

    def test_nothing_and_nonsense(self):
        for name, (package, options) in PROGRAMS.items():
            for arguments in ([], ["--no-such-option"], [options[0]]):
                with self.subTest(f"{name} {arguments}"):
                    done = run(package, name, *arguments)
                    self.assertEqual(done.returncode, BAD_ARGUMENTS, done.stderr)
                    self.assertNotEqual(done.stderr + done.stdout, "")

    def test_values_that_are_none(self):
        bag, config = workspace.bag("hall_light"), workspace.config("hall_light")
        done = replay(bag, config, self.output, "--seed", "seven")
        self.assertEqual(done.returncode, BAD_ARGUMENTS)
        self.assertIn("seven", done.stderr)
        done = run("field_core", "field_eval", "--truth", "truth.tum", "--estimate", "e.tum", "--align", "well")
        self.assertEqual(done.returncode, BAD_ARGUMENTS)
        done = run("field_core", "field_eval", "--truth", bag, "--estimate", "e.tum")
        self.assert_refused(done, "names no topic", code=BAD_ARGUMENTS)

    def test_the_node_too(self):
        for arguments, code in ((["--help"], 0), (["--no-such-option"], BAD_ARGUMENTS), (["more"], BAD_ARGUMENTS)):
            with self.subTest(arguments):
                self.assertEqual(run("gp_localize", "gp_localize_node", *arguments).returncode, code)


class Worlds(ProgramTest):
    def simulate(self, good="", bad=""):
        text = (workspace.package("field_bags") / "worlds" / "hall_light.yaml").read_text()
        self.assertIn(good, text)
        self.world = self.write("world.yaml", text.replace("duration: 1200", "duration: 20").replace(good, bad))
        return run("field_bags", "field_simulate", "--world", self.world, "--seed", 1, "--output", self.output)

    def test_good(self):
        self.must(self.simulate())

    def test_bad(self):
        for good, bad, texts in (("duration:", "duratoin:", ("duratoin", "duration")),
                                 ("noise_stddev: 8", "noise_stddev: -8", ("gp_fields/light_lux/noise_stddev", "-8")),
                                 ("lawn_mower", "lawn_moewr", ("route/kind", "lawn_mower")),
                                 ("rate: 5.0", "rate: fast", ("odometry/rate", "fast")),
                                 ("[2.0, 2.5]", "[2.0]", ("length_scales", "2"))):
            with self.subTest(bad):
                self.assert_refused(self.simulate(good, bad), f"{self.world}:", *texts)


class States(ProgramTest):
    def setUp(self):
        super().setUp()
        self.bag = recordings.write_bag(self.folder / "circle.bag", recordings.circling(duration=10.0))
        self.config = self.write("config.yaml", recordings.tiny_config())
        self.state = self.folder / "state.bag"

    def test_missing_foreign_and_damaged(self):
        done = replay(self.bag, self.config, self.output, "--load-state", self.state)
        self.assert_refused(done, self.state)
        done = replay(self.bag, self.config, self.output, "--load-state", self.bag)
        self.assert_refused(done, self.bag, "--save-state")
        self.must(replay(self.bag, self.config, self.folder / "first", "--save-state", self.state))
        part = recordings.cut(self.state, self.folder / "part.bag", 0.5)
        self.assert_refused(replay(self.bag, self.config, self.output, "--load-state", part), part)

    def test_of_another_configuration(self):
        self.must(replay(self.bag, self.config, self.folder / "first", "--save-state", self.state))
        other = self.write("other.yaml", recordings.tiny_config(particles=51))
        done = replay(self.bag, other, self.output, "--load-state", self.state)
        self.assert_refused(done, self.state, "particles", "50", "51")

    def test_no_state_of_a_run_that_failed(self):
        done = replay(self.folder / "none.bag", self.config, self.output, "--save-state", self.state)
        self.assert_refused(done, "none.bag")
        self.assertFalse(self.state.exists())


if __name__ == "__main__":
    main("bad_arguments")
