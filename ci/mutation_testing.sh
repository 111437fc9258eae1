#!/usr/bin/env bash
# Mutation testing: applies mutants to a copy of the code and asks the gate to find each (ci/mutation_testing/run.py).
# Usage: ci/mutation_testing.sh [OPTION...]     options of run.py
# CUTPROOF_COPIES=N: N parts in parallel, each in a copy of the build; makes their table. Needs root.
set -euo pipefail
cd "$(dirname "$0")/.."
ci/install.sh tests
copies=${CUTPROOF_COPIES:-1}
[ "$copies" -gt 1 ] || exec python3 ci/mutation_testing/run.py "$@"
[ "$(id -u)" -eq 0 ] || { echo "ci/mutation_testing.sh: only root can run several copies: unset CUTPROOF_COPIES" >&2; exit 2; }

python3 ci/mutation_testing/run.py --prepare
work=build/mutation_testing
parts=()
for ((i = 1; i <= copies; ++i)); do
  parts+=("${work}_$i.json")
  rm -f "${work}_$i.json"
  # A build contains its own path, so each copy is mounted in place of the first for its own processes.
  unshare --mount bash -c 'rm -rf "$1_$2" && cp -a "$1" "$1_$2" && mount --bind "$1_$2" "$1" && exec python3 ci/mutation_testing/run.py "${@:3}"' \
    part "$work" "$i" --shard "$i/$copies" --jobs $(($(nproc) / copies + 1)) --json "${work}_$i.json" "$@" &
done
status=0
for ((i = 1; i <= copies; ++i)); do wait -n || status=$(($? > status ? $? : status)); done
rm -rf "${work}"_[0-9]*[0-9] "${work}"_[0-9]
[ "$status" -le 1 ] || { echo "ci/mutation_testing.sh: a part stopped at a mutant, named above; mend the mutant and run again" >&2; exit "$status"; }
[ $# -gt 0 ] && exit "$status"
exec python3 ci/mutation_testing/run.py --merge "${parts[@]}"
