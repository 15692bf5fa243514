"""Messages of the suite's interface, well formed; tests spoil what they mean to spoil."""
import math

import genpy
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry


def _stamp(message, seconds):
    # Not Time.from_sec(), which cuts 100.2 to 100.199999999.
    message.header.stamp = genpy.Time(0, round(seconds * 1e9))
    return message


def odometry(seconds, x=0.0, y=0.0, yaw=0.0):
    message = _stamp(Odometry(), seconds)
    message.header.frame_id, message.child_frame_id = "odom", "base_link"
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.z = math.sin(yaw / 2)
    message.pose.pose.orientation.w = math.cos(yaw / 2)
    return message


def measurement(seconds, frame="base_link", variances=(), **fields):
    message = _stamp(FieldMeasurement(), seconds)
    message.header.frame_id = frame
    message.names, message.values = list(fields), [float(v) for v in fields.values()]
    message.variances = list(variances)
    return message


def initialpose(seconds, x, y, yaw=0.0, variance=0.01):
    message = _stamp(PoseWithCovarianceStamped(), seconds)
    message.header.frame_id = "map"
    message.pose.pose = odometry(seconds, x, y, yaw).pose.pose
    for i in (0, 7, 35):
        message.pose.covariance[i] = variance
    return message
