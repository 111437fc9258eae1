#!/usr/bin/env python3
"""Draws error against cost for several scenes side by side, from the JSON of `cutproof tune --full`.

Usage: docs/images/fronts.py TUNE.json... -o F.svg
"""
import argparse
import json
import math

from log_axes import HEIGHT, LEFT, WIDTH, LogAxes

PLAIN, ACCELERATED, MARK = "#1b6ca8", "#c1572b", "#3c8d40"
COLUMNS = 2
TOLERANCES = (0.5, 0.2, 0.05, 0.01)
# Exponents of ten, and ticks: the same in every panel of a picture.
X = {"gpu": ((-1.0, 0.7), (0.1, 0.2, 0.5, 1, 2, 5)), "host": ((-0.2, 1.7), (1, 2, 5, 10, 20, 50))}
Y = (-3.3, 1.0)
LEGEND = 40


def points_of(document):
    """[(milliseconds, error, trial)] of what was carried through."""
    return [
        (1e3 * t["seconds_per_frame"]["median"], t["rms_h"], t)
        for t in document["trials"]
        if t["seconds_per_frame"] and not isinstance(t["rms_h"], str) and t["rms_h"] > 0
    ]


def front_of(points):
    """Those than which none is both cheaper and more accurate."""
    front, best = [], math.inf
    for point in sorted(points, key=lambda p: (p[0], p[1])):
        if point[1] < best:
            front.append(point)
            best = point[1]
    return front


def panel(document):
    """One scene: plain and accelerated configurations, what none beats in both, the scene as given."""
    span, ticks = X[document["backend"]]
    axes = LogAxes(span, Y, document["scene"].rsplit("/", 1)[-1].removesuffix(".json"), beside=30)
    axes.ticks(ticks, (0.001, 0.01, 0.1, 1, 10))
    axes.labels("ms a frame", "greatest RMS error [h]")
    for tolerance in TOLERANCES:
        axes.tolerance(tolerance)
    points = points_of(document)
    inside = [p for p in points if span[0] <= math.log10(p[0]) <= span[1] and Y[0] <= math.log10(p[1]) <= Y[1]]
    front = front_of([p for p in inside if p[2]["outcome"] != "topology"])
    corners = " ".join(f"{axes.px(x):.1f},{axes.py(y):.1f}" for x, y, _ in front)
    axes.parts.append(f'<polyline points="{corners}" fill="none" stroke="#999" stroke-width="2"/>')
    for x, y, trial in inside:
        colour = PLAIN if trial["acceleration"] == "none" else ACCELERATED
        fill = "white" if trial["outcome"] == "topology" else colour
        axes.parts.append(f'<circle cx="{axes.px(x):.1f}" cy="{axes.py(y):.1f}" r="5" fill="{fill}" stroke="{colour}"/>')
    x, y, _ = points[0]
    axes.parts.append(f'<circle cx="{axes.px(x):.1f}" cy="{axes.py(y):.1f}" r="11" fill="none" stroke="{MARK}" '
                      'stroke-width="3"/>')
    return axes.svg()


def picture(documents):
    width, rows = COLUMNS * WIDTH, math.ceil(len(documents) / COLUMNS)
    height = rows * HEIGHT + LEGEND
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
             'font-size="20">', f'<rect width="{width}" height="{height}" fill="white"/>']
    for k, document in enumerate(documents):
        place = f'x="{k % COLUMNS * WIDTH}" y="{k // COLUMNS * HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        parts.append(panel(document).replace("<svg ", f"<svg {place} ", 1).replace('font-size="13"', 'font-size="17"')
                     .replace('font-size="15"', 'font-size="21"'))
    y = height - 12
    for k, (what, colour, fill) in enumerate([("plain", PLAIN, PLAIN), ("chebyshev", ACCELERATED, ACCELERATED),
                                              ("other parts", PLAIN, "white"), ("as given", MARK, "white")]):
        x = LEFT + 180 * k
        parts.append(f'<circle cx="{x}" cy="{y - 6}" r="7" fill="{fill}" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{x + 16}" y="{y}">{what}</text>')
    parts.append(f'<text x="{LEFT + 740}" y="{y}">grey: none beats these in both; dashed: 0.5, 0.2, 0.05, 0.01 h</text>')
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
        if documents[-1]["backend"] not in X:
            parser.error(f"{path}: its backend is {documents[-1]['backend']}, and axes are known of {', '.join(X)}")
        if not points_of(documents[-1]):
            parser.error(f"{path}: nothing in it was carried through")
    with open(arguments.output, "w", encoding="utf-8") as file:
        file.write(picture(documents))


if __name__ == "__main__":
    main()
