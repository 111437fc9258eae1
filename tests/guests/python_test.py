"""cutproof.py against the program: right and wrong functions for each operation, and what functions may do wrong.

The environment names the program (CUTPROOF) and the one that prints guests/wire.h (CUTPROOF_WIRE_LAYOUT).
"""
import ctypes
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest
import unittest.mock

import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "guests" / "python"))
import cutproof  # noqa: E402


def rotations_by_svd(a, previous):
    """A rotation wherever something is known of one."""
    r = previous.copy()
    known = numpy.isfinite(a).all((1, 2)) & (a != 0).any((1, 2))
    scaled = a[known].astype(numpy.float64)
    scaled /= abs(scaled).max((1, 2), keepdims=True)
    u, _, vt = numpy.linalg.svd(scaled)
    u[:, :, 2] *= numpy.sign(numpy.linalg.det(u) * numpy.linalg.det(vt))[:, None]
    r[known] = u @ vt
    return r


def labels_by_union_find(tissue, alive):
    parent = list(range(len(alive)))

    def root(i):
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for i in range(len(alive)):
        for k in range(tissue.edge_offsets[i], tissue.edge_offsets[i + 1]):
            other = tissue.edge_ends[k]
            if alive[i] and alive[other]:
                parent[root(i)] = root(other)
    return [root(i) for i in range(len(alive))]


# Corners of a cube around each particle of a body in which none touch: what a right surface is there.
def octahedra(tissue, alive):
    vertices, triangles = [], []
    for node in tissue.node[alive]:
        first = len(vertices)
        for axis in range(3):
            for sign in (-0.5, 0.5):
                place = node.astype(float)
                place[axis] += sign
                vertices.append(place * tissue.spacing)
        for x in (0, 1):
            for y in (0, 1):
                for z in (0, 1):
                    corners = [first + x, first + 2 + y, first + 4 + z]
                    triangles.append(corners if (x + y + z) % 2 == 1 else corners[::-1])
    return vertices, triangles


def an_edge_each(tissue):
    """Each edge a cluster, and each particle: connected, covered, coupled, and every edge is covered."""
    clusters = [[i] for i in range(len(tissue.mass))]
    for i in range(len(tissue.mass)):
        neighbours = tissue.edge_ends[tissue.edge_offsets[i]:tissue.edge_offsets[i + 1]]
        clusters += [[i, int(other)] for other in neighbours if other > i]
    return clusters


class Test(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def judge(self, **options):
        return cutproof.judge(**{"save": self.folder.name, "shrink": 3, "cases": 60, "sizes": (), **options})

    def failure(self, expected=cutproof.Failed, **options):
        """The text, and what failed by property."""
        with self.assertRaises(expected) as caught:
            self.judge(**options)
        document = getattr(caught.exception, "document", None)
        failures = [each for operation in document["operations"] for each in operation["failures"]] if document else []
        return str(caught.exception), {each["property"]: each for each in failures}


class Wire(Test):
    def test_python_repeats_what_the_header_says(self):
        said = json.loads(subprocess.run([os.environ["CUTPROOF_WIRE_LAYOUT"]], check=True, capture_output=True).stdout)
        ours = {"wire::kProtocol": cutproof._PROTOCOL, "wire::kPage": cutproof._PAGE,
                "wire::kArrayBytes": cutproof._ARRAY_BYTES, "wire::kArenaBytes": cutproof._ARENA_BYTES,
                "wire::kArenaCount": cutproof._ARENA_COUNT, "wire::kMemoryBytes": cutproof._MEMORY_BYTES,
                "wire::kLeastGap": cutproof._LEAST_GAP, "wire::kCanary": cutproof._CANARY,
                "wire::kDeviceCanary": cutproof._DEVICE_CANARY, "wire::kMostArrays": cutproof._MOST_ARRAYS,
                "wire::kMostGrown": cutproof._MOST_GROWN, "wire::Role::given": cutproof._GIVEN,
                "wire::Role::answer": cutproof._ANSWER, "wire::Role::grown": cutproof._GROWN,
                "wire::Role::setup": cutproof._SETUP, "wire::Outcome::answered": cutproof._ANSWERED,
                "wire::Outcome::refused": cutproof._REFUSED, "wire::Outcome::broke_a_rule": cutproof._BROKE_A_RULE,
                "wire::Outcome::device_failed": cutproof._DEVICE_FAILED, "wire::Greeting::ready": cutproof._READY}
        ours.update({f"wire::{name}": number for name, number in cutproof._OPERATIONS.items()})
        names = {"int32": "i32", "int64": "i64", "uint8": "u8", "float32": "f32", "float64": "f64"}
        ours.update({f"ElementType::{names[name]}": number for number, name in cutproof._TYPES.items()})
        for at_end in (False, True):
            for size in (0, 1, 4096, 5000):
                where = "at the end" if at_end else "at the beginning"
                values = cutproof._place_in_arena(3, size, at_end)
                ours.update(zip((f"place of {size}, {where}", f"first page of {size}, {where}",
                                 f"end page of {size}, {where}"), values))
        for struct in (cutproof._Array, cutproof._Request, cutproof._Reply, cutproof._Hello):
            name = struct.__name__[1:]
            ours[f"{name} size"] = ctypes.sizeof(struct)
            for member, _ in struct._fields_:
                ours[f"{name}.{member} offset"] = getattr(struct, member).offset
                ours[f"{name}.{member} size"] = getattr(struct, member).size
        self.assertEqual(ours, said)

    def test_another_version_is_refused(self):
        for member in ("protocol", "request_bytes", "reply_bytes"):
            guest = cutproof._Guest({"components": labels_by_union_find}, "single", "host", None, None)
            setattr(guest.hello, member, 99)
            status, _, errors = guest.run([], False)
            self.assertEqual(status, 2)
            self.assertIn("cutproof.py is of another version than cutproof", errors)

    def test_only_the_files_of_a_guest_are_taken(self):
        program = os.environ["CUTPROOF"]
        with tempfile.TemporaryFile() as file:
            for words, problem in (([f"--attached={file.fileno()},{file.fileno()}"], "not a socket"),
                                   (["--attached=3"], "1 numbers"), ([], "no plugin is given")):
                done = subprocess.run([program, "judge", *words], capture_output=True, text=True,
                                      pass_fds=(file.fileno(),))
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(problem, done.stderr)


class Operations(Test):
    def test_right_rotations(self):
        result = self.judge(rotations=rotations_by_svd, cases=20000)
        self.assertGreaterEqual(result.operations["rotations"]["cases"], 20000)
        self.assertEqual(result.operations["rotations"]["refused"], 0)
        self.assertEqual(result.document["plugin"]["name"], "rotations_by_svd")
        self.assertIn("all hold", result.text)

    def test_rotations_without_a_sign_are_found(self):
        def reflections(a, previous):
            u, _, vt = numpy.linalg.svd(numpy.where(numpy.isfinite(a), a, 0))
            return u @ vt

        text, failures = self.failure(rotations=reflections)
        self.assertIn("a reflection", failures["rotation"]["text"])
        self.assertEqual(failures["rotation"]["size"], "1 matrix")
        self.assertEqual(failures["rotation"]["measured"], 2)
        for wanted in ("'rotation' fails in question", "shrunk to 1 matrix", "measured 2, the bound is 5e-06",
                       f"cutproof.replay('{failures['rotation']['file']}', rotations=reflections)"):
            self.assertIn(wanted, text)
        with self.assertRaises(cutproof.Failed) as again:
            cutproof.replay(failures["rotation"]["file"], rotations=reflections)
        self.assertIn("a reflection", str(again.exception))
        self.assertIn("holds", cutproof.replay(failures["rotation"]["file"], rotations=rotations_by_svd).text)

    def test_double_precision(self):
        seen = set()

        def rotations(a, previous):
            seen.add((a.dtype, previous.dtype, a.shape == previous.shape, a.shape[1:]))
            return rotations_by_svd(a, previous)

        self.judge(rotations=rotations, precision="double")
        self.assertEqual(seen, {(numpy.dtype("float64"), numpy.dtype("float64"), True, (3, 3))})
        _, failures = self.failure(rotations=lambda a, p: rotations_by_svd(a, p).astype("f4"), precision="double")
        self.assertEqual(failures["answers"]["text"], "r is float32, float64 is wanted")
        _, failures = self.failure(rotations=lambda a, p: rotations_by_svd(a, p).astype("f4").astype("f8"),
                                   precision="double")
        self.assertIn("rotation", failures)
        # And a replay has the precision in which the question failed.
        with self.assertRaises(cutproof.Failed):
            cutproof.replay(failures["rotation"]["file"], rotations=lambda a, p: (a * 0).astype("f8"))

    def test_right_labels(self):
        self.judge(components=labels_by_union_find)

    def test_labels_in_16_bits_are_found_in_a_large_question(self):
        text, failures = self.failure(components=lambda t, alive: numpy.arange(len(alive)).astype("u2").astype("i4")
                                      if len(t.edge_ends) == 0 else labels_by_union_find(t, alive), sizes=(65537,),
                                      shrink=0)
        self.assertIn("fails in the question of size 65537 (many vertices without edges)", text)
        self.assertIn("0 and 65536 both have the label 0", failures["components"]["text"])

    def test_labels_that_go_around_once_are_found(self):
        def once(tissue, alive):
            label = numpy.arange(len(alive), dtype=numpy.int32)
            for i in range(len(alive)):
                for other in tissue.edge_ends[tissue.edge_offsets[i]:tissue.edge_offsets[i + 1]]:
                    if alive[i] and alive[other]:
                        label[i] = min(label[i], label[other])
            return label

        _, failures = self.failure(components=once)
        self.assertIn("an edge joins", failures["components"]["text"])
        self.assertIn("particles", failures["components"]["size"])
        self.assertLessEqual(int(failures["components"]["size"].split()[0]), 4)

    def test_a_surface_where_no_particles_touch(self):
        def alone_or_refused(tissue, alive):
            if alive.sum() > 1:
                raise cutproof.Refused
            return octahedra(tissue, alive)

        result = self.judge(surface=alone_or_refused)
        self.assertGreater(result.operations["surface"]["refused"], 0)
        self.assertLess(result.operations["surface"]["refused"], result.operations["surface"]["questions"])

    def test_a_wrong_surface_is_found(self):
        _, failures = self.failure(surface=octahedra)
        self.assertEqual(failures["surface vertices"]["size"], "2 particles")

        def inside_out(tissue, alive):
            vertices, triangles = octahedra(tissue, alive)
            return vertices, [corners[::-1] for corners in triangles]

        text, _ = self.failure(surface=inside_out)
        self.assertIn("are inside out", text)

    def test_right_clusters_as_lists_and_as_arrays(self):
        def as_arrays(tissue):
            lists = an_edge_each(tissue)
            return (numpy.cumsum([0] + [len(each) for each in lists]),
                    numpy.array([i for each in lists for i in each], dtype=numpy.int32))

        self.judge(clusters=an_edge_each, promises="connected covered coupled edges_covered same_bits")
        self.judge(clusters=as_arrays)

    def test_clusters_that_are_not_coupled_are_found(self):
        _, failures = self.failure(clusters=lambda tissue: [[i] for i in range(len(tissue.mass))])
        self.assertIn("isolation", failures)
        self.assertEqual(failures["isolation"]["size"], "2 particles")

    def test_what_is_promised_is_judged(self):
        def spread(tissue):  # all of a component in one cluster: connected, coupled, and no edge is left out
            label = numpy.array(labels_by_union_find(tissue, numpy.ones(len(tissue.mass), bool)))
            return [numpy.flatnonzero(label == each) for each in numpy.unique(label)]

        self.judge(clusters=spread, promises="covered edges_covered")
        count = [0]

        def shuffled(tissue, alive):
            count[0] += 1
            return numpy.array(labels_by_union_find(tissue, alive)) + count[0]

        self.judge(components=shuffled)
        _, failures = self.failure(components=shuffled, promises="same_bits")
        self.assertIn("determinism", failures)
        with self.assertRaisesRegex(cutproof.Error, "there is no promise 'perfect'"):
            self.judge(components=shuffled, promises="perfect")

    def test_several_at_once(self):
        result = self.judge(components=labels_by_union_find, clusters=an_edge_each, name="mine")
        self.assertEqual(list(result.operations), ["components", "clusters"])
        self.assertEqual(result.document["plugin"]["name"], "mine")

    def test_seed(self):
        def first(seed):
            seen = []
            self.judge(rotations=lambda a, p: seen.append(a.copy()) or rotations_by_svd(a, p), seed=seed, cases=1)
            return numpy.concatenate(seen)

        self.assertTrue(numpy.array_equal(first(7), first(7), equal_nan=True))
        self.assertFalse(numpy.array_equal(first(7)[:256], first(8)[:256], equal_nan=True))


class Answers(Test):
    """What is wrong with an answer is named."""

    def says(self, text, **functions):
        _, failures = self.failure(shrink=0, **functions)
        self.assertIn(text, failures["answers"]["text"])

    def test_labels(self):
        right = labels_by_union_find
        self.says("label is float64, int32 is wanted",
                  components=lambda t, alive: numpy.array(right(t, alive)).astype(float))
        self.says("label is bool, int32 is wanted", components=lambda t, alive: alive)
        self.says("label has the shape (2,), (1,) is wanted", components=lambda t, alive: right(t, alive) + [0])
        self.says("label has the shape (1, 1), (1,) is wanted",
                  components=lambda t, alive: numpy.array([right(t, alive)]))
        self.says("label holds 2147483648, which int32 cannot",
                  components=lambda t, alive: numpy.array(right(t, alive)) + 2**31)
        self.says("label is object, int32 is wanted", components=lambda t, alive: t)
        self.says("it returned no label", components=lambda t, alive: None)
        self.says("label cannot become an array", components=lambda t, alive: [[1], [1, 2]])

    def test_any_integers_and_what_has_an_array_interface(self):
        class Mine:
            def __init__(self, array):
                self.array = array
                self.__array_interface__ = array.__array_interface__

        for kind in ("i2", "u4", "i8", ">i4"):
            self.judge(components=lambda t, alive: Mine(numpy.array(labels_by_union_find(t, alive)).astype(kind)))

    def test_rotations(self):
        self.says("r is int64, float32 is wanted", rotations=lambda a, p: numpy.zeros(a.shape, int))
        self.says("r has the shape (256, 9), (256, 3, 3) is wanted", rotations=lambda a, p: p.reshape(-1, 9))
        self.says("r is float16, float32 is wanted", rotations=lambda a, p: p.astype("f2"))

    def test_nan(self):
        _, failures = self.failure(rotations=lambda a, p: p * numpy.nan)
        self.assertIn("not finite", failures["rotation"]["text"])

    def test_surfaces_and_clusters(self):
        self.says("it returned 4 values, (vertices, triangles) is wanted", surface=lambda t, alive: (1, 2, 3, 4))
        self.says("it returned ndarray, (vertices, triangles) is wanted", surface=lambda t, alive: t.rest)
        self.says("vertices has the shape (1, 2), (any, 3) is wanted", surface=lambda t, alive: ([[1., 2.]], []))
        self.says("triangles is float64, int32 is wanted", surface=lambda t, alive: ([[1., 2., 3.]], [[1., 2., 3.]]))
        self.says("it returned 1 values, (offsets, members) is wanted", clusters=lambda t: (1,))
        self.says("it returned dict; (offsets, members) or a list of lists", clusters=lambda t: {})
        self.says("cluster 1 is float64, int32 is wanted", clusters=lambda t: [[0], [0.5]])

    def test_zero_rows(self):
        counts = set()

        def labels(tissue, alive):
            counts.add(len(alive))
            self.assertEqual(tissue.rest.shape, (len(alive), 3))
            return labels_by_union_find(tissue, alive)

        self.judge(components=labels)
        self.assertIn(0, counts)
        _, failures = self.failure(surface=lambda t, alive: ([], []))
        self.assertIn("leaves the tissue, and has no vertex", failures["surface vertices"]["text"])

    def test_an_exception_is_a_fault_with_its_traceback(self):
        def raises(tissue, alive):
            if len(alive) > 3:
                return 1 // (len(alive) - len(alive))
            return labels_by_union_find(tissue, alive)

        text, failures = self.failure(components=raises, keep_going=True)
        self.assertEqual(failures["answers"]["text"], "it raised ZeroDivisionError: integer division or modulo by zero")
        self.assertEqual(failures["answers"]["size"], "4 particles")
        self.assertIn("return 1 // (len(alive) - len(alive))", text)
        self.assertNotIn("cutproof.py\"", text)
        with self.assertRaisesRegex(cutproof.Failed, "in raises"):
            cutproof.replay(failures["answers"]["file"], components=raises)

    def test_a_long_text_in_many_lines(self):
        def raises(tissue, alive):
            raise ValueError("ü\n" * 1000)

        _, failures = self.failure(components=raises, shrink=0)
        self.assertTrue(failures["answers"]["text"].startswith("it raised ValueError: ü ü"))
        self.assertLess(len(failures["answers"]["text"].encode()), 512)

    def test_it_gives_up_and_can_go_on(self):
        def raises(tissue, alive):
            raise ValueError

        text, _ = self.failure(components=raises, shrink=0)
        self.assertIn("given up after 10 questions", text)
        with self.assertRaises(cutproof.Failed) as caught:
            self.judge(components=raises, shrink=0, keep_going=True)
        self.assertGreaterEqual(caught.exception.document["operations"][0]["not_answered"], 60)

    def test_who_refuses_everything_has_passed_nothing(self):
        def refuses(tissue, alive):
            raise cutproof.Refused

        text, _ = self.failure(components=refuses)
        self.assertIn("too little was judged: all", text)

    def test_a_skip_in_a_function_is_a_skip(self):
        class Outcome(BaseException):  # as pytest's
            pass

        def skips(tissue, alive):
            raise Outcome

        self.failure(expected=Outcome, components=skips)


class Inputs(Test):
    def test_they_cannot_be_written(self):
        writers = {"alive": lambda t, alive: alive.fill(False), "rest": lambda t, alive: t.rest.fill(0),
                   "edge_ends": lambda t, alive: t.edge_ends.fill(0)}
        for name, write in writers.items():
            _, failures = self.failure(components=write, shrink=0)
            self.assertIn("it raised ValueError: assignment destination is read-only", failures["answers"]["text"])

    def test_who_writes_all_the_same_is_found(self):
        def with_pointers(a, previous):
            r = rotations_by_svd(a, previous)
            ctypes.memset(a.ctypes.data, 0, 4)
            return r

        _, failures = self.failure(rotations=with_pointers, shrink=0)
        self.assertEqual(failures["answers"]["text"], "it wrote to 'a', which is an input")

        def before_or_behind(a, previous):
            r = rotations_by_svd(a, previous)
            ctypes.memset(a.ctypes.data + (-1 if a.ctypes.data % 4096 else a.nbytes), 0, 1)
            return r

        _, failures = self.failure(rotations=before_or_behind, shrink=0)
        self.assertRegex(failures["answers"]["text"], "it wrote to byte 1 (before the beginning|behind the end) of 'a'")

    def test_they_are_no_copies(self):
        owned = []

        def rotations(a, previous):
            owned.append(a.flags.owndata or a.flags.writeable)
            return rotations_by_svd(a, previous)

        self.judge(rotations=rotations)
        self.assertFalse(any(owned))

    def test_what_a_tissue_has(self):
        grids = []

        def labels(tissue, alive):
            grids.append(tissue.node is not None)
            self.assertEqual((alive.dtype, tissue.edge_offsets.dtype, tissue.rest.dtype), (bool, "int64", "float32"))
            self.assertEqual(len(tissue.edge_ends), tissue.edge_offsets[-1])
            if tissue.node is None:
                self.assertIsNone(tissue.nodes)
            else:
                self.assertTrue((tissue.node > 0).all() and (tissue.node < numpy.array(tissue.nodes) - 1).all())
                self.assertTrue(numpy.allclose(tissue.rest, tissue.node * tissue.spacing))
            return labels_by_union_find(tissue, alive)

        self.judge(components=labels)
        self.assertEqual(set(grids), {False, True})


class Program(Test):
    def with_program(self, path):
        before = os.environ["CUTPROOF"]
        self.addCleanup(os.environ.__setitem__, "CUTPROOF", before)
        os.environ["CUTPROOF"] = path

    def test_one_that_is_not_there(self):
        self.with_program("/nonexistent/cutproof")
        with self.assertRaisesRegex(cutproof.Error, "CUTPROOF names '/nonexistent/cutproof', and there is no such"):
            self.judge(components=labels_by_union_find)

    def test_one_that_is_another(self):
        for other in ("/bin/false", "/bin/true"):
            self.with_program(other)
            with self.assertRaisesRegex(cutproof.Error, "is it cutproof?"):
                self.judge(components=labels_by_union_find)

    def test_it_is_found_beside_the_file_and_in_the_path(self):
        program = os.environ["CUTPROOF"]
        for place, path in (("beside", "/nowhere"), ("bin", "bin")):
            folder = pathlib.Path(self.folder.name) / place
            folder.mkdir()
            (folder / "cutproof").symlink_to(program)
            copy = (folder if place == "beside" else folder.parent) / "cutproof.py"
            copy.write_text((ROOT / "guests" / "python" / "cutproof.py").read_text())
            environment = {key: value for key, value in os.environ.items() if key not in ("CUTPROOF", "PYTHONPATH")}
            environment["PATH"] = str(folder) if path == "bin" else path
            words = [sys.executable, "-B", "-c",
                     "import cutproof; print(cutproof.judge(rotations=lambda a, p: p, cases=1))"]
            done = subprocess.run(words, cwd=copy.parent, env=environment, capture_output=True, text=True)
            self.assertIn("'best rotation' fails", done.stderr)
        del environment["PATH"]
        done = subprocess.run(words, cwd=copy.parent, env={**environment, "PATH": "/nowhere"}, capture_output=True,
                              text=True)
        self.assertIn("the program cutproof is not in PATH, nor beside cutproof.py", done.stderr)

    def test_bad_calls(self):
        for options, error in (({}, TypeError), ({"rotations": 3}, TypeError),
                               ({"rotations": rotations_by_svd, "precision": "half"}, ValueError),
                               ({"rotations": rotations_by_svd, "device": "tpu"}, ValueError),
                               ({"rotations": rotations_by_svd, "cases": 0}, cutproof.Error),
                               ({"rotations": rotations_by_svd, "save": "/dev/null/nonexistent"}, cutproof.Error)):
            with self.assertRaises(error):
                self.judge(**options)
        with self.assertRaisesRegex(cutproof.Error, "no question"):
            cutproof.replay(__file__, rotations=rotations_by_svd)
        with self.assertRaises(cutproof.Error):
            cutproof.replay(os.path.join(self.folder.name, "none.json"), rotations=rotations_by_svd)

    def test_replay_of_what_is_not_offered(self):
        _, failures = self.failure(rotations=lambda a, p: p, shrink=0)
        with self.assertRaisesRegex(cutproof.Error, "does not have this operation"):
            cutproof.replay(failures["best rotation"]["file"], components=labels_by_union_find)

    def test_no_device(self):
        with unittest.mock.patch("ctypes.CDLL", side_effect=OSError("not there")):
            with self.assertRaisesRegex(unittest.SkipTest, "there is no CUDA driver here"):
                self.judge(rotations=rotations_by_svd, device="cuda")

    def test_a_function_that_never_ends(self):
        def hangs(tissue, alive):
            while len(alive) == 0 or alive[0] in (True, False):
                time.sleep(0.01)

        begin = time.monotonic()
        text, failures = self.failure(components=hangs, clusters=an_edge_each, time_limit=0.5, shrink=0)
        self.assertLess(time.monotonic() - begin, 20)
        self.assertEqual(failures["answers"]["text"], "it did not answer within 0.5 s")
        self.assertIn("time.sleep(0.01)", text)
        self.assertIn("no further question was asked", text)
        self.judge(components=labels_by_union_find)  # and nothing is left of it

    def test_it_can_be_asked_within_a_function_and_in_another_thread(self):
        import threading
        results = []
        thread = threading.Thread(target=lambda: results.append(self.judge(components=labels_by_union_find)))
        thread.start()
        results.append(self.judge(clusters=an_edge_each))
        thread.join()
        self.assertEqual(len(results), 2)

    def test_ctrl_c_ends_everything(self):
        script = textwrap.dedent("""
            import os, sys, time
            import cutproof
            def slow(a, previous):
                print("asked", flush=True)
                time.sleep(60)
            try:
                cutproof.judge(rotations=slow)
            except KeyboardInterrupt:
                try:
                    print("child:", os.waitpid(-1, os.WNOHANG))
                except ChildProcessError:
                    print("no child is left")
        """)
        child = subprocess.Popen([sys.executable, "-B", "-c", script], stdout=subprocess.PIPE, text=True,
                                 env={**os.environ, "PYTHONPATH": str(ROOT / "guests" / "python")})
        self.assertEqual(child.stdout.readline(), "asked\n")
        child.send_signal(signal.SIGINT)
        self.assertEqual(child.communicate(timeout=60)[0], "no child is left\n")

    def test_no_file_or_thread_is_left_open(self):
        import threading
        self.judge(components=labels_by_union_find)
        before = len(os.listdir("/proc/self/fd")), threading.active_count()
        for _ in range(3):
            self.judge(components=labels_by_union_find)
        self.assertEqual((len(os.listdir("/proc/self/fd")), threading.active_count()), before)


class Relations(Test):
    def simulated(self, scene, gravity=None):
        x, v, places = scene["rest"], scene["velocities"], []
        for _ in range(10):
            places.append(x)
            v = v + scene["dt"] * ((scene["gravity"] if gravity is None else gravity) - scene["drag"] * v)
            x = x + scene["dt"] * v
        given = {name: scene[name] for name in ("rest", "mass", "gravity")}
        return dict(given, positions=numpy.array(places), time=numpy.arange(10) * scene["dt"])

    def test_a_mapped_scene_gives_the_mapped_run_unless_a_constant_has_a_dimension(self):
        scene = dict(rest=numpy.eye(3), velocities=numpy.ones((3, 3)), mass=numpy.ones(3),
                     gravity=numpy.array([0, 0, -9.81]), drag=numpy.array(0.5), dt=numpy.array(0.01))
        scaled = cutproof.mapped("units:4,4,16", scene, drag=(0, -1, 0), dt=(0, 1, 0))
        cutproof.relate(self.simulated(scene), self.simulated(scaled), map="units:4,4,16")
        with self.assertRaises(cutproof.Failed):
            fixed = scene["gravity"]
            cutproof.relate(self.simulated(scene, fixed), self.simulated(scaled, fixed), map="units:4,4,16")


class Documentation(Test):
    def test_the_examples_run(self):
        page = (ROOT / "docs" / "reference" / "python.md").read_text(encoding="utf-8")
        examples = re.findall(r"(?ms)^```python\n(.*?)^```", page)
        self.assertGreaterEqual(len(examples), 1)
        for example in examples:
            self.assertIn("\ndef test_", example)
            program = example + "\nfor name, test in list(globals().items()):\n    if name.startswith('test_'):\n" \
                "        test()\n        print(name)\n"
            done = subprocess.run([sys.executable, "-B", "-c", program], cwd=self.folder.name, capture_output=True,
                                  text=True, env={**os.environ, "PYTHONPATH": str(ROOT / "guests" / "python")})
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(len(done.stdout.split()), example.count("\ndef test_"))


if __name__ == "__main__":
    unittest.main()
