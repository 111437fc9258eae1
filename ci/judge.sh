#!/usr/bin/env bash
# Runs a subcommand of cutproof in continuous integration. Leaves results.json, junit.xml and page.html in a folder;
# fuzz and judge also leave counterexamples (cases/, unless --save names a folder). Exits as the program does (0:
# everything holds, 1: something fails, 2: bad input, 3: the machine failed).
# Usage: judge.sh PACKAGE FOLDER SUBCOMMAND ARGUMENTS...     e.g. judge.sh cutproof-0.1.0-linux-x86_64.tar.gz found check RUN
#   PACKAGE     the .tar.gz of ci/package.sh, unpacked into FOLDER/program if that is missing; "-": the installed program
#   SUBCOMMAND  run, check, judge or fuzz, which write all three; others take --json and --junit as arguments
set -euo pipefail

refuse() { echo "judge.sh: $1" >&2; exit 2; }
[ $# -ge 3 ] || refuse "usage: judge.sh PACKAGE FOLDER SUBCOMMAND ARGUMENTS..."
package=$1 folder=$2
shift 2
case $1 in
  run | check | judge | fuzz) ;;
  *) refuse "\"$1\" is no subcommand that writes results, JUnit and a page: run, check, judge, fuzz" ;;
esac
program=cutproof
if [ "$package" != - ]; then
  [ -f "$package" ] || refuse "there is no package \"$package\": ci/package.sh makes one in dist/"
  program=$folder/program/bin/cutproof
  if [ ! -e "$program" ] || [ "$package" -nt "$program" ]; then
    rm -rf "$folder/program" "$folder/program.new"
    mkdir -p "$folder/program.new"
    tar -xmzf "$package" -C "$folder/program.new" --strip-components=1 2>/dev/null ||
      { rm -rf "$folder/program.new"; refuse "\"$package\" is no whole .tar.gz of ci/package.sh: copy it again"; }
    mv "$folder/program.new" "$folder/program"
  fi
fi
command -v "$program" >/dev/null || refuse "the program cutproof is not in PATH: install it, or name a package instead of -"
mkdir -p "$folder"
save=()
case "$* " in
  *" --save"[\ =]* | *" --merge"[\ =]* | *" --case"[\ =]*) ;;
  judge\ * | fuzz\ *)
    mkdir -p "$folder/cases"
    save=(--save "$folder/cases")
    ;;
esac
exec "$program" "$@" "${save[@]}" --json "$folder/results.json" --junit "$folder/junit.xml" --report "$folder/page.html"
