"""Recordings (CSV) as runs of vector_field_slam, with odometry degraded or sensors simulated over them."""
import csv

import numpy as np

POSES = "stamp_s,x_m,y_m,yaw_rad"


def read_poses(file):
    """Rows of stamp, x, y, yaw."""
    return np.loadtxt(file, delimiter=",", skiprows=1)


def write_table(file, header, rows):
    with open(file, "w", newline="") as f:
        writer = csv.writer(f)
        writer.writerow(header.split(","))
        writer.writerows([["" if isinstance(v, float) and np.isnan(v) else f"{v:.6f}" for v in row] for row in rows])
    return file


def increments(poses):
    """Motions between rows in the frame of the first: columns forward, left, turn."""
    c, s = np.cos(poses[:-1, 3]), np.sin(poses[:-1, 3])
    dx, dy = np.diff(poses[:, 1]), np.diff(poses[:, 2])
    turn = (np.diff(poses[:, 3]) + np.pi) % (2.0 * np.pi) - np.pi
    return np.c_[c * dx + s * dy, -s * dx + c * dy, turn]


def integrate(stamps, motions):
    """Poses from the origin."""
    yaw = np.r_[0.0, np.cumsum(motions[:, 2])]
    c, s = np.cos(yaw[:-1]), np.sin(yaw[:-1])
    x = np.r_[0.0, np.cumsum(c * motions[:, 0] - s * motions[:, 1])]
    y = np.r_[0.0, np.cumsum(s * motions[:, 0] + c * motions[:, 1])]
    return np.c_[stamps, x, y, (yaw + np.pi) % (2.0 * np.pi) - np.pi]


def with_heading_drift(poses, radians_per_metre):
    motions = increments(poses)
    motions[:, 2] += radians_per_metre * np.hypot(motions[:, 0], motions[:, 1])
    return integrate(poses[:, 0], motions)


def with_noise(poses, random, translation, heading):
    """Noise of `translation` m / sqrt(m) and `heading` rad / sqrt(m) on the increments."""
    motions = increments(poses)
    root = np.sqrt(np.hypot(motions[:, 0], motions[:, 1]))
    motions[:, 0] += translation * root * random.standard_normal(len(root))
    motions[:, 2] += heading * root * random.standard_normal(len(root))
    return integrate(poses[:, 0], motions)


def at(poses, stamps):
    """Poses at other stamps, interpolated."""
    yaw = np.interp(stamps, poses[:, 0], np.unwrap(poses[:, 3]))
    return np.c_[stamps, np.interp(stamps, poses[:, 0], poses[:, 1]), np.interp(stamps, poses[:, 0], poses[:, 2]), yaw]


def beacon_readings(poses, random, multipath=0.3, height=2.5, noise=0.012):
    """Two optical spots on the ceiling above the middle of where the robot drives, bent by mirror images at the walls
    of a room half a metre larger: the world of vector_field_slam/test/simulated_run.hpp. Four columns."""
    places = poses[:, 1:3]
    low, high = places.min(axis=0) - 0.5, places.max(axis=0) + 0.5
    c, s = np.cos(poses[:, 3])[:, None], np.sin(poses[:, 3])[:, None]
    columns = []
    for spot in ((low + high) / 2.0 + d for d in ((-0.5, 0.25), (0.5, -0.25))):
        total, weights = spot - places, np.ones((len(places), 1))
        for axis in (0, 1):
            for wall in (low[axis], high[axis]):
                image = spot.copy()
                image[axis] = 2.0 * wall - spot[axis]
                weight = multipath * np.exp(-np.abs(places[:, [axis]] - wall))
                total, weights = total + weight * (image - places), weights + weight
        seen = total / (weights * height)
        x, y = seen[:, [0]], seen[:, [1]]
        columns += [c * x + s * y + 0.02, -s * x + c * y - 0.015]
    return np.hstack(columns) + noise * random.standard_normal((len(places), 4))


def read_measurements(file):
    """Names of the fields; rows of stamp and values, NaN where not observed."""
    with open(file) as f:
        header = f.readline().strip().split(",")
    return header[1:], np.genfromtxt(file, delimiter=",", skip_header=1)
