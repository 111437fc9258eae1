#!/usr/bin/env python3
"""Draws what bars have over what their material asks, by thickness, from results/h200_material.json.

Usage: docs/images/material.py MATERIAL.json -o F.svg
"""
import argparse
import json

from log_axes import TOP, LogAxes

TESTS = {"twisted": "#c1572b", "swinging across": "#1b6ca8", "hanging": "#3c8d40"}
NAMES = {"twisted": "G, twisted", "swinging across": "E, bent", "hanging": "E, hanging"}


def picture(rows):
    axes = LogAxes((0.8, 1.37), (-0.02, 0.11), "Measured over asked, bars of material, one H200")
    axes.ticks((7, 11, 21), (1, 1.05, 1.1, 1.2))
    axes.labels("nodes across", "measured / asked")
    axes.tolerance(1)
    place = 0
    for test, colour in TESTS.items():
        for nu, dash in ((0.45, ""), (0, ' stroke-dasharray="5 3"')):
            for side in (2, 1):
                points = [(row["across"], row["measured"] / row["asked"]) for row in rows
                          if row["test"] == test and row["quantity"] in "EG" and row["iterations"] is None
                          and row["poisson_ratio"] == nu and row["side"] == side]
                style = f'stroke="{colour}" stroke-width="{2.5 if side == 2 else 1.2}"{dash}'
                line = " ".join(f"{axes.px(x):.1f},{axes.py(y):.1f}" for x, y in sorted(points))
                axes.parts.append(f'<polyline points="{line}" fill="none" {style}/>')
                y = TOP + 14 + 20 * place
                axes.line(axes.right + 12, y - 4, axes.right + 42, y - 4, style)
                axes.text(axes.right + 48, y, f"{NAMES[test]}, ν = {nu:g}, side {side}")
                place += 1
    return axes.svg()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("material")
    parser.add_argument("-o", dest="output", required=True)
    options = parser.parse_args()
    with open(options.material, encoding="utf-8") as file:
        rows = json.load(file)["rows"]
    with open(options.output, "w", encoding="utf-8") as file:
        file.write(picture(rows))


if __name__ == "__main__":
    main()
