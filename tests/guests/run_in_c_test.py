"""cutproof/run.h: files that numpy reads bit for bit, a simulator in C that is judged, and what goes wrong while writing.

The environment names the program (CUTPROOF) and the compilers (CC, CXX).
"""
import ctypes
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from run_test import JudgedRuns

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = ROOT / "docs/reference/run.md"
SPRINGS = ROOT / "guests/examples/runs/springs.c"
FLAGS = ["-Wall", "-Wextra", "-Werror", "-pedantic", f"-I{ROOT}/guests/include"]
C, CPP = ["-std=c99"], ["-x", "c++", "-std=c++11"]
FAULTS = {"heals": "no coupling across pieces", "glued_by_one_node": "no coupling across pieces",
          "spin_lost": "angular momentum", "momentum_from_nothing": "linear momentum"}
# The functions of the header are inline: a library has them under names of its own.
LIBRARY = """#include <cutproof/plugin.h>
#include <cutproof/run.h>
size_t run_size(void) { return sizeof(cutproof_run); }
const char* run_name(int k) { return k < CUTPROOF_RUN_ARRAYS ? cutproof_run_arrays[k].name : NULL; }
int run_open(cutproof_run* r, const char* folder) { return cutproof_run_open(r, folder); }
int run_promise(cutproof_run* r, const char* words) { return cutproof_run_promise(r, words); }
int run_number(cutproof_run* r, const char* name, double x) { return cutproof_run_number(r, name, x); }
int run_frame(cutproof_run* r) { return cutproof_run_frame(r); }
int run_close(cutproof_run* r) { return cutproof_run_close(r); }
"""
TYPES = {"float64": ("f64", "double"), "float32": ("f32", "float"), "int64": ("i64", "int64_t"),
         "int32": ("i32", "int32_t"), "uint8": ("u8", "uint8_t")}
for short, of_c in TYPES.values():
    LIBRARY += (f"int run_{short}(cutproof_run* r, const char* name, const {of_c}* x, size_t rows, size_t columns) "
                f"{{ return cutproof_run_{short}(r, name, x, rows, columns); }}\n")


def compiled(folder, name, source, *flags):
    compiler = os.environ["CXX" if "c++" in flags else "CC"].split()
    subprocess.run([*compiler, *flags[:flags.index("--")], *FLAGS, source, *flags[flags.index("--") + 1:], "-o",
                    folder / name], check=True)
    return folder / name


class Run:
    """A cutproof_run of the library."""

    def __init__(self, library, folder):
        self.library, self.memory = library, ctypes.create_string_buffer(library.run_size())
        self.opened = self.call("open", str(folder).encode())

    def call(self, function, *arguments):
        return getattr(self.library, f"run_{function}")(self.memory, *arguments)

    def put(self, name, array, rows=None, columns=None):
        """As its shape says: rows, and all else a row's columns."""
        array = np.ascontiguousarray(array)
        rows = (len(array) if array.ndim else 1) if rows is None else rows
        columns = array.size // max(1, len(array) if array.ndim else 1) if columns is None else columns
        return self.call(TYPES[str(array.dtype)][0], name.encode(), ctypes.c_void_p(array.ctypes.data),
                         ctypes.c_size_t(rows), ctypes.c_size_t(columns))

    def number(self, name, value):
        return self.call("number", name.encode(), ctypes.c_double(value))

    @property
    def error(self):
        return self.memory.value.decode()


class WrittenInC(JudgedRuns):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="cutproof_run_in_c_")
        cls.addClassCleanup(folder.cleanup)
        cls.built = pathlib.Path(folder.name)
        (cls.built / "library.c").write_text(LIBRARY)
        cls.library = ctypes.CDLL(compiled(cls.built, "library.so", cls.built / "library.c", *C, "-O2", "-shared",
                                           "-fPIC", "--"))
        cls.library.run_name.restype = ctypes.c_char_p
        cls.library.run_size.restype = ctypes.c_size_t
        cls.springs = {
            "double": compiled(cls.built, "double", SPRINGS, *C, "-O2", "--", "-lm"),
            "single": compiled(cls.built, "single", SPRINGS, *C, "-O2", "-DSINGLE", "--", "-lm"),
            "as C++, checked": compiled(cls.built, "checked", SPRINGS, *CPP, "-O1", "-fsanitize=address,undefined",
                                        "-fno-sanitize-recover=all", "--"),
        }

    def test_numpy_reads_the_same_bits(self):
        random = np.random.default_rng(1)

        def of(kind, *shape):
            bits = random.integers(0, 256, (*shape, np.dtype(kind).itemsize), dtype=np.uint8)
            return bits.view(kind)[..., 0]

        n = 5
        given = {"rest": of("f4", n, 3), "gravity": of("f8", 3), "spacing": of("f8"), "steps": of("i8"),
                 "damping": of("f4"), "edges": of("i4", 4, 2), "nodes": of("i8", n, 3),
                 "permutation": of("i4", n), "cut_resolution": of("f8"),
                 "unit_roundoff": of("f8"), "positions": of("f8", n, 3), "time": of("f8"),
                 "velocities": of("f4", n, 3), "alive": of("u1", n), "removed": of("i4", n), "held": of("i8", n),
                 "contact_impulse": of("f4", 3), "spin": of("f8", n, 3), "energy": of("f4"),
                 "blade": of("f4", 2, 4, 3), "groups_offsets": of("i8", 3), "groups_members": of("u1", 300),
                 "groups_weights": of("f4", 300), "cells": of("i4", 0, 8), "mass": of("f8", n), "parent": of("i4", n),
                 "piece": of("i8", n), "vertices": of("f4", 6, 3), "triangles": of("i4", 7, 3)}
        by_frame = {"positions", "time", "velocities", "alive", "removed", "held", "contact_impulse", "spin", "energy",
                    "blade", "vertices"}
        names = [self.library.run_name(k).decode() for k in range(len(given) + 1)]
        self.assertEqual(set(names), {*given, "promises"})
        self.assertIsNone(self.library.run_name(len(names)))
        run = Run(self.library, self.folder / "run")
        for name, array in given.items():
            row = array[None] if name in ("gravity", "contact_impulse") else array
            self.assertEqual(run.put(name, row, columns=8 if name == "cells" else None), 0, run.error)
        self.assertEqual(run.call("promise", b"free energy"), 0, run.error)
        self.assertEqual(run.call("frame"), 0, run.error)
        triangles = {"positions": of("f4", n + 2, 3), "blade": of("f8", 3, 3, 3), "cells": of("i4", 2, 4)}
        for name, array in triangles.items():
            self.assertEqual(run.put(name, array), 0, run.error)
        self.assertEqual(run.call("frame") or run.call("close"), 0, run.error)
        self.assertEqual(sorted(os.listdir(self.folder / "run")), ["000000.npz", "000001.npz"])
        for number, wanted in enumerate((given, triangles)):
            with np.load(self.folder / f"run/{number:06}.npz") as found:
                for name, array in wanted.items():
                    array = array[None] if name in by_frame else array
                    self.assertEqual((found[name].dtype, found[name].shape), (array.dtype, array.shape), name)
                    self.assertEqual(found[name].tobytes(), array.tobytes(), name)
                if number == 0:
                    self.assertEqual(str(found["promises"][()], "ascii"), "free energy")
                self.assertEqual(set(found), {*wanted, *(["promises"] if number == 0 else [])})

    def test_the_page_s_arrays_are_the_writer_s(self):
        page = PAGE.read_text()
        tables = page[page.index("Given once"):page.index("## Promises")]
        named = {name for line in re.findall(r"^\| (`.*?) \|", tables, re.M) for name in re.findall(r"`(\w+)`", line)}
        writer, k = set(), 0
        while (name := self.library.run_name(k)) is not None:
            writer.add(name.decode())
            k += 1
        self.assertEqual(named, writer)

    def test_numbers(self):
        run = Run(self.library, self.folder)
        for name, value in (("steps", 10), ("spacing", 0.1), ("time", -1.5)):
            self.assertEqual(run.number(name, value), 0, run.error)
        self.assertEqual(run.put("positions", np.zeros((1, 3))) or run.call("frame") or run.call("close"), 0, run.error)
        with np.load(self.folder / "000000.npz") as found:
            self.assertEqual((found["steps"].dtype, found["steps"][()]), (np.int64, 10))
            self.assertEqual((found["spacing"][()], found["time"].tolist()), (0.1, [-1.5]))

    def test_what_does_not_fit_is_refused_by_name(self):
        x = np.zeros((4, 3))
        for problem, act in (
                ("velocity: There is no array", lambda run: run.put("velocity", x)),
                ("positions: Its type is i4; wanted are f32 or f64", lambda run: run.put("positions", x.astype("i4"))),
                ("alive: Its type is f8; wanted are integers", lambda run: run.put("alive", x[:, 0])),
                ("steps: Its type is f8; wanted are integers", lambda run: run.number("steps", 2.5)),
                ("promises: Its type is u1; wanted are words", lambda run: run.put("promises", np.uint8(1))),
                ("positions: It has 2 columns; wanted are 3", lambda run: run.put("positions", x[:, :2])),
                ("cells: It has 5 columns; wanted are 4", lambda run: run.put("cells", np.zeros((1, 5), np.int32))),
                ("velocities: It has 3 rows; wanted are 4",
                 lambda run: run.put("positions", x) or run.put("velocities", x[:3])),
                ("time: It has 2 rows; wanted are 1", lambda run: run.put("time", np.zeros(2))),
                ("positions: It is given twice", lambda run: run.put("positions", x) or run.put("positions", x)),
                ("rest: It is given once, with the first frame",
                 lambda run: run.put("positions", x) or run.call("frame") or run.put("rest", x)),
                ("positions: Frame 0 has none", lambda run: run.put("mass", x[:, 0]) or run.call("frame")),
                ("positions: Frame 0 has none", lambda run: run.put("positions", x[:0], columns=3) or run.call("frame")),
                ("positions: Frame 1 has 3 particles, and the one before has 4",
                 lambda run: run.put("positions", x) or run.call("frame") or run.put("positions", x[:3]) or
                 run.call("frame")),
                ("vertices: With it frame 0 has 4 GiB or more", lambda run: run.put("vertices", x, rows=178956971)),
                ("vertices: With it frame 0 has 4 GiB or more", lambda run: run.put("vertices", x, rows=2**64 // 24 + 1)),
                ("promises: wanted are a few words", lambda run: run.call("promise", b"")),
                ("Arrays were given behind the last frame", lambda run: run.put("positions", x) or run.call("close")),
                ("The run has no frames", lambda run: run.call("close"))):
            with self.subTest(problem):
                run = Run(self.library, self.folder / "run")
                self.assertEqual(run.opened, 0, run.error)
                self.assertEqual(act(run), -1)
                self.assertIn(problem, run.error)
                self.assertEqual([run.put("positions", x), run.call("frame"), run.call("close")], [-1] * 3)
                self.assertIn(problem, run.error)  # the first failure
                self.assertEqual([name for name in os.listdir(self.folder / "run") if name != "000000.npz"], [])

    def test_an_older_run_does_not_go_on_behind_a_new_one(self):
        for name in ("000000.npz", "000007.npz", "000008.npz.part", "other.npz", "000009.npy"):
            (self.folder / name).write_text("")
        run = Run(self.library, self.folder)
        self.assertEqual(run.put("positions", np.zeros((1, 3))) or run.call("frame") or run.call("close"), 0, run.error)
        self.assertEqual(sorted(os.listdir(self.folder)), ["000000.npz", "000009.npy", "other.npz"])

    def test_where_nothing_can_be_written_an_error_says_so(self):
        (self.folder / "file").write_text("")
        for folder, why in ((self.folder / "file", "Not a directory"), (self.folder / "file/run", "Not a directory"),
                            (self.folder / "away/run", "No such file or directory"),
                            (pathlib.Path("/proc/run"), "No such file or directory"),
                            (pathlib.Path("a" * 1030), "too long")):
            run = Run(self.library, folder)
            self.assertEqual(run.opened, -1, folder)
            self.assertIn(why, run.error)
        run = Run(self.library, self.folder / "gone")
        (self.folder / "gone").rmdir()
        self.assertEqual(run.put("positions", np.zeros((1, 3))), -1)
        self.assertIn("gone/000000.npz: No such file or directory", run.error)

    def test_a_full_disk_leaves_whole_files_only(self):
        """The system refuses bytes beyond a limit of files, in the midst of the values of every frame but the small."""
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        self.addCleanup(resource.setrlimit, resource.RLIMIT_FSIZE, (soft, hard))  # Python ignores SIGXFSZ
        for count in (3000, 200, 4):  # beyond what stdio keeps, and within: seen when it is written, or flushed
            run = Run(self.library, self.folder / "run")
            self.assertEqual(run.put("positions", np.zeros((1, 3))) or run.call("frame"), 0, run.error)
            resource.setrlimit(resource.RLIMIT_FSIZE, (250, hard))
            status = run.put("positions", np.zeros((count, 3))) or run.call("frame")
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
            self.assertEqual((status, run.call("close")), (-1, -1))
            self.assertIn("run/000001.npz: File too large", run.error)
            self.assertEqual(os.listdir(self.folder / "run"), ["000000.npz"])
            self.assertEqual(len(np.load(self.folder / "run/000000.npz")["positions"]), 1)

    def test_right_springs_hold(self):
        for how, program in self.springs.items():
            with self.subTest(how):
                subprocess.run([program, self.folder / "run"], check=True)
                status, document, text = self.check(self.folder / "run")
                self.assertEqual(status, 0, text)
                self.assertEqual((document["run"]["frames"], document["pieces"]["sure"], document["pieces"]["coupled"]),
                                 (24, 2, 2), text)
                self.assertEqual(document["single_precision"], how == "single")
                for wanted in {*FAULTS.values(), "pieces coupled within", "centre of mass", "no teleport"}:
                    self.assertIn(wanted, [verdict["property"] for verdict in document["verdicts"]])

    def test_faulty_springs_fail_the_property_that_is_named(self):
        for fault, wanted in FAULTS.items():
            for how in ("double", "single"):
                with self.subTest(fault=fault, how=how):
                    subprocess.run([self.springs[how], self.folder / "run", fault], check=True)
                    status, document, _ = self.check(self.folder / "run")
                    self.assertEqual(status, 1)
                    self.assertIn(wanted, [v["property"] for v in document["verdicts"] if not v["holds"]])

    def test_what_was_written_before_a_kill_is_judged(self):
        run = self.folder / "run"
        child = subprocess.Popen([self.springs["double"], run, "right", "1000000"])
        try:
            while not (run / "000030.npz").exists():
                self.assertIsNone(child.poll())
        finally:
            child.kill()
            child.wait()
        whole = sum(name.endswith(".npz") for name in os.listdir(run))
        status, document, text = self.check(run)
        self.assertEqual((status, document["run"]["frames"]), (0, whole), text)

    def test_the_page_s_program_writes_a_run_in_few_lines(self):
        program = re.search(r"```c\n(.*?)```", PAGE.read_text(), re.S)[1]
        self.assertLessEqual(len(re.findall("cutproof_run", program)), 15)
        (self.folder / "page.c").write_text(program)
        for flags in (C, CPP):
            written = compiled(self.folder, "page", self.folder / "page.c", *flags, "--")
            subprocess.run([written], cwd=self.folder, check=True)
            status, document, text = self.check(self.folder / "run")
            self.assertEqual(status, 0, text)
            self.assertIn("no coupling across pieces", [verdict["property"] for verdict in document["verdicts"]])


if __name__ == "__main__":
    unittest.main(verbosity=2)
