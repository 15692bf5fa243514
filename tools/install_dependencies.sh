#!/usr/bin/env bash
# Installs from Debian what building, testing and showing the suite needs; does nothing if all is there.
set -euo pipefail
packages=(
  build-essential cmake git catkin
  # colcon's parts by name: Debian's metapackage only recommends them.
  colcon python3-colcon-bash python3-colcon-cmake python3-colcon-library-path python3-colcon-output
  python3-colcon-package-selection python3-colcon-parallel-executor python3-colcon-recursive-crawl
  python3-colcon-ros python3-colcon-test-result
  ros-desktop-dev ros-robot-dev rosbash librostest-dev python3-rostest python3-catkin-pkg
  libeigen3-dev libsuitesparse-dev libcli11-dev libyaml-cpp-dev libfmt-dev libceres-dev
  libgtest-dev libbenchmark-dev
  librviz-dev rviz libogre-1.12-dev qtbase5-dev pluginlib-dev libdynamic-reconfigure-config-init-mutex-dev
  xvfb libgl1-mesa-dri python3-pil
  # The information filter on a microcontroller, in tests.
  gcc-arm-none-eabi libstdc++-arm-none-eabi-newlib qemu-system-arm
  python3-diagnostic-msgs python3-dynamic-reconfigure python3-nav-msgs python3-std-srvs python3-visualization-msgs
  python3-numpy python3-matplotlib python3-yaml python3-tf
)
missing=()
for package in "${packages[@]}"; do
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0
echo "installing: ${missing[*]}"
as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "install_dependencies.sh: not root and no sudo; as root run: apt-get install ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi
log=$(mktemp)
if ! { "${as_root[@]}" apt-get update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
       apt-get install -y --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
  tail -n 20 "$log" >&2
  echo "install_dependencies.sh: apt-get failed; the whole output is in $log" >&2
  exit 1
fi
rm -f "$log"
