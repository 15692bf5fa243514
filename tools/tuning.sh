#!/usr/bin/env bash
# What each parameter does to error and time: pictures and tables of docs/tuning.md. About 20 minutes; replays that are done stay
# in out/tuning and are not repeated. Usage: tools/tuning.sh [--seeds N] [--nodes NODE ...]
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to gp_localize vector_field_slam gmrf_slap field_bags field_config
use_workspace
$python tools/tuning.py --output "$root/out/tuning" --docs "$root/docs" "$@"
