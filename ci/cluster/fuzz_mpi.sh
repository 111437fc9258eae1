#!/usr/bin/env bash
# A campaign over the ranks of mpirun (Open MPI), put together to one result at its end. Nothing here is linked with MPI.
# Usage: fuzz_mpi.sh RESULTS [OPTIONS of cutproof fuzz] [-- OPTIONS of mpirun]
#   ci/cluster/fuzz_mpi.sh found --cases 1000000 --seed 7 -- -n 64 --hostfile hosts
# RESULTS must be a folder that all machines share, without results of another campaign. Writes RESULTS/whole.json.
# Exit status: of the merge. A rank that is lost costs its shard: the merge names it and ends with 1. Once more, and
# merged again:
#   CUTPROOF_SHARD=3/64 ci/cluster/fuzz_shard.sh found --cases 1000000 --seed 7
#   cutproof fuzz --merge found/shard_*.json --json found/whole.json
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

# As a rank: mpirun ends all the others once one of its processes ends with another status than 0. So each of them ends
# well, and its result, or that there is none, says how it was.
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
# Results of an earlier campaign would stand for ranks that are lost.
if compgen -G "$results/shard_*.json" > /dev/null; then refuse "$results has results of shards already: give another folder"; fi
mkdir -p "$results"
CUTPROOF=$("$here/fuzz_shard.sh" --program)
export CUTPROOF

# Each rank takes its share of its machine by itself. A rank that is killed must not take the others along (recovery).
mpirun --bind-to none --enable-recovery "${of_mpirun[@]}" "${BASH_SOURCE[0]}" --rank "$results" "${options[@]}" ||
  echo "fuzz_mpi.sh: mpirun ended with status $?; what its ranks have finished is put together" >&2
compgen -G "$results/shard_*.json" > /dev/null || { echo "fuzz_mpi.sh: no rank has left a result" >&2; exit 3; }
exec "$CUTPROOF" fuzz --merge "$results"/shard_*.json --json "$results/whole.json"
