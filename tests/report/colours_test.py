#!/usr/bin/env python3
"""Colours of the report pages under simulated protanopia and deuteranopia: how far apart those of a palette are (CIE76
in CIELAB). Simulation: G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, IEEE TVCG 15(6), 2009, severity 1.
Usage: colours_test.py report/page/colours.js report/page/page.css report/page/tissue.js"""
import itertools
import math
import pathlib
import re
import sys

script, style, drawing = (pathlib.Path(name).read_text() for name in sys.argv[1:4])
SEEN = {
    "as it is": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
}


def linear(colour):
    return [(x / 255 / 12.92 if x <= 0.04045 * 255 else ((x / 255 + 0.055) / 1.055) ** 2.4)
            for x in (int(colour[k:k + 2], 16) for k in (1, 3, 5))]


def lab(colour, matrix):
    r, g, b = (min(max(sum(row[k] * x for k, x in enumerate(linear(colour))), 0), 1) for row in matrix)
    xyz = ((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505, 0.2126 * r + 0.7152 * g + 0.0722 * b,
           (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089)
    f = [x ** (1 / 3) if x > 0.008856 else 7.787 * x + 16 / 116 for x in xyz]
    return 116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])


def palette(name):
    found = re.search(rf"const {name} = \[([^\]]*)\]", script)
    assert found, f"there is no {name}"
    colours = re.findall(r"#[0-9a-fA-F]{6}", found[1])
    assert len(colours) > 2, f"{name} holds {len(colours)} colours"
    return colours


def lines(mode):
    block = style if mode == "light" else style.split("prefers-color-scheme: dark")[1]
    return [re.search(rf"--s{k}: (#[0-9a-f]{{6}})", block)[1] for k in range(4)]


# What two colours of a list that are told apart by nothing else must have between them; a difference of 10 is seen at a
# glance. Lines of plots differ in their dashes as well.
LEAST = {"kOkabeIto": 10, "kChanges": 10, "kClusters": 10}
for name, least in LEAST.items():
    for kind, matrix in SEEN.items():
        nearest = min((math.dist(lab(a, matrix), lab(b, matrix)), a, b)
                      for a, b in itertools.combinations(palette(name), 2))
        print(f"{name}, {kind}: nearest {nearest[0]:.1f} ({nearest[1]}, {nearest[2]})")
        assert nearest[0] >= least, f"{name}, {kind}: {nearest}"
for mode in ("light", "dark"):
    for kind, matrix in SEEN.items():
        nearest = min(math.dist(lab(a, matrix), lab(b, matrix)) for a, b in itertools.combinations(lines(mode), 2))
        print(f"lines, {mode}, {kind}: nearest {nearest:.1f}")
        assert nearest >= 10, (mode, kind, nearest)
# A ramp must grow lighter all the way, and stand out from the view's ground, however colours are seen.
for kind, matrix in SEEN.items():
    light = [lab(colour, matrix)[0] for colour in palette("kRamp")]
    assert all(b - a > 5 for a, b in zip(light, light[1:])), (kind, light)
    for mode, block in (("light", style), ("dark", style.split("prefers-color-scheme: dark")[1])):
        ground = lab(re.search(r"--view: (#[0-9a-f]{6})", block)[1], matrix)
        nearest = min(math.dist(ground, lab(colour, matrix)) for colour in palette("kRamp"))
        print(f"ramp on {mode}, {kind}: nearest {nearest:.1f}")
        assert nearest >= 30, (mode, kind, nearest)
# What is marked stands out from what it lies on.
def triple(source, name):
    found = re.search(rf"{name} = (?:packed\()?\[(\d+), (\d+), (\d+)\]", source)
    assert found, f"there is no {name}"
    return "#%02x%02x%02x" % tuple(int(x) for x in found.groups())


marked, tissue = triple(drawing, "kMarked"), triple(script, "kTissue")
for kind, matrix in SEEN.items():
    apart = math.dist(lab(marked, matrix), lab(tissue, matrix))
    print(f"marked beside tissue, {kind}: {apart:.1f}")
    assert apart >= 20, (kind, apart)
# Nor is it taken for a cluster, or for what else is marked.
for kind, matrix in SEEN.items():
    for name, other in [("kMember", triple(drawing, "kMember"))] + [("kClusters", one) for one in palette("kClusters")]:
        apart = math.dist(lab(marked, matrix), lab(other, matrix))
        assert apart >= 10, (kind, name, other, apart)
print("colours are told apart")
