#!/usr/bin/env bash
# Installs missing packages, builds, and runs every test, of the long ones a share that the commit chooses
# (ci/long_tests.py). The last line is "N passed, N failed, N skipped".
# CUTPROOF_WHOLE=1: all of the long ones, eight times as many random cases, kernels for every GPU,
# and API pages by Doxygen (ci/nightly.sh).
# CUTPROOF_MESHES: a folder with outside meshes; tests on them say so when it is unset.
# CUTPROOF_PRESET: another preset of CMakePresets.json (debug, asan, tsan).
set -euo pipefail
cd "$(dirname "$0")/.."
preset=${CUTPROOF_PRESET:-default}

docs=()
[ "${CUTPROOF_WHOLE:-}" != 1 ] || docs=(docs)
ci/install.sh tests browser "${docs[@]}"
werror=()
[ "${CI:-}" = true ] && werror=(-DCUTPROOF_WERROR=ON)
# What a compiler writes of dependencies tells ccache what a file includes, without preprocessing it once more.
export CCACHE_DEPEND=1
# Without a GPU kernels are compiled for one architecture only, as fast as possible.
kernels=(-UCMAKE_CUDA_ARCHITECTURES)
if [ "${CUTPROOF_WHOLE:-}" != 1 ]; then
  export CUTPROOF_CASES=${CUTPROOF_CASES:-200}
  if [ ! -e /dev/nvidiactl ]; then
    kernels=(-DCMAKE_CUDA_ARCHITECTURES=90a-real)
    ! nvcc --help 2>/dev/null | grep -q -- --Ofast-compile || kernels+=("-DCMAKE_CUDA_FLAGS=--Ofast-compile=max")
  fi
fi
cmake --preset "$preset" --no-warn-unused-cli -DBUILD_TESTING=ON "${werror[@]}" "${kernels[@]}" >/dev/null
build=build/$preset
cmake --build "$build"

# Tests see no other programs than they would on a bare machine.
PATH=$(python3 ci/packages.py --path "$build/programs")
export PATH
report=$build/tests.xml
status=0
long="LONG TESTS: all"
left_out=()
if [ "${CUTPROOF_WHOLE:-}" != 1 ]; then
  share=$(python3 ci/long_tests.py "$build")
  left_out=(-E "${share%%$'\n'*}")
  long=${share#*$'\n'}
fi
# On GitHub, provoked messages of tests are not findings about this project.
unset GITHUB_ACTIONS GITHUB_STEP_SUMMARY
# One test more than cores: some wait for a browser or a clock.
ctest --test-dir "$build" --output-on-failure --no-tests=error "${left_out[@]}" -j "$(($(nproc) + 1))" --output-junit "$PWD/$report" || status=$?
[ -s "$report" ] || { echo "no test was run"; echo "0 passed, 1 failed, 0 skipped"; exit 1; }
echo "$long"
echo "RANDOM CASES: ${CUTPROOF_CASES:-2000} a property (ci/nightly.sh draws 2000, of which every class has to occur)"
exec python3 ci/count_tests.py "$report" "$status" "$("$build/cli/cutproof" info | grep -E "^ +gpu ")"
