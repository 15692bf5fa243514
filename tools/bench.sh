#!/usr/bin/env bash
# Google Benchmark of the estimators' steps: growth with particles, paths, support points, fields and
# length of the run. Usage: tools/bench.sh [ESTIMATOR] [benchmark flags, such as --benchmark_filter=step]
# ESTIMATOR: gp_localize (default), vector_field_slam or gmrf_slap.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
estimator=gp_localize
if [ $# -gt 0 ] && [ "${1#--}" = "$1" ]; then
  estimator=$1
  shift
fi
testing=OFF build_workspace --packages-up-to "$estimator"
use_workspace
rosrun "$estimator" "${estimator}_benchmark" "$@"
