#!/usr/bin/env bash
# Makes the tables of docs/results/*.md from the documents in results/.
# Usage: ci/results.sh            writes the tables
#        ci/results.sh --check    exit status 1 if a page and its documents differ
# Further options: ci/results.py
exec /usr/bin/python3 "$(dirname "$0")/results.py" "$@"
