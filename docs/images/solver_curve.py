#!/usr/bin/env python3
"""Draws error against time, or against iterations, from the JSON of `cutproof bench solver`.

Usage: docs/images/solver_curve.py BENCH.json -o F.svg [--scene block] [--substeps 1] [--x seconds|iterations]
"""
import argparse
import json
import math
import sys
from html import escape

COLOURS = ["#1b6ca8", "#c1572b", "#3c8d40", "#7b4ea3", "#8a6d1f"]
WIDTH, HEIGHT = 760, 470
LEFT, RIGHT, TOP, BOTTOM = 70, 190, 40, 50


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
    (x0, x1), (y0, y1) = decades(xs), decades(ys)
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM

    def px(value):
        return LEFT + (math.log10(value) - x0) / (x1 - x0) * (right - LEFT)

    def py(value):
        return bottom - (math.log10(value) - y0) / (y1 - y0) * (bottom - TOP)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        f'<text x="{LEFT}" y="24" font-size="15">{escape(title)}</text>',
    ]

    def line(a, b, c, d, style):
        parts.append(f'<line x1="{a:.1f}" y1="{b:.1f}" x2="{c:.1f}" y2="{d:.1f}" {style}/>')

    for e in range(x0, x1 + 1):
        line(px(10.0**e), TOP, px(10.0**e), bottom, 'stroke="#dddddd"')
        parts.append(f'<text x="{px(10.0**e):.1f}" y="{bottom + 18}" text-anchor="middle">{10.0**e:g}</text>')
    for e in range(y0, y1 + 1):
        line(LEFT, py(10.0**e), right, py(10.0**e), 'stroke="#dddddd"')
        parts.append(f'<text x="{LEFT - 8}" y="{py(10.0**e) + 4:.1f}" text-anchor="end">1e{e}</text>')
    line(LEFT, py(tolerance), right, py(tolerance), 'stroke="#444444" stroke-dasharray="2 3"')
    parts.append(f'<text x="{(LEFT + right) / 2}" y="{HEIGHT - 12}" text-anchor="middle">{escape(x_label)}</text>')
    parts.append(f'<text x="18" y="{(TOP + bottom) / 2}" text-anchor="middle" '
                 f'transform="rotate(-90 18 {(TOP + bottom) / 2})">greatest error [h]</text>')
    stiffnesses = sorted({k for k, _, _ in found})
    for n, (stiffness, acceleration, points) in enumerate(found):
        colour = COLOURS[stiffnesses.index(stiffness) % len(COLOURS)]
        dash = ' stroke-dasharray="6 4"' if acceleration == "none" else ""
        path = " ".join(f"{px(a):.1f},{py(b):.1f}" for a, b in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>')
        row = TOP + 14 + 20 * n
        line(right + 12, row - 4, right + 42, row - 4, f'stroke="{colour}" stroke-width="2"{dash}')
        parts.append(f'<text x="{right + 48}" y="{row}">k = {stiffness:.0e}, {acceleration}</text>')
    parts.append("</svg>")
    return "\n".join(parts) + "\n"


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
    device = document["device"].split(",")[0]
    title = f"{options.scene}: {document['backend']}, {document['precision']} precision, {device}"
    label = "time of a step [ms]" if options.x == "seconds" else "iterations of a substep"
    with open(options.output, "w", encoding="utf-8") as file:
        file.write(picture(found, title, label, document["tolerance_h"]))


if __name__ == "__main__":
    main()
