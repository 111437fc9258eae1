#!/usr/bin/env python3
"""The programs of docs/reference/vectors.md, run as they stand there, and what they answer, judged; and what the page
says of the arrays. Usage: vectors_test.py CUTPROOF SOURCES"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

wrong = []


def expect(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what)


def cutproof(program, folder, status, *arguments):
    done = subprocess.run([program, *arguments], cwd=folder, capture_output=True, text=True)
    expect(done.returncode == status, f"{arguments}: status {done.returncode}, not {status}: {done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def programs(page):
    return dict(re.findall(r"<!-- run: (\w+) -->\n```python\n(.*?)```", page, re.DOTALL))


def answers_hold(program, sources, folder):
    found = programs((sources / "docs/reference/vectors.md").read_text())
    expect(sorted(found) == ["components", "rotations"], f"the page has programs for {sorted(found)}")
    for operation, code in found.items():
        (folder / "mine.py").write_text(code)
        lines = [line for line in code.splitlines() if line and not line.startswith("import")]
        expect(len(lines) <= 10, f"{operation}: {len(lines)} lines")
        for precision in ("single", "double"):
            cutproof(program, folder, 0, "vectors", operation, "-o", "vectors.npz", "--precision", precision)
            (folder / "answers.npz").unlink(missing_ok=True)
            subprocess.run([sys.executable, "mine.py"], cwd=folder, check=True)
            said = cutproof(program, folder, 0, "check-vectors", "vectors.npz", "answers.npz")
            expect("all hold" in said, f"{operation} in {precision} precision: {said}")
            # The least wrong of them, and the program says where.
            with np.load(folder / "vectors.npz") as v, np.load(folder / "answers.npz") as a:
                if operation == "components":
                    of_several = int(np.argmax(np.bincount(a["label"]) > 1))
                    row = int(np.max(np.nonzero(a["label"] == of_several)))
                    label = a["label"].copy()
                    label[row] = -1
                    np.savez(folder / "answers.npz", label=label)
                else:
                    row = int(np.max(np.nonzero(v["expected"] == 0)))
                    r = a["r"].copy()
                    r[row] = r[row] @ np.diag([1, 1, -1])
                    np.savez(folder / "answers.npz", r=r)
                case = int(np.searchsorted(v["case_offsets"], row, side="right")) - 1
                kind = str(v["kinds"]).split("\n")[v["kind"][case]]
            said = cutproof(program, folder, 1, "check-vectors", "vectors.npz", "answers.npz")
            expect(f"case {case} ({kind})" in " ".join(said.split()), f"{operation}: row {row} of case {case} ({kind}) is broken: {said}")


# Every array that a file has stands in the page, and every one of the page is there.
def arrays_are_described(program, sources, folder):
    page = (sources / "docs/reference/vectors.md").read_text()
    questions = page[page.index("## The questions"):page.index("## The answers")]
    described = set(re.findall(r"`(\w+)`", questions))
    there = {"single", "double", "deterministic", "C", "N", "M"}  # words that are no arrays
    for operation in ("rotations", "components", "surface", "clusters", "split", "merge"):
        cutproof(program, folder, 0, "vectors", operation, "-o", "vectors.npz", "--cases", "1")
        with np.load(folder / "vectors.npz") as v:
            expect(str(v["schema"]) == f"cutproof.vectors {operation} 1", f"{operation}: schema {v['schema']}")
            names = {name for name in v if not name.startswith("example_")}
            if operation == "split":
                names = {name for name in names if not name.startswith("answer_")}
            expect(names <= described, f"{operation}: the page does not have {names - described}")
            there |= set(v)
            cases = len(v["kind"])
            expect(len(v["case_offsets"]) == cases + 1 and cases == len(str(v["kinds"]).split("\n")),
                   f"{operation}: {cases} cases")
            rows = len(v["a"] if operation == "rotations" else v["alive"])
            expect(v["case_offsets"][0] == 0 and v["case_offsets"][-1] == rows, f"{operation}: case_offsets")
            if operation == "rotations":
                check_rotations(v)
    unknown = {name for name in described - there if not name.endswith("_")} - {"X_offsets"}
    expect(not unknown, f"no file has {unknown}")


# The figures that make a rotation acceptable, by numpy.
def check_rotations(v):
    known = v["expected"] < 2
    a = v["a"].reshape(-1, 3, 3)[known].astype(np.longdouble) / np.exp2(v["must_exponent"][known].astype(
        np.longdouble))[:, None, None]
    a = a.astype(float)
    u, s, vt = np.linalg.svd(a)
    s[:, 2] *= np.sign(np.linalg.det(u @ vt))
    expect(np.allclose(s.sum(axis=1), v["must_greatest"][known], atol=1e-12), "must_greatest")
    expect(np.allclose(np.abs(s).sum(axis=1), v["must_singular_sum"][known], rtol=1e-12), "must_singular_sum")
    r = v["answer_r"].reshape(-1, 3, 3)[known]
    unique = ~np.isnan(r[:, 0, 0])
    expect(unique.sum() > len(r) / 2, "hardly any answer is unique")
    gap = (v["must_greatest"][known] - (r * a).sum(axis=(1, 2))) / v["must_singular_sum"][known]
    expect((gap[unique] <= v["bound_gap"]).all(), "answer_r is not acceptable")
    same = v["answer_r"][~known].astype(np.float32), v["previous"][~known]
    expect(np.array_equal(*same), "answer_r where the previous one stays")


def main():
    program, sources = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        answers_hold(program, sources, folder)
        arrays_are_described(program, sources, folder)
    print("wrong:" if wrong else "all is as it should be", len(wrong) or "")
    return 1 if wrong else 0


sys.exit(main())
