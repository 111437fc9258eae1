#!/usr/bin/env bash
# Builds the program and the libraries, and packs them into dist/: a .tar.gz, and a .deb for the system on which
# it runs, each with its SHA-256.
# Usage: ci/package.sh [OPTIONS of cmake]     e.g. -DCUTPROOF_CUDA=ON, with the gpu backend
set -euo pipefail
cd "$(dirname "$0")/.."

ci/install.sh package
cmake --preset package "$@" > /dev/null
cmake --build build/package
rm -rf dist
cpack --config build/package/CPackConfig.cmake -G "TGZ;DEB" -B "$PWD/dist" > build/package/cpack.log 2>&1 ||
  { cat build/package/cpack.log >&2; exit 3; }
rm -rf dist/_CPack_Packages
ls -l dist
