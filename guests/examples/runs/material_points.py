"""Material points (MLS-MPM, APIC, quadratic B-splines); pieces have grids of their own once a blade has parted them.

SPDX-License-Identifier: MIT

The tissue is a graph of neighbours at rest, whose edges the blade breaks; its components are labels of the points. So a
cut does not heal when the blade leaves. What has been cut in part stays coupled over the grid: the limit of labels.
"""
import numpy as np

import scene
import cutproof_run

FAULTS = ("heals stale_index glued_by_one_node spin_lost units mirror reset revive teleport tear_elsewhere fragment "
          "momentum_from_nothing global_solver race noise").split()
STENCIL = np.indices((3, 3, 3)).reshape(3, -1).T
kept = {}


def simulate(body, blade, frames, fault=None):
    """Yields what Writer.frame takes: the start, then the state after each frame."""
    h, mass, n = body["spacing"], body["mass"], len(body["rest"])
    x, v, affine = body["rest"].copy(), body["velocities"].copy(), np.zeros((n, 3, 3))
    deformation, label = np.tile(np.eye(3), (n, 1, 1)), np.zeros(n, int)
    cell = 2 * h if fault != "units" else 0.02
    mu, lame = body["stiffness"] / 2.6, body["stiffness"] * 0.3 / (1.3 * 0.4)  # Poisson's ratio 0.3
    edges = scene.grid_edges(body["nodes"])
    broken, removed = np.zeros(len(edges), bool), np.zeros(n, bool)
    held = body.get("held", np.zeros(n, bool))
    if fault == "reset":  # the last body's cuts are still there
        broken = kept.setdefault("broken", broken)
    for frame in range(frames):
        x, v = scene.disturbed(body, frame, x, v)
        v = scene.kicked(body, frame, v, lambda: label)
        steps = body["steps"]
        if fault == "global_solver":  # as many as the fastest point of the whole scene demands
            steps += int(8 * abs(v).max() * body["frame_time"] / h)
        for _ in range(steps if frame else 0):
            dt = body["frame_time"] / steps
            base = np.floor(x / cell - 0.5)
            at = x / cell - base
            along = np.stack([(1.5 - at)**2 / 2, 0.75 - (at - 1)**2, (at - 0.5)**2 / 2], 1)
            weight = np.prod([along[:, STENCIL[:, axis], axis] for axis in range(3)], 0)
            way = (STENCIL - at[:, None]) * cell
            node = np.concatenate([np.broadcast_to(label[:, None, None], (n, 27, 1)), base[:, None] + STENCIL], 2)
            node = (node.reshape(-1, 4) - node.min((0, 1))).astype(int).T
            node = np.unique(np.ravel_multi_index(node, node.max(1) + 1), return_inverse=True)[1]
            u, _, vt = np.linalg.svd(deformation)
            volume = np.linalg.det(deformation)
            if fault == "noise":  # single precision in one place
                volume = volume.astype(np.float32).astype(float)
            stress = 2 * mu * (deformation - u @ vt) @ np.swapaxes(deformation, 1, 2)
            stress += (lame * volume * (volume - 1))[:, None, None] * np.eye(3)
            moved = mass[:, None, None] * affine - dt * h**3 * 4 / cell**2 * stress
            momentum = weight[:, :, None] * ((mass[:, None] * v)[:, None] + way @ np.swapaxes(moved, 1, 2))
            weights, parts = (weight * np.where(removed, 0, mass)[:, None]).ravel(), momentum.reshape(-1, 3)
            order = slice(None) if fault != "race" else np.random.default_rng().permutation(len(node))
            heavy = np.bincount(node[order], weights[order])[:, None]
            fast = np.stack([np.bincount(node[order], parts[order, axis]) for axis in range(3)], 1)
            clamped = np.bincount(node, weights * held.repeat(27))[:, None] > 0.17 * heavy  # or held points only drag
            least = 0 if fault != "momentum_from_nothing" else mass.mean() / 10  # light nodes are skipped
            fast = np.where((heavy > least) & ~clamped, fast / np.where(heavy > 0, heavy, 1) + dt * body["gravity"], 0)
            fast = weight[:, :, None] * fast[node].reshape(n, 27, 3)
            v, affine = np.where(held[:, None], 0, fast.sum(1)), 4 / cell**2 * np.swapaxes(fast, 1, 2) @ way
            if fault == "spin_lost":  # an outer product the wrong way round
                affine = np.swapaxes(affine, 1, 2)
            x, deformation = x + dt * v, deformation + dt * affine @ deformation
        hit = scene.crossed(blade[frame], *x[edges.T], bounded=fault != "tear_elsewhere", one_sided=fault == "mirror")
        first = edges[hit & ~broken][:1].ravel()
        if fault == "fragment":  # all edges of a point break
            hit |= np.isin(edges, first[:1]).any(1)
        if fault == "teleport" and len(first):  # the blade pushes a point out of its way
            x[first[0]] -= 0.3 * (x[first[1]] - x[first[0]])
        gone = scene.near(blade[frame], x, body["kerf"] / 2)
        removed = gone if fault == "revive" else removed | gone
        if fault == "heals":  # broken is what the blade crosses just now
            broken[:] = False
        broken |= hit
        label = scene.pieces(n, edges[~broken & ~removed[edges].any(1)])
        parted = edges[broken & (label[edges[:, 0]] != label[edges[:, 1]])][:1].ravel()
        if fault == "glued_by_one_node" and len(parted):  # a point beside the cut keeps the other side's label
            label[parted[0]] = label[parted[1]]
        if fault == "stale_index":  # the number of grids is that of the start
            label = np.minimum(label, 0)
        label[removed] = -1
        spin = (mass * cell**2 / 4)[:, None] * np.stack([affine[:, 2, 1] - affine[:, 1, 2], affine[:, 0, 2]
                                                         - affine[:, 2, 0], affine[:, 1, 0] - affine[:, 0, 1]], 1)
        yield dict(positions=x, velocities=v, time=frame * body["frame_time"], labels=label, alive=~removed,
                   removed=removed, spin=spin, blade=blade[frame])


if __name__ == "__main__":
    given, body, blade = scene.arguments(__doc__, FAULTS)
    with cutproof_run.Writer(
            given.run, rest=body["rest"], mass=body["mass"], spacing=body["spacing"], gravity=body["gravity"],
            nodes=body["nodes"], steps=body["steps"], grid=(0, 2 * body["spacing"], "quadratic"),
            promises="free angular_momentum deterministic") as run:
        for frame in scene.frames(simulate, given, body, blade):
            run.frame(**frame)
