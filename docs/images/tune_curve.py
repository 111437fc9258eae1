#!/usr/bin/env python3
"""Draws what configurations cost against their error, from the JSON of `cutproof tune --full`.

Usage: docs/images/tune_curve.py TUNE.json [--before OLDER.json] -o F.svg
"""
import argparse
import json
import math

from log_axes import TOP, LogAxes

PLAIN, ACCELERATED, MARK = "#1b6ca8", "#c1572b", "#3c8d40"


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


def picture(document, before=None):
    points = points_of(document)
    front_before = front_of(points_of(before)) if before else []
    xs = [p[0] for p in points + front_before]
    ys = [p[1] for p in points + front_before] + [document["tolerance_h"]]
    # Half decades: a whole one leaves the picture empty.
    x0, x1 = math.floor(2 * math.log10(min(xs))) / 2, math.ceil(2 * math.log10(max(xs))) / 2
    y0, y1 = math.floor(2 * math.log10(min(ys))) / 2, math.ceil(2 * math.log10(max(ys))) / 2
    axes = LogAxes((x0, x1), (y0, y1), title_of(document))
    px, py, right, parts = axes.px, axes.py, axes.right, axes.parts

    def ticks(low, high):
        return [m * 10.0**e for e in range(math.floor(low), math.ceil(high) + 1) for m in (1, 2, 5)
                if low - 1e-9 <= math.log10(m * 10.0**e) <= high + 1e-9]

    axes.ticks(ticks(x0, x1), ticks(y0, y1))
    axes.labels("ms a frame", "greatest RMS error [h]")
    axes.tolerance(document["tolerance_h"])
    axes.text(right + 6, py(document["tolerance_h"]) + 4, f"tolerance {document['tolerance_h']:g} h")

    for front, dashes in [(front_before, 'stroke-dasharray="5 3"'), (front_of(points), "")]:
        if not front:
            continue
        corners = " ".join(f"{px(x):.1f},{py(y):.1f}" for x, y, _ in front)
        parts.append(f'<polyline points="{corners}" fill="none" stroke="#999" stroke-width="1.5" {dashes}/>')
    for x, y, trial in points:
        colour = PLAIN if trial["acceleration"] == "none" else ACCELERATED
        fill = "white" if trial["outcome"] == "topology" else colour
        parts.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="4" fill="{fill}" stroke="{colour}"/>')
    marks = [(points[0], "as given")]
    if document["found"] and document["found"]["trial"] != 0:
        found = document["trials"][document["found"]["trial"]]
        marks.append(((1e3 * found["seconds_per_frame"]["median"], found["rms_h"], found), "found"))
    for (x, y, trial), name in marks:
        parts.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="8" fill="none" stroke="{MARK}" stroke-width="2"/>')
        axes.text(px(x) + 11, py(y) + 4, f"{name}: {trial['substeps']} × {trial['iterations']}", extra=f'fill="{MARK}" stroke="white" stroke-width="4" paint-order="stroke"')
    for k, (what, colour, fill) in enumerate(
        [("none", PLAIN, PLAIN), ("chebyshev", ACCELERATED, ACCELERATED), ("other parts", PLAIN, "white")]
    ):
        y = TOP + 14 + 20 * k
        parts.append(f'<circle cx="{right + 14}" cy="{y}" r="4" fill="{fill}" stroke="{colour}"/>')
        axes.text(right + 24, y + 4, what)
    axes.text(right + 8, TOP + 14 + 60, "grey: none is both")
    axes.text(right + 8, TOP + 14 + 76, "cheaper and nearer")
    if before:
        axes.text(right + 8, axes.bottom - 20, "dashed: the grey line")
        axes.text(right + 8, axes.bottom - 4, f"at {before['commit']}")
    return axes.svg()


def title_of(document):
    name = document["scene"].rsplit("/", 1)[-1].removesuffix(".json")
    kind = {"limit": "the limit of short time steps", "substeps": "its own substeps, converged"}[(document.get("reference") or document["answer"])["kind"]]
    return f"{name}, {document['backend']}: error from {kind}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("json")
    parser.add_argument("--before", help="of an older state, of which the front is drawn too")
    parser.add_argument("-o", "--output", required=True)
    arguments = parser.parse_args()
    documents = []
    for path in filter(None, [arguments.json, arguments.before]):
        with open(path, encoding="utf-8") as file:
            documents.append(json.load(file))
        if not points_of(documents[-1]):
            parser.error(f"{path}: nothing in it was carried through")
    with open(arguments.output, "w", encoding="utf-8") as file:
        file.write(picture(*documents))


if __name__ == "__main__":
    main()
