#!/usr/bin/python3
"""The life of a deployment: survey.launch with a known pose, then localize.launch, anywhere on the map."""
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
import rospy
import yaml
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

from support import messages, recordings
from support.live import Collector, Process, start_test_node, wait_for
from support.runner import main

LAP_S = 20.0
MOST_ERROR_M = 0.6


class Deployment(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="field_system_tests_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        config = self.folder / "robot.yaml"
        config.write_text(recordings.tiny_config(state_directory=str(self.folder / "states"), max_pose_lag=0.0,
                                                 odom_queue_size=10000, field_queue_size=10000))
        self.config = config

    def launch(self, file, *arguments):
        process = Process("roslaunch", "field_launch", file, "site:=hall", f"directory:={self.folder}/survey",
                          "field_topic:=/field", *arguments)
        self.addCleanup(process.stop)
        return process

    def publisher(self, topic, message_type, process):
        publisher = rospy.Publisher(topic, message_type, queue_size=0)
        wait_for(lambda: publisher.get_num_connections() > 0 or not process.running(),
                 lambda: f"a subscriber of {topic}")
        self.assertTrue(process.running(), "the launch ended: " + str(process.running() or process.finish()[2]))
        return publisher

    def drive(self, odom, field, begin, seconds, offset):
        """Around the circle, beginning `offset` seconds after its start."""
        for tick in range(round(seconds * 10) + 1):
            time = tick / 10.0
            x, y, yaw = recordings.circle(time + offset)
            stamp = begin + time
            odom.publish(messages.odometry(stamp, x, y, yaw))
            if tick % 5 == 2:
                field.publish(messages.measurement(stamp, light=recordings.light_at(x, y)))
        return stamp

    def survey(self):
        launch = self.launch("survey.launch", f"config:={self.config}", "odom_topic:=/known_pose")
        odom = self.publisher("/known_pose", Odometry, launch)
        field = self.publisher("/field", FieldMeasurement, launch)
        rospy.wait_for_service("/survey/finish", 30.0)
        self.drive(odom, field, 100.0, 2 * LAP_S, 0.0)
        wait_for(lambda: (self.folder / "survey" / "hall.bag.active").exists()
                 or (self.folder / "survey" / "hall.bag").exists(), "the bag")
        answer = rospy.ServiceProxy("/survey/finish", Trigger)()
        self.assertTrue(answer.success, answer.message)
        wait_for(lambda: not launch.running(), "the launch to end with the survey")
        return answer.message

    def test_survey_then_localize_anywhere(self):
        message = self.survey()
        self.assertIn("localize.launch site:=hall", message)
        files = {p.name for p in (self.folder / "survey").iterdir()}
        self.assertTrue({"hall.bag", "hall.yaml", "hall"} <= files, files)
        maps = {p.name for p in (self.folder / "survey" / "hall").iterdir()}
        self.assertTrue({"field_light.csv", "field_light.pgm", "field_light.yaml", "field_light.asc"} <= maps, maps)
        values = yaml.safe_load((self.folder / "survey" / "hall.yaml").read_text())
        self.assertNotEqual(values["fields"]["light"]["length_scales"], [1.5, 1.5], "nothing was learned")
        launch = self.launch("localize.launch", "odom_topic:=/wheel_odom")
        poses = Collector("/gp_localize/pose", PoseWithCovarianceStamped)
        odom = self.publisher("/wheel_odom", Odometry, launch)
        field = self.publisher("/field", FieldMeasurement, launch)
        wait_for(lambda: poses.subscriber.get_num_connections() > 0, "~pose")
        # It begins a third of the way around; nobody tells it. This world has no noise, so the map's own errors
        # are all that readings differ by: close together they count little, and it takes three laps.
        end = self.drive(odom, field, 500.0, 4 * LAP_S, 7.0)
        wait_for(lambda: poses.all() and poses.last().header.stamp.to_sec() > end - 0.5, "the last pose")
        found = [(m.header.stamp.to_sec(), m.pose.pose.position) for m in poses.all()]
        errors = [np.hypot(p.x - x, p.y - y) for s, p in found
                  for x, y, _ in [recordings.circle(s - 500.0 + 7.0)]]
        print("error at the start and after four laps", np.round(errors[0], 2), np.round(errors[-10:], 2))
        self.assertGreater(errors[0], 1.0, "it knew where it was")
        self.assertLess(max(errors[-10:]), MOST_ERROR_M)
        self.assertEqual(launch.stop(), 0)
        # Stopped on purpose, it has saved where it is: the next launch goes on from there.
        self.assertEqual({p.name for p in (self.folder / "states").iterdir()}, {"hall.bag", "hall_last.bag"})


if __name__ == "__main__":
    start_test_node("live_deployment")
    main("live_deployment")
