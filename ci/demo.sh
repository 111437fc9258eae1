#!/usr/bin/env bash
# Dissects a kidney with every check on, and leaves a recording and a page. Installs the package in dist/
# (ci/package.sh); without one, installs missing packages and builds the program.
set -euo pipefail
cd "$(dirname "$0")/.."

package=$(find dist -name 'cutproof_*.deb' -print -quit 2>/dev/null || true)
if [ -n "$package" ]; then
  as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { echo "ci/demo.sh: installing $package needs root or sudo" >&2; exit 3; }
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get install -y -qq --reinstall -o APT::Sandbox::User=root "./$package" >/dev/null
  program=/usr/bin/cutproof
else
  ci/install.sh
  # A folder of its own, without parts that a demonstration does not run: tests, benchmarks, the GPU.
  cmake --preset demo >/dev/null
  cmake --build build/demo --target cutproof
  program=build/demo/cli/cutproof
fi
mkdir -p demo_output
"$program" run kidney_discontinuous --check \
  --record demo_output/kidney --json demo_output/kidney.json --report demo_output/kidney.html
echo
echo "demo_output/kidney.html shows what happened: open it in a browser."
echo "demo_output/ holds the recording, too: open kidney.skin.vtkhdf in ParaView (5.12 or later), or judge it again with"
echo "  $program check demo_output/kidney"
