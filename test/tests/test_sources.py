#!/usr/bin/python3
"""The estimator libraries know nothing of ROS and nothing of each other; the repository keeps its rules."""
import re
import unittest
import xml.etree.ElementTree as ElementTree

from support import workspace
from support.runner import main

ESTIMATORS = ("gp_localize", "vector_field_slam", "gmrf_slap")
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^">]+)[">]', re.MULTILINE)
# What a library without ROS may include, beside the standard library's plain names and C headers.
ALLOWED_FOLDERS = {"Eigen", "ceres", "field_core", "suitesparse", "sys"}
MAINS = ("_node.cpp", "_replay.cpp")


def library_sources(package):
    """Headers and sources of a package's library: all but its mains."""
    root = workspace.source_root() / package
    for folder in ("include", "src"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in (".hpp", ".h", ".cpp", ".cc") and not path.name.endswith(MAINS):
                yield path


def foreign_includes(package, text):
    """Includes that a library of this package must not have."""
    for header in INCLUDE.findall(text):
        folder, slash, _ = header.partition("/")
        own = not slash and header.endswith(".hpp")
        standard = not slash and ("." not in header or header in ("cholmod.h", "fcntl.h", "unistd.h", "immintrin.h"))
        if not (own or standard or folder in ALLOWED_FOLDERS | {package}):
            yield header


class Sources(unittest.TestCase):
    def packages(self):
        """The packages that are there; the suite grows one estimator at a time."""
        return [p for p in ("field_core",) + ESTIMATORS if (workspace.source_root() / p).is_dir()]

    def test_the_check_itself(self):
        good = '#include <vector>\n#include <Eigen/Core>\n#include "field_core/se2.hpp"\n#include "map.hpp"\n'
        self.assertEqual(list(foreign_includes("gp_localize", good)), [])
        for header in ("ros/ros.h", "nav_msgs/Odometry.h", "field_ros/node.hpp", "tf2/utils.h", "rosbag/bag.h",
                       "field_msgs/FieldMap.h", "gmrf_slap/params.hpp", "ros.h"):
            self.assertEqual(list(foreign_includes("gp_localize", good + f"#  include <{header}>\n")), [header])

    def test_libraries_include_no_ros_and_no_other_estimator(self):
        for package in self.packages():
            sources = list(library_sources(package))
            self.assertGreater(len(sources), 10, f"the sources of {package} were not found")
            for path in sources:
                with self.subTest(path.name):
                    self.assertEqual(list(foreign_includes(package, path.read_text())), [])

    def test_the_demo_builds_all_that_it_needs(self):
        """From nothing: colcon refuses a selection that leaves out what one of its packages depends on."""
        root = workspace.source_root()
        packages = {ElementTree.parse(file).findtext("name"): file for file in root.glob("*/package.xml")}
        selected = set(re.search(r"--packages-select (.*)", (root / "tools" / "demo.sh").read_text()).group(1).split())
        selected = (selected & set(packages)) | {"gp_localize"}
        self.assertGreater(len(selected), 5)
        for package in selected:
            depends = {e.text for e in ElementTree.parse(packages[package]).getroot() if e.tag.endswith("depend")}
            self.assertLessEqual(depends & set(packages), selected, package)

    def test_mains_are_short(self):
        for package in self.packages():
            for path in (workspace.source_root() / package / "src").glob("*"):
                if path.name.endswith(MAINS):
                    self.assertLessEqual(len(path.read_text().splitlines()), 20, path)


if __name__ == "__main__":
    main("sources")
