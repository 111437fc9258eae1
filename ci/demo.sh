#!/usr/bin/env bash
# Installs what is missing, builds the program, dissects a kidney with every check on, and leaves a recording.
set -euo pipefail
cd "$(dirname "$0")/.."

ci/install.sh
cmake --preset default -DBUILD_TESTING=OFF >/dev/null
cmake --build build/default --target cutproof
mkdir -p demo_output
build/default/cli/cutproof run fixtures/scenes/kidney_discontinuous.json --check \
  --record demo_output/kidney --json demo_output/kidney.json
echo
echo "demo_output/ holds the recording: open kidney.skin.vtkhdf in ParaView (5.12 or later), or judge it again with"
echo "  build/default/cli/cutproof check demo_output/kidney"
