"""cutproof_run.py: writes what a simulator did as a run that cutproof judges. Copy this file into your project.

SPDX-License-Identifier: MIT

    with cutproof_run.Writer("run.h5", rest=x0, mass=m, spacing=h, gravity=g, edges=pairs, promises="free") as run:
        run.frame(x, time=t, velocities=v, groups=springs, blade=swept_quads)      # once a frame, the start included

"run.h5" is one HDF5 file (and run.h5.0 and .1 until it is closed). A folder, or "run_%06d.npz", is a series of NPZ
files. Both are written in segments of `flush` frames: a killed program loses only later frames. "run.npz" is a single
segment, written when the writer is closed.
"""
import glob
import os

import numpy

# Shapes by name: letters are any size, n is the number of particles.
_ONCE = dict(rest="n3", permutation="n", mass="n", gravity="3", spacing="", steps="", damping="", edges="e2", cells="c4 c8",
             nodes="n3", cut_resolution="", unit_roundoff="")
_BY_FRAME = dict(positions="n3", time="", velocities="n3", alive="n", held="n", removed="n", spin="n3",
                 contact_impulse="3", energy="", blade="q43 q33", vertices="v3")
_BY_SEGMENT = dict(parent="n", piece="n", mass="n", cells="c4 c8", triangles="t3", groups_offsets="g", groups_members="m",
                   groups_weights="m")
_WHOLE = {"edges", "cells", "nodes", "parent", "piece", "permutation", "triangles", "groups_offsets", "groups_members",
          "steps"}
_FLAGS = {"alive", "held", "removed"}


def _checked(shapes, n, arrays):
    """Copies, in types that a run can hold: single precision stays single."""
    made = {}
    for name, array in ((name, numpy.array(value)) for name, value in arrays.items() if value is not None):
        if name not in shapes:
            raise ValueError(f"{name}: no such name; wanted are {', '.join(shapes)}")
        wanted = [[n if c == "n" else int(c) if c.isdigit() else c for c in text] for text in shapes[name].split(" ")]
        if not any(len(shape) == array.ndim and all(size in (got, "n") or size in tuple("cegmqtv")
                                                    for size, got in zip(shape, array.shape)) for shape in wanted):
            shown = " or ".join("(" + ", ".join(map(str, shape)) + ")" for shape in wanted)
            raise ValueError(f"{name}: its shape is {array.shape}; wanted is {shown}")
        if name in _WHOLE and array.size and array.dtype.kind not in "iu":
            raise ValueError(f"{name}: its type is {array.dtype}; wanted are whole numbers")
        kept = array.dtype in (numpy.float32, numpy.float64)
        made[name] = array.astype(numpy.int32 if name in _WHOLE else numpy.uint8 if name in _FLAGS
                                  else array.dtype if kept else numpy.float64)
    return made


def _groups(groups, n):
    """From a tuple (offsets, members, weights or none), a list of lists, or an array with a group in each row."""
    if not isinstance(groups, tuple):
        groups = (numpy.cumsum([0] + [len(group) for group in groups]), [i for group in groups for i in group])
    made = _checked(_BY_SEGMENT, n, dict(zip(("groups_offsets", "groups_members", "groups_weights"), groups)))
    offsets, members = made["groups_offsets"], made["groups_members"]
    if len(offsets) == 0 or offsets[0] != 0 or (numpy.diff(offsets) < 0).any() or offsets[-1] != len(members):
        raise ValueError(f"groups_offsets: wanted are ascending numbers from 0 to {len(members)}, all members")
    if len(members) and not 0 <= members.min() <= members.max() < n:
        raise ValueError(f"groups_members: {members.min()} to {members.max()}; wanted are particles, 0 to {n - 1}")
    if len(made.get("groups_weights", members)) != len(members):
        raise ValueError(f"groups_weights: {len(made['groups_weights'])}; wanted are {len(members)}, as groups_members")
    return made


def grid_groups(positions, origin, cell, kernel, labels=0, alive=True):
    """A group for each grid node that material points reach: offsets, members, B-spline weights with greatest 1.
    Points of different labels have grids of their own: so a cut keeps pieces apart."""
    points = numpy.flatnonzero(numpy.isfinite(positions).all(1) & numpy.asarray(alive, bool))
    at = (numpy.asarray(positions, float)[points] - origin) / cell
    width = {"linear": 2, "quadratic": 3, "cubic": 4}[kernel]
    base = numpy.floor(at - (width - 2) / 2)
    d = abs((at - base)[:, None] - numpy.arange(width)[:, None])  # (points, nodes along an axis, axes)
    along = (1 - d if width == 2 else numpy.where(d < 0.5, 0.75 - d**2, (1.5 - d)**2 / 2) if width == 3 else
             numpy.where(d < 1, 4 - 6 * d**2 + 3 * d**3, (2 - d)**3) / 6)
    i, j, k = numpy.indices((width,) * 3).reshape(3, -1)
    weights = (along[:, i, 0] * along[:, j, 1] * along[:, k, 2]).ravel()
    label = numpy.repeat(numpy.broadcast_to(labels, len(positions))[points], width**3)
    node = (base[:, None] + numpy.stack([i, j, k], 1)).reshape(-1, 3)
    used = numpy.flatnonzero(weights > 0)
    order = used[numpy.lexsort((*node[used].T, label[used]))]
    new = numpy.diff(numpy.column_stack([label, node])[order], axis=0, prepend=numpy.nan).any(1)  # NaN: any() is true
    first = numpy.flatnonzero(new)
    offsets, members, weights = numpy.append(first, len(order)), numpy.repeat(points, width**3)[order], weights[order]
    greatest = numpy.maximum.reduceat(weights, first) if len(first) else weights
    return offsets, members, weights / numpy.repeat(greatest, numpy.diff(offsets))


class Writer:
    """Collects frames in a segment, which ends when it is full or when groups, cells or the number of particles change.
    `grid` = (origin, cell, "linear", "quadratic" or "cubic"): groups are made from the positions of material points."""

    def __init__(self, path, *, flush=16, grid=None, promises="", **once):
        self.path, self.flush, self.grid, self.number, self.frames = os.fspath(path), flush, grid, 0, []
        self.segment, self.known, self.n = {}, {}, 0
        self.hdf5 = self.path.endswith((".h5", ".hdf5"))
        self.single = self.path.endswith(".npz") and "%06d" not in self.path
        if not self.hdf5 and not self.path.endswith(".npz"):
            os.makedirs(self.path, exist_ok=True)
            self.path = os.path.join(self.path, "%06d.npz")
        self.once = _checked(_ONCE, "n", once)
        self.once.update(promises=promises if isinstance(promises, str) else " ".join(promises))
        self.halves, self.late = [self.path + ".0", self.path + ".1"], [[("/", self.once)], [("/", self.once)]]
        for old in glob.glob(glob.escape(self.path).replace("%06d", "[0-9]" * 6)) + [*self.halves, self.path + ".part"]:
            if os.path.exists(old):  # an older, longer series must not go on behind this one
                os.remove(old)

    def frame(self, positions, *, groups=None, labels=0, **arrays):
        """Appends a copy. Without groups or cells those of the last frame remain."""
        n, arrays = len(positions), dict(arrays, positions=positions)
        if n < self.n:
            raise ValueError(f"positions: {n} particles; wanted are at least {self.n}, as in the frame before")
        made = _checked(_BY_FRAME | _BY_SEGMENT, n, arrays)
        frame = {name: made.pop(name) for name in _BY_FRAME if name in made}
        if self.grid and groups is None:
            groups = grid_groups(positions, *self.grid, labels, frame.get("alive", True))
        made.update(_groups(groups, n) if groups is not None else {})
        if all(numpy.array_equal(value, self.known.get(name)) for name, value in made.items()):
            made = {}
        forms = [{name: (value.dtype, value.shape) for name, value in of.items()} for of in [frame] + self.frames[-1:]]
        if self.frames and (made or forms[0] != forms[1]):
            self._write()
        self.segment.update(made)
        self.known.update(made)
        self.frames.append(frame)
        self.n = n
        if not self.single and len(self.frames) >= self.flush:
            self._write()

    def _write(self, last=False):
        if self.single and not last:
            raise ValueError(f"{self.path}: one NPZ holds one segment, but groups changed: write run.h5 or a folder")
        arrays = self.segment | {name: numpy.stack([frame[name] for frame in self.frames]) for name in self.frames[0]}
        number, self.number, self.frames, self.segment = self.number, self.number + 1, [], {}
        if self.hdf5:
            self._append("%06d" % number, arrays)
        else:
            path = self.path.replace("%06d", "%06d" % number)
            with open(path + ".part", "wb") as file:
                numpy.savez(file, **arrays, **({} if number else self.once))
            os.replace(path + ".part", path)

    def _append(self, group, arrays):
        """Two files grow by turns, and the one that is whole gets the name: a kill while HDF5 changes a file in place
        can make all of it unreadable."""
        import h5py  # only here: NPZ needs none
        for late in self.late:
            late.append((group, arrays))
        with h5py.File(self.halves[0], "a") as file:
            for group, arrays in self.late[0]:
                for name, array in arrays.items():
                    file.require_group(group)[name] = numpy.bytes_(array) if isinstance(array, str) else array
        os.link(self.halves[0], self.path + ".part")
        os.replace(self.path + ".part", self.path)
        self.late[0] = []
        self.halves.reverse(), self.late.reverse()

    def close(self):
        """Writes what has been collected."""
        if self.frames:
            self._write(last=True)
        for half in self.halves:
            if os.path.exists(half):
                os.remove(half)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
