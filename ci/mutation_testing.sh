#!/usr/bin/env bash
# Mutation testing: applies mutants to a copy of the code and asks the gate to find each (ci/mutation_testing/run.py).
set -euo pipefail
cd "$(dirname "$0")/.."
ci/install.sh tests
exec python3 ci/mutation_testing/run.py "$@"
