"""Live nodes: start, feed, watch and stop them. No fixed sleeps: everything waits for a condition."""
import itertools
import signal
import subprocess
import tempfile
import threading
import time

import rosgraph
import rospy
import yaml
from diagnostic_msgs.msg import DiagnosticArray

from support import workspace

# Far longer than anything takes on an idle machine: only a failure waits this long.
PATIENCE_S = 60.0


def wait_for(condition, what, timeout=PATIENCE_S):
    """The first true value of condition(); an AssertionError that says what did not come."""
    end = time.monotonic() + timeout
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"waited {timeout:.0f} s in vain for {what() if callable(what) else what}")
        time.sleep(0.01)


class Collector:
    """All messages of a topic since it was made."""

    def __init__(self, topic, message_type, keep=lambda message: message):
        self._lock, self._messages, self._keep = threading.Lock(), [], keep
        # None: unbounded, a busy machine must not lose messages that a test wants to see.
        self.subscriber = rospy.Subscriber(topic, message_type, self._add, queue_size=None,
                                           buff_size=2**24)

    def _add(self, message):
        with self._lock:
            self._messages.append(self._keep(message))

    def all(self):
        with self._lock:
            return list(self._messages)

    def last(self):
        with self._lock:
            return self._messages[-1] if self._messages else None

    def wait(self, count=1):
        wait_for(lambda: len(self.all()) >= count,
                 lambda: f"{count} messages of {self.subscriber.name}, got {len(self.all())}")
        return self.all()


class Diagnostics:
    """The two statuses of one node, as dictionaries."""

    def __init__(self, node):
        self._node, self._collector = node, Collector("/diagnostics", DiagnosticArray)

    def reports(self):
        """(level, message, values) by short name, of each report so far."""
        found = []
        for array in self._collector.all():
            report = {s.name.partition(": ")[2]: (s.level, s.message, {v.key: v.value for v in s.values})
                      for s in array.status if s.name.startswith(self._node + ": ")}
            if report:
                found.append(report)
        return found

    def values(self):
        """Values of the newest report, of both statuses together."""
        reports = self.reports()
        return {k: v for status in reports[-1].values() for k, v in status[2].items()} if reports else {}

    def count(self, key):
        return int(self.values().get(key, 0))

    def dropped(self):
        return {key[len("dropped "):]: int(value) for key, value in self.values().items()
                if key.startswith("dropped ")}

    def next_report(self):
        """Values of a report that is begun after this call; the first to come may be older."""
        known = len(self.reports())
        wait_for(lambda: len(self.reports()) >= known + 2, "two more reports of /diagnostics")
        return self.values()


class Process:
    """A program under test, or one that feeds it."""

    def __init__(self, *command, environment=None):
        # Files, not pipes: nobody reads while the program runs, and it must not block.
        self._out, self._err = tempfile.TemporaryFile("w+"), tempfile.TemporaryFile("w+")
        self._process = subprocess.Popen([str(c) for c in command], stdout=self._out, stderr=self._err,
                                         env=environment)

    def running(self):
        return self._process.poll() is None

    def finish(self, timeout=PATIENCE_S):
        """Exit code, standard output and error of a program that ends by itself."""
        self._process.wait(timeout)
        texts = []
        for stream in (self._out, self._err):
            stream.seek(0)
            texts.append(stream.read())
        return (self._process.returncode, *texts)

    def kill(self):
        """As a power failure stops it."""
        self._process.kill()
        self._process.wait()

    def stop(self):
        """As roslaunch stops a node: SIGINT. Returns the exit code."""
        if self.running():
            self._process.send_signal(signal.SIGINT)
        try:
            return self.finish()[0]
        finally:
            if self.running():
                self._process.kill()


_numbers = itertools.count(1)


class Node(Process):
    """An estimator's node with its parameters on the server, and its topics resolved below /name.

    Each gets a name of its own: nothing that is left of a node before can be taken for it.
    """

    def __init__(self, configuration, estimator="gp_localize", **parameters):
        self.name = name = f"{estimator}_{next(_numbers)}"
        values = yaml.safe_load(configuration)
        values.update(parameters)
        rospy.set_param("/" + name, values)
        super().__init__(workspace.program(estimator, f"{estimator}_node"), f"__name:={name}",
                         f"odom:=/{name}/odom", f"field:=/{name}/field", f"initialpose:=/{name}/initialpose",
                         f"global_localization:=/{name}/global_localization")

    def topic(self, name):
        return name if name.startswith("/") else f"/{self.name}/{name}"

    def service(self, name, service_type):
        """A call of the service, once it is there."""
        wait_for(lambda: not self.running() or self._has_service(name), f"service {name}")
        if not self.running():
            raise AssertionError(f"{self.name} died: {self.finish()}")
        return rospy.ServiceProxy(self.topic(name), service_type)

    def _has_service(self, name):
        try:
            rospy.wait_for_service(self.topic(name), timeout=0.2)
            return True
        except rospy.ROSException:
            return False

    def publisher(self, name, message_type):
        """A publisher that the node already listens to."""
        publisher = rospy.Publisher(self.topic(name), message_type, queue_size=0)
        wait_for(lambda: not self.running() or publisher.get_num_connections() > 0,
                 f"{self.name} to subscribe to {name}")
        if not self.running():
            raise AssertionError(f"{self.name} died: {self.finish()}")
        return publisher


def published_topics():
    """Type by topic, of all topics that somebody publishes."""
    return dict(rosgraph.Master("/field_system_tests").getPublishedTopics("/"))


def advertised_by(name):
    """Topics and services that the master has of a node."""
    publishers, _, services = rosgraph.Master("/field_system_tests").getSystemState()
    return [topic for topic, nodes in publishers + services if f"/{name}" in nodes]


def start_test_node(name):
    """This process as a ROS node; a master of its own comes from rostest."""
    rospy.init_node(name, disable_signals=True)
