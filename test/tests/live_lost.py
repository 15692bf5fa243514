#!/usr/bin/python3
"""Lost and found: the kidnapped robot, the verdict in /diagnostics, automatic recovery."""
import unittest

from support import recordings
from support.kidnapped import LostAndFound
from support.live import start_test_node
from support.runner import main


class GpLocalize(LostAndFound, unittest.TestCase):
    estimator = "gp_localize"
    # Enough particles to be found again among all poses of 10 m x 10 m, and gp_localize's own verdict (it takes
    # precedence over the node's) from three seconds. Its own recovery is off: the node's is tested.
    configuration = recordings.tiny_config(particles=1500, mode="localization", support={"size": 49},
                                           fields={"sound": {"mean": 40.0, "signal_stddev": 3.0, "noise_stddev": 0.3,
                                                             "length_scales": [1.5, 1.5]}},
                                           lost={"nis": 3.0, "window": 6, "recovery_share": 0.0})

    @classmethod
    def survey_parameters(cls):
        """Both fields everywhere in the region. Where nothing is known, nothing contradicts a pose."""
        file = cls.folder / "survey.csv"
        places = [(x / 2.0, y / 2.0) for x in range(-10, 11) for y in range(-10, 11)]
        file.write_text("x_m,y_m,light,sound\n" + "".join(
            f"{x},{y},{recordings.light_at(x, y)},{recordings.sound_at(x, y)}\n" for x, y in places))
        return {"survey": str(file)}


if __name__ == "__main__":
    start_test_node("live_lost")
    main("live_lost")
