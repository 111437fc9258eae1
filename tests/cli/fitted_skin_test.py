#!/usr/bin/env python3
"""How near the skin of an uncut body is to the surface that it was made from, by numpy alone: distances of its vertices
and of points on its triangles from the surface's triangles, and what the two enclose. Of an ellipsoid that is made here
at several sizes. Usage: fitted_skin_test.py CUTPROOF WORK"""
import json
import pathlib
import shutil
import subprocess
import sys

import h5py
import numpy as np

program, work = (pathlib.Path(given).resolve() for given in sys.argv[1:3])
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)


def ellipsoid(path):
    """A closed mesh of 2 * 96 * 47 triangles, as ASCII PLY in metres."""
    around, down = 96, 48
    points = [(0, 0, 0.03)]
    for i in range(1, down):
        for j in range(around):
            theta, phi = np.pi * i / down, 2 * np.pi * j / around
            points.append((0.05 * np.sin(theta) * np.cos(phi), 0.04 * np.sin(theta) * np.sin(phi), 0.03 * np.cos(theta)))
    points.append((0, 0, -0.03))
    ring = lambda i, j: 1 + (i - 1) * around + j % around
    faces = []
    for j in range(around):
        faces.append((0, ring(1, j), ring(1, j + 1)))
        faces.append((len(points) - 1, ring(down - 1, j + 1), ring(down - 1, j)))
        for i in range(1, down - 1):
            faces.append((ring(i, j), ring(i + 1, j), ring(i + 1, j + 1)))
            faces.append((ring(i, j), ring(i + 1, j + 1), ring(i, j + 1)))
    header = ("ply\nformat ascii 1.0\nelement vertex %d\nproperty double x\nproperty double y\nproperty double z\n"
              "element face %d\nproperty list uchar int vertex_indices\nend_header\n" % (len(points), len(faces)))
    path.write_text(header + "".join("%.17g %.17g %.17g\n" % p for p in points) + "".join("3 %d %d %d\n" % f for f in faces))


def fitted(mesh, particles, fit_skin):
    """Spacing, and the skin's points (in the mesh's frame) and triangles, of the body at rest; and the mesh's volume as
    the program says it."""
    scene = {"version": 5, "name": "at_rest", "frame": {"count": 1}, "step": {"iterations": 0, "substeps": 1},
             "body": {"mesh": {"file": str(mesh), "unit": 1, "repair": True}, "align": False, "particles": particles,
                      "fit_skin": fit_skin}}
    (work / "scene.json").write_text(json.dumps(scene))
    done = subprocess.run([program, "run", "scene.json", "--record", "rest"], cwd=work, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    with h5py.File(work / "rest.cutproof.h5") as index, h5py.File(work / "rest.skin.vtkhdf") as skin:
        at = index["snapshots"]
        row, vertices = at["skin_position_row"][-1], at["vertex_count"][-1]
        first, triangles = at["triangles_row"][-1], at["triangle_count"][-1]
        body = index["setup/body"].attrs
        points = skin["VTKHDF/Points"][row:row + vertices] @ body["orientation"].reshape(3, 3).T + body["origin"]
        corners = skin["VTKHDF/Polygons/Connectivity"][3 * first:3 * (first + triangles)].reshape(-1, 3)
        return body["spacing"], points, corners, len(index["setup/body/mass"])


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]] - points.mean(axis=0) for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def distances(queries, a, b, c):
    """Of points from the nearest of some triangles: Ericson, Real-Time Collision Detection, 5.1.5, by regions."""
    found = np.full(len(queries), np.inf)
    ab, ac = b - a, c - a
    for k in range(0, len(queries), 64):
        p = queries[k:k + 64, None, :]
        ap = p - a
        d1, d2 = (ap * ab).sum(-1), (ap * ac).sum(-1)
        uu, uv, vv = (ab * ab).sum(-1), (ab * ac).sum(-1), (ac * ac).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (uu * vv - uv * uv)
            s, t = (vv * d1 - uv * d2) * scale, (uu * d2 - uv * d1) * scale
            inside = (s >= 0) & (t >= 0) & (s + t <= 1)
            plane = ap - s[..., None] * ab - t[..., None] * ac
            best = np.where(inside, (plane * plane).sum(-1), np.inf)
            for start, side in ((a, ab), (a, ac), (b, c - b)):
                along = np.clip(((p - start) * side).sum(-1) / (side * side).sum(-1), 0, 1)
                rest = p - start - along[..., None] * side
                best = np.fmin(best, (rest * rest).sum(-1))
        found[k:k + 64] = np.sqrt(np.nanmin(best, axis=1))
    return found


def measure(mesh_points, mesh_triangles, mesh, particles, fit_skin=True):
    h, points, corners, count = fitted(mesh, particles, fit_skin)
    a, b, c = (mesh_points[mesh_triangles[:, k]] for k in range(3))
    random = np.random.default_rng(7)
    pick = random.permutation(len(points))[:500]
    at_vertices = distances(points[pick], a, b, c) / h
    area = np.linalg.norm(np.cross(points[corners[:, 1]] - points[corners[:, 0]], points[corners[:, 2]] - points[corners[:, 0]]), axis=1)
    t = random.choice(len(corners), 500, p=area / area.sum())
    u = np.sort(random.random((500, 2)), axis=1)
    weights = np.stack([u[:, 0], u[:, 1] - u[:, 0], 1 - u[:, 1]], axis=1)
    on_skin = distances(np.einsum("ik,ikx->ix", weights, points[corners[t]]), a, b, c) / h
    rms = lambda d: float(np.sqrt((d * d).mean()))
    off = volume(points, corners) / volume(mesh_points, mesh_triangles) - 1
    print("%-28s %7d particles%s: vertices %.4f h RMS, skin %.4f h RMS (greatest %.2f), volume %+.3f %%" % (
        mesh.stem[:28], count, "" if fit_skin else ", not fitted", rms(at_vertices), rms(on_skin), on_skin.max(), 100 * off))
    return rms(at_vertices), rms(on_skin), off


def ply(path):
    lines = path.read_text().split("end_header\n")[1].splitlines()
    count = next(k for k, line in enumerate(lines) if line.startswith("3 "))
    return (np.array([[float(x) for x in line.split()] for line in lines[:count]]),
            np.array([[int(x) for x in line.split()[1:]] for line in lines[count:]]))


mesh = work / "ellipsoid.ply"
ellipsoid(mesh)
surface = ply(mesh)
errors = []
for particles in (1500, 6000, 24000):
    vertices, skin, off = measure(*surface, mesh, particles)
    # A vertex is where bisection found the surface, to 1/512 of h, unless that is nearer than h/16 to a node.
    assert vertices < 0.02, "vertices do not lie on the surface"
    assert skin < 0.1, "the goal: 0.1 h"
    errors.append(off)
assert all(-0.02 < off < 0 for off in errors), "chords of a convex body lie inside"
assert abs(errors[-1]) < 0.005, "the goal: half a percent from 20,000 particles on"
# The spacing goes with the cube root of four: the error with its square, 2.52 times less at each step.
for before, after in zip(errors, errors[1:]):
    assert 1.8 < before / after < 3.5, f"{before} to {after} is no error of second order"
_, skin, _ = measure(*surface, mesh, 6000, fit_skin=False)
assert skin > 0.15, "halfway between particles it is worse, or nothing was measured"
