#!/usr/bin/env bash
# Makes pages of the public headers, with a search, in a folder that a browser opens from disk: index.html. Exits 1 and
# prints Doxygen's warnings, if there are any.
# Usage: ci/docs.sh [FOLDER]   (default: build/api; its contents are replaced)
# Needs Doxygen: ci/install.sh docs
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-build/api}
command -v doxygen > /dev/null || { echo "ci/docs.sh: Doxygen is not installed: ci/install.sh docs" >&2; exit 77; }

# Headers that cmake --install installs (cmake/Install.cmake, guests/include/CMakeLists.txt).
version=$(sed -n 's/^project(cutproof VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
rm -rf "$folder"
mkdir -p "$folder"
cat > "$folder/main.markdown" << 'END'
# Headers of cutproof

| header | use |
|---|---|
| `cutproof/plugin.h` | a plugin, whose kernels and stages `cutproof judge` judges |
| `cutproof/run.h` | writes a run, which `cutproof check` judges |
| `model/` | bodies, scenes, states, clusters, skins and verdicts; readers and writers of files |
| `oracles/` | functions that judge states, stages and runs |
| `reference_cpu/` | the CPU reference |
| `gpu/` | the kernels, and the launch layer below them |
END
if ! doxygen - > /dev/null 2> "$folder/warnings.txt" << END
PROJECT_NAME = cutproof
PROJECT_NUMBER = $version
PROJECT_BRIEF = "headers for plugins, runs and other projects"
INPUT = "$folder/main.markdown" guests/include model reference_cpu gpu oracles
FILE_PATTERNS = *.h *.cuh
EXTENSION_MAPPING = cuh=C++
RECURSIVE = YES
FULL_PATH_NAMES = YES
STRIP_FROM_PATH = guests/include .
STRIP_FROM_INC_PATH = guests/include .
USE_MDFILE_AS_MAINPAGE = "$folder/main.markdown"
FILTER_PATTERNS = "*.h=/usr/bin/python3 ci/doxygen_comments.py" "*.cuh=/usr/bin/python3 ci/doxygen_comments.py"
OUTPUT_DIRECTORY = "$folder"
HTML_OUTPUT = .
GENERATE_LATEX = NO
HTML_TIMESTAMP = NO
GENERATE_TREEVIEW = YES
SEARCHENGINE = YES
SERVER_BASED_SEARCH = NO
JAVADOC_AUTOBRIEF = YES
EXTRACT_ALL = YES
EXTRACT_STATIC = YES
HIDE_IN_BODY_DOCS = YES
EXCLUDE_SYMBOLS = fmt fmt::*
SHOW_INCLUDE_FILES = NO
VERBATIM_HEADERS = NO
HAVE_DOT = NO
QUIET = YES
WARN_AS_ERROR = FAIL_ON_WARNINGS
END
then
  cat "$folder/warnings.txt" >&2
  exit 1
fi
rm "$folder/warnings.txt" "$folder/main.markdown"
[ -s "$folder/search/all_0.js" ] || { echo "ci/docs.sh: the pages have no search" >&2; exit 1; }
echo "$folder/index.html"
