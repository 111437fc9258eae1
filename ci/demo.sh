#!/usr/bin/env bash
# Installs what is missing, builds the program, dissects a kidney with every check on, and leaves a recording.
set -euo pipefail
cd "$(dirname "$0")/.."

ci/install.sh
# A folder of its own, without what a demonstration does not run: tests, benchmarks, the GPU.
cmake --preset demo >/dev/null
cmake --build build/demo --target cutproof
mkdir -p demo_output
build/demo/cli/cutproof run fixtures/scenes/kidney_discontinuous.json --check \
  --record demo_output/kidney --json demo_output/kidney.json --report demo_output/kidney.html
echo
echo "demo_output/kidney.html shows what happened: open it in a browser."
echo "demo_output/ holds the recording, too: open kidney.skin.vtkhdf in ParaView (5.12 or later), or judge it again with"
echo "  build/demo/cli/cutproof check demo_output/kidney"
