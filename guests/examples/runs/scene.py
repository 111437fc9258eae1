"""What the simulators of this folder share: a body, the way of a blade, what it crosses, and the command line.

SPDX-License-Identifier: MIT

A body is a dict: rest (n, 3), nodes (n, 3), mass (n), velocities (n, 3), spacing, gravity, stiffness [Pa], frame_time
[s], steps, kerf (what lies nearer than half of it to the blade is removed), cells (tetrahedra), and perhaps
kick = (frame, velocity): from this frame on the piece of particle 0 is faster by that much, or each particle by its own
of (n, 3) velocities. A blade is an array
(frames, q, 4, 3): the quads swept in the way to each frame, where they lie at its end; NaN: none.
"""
import argparse
import pathlib
import sys

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "python"))  # or beside this file, which comes first
import cutproof_run  # noqa: E402


def block(size=(7, 4, 3), spacing=0.01, seed=1, kerf=0.0):
    """A block of soft tissue in the air, that falls, turns, and is being pulled apart along x."""
    nodes = np.stack(np.meshgrid(*map(np.arange, size), indexing="ij"), 3).reshape(-1, 3)
    rest = nodes * spacing
    way = rest - rest.mean(0)
    velocities = np.cross([0.3, 1.0, 0.5], way) + way * [2.0, -0.5, -0.5]
    velocities += np.random.default_rng(seed).normal(size=rest.shape) * 0.1 * spacing
    return dict(rest=rest, nodes=nodes, mass=np.full(len(rest), 1000 * spacing**3), velocities=velocities,
                spacing=spacing, gravity=np.array([0, 0, -9.81]), stiffness=2000.0, frame_time=0.01, steps=10,
                kerf=kerf, cells=tetrahedra(nodes))


def tetrahedra(nodes):
    """Six in each cube of the grid, all around the same diagonal, so that faces of neighbours meet."""
    number = {tuple(node): i for i, node in enumerate(nodes)}
    cells = []
    for node in nodes:
        for first, second in ((0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)):
            steps = np.zeros((4, 3), int)
            steps[1:, first] = 1
            steps[2:, second] = 1
            steps[3] = 1
            corners = [number.get(tuple(node + step)) for step in steps]
            if None not in corners:
                even = (second - first) % 3 == 1
                cells.append(corners if even else [corners[i] for i in (0, 2, 1, 3)])
    return np.array(cells)


def blade_path(body, frames, depth=1.0, at=0.4, first=4, last=10):
    """Down through the block, `at` spacings behind its middle nodes, in frames first to last; then it is withdrawn. It
    falls along with the block. Each frame sweeps a little of the way of the last again, so that no tissue is left."""
    low, high, h = body["rest"].min(0), body["rest"].max(0), body["spacing"]
    middle = h * (body["nodes"][:, 0].max() // 2 + (0.05 if body["kerf"] else at))
    path = np.full((frames, 1, 4, 3), np.nan)
    for frame in range(first, min(last, frames - 1) + 1):
        fallen = body["gravity"][2] * (frame * body["frame_time"])**2 / 2
        z = high[2] + h - depth * (high[2] - low[2] + 2 * h) * np.array([frame - first - 0.2, frame - first + 1]) / (
            last - first + 1) + fallen
        left, right = low[1] - h, high[1] + h
        path[frame, 0] = [[middle, y, z[i]] for y, i in ((right, 0), (left, 0), (left, 1), (right, 1))]
    return path


def crossed(quads, a, b, bounded=True, one_sided=False):
    """Which segments from a to b cross a quad. Not bounded: the quads' planes. One-sided: only along their normals."""
    hit = np.zeros(len(a), bool)
    for p, q, r in [quad[list(of)] for quad in quads for of in ((0, 1, 2), (0, 2, 3)) if np.isfinite(quad).all()]:
        normal = np.cross(q - p, r - p)
        da, db = (a - p) @ normal, (b - p) @ normal
        sides = (da < 0) & (db >= 0) if one_sided else (da < 0) != (db < 0)
        at = a + np.where(sides, da / np.where(sides, da - db, 1), 0)[:, None] * (b - a)
        inside = [np.cross(end - start, at - start) @ normal >= 0 for start, end in ((p, q), (q, r), (r, p))]
        hit |= sides & (np.all(inside, 0) | (not bounded))
    return hit


def near(quads, x, distance):
    """Which particles lie beside a quad, no farther away than that."""
    hit = np.zeros(len(x), bool)
    for quad in quads[np.isfinite(quads).all((1, 2))]:
        normal = np.cross(quad[1] - quad[0], quad[2] - quad[0])
        way = normal / np.linalg.norm(normal) * distance
        hit |= crossed(quad[None], x - way, x + way)
    return hit


def pieces(count, groups):
    """A number for each particle: equal where groups join them, ascending with their first particles."""
    groups, piece, seen = [list(group) for group in groups], np.full(count, -1), set()
    groups_of = [[] for _ in range(count)]
    for g, members in enumerate(groups):
        for i in members:
            groups_of[i].append(g)
    for first in range(count):
        if piece[first] >= 0:
            continue
        piece[first] = number = piece.max() + 1
        queue = [first]
        for i in queue:
            for g in groups_of[i]:
                if g not in seen:
                    seen.add(g)
                    new = [j for j in groups[g] if piece[j] < 0]
                    piece[new] = number
                    queue += new
    return piece


def grid_edges(nodes):
    """Pairs of neighbours along an axis, the smaller number first."""
    number = {tuple(node): i for i, node in enumerate(nodes)}
    pairs = [(i, number.get(tuple(node + axis))) for i, node in enumerate(nodes) for axis in np.eye(3, dtype=int)]
    return np.sort([pair for pair in pairs if pair[1] is not None], 1)


def disturbed(body, frame, *arrays):
    """Of each array a copy; where the body is to be disturbed, off by one unit in the last place of its size."""
    random = np.random.default_rng([body["disturb"], frame]) if body.get("disturb") else None
    return [array.copy() if random is None else
            array + np.spacing(abs(array).max()) * random.choice([-1, 1], array.shape) for array in arrays]


def kicked(body, frame, v, piece):
    """The velocities, changed if this is the frame of a kick."""
    when, by = body.get("kick", (-1, None))
    if frame != when:
        return v
    if by.ndim == 1:
        return np.where((piece() == piece()[0])[:, None], v + by, v)
    return v + np.pad(by, ((0, len(v) - len(by)), (0, 0)))


def dissection(simulate, fault=None, kerf=0.0):
    """The simulator as `cutproof.judge(dissect=...)` takes it. Stiffness and substeps are as those of block(), whatever
    the size of a spacing; `kerf` is in spacings."""
    def dissect(asked):
        body = {name: getattr(asked, name) for name in ("rest", "nodes", "mass", "velocities", "spacing", "gravity",
                                                        "frame_time", "held")}
        body.update(stiffness=2e7 * asked.spacing**2, steps=int(np.ceil(1000 * asked.frame_time)),
                    kerf=kerf * asked.spacing, cells=asked.tetrahedra, kick=(asked.kick_frame, asked.kick))
        for frame in simulate(body, asked.blade, asked.frames, fault):
            if "labels" in frame:
                frame["groups"] = cutproof_run.grid_groups(frame["positions"], 0, 2 * asked.spacing, "quadratic",
                                                           frame.pop("labels"), frame["alive"])
            yield dict(frame, steps=body["steps"])
    return dissect


def arguments(about, faults, at=0.4):
    """Of the command line: where to write, the fault or None, the body, its blade, whether to simulate twice."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0], epilog="faults: " + ", ".join(faults))
    parser.add_argument("run", help="run.h5, or a folder for a series of NPZ files")
    parser.add_argument("--fault", choices=faults, metavar="NAME")
    parser.add_argument("--frames", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1, help="of the velocities at the start")
    parser.add_argument("--depth", type=float, default=1.0, help="how far through the blade goes, 1: through")
    parser.add_argument("--kerf", type=float, default=None, help="what the blade removes, in spacings")
    parser.add_argument("--again", action="store_true", help="simulate twice in this process, write the second run")
    parser.add_argument("--disturb", type=int, default=0, help="a seed: one unit in the last place in each frame")
    parser.add_argument("--kick", type=float, nargs=4, help="a frame, and a velocity for the piece of particle 0")
    parser.add_argument("--scene", help="an NPZ with fields of the body, and blade, that replace those drawn here")
    parser.add_argument("--save-scene", help="write such an NPZ")
    given = parser.parse_args()
    kerf = given.kerf if given.kerf is not None else 0.5 if given.fault == "revive" else 0.0
    body = block(seed=given.seed, kerf=kerf * 0.01)
    blade = blade_path(body, given.frames, given.depth, at)
    if given.save_scene:
        np.savez(given.save_scene, blade=blade, **body)
    if given.scene:
        body.update((name, array[()]) for name, array in np.load(given.scene).items())
        blade = body.pop("blade", blade)
    body["disturb"] = given.disturb
    if given.kick:
        body["kick"] = (int(given.kick[0]), np.array(given.kick[1:]))
    return given, body, blade


def frames(simulate, given, body, blade):
    """The frames of the run that was asked for, one after the other."""
    if given.again:
        list(simulate(body, blade, given.frames, given.fault))
    return simulate(body, blade, given.frames, given.fault)
