#!/usr/bin/env bash
# Runs all that needs a GPU: primitives, failing calls, scenes, properties, compute-sanitizer, timings. Part of the kit
# from ci/gpu_kit.sh. Usage: run.sh RESULTS [PART...]
# Parts: primitives failures scenes lockstep determinism properties guests methods sanitizer timings
set -uo pipefail
here=$(cd "$(dirname "$0")" && pwd)
results=$(mkdir -p "$1" && cd "$1" && pwd)
shift
parts=${*:-primitives failures scenes lockstep determinism properties guests methods sanitizer timings}
export CUTPROOF_COMMIT=$(cat "$here/commit")
export PATH="$here/bin:$PATH:/usr/local/cuda/bin"
cases=${CUTPROOF_CASES:-100000}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
[ -d "$here/bin" ] || tar -xzf "$here/contents.tar.gz" -C "$here" || exit 3
export CUTPROOF_REGRESSIONS="$here/fixtures/regressions"
status=0
lines=()
cd "$here"

note() {  # NAME STATUS SECONDS
  lines+=("    {\"name\": \"$1\", \"status\": $2, \"seconds\": $3}")
  [ "$2" = 0 ] || status=1
  echo "$1: status $2, $3 s"
}
try() {  # NAME COMMAND...
  local name=$1 begin=$SECONDS result=0
  shift
  "$@" > "$results/$name.log" 2>&1 || result=$?
  # This machine has a device, so a skipped test is a failure.
  if [ "$result" = 0 ] && grep -q '^\[  SKIPPED \]' "$results/$name.log"; then result=4; fi
  [ "$result" = 0 ] || tail -25 "$results/$name.log"
  note "$name" "$result" "$((SECONDS - begin))"
}

# Passes if the command reports a failing verdict.
finds() {
  local result=0
  "$@" || result=$?
  [ "$result" = 1 ]
}
# A guest under compute-sanitizer: TOOL PLUGIN SUMMARY, the required last line of the tool. The judge starts the program
# that CUTPROOF_GUEST names.
judge_under() {
  printf '#!/usr/bin/env bash\nexec compute-sanitizer --tool %s --error-exitcode 99 --log-file %s "%s/bin/cutproof-guest" "$@"\n' \
    "$1" "$work/$1.log" "$here" > "$work/guest"
  chmod +x "$work/guest"
  rm -f "$work/$1.log"
  CUTPROOF_GUEST="$work/guest" cutproof judge "guests/$2.so" --cases 60 --time-limit 120 --shrink 0 --save "$work" || true
  cat "$work/$1.log"
  grep -q "$3" "$work/$1.log"
}

for part in $parts; do
  case $part in
    primitives) try launch_device_test launch_device_test ;;
    failures) try device_failures_test env CUTPROOF_CALLS=all device_failures_test ;;
    scenes)
      for scene in cuboid_press uniform_stretch uniform_stretch_strain three_cuts liver_cut kidney_arc \
          kidney_discontinuous irregular_sampled irregular_sampled_covered cluster_growth small_block cylinder \
          kidney_101096; do
        try "scene_$scene" cutproof run "fixtures/scenes/$scene.json" --backend gpu --check
      done ;;
    lockstep)
      for scene in kidney_discontinuous liver_cut cuboid_press; do
        try "lockstep_$scene" cutproof run "fixtures/scenes/$scene.json" --backend gpu --against reference --json "$results/lockstep_$scene.json"
      done ;;
    determinism)
      # The same run gives the same files in all bytes, so comparing recordings compares runs.
      for run in first second; do
        try "determinism_$run" cutproof run fixtures/scenes/kidney_1000_frames.json --backend gpu --record "$work/$run"
      done
      for file in cutproof.h5 particles.vtkhdf skin.vtkhdf; do
        try "determinism_same_$file" cmp "$work/first.$file" "$work/second.$file"
      done ;;
    properties)
      try fuzz cutproof fuzz --backend gpu --cases "$cases" --save "$results" --json "$results/fuzz.json"
      try fuzz_dynamics cutproof fuzz --backend gpu --dynamics --cases 10000 --seed 2000001 \
        --save "$results" --json "$results/fuzz_dynamics.json"
      try kernels kernels_test --gtest_filter='*/gpu'
      try rapidcheck property_tests --gtest_filter='*/gpu*:Cases*:Paths.OfTheDevice*' ;;
    guests)
      for plugin in cuda_components cuda_components_in_a_block; do
        try "judge_$plugin" cutproof judge "guests/$plugin.so" --save "$results" --json "$results/judge_$plugin.json"
      done
      # Twenty iterations of Müller's method are not always enough, and a missing barrier shows.
      for plugin in cuda_rotations cuda_components_without_barrier; do
        try "judge_$plugin" finds cutproof judge "guests/$plugin.so" --save "$results" --json "$results/judge_$plugin.json"
      done
      # Without the plugin that lacks a barrier: its shared accesses are atomic, no hazard to racecheck.
      for plugin in cuda_components cuda_components_in_a_block cuda_rotations; do
        for tool in memcheck racecheck synccheck initcheck; do
          try "judge_${plugin}_$tool" judge_under "$tool" "$plugin" 'ERROR SUMMARY: 0 errors\|RACECHECK SUMMARY: 0 hazards'
        done
      done ;;
    methods)
      # Other tests of that program need no device; those of plugins look for them in the build.
      try baselines_test baselines_test --gtest_filter='*cuda*'
      # Tests of thousands of steps are left out: shorter ones launch the same kernels.
      for tool in memcheck racecheck initcheck synccheck; do
        try "baselines_$tool" compute-sanitizer --tool "$tool" --error-exitcode 9 baselines_test \
          --gtest_filter='*cuda*-*Hard*:*MakesOf*:*WhatIsHeld*:*HeldBar*'
      done
      for method in fem mpm tets; do
        try "dissect_$method" cutproof judge "guests/${method}_cuda.so" dissect --cases "${CUTPROOF_SCENES:-1000}" \
          --time-limit 60 --save "$results"
      done
      try methods cutproof bench baselines --backend gpu --sizes 101096,48385,37704,12800 --with guests/fem_cuda.so \
        --with guests/fem_cuda.so,steps=1 --with guests/mpm_cuda.so --with guests/mpm_cuda.so,labels=0 \
        --with guests/tets_cuda.so,steps=80 --with guests/tets_cuda.so,steps=640 --iterations 32,128 \
        --truth guests/fem_cuda.so,newton=2 --truth-particles 400000 --json "$results/methods.json" ;;
    sanitizer)
      for tool in memcheck racecheck initcheck synccheck; do
        # Kernels one by one, because racecheck does not support conditional nodes. From one thread, because racecheck
        # then ends no kernel during the launch of another.
        try "sanitizer_$tool" compute-sanitizer --tool "$tool" --error-exitcode 9 cutproof fuzz \
          --backend gpu-eager --threads 1 --cases "${CUTPROOF_SANITIZER_CASES:-128}" --save "$results"
        try "sanitizer_${tool}_moving" compute-sanitizer --tool "$tool" --error-exitcode 9 cutproof fuzz \
          --backend gpu-eager --threads 1 --dynamics --cases 16 --save "$results"
        try "sanitizer_${tool}_step" compute-sanitizer --tool "$tool" --error-exitcode 9 cutproof run \
          fixtures/scenes/small_block.json --backend gpu-eager
        try "sanitizer_${tool}_retarded" compute-sanitizer --tool "$tool" --error-exitcode 9 cutproof run \
          fixtures/scenes/small_block.json --backend gpu-eager --set step.retardation=0.004 --frames 30
      done
      # The graph too, with tools that support its conditions; they do so only when nothing else runs on the device.
      for tool in memcheck initcheck; do
        for scene in small_block kidney_discontinuous cluster_growth; do
          try "sanitizer_${tool}_graph_$scene" compute-sanitizer --tool "$tool" --error-exitcode 9 cutproof run \
            "fixtures/scenes/$scene.json" --backend gpu --frames 30
        done
      done ;;
    timings)
      try rotations cutproof bench rotations --backend gpu --cases --json "$results/rotations.json"
      try machine_limits cutproof bench machine_limits --backend gpu --json "$results/machine_limits.json"
      try stages cutproof bench stages --backend gpu --json "$results/stages.json"
      try sizes cutproof bench stages --backend gpu --sizes 1000,101096,1000000,10000000 \
        --json "$results/stages_sizes.json"
      try sampling cutproof bench sampling --backend gpu --json "$results/sampling.json"
      try clusters cutproof bench clusters --backend gpu --json "$results/clusters.json"
      try scale cutproof bench scale --backend gpu --json "$results/scale.json"
      try solver cutproof bench solver --backend gpu --json "$results/solver.json"
      try sensitivity cutproof bench sensitivity --backend gpu --json "$results/sensitivity.json"
      try baselines cutproof bench baselines --backend gpu --json "$results/baselines.json"
      try parts cutproof bench parts --backend gpu --json "$results/parts.json"
      try campaigns cutproof bench campaigns --backend gpu --json "$results/campaigns.json"
      # A body of ten million particles under a blade for 100 frames.
      try ten_million cutproof bench stages --backend gpu --sizes 10000000 --frames 100 --json "$results/stages_10M.json" ;;
    *) echo "run.sh: there is no part '$part'" >&2; exit 2 ;;
  esac
done

device=$(nvidia-smi --query-gpu=name,driver_version,memory.total --format=csv,noheader 2>/dev/null | head -1)
{
  echo "{"
  echo "  \"commit\": \"$CUTPROOF_COMMIT\","
  echo "  \"device\": \"$device\","
  echo "  \"date\": \"$(date -u +%Y-%m-%dT%H:%M:%SZ)\","
  echo "  \"steps\": ["
  for ((i = 0; i < ${#lines[@]}; ++i)); do echo "${lines[i]}$([ $((i + 1)) -lt ${#lines[@]} ] && echo ,)"; done
  echo "  ]"
  echo "}"
} > "$results/summary.json"
exit $status
