#!/usr/bin/env bash
# Packs everything for a GPU machine with only a driver: programs, their libraries, scenes, regressions, run.sh.
# Usage: ci/gpu_kit.sh [BUILD] [KIT]     BUILD: a build folder configured with the gpu backend (default build/default),
#                                        which this builds; KIT: the folder to make (default gpu_kit)
# On that machine: KIT/run.sh RESULTS    unpacks KIT/contents.tar.gz into KIT the first time, and writes JSON and logs into
#                                        RESULTS; exit status 0 if everything held.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/default}
kit=${2:-gpu_kit}
most_bytes=60000000  # most that can be sent to such a machine beside the code

programs=(cli/cutproof cli/cutproof-guest tests/gpu/launch_device_test tests/gpu/device_failures_test tests/gpu/kernels_test
  property_tests/property_tests tests/baselines/baselines_test)
[ -f "$build/CMakeCache.txt" ] || { echo "ci/gpu_kit.sh: $build is no build folder: cmake --preset default -B $build first" >&2; exit 2; }
# Programs look beside themselves for their libraries and for those of the libraries. (A runpath, the linkers' default,
# does not apply to the latter.)
cmake -B "$build" -DCMAKE_BUILD_RPATH='$ORIGIN/../lib' -DCMAKE_EXE_LINKER_FLAGS=-Wl,--disable-new-dtags > /dev/null
grep -q '^CMAKE_CUDA_COMPILER:.*nvcc' "$build/CMakeCache.txt" ||
  { echo "ci/gpu_kit.sh: $build has no gpu backend: it needs a CUDA toolkit" >&2; exit 2; }
guests=(cuda_components cuda_components_in_a_block cuda_components_without_barrier cuda_rotations)
methods=(fem_cuda mpm_cuda tets_cuda)
cmake --build "$build" --target "${programs[@]##*/}" "${guests[@]}" "${methods[@]}"

rm -rf "$kit.new"
mkdir -p "$kit.new/bin" "$kit.new/lib" "$kit.new/fixtures" "$kit.new/guests"
for guest in "${guests[@]}"; do install -s "$build/guests/examples/$guest.so" "$kit.new/guests/"; done
for method in "${methods[@]}"; do install -s "$build/baselines/$method.so" "$kit.new/guests/"; done
for program in "${programs[@]}"; do
  install -s "$build/$program" "$kit.new/bin/"
  # The machine has its own C library and driver.
  ldd "$build/$program" | awk '$3 ~ /^\// {print $3}' | grep -vE '/(libc|libm|libpthread|libdl|librt|ld-linux[^/]*|libcuda|libresolv)\.so'
done | sort -u | while read -r library; do
  install -s "$(readlink -f "$library")" "$kit.new/lib/${library##*/}"
done
cp -r fixtures/scenes fixtures/regressions "$kit.new/fixtures/"
rm -rf "$kit.new/fixtures/regressions/inputs"  # of readers, which need no GPU
# kidney_discontinuous with a rest long enough for 1,000 frames.
python3 - "$kit.new/fixtures/scenes" <<'PYTHON'
import json, sys
folder = sys.argv[1]
scene = json.load(open(folder + "/kidney_discontinuous.json"))
scene["name"] = "kidney_1000_frames"
scene["frame"]["count"] = 1000
scene["frame"].pop("settle", None)
json.dump(scene, open(folder + "/kidney_1000_frames.json", "w"))
PYTHON
tar -C "$kit.new" -czf "$kit.new/contents.tar.gz" bin lib fixtures guests
rm -r "$kit.new"/{bin,lib,fixtures,guests}
cp ci/gpu_kit_run.sh "$kit.new/run.sh"
git describe --always --dirty --abbrev=12 > "$kit.new/commit"
bytes=$(du -sb "$kit.new" | cut -f1)
if [ "$bytes" -gt "$most_bytes" ]; then
  echo "ci/gpu_kit.sh: the kit has $bytes bytes, more than $most_bytes" >&2
  exit 1
fi
rm -rf "$kit"
mv "$kit.new" "$kit"
echo "$kit: $((bytes / 1000000)) MB"
