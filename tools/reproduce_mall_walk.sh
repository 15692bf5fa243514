#!/usr/bin/env bash
# Walks with a phone in a shopping mall, each localized in the map of the others: docs/results/mall_walk.md and its picture.
# Replays that are done stay in out/reproduce_mall_walk and are not repeated.
# Usage: tools/reproduce_mall_walk.sh [--seeds N]   (default 3; recordings: ../shared/data/mall_walk or FIELD_DATA_DIR/mall_walk)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to gp_localize field_bags field_config
use_workspace
$python tools/reproduce_mall_walk.py --data "${FIELD_DATA_DIR:-$root/../shared/data}/mall_walk" \
  --output "$root/out/reproduce_mall_walk" --page "$root/docs/results/mall_walk.md" "$@"
