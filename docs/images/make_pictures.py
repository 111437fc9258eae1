#!/usr/bin/env python3
"""Makes the pictures of the documentation from a recording. Needs Debian's python3-matplotlib and python3-h5py.

Usage: build/default/cli/cutproof run fixtures/scenes/kidney_discontinuous.json --record kidney
       python3 docs/images/make_pictures.py kidney docs/images/kidney_discontinuous.png
"""
import sys

import h5py
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection


def surface(group, step):
    steps = group["Steps"]
    parts = steps["NumberOfParts"][step]
    first = steps["PartOffsets"][step]
    assert parts >= 1
    points_at = steps["PointOffsets"][step]
    cells_at = steps["CellOffsets"][step][2]
    ids_at = steps["ConnectivityIdOffsets"][step][2]
    points = group["Points"][points_at : points_at + group["NumberOfPoints"][first]]
    cells = group["Polygons/NumberOfCells"][first]
    ids = group["Polygons/NumberOfConnectivityIds"][first]
    assert ids == 3 * cells
    return points, group["Polygons/Connectivity"][ids_at : ids_at + ids].reshape(-1, 3)


def pieces(count, triangles):
    parent = np.arange(count)

    def find(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b, c in triangles:
        ra = find(a)
        parent[find(b)] = ra
        parent[find(c)] = ra
    roots = np.array([find(i) for i in range(count)])
    names, label = np.unique(roots, return_inverse=True)
    sizes = np.bincount(label)
    return np.argsort(np.argsort(-sizes))[label]


def draw(axes, points, triangles, limits, title):
    colours = np.array([[0.78, 0.34, 0.30], [0.93, 0.70, 0.36], [0.45, 0.55, 0.75], [0.5, 0.7, 0.5]])
    label = pieces(len(points), triangles)
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    light = np.array([0.35, -0.6, 0.72])
    shade = 0.45 + 0.55 * np.clip(normal @ light, 0, 1)
    axes.add_collection3d(
        Poly3DCollection(corners, facecolors=colours[np.minimum(label[triangles[:, 0]], 3)] * shade[:, None], linewidths=0)
    )
    low, high = limits
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_zlim(low[2], high[2])
    axes.set_box_aspect(high - low)
    axes.view_init(elev=22, azim=-62)
    axes.set_axis_off()
    axes.set_title(title, fontsize=10, y=0.95)


def main():
    recording, picture = sys.argv[1:3]
    with h5py.File(recording + ".cutproof.h5") as index, h5py.File(recording + ".skin.vtkhdf") as skin:
        stroke_end = index["setup/stroke_end"][:]
        group = skin["VTKHDF"]
        last = group["Steps"].attrs["NSteps"] - 1
        shown = [(stroke_end[0] + 1, "after the vertical stroke"), (stroke_end[1] + 1, "after the horizontal stroke"),
                 (last, "the piece is pulled away")]
        surfaces = [(surface(group, step), title) for step, title in shown]
    everything = np.vstack([points for (points, _), _ in surfaces])
    limits = everything.min(axis=0), everything.max(axis=0)
    figure = plt.figure(figsize=(12, 3.6), dpi=110)
    for k, ((points, triangles), title) in enumerate(surfaces):
        draw(figure.add_subplot(1, 3, k + 1, projection="3d"), points, triangles, limits,
             f"{title}: {pieces(len(points), triangles).max() + 1} component(s)")
    figure.subplots_adjust(left=0, right=1, bottom=0, top=1, wspace=0)
    figure.savefig(picture, facecolor="white")


if __name__ == "__main__":
    main()
