#!/usr/bin/env bash
# Every test under AddressSanitizer and UndefinedBehaviorSanitizer, then under ThreadSanitizer. Then the program twice:
# with each file compiled alone, which finds missing includes, and linked as a whole, where two definitions of one class
# are an error (odr).
# Usage: ci/sanitizers.sh [asan] [tsan] [odr]     default: all
set -euo pipefail
cd "$(dirname "$0")/.."
for preset in ${*:-asan tsan odr}; do
  echo "== $preset"
  if [ "$preset" = odr ]; then
    ci/install.sh
    cmake --preset odr >/dev/null
    cmake --build build/odr --target cutproof
  else
    CUTPROOF_WHOLE=1 CUTPROOF_PRESET=$preset ci/test.sh
  fi
done
