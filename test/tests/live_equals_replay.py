#!/usr/bin/python3
"""The poses that the live node publishes over a bag are those of the replay, to the last bit."""
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
import rosbag
import yaml
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from support import recordings, trajectories, workspace
from support.live import Collector, Node, start_test_node, wait_for
from support.programs import replay
from support.robot import QUEUES, covariance_of
from support.runner import main

SEED = 5


def part_of(source, target, seconds):
    """The first seconds of a bag."""
    with rosbag.Bag(str(source)) as whole, rosbag.Bag(str(target), "w") as part:
        end = whole.get_start_time() + seconds
        for topic, message, time in whole.read_messages():
            if time.to_sec() <= end:
                part.write(topic, message, time)
    return target


class LiveEqualsReplay(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="field_system_tests_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def live_poses(self, bag, configuration, count):
        """Everything on ~pose while the messages of the bag are published in their order."""
        node = Node(configuration, seed=SEED, **QUEUES)
        self.addCleanup(node.stop)
        poses = Collector(node.topic("pose"), PoseWithCovarianceStamped)
        publishers = {"/odom": node.publisher("odom", Odometry), "/field": node.publisher("field", FieldMeasurement)}
        wait_for(lambda: poses.subscriber.get_num_connections() > 0, "~pose")
        fields = 0
        with rosbag.Bag(str(bag)) as recording:
            for topic, message, _ in recording.read_messages(list(publishers)):
                # A few measurements ahead of the node at most: ~pose has a short queue.
                if topic == "/field":
                    fields += 1
                    wait_for(lambda: len(poses.all()) >= fields - 5, f"pose {fields - 5}")
                publishers[topic].publish(message)
        poses.wait(count)
        self.assertEqual(node.stop(), 0)
        return poses.all()

    def check(self, bag, configuration):
        config = self.folder / "config.yaml"
        config.write_text(configuration)
        done = replay(bag, config, self.folder / "out", "--seed", SEED)
        self.assertEqual(done.returncode, 0, done.stderr)
        _, expected = trajectories.read_csv(self.folder / "out" / "estimate.csv")
        poses = self.live_poses(bag, configuration, len(expected))
        self.assertGreater(len(expected), 20)
        self.assertEqual(len(poses), len(expected))
        upper = np.triu_indices(3)
        # The file's stamps are exact decimals; as doubles they are 1e-13 s apart.
        np.testing.assert_allclose([m.header.stamp.to_sec() for m in poses], expected[:, 0], rtol=0, atol=1e-9)
        live = np.array([[m.pose.pose.position.x, m.pose.pose.position.y, *covariance_of(m)[upper]]
                         for m in poses])
        # The file holds the shortest decimals that give back each double.
        np.testing.assert_array_equal(live, np.delete(expected, [0, 3], axis=1))
        # A quaternion's sine and cosine are rounded: a few 1e-16 rad.
        yaw = [trajectories.yaw_of(m.pose.pose.orientation) for m in poses]
        np.testing.assert_allclose(trajectories.wrapped(yaw - expected[:, 3]), 0.0, atol=1e-14)

    def test_a_map_per_particle(self):
        bag = part_of(workspace.bag("office_wifi"), self.folder / "part.bag", 120.0)
        self.check(bag, workspace.config("office_wifi").read_text())

    def test_the_papers_shared_sample_paths(self):
        bag = part_of(workspace.bag("office_wifi"), self.folder / "part.bag", 60.0)
        values = yaml.safe_load(workspace.config("office_wifi").read_text())
        values.update(map_hypotheses="sample_paths", particles=100, sample_paths=100)
        self.check(bag, yaml.safe_dump(values))

    def test_measurements_between_odometry(self):
        bag = recordings.write_bag(self.folder / "circle.bag", recordings.circling(odom_rate=3.0, field_rate=2.0))
        self.check(bag, recordings.tiny_config())


if __name__ == "__main__":
    start_test_node("live_equals_replay")
    main("live_equals_replay")
