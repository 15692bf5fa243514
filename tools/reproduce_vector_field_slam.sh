#!/usr/bin/env bash
# Simulated experiments of vector_field_slam: nine runs of rising multipath, and the IEC room. Writes
# out/vector_field_slam/*.csv and docs/results/vector_field_slam.md with its plot.
# Usage: tools/reproduce_vector_field_slam.sh [SEEDS]   (default 20; 1 is the quick mode)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to vector_field_slam
use_workspace
out=$root/out/vector_field_slam
mkdir -p "$out"
seeds=${1:-20}
nice rosrun vector_field_slam vector_field_slam_experiment --experiment nine --seeds "$seeds" >"$out/nine.csv"
nice rosrun vector_field_slam vector_field_slam_experiment --experiment iec \
  --seeds "$(((seeds + 9) / 10))" >"$out/iec.csv"
$python tools/reproduce_vector_field_slam.py --nine "$out/nine.csv" --iec "$out/iec.csv" --output docs/results
