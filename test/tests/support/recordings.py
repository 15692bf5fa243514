"""Small bags and configurations, made on the spot."""
import math

import rosbag
import yaml

from support import messages

# One field over a 10 m x 10 m square; quick to replay.
TINY_CONFIG = {
    "fields": {"light": {"mean": 5.0, "signal_stddev": 2.0, "noise_stddev": 0.2, "length_scales": [1.5, 1.5]}},
    "particles": 50,
    "sample_paths": 50,
    "support": {"selection": "grid", "size": 25, "region": [-5.0, -5.0, 5.0, 5.0]},
    "odom_alpha1": 0.01, "odom_alpha2": 0.01, "odom_alpha3": 0.01, "odom_alpha4": 0.01,
    "initial_cov_xx": 0.01, "initial_cov_yy": 0.01, "initial_cov_aa": 0.001,
}


def tiny_config(**changes):
    """YAML text of TINY_CONFIG; support=..., fields=... are merged one level deep."""
    values = {key: dict(value) if isinstance(value, dict) else value for key, value in TINY_CONFIG.items()}
    for key, value in changes.items():
        if isinstance(value, dict) and isinstance(values.get(key), dict):
            values[key].update(value)
        else:
            values[key] = value
    return yaml.safe_dump(values, sort_keys=False)


def light_at(x, y):
    """A smooth field that no two nearby places of a circle share."""
    return 5.0 + 2.0 * math.sin(1.1 * x) * math.cos(0.7 * y) + 0.3 * x


def sound_at(x, y):
    return 40.0 + 3.0 * math.sin(0.8 * y + 0.5) + 2.0 * math.cos(0.9 * x - 0.4 * y)


def circle(seconds, radius=2.0, period=20.0):
    """Pose (x, y, yaw) of a robot on a circle that starts at the origin, heading along x."""
    angle = 2.0 * math.pi * seconds / period
    return radius * math.sin(angle), radius * (1.0 - math.cos(angle)), math.remainder(angle, 2.0 * math.pi)


def circling(duration=40.0, start=100.0, odom_rate=10.0, field_rate=2.0):
    """Messages (topic, message) of a robot on the circle, by stamp; odometry is exact."""
    merged = []
    for i in range(int(duration * odom_rate) + 1):
        seconds = i / odom_rate
        merged.append((start + seconds, "/odom", messages.odometry(start + seconds, *circle(seconds))))
    for i in range(int(duration * field_rate)):
        seconds = (i + 0.5) / field_rate
        x, y, _ = circle(seconds)
        merged.append((start + seconds, "/field", messages.measurement(start + seconds, light=light_at(x, y))))
    return [(topic, message) for _, topic, message in sorted(merged, key=lambda m: m[0])]


def write_bag(path, stream):
    with rosbag.Bag(str(path), "w") as recording:
        for topic, message in stream:
            recording.write(topic, message, message.header.stamp)
    return path


def cut(source, target, share):
    """The first part of a file, as a full disk or a pulled plug leaves it."""
    content = source.read_bytes()
    target.write_bytes(content[:int(len(content) * share)])
    return target
