#!/usr/bin/python3
"""camera_features.py: what a turn of the robot does to its features, bad images and arguments, a folder of frames."""
import importlib.util
import math
import subprocess
import sys

import numpy as np
from PIL import Image as Picture
from sensor_msgs.msg import Image

from support import workspace
from support.programs import BAD_ARGUMENTS, ProgramTest
from support.runner import main

PROGRAM = workspace.source_root() / "field_ros" / "scripts" / "camera_features.py"
_spec = importlib.util.spec_from_file_location("camera_features", PROGRAM)
camera = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(camera)

RING = (80.0, 60.0, 20.0, 50.0)


def scene(turn=0.0):
    """A smooth ring image whose grey level depends on bearing and radius; turned by an angle [rad]."""
    y, x = np.mgrid[0:121, 0:161]
    angle, radius = np.arctan2(y - RING[1], x - RING[0]) - turn, np.hypot(x - RING[0], y - RING[1])
    return 128.0 + 50.0 * np.sin(3.0 * angle) + 30.0 * np.cos(5.0 * angle + 1.0) + 0.5 * radius


class CameraFeatures(ProgramTest):
    def test_a_shift_of_the_panorama_changes_nothing(self):
        panorama = camera.unwrap(scene(), RING)
        before, after = camera.features(panorama), camera.features(np.roll(panorama, 77, axis=1))
        self.assertEqual(len(before), 32)
        for name, value in before.items():
            self.assertAlmostEqual(value, after[name], delta=1e-6)

    def test_a_turn_of_the_robot_changes_next_to_nothing(self):
        before, after = (camera.features(camera.unwrap(scene(turn), RING)) for turn in (0.0, 1.0))
        # The two frequencies that the scene has, by their amplitudes; 50 and 30 of mean 128 + 0.5 * 35, halved by the FFT.
        for name, amplitude in (("fft3", 50.0), ("fft5", 30.0)):
            self.assertAlmostEqual(before[name], math.log(0.5 * amplitude / 145.5), delta=0.02)
            self.assertAlmostEqual(after[name], before[name], delta=0.01)
        self.assertLess(before["fft4"], before["fft3"] - 4.0)
        for k in range(1, 17):
            self.assertAlmostEqual(after[f"hist{k}"], before[f"hist{k}"], delta=0.01)
        self.assertAlmostEqual(sum(before[f"hist{k}"] for k in range(1, 17)), 1.0, delta=1e-9)

    def test_images_of_the_usual_encodings(self):
        grey = np.arange(24, dtype=np.uint8).reshape(4, 6)
        mono = Image(height=4, width=6, step=6, encoding="mono8", data=grey.tobytes())
        np.testing.assert_array_equal(camera.grey(mono), grey)
        blue = np.zeros((4, 6, 3), dtype=np.uint8)
        blue[:, :, 2] = 200
        for encoding, pixels in (("rgb8", blue), ("bgr8", blue[:, :, ::-1])):
            image = Image(height=4, width=6, step=18, encoding=encoding, data=pixels.tobytes())
            np.testing.assert_allclose(camera.grey(image), 0.114 * 200)
        with self.assertRaisesRegex(ValueError, "32FC1"):
            camera.grey(Image(height=1, width=1, step=4, encoding="32FC1", data=b"0000"))

    def program(self, *arguments):
        return subprocess.run([sys.executable, PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, timeout=60, check=False)

    def test_a_folder_of_frames(self):
        for k in range(3):
            Picture.fromarray(scene(0.2 * k).astype(np.uint8)).save(self.folder / f"{k}.png")
        frames = self.write("frames.csv", "time_s,jpg\n" + "".join(f"{k}.5,frames/{k}.png\n" for k in range(3)))
        output = self.folder / "measurements.csv"
        common = ("--folder", self.folder, "--frames", frames, "--output", output, "--ring")
        self.must(self.program(*common, *RING))
        lines = output.read_text().splitlines()
        self.assertEqual(len(lines), 4)
        self.assertTrue(lines[0].startswith("stamp_s,fft1,"))
        self.assertTrue(lines[3].startswith("2.5,"))
        done = self.program(*common, 80, 60, 20, 500)
        self.assert_refused(done, "does not fit the image of 161 x 121")
        self.assertEqual(self.program("--folder", self.folder).returncode, BAD_ARGUMENTS)


if __name__ == "__main__":
    main("camera_features")
