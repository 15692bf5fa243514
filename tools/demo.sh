#!/usr/bin/env bash
# Installs what is missing, builds, replays the bundled bags and shows how well the robot was localized:
# one table, and pictures in out/demo/. Usage: tools/demo.sh [--all]
# gp_localize alone, or with --all every estimator on every bag that there is a configuration for.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
nodes=(gp_localize)
[ "${1:-}" = --all ] && nodes+=(vector_field_slam gmrf_slap)
testing=OFF build_workspace --packages-select field_msgs field_core field_ros field_bags field_config "${nodes[@]}"
use_workspace
note "replaying the bundled bags"
$python tools/demo.py --output "$root/out/demo" --nodes "${nodes[@]}"
