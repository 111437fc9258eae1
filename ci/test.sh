#!/usr/bin/env bash
# Installs what is missing, builds, runs every test. The last line is "N passed, N failed, N skipped".
# CUTPROOF_MESHES: a folder with outside meshes; tests on them say so when it is unset.
# CUTPROOF_PRESET: another preset of CMakePresets.json (debug, asan, tsan).
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${CUTPROOF_PRESET:-default}

ci/install.sh tests browser
werror=()
[ "${CI:-}" = true ] && werror=(-DCUTPROOF_WERROR=ON)
cmake --preset "$preset" -DBUILD_TESTING=ON "${werror[@]}" >/dev/null
build=build/$preset
cmake --build "$build"

# Tests see no other programs than they would on a bare machine.
PATH=$(python3 ci/packages.py --path "$build/programs")
export PATH
report=$build/tests.xml
status=0
# One test more than there are cores: some wait for a browser or a clock.
ctest --test-dir "$build" --output-on-failure --no-tests=error -j "$(($(nproc) + 1))" --output-junit "$PWD/$report" || status=$?
[ -s "$report" ] || { echo "no test was run"; echo "0 passed, 1 failed, 0 skipped"; exit 1; }
exec python3 ci/count_tests.py "$report" "$status" "$("$build/cli/cutproof" info | grep -E "^ +gpu ")"
