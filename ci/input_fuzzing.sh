#!/usr/bin/env bash
# Feeds arbitrary bytes to every reader of files: libFuzzer with ASan and UBSan, one target at a time. The last lines
# are a table; the exit status is 1 if anything was found. Next steps: docs/design/architecture.md, Input fuzzing.
# Usage: ci/input_fuzzing.sh [SECONDS_PER_TARGET] [TARGET...]     default: 600, all targets
# CUTPROOF_FUZZING_SEED: libFuzzer's seed (default 1). build/fuzzing/corpus keeps the corpus for later runs; remove it
# to begin anew.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-600}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || { echo "ci/input_fuzzing.sh: \"$seconds\" is not a number of seconds" >&2; exit 2; }
shift $(($# > 0))
all=(scene stl obj ply off recording recording_contents arrays counterexample campaign results question run)
targets=("$@")
[ $# -gt 0 ] || targets=("${all[@]}")
for target in "${targets[@]}"; do
  [[ " ${all[*]} " == *" $target "* ]] || { echo "ci/input_fuzzing.sh: there is no target \"$target\"; there are: ${all[*]}" >&2; exit 2; }
done
seed=${CUTPROOF_FUZZING_SEED:-1}

ci/install.sh tests fuzzing
cmake --preset fuzzing >/dev/null
build=build/fuzzing
cmake --build "$build" --target input_fuzzer
fuzzer=$build/tests/input_fuzzing/input_fuzzer

# Readers take files, thousands of them a second; they are kept in memory.
memory=/dev/shm
[ -w "$memory" ] || memory=${TMPDIR:-/tmp}
TMPDIR=$(mktemp -d "$memory/cutproof_fuzzing_XXXXXX")
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

declare -A longest=([scene]=8192 [stl]=4096 [obj]=4096 [ply]=4096 [off]=4096 [recording]=65536 [recording_contents]=96 [arrays]=16384 [counterexample]=8192 [campaign]=16384 [results]=16384 [question]=16384 [run]=16384)
table=$(printf '%-20s %11s %8s %9s %7s %9s' target executions seconds coverage corpus findings)
status=0
for target in "${targets[@]}"; do
  export CUTPROOF_INPUT_TARGET=$target
  seeds=$build/seeds/$target corpus=$build/corpus/$target findings=$build/findings/$target
  regressions=fixtures/regressions/inputs/$target
  rm -rf "$seeds" "$findings"
  mkdir -p "$corpus" "$findings"
  "$fuzzer" --make-seeds="$seeds"
  folders=("$corpus" "$seeds")
  [ -d "$regressions" ] && folders+=("$regressions")
  words=()
  [ -s "$seeds.dict" ] && words=(-dict="$seeds.dict")
  # HDF5 keeps freed memory, which looks like a leak after every input. The replay under ASan checks for leaks at its
  # end.
  leaks=1
  [[ $target == recording* || $target == arrays || $target == run ]] && leaks=0
  limits=(-detect_leaks="$leaks" -max_len="${longest[$target]}" -rss_limit_mb=2048 -malloc_limit_mb=1024 -timeout=20)

  echo "== $target: $seconds s, seed $seed"
  log=$build/findings/$target.log
  result=0
  begin=$SECONDS
  nice -n 15 "$fuzzer" -max_total_time="$seconds" -seed="$seed" "${words[@]}" -print_final_stats=1 \
    "${limits[@]}" -artifact_prefix="$findings/" "${folders[@]}" > "$log" 2>&1 || result=$?
  took=$((SECONDS - begin))

  found=0
  for finding in "$findings"/*; do
    [ -e "$finding" ] || continue
    found=$((found + 1))
    grep -aE -m 8 'ERROR:|what\(\)|runtime error|SUMMARY' "$log" || tail -20 "$log"
    # Time-outs and excess memory are not minimised: each try would take as long, or as much.
    small=$findings/minimised
    case $finding in
      */timeout-* | */oom-*) cp "$finding" "$small" ;;
      *) "$fuzzer" -minimize_crash=1 -max_total_time=30 "${limits[@]}" -exact_artifact_path="$small" "$finding" \
           > "$findings.minimised.log" 2>&1 || true ;;
    esac
    [ -e "$small" ] || cp "$finding" "$small"
    echo "found: $small; keep it as $regressions/NAME_OF_THE_FAULT when it is mended"
  done
  # The fuzzer itself may fail without a guilty input.
  [ "$result" = 0 ] || [ "$found" -gt 0 ] || { found=1; tail -20 "$log"; }
  [ "$found" = 0 ] || status=1

  statistic() { awk -v name="stat::$1:" '$1 == name { print $2 }' "$log"; }
  last=$(grep -aE '^#[0-9]+' "$log" | tail -1 || true)
  table+=$(printf '\n%-20s %11s %8s %9s %7s %9s' "$target" "$(statistic number_of_executed_units)" \
    "$took" "$(sed -nE 's/.* cov: ([0-9]+).*/\1/p' <<< "$last")" "$(sed -nE 's/.* corp: ([0-9]+).*/\1/p' <<< "$last")" "$found")
done
echo
echo "$table"
exit "$status"
