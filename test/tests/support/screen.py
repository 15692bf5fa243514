"""rviz without a screen: Xvfb, software GL, and the picture as an array."""
import os
import subprocess

import numpy as np
import yaml
from PIL import ImageGrab

from support import workspace
from support.live import Process, wait_for

SIZE = (1400, 900)
BACKGROUND = (38, 38, 42)
VIRIDIS = {"low": (68, 1, 84), "middle": (33, 145, 140), "high": (253, 231, 37)}
LEGEND = (slice(10, 246), slice(10, 142))  # rows, columns
FOCUS = (slice(415, 486), slice(665, 736))  # where rviz draws the centre of the view


class Screen:
    """A virtual screen, until stop()."""

    def __init__(self, size=SIZE):
        read, write = os.pipe()
        self._server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{size[0]}x{size[1]}x24", "-nolisten", "tcp"],
            pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        # Xvfb chooses a free display and writes its number once it is ready.
        with os.fdopen(read) as answer:
            number = answer.readline().strip()
        if not number:
            raise RuntimeError("Xvfb did not start")
        self.display = f":{number}"

    def rviz(self, config, *arguments):
        """rviz over the whole screen, without its panels."""
        # Each display its own settings: the user's are neither read nor changed.
        environment = dict(os.environ, DISPLAY=self.display, LIBGL_ALWAYS_SOFTWARE="1", QT_X11_NO_MITSHM="1",
                           XDG_RUNTIME_DIR=os.environ.get("XDG_RUNTIME_DIR", "/tmp"))
        return Process("rviz", "--fullscreen", "--disable-anti-aliasing", "-d", config, *arguments,
                       environment=environment)

    def grab(self):
        """rows x columns x (red, green, blue)."""
        return np.asarray(self.picture())

    def picture(self):
        return ImageGrab.grab(xdisplay=self.display).convert("RGB")

    def stop(self):
        self._server.terminate()
        self._server.wait()


def near(image, colour, tolerance=12):
    """Where pixels have a colour, up to anti-aliasing and blending."""
    return (np.abs(image.astype(int) - np.array(colour)).max(axis=2) <= tolerance)


def at_least(count, colour, tolerance=12):
    """Outside the legend."""
    def seen(image):
        found = near(image, colour, tolerance)
        found[LEGEND] = False
        return int(found.sum()) >= count
    return seen


def colourful(image):
    """The learned field is more than one colour: blue to yellow-green, blended with the dark ground."""
    inside = image[260:, 150:].astype(int)
    saturated = (inside.max(axis=2) - inside.min(axis=2)) > 40
    hues = {tuple(c) for c in (inside[saturated] // 32)[::97]}
    return saturated.sum() > 20000 and len(hues) > 12


def legend_has_the_colour_map(image):
    bar = image[LEGEND][:, 10:30]
    return all(near(bar, colour, 25).any() for colour in VIRIDIS.values())


# What every configuration shows beside its own layers.
FIELD = {"ground": at_least(1000, BACKGROUND), "field": colourful, "legend": legend_has_the_colour_map}


def drawn(count):
    """Something is drawn on the empty ground, legend and centre aside. Black: rviz has not drawn there yet."""
    def seen(image):
        found = ~near(image, BACKGROUND) & ~near(image, (0, 0, 0), 6)
        found[LEGEND] = found[FOCUS] = False
        return int(found.sum()) >= count
    return seen


def config(name):
    return workspace.package("field_config") / "rviz" / f"{name}.rviz"


def only(name, layer, folder):
    """The configuration with one of its displays alone; with none if layer is None."""
    values = yaml.safe_load(config(name).read_text())
    displays = values["Visualization Manager"]["Displays"]
    assert layer is None or layer in [d["Name"] for d in displays], layer
    for display in displays:
        display["Enabled"] = display["Value"] = display["Name"] == layer
    file = folder / f"{name}_{layer}.rviz"
    file.write_text(yaml.safe_dump(values, sort_keys=False))
    return file


def wait_for_pixels(screen, wanted, timeout=120.0):
    """The first picture in which wanted(image) is true for all; says which layer is missing."""
    last = {}

    def complete():
        image = screen.grab()
        last.update({name: layer(image) for name, layer in wanted.items()})
        return (image,) if all(last.values()) else None

    return wait_for(complete, lambda: f"the layers {[n for n, seen in last.items() if not seen]}", timeout)[0]


def see_alone(screen, name, layer, count, folder):
    """rviz with one display of a configuration, until it has drawn so many pixels."""
    rviz = screen.rviz(only(name, layer, folder))
    try:
        wait_for_pixels(screen, {f"{name}: {layer}": drawn(count), "ground": at_least(300000, BACKGROUND)})
    finally:
        rviz.stop()
