#!/usr/bin/env python3
"""Draws how far each number of substeps is from half as many, from the JSON of `cutproof tune --reference limit`.

Usage: docs/images/refinement.py TUNE.json... -o F.svg

Solid: scenes with retardation. Dashed: without.
"""
import argparse
import json

from log_axes import TOP, LogAxes

COLOURS = ["#1b6ca8", "#c1572b", "#3c8d40", "#7b4ea3", "#8a6d1f", "#5c6770"]


def curve(path):
    """Scene, whether it has retardation, and [(substeps, distance)]."""
    with open(path, encoding="utf-8") as file:
        document = json.load(file)
    scene = document["scene"].rsplit("/", 1)[-1].removesuffix(".json")
    levels = (document.get("reference") or document["answer"])["levels"]
    points = [(level["substeps"], level["apart_h"]) for level in levels if isinstance(level["apart_h"], float)]
    return scene, "retardation" in document.get("again", ""), points


def picture(curves):
    axes = LogAxes((1.7, 2.8), (-3.7, 0.1), "Distance from half as many substeps; dashed: without retardation, solid: 4 ms")
    axes.ticks((64, 128, 256, 512), (0.001, 0.01, 0.1, 1))
    axes.labels("substeps a frame of 16 ms", "greatest RMS distance [h]")
    scenes = sorted({scene for scene, _, _ in curves})
    for scene, retarded, points in curves:
        colour = COLOURS[scenes.index(scene)]
        dash = "" if retarded else ' stroke-dasharray="6 4"'
        path = " ".join(f"{axes.px(x):.1f},{axes.py(y):.1f}" for x, y in points)
        axes.parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>')
        for x, y in points:
            axes.parts.append(f'<circle cx="{axes.px(x):.1f}" cy="{axes.py(y):.1f}" r="3" fill="{colour}"/>')
    for row, scene in enumerate(scenes):
        y = TOP + 14 + 20 * row
        axes.line(axes.right + 12, y - 4, axes.right + 42, y - 4, f'stroke="{COLOURS[row]}" stroke-width="2"')
        axes.text(axes.right + 48, y, scene)
    axes.line(axes.px(64), axes.py(0.0014), axes.px(256), axes.py(0.00035), 'stroke="#555555" stroke-width="1"')
    axes.text(axes.px(64), axes.py(0.0014) + 36, "first order", extra='fill="#555555"')
    return axes.svg()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tune", nargs="+")
    parser.add_argument("-o", dest="output", required=True)
    options = parser.parse_args()
    with open(options.output, "w", encoding="utf-8") as file:
        file.write(picture([curve(path) for path in options.tune]))


if __name__ == "__main__":
    main()
