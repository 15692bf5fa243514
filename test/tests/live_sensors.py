#!/usr/bin/python3
"""Sensors as they come on a robot: sensor_msgs as fields, a WiFi scan, a magnetometer and its calibration."""
import numpy as np
import rosbag
import rospy
import yaml
from field_msgs.msg import FieldMeasurement
from field_msgs.srv import PredictField
from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
from sensor_msgs.msg import (FluidPressure, Illuminance, MagneticField, Range, RelativeHumidity, Temperature)

from support import messages, recordings
from support.live import Collector, Process, start_test_node, wait_for
from support.programs import ProgramTest, run
from support.robot import Robot
from support.runner import main
from support.workspace import program

# type: (message, its member, what it reads, prior mean of the field)
SENSORS = {
    "temperature": (Temperature, "temperature", 21.5, 15.0),
    "illuminance": (Illuminance, "illuminance", 320.0, 200.0),
    "relative_humidity": (RelativeHumidity, "relative_humidity", 0.45, 0.3),
    "fluid_pressure": (FluidPressure, "fluid_pressure", 101325.0, 100000.0),
    "range": (Range, "range", 2.0, 3.0),
}
EARTH_T = 48e-6
IRON = np.array([[1.2, 0.1, 0.05], [0.1, 0.9, -0.08], [0.05, -0.08, 1.0]])
OFFSET_T = np.array([12e-6, -30e-6, 7e-6])

SCAN = """BSS 3c:37:86:00:00:01(on wlan0)
\tfreq: 2437
\tsignal: -47.00 dBm
\tSSID: hall
BSS 3c:37:86:00:00:02(on wlan0)
\tsignal: -71.50 dBm
"""


def field(mean, spread):
    return {"mean": mean, "signal_stddev": spread, "noise_stddev": spread / 50.0, "length_scales": [1.5, 1.5]}


def raw_reading(direction):
    """What a magnetometer with this iron reads in a field of EARTH_T."""
    return np.linalg.solve(IRON, EARTH_T * direction / np.linalg.norm(direction)) + OFFSET_T


def magnetic(stamp, reading):
    message = MagneticField()
    message.header.stamp = rospy.Time.from_sec(stamp)
    message.header.frame_id = "base_link"
    message.magnetic_field.x, message.magnetic_field.y, message.magnetic_field.z = reading
    return message


class SensorRobot(Robot):
    """On the circle; publishes the messages that `readings(time)` gives by topic."""

    def __init__(self, sensors, fields, readings, **parameters):
        super().__init__(recordings.tiny_config(fields=fields), sensors=sensors, **parameters)
        self._readings = readings
        self._sensors = {s["topic"]: self._publisher(s["topic"], message) for s, message in
                         zip(sensors.values(), (type(m) for m in readings(0.0)))}

    @staticmethod
    def _publisher(topic, message_type):
        publisher = rospy.Publisher(topic, message_type, queue_size=0)
        wait_for(lambda: publisher.get_num_connections() > 0, f"a subscriber of {topic}")
        return publisher

    def measure(self, time):
        for publisher, message in zip(self._sensors.values(), self._readings(time)):
            message.header.stamp = rospy.Time(0, round((self.start + time) * 1e9))
            message.header.frame_id = "base_link"
            publisher.publish(message)

    def learned(self, names, time):
        """Means at the place of a time of the drive."""
        x, y, _ = self.truth(time)
        answer = self.node.service("predict_field", PredictField)(names=names, points=[Point(x, y, 0.0)])
        assert answer.success, answer.message
        return np.array(answer.mean)


class Sensors(ProgramTest):
    def test_sensor_messages_are_fields_in_their_units(self):
        def readings(_):
            made = []
            for message_type, member, value, _ in SENSORS.values():
                message = message_type(**{member: value})
                if message_type is Range:
                    message.min_range, message.max_range = 0.1, 10.0
                made.append(message)
            return made
        robot = SensorRobot(
            {name: {"type": name, "topic": f"/robot/{name}", "field": f"the_{name}"} for name in SENSORS},
            {f"the_{name}": field(mean, abs(value - mean)) for name, (_, _, value, mean) in SENSORS.items()},
            readings, reorder_window=0.05)
        self.addCleanup(robot.node.stop)
        robot.drive(10.0)
        for name, (_, _, value, mean) in SENSORS.items():
            # 20 readings around the place with a noise of 2 % of the spread: well below a tenth of it remains.
            learned = robot.learned([f"the_{name}"], 6.0)[0]
            self.assertAlmostEqual(learned, value, delta=0.1 * abs(value - mean), msg=name)

    def test_a_magnetometer_from_its_calibration_to_the_map(self):
        random = np.random.default_rng(3)
        recording = self.folder / "turned.bag"
        with rosbag.Bag(str(recording), "w") as bag:
            for i in range(300):
                message = magnetic(1.0 + 0.1 * i, raw_reading(random.normal(size=3)))
                bag.write("/imu/mag", message, message.header.stamp)
        calibration = self.folder / "iron.yaml"
        self.must(run("field_ros", "calibrate_magnetometer", "--bag", recording, "--topic", "/imu/mag",
                      "--output", calibration))
        sensor = {"type": "magnetic_field", "topic": "/robot/mag", "field": "mag"}
        sensor.update(yaml.safe_load(calibration.read_text()))

        def turning(time):
            return np.array([np.cos(2 * time), np.sin(2 * time), 0.7])
        robot = SensorRobot({"imu": sensor}, {"mag_norm": field(40e-6, 10e-6)},
                            lambda time: [magnetic(time, raw_reading(turning(time)))])
        self.addCleanup(robot.node.stop)
        robot.drive(10.0)
        # No magnetometer tells the magnitude from the mean soft iron: the determinant is taken as 1.
        expected = EARTH_T / np.cbrt(np.linalg.det(IRON))
        spread = np.ptp([np.linalg.norm(raw_reading(turning(t))) for t in np.arange(0.0, 10.0, 0.5)])
        self.assertGreater(spread, 20e-6, "uncalibrated, it would have been no map at all")
        self.assertAlmostEqual(robot.learned(["mag_norm"], 6.0)[0], expected, delta=0.5e-6)

    def test_a_bag_without_turns_is_refused(self):
        recording = self.folder / "still.bag"
        with rosbag.Bag(str(recording), "w") as bag:
            for i in range(50):
                message = magnetic(1.0 + 0.1 * i, raw_reading(np.array([1.0, 0.0, 0.0])))
                bag.write("/imu/mag", message, message.header.stamp)
        self.assert_refused(run("field_ros", "calibrate_magnetometer", "--bag", recording, "--topic", "/imu/mag",
                                "--output", self.output), "iron of the magnetometer")

    def test_a_wifi_scan_reaches_the_node(self):
        scan = self.write("scan.txt", SCAN)
        robot = Robot(recordings.tiny_config(fields={"hall": field(-60.0, 10.0)}))
        self.addCleanup(robot.node.stop)
        seen = Collector(robot.node.topic("field"), FieldMeasurement)
        scanner = Process(program("field_ros", "wifi_scanner"), f"field:={robot.node.topic('field')}", "--file", scan,
                          "--period", "0.05", "--name", "3c:37:86:00:00:01=hall")
        self.addCleanup(scanner.stop)
        odometry = robot.node.publisher("odom", Odometry)

        def driven():
            now = rospy.get_time()
            odometry.publish(messages.odometry(now, 0.02 * now % 1000.0, 0.0))
            return len(robot.poses.all()) >= 5
        wait_for(driven, "five poses from scans")
        self.assertEqual(seen.last().names, ["ap_3c3786000002", "hall"])
        self.assertEqual(list(seen.last().values), [-71.5, -47.0])
        answer = robot.node.service("predict_field", PredictField)(names=["hall"], points=[Point(0.0, 0.0, 0.0)])
        self.assertTrue(answer.success, answer.message)
        self.assertAlmostEqual(answer.mean[0], -47.0, delta=1.0)


if __name__ == "__main__":
    start_test_node("live_sensors")
    main("live_sensors")
