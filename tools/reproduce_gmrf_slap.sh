#!/usr/bin/env bash
# The paper's section III over many seeds, several robots, large grids and real fields: docs/results/gmrf_slap.md and its
# pictures. Runs that are done stay in out/reproduce_gmrf_slap and are not repeated.
# Usage: tools/reproduce_gmrf_slap.sh [--seeds N] [--only paper robots grids real] [--robots 2 5] [--sides 31 101 301]
# 20 seeds of two robots take ten minutes, of five robots and of 301 x 301 sites each more than twenty.
# Real fields: ../shared/data or FIELD_DATA_DIR
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to gmrf_slap
use_workspace
$python tools/reproduce_gmrf_slap.py --data "${FIELD_DATA_DIR:-$root/../shared/data}" \
  --output "$root/out/reproduce_gmrf_slap" --page "$root/docs/results/gmrf_slap.md" "$@"
