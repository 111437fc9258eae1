#!/usr/bin/env python3
"""Draws error against cost for several scenes side by side, from the JSON of `cutproof tune --full`.

Usage: docs/images/fronts.py TUNE.json... -o F.svg
"""
import argparse
import json
import math
from html import escape

from tune_curve import ACCELERATED, MARK, PLAIN, front_of, points_of

COLUMNS, WIDTH, HEIGHT = 2, 420, 250
LEFT, RIGHT, TOP, BOTTOM = 58, 14, 30, 42
TOLERANCES = (0.5, 0.2, 0.05, 0.01)


def panel(document, x_range, y_range):
    """One scene: plain and accelerated configurations, what none beats in both, the scene as given."""
    parts = []
    px = lambda ms: LEFT + (math.log10(ms) - x_range[0]) / (x_range[1] - x_range[0]) * (WIDTH - LEFT - RIGHT)
    py = lambda h: HEIGHT - BOTTOM - (math.log10(h) - y_range[0]) / (y_range[1] - y_range[0]) * (HEIGHT - TOP - BOTTOM)
    def text(x, y, what, anchor="start", extra=""):
        parts.append(f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {extra}>{escape(what)}</text>')
    name = document["scene"].rsplit("/", 1)[-1].removesuffix(".json")
    text(LEFT, 18, name, extra='font-size="14"')
    for ms in (0.1, 0.2, 0.5, 1, 2, 5):
        if not x_range[0] <= math.log10(ms) <= x_range[1]:
            continue
        parts.append(f'<line x1="{px(ms):.1f}" y1="{TOP}" x2="{px(ms):.1f}" y2="{HEIGHT - BOTTOM}" stroke="#e6e6e6"/>')
        text(px(ms), HEIGHT - BOTTOM + 16, f"{ms:g}", "middle")
    for h in (0.001, 0.01, 0.1, 1, 10):
        if not y_range[0] <= math.log10(h) <= y_range[1]:
            continue
        parts.append(f'<line x1="{LEFT}" y1="{py(h):.1f}" x2="{WIDTH - RIGHT}" y2="{py(h):.1f}" stroke="#e6e6e6"/>')
        text(LEFT - 6, py(h) + 4, f"{h:g}", "end")
    for h in TOLERANCES:
        parts.append(f'<line x1="{LEFT}" y1="{py(h):.1f}" x2="{WIDTH - RIGHT}" y2="{py(h):.1f}" '
                     'stroke="#777" stroke-dasharray="2 4"/>')
    inside = [p for p in points_of(document)
              if x_range[0] <= math.log10(p[0]) <= x_range[1] and y_range[0] <= math.log10(p[1]) <= y_range[1]]
    corners = " ".join(f"{px(x):.1f},{py(y):.1f}" for x, y, _ in front_of([p for p in inside if p[2]["outcome"] != "topology"]))
    parts.append(f'<polyline points="{corners}" fill="none" stroke="#999" stroke-width="1.5"/>')
    for x, y, trial in inside:
        colour = PLAIN if trial["acceleration"] == "none" else ACCELERATED
        fill = "white" if trial["outcome"] == "topology" else colour
        parts.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="3" fill="{fill}" stroke="{colour}"/>')
    x, y, _ = points_of(document)[0]
    parts.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="7" fill="none" stroke="{MARK}" stroke-width="2"/>')
    text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 8, "ms a frame", "middle")
    middle = (TOP + HEIGHT - BOTTOM) / 2
    text(14, middle, "greatest RMS error [h]", "middle", f'transform="rotate(-90 14 {middle:.0f})"')
    return parts


def picture(documents):
    rows = math.ceil(len(documents) / COLUMNS)
    width, height = COLUMNS * WIDTH, rows * HEIGHT + 30
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        'font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for k, document in enumerate(documents):
        parts.append(f'<g transform="translate({k % COLUMNS * WIDTH} {k // COLUMNS * HEIGHT})">')
        parts += panel(document, (-1.0, 0.7), (-3.3, 1.0))
        parts.append("</g>")
    y = height - 12
    for k, (what, colour, fill) in enumerate([("plain", PLAIN, PLAIN), ("chebyshev", ACCELERATED, ACCELERATED),
                                              ("other parts", PLAIN, "white"), ("as given", MARK, "white")]):
        parts.append(f'<circle cx="{LEFT + 110 * k}" cy="{y - 4}" r="4" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>')
        parts.append(f'<text x="{LEFT + 110 * k + 10}" y="{y}">{what}</text>')
    parts.append(f'<text x="{LEFT + 430}" y="{y}">grey: none beats these in both; dotted: 0.5, 0.2, 0.05, 0.01 h</text>')
    return "\n".join(parts + ["</svg>"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("json", nargs="+")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    documents = []
    for path in arguments.json:
        with open(path, encoding="utf-8") as file:
            documents.append(json.load(file))
        if not points_of(documents[-1]):
            parser.error(f"{path}: nothing in it was carried through")
    with open(arguments.output, "w", encoding="utf-8") as file:
        file.write(picture(documents))


if __name__ == "__main__":
    main()
