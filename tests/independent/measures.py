"""How far two trajectories of one scene are apart, what rounding explains of that, and how errors fall with the time
step. Measures; simulates nothing and prints nothing."""
import dataclasses

import numpy as np

UNIT_ROUNDOFF = 2.0**-53


@dataclasses.dataclass
class Apart:
    rms: float  # greatest in any frame, over the particles that are alive in both [h]
    worst: float  # of a single particle in any frame [h]
    differ: int  # greatest number of particles, in any frame, that are alive in one alone


class Trajectory:
    """Positions and who is alive, at the times at which frames of the scene end, counted in these frames."""

    def __init__(self, h):
        self.h, self.at = h, {}

    def add(self, frame, x, alive):
        self.at[frame] = (x.copy(), alive.copy())


def apart(a, b):
    found = Apart(0, 0, 0)
    common = a.at.keys() & b.at.keys()
    assert common and len(common) >= max(len(a.at), len(b.at)), "trajectories of different times"
    for frame in common:
        (x, alive), (y, also) = a.at[frame], b.at[frame]
        both = alive & also
        square = ((x - y)[:, both]**2).sum(axis=0) / a.h**2
        if both.any():
            found.rms = max(found.rms, float(np.sqrt(square.mean())))
            found.worst = max(found.worst, float(np.sqrt(square.max())))
        found.differ = max(found.differ, int((alive != also).sum()))
    return found


def errors(levels):
    """Of each level from the next one, which is twice as fine."""
    return [apart(coarse, fine) for coarse, fine in zip(levels, levels[1:])]


def orders(values):
    """Base-2 logarithm of how much each error is greater than the next."""
    return [float(np.log2(a / b)) if a > 0 and b > 0 else float("nan") for a, b in zip(values, values[1:])]


def rounding_bound(setup, state, substeps):
    """How far rounding may lead two right programs apart in so many substeps [h]: tolerances.md, Independent simulator."""
    greatest = max(len(c) for c in state.clusters)
    size = max(np.abs(setup.rest).max(), np.abs(state.x).max()) / setup.h
    iteration = (np.sqrt(greatest / 3) + 8) * UNIT_ROUNDOFF * size
    substep = setup.iterations * (setup.iterations + 1) * 2 * iteration
    return float(substep * (substeps**1.5 / np.sqrt(3) + 1))
