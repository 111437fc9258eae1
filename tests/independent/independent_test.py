#!/usr/bin/env python3
"""Holds cutproof against a simulator that shares nothing with it (simulator.py): positions, removals and clusters frame
by frame at the same substeps; errors and orders of convergence as the time step is refined, with detection in every
substep; and, with --all, the distances between levels that `cutproof tune --reference limit` prints. Simulators that are
wrong on purpose have to be rejected, or nothing was shown.

Usage: independent_test.py CUTPROOF SOURCE WORK [--all] [--only PART...] [--json FILE]
Ends with 77 where numpy or h5py is missing."""
import argparse
import json
import math
import pathlib
import shutil
import subprocess
import sys
import time

try:
    import h5py  # noqa: F401
    import numpy as np
except ImportError as missing:
    print(f"{missing.name} is missing (Debian: python3-numpy, python3-h5py)")
    sys.exit(77)

sys.dont_write_bytecode = True  # nothing is left in the source tree
from measures import Trajectory, apart, errors, orders, rounding_bound
from recording import Recording
from simulator import Simulator, Wrong

ORDER_TOLERANCE = 0.1
LEAST_ORDER = 0.7  # with retardation
PARTS = ("trajectories", "orders", "solved", "printed", "wrong")

parser = argparse.ArgumentParser()
parser.add_argument("program", type=pathlib.Path)
parser.add_argument("source", type=pathlib.Path)
parser.add_argument("work", type=pathlib.Path)
parser.add_argument("--all", action="store_true", help="twelve scenes, deeper levels, and the levels that tune prints")
parser.add_argument("--only", nargs="+", default=PARTS, choices=PARTS)
parser.add_argument("--json", type=pathlib.Path, help="write what was measured")
options = parser.parse_args()
program, work = options.program.resolve(), options.work.resolve()
shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
failures, document = [], {}


def check(holds, what):
    if not holds:
        failures.append(what)
        print("  FAILS:", what)


def scene_path(scene):
    return options.source.resolve() / "fixtures/scenes" / f"{scene}.json"


def recorded(scene, frames=None, **settings):
    """Made by the program. Settings: substeps=8 for step.substeps=8."""
    command = [program, "run", scene_path(scene), "--record", "run", "--set", "skin.wanted=false"]
    for name, value in settings.items():
        command += ["--set", f"{'detect' if name in ('every', 'remove') else 'step'}.{name}={value}"]
    done = subprocess.run(command + (["--frames", str(frames)] if frames else []), cwd=work, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return Recording(work / "run")


def both(recording, wrong=None, solve_to=None):
    """The program's trajectory and the independent one, at the ends of the scene's frames. And the first frame of the
    schedule in which numbers of clusters differ."""
    length = json.loads(recording.scene).get("frame", {}).get("length", 0.016)
    ours, theirs = Trajectory(recording.setup.h), Trajectory(recording.setup.h)
    simulator = Simulator(recording.setup, recording.state, wrong, solve_to)
    first_difference = None
    for frame, end in enumerate(recording.times):
        simulator.run_frame()
        x, alive, clusters = recording.after(frame)
        if clusters != len(simulator.cover.sets) and first_difference is None:
            first_difference = frame
        if abs(end / length - round(end / length)) < 1e-6:
            ours.add(round(end / length), x, alive)
            theirs.add(round(end / length), simulator.x, simulator.alive)
    return ours, theirs, first_difference


def trajectories_agree(scene, frames=None, wrong=None, **settings):
    """What is wrong with it; nothing if they agree."""
    recording = recorded(scene, frames, **settings)
    ours, theirs, clusters = both(recording, wrong)
    found = apart(ours, theirs)
    substeps = len(recording.times) * recording.setup.substeps
    bound = rounding_bound(recording.setup, recording.state, substeps)
    removed = recording.count - int(min(alive.sum() for _, alive in ours.at.values()))
    print(f"  {scene}{''.join(f', {k}={v}' for k, v in settings.items())}: {recording.count} particles, {len(recording.state.clusters)} clusters, {substeps} substeps, "
          f"{removed} removed: {found.worst:.1e} h apart at worst, bound {bound:.1e}; {found.differ} removed in one alone"
          + ("" if clusters is None else f"; other clusters from frame {clusters} on"), flush=True)
    if wrong is None:
        document.setdefault("trajectories", []).append(
            {"scene": scene, "settings": settings, "particles": recording.count, "substeps": substeps, "removed": removed,
             "worst_h": found.worst, "bound_h": bound, "removed_in_one": found.differ})
    problems = []
    if not found.worst <= bound:
        problems.append(f"{scene}: {found.worst:.1e} h apart, rounding explains {bound:.1e} h")
    if found.differ:
        problems.append(f"{scene}: {found.differ} particles are removed in one alone")
    if clusters is not None:
        problems.append(f"{scene}: other clusters from frame {clusters} on")
    return problems


def orders_agree(scene, substeps, frames=None, wrong=None, solve_to=None, least=None, **settings):
    """What is wrong with the orders; nothing if they agree, and, of RMS distances, none is below `least`."""
    levels = ([], [])
    for count in substeps:
        pair = both(recorded(scene, frames, substeps=count, every="substep", **settings), wrong, solve_to)
        levels[0].append(pair[0])
        levels[1].append(pair[1])
    print(f"  {scene}{f', {frames} frames' if frames else ''}{', every substep solved' if solve_to else ''}: distance of "
          f"{' '.join(f'{n}-{2 * n}' for n in substeps[:-1])} substeps a frame, in h; order")
    rows, problems = {}, []
    for who, trajectories in zip(("cutproof", "independent"), levels):
        found = errors(trajectories)
        for norm in ("rms", "worst"):
            values = [getattr(e, norm) for e in found]
            rows[who, norm] = (values, orders(values))
            print(f"    {who:11} {norm:5} {' '.join(f'{v:.3e}' for v in values)}; {' '.join(f'{p:.4f}' for p in orders(values))}",
                  flush=True)
        print(f"    {who:11} removed in one alone: {' '.join(str(e.differ) for e in found)}")
        rows[who, "differ"] = [e.differ for e in found]
    for norm in ("rms", "worst"):
        for k, (p, q) in enumerate(zip(rows["cutproof", norm][1], rows["independent", norm][1])):
            if not abs(p - q) <= ORDER_TOLERANCE:
                problems.append(f"{scene}: order {q:.2f} ({norm}, {substeps[k]} to {4 * substeps[k]} substeps), cutproof "
                                f"has {p:.2f}")
            if least is not None and norm == "rms" and not q >= least:
                problems.append(f"{scene}: order {q:.2f} ({substeps[k]} to {4 * substeps[k]} substeps)")
    if wrong is None:
        document.setdefault("orders", []).append(
            {"scene": scene, "substeps": list(substeps), "frames": frames, "solved": solve_to is not None,
             "settings": settings, **{f"{who}_{norm}": rows[who, norm] for who, norm in rows}})
    return problems


def printed_orders_agree(scene, frames=None, **settings):
    """The levels of `cutproof tune --reference limit`, which never come as near as is asked for here, so that it ends
    before its search; and the same levels by the independent simulator."""
    command = [program, "tune", scene_path(scene), "--tolerance", "1e-9", "--json", "tune.json", "--set", "skin.wanted=false"]
    for name, value in settings.items():
        command += ["--set", f"{'detect' if name in ('every', 'remove') else 'step'}.{name}={value}"]
    done = subprocess.run(command + (["--frames", str(frames)] if frames else []), cwd=work, capture_output=True, text=True)
    assert done.returncode == 1, done.stdout + done.stderr
    levels = json.loads((work / "tune.json").read_text())["reference"]["levels"]
    trajectories = [both(recorded(scene, frames, substeps=level["substeps"], iterations=level["iterations"],
                                  acceleration="none", **settings))[1] for level in levels]
    printed = [level["apart_h"] for level in levels[1:]]
    own = [e.rms for e in errors(trajectories)]
    print(f"  {scene}{f', {frames} frames' if frames else ''} ({', '.join(f'{k}={v}' for k, v in settings.items()) or 'as given'}): "
          f"{' '.join('%d×%d' % (l['substeps'], l['iterations']) for l in levels)}")
    for who, values in (("cutproof tune", printed), ("independent", own)):
        print(f"    {who:13} rms {' '.join(f'{v:.3e}' for v in values)}; {' '.join(f'{p:.4f}' for p in orders(values))}", flush=True)
    document.setdefault("printed", []).append(
        {"scene": scene, "frames": frames, "settings": settings, "levels": levels, "independent_h": own,
         "orders": orders(printed), "independent_orders": orders(own)})
    return [f"{scene}: order {q:.2f}, cutproof tune prints {p:.2f}" for p, q in zip(orders(printed), orders(own))
            if not abs(p - q) <= ORDER_TOLERANCE]


def section(title):
    print(f"{title} ({time.monotonic() - started:.0f} s)", flush=True)


started = time.monotonic()
if "trajectories" in options.only:
    section("Frame by frame, beside the program at the same substeps")
    cases = [("small_block", None), ("three_cuts", 24), ("uniform_stretch", 5), ("cuboid_press", 16)]
    if options.all:
        cases = [(scene, None) for scene in (
            "small_block", "three_cuts", "cuboid_press", "uniform_stretch", "uniform_stretch_strain", "kidney_arc",
            "kidney_discontinuous", "liver_cut", "irregular_sampled", "irregular_sampled_covered", "cluster_growth",
            "kidney_37704")]
    for scene, frames in cases:
        for problem in trajectories_agree(scene, frames):
            check(False, problem)
    for problem in trajectories_agree("small_block", remove="one", every="substep"):
        check(False, problem)
    for scene, frames in [("small_block", None), ("cuboid_press", None if options.all else 25),
                          ("kidney_arc", None if options.all else 5)]:
        for problem in trajectories_agree(scene, frames, remove="one", retardation=0.004):
            check(False, problem)

if "orders" in options.only:
    section("Orders, with detection in every substep")
    cases = [("uniform_stretch", (8, 16, 32, 64), 2), ("small_block", (4, 8, 16), 12)]
    if options.all:
        cases = [("uniform_stretch", (4, 8, 16, 32, 64), 20), ("small_block", (4, 8, 16, 32, 64), None),
                 ("three_cuts", (4, 8, 16), None), ("cuboid_press", (4, 8, 16), None)]
    for scene, substeps, frames in cases:
        for problem in orders_agree(scene, substeps, frames):
            check(False, problem)

if "orders" in options.only:
    # With a retardation as long as the time step that scenes are given, implicit Euler is of first order on them.
    section("Orders with retardation")
    cases = [("uniform_stretch", (8, 16, 32, 64), 2), ("small_block", (16, 32, 64), 10)]
    if options.all:
        cases = [("uniform_stretch", (8, 16, 32, 64), 20), ("small_block", (8, 16, 32, 64), None)]
    for scene, substeps, frames in cases:
        for problem in orders_agree(scene, substeps, frames, least=LEAST_ORDER, retardation=0.004, remove="one"):
            check(False, problem)

if options.all and "solved" in options.only:
    # The program by iterations enough for every level, the independent one until nothing moves: of the time step alone.
    section("Orders where every substep is solved")
    for scene, substeps, frames in [("uniform_stretch", (8, 16, 32, 64, 128, 256), 2), ("small_block", (4, 8, 16, 32), 30)]:
        for problem in orders_agree(scene, substeps, frames, solve_to=1e-11, iterations=40):
            check(False, problem)

if options.all and "printed" in options.only:
    section("Orders that the program prints")
    for scene, frames, settings in [("uniform_stretch", 4, {}), ("small_block", None, {}),
                                    ("small_block", 12, {"every": "substep"})]:
        for problem in printed_orders_agree(scene, frames, **settings):
            check(False, problem)

if "wrong" in options.only:
    section("Simulators that are wrong on purpose")
    for name, scene, frames, wrong in (
            ("damping a thousandth too strong", "small_block", 3, Wrong(damping=1.001)),
            ("gravity a substep late", "small_block", 3, Wrong(late_gravity=True)),
            ("detection a frame late", "small_block", 8, Wrong(detect_late=True)),
            ("a retardation that is none", "small_block", 3, Wrong(retardation=0)),
            ("a thousandth too much retardation", "small_block", 3, Wrong(retardation=1.001)),
            ("what is cut is not split", "three_cuts", 10, Wrong(keep_cut_clusters=True))):
        print(f" {name}:")
        retarded = {"retardation": 0.004} if wrong.retardation != 1 else {}
        check(trajectories_agree(scene, frames, wrong, **retarded), f"{name}: not found")
    stiff = 1e5 * 0.004**2
    for name, scene, substeps, frames, wrong in (
            ("s of 4 ms, whatever the time step", "uniform_stretch", (4, 8, 16), 2, Wrong(relaxation=stiff / (1 + stiff))),
            ("velocities damped by substeps, not by time", "small_block", (4, 8, 16), 4, Wrong(decay=math.exp(-2 * 0.004)))):
        print(f" {name}:")
        # With the scene's own four substeps both are right; only what becomes of it as the time step shrinks tells.
        check(not trajectories_agree(scene, frames, wrong), f"{name}: not right where it should be")
        problems = orders_agree(scene, substeps, frames, wrong)
        check(problems, f"{name}: its order is taken for right")
        print("    found:", "; ".join(problems))

section("Done")
if options.json:
    options.json.write_text(json.dumps(document, indent=1) + "\n")
shutil.rmtree(work, ignore_errors=True)
print("all holds" if not failures else "\n".join(["what fails:"] + failures))
sys.exit(1 if failures else 0)
