#!/usr/bin/env bash
# Formatting and static analysis: clang-format, catkin_lint and clang-tidy (from Debian) over the suite.
# Usage: tools/check.sh [--tidy]
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
for tool in clang-format clang-tidy; do
  command -v $tool >/dev/null || { echo "check.sh: $tool is missing; apt-get install $tool" >&2; exit 2; }
done
mapfile -t files < <(git ls-files '*.cpp' '*.hpp')
status=0
clang-format --dry-run --Werror "${files[@]}" || status=1
if command -v catkin_lint >/dev/null; then
  # What field_core_build.cmake's macros install, catkin_lint cannot see; field_core builds without catkin.
  ignored=()
  for id in uninstalled_include_path external_interface_path missing_required uninstalled_script \
            unused_include_path uninstalled_target; do
    ignored+=(--ignore $id)
  done
  ROS_DISTRO=${ROS_DISTRO:-noetic} $python "$(command -v catkin_lint)" --quiet --strict "${ignored[@]}" . || status=1
fi
if [ "${1:-}" = --tidy ]; then
  build_workspace --cmake-force-configure
  for package in field_core field_ros gp_localize bags; do
    mapfile -t sources < <(git ls-files "$package/src/*.cpp")
    database=$build_dir/$([ $package = bags ] && echo field_bags || echo $package)
    clang-tidy --quiet -p "$database" "${sources[@]}" || status=1
  done
fi
exit $status
