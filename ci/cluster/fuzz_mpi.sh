#!/usr/bin/env bash
# A campaign over the ranks of mpirun (Open MPI), merged into one result. Nothing here is linked with MPI.
# Usage: fuzz_mpi.sh RESULTS [OPTIONS of cutproof fuzz] [-- OPTIONS of mpirun]
#   ci/cluster/fuzz_mpi.sh found --cases 1000000 --seed 7 -- -n 64 --hostfile hosts
# RESULTS must be a folder that all machines share, without results of another campaign. Writes RESULTS/whole.json.
# Exit status: that of the merge. Without a lost rank's shard the merge names it and ends with 1. Run it again and
# merge:
#   CUTPROOF_SHARD=3/64 ci/cluster/fuzz_shard.sh found --cases 1000000 --seed 7
#   cutproof fuzz --merge found/shard_*.json --json found/whole.json
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

# As a rank: mpirun ends all ranks when one ends with a status other than 0. So each rank ends with 0; its result,
# present or missing, shows its outcome.
if [ "${1:-}" = --rank ]; then
  shift
  "$here/fuzz_shard.sh" "$@" || true
  exit 0
fi

refuse() { echo "fuzz_mpi.sh: $1" >&2; exit 2; }
[ $# -ge 1 ] && [[ $1 != -* ]] || refuse "the folder for results is missing: fuzz_mpi.sh RESULTS [OPTIONS] [-- OPTIONS of mpirun]"
results=$1
shift
options=() of_mpirun=()
while [ $# -gt 0 ]; do
  if [ "$1" = -- ]; then
    shift
    of_mpirun=("$@")
    break
  fi
  options+=("$1")
  shift
done
command -v mpirun > /dev/null || refuse "there is no mpirun: install openmpi-bin, or use a job array (fuzz.slurm)"
# An earlier campaign's results would replace those of lost ranks.
if compgen -G "$results/shard_*.json" > /dev/null; then refuse "$results has results of shards already: give another folder"; fi
mkdir -p "$results"
CUTPROOF=$("$here/fuzz_shard.sh" --program)
export CUTPROOF

# Each rank takes its share of its machine itself. A killed rank must not end the others (recovery).
mpirun --bind-to none --enable-recovery "${of_mpirun[@]}" "${BASH_SOURCE[0]}" --rank "$results" "${options[@]}" ||
  echo "fuzz_mpi.sh: mpirun ended with status $?; what its ranks have finished is put together" >&2
compgen -G "$results/shard_*.json" > /dev/null || { echo "fuzz_mpi.sh: no rank has left a result" >&2; exit 3; }
exec "$CUTPROOF" fuzz --merge "$results"/shard_*.json --json "$results/whole.json"
