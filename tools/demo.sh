#!/usr/bin/env bash
# Installs what is missing, builds, replays the bundled bags and shows how well the robot was localized:
# one table, and pictures in out/demo/. Usage: tools/demo.sh
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to field_bags field_config gp_localize
use_workspace
note "replaying the bundled bags"
$python tools/demo.py --output "$root/out/demo"
