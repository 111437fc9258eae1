#!/usr/bin/env python3
"""Prints which tests were skipped or left out, and as the last line the counts. Usage: count_tests.py REPORT STATUS

REPORT is CTest's JUnit file, STATUS CTest's exit status. Exits 1 if a test failed or none ran.
"""
import os
import sys
import xml.etree.ElementTree as tree


def main():
    report, status = sys.argv[1], int(sys.argv[2])
    passed, failed, skipped = [], [], []
    for case in tree.parse(report).getroot().iter("testcase"):
        name = case.get("name")
        if case.find("failure") is not None or case.get("status") == "fail":
            failed.append(name)
        elif case.find("skipped") is not None or case.get("status") in ("notrun", "disabled"):
            skipped.append(name)
        else:
            passed.append(name)
    for name in failed:
        print(f"FAILED: {name}")
    for name in skipped:
        print(f"SKIPPED: {name}")
    if not os.environ.get("CUTPROOF_MESHES"):
        print("SKIPPED: tests on outside meshes (CUTPROOF_MESHES is not set)")
    print("NOT RUN: gpu (no kernels yet; see CHANGELOG.md)")
    if not passed and not failed:
        print("no test was run")
    wrong = bool(failed) or not passed or status != 0
    print(f"{len(passed)} passed, {len(failed) if failed or not wrong else 1} failed, {len(skipped)} skipped")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
