#!/usr/bin/env python3
"""Checks that the folders of the project include each other one way: no circle.

Usage: check_folders.py [--draw] [ROOT]   --draw: also prints the includes of each folder, from the ground up
       check_folders.py --self-test       whether a circle is found

Only folders with sources count; a subfolder is a folder of its own. Exit status: 0 no circle, 1 a circle, 2 bad usage.
"""
import argparse
import graphlib
import pathlib
import re
import sys
import tempfile

SOURCES = {".h", ".cuh", ".inc", ".cpp", ".cu"}
INCLUDE = re.compile(r'[ \t]*#[ \t]*include[ \t]+"([^"]+)"')
MOST_SHOWN = 3


def folder_of(file):
    return str(pathlib.PurePath(file).parent)


def includes_between(root):
    """{folder: {included folder: ["file:line includes file"]}}"""
    files = [file for file in sorted(root.rglob("*")) if file.suffix in SOURCES
             and file.relative_to(root).parts[0] not in ("build", ".git")]
    graph = {}
    for file in files:
        name = str(file.relative_to(root))
        mine = graph.setdefault(folder_of(name), {})
        for number, line in enumerate(file.read_text(encoding="utf-8", errors="replace").split("\n"), 1):
            found = INCLUDE.match(line)
            if found and (root / found.group(1)).is_file() and folder_of(found.group(1)) != folder_of(name):
                mine.setdefault(folder_of(found.group(1)), []).append(f"{name}:{number} includes {found.group(1)}")
    return graph


def check(root, draw):
    graph = includes_between(root)
    try:
        order = list(graphlib.TopologicalSorter(graph).static_order())
    except graphlib.CycleError as error:
        circle = error.args[1][::-1]  # each includes the next
        print(f"These folders include each other in a circle: {' -> '.join(circle)}")
        for folder, included in zip(circle, circle[1:]):
            lines = graph[folder][included]
            print(f"{folder} -> {included}, {len(lines)} in all:", *lines[:MOST_SHOWN], sep="\n  ")
        return 1
    if draw:
        for folder in order:
            print(f"{folder} -> {' '.join(sorted(graph[folder])) or '(nothing)'}")
    return 0


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for file, included in {"low/a.h": "<vector>", "low/b.h": '"low/a.h"', "low/in/c.h": '"low/b.h"',
                               "high/d.cpp": '"low/in/c.h"'}.items():
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(f"#pragma once\n#include {included}\n")
        if check(root, draw=False) != 0:
            return 1
        (root / "high/e.h").write_text("#pragma once\n")
        (root / "low/b.h").write_text('#pragma once\n  #  include "high/e.h"\n')
        return 0 if check(root, draw=False) == 1 else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draw", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("root", nargs="?", default=pathlib.Path(__file__).resolve().parent.parent, type=pathlib.Path)
    given = parser.parse_args()
    return self_test() if given.self_test else check(given.root, given.draw)


if __name__ == "__main__":
    sys.exit(main())
