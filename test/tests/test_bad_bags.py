#!/usr/bin/python3
"""What is wrong with a bag, and what to do, in one line; nothing half-written."""
import rosbag
from std_msgs.msg import String

from support import messages, recordings, workspace
from support.programs import BAD_DATA, ProgramTest, replay, run
from support.runner import main


class BadBags(ProgramTest):
    """Each broken bag goes through every program that reads bags."""

    def setUp(self):
        super().setUp()
        self.config = self.write("config.yaml", recordings.tiny_config())

    def replay(self, bag, *more):
        return replay(bag, self.config, self.output, *more)

    def everyone(self, bag):
        """(program, result) of every reader of bags."""
        json_file = self.output / "errors.json"
        estimate = self.write("estimate.csv", "stamp_s,x_m,y_m,yaw_rad\n100,0,0,0\n101,0,0,0\n")
        yield "gp_localize_replay", self.replay(bag)
        yield "bag_trajectory", run("field_ros", "bag_trajectory", bag, "/odom")
        yield "field_eval", run("field_core", "field_eval", "--truth", f"{bag}:/odom", "--estimate", estimate,
                                "--json", json_file)

    def assert_all_refuse(self, bag, *texts):
        for name, done in self.everyone(bag):
            with self.subTest(name):
                self.assert_refused(done, bag, *texts)
                self.assertEqual(done.stdout, "")

    def test_missing(self):
        self.assert_all_refuse(self.folder / "no_such.bag", "No such file")

    def test_not_a_bag(self):
        self.assert_all_refuse(self.write("notes.bag", "these are my notes\n"), "is not a bag")

    def test_empty_file(self):
        self.assert_all_refuse(self.write("empty.bag", ""), "is not a bag")

    def test_without_messages(self):
        bag = recordings.write_bag(self.folder / "silent.bag", [])
        self.assert_all_refuse(bag, "holds no message", "record it again")

    def test_cut_in_half(self):
        for name in ("hall_light", "office_wifi"):
            bag = recordings.cut(workspace.bag(name), self.folder / f"{name}.bag", 0.5)
            self.assert_all_refuse(bag, "rosbag reindex")

    def test_cut_at_many_places(self):
        whole = recordings.write_bag(self.folder / "whole.bag", recordings.circling())
        for percent in (1, 10, 30, 60, 90, 99):
            with self.subTest(percent):
                bag = recordings.cut(whole, self.folder / "part.bag", percent / 100)
                self.assert_refused(self.replay(bag), bag)

    def test_bytes_overwritten_in_the_middle(self):
        whole = recordings.write_bag(self.folder / "whole.bag", recordings.circling())
        content = bytearray(whole.read_bytes())
        middle = len(content) // 2
        content[middle:middle + 4000] = b"\xff" * 4000
        damaged = self.folder / "damaged.bag"
        damaged.write_bytes(content)
        self.assert_refused(self.replay(damaged), damaged, "damaged")

    def test_wrong_topic_lists_those_of_the_right_type(self):
        bag = workspace.bag("hall_light")
        done = self.replay(bag, "--odom-topic", "/wheel_odom")
        self.assert_refused(done, bag, "/wheel_odom", "nav_msgs/Odometry in this bag: /odom")
        done = self.replay(bag, "--field-topic", "/odom")
        self.assert_refused(done, "topic '/odom' is nav_msgs/Odometry", "in this bag: /field")
        done = run("field_ros", "bag_trajectory", bag, "/truth")
        self.assert_refused(done, bag, "/truth", "/ground_truth", "/odom")
        estimate = self.write("estimate.csv", "stamp_s,x_m,y_m,yaw_rad\n100,0,0,0\n101,0,0,0\n")
        done = run("field_core", "field_eval", "--truth", f"{bag}:/truth", "--estimate", estimate)
        self.assert_refused(done, "/truth", "/ground_truth")

    def test_foreign_topics_only(self):
        bag = self.folder / "chatter.bag"
        with rosbag.Bag(str(bag), "w") as recording:
            recording.write("/chatter", String("hello"))
        self.assert_refused(self.replay(bag), bag, "there is no topic '/odom'", "none")

    def test_no_measurement_can_be_used(self):
        stream = [(topic, m) for topic, m in recordings.circling() if topic == "/odom"]
        stream.append(("/field", messages.measurement(120.0, humidity=40.0)))
        bag = recordings.write_bag(self.folder / "humid.bag", stream)
        self.assert_refused(self.replay(bag), bag, "no measurement could be used", "1 no_known_field")

    def test_measurements_of_another_day(self):
        stream = [(topic, m) for topic, m in recordings.circling() if topic == "/odom"]
        stream.append(("/field", messages.measurement(90000.0, light=5.0)))
        bag = recordings.write_bag(self.folder / "late.bag", stream)
        self.assert_refused(self.replay(bag), bag, "1 without odometry", "compare stamps")

    def test_an_output_that_was_there_keeps_its_files(self):
        self.output.mkdir()
        (self.output / "notes.txt").write_text("mine")
        done = self.replay(self.folder / "no_such.bag")
        self.assertEqual(done.returncode, BAD_DATA)
        self.assertEqual([p.name for p in self.output.iterdir()], ["notes.txt"])

    def test_output_is_a_file(self):
        bag = recordings.write_bag(self.folder / "whole.bag", recordings.circling())
        place = self.write("results", "mine")
        done = replay(bag, self.config, place)
        self.assert_refused(done, place, "is a file")
        self.assertEqual(place.read_text(), "mine")


if __name__ == "__main__":
    main("bad_bags")
