#!/usr/bin/env bash
# Google Benchmark of the estimators' steps: growth with particles, paths, support points, fields and
# length of the run. Usage: tools/bench.sh [benchmark flags, such as --benchmark_filter=step]
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace --packages-up-to gp_localize
use_workspace
rosrun gp_localize gp_localize_benchmark "$@"
