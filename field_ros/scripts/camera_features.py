#!/usr/bin/python3
"""A camera with a panoramic mirror as field sensors: features of the image that do not change when the robot turns.

The ring of the mirror is unwrapped to a panorama, which a turn of the robot only shifts sideways. Channels of
field_msgs/FieldMeasurement:
  fft<k>   log magnitude of the k-th horizontal frequency of the mean row, relative to the mean grey level
  hist<k>  share of pixels in the k-th of equal grey levels
Live:    rosrun field_ros camera_features.py image:=/camera/image_raw _ring:=[147.5,120.5,40,80]
A folder: camera_features.py --frames frames.csv --folder frames --ring 147.5 120.5 40 80 --output measurements.csv
         (frames.csv: columns time_s and jpg; the output is what csv_to_bag reads)
"""
import argparse
import csv
import pathlib
import sys

import numpy as np

COLUMNS, ROWS = 512, 40


def unwrap(image, ring):
    """Grey panorama (ROWS x COLUMNS) of the ring (centre x, centre y, inner radius, outer radius) [px], bilinear."""
    x, y, inner, outer = ring
    angle = 2.0 * np.pi * np.arange(COLUMNS) / COLUMNS
    radius = inner + (outer - inner) * (np.arange(ROWS) + 0.5) / ROWS
    u = x + radius[:, None] * np.cos(angle)
    v = y + radius[:, None] * np.sin(angle)
    i, j = np.floor(u).astype(int), np.floor(v).astype(int)
    if i.min() < 0 or j.min() < 0 or i.max() + 1 >= image.shape[1] or j.max() + 1 >= image.shape[0]:
        raise ValueError(f"the ring {ring} does not fit the image of {image.shape[1]} x {image.shape[0]} pixels")
    a, b = u - i, v - j
    return ((1 - a) * (1 - b) * image[j, i] + a * (1 - b) * image[j, i + 1]
            + (1 - a) * b * image[j + 1, i] + a * b * image[j + 1, i + 1])


def features(panorama, frequencies=16, bins=16):
    """Channels by name. A shift of the panorama along its columns changes none of them."""
    spectrum = np.abs(np.fft.rfft(panorama.mean(axis=0)))
    relative = np.log(np.maximum(spectrum[1:frequencies + 1], 1e-9) / max(spectrum[0], 1e-9))
    shares = np.histogram(panorama, bins=bins, range=(0.0, 256.0))[0] / panorama.size
    out = {f"fft{k + 1}": float(v) for k, v in enumerate(relative)}
    out.update({f"hist{k + 1}": float(v) for k, v in enumerate(shares)})
    return out


def grey(message):
    """sensor_msgs/Image as an array of grey levels. @raise ValueError for an encoding that is none of the usual"""
    channels = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}.get(message.encoding)
    if channels is None:
        raise ValueError(f"encoding '{message.encoding}' is not read; publish mono8, rgb8 or bgr8")
    rows = np.frombuffer(message.data, dtype=np.uint8).reshape(message.height, message.step)
    pixels = rows[:, :message.width * channels].reshape(message.height, message.width, channels)[:, :, :3].astype(float)
    if channels == 1:
        return pixels[:, :, 0]
    weights = np.array([0.299, 0.587, 0.114])
    return pixels @ (weights if message.encoding.startswith("rgb") else weights[::-1])


def run_folder(arguments):
    from PIL import Image
    folder = pathlib.Path(arguments.folder)
    lines, names = [], None
    with open(arguments.frames) as f:
        for row in csv.DictReader(f):
            image = np.asarray(Image.open(folder / pathlib.Path(row["jpg"]).name).convert("L"), dtype=float)
            values = features(unwrap(image, arguments.ring))
            names = names or list(values)
            lines.append(f"{row['time_s']}," + ",".join(f"{values[n]:.9g}" for n in names))
    if not lines:
        raise ValueError(f"{arguments.frames}: names no frame")
    pathlib.Path(arguments.output).write_text("stamp_s," + ",".join(names) + "\n" + "\n".join(lines) + "\n")


def run_node():
    import rospy
    from field_msgs.msg import FieldMeasurement
    from sensor_msgs.msg import Image
    rospy.init_node("camera_features")
    ring = rospy.get_param("~ring", None)
    if not (isinstance(ring, list) and len(ring) == 4):
        raise ValueError("~ring is not given; set [centre x, centre y, inner radius, outer radius] of the mirror in pixels")
    publisher = rospy.Publisher("field", FieldMeasurement, queue_size=10)

    def on_image(message):
        try:
            values = features(unwrap(grey(message), ring))
        except ValueError as error:
            rospy.logwarn_throttle(10.0, f"image dropped: {error}")
            return
        out = FieldMeasurement(header=message.header, names=list(values), values=list(values.values()))
        publisher.publish(out)

    rospy.Subscriber("image", Image, on_image, queue_size=5)
    rospy.spin()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--folder", help="images; without it the program is a node")
    parser.add_argument("--frames", help="CSV with columns time_s and jpg")
    parser.add_argument("--ring", type=float, nargs=4, metavar=("X", "Y", "INNER", "OUTER"), help="of the mirror [px]")
    parser.add_argument("--output", help="CSV for csv_to_bag")
    arguments = parser.parse_args([a for a in sys.argv[1:] if ":=" not in a])
    try:
        if not arguments.folder:
            run_node()
            return 0
        if not (arguments.frames and arguments.ring and arguments.output):
            parser.error("--folder needs --frames, --ring and --output")
        run_folder(arguments)
        return 0
    except (OSError, ValueError, KeyError) as error:
        print(f"camera_features: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
