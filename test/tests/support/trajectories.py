"""Trajectories as numpy arrays with rows (stamp_s, x_m, y_m, yaw_rad[, covariance])."""
import csv
import math

import numpy as np
import rosbag


def read_csv(path):
    with open(path) as f:
        rows = list(csv.reader(f))
    return rows[0], np.array(rows[1:], dtype=float)


def yaw_of(q):
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


def wrapped(angle):
    return np.arctan2(np.sin(angle), np.cos(angle))


def from_bag(bag, topic):
    """Poses of a topic of PoseStamped or Odometry."""
    rows = []
    with rosbag.Bag(str(bag)) as recording:
        for _, message, _ in recording.read_messages([topic]):
            pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
            rows.append((message.header.stamp.to_sec(), pose.position.x, pose.position.y,
                         yaw_of(pose.orientation)))
    return np.array(rows)


def at(trajectory, stamps):
    """Poses at stamps, between two rows linearly in x and y and along the shorter arc in yaw."""
    columns = [np.interp(stamps, trajectory[:, 0], trajectory[:, c]) for c in (1, 2)]
    columns.append(np.interp(stamps, trajectory[:, 0], np.unwrap(trajectory[:, 3])))
    return np.stack(columns, axis=1)


def position_errors(truth, estimate):
    """Distances [m] of an estimate's poses from the truth, by stamp."""
    return np.linalg.norm(at(truth, estimate[:, 0])[:, :2] - estimate[:, 1:3], axis=1)
