"""Shape matching on a grid: a cluster around each particle; a blade splits clusters into their connected parts.

SPDX-License-Identifier: MIT

Each cluster pulls its particles to their goals with the share of their mass that it has: both momenta are conserved to
rounding. Semi-implicit Euler.
"""
import numpy as np

import scene
import cutproof_run

FAULTS = ("heals stale_index glued_by_one_node spin_lost units mirror reset revive teleport tear_elsewhere fragment "
          "momentum_from_nothing global_solver race noise").split()
kept = {}


def split(regions, edges, intact, removed):
    """The connected parts of each region, by breadth-first search, and the region of each part."""
    parts = []
    for number, region in enumerate(regions):
        region = region[~removed[region]]
        local = np.full(len(removed), -1)
        local[region] = np.arange(len(region))
        inside = local[edges[intact]]
        piece = scene.pieces(len(region), inside[(inside >= 0).all(1)])
        parts += [(region[piece == p], number) for p in range(piece.max(initial=-1) + 1)]
    return [members for members, _ in parts], np.array([number for _, number in parts])


def simulate(body, blade, frames, fault=None):
    """Yields what Writer.frame takes: the start, then the state after each frame."""
    rest, nodes, h, n = body["rest"], body["nodes"], body["spacing"], len(body["rest"])
    x, v, mass = rest.copy(), body["velocities"].copy(), body["mass"]
    frequency = np.sqrt(body["stiffness"] * h / mass.mean()) if fault != "units" else 141.4213562373095
    if fault == "noise":  # a fast square root
        frequency = float(np.float32(frequency))
    regions = [np.flatnonzero(abs(nodes - node).max(1) <= 1) for node in nodes]
    edges = scene.grid_edges(nodes)
    broken, removed = np.zeros(len(edges), bool), np.zeros(n, bool)
    held = body.get("held", np.zeros(n, bool))
    if fault == "reset":  # the last body's cuts are still there
        broken = kept.setdefault("broken", broken)
    clusters, region_of = split(regions, edges, ~broken, removed)
    for frame in range(frames):
        x, v = scene.disturbed(body, frame, x, v)
        v = scene.kicked(body, frame, v, lambda: scene.pieces(n, clusters))
        member, owner = np.concatenate(clusters), np.repeat(np.arange(len(clusters)), [len(c) for c in clusters])
        share = (mass / np.maximum(np.bincount(member, minlength=n), 1))[member]

        def mean(values, by=share, of=owner):
            return np.stack([np.bincount(of, by * column) for column in values.T], 1) / np.bincount(of, by)[:, None]

        centre = mean(rest[member])
        whole = centre if frame == 0 else whole
        if fault == "stale_index":  # centres at rest of what there was before the split
            centre = whole[region_of]
        offset = rest[member] - centre[owner]
        steps = body["steps"]
        if fault == "global_solver":  # as many as the fastest particle of the whole scene demands
            steps += int(8 * abs(v).max() * body["frame_time"] / h)
        for step in range(steps if frame else 0):
            dt = body["frame_time"] / steps
            now = mean(x[member])
            if fault == "momentum_from_nothing":  # centres without the weights
                now = mean(x[member], np.ones_like(share))
            moment = mean(((x[member] - now[owner])[:, :, None] * offset[:, None]).reshape(-1, 9)).reshape(-1, 3, 3)
            if fault != "spin_lost" or step == 0:  # else rotations are those of the frame's start
                u, _, vt = np.linalg.svd(moment)
                u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
                rotation = u @ vt
            goal = now[owner] + (rotation[owner] @ offset[:, :, None])[:, :, 0]
            add = frequency**2 * share[:, None] * (goal - x[member])
            order = slice(None) if fault != "race" else np.random.default_rng().permutation(len(member))
            force = np.zeros_like(x)
            np.add.at(force, member[order], add[order])
            v = np.where((removed | held)[:, None], 0, v + dt * (force / mass[:, None] + body["gravity"]))
            x = x + dt * v
        blade_is_there = np.isfinite(blade[frame]).any()
        hit = scene.crossed(blade[frame], *x[edges.T], bounded=fault != "tear_elsewhere", one_sided=fault == "mirror")
        first = edges[hit & ~broken][:1].ravel()
        if fault == "fragment":  # a particle is left alone
            hit |= np.isin(edges, first[:1]).any(1)
        if fault == "teleport" and len(first):  # the wound is opened by hand
            x[first[0]] -= 0.3 * (x[first[1]] - x[first[0]])
        gone = scene.near(blade[frame], x, body["kerf"] / 2)
        removed = gone if fault == "revive" else removed | gone
        if fault == "heals":  # broken is what the blade crosses just now
            broken[:] = False
        broken |= hit
        if blade_is_there or fault in ("heals", "revive"):
            clusters, region_of = split(regions, edges, ~broken, removed)
        if fault == "glued_by_one_node" and broken.any() and blade_is_there:  # one cluster also stays whole
            clusters.append(regions[edges[broken][0, 0]])
        yield dict(positions=x, velocities=v, time=frame * body["frame_time"], groups=clusters, alive=~removed,
                   removed=removed, blade=blade[frame])


if __name__ == "__main__":
    given, body, blade = scene.arguments(__doc__, FAULTS)
    with cutproof_run.Writer(
            given.run, rest=body["rest"], mass=body["mass"], spacing=body["spacing"], gravity=body["gravity"],
            nodes=body["nodes"], steps=body["steps"], promises="free angular_momentum deterministic") as run:
        for frame in scene.frames(simulate, given, body, blade):
            run.frame(**frame)
