#!/usr/bin/env bash
# Every number and picture of docs/results.md: the bundled bags, and the published recordings if they
# are at hand. Usage: tools/results.sh [SEEDS]   (default 3; recordings in ../shared/data or FIELD_DATA_DIR)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
testing=OFF build_workspace
use_workspace
$python tools/results.py --seeds "${1:-3}" --data "${FIELD_DATA_DIR:-$root/../shared/data}" --output "$root/out/results"
