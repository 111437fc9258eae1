#!/usr/bin/env python3
"""--junit and annotations of every verb that has them. Usage: reports_test.py CUTPROOF SOURCES"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as tree
import zipfile

wrong = []
SCENE = {"version": 5, "name": "small", "frame": {"count": 3}, "step": {"gravity": [0, 0, -9.81]},
         "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]}, "spacing": 0.01}}


def expect(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what)


class Program:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)

    def run(self, *arguments, github=False):
        environment = {name: value for name, value in os.environ.items() if name not in ("GITHUB_ACTIONS",)}
        if github:
            environment["GITHUB_ACTIONS"] = "true"
        return subprocess.run([self.program, *arguments], cwd=self.folder, env=environment, capture_output=True,
                              text=True)

    def annotations(self, status, *arguments):
        """The lines that GitHub takes, which are there for it alone; the exit status does not depend on them."""
        silent, done = self.run(*arguments), self.run(*arguments, github=True)
        expect(silent.returncode == done.returncode == status,
               f"{arguments}: status {done.returncode}, not {status}: {done.stdout}{done.stderr}")
        expect("::error" not in silent.stdout + silent.stderr, f"{arguments}: annotations without GitHub")
        return [line for line in done.stdout.splitlines() if line.startswith("::")]

    def junit(self, status, *arguments):
        done = self.run(*arguments, "--junit", "report.xml")
        expect(done.returncode == status,
               f"{arguments}: status {done.returncode}, not {status}: {done.stdout}{done.stderr}")
        root = tree.parse(self.folder / "report.xml").getroot()
        expect(root.tag == "testsuites" and len(root) == 1, f"{arguments}: not one suite")
        cases = list(root.iter("testcase"))
        names = [case.get("name") for case in cases]
        expect(len(set(names)) == len(names), f"{arguments}: a case stands there twice: {names}")
        for holder in (root, root[0]):
            for attribute, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
                expect(int(holder.get(attribute)) == sum(case.find(tag) is not None for case in cases),
                       f"{arguments}: {attribute} are counted wrong")
            expect(int(holder.get("tests")) == len(cases) > 3, f"{arguments}: tests are counted wrong")
            expect(float(holder.get("time")) > 0, f"{arguments}: it has taken no time")
        # CI and the exit status must say the same.
        fails = int(root.get("failures")) + int(root.get("errors")) > 0
        expect(fails == (status == 1), f"{arguments}: status {status}, and the report says otherwise")
        return {case.get("name"): case for case in cases}


def of(case, tag):
    found = case.find(tag) if case is not None else None
    return ("", "") if found is None else (found.get("message"), found.text or "")


def runs(program, sources):
    def scene(name, **more):
        (program.folder / name).write_text(json.dumps(SCENE | more))
        return name

    good = scene("good.json", expect={"components_at_end": 1})
    done = program.run("run", good, "--check", "--json", "good.out", "--record", "seen")
    expect(done.returncode == 0, done.stdout + done.stderr)
    properties = {f"{p['property']} after {p['stage']}": p
                  for p in json.loads((program.folder / "good.out").read_text())["properties"]}
    cases = program.junit(0, "run", good, "--check")
    expect(properties.keys() <= cases.keys(), f"no case for {properties.keys() - cases.keys()}")
    expect("expected components at the end after skin" in cases, f"what the scene expects is no case: {list(cases)}")
    vacuous = {name for name, p in properties.items() if p["judged"] == 0}
    skipped = {name for name, case in cases.items() if case.find("skipped") is not None}
    expect(vacuous and vacuous == skipped, f"vacuous {vacuous}, skipped {skipped}")
    expect(all(len(of(cases[name], "skipped")[0]) > len("vacuous: ") for name in skipped), "skipped without a reason")
    expect(program.annotations(0, "run", good, "--check") == [], "annotations of what holds")

    # A run that fails, in a file whose name a shell has to be told.
    bad = scene("it's bad.json", expect={"components_at_end": 7})
    again = "cutproof run 'it'\\''s bad.json' --backend host --check"  # whose default is motion
    cases = program.junit(1, "run", bad, "--backend", "host", "--check")
    message, text = of(cases["expected components at the end after skin"], "failure")
    expect(message and again in text and "1 of 1 verdicts fail" in text, f"no witness or no command: {message} {text}")
    expect([name for name, case in cases.items() if case.find("failure") is not None] ==
           ["expected components at the end after skin"], "other cases fail as well")
    found = program.annotations(1, "run", bad, "--backend", "host", "--check")
    expect(len(found) == 1 and found[0].startswith("::error title=cutproof: expected components at the end::") and
           found[0].endswith("; see it again: " + again + " motion"), f"annotations: {found}")
    # --check before the scene takes no depth, and the command stays one that can be given again.
    found = program.annotations(1, "run", "--check", bad)
    expect(len(found) == 1 and found[0].endswith("cutproof run --check 'it'\\''s bad.json'"), f"annotations: {found}")

    # What is not promised is skipped, and what fails as a scene expects passes and says so.
    open_scene = str(sources / "fixtures/scenes/irregular_sampled.json")
    cases = program.junit(0, "run", open_scene, "--check", "topology")
    promised = [of(case, "skipped")[0] for name, case in cases.items() if name.endswith("where it is not promised")]
    expected = [of(case, "system-out")[1] for case in cases.values() if case.find("system-out") is not None]
    expect(promised or expected, "nothing of this scene is unpromised or expected to fail")
    for message in promised:
        expect(message.startswith("not promised: of "), message)
    for text in expected:
        expect("as the scene expects" in text, text)
    expect(expected, f"no case of {list(cases)} fails as the scene expects")

    # Beside the reference, and conservation.
    cases = program.junit(0, "run", good, "--backend", "host", "--against", "reference", "--errors", "conservation")
    expect("lockstep: positions after step" in cases and "conservation" in cases, f"{list(cases)}")
    for arguments, word in ((["run", good], "--check"), (["run", good, "--check"], "nowhere")):
        target = "nowhere/report.xml" if word == "nowhere" else "none.xml"
        done = program.run(*arguments, "--junit", target)
        expect(done.returncode == 2 and word in done.stderr and "frame" not in done.stdout, f"{arguments}: {done}")
    expect(not (program.folder / "none.xml").exists(), "a report of nothing")

    # The same of a recording.
    cases = program.junit(0, "check", "seen")
    expect(cases["coverage after skin"].get("classname") == "cutproof.check.small", "the class of check's cases")
    program.run("run", bad, "--record", "worse")
    cases = program.junit(1, "check", "worse")
    expect("cutproof check worse" in of(cases["expected components at the end after skin"], "failure")[1], "no command")
    found = program.annotations(1, "check", "worse")
    expect(len(found) == 1 and found[0].endswith("; see it again: cutproof check worse"), f"annotations: {found}")


def campaigns(program):
    campaign = ["fuzz", "--backend", "reference", "--cases", "40", "--sizes", "0-30"]
    cases = program.junit(0, *campaign, "--json", "whole.json")
    document = json.loads((program.folder / "whole.json").read_text())
    names = {f"{p['property']} after {p['stage']}" for p in document["properties"]}
    expect(set(cases) == names | {"enough was judged"}, f"cases of a campaign: {set(cases) ^ names}")
    expect(program.annotations(0, *campaign) == [], "annotations of a campaign that holds")

    # One that judged nothing.
    nothing = ["fuzz", "--cases", "0"]
    found = program.annotations(1, *nothing)
    expect(found == ["::error title=cutproof: enough was judged::nothing was judged; see it again: cutproof fuzz --cases 0"],
           f"annotations: {found}")

    # Violations, and a shard that is missing.
    for shard in ("1", "2"):
        program.run(*campaign, "--shard", f"{shard}/3", "--json", f"{shard}.json")
    failed = json.loads((program.folder / "2.json").read_text())
    failed["violations"] = [
        {"index": 4, "property": "coverage", "stage": "skin", "text": "'coverage' fails: 5 % <of> it",
         "witness": "5 % <of>\nit", "file": "found here.json"},
        {"index": 7, "property": "runs to its end", "stage": "skin", "text": "thrown", "witness": "", "file": "b.json",
         "simplified": {"particles": 1, "strokes": 0, "property": "isolation", "stage": "skin",
                        "text": "'isolation' fails: alone", "witness": "alone"}}]
    (program.folder / "2.json").write_text(json.dumps(failed))
    merging = ["fuzz", "--merge", "1.json", "2.json"]
    cases = program.junit(1, *merging)
    message, text = of(cases["coverage after skin"], "failure")
    expect(message == "5 % <of>\nit", f"message {message!r}")
    expect("cutproof replay 'found here.json'" in text and "case 4: 'coverage' fails: 5 % <of> it" in text, text)
    # Its command shows the simplified case, so that is what is told of it.
    message, text = of(cases["runs to its end after skin"], "failure")
    expect(message == "alone" and "case 7: 'isolation' fails: alone" in text, f"a violation of no listed property {text}")
    message, text = of(cases["enough was judged"], "error")
    expect("missing" in message and message.endswith(": 3") and "cutproof fuzz --merge 1.json 2.json" in text,
           f"the missing shard: {message!r} {text!r}")
    found = program.annotations(1, *merging)
    expect(len(found) == 3 and ": 3; see it again: cutproof fuzz --merge 1.json 2.json" in found[0] and found[1:] == [
        "::error title=cutproof: coverage::5 %25 <of>%0Ait; see it again: cutproof replay 'found here.json'",
        "::error title=cutproof: isolation::alone; see it again: cutproof replay b.json"], f"annotations: {found}")
    done = program.run(*campaign, "--junit", "nowhere/report.xml")
    expect(done.returncode == 2 and "nowhere" in done.stderr and "fuzzing" not in done.stdout, f"{done}")


def vectors(program):
    program.run("vectors", "merge", "-o", "vectors.npz", "--cases", "1")
    # Answers that stand in the questions, as numpy would rename them: the names of entries of the archive.
    names = ("cluster_offsets", "offsets", "members", "number")

    def answers(name, prefix):
        with zipfile.ZipFile(program.folder / "vectors.npz") as all_of, zipfile.ZipFile(program.folder / name, "w") as to:
            for array in names:
                to.writestr(f"{array}.npy", all_of.read(f"{prefix}{array}.npy"))

    answers("right.npz", "example_")
    answers("unmerged.npz", "")
    cases = program.junit(0, "check-vectors", "vectors.npz", "right.npz")
    expect(set(cases) >= {"merge legality", "cap kept", "merge maximality"}, f"cases of vectors: {list(cases)}")
    expect(program.annotations(0, "check-vectors", "vectors.npz", "right.npz") == [], "annotations of what holds")
    again = "cutproof check-vectors vectors.npz unmerged.npz"
    cases = program.junit(1, "check-vectors", "vectors.npz", "unmerged.npz")
    message, text = of(cases["merge maximality"], "failure")
    expect("could still merge" in message and again in text, f"no witness or no command: {message} {text}")
    found = program.annotations(1, "check-vectors", "vectors.npz", "unmerged.npz")
    expect(len(found) == 1 and found[0].startswith("::error title=cutproof: merge%3A merge maximality::") and
           found[0].endswith("; see it again: " + again), f"annotations: {found}")
    cases = program.junit(0, "check-vectors", "vectors.npz", "unmerged.npz", "--promises", "covered")
    expect(of(cases["merge maximality"], "skipped")[0] == "not promised", "what is not promised is not skipped")


def replays(program, sources):
    case = sources / "fixtures/regressions/skin_cell_not_renewed.json"
    expect(program.annotations(0, "replay", str(case)) == [], "annotations of a case that holds")
    # A body that is too small for single precision.
    document = json.loads(case.read_text())
    document["case"]["spacing"] = 1e-30
    (program.folder / "tiny.json").write_text(json.dumps(document))
    found = program.annotations(1, "replay", "tiny.json", "--backend", "host")
    expect(len(found) == 1 and found[0].startswith("::error title=cutproof: ") and
           found[0].endswith("; see it again: cutproof replay tiny.json --backend host"), f"annotations: {found}")


def main():
    program, sources = sys.argv[1], pathlib.Path(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        runs(Program(program, folder), sources)
        campaigns(Program(program, folder))
        vectors(Program(program, folder))
        replays(Program(program, folder), sources)
    print("reports: " + ("all as they should be" if not wrong else f"{len(wrong)} things are wrong"))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
