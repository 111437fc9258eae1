#!/usr/bin/env bash
# Makes the tables of docs/results/*.md from the documents in results/.
# Usage: ci/results.sh            writes the tables
#        ci/results.sh --check    exit status 1 if a page and its documents differ
#        ci/results.sh --fronts TUNE.json...   makes results/h200_fronts.json, an extract of documents of `tune --full`
exec /usr/bin/python3 "$(dirname "$0")/results.py" "$@"
