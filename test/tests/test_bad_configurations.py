#!/usr/bin/python3
"""A configuration that cannot be meant so is refused with file, line, key, value and what is allowed."""

from support import recordings
from support.programs import ProgramTest, replay
from support.runner import main


class BadConfigurations(ProgramTest):
    def setUp(self):
        super().setUp()
        self.bag = recordings.write_bag(self.folder / "circle.bag", recordings.circling(duration=20.0))

    def replay(self, text):
        self.config = self.write("config.yaml", text)
        return replay(self.bag, self.config, self.output)

    def assert_line_refused(self, text, line_start, *texts):
        """Refused with the number of the line that begins with line_start."""
        numbers = [n for n, line in enumerate(text.splitlines(), 1) if line.strip().startswith(line_start)]
        done = self.replay(text)
        self.assert_refused(done, f"{self.config}:{numbers[0]}:", *texts)

    def test_the_configuration_the_others_spoil_is_good(self):
        self.must(self.replay(recordings.tiny_config()))

    def test_misspelt_keys_are_named_with_the_nearest(self):
        self.assert_line_refused(recordings.tiny_config(partikles=50), "partikles", "partikles",
                                 "particles")
        self.assert_line_refused(recordings.tiny_config(support={"seize": 9}), "seize", "support/seize", "size")
        field = dict(recordings.TINY_CONFIG["fields"]["light"], noise_stdev=0.1)
        self.assert_line_refused(recordings.tiny_config(fields={"light": field}), "noise_stdev",
                                 "fields/light/noise_stdev", "noise_stddev")

    def test_wrong_types(self):
        for key, value in (("particles", "many"), ("particles", "400"), ("particles", 2.5),
                           ("particles", [1, 2]), ("redraw_sample_paths", 1), ("fields", 3),
                           ("support", {"region": "everywhere"}), ("support", {"noisy": "yes please"})):
            with self.subTest(f"{key}: {value}"):
                inner = next(iter(value)) if isinstance(value, dict) else key
                self.assert_line_refused(recordings.tiny_config(**{key: value}), inner, inner)

    def test_values_out_of_range(self):
        for key, value, allowed in (("particles", 0, "1 to 100000"), ("particles", 10**9, "1 to 100000"),
                                    ("odom_alpha1", -0.1, ">= 0"), ("resample_threshold", 1.5, "0 to 1"),
                                    ("initial_cov_xx", -1.0, ">= 0"), ("initial_pose_x", float("nan"), ""),
                                    ("initial_pose_x", float("inf"), ""),
                                    ("map_hypotheses", "particles", "sample_paths"),
                                    ("observation_model", "exact", "full_gp")):
            with self.subTest(f"{key}: {value}"):
                shown = str(value) if isinstance(value, (int, str)) else key
                self.assert_line_refused(recordings.tiny_config(**{key: value}), key, key, shown, allowed)

    def test_lists_of_the_wrong_length(self):
        self.assert_line_refused(recordings.tiny_config(support={"region": [-5.0, -5.0, 5.0]}), "region",
                                 "support/region", "4")
        field = dict(recordings.TINY_CONFIG["fields"]["light"], length_scales=[1.0, 2.0, 3.0])
        self.assert_line_refused(recordings.tiny_config(fields={"light": field}), "length_scales",
                                 "fields/light/length_scales", "2")

    def test_missing_required_keys(self):
        field = dict(recordings.TINY_CONFIG["fields"]["light"])
        del field["noise_stddev"]
        done = self.replay(recordings.tiny_config(fields={"light": field}))
        self.assert_refused(done, self.config, "fields/light/noise_stddev")
        self.assert_refused(self.replay("particles: 50\n"), self.config, "fields")

    def test_a_key_twice(self):
        text = recordings.tiny_config() + "particles: 60\n"
        self.assert_refused(self.replay(text), self.config, "particles")

    def test_not_yaml(self):
        self.assert_refused(self.replay("fields: {light: [\n"), self.config)
        self.assert_refused(self.replay(""), self.config, "fields")
        self.assert_refused(self.replay("- one\n- two\n"), self.config)

    def test_missing_file(self):
        missing = self.folder / "no_such.yaml"
        self.assert_refused(replay(self.bag, missing, self.output), missing)

    def explicit_support(self, *points, **field):
        light = dict(recordings.TINY_CONFIG["fields"]["light"], **field)
        support = {"selection": "explicit", "points": [list(p) for p in points], "size": len(points), "jitter": 0.0}
        return self.replay(recordings.tiny_config(fields={"light": light}, support=support))

    def test_two_equal_support_points(self):
        done = self.explicit_support((0.0, 0.0), (1.0, 2.0), (2.0, 0.0), (1.0, 2.0))
        self.assert_refused(done, "support points 1 (1.0", "and 3 (1.0", "coincide", "remove one")

    def test_singular_kernel(self):
        # Far closer together than the field changes, and no jitter: distinct, but the matrix has no inverse.
        points = [(0.01 * i, 0.01 * j) for i in range(4) for j in range(4)]
        done = self.explicit_support(*points, length_scales=[100.0, 100.0])
        self.assert_refused(done, "light", "jitter")

    def test_no_motion_noise_and_an_exact_start_are_legal(self):
        exact = {key: 0.0 for key in ("odom_alpha1", "odom_alpha2", "odom_alpha3", "odom_alpha4",
                                      "initial_cov_xx", "initial_cov_yy", "initial_cov_aa")}
        self.must(self.replay(recordings.tiny_config(**exact)))
        # All particles follow the odometry, which is exact here: so is the estimate, up to rounding.
        lines = (self.output / "estimate.csv").read_text().splitlines()[1:]
        self.assertGreater(len(lines), 30)
        for line in lines:
            stamp, x, y = [float(v) for v in line.split(",")[:3]]
            true_x, true_y, _ = recordings.circle(stamp - 100.0)
            # Odometry at 10 Hz is interpolated along an arc: exact on a circle.
            self.assertLess(max(abs(x - true_x), abs(y - true_y)), 1e-3)


if __name__ == "__main__":
    main("bad_configurations")
