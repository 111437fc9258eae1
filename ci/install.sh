#!/usr/bin/env bash
# Installs what building and testing needs, from Debian or Ubuntu packages; does nothing if all of it is there.
# Usage: ci/install.sh [browser | fuzzing | libraries]
#   browser     also Chromium, in which tests/report/ opens report pages; without it those tests are skipped
#   fuzzing     also what ci/input_fuzzing.sh needs, and nothing else does
#   libraries   also VTK, which tests/guests/libraries_test.cpp judges; without it those tests are skipped
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(
  g++ cmake ninja-build ccache git ca-certificates
  libeigen3-dev libsuitesparse-dev libcgal-dev libboost-dev libboost-context-dev libhdf5-dev libzip-dev
  nlohmann-json3-dev libfmt-dev libcli11-dev
  libgtest-dev librapidcheck-dev libbullet-dev
  python3 python3-h5py python3-numpy
  zlib1g-dev esbuild libjs-three  # report pages
  python3-scipy python3-skimage  # judged as examples: docs/results/libraries.md
  groff-base     # the manual page, rendered by a test
  zsh fish       # shells that a test has read their completions
  dpkg-dev file  # packages: which libraries they depend on
  openmpi-bin    # mpirun, for a test of ci/cluster/; no program is linked with it
)
browser_packages=(chromium chromium-driver python3-selenium)
# libFuzzer and the sanitizers of clang; llvm has the symbolizer that gives their reports file and line.
fuzzing_packages=(clang libclang-rt-dev llvm)
vtk=no
case "$*" in
  "") ;;
  # Ubuntu has Chromium as a snap alone.
  browser) [ "$(. /etc/os-release && echo "${ID:-}")" != debian ] || packages+=("${browser_packages[@]}") ;;
  fuzzing) packages+=("${fuzzing_packages[@]}") ;;
  libraries) vtk=yes ;;
  *) echo "ci/install.sh: \"$*\" is no list of packages; there are: browser, fuzzing, libraries" >&2; exit 2 ;;
esac

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
done
# libvtk9-dev would bring 212 packages, a Java and an MPI among them. Its headers are enough, beside the libraries.
headers=build/libraries/usr/include/vtk-9.1
if [ "$vtk" = yes ] && ! { [ -d "$headers" ] && compgen -G "/usr/lib/*/libvtkFiltersCore-9.1.so.1" >/dev/null; }; then
  missing+=(vtk)
fi
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "ci/install.sh: these packages are missing, and installing them needs root or sudo: ${missing[*]}" >&2; exit 3; }
  as_root=(sudo)
fi
echo "Installing: ${missing[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
if [ "$vtk" = yes ] && [ "${missing[-1]}" = vtk ]; then
  # The name of the package of libraries differs: libvtk9.1, libvtk9.1t64.
  missing[-1]=$(apt-cache depends libvtk9-dev | awk '$2 ~ /^libvtk9\.[0-9]+(t64)?$/ {print $2; exit}')
  mkdir -p build/libraries
  (cd build/libraries && apt-get download -qq -o APT::Sandbox::User=root libvtk9-dev && dpkg -x libvtk9-dev_*.deb .)
fi
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
