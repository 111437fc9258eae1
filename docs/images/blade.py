#!/usr/bin/env python3
"""Draws the blade of a scene where its first stroke begins: its length, its depth, along and back, and its path.

Usage: docs/images/blade.py SCENE.json -o F.svg

The body is a cylinder along x, and the edge keeps its direction.
"""
import argparse
import json
import math
from html import escape

WIDTH, HEIGHT, SCALE = 660, 510, 3000  # pixels per metre
X, Y, Z, ORIGIN = (1.0, 0.16), (0.62, -0.34), (0.0, -1.0), (150, 420)
BODY, STEEL, PATH, TEXT = "#d9a184", "#9fb4c8", "#8f2f05", "#222222"


class Drawing:
    def __init__(self):
        self.parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
                      'font-size="15">',
                      f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>']
        for colour in (PATH, TEXT):
            self.parts.append(f'<marker id="head{colour[1:]}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="7" '
                              'markerHeight="7" orient="auto-start-reverse">'
                              f'<path d="M0 0 L10 5 L0 10 z" fill="{colour}"/></marker>')

    def at(self, p):
        return [ORIGIN[k] + SCALE * (p[0] * X[k] + p[1] * Y[k] + p[2] * Z[k]) for k in (0, 1)]

    def shape(self, points, style, closed=True):
        path = "M" + " L".join(f"{x:.1f} {y:.1f}" for x, y in map(self.at, points)) + (" z" if closed else "")
        self.parts.append(f'<path d="{path}" {style}/>')

    def arrow(self, a, b, colour, both=False):
        head = f'url(#head{colour[1:]})'
        start = f' marker-start="{head}"' if both else ""
        self.shape([a, b], f'fill="none" stroke="{colour}" stroke-width="2"{start} marker-end="{head}"', False)

    def text(self, p, what, dx=0, dy=0, anchor="start", colour=TEXT):
        x, y = self.at(p)
        self.parts.append(f'<text x="{x + dx:.1f}" y="{y + dy:.1f}" text-anchor="{anchor}" fill="{colour}">{escape(what)}'
                          '</text>')


def vector(numbers):
    return "[" + ", ".join(f"{x:g}" for x in numbers) + "]"


def picture(scene):
    shape, blade = scene["body"]["shape"], scene["blade"]
    stroke = blade["strokes"][0]
    assert shape["kind"] == "cylinder" and shape["along"] == [1, 0, 0], "the body is no cylinder along x"
    r, extent = shape["radius"], (shape["length"], 2 * shape["radius"], 2 * shape["radius"])
    metric = lambda p: [c * e for c, e in zip(p, extent)]  # noqa: E731
    unit = lambda v: [c / math.hypot(*v) for c in v]  # noqa: E731
    plus = lambda p, v, s: [a + s * b for a, b in zip(p, v)]  # noqa: E731
    along, back = unit(stroke["along"]), unit(stroke["back"])
    width = lambda v: sum(abs(c) * e for c, e in zip(v, extent))  # noqa: E731
    length, depth = blade["length"] * width(along), blade["depth"] * width(back)
    start, end = (metric(p) for p in stroke["points"])

    d = Drawing()
    # The box of the coordinates: what is behind, the body, what is before.
    corner = lambda i, j, k: metric((i, j, k))  # noqa: E731
    grey = 'stroke="#999999" stroke-dasharray="4 4" fill="none"'
    for a, b in ((0, 1, 0), (1, 1, 0)), ((0, 1, 0), (0, 1, 1)), ((0, 0, 0), (0, 1, 0)):
        d.shape([corner(*a), corner(*b)], grey, False)
    ring = lambda x, a: (x, r + r * math.cos(a), r + r * math.sin(a))  # noqa: E731
    angles = [k * math.pi / 60 for k in range(120)]
    # The silhouette: where the projected circle is farthest from the axis.
    across = max(angles, key=lambda a: (lambda p: -X[1] * p[0] + X[0] * p[1])(d.at(ring(0, a))))
    around = [across + k * math.pi / 60 for k in range(61)]
    style = f'fill="{BODY}" fill-opacity="0.75" stroke="#8a5a40"'
    other = [a + math.pi for a in around]
    d.shape([ring(0, a) for a in other] + [ring(extent[0], a) for a in around], style)
    d.shape([ring(0, a) for a in angles], style)
    for a, b in (((0, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 0, 1)), ((0, 0, 1), (1, 0, 1)), ((1, 0, 0), (1, 0, 1)),
                 ((0, 0, 1), (0, 1, 1)), ((0, 1, 1), (1, 1, 1)), ((1, 0, 1), (1, 1, 1)), ((1, 0, 0), (1, 1, 0)),
                 ((1, 1, 0), (1, 1, 1))):
        d.shape([corner(*a), corner(*b)], grey, False)

    ends = [plus(start, along, side * length / 2) for side in (-1, 1)]
    backs = [plus(p, back, depth) for p in ends]
    d.shape([ends[0], ends[1], backs[1], backs[0]], f'fill="{STEEL}" fill-opacity="0.55" stroke="#4c5c6c"')
    d.shape(ends, 'stroke="#222222" stroke-width="4" fill="none"', False)
    last = [plus(end, along, side * length / 2) for side in (-1, 1)]
    d.shape(last, 'stroke="#222222" stroke-width="2" stroke-dasharray="6 4" fill="none"', False)
    d.arrow(start, end, PATH)

    d.arrow(plus(backs[0], back, 0.006), plus(backs[1], back, 0.006), TEXT, True)
    d.text(plus(start, back, depth + 0.006), f"length: {blade['length']:g} extents along the edge", -24, -14, "end")
    beside = plus(ends[0], (1, 0, 0), -0.006)
    d.arrow(beside, plus(beside, back, depth), TEXT, True)
    d.text(plus(beside, back, depth / 2), f"depth: {blade['depth']:g} extents", -10, -24, "end")
    d.text(plus(beside, back, depth / 2), "along back", -10, -5, "end")
    d.arrow(start, plus(start, back, 0.035), PATH)
    d.text(plus(start, back, 0.035), f"back {vector(stroke['back'])}", 8, 14, colour=PATH)
    d.arrow(start, plus(start, along, 0.035), PATH)
    d.text(plus(start, along, 0.035), f"along {vector(stroke['along'])}", 8, 12, colour=PATH)
    d.text(start, f"from {vector(stroke['points'][0])}", 14, 24, colour=PATH)
    d.text(end, f"to {vector(stroke['points'][1])}", 12, 20, colour=PATH)
    d.text(ends[1], "the cutting edge", 10, 6)
    d.text(last[0], "the edge when the stroke ends", -8, 20, "middle")
    d.text(corner(0, 0, 0), "[0, 0, 0]", -8, 14, "end", "#666666")
    d.text(corner(1, 1, 1), "[1, 1, 1]", 8, 0, colour="#666666")
    for axis, name in ((0, "x"), (1, "y"), (2, "z")):
        p = [0, 0, 0]
        p[axis] = 0.5
        d.text(metric(p), name, *((-60, 12), (14, 2), (-14, 4))[axis], colour="#666666")
    return "\n".join([*d.parts, "</svg>\n"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", dest="output", required=True)
    options = parser.parse_args()
    with open(options.scene, encoding="utf-8") as file:
        scene = json.load(file)
    with open(options.output, "w", encoding="utf-8") as file:
        file.write(picture(scene))


if __name__ == "__main__":
    main()
