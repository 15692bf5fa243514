#!/usr/bin/python3
"""What is wrong with a CSV file, where in it, and what to do, from every program that reads one."""
from support import recordings
from support.programs import ProgramTest, replay, run
from support.runner import main

POSES = "stamp_s,x_m,y_m,yaw_rad\n1,0,0,0\n2,1,0,0\n3,2,0,0\n"
READINGS = "stamp_s,light,ap1\n1,5,-70\n2,,-71\n3,6,\n"

# What is done to a good table of poses, and what the line must say beside the file's name.
SPOILT_POSES = {
    "a NaN": ("2,1,0,0", "2,nan,0,0", (":3:", "x_m", "nan")),
    "infinity": ("2,1,0,0", "2,1,-inf,0", (":3:", "y_m", "inf")),
    "a word": ("3,2,0,0", "3,2,zero,0", (":4:", "y_m", "zero")),
    "an empty cell": ("2,1,0,0", "2,1,,0", (":3:", "y_m")),
    "a missing column": ("yaw_rad", "heading", ("yaw_rad", "heading")),
    "a missing cell": ("2,1,0,0", "2,1,0", (":3:", "3 cells", "4 columns")),
    "a column twice": ("x_m,y_m", "x_m,x_m", (":1:", "x_m", "twice")),
    "stamps that go back": ("3,2,0,0", "1.5,2,0,0", (":4:", "1.5")),
    "a stamp that is none": ("2,1,0,0", "noon,1,0,0", (":3:", "stamp_s", "noon")),
}


class BadCsv(ProgramTest):
    def setUp(self):
        super().setUp()
        self.files = {"odom": self.write("odom.csv", POSES), "truth": self.write("truth.csv", POSES),
                      "measurements": self.write("measurements.csv", READINGS)}

    def convert(self):
        options = [text for name, path in self.files.items() for text in (f"--{name}", path)]
        return run("field_bags", "csv_to_bag", *options, "--output", self.output)

    def evaluate(self):
        return run("field_core", "field_eval", "--truth", self.files["truth"], "--estimate",
                   self.files["odom"], "--json", self.output)

    def test_what_the_others_spoil_is_good(self):
        self.must(self.convert())
        self.must(self.evaluate())

    def test_poses(self):
        for reader, names in ((self.convert, ("odom", "truth")), (self.evaluate, ("truth", "odom"))):
            for name in names:
                for problem, (good, bad, texts) in SPOILT_POSES.items():
                    with self.subTest(f"{reader.__name__}, {name}: {problem}"):
                        self.files[name].write_text(POSES.replace(good, bad))
                        self.assert_refused(reader(), self.files[name], *texts)
                self.files[name].write_text(POSES)

    def test_measurements(self):
        for good, bad, texts in (("2,,-71", "2,nan,-71", (":3:", "light", "nan")),
                                 ("3,6,", "3,6,1e999", (":4:", "ap1", "1e999")),
                                 ("stamp_s", "time", ("stamp_s", "time")),
                                 ("3,6,", "2,6,", (":4:", "stamp_s"))):
            with self.subTest(bad):
                self.files["measurements"].write_text(READINGS.replace(good, bad))
                self.assert_refused(self.convert(), self.files["measurements"], *texts)

    def test_files_that_hold_nothing(self):
        for text in ("", "stamp_s,x_m,y_m,yaw_rad\n", "\0\1\2"):
            with self.subTest(repr(text)):
                self.files["odom"].write_text(text)
                self.assert_refused(self.convert(), self.files["odom"])
                self.assert_refused(self.evaluate(), self.files["odom"])

    def test_missing_files(self):
        self.files["odom"].unlink()
        self.assert_refused(self.convert(), self.files["odom"])
        self.assert_refused(self.evaluate(), self.files["odom"])

    def test_an_estimate_of_another_day(self):
        self.files["odom"].write_text(POSES.replace("\n1,", "\n901,").replace("\n2,", "\n902,")
                                      .replace("\n3,", "\n903,"))
        self.assert_refused(self.evaluate(), self.files["odom"])

    def test_points_to_predict(self):
        bag = recordings.write_bag(self.folder / "circle.bag", recordings.circling(duration=10.0))
        config = self.write("config.yaml", recordings.tiny_config())
        for text, texts in (("x_m,y_m\n0,0\n1,nan\n", (":3:", "y_m", "nan")), ("x,y\n0,0\n", ("x_m", "x,y")),
                            ("", ("is empty",))):
            with self.subTest(repr(text)):
                points = self.write("points.csv", text)
                self.assert_refused(replay(bag, config, self.output, "--predict", points), points, *texts)


if __name__ == "__main__":
    main("bad_csv")
