#!/usr/bin/env python3
"""Draws error against time, or against iterations, from the JSON of `cutproof bench solver`.

Usage: docs/images/solver_curve.py BENCH.json -o F.svg [--scene block] [--substeps 1] [--x seconds|iterations]
"""
import argparse
import json
import math
import sys

from log_axes import TOP, LogAxes

COLOURS = ["#1b6ca8", "#c1572b", "#3c8d40", "#7b4ea3", "#8a6d1f"]


def curves(document, scene, substeps, x):
    """[(stiffness, acceleration, [(x, error)])] of positive errors."""
    found = []
    for entry in document["scenes"]:
        if entry["scene"] != scene or entry["substeps"] != substeps:
            continue
        for acceleration in ("none", "chebyshev"):
            points = [
                (1e3 * row["seconds"]["median"] if x == "seconds" else row["iterations"], row["max_h"])
                for row in entry["rows"]
                if row["acceleration"] == acceleration and not isinstance(row["max_h"], str) and row["max_h"] > 0
            ]
            found.append((entry["stiffness"], acceleration, sorted(points)))
    return found


def decades(values):
    return math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))


def picture(found, title, x_label, tolerance):
    xs = [p[0] for _, _, points in found for p in points]
    ys = [p[1] for _, _, points in found for p in points] + [tolerance]
    axes = LogAxes(decades(xs), decades(ys), title)
    powers = lambda ends: [10.0**e for e in range(ends[0], ends[1] + 1)]
    axes.ticks(powers(axes.x), powers(axes.y), y_name=lambda value: f"1e{round(math.log10(value))}")
    axes.tolerance(tolerance)
    axes.labels(x_label, "greatest error [h]")
    stiffnesses = sorted({k for k, _, _ in found})
    for n, (stiffness, acceleration, points) in enumerate(found):
        colour = COLOURS[stiffnesses.index(stiffness) % len(COLOURS)]
        dash = ' stroke-dasharray="6 4"' if acceleration == "none" else ""
        path = " ".join(f"{axes.px(a):.1f},{axes.py(b):.1f}" for a, b in points)
        axes.parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>')
        row = TOP + 14 + 20 * n
        axes.line(axes.right + 12, row - 4, axes.right + 42, row - 4, f'stroke="{colour}" stroke-width="2"{dash}')
        axes.text(axes.right + 48, row, f"k = {stiffness:.0e}, {acceleration}")
    return axes.svg()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bench")
    parser.add_argument("-o", dest="output", required=True)
    parser.add_argument("--scene", default="block")
    parser.add_argument("--substeps", type=int, default=1)
    parser.add_argument("--x", choices=["seconds", "iterations"], default="seconds")
    options = parser.parse_args()
    with open(options.bench, encoding="utf-8") as file:
        document = json.load(file)
    if document.get("suite") != "solver":
        sys.exit(f"{options.bench}: this is not what `cutproof bench solver --json` writes")
    found = curves(document, options.scene, options.substeps, options.x)
    if not any(points for _, _, points in found):
        sys.exit(f"{options.bench}: no rows of scene '{options.scene}' with {options.substeps} substeps")
    title = f"{options.scene}: {document['backend']}, {document['precision']} precision"
    label = "iterations of a substep"
    if options.x == "seconds":  # errors are the same on every machine
        title += f", {document['device'].split(',')[0]}"
        label = "time of a step [ms]"
    with open(options.output, "w", encoding="utf-8") as file:
        file.write(picture(found, title, label, document["tolerance_h"]))


if __name__ == "__main__":
    main()
