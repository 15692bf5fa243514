#!/usr/bin/python3
"""field_core and the gp_localize library build, install and are used with plain CMake, without catkin."""
import os
import subprocess

from support import workspace
from support.programs import ProgramTest
from support.runner import main

TIMEOUT_S = 900

CONSUMER_CMAKE = """cmake_minimum_required(VERSION 3.16)
project(consumer LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 17)
find_package(Eigen3 REQUIRED)
find_package(field_core REQUIRED)
find_package(gp_localize REQUIRED)
add_executable(consumer main.cpp)
target_include_directories(consumer PRIVATE ${field_core_INCLUDE_DIRS} ${gp_localize_INCLUDE_DIRS})
target_link_libraries(consumer ${gp_localize_LIBRARIES} ${field_core_LIBRARIES} Eigen3::Eigen)
"""

# The least a user without ROS would do: build an estimator, move it, give it a reading.
CONSUMER_MAIN = """#include <iostream>
#include "gp_localize/gp_localize.hpp"
int main() {
  gp_localize::GpLocalizeParams params;
  params.fields["light"];
  params.particles = 20;
  params.sample_paths = 20;
  params.support.size = 9;
  gp_localize::GpLocalize estimator(params, 1);
  std::cout << estimator.belief().particles.size() << std::endl;
}
"""


class PlainCMake(ProgramTest):
    def setUp(self):
        super().setUp()
        # Nothing of a sourced workspace may help.
        hidden = ("CMAKE_PREFIX_PATH", "ROS_PACKAGE_PATH", "LD_LIBRARY_PATH", "PKG_CONFIG_PATH", "CPATH")
        self.environment = {k: v for k, v in os.environ.items() if k not in hidden}
        self.prefix = self.folder / "install"

    def cmake(self, *arguments):
        done = subprocess.run(["cmake"] + [str(a) for a in arguments], env=self.environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=TIMEOUT_S, check=False)
        self.assertEqual(done.returncode, 0, done.stdout[-4000:])
        return done.stdout

    def build(self, source, *targets):
        build = self.folder / f"build_{source.name}"
        self.cmake("-S", source, "-B", build, "-DCMAKE_DISABLE_FIND_PACKAGE_catkin=ON", "-DBUILD_TESTING=OFF",
                   "-DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_benchmark=ON",
                   "-DCMAKE_BUILD_TYPE=None", "-DCMAKE_UNITY_BUILD=ON",  # both for speed
                   f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DCMAKE_INSTALL_PREFIX={self.prefix}")
        self.cmake("--build", build, *targets)  # on one core: tests run side by side
        return build

    def test_build_install_use(self):
        for package in ("field_core", "gp_localize"):
            self.build(workspace.source_root() / package, "--target", "install")
        for program in ("gp_localize_node", "gp_localize_replay"):
            self.assertEqual(list(self.prefix.rglob(program)), [], "needs ROS and must not be built here")
        consumer = self.folder / "consumer"
        consumer.mkdir()
        (consumer / "CMakeLists.txt").write_text(CONSUMER_CMAKE)
        (consumer / "main.cpp").write_text(CONSUMER_MAIN)
        program = self.build(consumer) / "consumer"
        done = subprocess.run([program], env=self.environment, stdout=subprocess.PIPE, text=True, check=True)
        self.assertEqual(done.stdout.strip(), "20")
        linked = subprocess.run(["ldd", program], stdout=subprocess.PIPE, text=True, check=True).stdout
        self.assertIn("libgp_localize", linked)
        self.assertNotRegex(linked, r"libros|librosbag|libtf2|not found")


if __name__ == "__main__":
    main("plain_cmake")
