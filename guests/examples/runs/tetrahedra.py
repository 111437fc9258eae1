"""Co-rotational tetrahedra; a blade separates cells whose centres it passes between, along their faces.

SPDX-License-Identifier: MIT

Vertices on a cut face are split: each side gets its own, with the mass of its cells. Semi-implicit Euler.
"""
import numpy as np

import scene
import cutproof_run

FAULTS = ("heals stale_index glued_by_one_node spin_lost units mirror reset teleport tear_elsewhere fragment "
          "inverted volume momentum_from_nothing global_solver race noise").split()
kept = {}


def split(cells, joined, count, fault):
    """Cells with new corners, numbered from count on, and whom each new vertex was split from."""
    cells, parents, forgotten = cells.copy(), [], False
    for vertex in range(count):
        around = np.flatnonzero((cells == vertex).any(1))
        side = scene.pieces(len(cells), joined[np.isin(joined, around).all(1)])[around]
        if fault == "glued_by_one_node" and not forgotten and len(set(side)) > 1:
            forgotten = True
            continue
        for number in sorted(set(side))[1:]:
            mine = around[side == number]
            cells[mine] = np.where(cells[mine] == vertex, count + len(parents), cells[mine])
            parents.append(vertex)
    return cells, np.array(parents, int)


def simulate(body, blade, frames, fault=None):
    """Yields what Writer.frame takes: the start, then the state after each frame."""
    rest, h, cells = body["rest"], body["spacing"], body["cells"]
    x, v, origin, parent = rest.copy(), body["velocities"].copy(), np.arange(len(rest)), np.full(len(rest), -1)
    edges_of = rest[cells[:, 1:]] - rest[cells[:, :1]]  # (cells, edge, axis)
    inverse = np.linalg.inv(edges_of)
    volume = (np.cross(edges_of[:, 0], edges_of[:, 1]) * edges_of[:, 2]).sum(1) / 6  # det() has a logarithm in it
    stiffness = body["stiffness"] if fault != "units" else 2000.0
    mu, lame = stiffness / 2.8, stiffness * 0.4 / (1.4 * 0.2)  # Poisson's ratio 0.4
    cell_mass = volume * body["mass"].sum() / volume.sum() / 4
    mass = np.bincount(cells.ravel(), np.repeat(cell_mass, 4))
    pairs = np.array([(a, b) for a in range(len(cells)) for b in range(a + 1, len(cells))
                      if len(set(cells[a]) & set(cells[b])) == 3])
    broken, split_so_far, first_cells = np.zeros(len(pairs), bool), 0, cells
    held, lost = body.get("held", np.zeros(len(rest), bool)), np.zeros(len(cells), bool)
    if fault == "reset":  # the last body's cuts are still there
        broken = kept.setdefault("broken", broken)
    for frame in range(frames):
        x, v = scene.disturbed(body, frame, x, v)
        v = scene.kicked(body, frame, v, lambda: scene.pieces(len(x), cells))
        steps = body["steps"]
        if fault == "global_solver":  # as many as the fastest vertex of the whole scene demands
            steps += int(8 * abs(v).max() * body["frame_time"] / h)
        for _ in range(steps if frame else 0):
            dt = body["frame_time"] / steps
            deformation = np.swapaxes(inverse @ (x[cells[:, 1:]] - x[cells[:, :1]]), 1, 2)
            u, _, vt = np.linalg.svd(deformation)
            u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
            rotation = u @ vt if fault != "spin_lost" else np.broadcast_to(np.eye(3), u.shape)
            trace = (rotation * deformation).sum((1, 2)) - 3
            if fault == "noise":  # single precision in one place
                trace = trace.astype(np.float32).astype(float)
            if fault == "inverted":  # a sign is lost: what is compressed is compressed further
                trace = abs(trace)
            stress = 2 * mu * (deformation - rotation) + (lame * trace)[:, None, None] * rotation
            pull = -volume[:, None, None] * np.swapaxes(stress @ inverse, 1, 2)
            pull = np.concatenate([-pull.sum(1, keepdims=True), pull], 1).reshape(-1, 3)
            ends = (cells if fault != "stale_index" else first_cells).ravel()  # stale: where forces are added
            order = slice(None) if fault != "race" else np.random.default_rng().permutation(len(ends))
            force = np.zeros_like(x)
            np.add.at(force, ends[order], pull[order])
            v = np.where(held[origin, None], 0, v + dt * (force / mass[:, None] + body["gravity"]))
            if fault == "heals" and np.isnan(blade[frame]).all():  # new vertices stick to what they were split from
                root = np.where(np.linalg.norm(x - x[origin], axis=1) < h / 2, origin, np.arange(len(x)))
                v = np.stack([np.bincount(root, mass * a, len(x)) for a in v.T], 1)[root] / np.bincount(root, mass)[
                    root, None]
            x = x + dt * v
        centre = x[cells].mean(1)
        hit = scene.crossed(blade[frame], *centre[pairs.T], bounded=fault != "tear_elsewhere",
                            one_sided=fault == "mirror")
        if fault == "fragment" and hit.any():  # an index that nobody has set is 0
            hit |= (pairs == 0).any(1)
        broken |= hit
        if fault == "volume":  # cells that the blade passes through are deleted
            lost |= np.isin(np.arange(len(cells)), pairs[hit, 0])
            volume = np.where(lost, 0, volume)
        if broken.sum() > split_so_far:
            split_so_far = broken.sum()
            cells, new = split(cells, pairs[~broken], len(x), fault)
            origin, parent = np.append(origin, origin[new]), np.append(np.full(len(x), -1), new)
            x = np.concatenate([x, x[new] if fault != "teleport" else rest[origin[len(x):]]])  # where they were at rest
            v, old = np.concatenate([v, v[new]]), mass
            mass = np.bincount(cells.ravel(), np.repeat(cell_mass, 4), len(x))
            if fault == "momentum_from_nothing":  # both sides get all of the mass
                mass = np.append(old, old[new])
        yield dict(positions=x, velocities=v, time=frame * body["frame_time"], cells=cells[~lost], mass=mass,
                   parent=parent, blade=blade[frame])


if __name__ == "__main__":
    given, body, blade = scene.arguments(__doc__, FAULTS, at=0.05)
    with cutproof_run.Writer(
            given.run, rest=body["rest"], spacing=body["spacing"], gravity=body["gravity"], steps=body["steps"],
            cut_resolution=body["spacing"], promises="free angular_momentum deterministic") as run:
        for frame in scene.frames(simulate, given, body, blade):
            run.frame(**frame)
