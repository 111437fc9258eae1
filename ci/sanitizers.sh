#!/usr/bin/env bash
# Every test under AddressSanitizer and UndefinedBehaviorSanitizer, then the same under ThreadSanitizer.
set -euo pipefail
cd "$(dirname "$0")/.."
for preset in ${*:-asan tsan}; do
  echo "== $preset"
  CUTPROOF_PRESET=$preset ci/test.sh
done
