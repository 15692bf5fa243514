#!/usr/bin/python3
"""A roscore that is started anew: the node that ran all the time is found again, with its pose and its map.

Everything that talks to the node is a process of its own, because rospy forgets nothing and registers once.
"""
import os
import socket
import subprocess
import sys

import numpy as np
import rosgraph

from support import recordings
from support.live import Node, Process, advertised_by, wait_for
from support.programs import ProgramTest
from support.runner import main
from support.trajectories import yaw_of

CHANGE_S, END_S = 12.0, 24.0  # at 12 s the circle is 3.8 m from where the robot began
MOST_ERROR_M = 0.6


def print_poses(topic):
    """The child: a line "stamp x y yaw" for each pose; "ready" once the node is connected."""
    import rospy
    from geometry_msgs.msg import PoseWithCovarianceStamped

    def show(message):
        position = message.pose.pose.position
        print(message.header.stamp.to_sec(), position.x, position.y, yaw_of(message.pose.pose.orientation), flush=True)
    rospy.init_node("watcher", anonymous=True)
    subscriber = rospy.Subscriber(topic, PoseWithCovarianceStamped, show, queue_size=None)
    wait_for(lambda: subscriber.get_num_connections() > 0, topic)
    print("ready", flush=True)
    rospy.spin()


def free_port():
    with socket.socket() as s:
        s.bind(("localhost", 0))
        return s.getsockname()[1]


class RoscoreRestart(ProgramTest):
    def setUp(self):
        super().setUp()
        self.port = free_port()
        os.environ["ROS_MASTER_URI"] = f"http://localhost:{self.port}"
        self.start_master()
        stream = [(t, m) for t, m in recordings.circling(duration=END_S)]
        self.bags = []
        for name, wanted in (("before", lambda s: s <= CHANGE_S), ("after", lambda s: s > CHANGE_S)):
            part = [(t, m) for t, m in stream if wanted(m.header.stamp.to_sec() - 100.0)]
            self.bags.append(recordings.write_bag(self.folder / f"{name}.bag", part))
        self.node = Node(recordings.tiny_config(), max_pose_lag=0.0)
        self.addCleanup(self.node.stop)

    def start_master(self):
        self.master = subprocess.Popen(["rosmaster", "--core", "-p", str(self.port)], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
        self.addCleanup(self.master.wait)
        self.addCleanup(self.master.kill)
        wait_for(rosgraph.is_master_online, "the master")

    def drive(self, bag, last):
        """Poses (stamp, x, y) from a watcher that is started now, up to the stamp `last`."""
        watcher = subprocess.Popen([sys.executable, __file__, "--watch", self.node.topic("pose")], text=True,
                                   stdout=subprocess.PIPE, bufsize=1)
        try:
            self.assertEqual(watcher.stdout.readline(), "ready\n")
            player = Process("rosbag", "play", "--quiet", "--wait-for-subscribers", "--rate", "10", bag,
                             f"/odom:={self.node.topic('odom')}", f"/field:={self.node.topic('field')}")
            poses = []
            while not poses or poses[-1][0] < last - 1e-6:
                line = watcher.stdout.readline()
                self.assertTrue(line, "the watcher ended")
                poses.append([float(v) for v in line.split()])
            self.assertEqual(player.finish()[0], 0)
            return np.array(poses)
        finally:
            watcher.kill()
            watcher.wait()
            watcher.stdout.close()

    def check(self, poses):
        truth = np.array([recordings.circle(stamp - 100.0)[:2] for stamp in poses[:, 0]])
        self.assertLess(np.hypot(*(poses[:, 1:3] - truth).T).max(), MOST_ERROR_M)

    def test_the_node_is_found_again(self):
        wait_for(lambda: self.node.topic("pose") in advertised_by(self.node.name), "the node")
        self.check(self.drive(self.bags[0], 100.0 + CHANGE_S - 0.25))
        self.master.kill()
        self.master.wait()
        self.start_master()
        self.assertEqual(advertised_by(self.node.name), [], "a new master knows nobody")
        wait_for(lambda: {self.node.topic("pose"), self.node.topic("predict_field"),
                          self.node.topic("set_parameters")} <= set(advertised_by(self.node.name)),
                 "the node to advertise again")
        self.check(self.drive(self.bags[1], 100.0 + END_S - 0.25))
        answer = self.must(subprocess.run(["rosservice", "call", self.node.topic("predict_field"),
                                           "{names: [light], points: [{x: 0.0, y: 4.0, z: 0.0}]}"],
                                          stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60))
        self.assertIn("success: True", answer)
        # Learned at 10 s, before the change; the prior's variance is 4.
        variance = float(answer.split("variance:")[1].split("\n")[0].strip(" []"))
        self.assertLess(variance, 1.0)
        self.assertEqual(self.node.stop(), 0)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--watch"]:
        print_poses(sys.argv[2])
    else:
        main("roscore_restart")
