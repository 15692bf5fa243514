#!/usr/bin/env bash
# The experiments of vector_field_slam: nine simulated runs of rising multipath, the IEC room, halls of rising size, wheel odometry of real robots
# under simulated beacons, real radio ranges, real magnetic walks. Writes docs/results/vector_field_slam.md and its pictures.
# Results that are there stay in out/vector_field_slam and are not computed again.
# Usage: tools/reproduce_vector_field_slam.sh [SEEDS]   (default 20, half an hour; 1 is the quick mode)
# Recordings: ../shared/data or FIELD_DATA_DIR; what is not there is left out.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to vector_field_slam field_bags field_config
use_workspace
out=$root/out/vector_field_slam
seeds=${1:-20}
mkdir -p "$out"
# simulate EXPERIMENT SEEDS [SEEDS OF THE SLOW VARIANTS]
simulate() {
  [[ -s $out/$1.csv ]] && return
  note "$1"
  nice rosrun vector_field_slam vector_field_slam_experiment --experiment "$1" --seeds "$2" --corrected-seeds "${3:-3}" >"$out/$1.partial"
  mv "$out/$1.partial" "$out/$1.csv"
}
simulate nine "$seeds" "$seeds"
simulate iec "$seeds" 0
simulate hall "$seeds" 0
$python tools/reproduce_vector_field_slam.py --data "${FIELD_DATA_DIR:-$root/../shared/data}" --seeds "$seeds" \
  --work "$out" --output docs/results
