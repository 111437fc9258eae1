"""Runs of the simulators in guests/examples/runs, judged by the program: right ones hold, and each fault that one run
shows fails the property that is named here, each that two runs show a relation.

Usage: run_test.py           right simulators, and what a run may look like
       run_test.py Related   right simulators keep every relation
       run_test.py Faults    every fault fails what is named here
The environment names the program (CUTPROOF).
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
from xml.etree import ElementTree

import h5py
import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "guests" / "python"))
import cutproof  # noqa: E402
import cutproof_run  # noqa: E402
sys.path.insert(0, str(ROOT / "tests" / "cli"))
from schemas import Schemas, in_words  # noqa: E402

SCHEMAS = Schemas()
SIMULATORS = ("springs", "tetrahedra", "material_points", "clusters")
ACROSS, WITHIN = "no coupling across pieces", "pieces coupled within"
# By fault: the property that has to fail, of all simulators or by simulator; others may fail as well.
FAULTS = {
    "heals": {"springs": ACROSS, "tetrahedra": "angular momentum", "material_points": ACROSS, "clusters": ACROSS},
    "stale_index": {"springs": ACROSS, "tetrahedra": "angular momentum", "material_points": ACROSS,
                    "clusters": "linear momentum"},
    "glued_by_one_node": dict.fromkeys(SIMULATORS, ACROSS),
    "spin_lost": dict.fromkeys(SIMULATORS, "angular momentum"),
    "revive": {"springs": "what is gone stays gone", "material_points": "what is gone stays gone",
               "clusters": "what is gone stays gone"},
    "teleport": dict.fromkeys(SIMULATORS, "no teleport") | {"tetrahedra": "no inverted cell"},
    "tear_elsewhere": dict.fromkeys(SIMULATORS, WITHIN),
    "fragment": dict.fromkeys(SIMULATORS, WITHIN),
    "momentum_from_nothing": dict.fromkeys(SIMULATORS, "linear momentum") | {"tetrahedra": "mass kept"},
    "inverted": {"tetrahedra": "no inverted cell"},
    "volume": {"tetrahedra": "tissue kept"},
}

# By fault that only a second run shows: the map that shows it, and of springs the property that has to fail.
RELATED = {"units": ("units:4,4,16", "related positions"), "mirror": ("mirror:x", "related coupling"),
           "reset": ("reset", "related coupling"), "race": ("same", "same bits")}
DIMENSIONS = ("stiffness=-1,-2,1", "frame_time=0,1,0", "kerf=1,0,0")


class JudgedRuns(unittest.TestCase):
    """What tests of runs share: a folder, and the program's word on a run."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="cutproof_runs_")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def check(self, path, *options, env=None):
        """The exit status, the document, and what is printed; `memory` is then the most that the program had [bytes]."""
        document, errors = self.folder / "verdicts.json", self.folder / "errors"
        with errors.open("w") as file:
            program = subprocess.Popen([os.environ["CUTPROOF"], "check", path, *options, "--json", document], text=True,
                                       stdout=subprocess.PIPE, stderr=file, env=os.environ | (env or {}))
            with program.stdout:
                text = program.stdout.read()
            _, status, used = os.wait4(program.pid, 0)
        program.returncode, self.memory = os.waitstatus_to_exitcode(status), 1024 * used.ru_maxrss
        self.assertIn(program.returncode, (0, 1), errors.read_text())
        return program.returncode, self.read(document), text

    def relate(self, *arguments):
        document = self.folder / "related.json"
        done = subprocess.run([os.environ["CUTPROOF"], "relate", *arguments, "--json", document], capture_output=True,
                              text=True)
        self.assertIn(done.returncode, (0, 1), done.stderr)
        return done.returncode, self.read(document), done.stdout

    def read(self, file):
        document = json.loads(file.read_text())
        self.assertEqual([in_words(error) for error in SCHEMAS.errors(document)], [])
        return document

    def failed(self, document):
        return [verdict["property"] for verdict in document["verdicts"] if not verdict["holds"]]


class Simulated(JudgedRuns):
    """Runs of the gallery."""

    def simulate(self, simulator, name="run.h5", *options):
        path = self.folder / name
        subprocess.run(["/usr/bin/python3", "-B", ROOT / f"guests/examples/runs/{simulator}.py", path, *options],
                       check=True, stdout=subprocess.DEVNULL)
        return path

    def related(self, simulator, word, *options, noise=(), bits=False):
        """Two runs that must correspond by this map, made as a user would."""
        scene, image = self.folder / "scene.npz", self.folder / "image.npz"
        first = self.simulate(simulator, "first.h5", "--frames", "12", "--save-scene", scene, *options)
        second = ["--again"] if word == "reset" else ["--frames", "12"]
        if ":" in word or word == "permute":
            subprocess.run([os.environ["CUTPROOF"], "relate", "--make", word, scene, image,
                            *(f"--dimension={each}" for each in DIMENSIONS)], check=True, stdout=subprocess.DEVNULL)
            second += ["--scene", image]
        other = self.simulate(simulator, "second.h5", "--frames", "12", *second, *options)
        disturbed = [self.simulate(simulator, f"noise{seed}.h5", "--frames", "12", "--disturb", seed) for seed in noise]
        return self.relate(first, other, "--map", word, *(["--bits"] if bits else []),
                           *(["--noise", *disturbed] if noise else []))


class Runs(Simulated):
    def test_right_simulators_hold(self):
        for simulator in SIMULATORS:
            for seed in ("1", "2"):
                with self.subTest(simulator=simulator, seed=seed):
                    status, document, text = self.check(self.simulate(simulator, "run.h5", "--seed", seed))
                    self.assertEqual(status, 0, text)
                    self.assertEqual(document["pieces"]["sure"], 2, text)
                    self.assertEqual(document["pieces"]["coupled"], 2, text)
                    for wanted in (ACROSS, WITHIN, "linear momentum", "centre of mass", "angular momentum"):
                        self.assertIn(wanted, [verdict["property"] for verdict in document["verdicts"]])

    def test_relations_of_arrays_in_memory(self):
        scene = {"rest": numpy.random.default_rng(1).random((6, 3)), "gravity": numpy.array([0, 0, -9.81]),
                 "velocities": numpy.ones((6, 3)), "mass": numpy.ones(6), "drag": numpy.array(0.5)}

        def simulate(scene, constant=0.0):
            dt, drag = 0.01 * (4 if scene["mass"][0] > 1 else 1), scene["drag"] + constant
            x, v, frames = scene["rest"], scene["velocities"], []
            for _ in range(8):
                frames.append((x, v))
                v = v + dt * (scene["gravity"] - drag * v)
                x = x + dt * v
            return dict(scene, positions=numpy.array([f[0] for f in frames]), time=dt * numpy.arange(8), drag=None,
                        velocities=numpy.array([f[1] for f in frames]))

        scaled = cutproof.mapped("units:4,4,16", scene, drag=(0, -1, 0))
        self.assertEqual((scaled["drag"], scaled["mass"][0]), (0.125, 16))
        result = cutproof.relate(simulate(scene), simulate(scaled), map="units:4,4,16", bits=True)
        self.assertEqual(result.document["frames"], 8)
        with self.assertRaises(cutproof.Failed) as caught:
            cutproof.relate(simulate(scene, 0.1), simulate(scaled, 0.1), map="units:4,4,16")
        self.assertEqual(self.failed(caught.exception.document), ["related positions", "related velocities"])
        with self.assertRaisesRegex(cutproof.Error, "drag"):
            cutproof.mapped("units:4,4,16", scene)
        noisy = simulate(scene)
        noisy["positions"] = noisy["positions"] * (1 + 1e-16)
        with self.assertRaisesRegex(cutproof.Failed, "noise is there"):
            cutproof.relate(simulate(scene), simulate(scene), noise=[noisy])

    def test_bodies_alone_and_a_run_that_goes_on_correspond(self):
        random = numpy.random.default_rng(2)
        x, time = random.random((6, 5, 3)).cumsum(0), 0.1 * numpy.arange(6)
        both = dict(positions=x, time=time, groups_offsets=[0, 2, 5], groups_members=[0, 1, 2, 3, 4])
        one = dict(positions=x[:, :2], time=time, groups_offsets=[0, 2], groups_members=[0, 1])
        other = dict(positions=x[:, 2:], time=time, groups_offsets=[0, 3], groups_members=[0, 1, 2])
        later = dict(both, positions=x[2:], time=time[2:])
        self.assertEqual(cutproof.relate(both, one, other, map="split", bits=True).document["frames"], 6)
        self.assertEqual(cutproof.relate(both, later, map="checkpoint", bits=True).document["frames"], 4)

        def failures(*runs, map):
            with self.assertRaises(cutproof.Failed) as caught:
                cutproof.relate(*runs, map=map)
            return self.failed(caught.exception.document)

        self.assertEqual(failures(both, other, one, map="split"), ["related positions", "related coupling"])
        self.assertEqual(failures(both, dict(other, groups_members=[0, 1, 1]), map="split"), ["related frames"])
        wrong = dict(later, positions=x[2:] + [[[0, 0, 1e-9]]])
        self.assertEqual(failures(both, wrong, map="checkpoint"), ["related positions"])
        self.assertEqual(failures(both, dict(later, positions=x[2:5], time=time[2:5]), map="checkpoint"),
                         ["related frames"])
        # The first run in many segments, the first of which alone has what is given once; disturbed runs that are short.
        path = self.folder / "series.h5"
        with cutproof_run.Writer(path, flush=1, gravity=[0, 0, -9.81], steps=3, spacing=0.5) as run:
            for frame, at in enumerate(time):
                run.frame(x[frame], time=at, groups=[[0, 1], [2, 3, 4]])
        once = dict(gravity=[0, 0, -9.81], steps=3, spacing=0.5)
        self.assertEqual(cutproof.relate(path, dict(later, **once), map="checkpoint").document["frames"], 4)
        with self.assertRaises(cutproof.Failed) as caught:
            cutproof.relate(path, dict(later, **once), map="checkpoint", noise=[dict(both, positions=x[:1], time=[0.0])])
        self.assertIn("related frames", self.failed(caught.exception.document))
        # One blade cuts all bodies.
        swept = numpy.zeros((6, 1, 4, 3))
        cutproof.relate(dict(both, blade=swept), dict(one, blade=swept), dict(other, blade=swept), map="split")
        was, path = [4, 2, 0, 1, 3], self.folder / "permuted.h5"
        with cutproof_run.Writer(path, permutation=was) as run:
            for frame, at in enumerate(time):
                run.frame(x[frame, was], time=at, groups=[[2, 3], [0, 1, 4]])
        self.assertEqual(cutproof.relate(both, path, map="permute", bits=True).document["frames"], 6)
        for runs, map, words in (((both, later), "shift", "no map"), ((both, one), "refine", "3 or more"),
                                 ((both, dict(later, time=None)), "checkpoint", "Write time"),
                                 ((both, both), "permute", "correspondence of particles"),
                                 ((both, dict(both, permutation=[0, 1, 2, 2, 4])), "permute", "Name each particle once"),
                                 ((both, dict(later, time=later["time"] + 9)), "checkpoint", "Write a longer one"),
                                 ((both, dict(both, kicked=x)), "same", "Use cutproof kick")):
            with self.subTest(map=map, words=words), self.assertRaisesRegex(cutproof.Error, words):
                cutproof.relate(*runs, map=map)

    def test_continuous_integration_reads_each_property_once(self):
        path, report = self.simulate("springs", "run.h5", "--fault", "heals"), self.folder / "junit.xml"
        status, document, text = self.check(path, "--junit", report, env={"GITHUB_ACTIONS": "true"})
        self.assertEqual(status, 1, text)
        cases = {case.get("name"): case for case in ElementTree.parse(report).iter("testcase")}
        judged = [verdict["property"] for verdict in document["verdicts"]]
        skipped = [one["property"] for one in document["not_judged"]]
        self.assertEqual(list(cases), judged + skipped)
        for name, case in cases.items():
            kinds = [child.tag for child in case]
            self.assertEqual(kinds, ["failure"] if name in self.failed(document) else
                             ["skipped"] if name in skipped else [])
        verdict = next(one for one in document["verdicts"] if one["property"] == ACROSS)
        failure = cases[ACROSS].find("failure")
        self.assertEqual(failure.get("message"), verdict["witness"]["text"])
        particles = ", ".join(str(particle) for particle in verdict["witness"]["particles"])
        self.assertTrue(failure.text.startswith(
            f"'{ACROSS}' fails in frame {verdict['frame']} at particles {particles}: measured "), failure.text)
        self.assertIn(f"see it again: cutproof check {path}", failure.text)
        for words in ("after skin", "backend", "1 of 1"):
            self.assertNotIn(words, failure.text)
        notes = [line for line in text.splitlines() if line.startswith("::")]
        self.assertEqual(len(notes), len(self.failed(document)))
        self.assertIn(f"::error title=cutproof: {ACROSS}::{verdict['witness']['text']}; "
                      f"see it again: cutproof check {path}", "\n".join(notes))

    def write_skin(self, before, after, promises="free skin", last=None):
        """A bar that is cut in frame 2 of 4, with these surfaces; `last`: the one of frame 3. Where the surface stays,
        nothing else is told anew either."""
        path = self.folder / "run.h5"
        x = numpy.stack(numpy.meshgrid(numpy.arange(4.0), numpy.arange(2.0), numpy.arange(2.0), indexing="ij"), 3)
        x = x.reshape(-1, 3)
        with cutproof_run.Writer(path, rest=x, spacing=1.0, promises=promises) as run:
            for frame in range(4):
                blade = numpy.full((1, 4, 3), numpy.nan)
                if frame == 2:
                    blade[0] = [[1.5, -9, -9], [1.5, 9, -9], [1.5, 9, 9], [1.5, -9, 9]]
                skin = before if frame < 2 else last if frame == 3 and last else after
                groups = {} if after is before else dict(groups=[range(16)] if frame < 2 else [range(8), range(8, 16)])
                run.frame(x, blade=blade, **groups, **skin)
        return path

    def test_the_skin_is_closed_and_goes_around_each_piece(self):
        corner = numpy.stack(numpy.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), 3).reshape(-1, 3)
        faces = numpy.array([[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5], [2, 3, 7], [2, 7, 6],
                             [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])

        def boxes(*ends):
            return dict(vertices=numpy.concatenate([[low - 0.4, -0.4, -0.4] + corner * [high - low + 0.8, 1.8, 1.8]
                                                    for low, high in ends]),
                        triangles=numpy.concatenate([8 * k + faces for k in range(len(ends))]))

        one, two, three = boxes((0, 3)), boxes((0, 1), (2, 3)), boxes((0, 1), (2, 2), (3, 3))
        open_one = dict(two, triangles=two["triangles"][:-1])
        turned = dict(two, triangles=numpy.concatenate([two["triangles"][:-1], two["triangles"][-1:, ::-1]]))
        nowhere = dict(two, vertices=numpy.where(numpy.arange(16)[:, None] == 5, numpy.nan, two["vertices"]))
        gone = dict(vertices=numpy.zeros((0, 3)), triangles=numpy.zeros((0, 3), int))
        status, document, text = self.check(self.write_skin(one, two))
        self.assertEqual((status, self.failed(document)), (0, []), text)
        self.assertLessEqual({"skin surface", "skin match"}, {one["property"] for one in document["verdicts"]})
        self.assertIn("skin geometry", [one["property"] for one in document["not_judged"]])
        for before, after, last, wanted, frame in (
                (one, one, None, "skin match", 2), (two, two, None, "skin match", 0), (one, three, None, "skin match", 2),
                (one, open_one, None, "skin surface", 2), (one, turned, None, "skin surface", 2),
                (one, two, nowhere, "skin surface", 3), (one, gone, None, "skin surface", 2)):
            with self.subTest(wanted=wanted, frame=frame):
                status, document, _ = self.check(self.write_skin(before, after, last=last))
                found = [(v["property"], v["frame"]) for v in document["verdicts"] if not v["holds"]]
                self.assertEqual((status, found), (1, [(wanted, frame)]))
        # Who does not promise it may have one surface around pieces that touch.
        status, document, text = self.check(self.write_skin(one, one, promises="free"))
        self.assertEqual(status, 0, text)
        self.assertIn({"property": "skin match", "why": "needs the promise 'skin'"}, document["not_judged"])

    def test_a_recording_is_a_run_too(self):
        for scene in ("small_block", "three_cuts", "uniform_stretch"):
            with self.subTest(scene=scene):
                path = self.folder / scene
                subprocess.run([os.environ["CUTPROOF"], "run", ROOT / f"fixtures/scenes/{scene}.json", "--record", path],
                               check=True, stdout=subprocess.DEVNULL)
                status, document, text = self.check(path)
                self.assertEqual(status, 0, text)
                judged = [verdict["property"] for verdict in document["verdicts"]]
                # What a scene's moments are asked is not asked again.
                for once in ("centre of mass", "what is gone stays gone", ACROSS):
                    self.assertEqual(judged.count(once), 1, once)
                self.assertNotIn("run well formed", judged)
        # What is planted is found.
        path = self.folder / "small_block"
        with h5py.File(f"{path}.cutproof.h5") as index:
            last = index["snapshots/velocity_row"][-1]
        with h5py.File(f"{path}.particles.vtkhdf", "r+") as particles:
            particles["VTKHDF/PointData/velocity"][last] += [0, 0, 100]
        status, document, text = self.check(path)
        self.assertEqual(status, 1, text)
        self.assertIn("linear momentum", self.failed(document))
        # A recording may promise less.
        with h5py.File(f"{path}.cutproof.h5", "r+") as index:
            index.attrs["promises"] = numpy.bytes_("connected covered")
        status, document, text = self.check(path)
        self.assertNotIn("linear momentum", self.failed(document))
        self.assertTrue(any("'linear momentum' is not promised" in note for note in document["notes"]), text)

    def test_forms_of_a_file_have_the_same_verdicts(self):
        told = []
        for name in ("run.h5", "folder"):
            _, document, _ = self.check(self.simulate("springs", name))
            told.append([(v["property"], v["holds"], v["measured"], v["bound"]) for v in document["verdicts"]])
        self.assertEqual(*told)
        # One NPZ is one segment: without a cut nothing changes in it.
        path = self.folder / "run.npz"
        x = numpy.random.default_rng(1).random((5, 3))
        with cutproof_run.Writer(path, mass=numpy.ones(5), promises="free") as run:
            for frame in range(3):
                run.frame(x + 0.01 * frame, velocities=numpy.ones((5, 3)), time=0.01 * frame, groups=[[0, 1, 2, 3, 4]])
        status, document, text = self.check(path)
        self.assertEqual((status, document["run"]["frames"]), (0, 3), text)

    def test_a_large_run_is_judged_as_it_is_read(self):
        """97,336 particles, whose springs change in each tenth frame, in two gigabytes (ci/nightly.sh: 1,000 frames)."""
        side, frames, h, dt = 46, 1000 if os.environ.get("CUTPROOF_WHOLE") == "1" else 100, 0.01, 0.005
        number = numpy.arange(side**3).reshape(side, side, side)
        springs = numpy.concatenate([numpy.stack([a.ravel(), b.ravel()], 1) for a, b in (
            (number[:-1], number[1:]), (number[:, :-1], number[:, 1:]), (number[:, :, :-1], number[:, :, 1:]))])
        rest = h * numpy.stack(numpy.unravel_index(numpy.arange(side**3), number.shape), 1)
        plane, top, gravity = h * (side // 2 - 0.5), h * side, numpy.array([0, 0, -9.81])
        crosses = numpy.diff(rest[springs, 0] < plane, axis=1)[:, 0]
        height, low, whole = rest[springs, 2].min(1), top, numpy.ones(len(springs), bool)
        with cutproof_run.Writer(self.folder / "run.h5", rest=rest, mass=numpy.ones(len(rest)), spacing=h, steps=4,
                                 gravity=gravity, edges=springs, promises="free", unit_roundoff=2.0**-24,
                                 flush=1) as run:
            for f in range(frames):
                fallen, more = gravity * (f * dt)**2 / 2, {}
                if f % 10 == 0:
                    if 0 < f <= 0.9 * frames:
                        was, low = low + 0.1 * h, top - (top + h) * f / (0.9 * frames)
                        more["blade"] = [[[plane, -h, was], [plane, top, was], [plane, top, low],
                                          [plane, -h, low]]] + fallen
                    whole &= ~(crosses & (height >= low))
                    more["groups"] = numpy.arange(0, 2 * whole.sum() + 1, 2), springs[whole].ravel()
                run.frame((rest + fallen).astype(numpy.float32), time=f * dt, **more,
                          velocities=numpy.broadcast_to(gravity * f * dt, rest.shape).astype(numpy.float32))
        status, document, text = self.check(self.folder / "run.h5")
        self.assertEqual((status, document["pieces"]["sizes"]), (0, [side**3 // 2] * 2), text)
        self.assertLess(self.memory, 2 << 30)

    def test_what_does_not_fit_is_refused_by_name(self):
        x = numpy.zeros((2, 4, 3))
        for name, array, words in (("velocities", numpy.zeros((2, 3, 3)), "velocities"),
                                   ("speed", numpy.zeros(2), "speed"),
                                   ("cells", numpy.zeros((1, 5), int), "5 corners"),
                                   ("promises", numpy.array("fast"), "cannot promise 'fast'")):
            with self.subTest(name=name):
                path = self.folder / "run.npz"
                numpy.savez(path, positions=x, **{name: array})
                done = subprocess.run([os.environ["CUTPROOF"], "check", path], capture_output=True, text=True)
                self.assertEqual(done.returncode, 2)
                self.assertIn(words, " ".join(done.stderr.split()))
                self.assertIn(str(path), done.stderr)

    def test_values_that_cannot_be_fail_the_form(self):
        path = self.folder / "run.npz"
        x, none = numpy.zeros((2, 4, 3)), numpy.nan
        patch = numpy.array([[[[0, 0, 0], [1, 0, 0], [0, 1, none]]]] * 2)
        for arrays in (dict(groups_offsets=[0, 2], groups_members=[0, 9]),
                       dict(groups_offsets=[0, 2], groups_members=[0, -1]),
                       dict(groups_offsets=[1, 2], groups_members=[0, 1]),
                       dict(groups_offsets=[0, 2, 1], groups_members=[0, 1]),
                       dict(groups_offsets=[0], groups_members=[0, 1]),
                       dict(groups_offsets=[0, 2], groups_members=[0, 1], groups_weights=[1, none]),
                       dict(cells=[[0, 1, 2, 4]]), dict(edges=[[0, 4]]), dict(blade=patch),
                       dict(time=[0, none]), dict(time=[1, 1]), dict(rest=[[none, 0, 0]] * 4, spacing=1.0),
                       dict(parent=[-1, -1, -1, 4])):
            with self.subTest(arrays):
                numpy.savez(path, positions=x, **arrays)
                status, document, _ = self.check(path)
                self.assertEqual(status, 1)
                self.assertEqual(self.failed(document), ["run well formed"])

    def test_a_wrong_spacing_is_named_and_takes_no_memory(self):
        numpy.savez(self.folder / "run.npz", positions=numpy.zeros((1, 200000, 3)), rest=numpy.zeros((200000, 3)),
                    spacing=1.0)
        _, document, text = self.check(self.folder / "run.npz")
        self.assertEqual(self.failed(document), ["run well formed"])
        self.assertIn("spacing = 1", text)
        self.assertLess(self.memory, 2 << 30)  # all pairs would take eighty times as much

    def test_groups_and_cells_go_on_each_by_itself(self):
        folder = self.folder / "run"
        folder.mkdir()
        x = numpy.array([[0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
        for k in range(3):
            more = [dict(cells=[[1, 2, 3, 0]]), dict(groups_offsets=[0, 2], groups_members=[0, 1]), {}][k]
            numpy.savez(folder / f"{10 * k:06}.npz", positions=x, **more)  # numbers of steps
        status, document, text = self.check(folder)
        self.assertEqual((status, document["pieces"]["units"]), (0, 1), text)
        inverted = [v for v in document["verdicts"] if v["property"] == "no inverted cell"]
        self.assertEqual([v["checked"] for v in inverted], [3])


class Related(Simulated):
    def test_right_simulators_keep_every_relation(self):
        for simulator in SIMULATORS:
            others = ("same", "reset", "rotate:90z") if simulator == "springs" else ()
            for word in ("units:4,4,16", "mirror:x", *others):
                with self.subTest(simulator=simulator, map=word):
                    keeps_bits = word in ("same", "reset", "units:4,4,16")
                    status, document, text = self.related(simulator, word, bits=keeps_bits)
                    self.assertEqual(status, 0, text)
                    self.assertIn("related coupling", [verdict["property"] for verdict in document["verdicts"]])
        status, _, text = self.related("springs", "permute", noise=("1", "2"))
        self.assertEqual(status, 0, text)

    def test_finer_steps_converge(self):
        runs = []
        for steps in (10, 20, 40):
            scene, finer = self.folder / "scene.npz", self.folder / "finer.npz"
            self.simulate("springs", "plain.h5", "--frames", "4", "--save-scene", scene)
            numpy.savez(finer, **{**numpy.load(scene), "steps": steps})
            runs.append(self.simulate("springs", f"{steps}.h5", "--frames", "4", "--scene", finer))
        status, document, text = self.relate(*runs, "--map", "refine")
        self.assertEqual(status, 0, text)
        self.assertGreater(document["differences"][0], 1.8 * document["differences"][1])
        shorter = self.simulate("springs", "shorter.h5", "--frames", "3", "--scene", finer)
        status, document, text = self.relate(*runs[:2], shorter, "--map", "refine")
        self.assertEqual((status, self.failed(document)), (1, ["related frames"]), text)
        for options, words in ((("--noise", shorter), "compares with no noise"), (("--bits",), "have other bits"),
                               (("--dimension", "a=1,1,1"), "--make")):
            done = subprocess.run([os.environ["CUTPROOF"], "relate", *runs, "--map", "refine", *options],
                                  capture_output=True, text=True)
            self.assertEqual(done.returncode, 2)
            self.assertIn(words, " ".join(done.stderr.split()))
        other = self.simulate("springs", "other.h5", "--frames", "4", "--scene", finer, "--fault", "spin_lost")
        status, document, text = self.relate(*runs[:2], other, "--map", "refine")
        self.assertEqual((status, self.failed(document)), (1, ["converges"]), text)


class Faults(Simulated):
    def test_faults_fail_the_property_that_is_named(self):
        for fault, by_simulator in FAULTS.items():
            for simulator, wanted in by_simulator.items():
                with self.subTest(fault=fault, simulator=simulator):
                    status, document, _ = self.check(self.simulate(simulator, "run.h5", "--fault", fault))
                    self.assertEqual(status, 1)
                    self.assertIn(wanted, self.failed(document))

    def test_faults_fail_the_relation_that_is_named(self):
        for fault, (word, wanted) in RELATED.items():
            with self.subTest(fault=fault):
                status, document, text = self.related("springs", word, "--fault", fault, bits=wanted == "same bits")
                self.assertEqual(status, 1, text)
                self.assertIn(wanted, self.failed(document), text)
                report = self.folder / "related.xml"
                self.relate(self.folder / "first.h5", self.folder / "second.h5", "--map", word, "--junit", report)
                names = [case.get("name") for case in ElementTree.parse(report).iter("testcase")]
                self.assertIn("related positions", names)
        # A right run beside one whose square roots are of single precision: as a GPU beside its CPU.
        right = self.simulate("springs", "first.h5", "--frames", "12")
        rough = self.simulate("springs", "second.h5", "--frames", "12", "--fault", "noise")
        noise = [self.simulate("springs", f"noise{seed}.h5", "--frames", "12", "--disturb", seed) for seed in "12"]
        status, document, text = self.relate(right, rough, "--map", "same", "--noise", *noise)
        self.assertEqual(status, 1, text)
        self.assertIn("related positions", self.failed(document))
        self.assertGreater(document["sharpest"]["moved"], 1e10 * document["sharpest"]["bound"])


if __name__ == "__main__":
    unittest.main(verbosity=2, defaultTest="Runs")
