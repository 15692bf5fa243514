#!/usr/bin/python3
"""Records a drive with a known pose; ~finish turns it into a map and a configuration to localize with."""
import os
import pathlib
import re
import signal
import subprocess

import rosbag
import rospy
import yaml
from std_srvs.srv import Trigger, TriggerResponse
from tf.transformations import euler_from_quaternion

STOP_S = 20.0
# The pose is known: odometry is exact, and so is the start. The filter is then the plain field model.
KNOWN_POSE = {"odom_alpha1": 0.0, "odom_alpha2": 0.0, "odom_alpha3": 0.0, "odom_alpha4": 0.0,
              "initial_cov_xx": 0.0, "initial_cov_yy": 0.0, "initial_cov_aa": 0.0}
# To find the robot anywhere on a known map takes many particles at first, few once the pose is known.
LOCALIZATION = {"gp_localize": {"mode": "localization", "particles": 5000, "adaptive": {"min_particles": 300}}}


class SurveyError(Exception):
    """One line that says what is wrong and what to do."""


def run(*command):
    """Runs a program of the suite; its one line on standard error is the reason if it fails."""
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or ["no reason given"]
        raise SurveyError(f"{command[2]}: {lines[-1]}")
    return done.stdout


def first_pose(bag, topic):
    """x, y, yaw of the first odometry message, which fixes the frame of the map."""
    with rosbag.Bag(str(bag)) as recording:
        for _, message, _ in recording.read_messages([topic]):
            p, q = message.pose.pose.position, message.pose.pose.orientation
            return p.x, p.y, euler_from_quaternion((q.x, q.y, q.z, q.w))[2]
    raise SurveyError(f"{bag}: no message on {topic}; check odom_topic")


class Survey:
    def __init__(self):
        get = rospy.get_param
        self.site, self.node = get("~site", "site"), get("~node", "gp_localize")
        if not re.fullmatch(r"[A-Za-z0-9_-]+", self.site):
            raise SurveyError(f"site '{self.site}': use letters, digits, _ and - only")
        self.config = pathlib.Path(get("~config"))
        if not self.config.is_file():
            raise SurveyError(f"{self.config}: no such file; give config:=... to survey.launch")
        self.odom, self.field = (rospy.resolve_name(get(f"~{n}_topic")) for n in ("odom", "field"))
        self.learn = get("~learn", True)
        self.directory = pathlib.Path(get("~directory")).expanduser()
        self.directory.mkdir(parents=True, exist_ok=True)
        self.bag = self.directory / f"{self.site}.bag"
        values = yaml.safe_load(self.config.read_text())
        sensors = [rospy.resolve_name(s["topic"]) for s in values.get("sensors", {}).values()]
        self.recorder = subprocess.Popen(
            ["rosrun", "rosbag", "record", "--quiet", "-O", str(self.bag), self.odom, self.field, "/tf_static",
             *sensors, f"__name:={rospy.get_name()[1:].replace('/', '_')}_recorder"], start_new_session=True)

    def stop_recording(self):
        if self.recorder.poll() is None:
            os.killpg(self.recorder.pid, signal.SIGINT)
        try:
            self.recorder.wait(STOP_S)
        except subprocess.TimeoutExpired as error:
            os.killpg(self.recorder.pid, signal.SIGKILL)
            raise SurveyError(f"{self.bag}: rosbag record did not end") from error
        if not self.bag.exists():
            raise SurveyError(f"{self.bag}: nothing was recorded; check {self.odom} and {self.field}")

    def learned(self, values):
        """The configuration with the hyperparameters of this place."""
        if not self.learn or self.node != "gp_localize":
            return values
        file = self.directory / f"{self.site}.hyper.yaml"
        run("rosrun", "gp_localize", "learn_hyperparameters", "--bag", self.bag, "--truth-topic", self.odom,
            "--field-topic", self.field, "--output", file)
        for name, learned in yaml.safe_load(file.read_text())["fields"].items():
            if name in values["fields"]:
                values["fields"][name].update(learned)
        return values

    def process(self):
        """Configuration, state and maps from the bag; returns what to do next."""
        values = self.learned(yaml.safe_load(self.config.read_text()))
        x, y, yaw = first_pose(self.bag, self.odom)
        start = {"initial_pose_x": x, "initial_pose_y": y, "initial_pose_a": yaw}
        known = self.directory / f"{self.site}.survey.yaml"
        known.write_text("# The configuration of the survey: the pose is known.\n"
                         + yaml.safe_dump({**values, **KNOWN_POSE, **start}))
        states = pathlib.Path(values.get("state_directory", "~/.ros/field_states")).expanduser()
        states.mkdir(parents=True, exist_ok=True)
        run("rosrun", self.node, f"{self.node}_replay", "--bag", self.bag, "--config", known, "--odom-topic",
            self.odom, "--field-topic", self.field, "--output", self.directory / self.site, "--export-maps",
            "--save-state", states / f"{self.site}.bag")
        (self.directory / f"{self.site}.yaml").write_text(
            f"# {self.config} with the hyperparameters of {self.bag.name}\n"
            + yaml.safe_dump({**values, **LOCALIZATION.get(self.node, {})}))
        return (f"maps are in {self.directory / self.site}; next: roslaunch field_launch localize.launch "
                f"site:={self.site} node:={self.node}")

    def finish(self, _):
        try:
            self.stop_recording()
            text = self.process()
            rospy.Timer(rospy.Duration(0.5), lambda _: rospy.signal_shutdown("finished"), oneshot=True)
            return TriggerResponse(success=True, message=text)
        except (SurveyError, OSError, KeyError, yaml.YAMLError) as error:
            return TriggerResponse(success=False, message=str(error))


def main():
    rospy.init_node("survey")
    try:
        survey = Survey()
    except (SurveyError, KeyError, OSError) as error:
        rospy.logfatal("%s", error)
        return 1
    rospy.Service("~finish", Trigger, survey.finish)
    rospy.loginfo("recording %s; when the drive is over: rosservice call %s/finish", survey.bag, rospy.get_name())
    rospy.spin()
    if survey.recorder.poll() is None:
        survey.stop_recording()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
