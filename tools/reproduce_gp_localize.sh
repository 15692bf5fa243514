#!/usr/bin/env bash
# The experiments of the GP-Localize paper and those on known maps, over many seeds: docs/results/gp_localize.md and its
# pictures; gp_localize_traffic.md for the road network. Replays that are done stay in out/reproduce_gp_localize and are not repeated.
# Usage: tools/reproduce_gp_localize.sh [--seeds N] [--only pioneer ieq wss traffic ...] [--done: only what is kept]   (recordings: ../shared/data or FIELD_DATA_DIR)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to gp_localize field_bags field_config
use_workspace
$python tools/reproduce_gp_localize.py --data "${FIELD_DATA_DIR:-$root/../shared/data}" \
  --output "$root/out/reproduce_gp_localize" --page "$root/docs/results/gp_localize.md" "$@"
