#!/usr/bin/env python3
"""Compares cutproof's reference with a simulator that shares nothing with it (simulator.py).

Both programs run small scenes (scenes.py) from the scene's text. The test compares their setups and each frame: counts and
choices exactly, measured values within rounding. Simulators that are wrong in one line (wrong.py) have to be noticed.

Usage: independent_test.py CUTPROOF WORK [--only SCENE...]     CUTPROOF_WHOLE=1: every scene and every wrong line
Ends with 77 where numpy or h5py is missing."""
import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time
import types

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"  # matrices are small, and cores are shared
try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as missing:
    print(f"{missing.name} is missing (Debian: python3-numpy, python3-h5py)")
    sys.exit(77)

sys.dont_write_bytecode = True  # nothing is left in the source tree
from recording import Recording
from scenes import MESHES, SCENES, SHORT
from wrong import SHORT as SHORT_WRONG, WRONG

U = 2.0**-53
KINDS = ("positions", "velocities", "rotations", "impulses", "skin", "reaches")


class Bounds:
    """What rounding explains, for two programs, in SI units.

    An iteration rounds coordinates of at most E some eight times, each time by u E: in means, moments, rotations, goals,
    combination and contacts. Acceleration passes an error of iteration j on by at most K + 1 - j (Chebyshev polynomials of
    the second kind on [0, 1]). So two programs part by e = 2 · 8 u E K (K + 1) / 2 in a substep. That is e / dt in
    velocities, which later substeps add up. After N substeps velocities have parted by N e / dt, positions by e N (N + 1) / 2.
    With g the gap of eigenvalues (M12.1), a rotation turns by at most 24 dx / (h g): entries of N are off by 6 dx / h.
    A cut vertex multiplies errors of height by at most 16 (M8.3). Contacts may magnify errors; the factor 8 leaves room."""

    def __init__(self, simulator, extent, substeps, dt):
        K = max(1, simulator.scene["step"]["iterations"])
        h, e = simulator.body.h, 16 * U * extent * K * (K + 1) / 2
        self.x = e * substeps * (substeps + 1) / 2 + 4 * U * extent
        self.v = e * substeps / dt
        self.impulse = self.v * simulator.body.mass.sum()
        self.rotation = 24 * self.x / h / simulator.gap + 8 * U
        self.skin, self.reach = 16 * self.x, 16 * self.x / h
        self.center = 16 * U * extent


class Comparison:
    """Of one scene. `problem` says what differs first; `worst` has greatest deviations and their shares of the bound."""

    def __init__(self, recording, simulator):
        self.recording, self.simulator, self.problem, self.worst, self.removed = recording, simulator, None, {}, 0
        self.setup()
        self.substeps, self.extent, self.dt = 0, 0.0, 1e9
        for frame in range(len(recording.ends)):
            if self.problem is None:
                if frame:
                    self.dt = min(self.dt, simulator.setup.frames[frame - 1][0])
                    self.substeps += simulator.setup.substeps
                    simulator.run_frame()
                self.state(frame, recording.state(frame))

    def exactly(self, what, theirs, ours):
        if self.problem is None and not np.array_equal(np.asarray(theirs), np.asarray(ours)):
            self.problem = f"{what} differ"

    def within(self, what, theirs, ours, bound, unit=1):
        if self.problem is None:
            theirs, ours = np.asarray(theirs, float), np.asarray(ours, float)
            if theirs.shape != ours.shape:
                self.problem = f"{what}: {theirs.shape} and {ours.shape} numbers"
            elif theirs.size:
                deviation = abs(theirs - ours)
                kind = what.split(": ")[-1]
                share = np.max(deviation / np.reshape(bound, np.shape(bound) + (1,) * (deviation.ndim - np.ndim(bound))))
                old = self.worst.get(kind, (0, 0))
                self.worst[kind] = max(old[0], deviation.max() / unit), max(old[1], share)
                if not share <= 1:
                    self.problem = f"{what} differ by {deviation.max() / unit:.1e}, {share:.1e} times the bound"

    def setup(self):
        theirs, ours, body = self.recording.setup, self.simulator.setup, self.simulator.body
        self.exactly("nodes", theirs["body/node"], body.node)
        fitted = self.simulator.scene["body"]["fit_skin"]
        self.exactly("crossings", theirs["body/surface_crossing"], body.crossing.ravel() if fitted else [])
        self.exactly("numbers of frames", len(theirs["substep_length"]), len(ours.frames))
        small = 64 * U
        length = max(1.0, abs(body.rest).max())
        self.within("orientations", theirs["body"].attrs["orientation"], body.axes.T, 1e-10)
        self.within("origins", theirs["body"].attrs["origin"], body.origin, 1e-10 * length)
        self.within("masses", theirs["body/mass"], body.mass, small * body.mass[0], body.mass[0])
        self.within("substep lengths", theirs["substep_length"], [dt for dt, _ in ours.frames], small)
        self.within("walls", theirs["walls/offset"], [wall.offset for wall in ours.walls], small * length)
        for what, column in (("particles", [g.particles for g in ours.grips]), ("active", [g.active for g in ours.grips])):
            self.exactly(f"{what} of grips", theirs[f"grips/{what}"], np.concatenate([[]] + column))
        self.exactly("blades", theirs["blade"].attrs["present"], ours.blade is not None)
        if ours.blade is not None and self.problem is None:
            for name in ("length", "depth", "thickness", "friction"):
                self.within(f"{name} of the blade", theirs["blade"].attrs[name], getattr(ours.blade, name), small)
            moves = [move for _, moves in ours.frames for move in moves]
            self.exactly("lowered blades", theirs["blade_moves/down"], [move.down for move in moves])
            for end, column in (("from", "before"), ("to", "after")):
                for part in ("edge", "along", "back"):
                    poses = [getattr(getattr(move, column), part) for move in moves]
                    self.within(f"poses of the blade ({part})", theirs[f"blade_moves/{end}_{part}"], poses, small * len(moves))

    def state(self, frame, theirs):
        ours, h = self.simulator, self.simulator.body.h
        at = f"frame {frame}: "
        self.extent = max(self.extent, abs(theirs.x).max(), ours.setup.blade.length if ours.setup.blade else 0)
        bounds = Bounds(ours, self.extent, self.substeps, self.dt)
        for what in ("removed", "debris", "alive", "tau", "cap", "edge_covered"):
            self.exactly(at + what, getattr(theirs, what), getattr(ours, what))
        if self.problem is None and theirs.clusters != [sorted(c.members) for c in ours.clusters]:
            self.problem = at + f"clusters differ ({len(theirs.clusters)} and {len(ours.clusters)})"
        self.exactly(at + "numbers of clusters", theirs.numbers, [c.number for c in ours.clusters])
        self.exactly(at + "ambiguous rotations", theirs.flags, [c.flag for c in ours.clusters])
        self.within(at + "rest centres", theirs.centers, ours.cover.T, bounds.center, h)
        self.within(at + "masses of clusters", theirs.masses, ours.cover.M, 64 * U * ours.cover.M)
        self.within(at + "positions", theirs.x, ours.x, bounds.x, h)
        self.within(at + "velocities", theirs.v, ours.v, bounds.v or U)
        self.within(at + "impulses", theirs.impulse, ours.impulse, bounds.impulse or U)
        self.within(at + "rotations", theirs.rotations, [c.rotation for c in ours.clusters], bounds.rotation.max())
        self.removed += len(theirs.removed) + len(theirs.debris)
        if frame and ours.skin is not None:
            for what in ("owner", "direction", "triangles"):
                self.exactly(at + f"skin ({what})", getattr(theirs, what), getattr(ours.skin, what))
            self.within(at + "reaches", theirs.reach, ours.skin.reach, bounds.reach)
            self.within(at + "skin", theirs.skin, ours.skin.positions, bounds.skin, h)
        elif self.problem is None and len(theirs.owner):
            self.problem = at + "a skin in one alone"


def record(program, work, name, scene):
    folder = work / name
    path = folder / "run"
    if not folder.exists():
        folder.mkdir()
        (folder / "scene.json").write_text(json.dumps(scene))
        (folder / "body.obj").write_text(MESHES.get(name, ""))
        done = subprocess.run([program, "run", "scene.json", "--backend", "reference", "--record", "run"], cwd=folder,
                              capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"{name}: cutproof fails: {done.stdout}{done.stderr}")
    return Recording(path)


def variant(source, line, instead):
    """The module with one line replaced."""
    if source.count(line) != 1:
        sys.exit(f"wrong.py: the simulator has {source.count(line)} times: {line}")
    module = types.ModuleType("wrong_simulator")
    exec(compile(source.replace(line, instead), "wrong_simulator", "exec"), module.__dict__)
    return module


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--only", nargs="+", choices=SCENES)
    options = parser.parse_args()
    whole, program, work = os.environ.get("CUTPROOF_WHOLE") == "1", options.program.resolve(), options.work.resolve()
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    source = (pathlib.Path(__file__).parent / "simulator.py").read_text()
    failures, started = [], time.monotonic()
    import simulator as right
    names = options.only or (SCENES if whole else SHORT)
    for name in names:
        result = Comparison(record(program, work, name, SCENES[name]), right.Simulator(SCENES[name], work / name))
        ours, worst = result.simulator, result.worst
        # Greatest deviations (positions and skin in h), and in brackets their greatest share of the bound.
        told = ", ".join(f"{kind} {worst[kind][0]:.0e} ({worst[kind][1]:.0e})" for kind in KINDS if kind in worst)
        print(f"{name}: {ours.body.count} particles, {ours.frame} frames, {len(ours.clusters)} clusters, {result.removed} removed: "
              f"{told}", flush=True)
        if result.problem:
            failures.append(f"{name}: {result.problem}")
            print(f"  FAILS: {result.problem}", flush=True)
    print(f"Simulators that are wrong in one line ({time.monotonic() - started:.0f} s)", flush=True)
    for requirement, name, line, instead in WRONG:
        if name in names and (whole or options.only or requirement in SHORT_WRONG):
            recording = record(program, work, name, SCENES[name])
            try:
                problem = Comparison(recording, variant(source, line, instead).Simulator(SCENES[name], work / name)).problem
            except (ArithmeticError, LookupError, ValueError) as error:
                problem = repr(error)
            print(f"  {requirement} in {name}: {problem or 'NOT NOTICED'}", flush=True)
            if not problem:
                failures.append(f"{requirement} in {name}: a wrong line is not noticed")
    print(f"{time.monotonic() - started:.0f} s")
    shutil.rmtree(work, ignore_errors=True)
    print("all holds" if not failures else "\n".join(["what fails:"] + failures))
    return 1 if failures else 0


sys.exit(main())
