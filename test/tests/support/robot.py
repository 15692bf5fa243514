"""A robot on the circle of support.recordings that drives a live node, as fast as the node can."""
import numpy as np
from field_msgs.msg import FieldMeasurement
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from support import messages, recordings
from support.live import Collector, Node, wait_for
from support.trajectories import yaw_of

# Nothing may be lost in a queue, or shed, when a test feeds faster than real time.
QUEUES = {"odom_queue_size": 100000, "field_queue_size": 100000, "max_pose_lag": 0.0}


def covariance_of(message):
    """The 3 x 3 covariance of (x, y, yaw)."""
    return np.array(message.pose.covariance).reshape(6, 6)[np.ix_((0, 1, 5), (0, 1, 5))]


class Robot:
    """Odometry is exact, readings are those of light_at(): the node should know where the robot is."""

    def __init__(self, configuration=None, start=100.0, **parameters):
        self.node = Node(configuration or recordings.tiny_config(), **dict(QUEUES, **parameters))
        self.poses = Collector(self.node.topic("pose"), PoseWithCovarianceStamped)
        self.odom = self.node.publisher("odom", Odometry)
        self.field = self.node.publisher("field", FieldMeasurement)
        wait_for(lambda: self.poses.subscriber.get_num_connections() > 0, "the node's ~pose")
        self.start, self.driven, self._known = start, 0.0, 0
        self.kidnapped_s = 0.0

    def truth(self, time):
        """Where the robot is; odometry never learns that somebody has put it elsewhere on the circle."""
        return recordings.circle(time + self.kidnapped_s)

    def now(self):
        return self.start + self.driven

    def drive(self, seconds):
        """Ten odometry messages and two measurements a second, until the node has used them all.

        Two seconds at a time: the node's ~pose has a queue of ten, and no pose is to be lost.
        """
        end = round((self.driven + seconds) * 10)
        while round(self.driven * 10) < end:
            self._drive_ticks(round(self.driven * 10), min(end, round(self.driven * 10) + 20))

    def _drive_ticks(self, begin, end):
        for tick in range(begin, end + 1):
            time = tick / 10.0
            if tick > begin or tick == 0:
                self.odom.publish(messages.odometry(self.start + time, *recordings.circle(time)))
            if tick % 5 == 2 and tick > begin:
                self.measure(time)
        self.driven = end / 10.0
        last = end - (end - 2) % 5
        if last > begin:
            wait_for(lambda: self._last_stamp() >= self.start + last / 10.0 - 1e-6,
                     lambda: f"a pose at {self.start + last / 10.0}, newest is {self._last_stamp()}")

    def measure(self, time):
        x, y, _ = self.truth(time)
        self.field.publish(messages.measurement(self.start + time, light=recordings.light_at(x, y)))

    def restart_clock(self, start):
        """The same drive again, at another time; poses received before do not count any more.

        Publishes the two odometry messages by which the node tells a restart. Measurements come over another
        connection and may overtake them: wait for the reset before driving on.
        """
        self.start, self.driven, self._known = start, 0.1, len(self.poses.all())
        for time in (0.0, 0.1):
            self.odom.publish(messages.odometry(start + time, *recordings.circle(time)))

    def received(self):
        """Poses since the start of the clock."""
        return self.poses.all()[self._known:]

    def _last_stamp(self):
        received = self.received()
        return received[-1].header.stamp.to_sec() if received else float("-inf")

    def errors(self, since=0.0):
        """Position errors [m] by stamp, of all poses received with a stamp of at least `since`."""
        found = {}
        for message in self.received():
            stamp = message.header.stamp.to_sec()
            if stamp >= since:
                x, y, _ = self.truth(stamp - self.start)
                found[stamp] = np.hypot(message.pose.pose.position.x - x, message.pose.pose.position.y - y)
        return np.array(list(found.values()))

    def check_poses(self, test, since=0.0):
        """Every pose is well formed: frame, finite, unit quaternion, covariance SPD."""
        for message in self.received():
            if message.header.stamp.to_sec() < since:
                continue
            check_pose(test, message)


class TwoFieldRobot(Robot):
    """One field alone leaves the filter a way out: along a line of equal light."""

    def measure(self, time):
        x, y, _ = self.truth(time)
        self.field.publish(messages.measurement(self.start + time, light=recordings.light_at(x, y),
                                                sound=recordings.sound_at(x, y)))


def check_pose(test, message):
    position, q = message.pose.pose.position, message.pose.pose.orientation
    test.assertEqual(message.header.frame_id, "map")
    test.assertTrue(np.isfinite([position.x, position.y, yaw_of(q)]).all(), message)
    test.assertEqual(position.z, 0.0)
    test.assertAlmostEqual(q.x**2 + q.y**2 + q.z**2 + q.w**2, 1.0, delta=1e-12)
    covariance = covariance_of(message)
    np.testing.assert_array_equal(covariance, covariance.T)
    np.linalg.cholesky(covariance)  # raises unless positive definite
