#!/usr/bin/env bash
# Every test, including those of which ci/test.sh runs a share (ci/long_tests.py).
set -euo pipefail
cd "$(dirname "$0")/.."
CUTPROOF_WHOLE=1 exec ci/test.sh
