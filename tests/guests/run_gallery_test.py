"""The writer of runs, and the simulators of guests/examples/runs/: right ones conserve, and each fault shows as named.

Neither needs the program `cutproof`: what it finds in these runs is another test.
"""
import ast
import glob
import importlib
import itertools
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import h5py
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
GALLERY = ROOT / "guests" / "examples" / "runs"
sys.path[:0] = [str(ROOT / "guests" / "python"), str(GALLERY)]
import cutproof_run  # noqa: E402
import scene  # noqa: E402

PROGRAMS = {name: importlib.import_module(name) for name in ("springs", "tetrahedra", "material_points", "clusters")}
FRAMES, WITHDRAWN = 12, 8
BESIDE = {"tetrahedra": 0.05}


def small_scene(name, depth=1.0, kerf=0.0):
    body = scene.block(size=(6, 3, 2), kerf=kerf)
    body.update(frame_time=0.008, steps=4)
    return body, scene.blade_path(body, FRAMES, depth, at=BESIDE.get(name, 0.4), first=3, last=WITHDRAWN - 1)


def simulated(name, body, blade, fault=None):
    PROGRAMS[name].kept.clear()
    return list(PROGRAMS[name].simulate(body, blade, FRAMES, fault))


def groups_of(frame, body):
    if "labels" in frame:
        offsets, members, _ = cutproof_run.grid_groups(frame["positions"], 0, 2 * body["spacing"], "quadratic",
                                                       frame["labels"], frame["alive"])
        return np.split(members, offsets[1:-1])
    return frame["groups"] if "groups" in frame else frame["cells"]


def pieces_of(frame, body):
    return scene.pieces(len(frame["positions"]), groups_of(frame, body))


def momenta(frame, body):
    """Linear, and angular about the centre of mass: gravity does not change the latter, not even in Euler's steps."""
    mass, x, v = frame.get("mass", body["mass"])[:, None], frame["positions"], frame["velocities"]
    linear, centre = (mass * v).sum(0), (mass * x).sum(0) / mass.sum()
    spin = frame["spin"].sum(0) if "spin" in frame else 0
    return linear, (mass * np.cross(x, v)).sum(0) + spin - np.cross(centre, linear)


def apart(one, other):
    """How far two runs are from each other: infinitely if their particles, groups or the living differ."""
    worst = 0.0
    for a, b in zip(one, other):
        if a["positions"].shape != b["positions"].shape:
            return np.inf
        for name in ("groups", "labels", "cells", "alive"):
            if name in a and not (len(a[name]) == len(b[name]) and all(map(np.array_equal, a[name], b[name]))):
                return np.inf
        worst = max(worst, abs(a["positions"] - b["positions"]).max())
    return worst


def other_piece(name, body, blade, fault=None):
    """What the piece without particle 0 feels of a kick to the other one, after the cut."""
    plain = simulated(name, body, blade, fault)
    kicked = simulated(name, dict(body, kick=(WITHDRAWN + 1, np.array([0.2, 0.1, -0.5]))), blade, fault)
    piece = pieces_of(plain[-1], body)
    moved = abs(plain[-1]["positions"] - kicked[-1]["positions"]).max(1)
    return moved[piece != piece[0]].max(), moved[piece == piece[0]].max()


class RightSimulators(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenes = {name: small_scene(name) for name in PROGRAMS}
        cls.runs = {name: simulated(name, *cls.scenes[name]) for name in PROGRAMS}

    def each(self):
        for name in PROGRAMS:
            with self.subTest(name):
                yield name, *self.scenes[name], self.runs[name]

    def test_both_momenta_are_conserved(self):
        for name, body, _, run in self.each():
            linear, angular = momenta(run[0], body)
            for frame in run:
                fallen = linear + body["mass"].sum() * body["gravity"] * frame["time"]
                roundings = 100 * FRAMES * body["steps"] * np.finfo(float).eps
                now = momenta(frame, body)
                self.assertLess(abs(now[0] - fallen).max(), roundings * body["mass"].sum())
                self.assertLess(abs(now[1] - angular).max(), roundings * abs(angular).max() * 100)

    def test_cells_keep_their_volume(self):
        for frame in self.runs["tetrahedra"]:
            x, cells = frame["positions"], frame["cells"]
            volume = np.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]]) / 6
            np.testing.assert_allclose(volume, 1e-6 / 6, rtol=0.05)
            np.testing.assert_allclose(volume.sum(), 10e-6, rtol=0.01)

    def test_mass_is_conserved_where_vertices_are_split(self):
        for frame in self.runs["tetrahedra"]:
            np.testing.assert_allclose(frame["mass"].sum(), 36e-3, rtol=1e-14)

    def test_a_cut_through_makes_two_pieces_that_stay_two(self):
        for name, body, blade, run in self.each():
            self.assertEqual([pieces_of(frame, body).max() + 1 for frame in run[:4]], [1] * 4)
            self.assertEqual({pieces_of(frame, body).max() + 1 for frame in run[WITHDRAWN:]}, {2})
            rest = body["rest"][:, 0]
            piece = pieces_of(run[-1], body)[:len(rest)]
            left = rest < body["spacing"] * (2.2 if name != "tetrahedra" else 1.9)
            self.assertEqual(len(set(piece[left])), 1)
            right = rest > body["spacing"] * 2.2
            self.assertEqual(len(set(piece[right])), 1)
            self.assertNotEqual(piece[left][0], piece[right][0])

    def test_a_cut_in_part_makes_no_piece(self):
        for name in PROGRAMS:
            with self.subTest(name):
                body, blade = small_scene(name, depth=0.5)
                run = simulated(name, body, blade)
                self.assertEqual(pieces_of(run[-1], body).max(), 0)
                if name in ("springs", "tetrahedra"):  # labels and clusters are still connected around the tip
                    uncut = simulated(name, body, np.full_like(blade, np.nan))
                    self.assertGreater(apart(run, uncut), 1e-6)

    def test_the_blade_removes_what_is_within_its_kerf(self):
        for name in ("springs", "material_points", "clusters"):
            with self.subTest(name):
                body, blade = small_scene(name, kerf=0.005)
                run = simulated(name, body, blade)
                self.assertEqual(set(np.flatnonzero(run[-1]["removed"])),
                                 set(np.flatnonzero(body["nodes"][:, 0] == 2)))

    def test_no_piece_feels_a_kick_to_another(self):
        for name, body, blade, _ in self.each():
            felt, moved = other_piece(name, body, blade)
            self.assertEqual(felt, 0)
            self.assertGreater(moved, 1e-3)

    def test_a_point_among_held_ones_does_not_creep(self):
        body = scene.block(size=(5, 5, 5))
        held = (body["nodes"] != 2).any(1)
        body.update(held=held, velocities=np.where(held[:, None], 0, body["velocities"]))
        run = simulated("material_points", body, np.full((FRAMES, 1, 4, 3), np.nan))
        np.testing.assert_array_equal(run[-1]["positions"], body["rest"])

    def test_they_are_short(self):
        for name in PROGRAMS:
            right, own = lines_of((GALLERY / f"{name}.py").read_text())
            self.assertLessEqual(right, 60, name)
            self.assertLessEqual(own, 15, name)


def apart_in_place(one, other):
    """As apart(), of runs whose groups or cells may be in another order."""
    return max(abs(a["positions"][:36] - b["positions"][:36]).max() for a, b in zip(one, other))


def lines_of(source):
    """Lines of code without those of faults, and those that write the run."""
    tree = ast.parse(source)
    skipped, own = set(), set()
    for node in ast.walk(tree):
        lines = range(node.lineno, node.end_lineno + 1) if hasattr(node, "lineno") else ()
        if isinstance(node, (ast.Module, ast.FunctionDef)) and ast.get_docstring(node):
            skipped |= set(range(node.body[0].lineno, node.body[0].end_lineno + 1))
        elif isinstance(node, ast.If) and "__name__" in ast.unparse(node.test):
            own |= set(lines)
        elif isinstance(node, ast.If) and "fault" in ast.unparse(node.test):
            skipped |= set(range(node.lineno, node.body[-1].end_lineno + 1))
        elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) in ("FAULTS", "kept"):
            skipped |= set(lines)
    code = {number for number, line in enumerate(source.splitlines(), 1) if re.match(r"\s*[^\s#]", line)}
    return len(code - skipped - own), len(code & own)


# Of these a run by itself is right; run_test.py has the program find them.
SHOWN_BY_A_RELATION = {"units", "mirror", "reset", "race", "noise"}


class Faults(unittest.TestCase):

    def test_each_shows(self):
        for name, program in PROGRAMS.items():
            body, blade = small_scene(name)
            right = simulated(name, body, blade)
            for fault in set(program.FAULTS) - SHOWN_BY_A_RELATION:
                with self.subTest(f"{name} {fault}"):
                    look = getattr(self, f"look_at_{fault}", self.look_at_a_run)
                    look(name, body, blade, right, fault)
        PROGRAMS["springs"].kept.clear()

    def look_at_a_run(self, name, body, blade, right, fault):
        self.assertGreater(apart(right, simulated(name, body, blade, fault)), 1e-6)

    def look_at_heals(self, name, body, blade, right, fault):
        run = simulated(name, body, blade, fault)
        if name == "tetrahedra":  # cells stay apart, their vertices stick together
            felt, _ = other_piece(name, body, blade, fault)
            self.assertGreater(felt, 1e-3)
        else:
            self.assertEqual(pieces_of(run[-1], body).max(), 0)

    def look_at_glued_by_one_node(self, name, body, blade, right, fault):
        run = simulated(name, body, blade, fault)
        piece = pieces_of(right[-1], body)[:36]  # of the particles that were there before the cut
        joined = [set(piece[[i for i in group if i < 36]]) for group in groups_of(run[-1], body)]
        self.assertIn(2, map(len, joined))

    def look_at_spin_lost(self, name, body, blade, right, fault):
        run = simulated(name, body, blade, fault)
        linear, angular = momenta(run[0], body)
        now = momenta(run[-1], body)
        self.assertLess(abs(now[0] - linear - body["mass"].sum() * body["gravity"] * run[-1]["time"]).max(), 1e-13)
        self.assertGreater(abs(now[1] - angular).max(), 0.01 * abs(angular).max())

    def look_at_momentum_from_nothing(self, name, body, blade, right, fault):
        now = momenta(simulated(name, body, blade, fault)[-1], body)[0]
        self.assertGreater(abs(now - momenta(right[-1], body)[0]).max(), 1e-4 * abs(now).max())

    def look_at_revive(self, name, body, blade, right, fault):
        body, blade = small_scene(name, kerf=0.005)
        alive = np.array([frame["alive"] for frame in simulated(name, body, blade, fault)], int)
        self.assertTrue((np.diff(alive, axis=0) > 0).any())

    def look_at_teleport(self, name, body, blade, right, fault):
        jump = 0
        run = simulated(name, body, blade, fault)
        for before, after in zip(run, run[1:]):
            x = before["positions"]
            if "parent" in after:  # a new vertex comes from its parent
                x = np.concatenate([x, x[after["parent"][len(x):]]])
            unlike = after["positions"] - x - body["frame_time"] * after["velocities"]
            jump = max(jump, np.linalg.norm(unlike, axis=1).max())
        self.assertGreater(jump, 0.2 * body["spacing"])

    def look_at_tear_elsewhere(self, name, body, blade, right, fault):
        self.assertEqual(pieces_of(right[3], body).max(), 0)
        self.assertEqual(pieces_of(simulated(name, body, blade, fault)[3], body).max(), 1)

    def look_at_fragment(self, name, body, blade, right, fault):
        self.assertGreater(pieces_of(simulated(name, body, blade, fault)[-1], body).max(), 1)

    def look_at_inverted(self, name, body, blade, right, fault):
        frame = simulated(name, body, blade, fault)[-1]
        x, cells = frame["positions"], frame["cells"]
        self.assertLess(np.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]]).min(), 0)

    def look_at_global_solver(self, name, body, blade, right, fault):
        felt, moved = other_piece(name, body, blade, fault)
        self.assertGreater(felt, 1e-12)
        self.assertLess(felt, 0.1 * moved)


class Programs(unittest.TestCase):
    def test_they_write_runs(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, arguments in (("springs", ["--fault", "heals"]), ("tetrahedra", []), ("clusters", ["--again"]),
                                    ("material_points", ["--fault", "revive", "--kick", "11", "0.1", "0", "0"])):
                path = f"{folder}/{name}" + (".h5" if name != "clusters" else "")
                subprocess.run([sys.executable, GALLERY / f"{name}.py", path, "--frames", "12", *arguments], check=True)
                frames = read_run(path)
                self.assertEqual(len(frames), 12, name)
                self.assertIn("deterministic", text_of(path))
                self.assertEqual("groups_weights" in frames[0], name == "material_points")
                self.assertTrue("groups_members" in frames[-1] or "cells" in frames[-1])

    def test_a_scene_that_was_saved_gives_the_same_run(self):
        with tempfile.TemporaryDirectory() as folder:
            program = [sys.executable, GALLERY / "springs.py"]
            subprocess.run(program + [f"{folder}/a.h5", "--frames", "6", "--seed", "3", "--save-scene",
                                      f"{folder}/scene.npz"], check=True)
            subprocess.run(program + [f"{folder}/b.h5", "--frames", "6", "--scene", f"{folder}/scene.npz"], check=True)
            for a, b in zip(read_run(f"{folder}/a.h5"), read_run(f"{folder}/b.h5")):
                np.testing.assert_array_equal(a["positions"], b["positions"])


def segments(path):
    """What is given once, and the arrays of each segment."""
    if path.endswith(".h5"):
        with h5py.File(path) as file:
            once = {name: item[()] for name, item in file.items() if isinstance(item, h5py.Dataset)}
            return once, [{name: item[()] for name, item in file[number].items()}
                          for number in sorted(file) if re.fullmatch(r"\d{6}", number)]
    names = sorted(glob.glob(path.replace("%06d", "*") if path.endswith(".npz") else f"{path}/*.npz"))
    parts = [dict(np.load(name).items()) for name in names]
    once = {name: parts[0].pop(name) for name in list(parts[0]) if name in cutproof_run._ONCE and name != "cells"
            and parts[0][name].ndim < 3 or name == "promises"}
    return once, parts


def text_of(path):
    promises = segments(path)[0]["promises"]
    return promises.decode() if isinstance(promises, bytes) else str(promises)


def read_run(path):
    """The frames, each with the groups that it has."""
    frames, known = [], {}
    for segment in segments(path)[1]:
        if "groups_offsets" in segment:
            known.pop("groups_weights", None)
        known.update((name, array) for name, array in segment.items() if name in cutproof_run._BY_SEGMENT)
        for k in range(len(segment["positions"])):
            frames.append(known | {name: array[k] for name, array in segment.items()
                                   if name in cutproof_run._BY_FRAME})
    return frames


class WriterTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def test_all_kinds_of_files_hold_the_same_numbers(self):
        random = np.random.default_rng(1)
        given = [dict(positions=random.normal(size=(5, 3)), velocities=random.normal(size=(5, 3)), time=0.1 * f,
                      alive=[True] * 5, blade=np.full((2, 4, 3), np.nan), energy=f) for f in range(7)]
        kinds = [self.path(name) for name in ("a.h5", "a.npz", "b", "c_%06d.npz")]
        for path in kinds:
            with cutproof_run.Writer(path, flush=3, rest=np.zeros((5, 3)), spacing=0.1, promises=["free", "energy"],
                                     gravity=[0, 0, -9.81], steps=4) as run:
                for frame in given:
                    run.frame(**frame, groups=[[0, 1, 2], [3, 4]])
            self.assertEqual(text_of(path), "free energy")
            self.assertEqual([len(part["positions"]) for part in segments(path)[1]],
                             [7] if path == kinds[1] else [3, 3, 1])
            self.assertEqual(sum("groups_members" in part for part in segments(path)[1]), 1)
            np.testing.assert_array_equal(segments(path)[0]["gravity"], [0, 0, -9.81])
            for frame, wanted in zip(read_run(path), given, strict=True):
                for name, value in wanted.items():
                    np.testing.assert_array_equal(frame[name], value, err_msg=f"{path} {name}")
                np.testing.assert_array_equal(frame["groups_offsets"], [0, 3, 5])

    def test_a_segment_ends_where_groups_or_numbers_change(self):
        with cutproof_run.Writer(self.path("a.h5")) as run:
            run.frame(np.zeros((2, 3)), groups=[[0, 1]])
            run.frame(np.zeros((2, 3)))
            run.frame(np.zeros((2, 3)), groups=([0, 1], [0], [1.0]))
            run.frame(np.zeros((3, 3)), parent=[-1, -1, 0])
            run.frame(np.zeros((3, 3)), parent=[-1, -1, 0], vertices=np.zeros((1, 3)), triangles=[[0, 0, 0]])
            run.frame(np.zeros((3, 3)))
        parts = segments(self.path("a.h5"))[1]
        self.assertEqual([part["positions"].shape for part in parts], [(2, 2, 3), (1, 2, 3)] + 3 * [(1, 3, 3)])
        self.assertEqual(["groups_members" in part for part in parts], [True, True, False, False, False])
        self.assertEqual(["vertices" in part for part in parts], [False, False, False, True, False])

    def test_a_skin_moves_within_a_segment_and_new_triangles_begin_one(self):
        with cutproof_run.Writer(self.path("a.h5")) as run:
            for frame in range(5):
                run.frame(np.zeros((2, 3)), vertices=np.full((4, 3), float(frame)),
                          triangles=[[0, 1, 2]] if frame < 3 else [[0, 1, 2], [1, 2, 3]])
        parts = segments(self.path("a.h5"))[1]
        self.assertEqual([part["vertices"].shape for part in parts], [(3, 4, 3), (2, 4, 3)])
        self.assertEqual([part["triangles"].shape for part in parts], [(1, 3), (2, 3)])
        self.assertEqual(list(parts[0]["vertices"][:, 0, 0]), [0, 1, 2])

    def test_one_npz_refuses_a_second_segment_and_keeps_the_first(self):
        with self.assertRaisesRegex(ValueError, "one segment"):
            with cutproof_run.Writer(self.path("a.npz")) as run:
                run.frame(np.zeros((2, 3)), groups=[[0, 1]])
                run.frame(np.zeros((2, 3)), groups=[[0]])
        self.assertEqual(len(read_run(self.path("a.npz"))), 1)

    def test_wrong_arrays_are_refused_by_name(self):
        run = cutproof_run.Writer(self.path("a.h5"))
        x = np.zeros((4, 3))
        for problem, arrays in (
                (r"positions: its shape is \(4, 2\); wanted is \(4, 3\)", dict(positions=x[:, :2])),
                (r"velocities: its shape is \(3, 3\); wanted is \(4, 3\)", dict(velocities=x[:3])),
                (r"blade: its shape is \(1, 4, 2\); wanted is \(q, 4, 3\) or \(q, 3, 3\)",
                 dict(blade=np.zeros((1, 4, 2)))),
                ("velocity: no such name", dict(velocity=x)),
                ("cells: its type is float64", dict(cells=np.zeros((1, 4)))),
                ("groups_members: 0 to 4; wanted are particles, 0 to 3", dict(groups=[[0, 4]])),
                ("groups_offsets: wanted are ascending", dict(groups=([0, 2, 1], [0]))),
                ("groups_weights: 1; wanted are 2", dict(groups=([0, 2], [0, 1], [1.0])))):
            with self.subTest(problem), self.assertRaisesRegex(ValueError, problem):
                run.frame(**(dict(positions=x) | arrays))
        run.frame(x)
        with self.assertRaisesRegex(ValueError, "3 particles; wanted are at least 4"):
            run.frame(x[:3])
        with self.assertRaisesRegex(ValueError, r"gravity: its shape is \(\); wanted is \(3\)"):
            cutproof_run.Writer(self.path("b.h5"), gravity=9.81)

    def test_single_precision_stays_and_frames_are_copies(self):
        x = np.ones((2, 3), np.float32)
        with cutproof_run.Writer(self.path("a.h5")) as run:
            run.frame(x)
            x[:] = 2
            run.frame(x)
        positions = segments(self.path("a.h5"))[1][0]["positions"]
        self.assertEqual(positions.dtype, np.float32)
        np.testing.assert_array_equal(positions[:, 0, 0], [1, 2])

    def test_groups_of_a_grid(self):
        x = np.random.default_rng(2).uniform(-1, 1, size=(12, 3))
        x[5] = np.nan
        kernels = {"linear": lambda d: np.maximum(0, 1 - d),
                   "quadratic": lambda d: np.where(d < 0.5, 0.75 - d**2, np.maximum(0, 1.5 - d)**2 / 2),
                   "cubic": lambda d: np.where(d < 1, 2 / 3 - d**2 + d**3 / 2, np.maximum(0, 2 - d)**3 / 6)}
        for kernel, weight in kernels.items():
            wanted = []
            for node in itertools.product(range(-4, 5), repeat=3):
                reached = np.nan_to_num(np.prod(weight(abs((x - 0.1) / 0.7 - node)), 1))
                for label in (0, 1):
                    group = np.flatnonzero((reached > 0) & (np.arange(12) % 2 == label))
                    if len(group):
                        wanted.append((group, reached[group] / reached[group].max()))
            offsets, members, weights = cutproof_run.grid_groups(x, 0.1, 0.7, kernel, np.arange(12) % 2)
            self.assertEqual(len(offsets) - 1, len(wanted), kernel)
            made = {}
            for a, b in zip(offsets, offsets[1:]):
                made.setdefault(tuple(members[a:b]), []).append(weights[a:b])
            for group, shares in wanted:
                self.assertLess(min(abs(found - shares).max() for found in made[tuple(group)]), 1e-9)

    def test_an_older_series_does_not_go_on_behind_a_new_one(self):
        for count in (5, 2):
            with cutproof_run.Writer(self.path("run"), flush=1) as run:
                for _ in range(count):
                    run.frame(np.zeros((1, 3)))
        self.assertEqual(len(read_run(self.path("run"))), 2)

    def test_the_file_that_has_the_name_is_never_open_for_writing(self):
        path, opened = self.path("a.h5"), []

        def open_file(file, mode, original=h5py.File):
            opened.append(os.path.exists(path) and os.path.exists(file) and os.path.samefile(file, path))
            return original(file, mode)

        with cutproof_run.Writer(path, flush=1) as run, unittest.mock.patch.object(h5py, "File", open_file):
            for f in range(5):
                run.frame([[float(f)] * 3])
        self.assertEqual(opened, [False] * 5)
        self.assertEqual([frame["positions"][0, 0] for frame in read_run(path)], [0, 1, 2, 3, 4])
        self.assertEqual(os.listdir(self.folder), ["a.h5"])

    def test_what_was_written_before_a_kill_is_read(self):
        program = ("import sys; sys.path.insert(0, sys.argv[1]); import cutproof_run\n"
                   "run = cutproof_run.Writer(sys.argv[2], flush=2)\n"
                   "for f in range(10**6):\n"
                   "    run.frame([[float(f)] * 3], groups=[[0]] * (1 + f % 2))\n"
                   "    if f % 16 == 1: print(f, flush=True)\n")
        for name in ("a.h5", "b"):
            with self.subTest(name):
                child = subprocess.Popen([sys.executable, "-c", program, ROOT / "guests" / "python", self.path(name)],
                                         stdout=subprocess.PIPE, text=True)
                for _ in range(3):
                    last = int(child.stdout.readline())
                child.kill()
                child.wait()
                child.stdout.close()
                frames = read_run(self.path(name))
                self.assertGreaterEqual(len(frames), last)
                np.testing.assert_array_equal([frame["positions"][0, 0] for frame in frames], np.arange(len(frames)))


if __name__ == "__main__":
    unittest.main()
