#!/usr/bin/python3
"""gmrf_slap lost and found on a loaded map: the kidnapped robot, the verdict, global localization, recovery."""
import unittest

import yaml

from support.kidnapped import LostAndFound
from support.live import start_test_node
from support.runner import main


class GmrfSlap(LostAndFound, unittest.TestCase):
    estimator = "gmrf_slap"
    survey_s = 40.0  # two laps
    # Not for long: a robot that maps learns the fields anew where it believes to be, and no longer looks lost.
    verdict_s, global_s = 2.0, 4.0
    configuration = yaml.safe_dump({
        "fields": {
            "light": {"mean": 5.0, "measurement_stddev": 0.2, "hyperparameters": [{"bandwidth": 2.0, "stddev": 2.0}]},
            "sound": {"mean": 40.0, "measurement_stddev": 0.3, "hyperparameters": [{"bandwidth": 2.0, "stddev": 3.0}]}},
        "grid": {"origin": [-5.0, -3.0], "spacing": 0.5, "size": [21, 21]},
        "particles": 1500, "lag": 10, "likelihood_noise_scale": 2.0,
        "odom_alpha1": 0.01, "odom_alpha2": 0.01, "odom_alpha3": 0.01, "odom_alpha4": 0.01,
        "initial_cov_xx": 0.01, "initial_cov_yy": 0.01, "initial_cov_aa": 0.001, "lost_window": 6})


if __name__ == "__main__":
    start_test_node("live_lost_gmrf_slap")
    main("live_lost_gmrf_slap")
