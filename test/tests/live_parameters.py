#!/usr/bin/python3
"""A wrong value on the parameter server: exit code 1, one line, and nothing was ever advertised."""
import unittest

import rosgraph
from std_srvs.srv import Empty

from support import recordings
from support.live import Node, advertised_by, start_test_node
from support.runner import main


def topics_ever_of(name):
    """Topics below /name that were ever advertised or subscribed: the master remembers their types."""
    known = rosgraph.Master("/field_system_tests").getTopicTypes()
    return [topic for topic, _ in known if topic.startswith(f"/{name}/")]


class Parameters(unittest.TestCase):
    def refused(self, *texts, configuration=None, **parameters):
        node = Node(configuration or recordings.tiny_config(), **parameters)
        self.addCleanup(node.stop)
        code, _, err = node.finish()
        self.assertEqual(code, 1, err)
        self.assertEqual(len(err.splitlines()), 1, f"not one line: {err!r}")
        for text in texts:
            self.assertIn(text, err)
        self.assertEqual(topics_ever_of(node.name), [])
        self.assertEqual([t for t in advertised_by(node.name) if t != "/rosout"
                          and not t.endswith(("/get_loggers", "/set_logger_level"))], [])

    def test_misspelt_key(self):
        self.refused("partikles", "particles", partikles=50)
        self.refused("support/seize", "size",
                     configuration=recordings.tiny_config(support={"seize": 9}))

    def test_wrong_type(self):
        self.refused("particles", "many", particles="many")
        self.refused("particles", "400", particles="400")
        self.refused("tf_broadcast", "1", tf_broadcast=1)
        self.refused("support/region",
                     configuration=recordings.tiny_config(support={"region": "all"}))

    def test_out_of_range(self):
        self.refused("particles", "0", "1 to 100000", particles=0)
        self.refused("odom_alpha1", "-0.5", ">= 0", odom_alpha1=-0.5)
        self.refused("initial_pose_x", initial_pose_x=float("nan"))
        self.refused("map_hypotheses", "both", "sample_paths", "particle",
                     map_hypotheses="both")

    def test_frames(self):
        self.refused("odom_frame_id", "/odom", "slash", odom_frame_id="/odom")
        self.refused("odom_frame_id", "global_frame_id", odom_frame_id="map")

    def test_nothing_on_the_server(self):
        self.refused("fields", configuration="particles: 50")

    def test_zero_motion_noise_and_exact_start_are_legal(self):
        exact = {key: 0.0 for key in ("odom_alpha1", "odom_alpha2", "odom_alpha3", "odom_alpha4",
                                      "initial_cov_xx", "initial_cov_yy", "initial_cov_aa")}
        node = Node(recordings.tiny_config(**exact))
        self.addCleanup(node.stop)
        node.service("reset", Empty)
        self.assertTrue(topics_ever_of(node.name))
        self.assertEqual(node.stop(), 0)


if __name__ == "__main__":
    start_test_node("live_parameters")
    main("live_parameters")
