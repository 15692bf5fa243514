# Sourced by the other scripts: where things are, and how the workspace is built.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
build_dir=${FIELD_BUILD_DIR:-$root/build}
install_dir=${FIELD_INSTALL_DIR:-$root/install}
log_dir=${FIELD_LOG_DIR:-$root/log}
export COLCON_LOG_LEVEL=${COLCON_LOG_LEVEL:-warning}
# Debian's ROS is built for Debian's python3; a pyenv may come first on PATH.
python=/usr/bin/python3

note() { printf '\n== %s\n' "$*"; }

colcon_() { colcon --log-base "$log_dir" "$@"; }

# Builds, with tests unless testing=OFF. Arguments go to colcon.
build_workspace() {
  note "building the workspace"
  CMAKE_BUILD_PARALLEL_LEVEL=$(nproc) MAKEFLAGS=${MAKEFLAGS:--j$(nproc)} colcon_ build \
    --base-paths "$root" --build-base "$build_dir" --install-base "$install_dir" --merge-install \
    --parallel-workers 2 --event-handlers console_stderr- "$@" \
    --cmake-args -DPYTHON_EXECUTABLE=$python -DCMAKE_BUILD_TYPE=Release \
    -DCATKIN_ENABLE_TESTING=${testing:-ON}
}

use_workspace() {
  set +u
  # shellcheck disable=SC1091
  source "$install_dir/setup.bash"
  set -u
}
