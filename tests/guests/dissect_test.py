"""The simulators of guests/examples/runs/, asked by `dissect`: right ones hold in drawn scenes, and each fault fails the
property that is named here. CUTPROOF names the program.

Usage: dissect_test.py            what a function may do wrong
       dissect_test.py right      right simulators in 50 scenes, or 1,000 (ci/nightly.sh)
       dissect_test.py SIMULATOR  every fault of this one is found in few scenes, and shrunk
"""
import importlib
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "guests" / "python"), str(ROOT / "guests" / "examples" / "runs")]
import cutproof  # noqa: E402
import scene  # noqa: E402

LIMITS = {"springs": "diagonals", "tetrahedra": "cells cut_resolution=1", "material_points": "", "clusters": ""}
PROGRAMS = {name: importlib.import_module(name) for name in LIMITS}
ACROSS, WITHIN, ANSWERS = "no coupling across pieces", "pieces coupled within", "answers"
SEED = int(os.environ.get("CUTPROOF_SEED", "1"))
# By fault: the property that fails, of all simulators or by simulator; others may fail as well.
FAULTS = {
    "heals": dict.fromkeys(LIMITS, ACROSS) | {"tetrahedra": "angular momentum"},
    "stale_index": {"springs": ACROSS, "tetrahedra": "angular momentum", "material_points": ACROSS,
                    "clusters": "linear momentum"},
    "glued_by_one_node": dict.fromkeys(LIMITS, ACROSS),
    "spin_lost": dict.fromkeys(LIMITS, "angular momentum"),
    "revive": dict.fromkeys(("springs", "material_points", "clusters"), "what is gone stays gone"),
    "teleport": dict.fromkeys(LIMITS, "no teleport") | {"tetrahedra": "no inverted cell"},
    "tear_elsewhere": dict.fromkeys(LIMITS, WITHIN),
    "fragment": dict.fromkeys(LIMITS, WITHIN),
    "momentum_from_nothing": dict.fromkeys(LIMITS, "linear momentum") | {"tetrahedra": "mass kept"},
    "inverted": {"tetrahedra": "no inverted cell"},
    # Of a run by itself these are right: a second run, a kick, a blade from the other side and another body show them.
    "race": dict.fromkeys(LIMITS, "determinism"),
    "global_solver": dict.fromkeys(LIMITS, "no ghost force"),
    "mirror": dict.fromkeys(LIMITS, ACROSS),
    "reset": dict.fromkeys(LIMITS, ANSWERS),
}


class Dissected(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="cutproof_dissect_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def judge(self, function, limits="", **options):
        return cutproof.judge(dissect=function, **{
            "limits": limits, "precision": "double", "promises": "free angular_momentum deterministic no_ghost_force mirror", "seed": SEED,
            "save": self.folder, **options})

    def of_gallery(self, name, fault=None, **options):
        PROGRAMS[name].kept.clear()
        kerf = 0.5 if fault == "revive" else 0
        return self.judge(scene.dissection(PROGRAMS[name].simulate, fault, kerf), LIMITS[name], name=name, **options)

    def failures(self, *arguments, **options):
        with self.assertRaises(cutproof.Failed) as caught:
            self.of_gallery(*arguments, **options)
        return {each["property"]: each for each in caught.exception.document["operations"][0]["failures"]}, \
            str(caught.exception)


class RightSimulators(Dissected):
    def test_hold_in_drawn_scenes(self):
        cases = 1000 if os.environ.get("CUTPROOF_WHOLE") else 50
        for name in LIMITS:
            with self.subTest(name):
                operation = self.of_gallery(name, cases=cases).operations["dissect"]
                self.assertEqual((operation["cases"], operation["refused"]), (cases, 0))
                judged = {each["property"]: each["judged"] for each in operation["properties"]}
                for wanted in (ACROSS, WITHIN, "linear momentum", "angular momentum", "determinism", "cut as drawn",
                               "no ghost force"):
                    self.assertGreater(judged[wanted], cases // 5, wanted)
                self.assertGreater(judged["mirrored run"], cases // 20)
                for kind in operation["kinds"]:
                    self.assertGreater(kind["as_drawn"], 0, kind)

    def test_a_kick_is_asked_of_who_repeats_itself(self):
        function = scene.dissection(PROGRAMS["springs"].simulate, "global_solver")
        operation = self.judge(function, LIMITS["springs"], cases=20, promises="no_ghost_force").operations["dissect"]
        judged = {each["property"]: each["judged"] for each in operation["properties"]}
        self.assertEqual(judged["no ghost force"], 0)


class Functions(Dissected):
    """What a function may do wrong that is no fault of a simulator."""

    def still(self, asked):
        """Nothing moves, and nothing is coupled: each frame as it is asked for."""
        for _ in range(asked.frames):
            yield dict(positions=asked.rest, velocities=asked.velocities)

    def said(self, function, **options):
        with self.assertRaises(cutproof.Failed) as caught:
            self.judge(function, **{"cases": 10, "shrink": 0, **options})
        return str(caught.exception)

    def test_what_a_scene_holds(self):
        seen = []

        def look(asked):
            seen.append(asked)
            n = len(asked.mass)
            self.assertEqual(asked.rest.shape, (n, 3))
            self.assertEqual(asked.blade.shape[::2], (asked.frames, 4))
            self.assertEqual(asked.blade.shape[3], 3)
            self.assertTrue(numpy.isnan(asked.blade[0]).all() and numpy.isnan(asked.blade[-1]).all())
            self.assertEqual(asked.held.dtype, bool)
            numpy.testing.assert_allclose(asked.rest, asked.nodes * asked.spacing, rtol=1e-6)
            between = abs(asked.nodes[asked.edges[:, 0]] - asked.nodes[asked.edges[:, 1]])
            self.assertTrue((between.sum(1) == 1).all())
            with self.assertRaises(ValueError):
                asked.rest[0] = 0
            raise cutproof.Refused

        self.assertIn("too little was judged: all 30 questions were refused", self.said(look, cases=30))
        self.assertEqual(len(seen), 30)

    def test_what_is_no_answer_is_named(self):
        def frames(change):
            def dissect(asked):
                made = list(self.still(asked))
                change(made, asked)
                return made
            return dissect

        for words, change in (
                ("frames, ", lambda made, asked: made.pop()),
                ("is no dict that holds positions", lambda made, asked: made[1].pop("positions")),
                ("frame 0 holds speed, which is not known", lambda made, asked: made[0].update(speed=1)),
                ("velocities of frame 2 has the shape", lambda made, asked: made[2].update(velocities=[[0, 0, 0]])),
                ("velocities is in 1 of", lambda made, asked: [each.pop("velocities") for each in made[1:]]),
                ("cells have 4 and 8 corners", lambda made, asked: made[1].update(cells=[[0] * 4])
                 or made[2].update(cells=[[0] * 8])),
                ("offsets of groups do not go from 0 to 2", lambda made, asked: made[0].update(groups=([0, 1], [0, 1]))),
                ("weights in some frames", lambda made, asked: made[0].update(groups=([0, 1], [0], [1.0]))
                 or made[1].update(groups=[[0]])),
                ("it starts with", lambda made, asked: [each.update(
                    positions=asked.rest[:-1], velocities=asked.velocities[:-1]) for each in made])):
            with self.subTest(words):
                self.assertIn(words, self.said(frames(change)))

    def test_limits_are_words(self):
        with self.assertRaises(cutproof.Error) as caught:
            self.judge(self.still, "one_knife", cases=1)
        self.assertIn("there is no limit 'one_knife'", " ".join(str(caught.exception).split()))


class Faults(Dissected):
    def test_are_found_and_shrunk(self):
        name, = sys.argv[1:]
        large, faults = [], {fault: by_simulator[name] for fault, by_simulator in FAULTS.items() if name in by_simulator}
        for fault, wanted in faults.items():
            with self.subTest(fault):
                failures, text = self.failures(name, fault, cases=20, shrink=10)
                self.assertIn(wanted, failures, text)
                found = failures[wanted]
                print(f"{name} {fault}: '{wanted}' in question {found['index']}, {found['size']}", file=sys.stderr)
                particles, strokes = (int(words.split()[0]) for words in found["size"].split(", ")[:2])
                large += [fault] if strokes > 3 or particles > 40 else []
        self.assertLessEqual(len(large), 0.2 * len(faults), large)

    def test_a_saved_scene_fails_again_and_so_does_its_run(self):
        failures, text = self.failures("springs", "heals", cases=20, shrink=3)
        file = failures[ACROSS]["file"]
        function = scene.dissection(PROGRAMS["springs"].simulate, "heals")
        with self.assertRaises(cutproof.Failed) as caught:
            cutproof.replay(file, dissect=function, promises="free")
        self.assertIn(ACROSS, str(caught.exception))
        self.assertTrue(cutproof.replay(file, dissect=scene.dissection(PROGRAMS["springs"].simulate), promises="free"))
        done = subprocess.run([os.environ["CUTPROOF"], "check", file.replace(".json", "_run")], capture_output=True,
                              text=True)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn(ACROSS, done.stdout)


if __name__ == "__main__":
    print(f"seed {SEED}", file=sys.stderr)
    unittest.main(argv=sys.argv[:1], verbosity=2,
                  defaultTest={"": "Functions", "right": "RightSimulators"}.get("".join(sys.argv[1:]), "Faults"))
