#!/usr/bin/env python3
"""Counts lines of code without blanks and comments, by folder: the product, and its tests.

Usage: count_lines.py
"""
import collections
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent
SOURCES = {".h", ".cuh", ".inc", ".cpp", ".cu", ".js", ".css", ".py", ".sh", ".cmake"}
COMMENT = re.compile(r"\s*(//|#(?!\s*(include|pragma|define|if|el|endif|undef|error))|\*|/\*)")


def main():
    lines = collections.Counter()
    for name in subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n"):
        path = pathlib.PurePath(name)
        if path.suffix not in SOURCES:
            continue
        text = (ROOT / name).read_text(encoding="utf-8", errors="replace")
        lines[path.parts[0]] += sum(1 for line in text.split("\n") if line.strip() and not COMMENT.match(line))
    tests = lines.pop("tests", 0)
    for folder, count in lines.most_common():
        print(f"{folder:15} {count:7,}")
    print(f"{'product':15} {sum(lines.values()):7,}\n{'tests':15} {tests:7,}")


if __name__ == "__main__":
    main()
