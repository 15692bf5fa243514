#!/usr/bin/python3
"""Starts a launch file and rviz on a virtual screen; takes a picture when the bag has been played."""
import argparse
import os
import pathlib
import subprocess
import sys
import time

import rosbag
import rosgraph
import rospy
from rosgraph_msgs.msg import Clock
from support import workspace
from support.live import Process, wait_for
from support.screen import Screen, config

# name of the picture and of the rviz configuration: launch file, arguments, bag, seconds of it, rate
PICTURES = {
    "gp_localize": ("demo.launch", ["node:=gp_localize"], "office_wifi", 300, 15),
    "gmrf_slap": ("demo.launch", ["node:=gmrf_slap"], "office_wifi", 300, 5),
    "vector_field_slam": ("demo.launch", ["node:=vector_field_slam"], "warehouse_magnetic", 300, 10),
    "two_robots": ("demo.launch", ["node:=gmrf_slap"], "two_robots_light", 300, 5),
    "compare": ("compare.launch", [], "office_wifi", 300, 4),
}
MASTER_PORT = 11399
SETTLE_S = 6.0  # of wall time: the last maps are drawn, and rviz shows them


def begin_of(bag):
    with rosbag.Bag(str(workspace.bag(bag))) as recording:
        return recording.get_start_time(), recording.get_end_time()


def take(name, output):
    launch, arguments, bag, seconds, rate = PICTURES[name]
    clock = []
    subscriber = rospy.Subscriber("/clock", Clock, lambda message: clock.append(message.clock.to_sec()))
    begin, end = begin_of(bag)
    until = min(begin + seconds, end - 1.0)
    screen = Screen()
    nodes = Process("roslaunch", "field_launch", launch, f"bag:={bag}", f"rate:={rate}",
                    f"duration:={until - begin + 1.0}", "rviz:=false", *arguments)
    rviz = screen.rviz(config(name))
    try:
        wait_for(lambda: clock and clock[-1] >= until or not nodes.running(),
                 lambda: f"{name}: {until - begin:.0f} s of {bag}", timeout=600.0)
        if not nodes.running():
            sys.exit(f"{name}: {nodes.finish()[2]}")
        time.sleep(SETTLE_S)
        file = output / f"rviz_{name}.png"
        screen.picture().save(file, optimize=True)
        print(file)
    finally:
        for process in (rviz, nodes):
            process.stop()
        screen.stop()
        subscriber.unregister()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("names", nargs="*", default=list(PICTURES), help=f"of {', '.join(PICTURES)}")
    arguments = parser.parse_args()
    # A master of its own: a running robot is left alone.
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{MASTER_PORT}"
    master = subprocess.Popen(["rosmaster", "--core", "-p", str(MASTER_PORT)], stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL)
    try:
        wait_for(rosgraph.is_master_online, "roscore")
        rospy.init_node("screenshots", disable_signals=True)
        for name in arguments.names:
            take(name, arguments.output)
    finally:
        master.terminate()
        master.wait()


if __name__ == "__main__":
    main()
