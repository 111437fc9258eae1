#!/usr/bin/env bash
# Installs the Debian 12 packages that building the program needs, and those of each named group. Does nothing if all
# are installed.
# Usage: ci/install.sh [--list] [GROUP...]
#   tests       for the tests; without the next two groups tests of a browser or VTK are skipped
#   browser     Chromium, in which tests/report/ opens report pages
#   libraries   VTK, which tests/guests/libraries_test.cpp judges, and npm packages, which javascript_test.py judges
#   package     for ci/package.sh
#   fuzzing     for ci/input_fuzzing.sh, beside the tests'
#   docs        Doxygen for ci/docs.sh
#   --list      prints the packages instead
set -euo pipefail
cd "$(dirname "$0")/.."

program=(
  g++ cmake ninja-build
  libeigen3-dev libsuitesparse-dev libcgal-dev libboost-dev libboost-context-dev libhdf5-dev zlib1g-dev
  nlohmann-json3-dev libfmt-dev libcli11-dev
  python3 esbuild libjs-three  # report pages
)
package=(dpkg-dev file libgfortran-12-dev)  # a package's dependencies; the archive that libblas.a needs
tests=(
  "${package[@]}" git ccache
  libgtest-dev libgmock-dev librapidcheck-dev
  python3-h5py python3-numpy python3-jsonschema
  libbullet-dev python3-scipy python3-skimage  # judged as examples: docs/results/libraries.md
  groff-base   # reads the manual page
  zsh fish     # read their completions
  python3-venv # pip, which installs the wheel
  openmpi-bin  # mpirun, for a test of ci/cluster/; no program is linked with it
)
browser=(chromium chromium-driver python3-selenium)
libraries=(libvtk9.1)
command -v npm >/dev/null || libraries+=(nodejs npm)  # a Node.js from elsewhere brings its own npm
fuzzing=(clang libclang-rt-dev llvm)  # llvm adds file and line to sanitizers' reports
docs=(doxygen)

list=no
if [ "${1:-}" = --list ]; then
  list=yes
  shift
fi
packages=()
for group in program "$@"; do
  case $group in
    program | tests | browser | libraries | package | fuzzing | docs) declare -n these=$group ;;
    *) echo "ci/install.sh: \"$group\" is no group of packages; there are: tests, browser, libraries, package, fuzzing, docs" >&2; exit 2 ;;
  esac
  packages+=("${these[@]}")
done
if [ "$list" = yes ]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

missing=()
for name in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$name" 2>/dev/null | grep -q 'install ok installed' || missing+=("$name")
done
# libvtk9-dev would bring 212 packages, with Java and MPI. Its headers and the libraries suffice.
headers=no
[[ " $* " != *" libraries "* ]] || [ -d build/libraries/usr/include/vtk-9.1 ] || headers=yes
engines() {
  [[ " $* " == *" libraries "* ]] || return 0
  cd guests/examples/javascript
  [ ! package-lock.json -nt node_modules ] || npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
}
[ ${#missing[@]} -gt 0 ] || [ "$headers" = yes ] || { engines "$@"; exit 0; }

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "ci/install.sh: these packages are missing, and installing them needs root or sudo: ${missing[*]:-libvtk9-dev}" >&2; exit 3; }
  as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
if [ ${#missing[@]} -gt 0 ]; then
  echo "Installing: ${missing[*]}"
  "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi
if [ "$headers" = yes ]; then
  mkdir -p build/libraries
  (cd build/libraries && apt-get download -qq -o APT::Sandbox::User=root libvtk9-dev && dpkg -x libvtk9-dev_*.deb .)
fi
engines "$@"
