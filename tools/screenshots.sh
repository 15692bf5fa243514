#!/usr/bin/env bash
# rviz over bundled bags, without a screen (Xvfb, software GL): the pictures rviz_*.png of docs/images/.
# Usage: tools/screenshots.sh [names such as gp_localize compare]
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to field_launch
use_workspace
PYTHONPATH="$root/test/tests:${PYTHONPATH:-}" $python tools/screenshots.py --output "$root/docs/images" "$@"
