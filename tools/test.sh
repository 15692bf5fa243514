#!/usr/bin/env bash
# Installs what is missing, builds everything, runs every test. Ends with 'N passed, N failed, N skipped'.
# Usage: tools/test.sh [packages...]   (default: all)
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
tools/install_dependencies.sh
build_workspace

select=()
[ $# -gt 0 ] && select=(--packages-select "$@")
rm -rf "$build_dir"/*/{test_results,Testing}
use_workspace
note "running the tests"
status=0
export CTEST_PARALLEL_LEVEL=${CTEST_PARALLEL_LEVEL:-$(nproc)}
colcon_ test --base-paths "$root" --build-base "$build_dir" --install-base "$install_dir" \
  --merge-install --executor sequential --return-code-on-test-failure \
  --event-handlers console_direct+ "${select[@]}" || status=$?

note "summary"
colcon_ test-result --test-result-base "$build_dir" --verbose | tail -n 40 || true
$python tools/count_tests.py "$build_dir" || status=1
exit $status
