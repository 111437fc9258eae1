#!/usr/bin/env bash
# Builds and packs the program and the libraries: a .tar.gz and a .deb, each with its SHA-256, and a wheel. The packed
# program needs only glibc 2.34 or later.
# Usage: ci/package.sh [OPTIONS of cmake]     e.g. -DCUTPROOF_CUDA=ON, with the gpu backend
# CUTPROOF_DIST: the packages' folder, which keeps nothing else (default: dist)
set -euo pipefail
cd "$(dirname "$0")/.."
dist=${CUTPROOF_DIST:-$PWD/dist}

ci/install.sh package
cmake --preset package "$@" > /dev/null
cmake --build build/package
rm -rf "$dist"
cpack --config build/package/CPackConfig.cmake -G "TGZ;DEB" -B "$dist" > build/package/cpack.log 2>&1 ||
  { cat build/package/cpack.log >&2; exit 3; }
rm -rf "$dist/_CPack_Packages"
ci/wheel.sh "$dist" > /dev/null
ls -l "$dist"
