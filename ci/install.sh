#!/usr/bin/env bash
# Installs what building and testing needs, from Debian or Ubuntu packages; does nothing if all of it is there.
# Usage: ci/install.sh [fuzzing]     fuzzing: also what ci/input_fuzzing.sh needs, and nothing else does
set -euo pipefail

packages=(
  g++ cmake ninja-build ccache git ca-certificates
  libeigen3-dev libsuitesparse-dev libcgal-dev libboost-dev libboost-context-dev libhdf5-dev libzip-dev
  nlohmann-json3-dev libfmt-dev libcli11-dev
  libgtest-dev librapidcheck-dev
  python3 python3-h5py python3-numpy
)
# libFuzzer and the sanitizers of clang; llvm has the symbolizer that gives their reports file and line.
fuzzing_packages=(clang libclang-rt-dev llvm)
case "$*" in
  "") ;;
  fuzzing) packages+=("${fuzzing_packages[@]}") ;;
  *) echo "ci/install.sh: \"$*\" is no list of packages; the only one is: fuzzing" >&2; exit 2 ;;
esac

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "ci/install.sh: these packages are missing, and installing them needs root or sudo: ${missing[*]}" >&2; exit 3; }
  as_root=(sudo)
fi
echo "Installing: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
