#!/usr/bin/env python3
"""Prints skipped and omitted tests, kernels that no device has run yet, and in the last line the counts.

Usage: count_tests.py REPORT STATUS GPU

REPORT is CTest's JUnit file, STATUS CTest's exit status, GPU the text of `cutproof info` about the backend gpu. Exits 1 if a
test failed or none ran.
"""
import os
import pathlib
import re
import subprocess
import sys
import xml.etree.ElementTree as tree

RESULTS = pathlib.Path(__file__).resolve().parent.parent / "docs" / "results"
ON_A_DEVICE = re.compile(r'"device": ?"NVIDIA')
COMMIT = re.compile(r'"commit": ?"([0-9a-f]+)"')


def kernels_since_the_last_run():
    """Kernel sources that differ from those of the newest commit with a stored run on a device."""
    def git(*arguments):
        return subprocess.run(["git", "-C", RESULTS, *arguments], capture_output=True, text=True).stdout.split()

    texts = (file.read_text() for file in RESULTS.glob("*.json"))
    stored = {commit for text in texts if ON_A_DEVICE.search(text) for commit in COMMIT.findall(text)}
    newest = next((commit for commit in git("rev-list", "HEAD") if any(commit.startswith(short) for short in stored)), None)
    if newest is None:
        return "no stored run on a device is of a commit that is known here"
    changed = git("diff", "--name-only", newest, "--", ":/gpu", ":(top,exclude)gpu/host")
    since = f"kernel sources changed since {newest[:12]}, the last stored run on a device"
    return f"{len(changed)} {since}: {' '.join(changed)}" if changed else f"no {since}"


def main():
    report, status, gpu = sys.argv[1], int(sys.argv[2]), " ".join(sys.argv[3].split())
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
    suites = {}
    for name in skipped:
        suite = name.split(".")[0]
        suites[suite] = suites.get(suite, 0) + 1
    for suite, count in suites.items():
        print(f"SKIPPED: {count} tests of {suite}")
    if not os.environ.get("CUTPROOF_MESHES"):
        print("SKIPPED: tests on outside meshes (CUTPROOF_MESHES is not set)")
    if "not built" in gpu or "none" in gpu:
        print(f"NOT RUN: the backend gpu ({gpu}); ci/gpu_kit.sh packs its tests for a machine that has a GPU")
    print(f"KERNELS: {kernels_since_the_last_run()}")
    if not passed and not failed:
        print("no test was run")
    wrong = bool(failed) or not passed or status != 0
    print(f"{len(passed)} passed, {len(failed) if failed or not wrong else 1} failed, {len(skipped)} skipped")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
