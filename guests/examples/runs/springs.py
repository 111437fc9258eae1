"""Springs between all neighbours on a grid; a blade breaks those that it crosses.

SPDX-License-Identifier: MIT

Semi-implicit Euler, damping along the springs: both momenta are conserved to rounding.
"""
import numpy as np

import scene
import cutproof_run

FAULTS = ("heals stale_index glued_by_one_node spin_lost units mirror reset revive teleport tear_elsewhere fragment "
          "momentum_from_nothing global_solver race noise").split()
kept = {}


def springs_of(nodes):
    return np.argwhere(np.triu(abs(nodes[:, None] - nodes).max(2) == 1))


def simulate(body, blade, frames, fault=None):
    """Yields what Writer.frame takes: the start, then the state after each frame."""
    rest, h, mass = body["rest"], body["spacing"], body["mass"][:, None]
    x, v, dt = rest.copy(), body["velocities"].copy(), body["frame_time"] / body["steps"]
    ends = springs_of(body["nodes"])
    i, j = ends.T
    length = np.linalg.norm(rest[j] - rest[i], axis=1)
    stiffness, damping = body["stiffness"] * h, 0.2 * np.sqrt(body["stiffness"] * h * mass.mean())
    gravity = body["gravity"] if fault != "units" else np.array([0, 0, -9.81])
    broken, removed = np.zeros(len(ends), bool), np.zeros(len(x), bool)
    held = body.get("held", np.zeros(len(x), bool))
    if fault == "reset":  # the last body's cuts are still there
        broken = kept.setdefault("broken", broken)
    on = ~broken
    for frame in range(frames):
        x, v = scene.disturbed(body, frame, x, v)
        v = scene.kicked(body, frame, v, lambda: scene.pieces(len(x), ends[on]))
        for _ in range(body["steps"] if frame else 0):
            way = x[j] - x[i]
            long = np.linalg.norm(way, axis=1)
            if fault == "noise":  # a fast square root
                long = long.astype(np.float32).astype(float)
            along = way / long[:, None]
            apart = v[j] - v[i]
            if fault != "spin_lost":  # else damping also acts across the spring
                apart = (apart * along).sum(1, keepdims=True) * along
            if fault == "global_solver":  # damped as the fastest particle of the whole scene demands
                apart = apart * (1 + abs(v).max() * dt / h)
            pull = (stiffness * (long - length)[:, None] * along + damping * apart) * on[:, None]
            force = np.zeros_like(x)
            if fault == "race":  # threads add in the order in which they come
                order = np.random.default_rng().permutation(len(ends))
                np.add.at(force, i[order], pull[order])
            else:
                np.add.at(force, i, pull)
            if fault == "momentum_from_nothing":  # of equal indices, one is added
                force[j] -= pull
            else:
                np.add.at(force, j, -pull)
            v = np.where((removed | held)[:, None], 0, v + dt * (force / mass + gravity))
            x = x + dt * v
        hit = scene.crossed(blade[frame], x[i], x[j], bounded=fault != "tear_elsewhere", one_sided=fault == "mirror")
        first = ends[hit & ~broken][:1].ravel()  # of the springs that are cut now
        if fault == "glued_by_one_node":  # this node's springs are forgotten
            hit &= ~np.isin(ends, first[:1]).any(1)
        if fault == "fragment":  # all of this node's springs break
            hit |= np.isin(ends, first[:1]).any(1)
        if fault == "teleport" and len(first):  # the wound is opened by hand
            x[first[0]] -= 0.3 * (x[first[1]] - x[first[0]])
        if fault == "stale_index":  # numbers among the springs left, used as numbers among all
            hit = np.isin(np.arange(len(ends)), np.flatnonzero(hit[~broken]))
        gone = scene.near(blade[frame], x, body["kerf"] / 2)
        removed = gone if fault == "revive" else removed | gone
        if fault == "heals":  # broken is what the blade crosses just now
            broken[:] = False
        broken |= hit
        on = ~broken & ~removed[ends].any(1)
        yield dict(positions=x, velocities=v, time=frame * body["frame_time"], groups=ends[on], alive=~removed,
                   removed=removed, blade=blade[frame])


if __name__ == "__main__":
    given, body, blade = scene.arguments(__doc__, FAULTS)
    with cutproof_run.Writer(
            given.run, rest=body["rest"], mass=body["mass"], spacing=body["spacing"], gravity=body["gravity"],
            steps=body["steps"], edges=springs_of(body["nodes"]),
            promises="free angular_momentum deterministic") as run:
        for frame in scene.frames(simulate, given, body, blade):
            run.frame(**frame)
