#!/usr/bin/env bash
# Packs what a GPU machine needs that has nothing but a driver: programs, their libraries, scenes, and run.sh.
# Usage: ci/gpu_kit.sh [BUILD] [KIT]     BUILD: a build folder with the gpu backend (default build/default);
#                                        KIT: the folder to make (default gpu_kit)
# On that machine: KIT/run.sh RESULTS    writes JSON and logs into RESULTS; exit status 0 if everything held.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/default}
kit=${2:-gpu_kit}

programs=(cli/cutproof tests/gpu/launch_device_test tests/gpu/device_failures_test tests/gpu/acceleration_test
  property_tests/property_tests)
for program in "${programs[@]}"; do
  [ -x "$build/$program" ] || { echo "ci/gpu_kit.sh: $build/$program is not there: build it with a CUDA toolkit first" >&2; exit 2; }
done

rm -rf "$kit.new"
mkdir -p "$kit.new/bin" "$kit.new/lib"
for program in "${programs[@]}"; do
  install -s "$build/$program" "$kit.new/bin/"
  # The C library and the driver are the machine's own.
  ldd "$build/$program" | awk '$3 ~ /^\// {print $3}' | grep -vE '/(libc|libm|libpthread|libdl|librt|ld-linux[^/]*|libcuda|libresolv)\.so' |
    while read -r library; do cp -Ln "$library" "$kit.new/lib/"; done
done
cp -r fixtures "$kit.new/fixtures"
find "$kit.new/fixtures" -name '*.cpp' -delete -o -name '*.h' -delete -o -name CMakeLists.txt -delete
# kidney_discontinuous at rest for long enough to make 1,000 frames of it.
python3 - "$kit.new/fixtures/scenes" <<'PYTHON'
import json, sys
folder = sys.argv[1]
scene = json.load(open(folder + "/kidney_discontinuous.json"))
scene["name"] = "kidney_1000_frames"
scene["frame"]["count"] = 1000
scene["frame"].pop("settle", None)
json.dump(scene, open(folder + "/kidney_1000_frames.json", "w"))
PYTHON
cp ci/gpu_kit_run.sh "$kit.new/run.sh"
git describe --always --dirty --abbrev=12 > "$kit.new/commit"
rm -rf "$kit"
mv "$kit.new" "$kit"
du -sh "$kit" | cut -f1
