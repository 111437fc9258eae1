#!/usr/bin/env bash
# One rank of a campaign: determines its shard of the cases, and judges that.
# Usage: fuzz_shard.sh RESULTS [OPTIONS of cutproof fuzz]
#        fuzz_shard.sh --program       prints the program that it would run
# Writes RESULTS/shard_I_of_N.json, shard_I_of_N.log and counterexamples; exits as `cutproof fuzz` does.
#
# The shard, by the first of these that is set (none of their libraries is needed):
#   CUTPROOF_SHARD                             I/N, to run a lost one again by hand
#   OMPI_COMM_WORLD_RANK, OMPI_COMM_WORLD_SIZE Open MPI's mpirun
#   PMI_RANK, PMI_SIZE                         MPICH's mpiexec, srun --mpi=pmi2
#   SLURM_ARRAY_TASK_ID, _COUNT, _MIN, _MAX    a job array
#   SLURM_PROCID, SLURM_NTASKS                 srun
# CUTPROOF_SHARDS: N, where an array is only the lost part of a campaign: --array=3,7-12 with CUTPROOF_SHARDS=64 runs
# shards 3 and 7 to 12 of 64.
# CUTPROOF: the program (default: of this build or installation, else the one in PATH).
# CUTPROOF_THREADS: of this rank (default: its share of the machine).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
refuse() { echo "fuzz_shard.sh: $1" >&2; exit 2; }
number() { [[ $2 =~ ^[0-9]{1,9}$ ]] || refuse "$1 is '$2', which is no number"; }

program=${CUTPROOF:-}
# Beside this file in the sources and their build, or in an installation.
for beside in "$here/../../build/default/cli/cutproof" "$here/../../../bin/cutproof"; do
  if [ -z "$program" ] && [ -x "$beside" ]; then program=$beside; fi
done
[ -n "$program" ] || program=$(command -v cutproof) || refuse "there is no program cutproof: set CUTPROOF"
if [ "$*" = --program ]; then
  echo "$program"
  exit 0
fi

[ $# -ge 1 ] && [[ $1 != -* ]] || refuse "the folder for results is missing: fuzz_shard.sh RESULTS [OPTIONS]"
results=$1
shift
for option in "$@"; do
  case $option in
    --shard* | --json* | --save* | --merge* | --threads*) refuse "$option is this script's to give" ;;
  esac
done

if [ -n "${CUTPROOF_SHARD:-}" ]; then
  [[ $CUTPROOF_SHARD =~ ^([0-9]{1,9})/([0-9]{1,9})$ ]] || refuse "CUTPROOF_SHARD is '$CUTPROOF_SHARD', and not I/N"
  shard=${BASH_REMATCH[1]} shards=${BASH_REMATCH[2]}
elif [ -n "${OMPI_COMM_WORLD_RANK:-}" ]; then
  number OMPI_COMM_WORLD_RANK "$OMPI_COMM_WORLD_RANK"
  number OMPI_COMM_WORLD_SIZE "${OMPI_COMM_WORLD_SIZE:-}"
  shard=$((10#$OMPI_COMM_WORLD_RANK + 1)) shards=$OMPI_COMM_WORLD_SIZE
elif [ -n "${PMI_RANK:-}" ]; then
  number PMI_RANK "$PMI_RANK"
  number PMI_SIZE "${PMI_SIZE:-}"
  shard=$((10#$PMI_RANK + 1)) shards=$PMI_SIZE
elif [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
  # Several tasks of one element would all run the same shard.
  [ "${SLURM_PROCID:-0}" = 0 ] || refuse "an element of a job array is one shard: leave --ntasks out"
  number SLURM_ARRAY_TASK_ID "$SLURM_ARRAY_TASK_ID"
  if [ -n "${CUTPROOF_SHARDS:-}" ]; then
    number CUTPROOF_SHARDS "$CUTPROOF_SHARDS"
    shard=$SLURM_ARRAY_TASK_ID shards=$CUTPROOF_SHARDS
  else
    for name in COUNT MIN MAX; do
      variable=SLURM_ARRAY_TASK_$name
      number "$variable" "${!variable:-}"
    done
    [ $((SLURM_ARRAY_TASK_MAX - SLURM_ARRAY_TASK_MIN + 1)) = "$SLURM_ARRAY_TASK_COUNT" ] ||
      refuse "the job array has holes: set CUTPROOF_SHARDS to the number of shards of the whole campaign"
    shard=$((SLURM_ARRAY_TASK_ID - SLURM_ARRAY_TASK_MIN + 1)) shards=$SLURM_ARRAY_TASK_COUNT
  fi
elif [ -n "${SLURM_PROCID:-}" ]; then
  number SLURM_PROCID "$SLURM_PROCID"
  number SLURM_NTASKS "${SLURM_NTASKS:-}"
  shard=$((10#$SLURM_PROCID + 1)) shards=$SLURM_NTASKS
else
  refuse "nothing says which shard this is: set CUTPROOF_SHARD=I/N, or start it with mpirun, srun or as a job array"
fi

# Ranks of one machine share it; nproc knows a rank's cores.
threads=${CUTPROOF_THREADS:-}
if [ -z "$threads" ]; then
  here_as_well=${OMPI_COMM_WORLD_LOCAL_SIZE:-${MPI_LOCALNRANKS:-1}}
  threads=${SLURM_CPUS_PER_TASK:-$(($(nproc) / here_as_well))}
  [ "$threads" -ge 1 ] || threads=1
fi

mkdir -p "$results"
name=$results/shard_${shard}_of_${shards}
# An earlier run's result must not replace this one's if it is lost.
rm -f "$name.json"
status=0
"$program" fuzz "$@" --shard "$shard/$shards" --threads "$threads" --save "$results" --json "$name.json" \
  > "$name.log" 2>&1 || status=$?
echo "shard $shard of $shards: exit status $status, $(tail -1 "$name.log")"
exit "$status"
