#!/usr/bin/env python3
"""Compares two recordings of the same scene, of which one pulls a piece away in the end: every particle outside of that
piece must end with the same bits. Usage: same_bits.py PULLED LEFT

The pieces are found here, from the recorded grid and the particles that are alive, not taken from the program.
"""
import sys

import h5py
import numpy as np


def last_state(name):
    with h5py.File(name + ".cutproof.h5") as index, h5py.File(name + ".particles.vtkhdf") as particles:
        node = index["setup/body/node"][:]
        nodes = index["setup/body"].attrs["nodes"]
        snapshots = index["snapshots"]
        row = snapshots["position_row"][-1]
        x = particles["VTKHDF/Points"][row : row + len(node)]
        row = snapshots["alive_row"][-1]
        alive = particles["VTKHDF/PointData/alive"][row : row + len(node)] == 1
    return node, nodes, x, alive


def components(node, nodes, alive):
    at = {int(n): i for i, n in enumerate(node) if alive[i]}
    steps = (1, int(nodes[0]), int(nodes[0]) * int(nodes[1]))
    label = -np.ones(len(node), dtype=int)
    count = 0
    for start in at.values():
        if label[start] >= 0:
            continue
        label[start] = count
        queue = [start]
        while queue:
            i = queue.pop()
            for step in steps:
                for n in (int(node[i]) - step, int(node[i]) + step):
                    j = at.get(n, -1)
                    if j >= 0 and label[j] < 0:
                        label[j] = count
                        queue.append(j)
        count += 1
    return label, count


def main():
    node, nodes, pulled, alive = last_state(sys.argv[1])
    _, _, left, alive_left = last_state(sys.argv[2])
    assert np.array_equal(alive, alive_left), "pulling the piece changed what is alive"
    label, count = components(node, nodes, alive)
    assert count == 2, f"{count} pieces instead of two"
    sizes = np.bincount(label[label >= 0])
    rest, piece = label == np.argmax(sizes), label == np.argmin(sizes)
    moved = np.linalg.norm(pulled[piece] - left[piece], axis=1).max()
    assert moved > 1e-3, f"the piece was hardly moved: {moved} m"
    assert pulled[rest].tobytes() == left[rest].tobytes(), "the rest felt it"
    print(f"{rest.sum()} particles of the rest have the same bits; the piece of {piece.sum()} moved by {1e3 * moved:.1f} mm")


if __name__ == "__main__":
    main()
