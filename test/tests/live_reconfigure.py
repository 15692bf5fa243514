#!/usr/bin/python3
"""Parameters that change while the node runs, through dynamic_reconfigure's own client (as rqt_reconfigure has it)."""
import unittest

from dynamic_reconfigure.client import Client
from field_msgs.msg import FieldMap

from support.live import PATIENCE_S, Collector, start_test_node, wait_for
from support.robot import Robot
from support.runner import main
from tf2_msgs.msg import TFMessage


class Reconfigure(unittest.TestCase):
    def setUp(self):
        self.robot = Robot(map_publish_period=0.0)
        self.addCleanup(self.robot.node.stop)
        self.client = Client(self.robot.node.name, timeout=PATIENCE_S)
        self.addCleanup(self.client.close)

    def test_the_client_sees_what_there_is(self):
        described = {p["name"]: p for p in self.client.get_parameter_descriptions()}
        self.assertEqual(described["lost_nis"]["min"], 1.0)
        self.assertIn("path_length", described)
        self.assertNotIn("particles", described, "fixed once the node runs")
        self.assertEqual(self.client.get_configuration()["map_publish_period"], 0.0)

    def test_a_change_takes_effect(self):
        maps = Collector(self.robot.node.topic("field_map"), FieldMap)
        wait_for(lambda: maps.subscriber.get_num_connections() > 0, "~field_map")
        self.robot.drive(4.0)
        self.assertEqual(maps.all(), [], "maps are off")
        self.assertEqual(self.client.update_configuration({"map_publish_period": 0.05})["map_publish_period"], 0.05)
        maps.wait(2)
        transforms = Collector("/tf", TFMessage)
        wait_for(lambda: transforms.subscriber.get_num_connections() > 0, "/tf")
        self.robot.drive(2.0)
        wait_for(lambda: transforms.all(), "map -> odom")
        self.client.update_configuration({"tf_broadcast": False})
        count = len(transforms.all())
        self.robot.drive(4.0)
        # Those that were on their way; 40 odometry messages would have made 40.
        self.assertLess(len(transforms.all()) - count, 10)

    def test_what_is_not_allowed_changes_nothing(self):
        before = self.client.get_configuration()
        self.assertEqual(self.client.update_configuration({"path_length": 0})["path_length"], before["path_length"])
        self.robot.drive(2.0)
        self.assertTrue(self.robot.node.running())


if __name__ == "__main__":
    start_test_node("live_reconfigure")
    main("live_reconfigure")
