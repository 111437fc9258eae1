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

    def run(self, *arguments, github=False, step_summary=None):
        environment = {name: value for name, value in os.environ.items() if name not in ("GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY")}
        if github:
            environment["GITHUB_ACTIONS"] = "true"
        if step_summary:
            environment["GITHUB_STEP_SUMMARY"] = step_summary
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
    def scene(file, **more):
        (program.folder / file).write_text(json.dumps(SCENE | more))
        return file

    good = scene("good.json", expect={"components_at_end": 1})
    done = program.run("run", good, "--check", "--json", "good.out", "--record", "seen")
    expect(done.returncode == 0, done.stdout + done.stderr)
    properties = {f"{p['property']} after {p['stage']}": p
                  for p in json.loads((program.folder / "good.out").read_text())["properties"]}
    cases = program.junit(0, "run", good, "--check")
    expect(properties.keys() <= cases.keys(), f"no case for {properties.keys() - cases.keys()}")
    expect("expected components at the end" in cases, f"what the scene expects is no case: {list(cases)}")
    vacuous = {name for name, p in properties.items() if p["judged"] == 0}
    skipped = {name for name, case in cases.items() if case.find("skipped") is not None}
    expect(vacuous and vacuous == skipped, f"vacuous {vacuous}, skipped {skipped}")
    expect(all(len(of(cases[name], "skipped")[0]) > len("nothing to look at: ") for name in skipped), "skipped without a reason")
    expect(all(of(cases[name], "skipped")[0].startswith("nothing to look at: ") for name in skipped), "another reason")
    expect(float(cases["admissible step after step"].get("time")) > 0, "judging has taken no time")
    expect(program.annotations(0, "run", good, "--check") == [], "annotations of what holds")
    cases = program.junit(0, "run", scene("dots.json", name="a.b/c.d"), "--check")
    expect({case.get("classname") for case in cases.values()} == {"cutproof.run.a_b/c_d"}, "dots in a class")

    # A run that fails, in a file whose name a shell has to be told.
    bad = scene("it's bad.json", expect={"components_at_end": 7})
    again = "cutproof run 'it'\\''s bad.json' --backend host --check"  # whose default is motion
    cases = program.junit(1, "run", bad, "--backend", "host", "--check")
    message, text = of(cases["expected components at the end"], "failure")
    expect(message and again in text and "1 of 1 verdicts fail" in text, f"no witness or no command: {message} {text}")
    expect([name for name, case in cases.items() if case.find("failure") is not None] ==
           ["expected components at the end"], "other cases fail as well")
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

    # The summary of a step, to which each command adds.
    program.run("run", good, "--check", step_summary="summary.txt")
    program.run("run", bad, "--check", step_summary="summary.txt")
    summary = (program.folder / "summary.txt").read_text()
    expect(summary.startswith("### cutproof run good.json "), summary)
    expect(summary.count("### ") == 2 and ": holds\n" in summary and ": 1 failure\n" in summary and
           "- **expected components at the end**: " in summary and "\n      cutproof run 'it'\\''s bad.json'" in summary,
           summary)
    done = program.run("run", good, "--check", step_summary="nowhere/summary.txt")
    expect(done.returncode == 3 and "GITHUB_STEP_SUMMARY" in done.stderr, f"a summary that cannot be written: {done}")

    # The same of a recording.
    cases = program.junit(0, "check", "seen")
    expect(cases["coverage after skin"].get("classname") == "cutproof.check.small", "the class of check's cases")
    program.run("run", bad, "--record", "worse")
    cases = program.junit(1, "check", "worse")
    expect("cutproof check worse" in of(cases["expected components at the end"], "failure")[1], "no command")
    found = program.annotations(1, "check", "worse")
    expect(len(found) == 1 and found[0].endswith("; see it again: cutproof check worse"), f"annotations: {found}")


def baselines(program):
    """What failed before does not count; what is new does, and what is slower does not."""
    def scene(**expect_block):
        (program.folder / "scene.json").write_text(json.dumps(SCENE | {"expect": expect_block}))

    def document(name):
        return json.loads((program.folder / name).read_text())

    def run(status, *more):
        done = program.run("run", "scene.json", "--check", *more)
        expect(done.returncode == status, f"{more}: status {done.returncode}, not {status}: {done.stdout}{done.stderr}")
        return done.stdout

    beside = ("--baseline", "before.json", "--json", "now.json")
    scene(components_at_end=7)
    run(1, "--json", "before.json")
    said = run(0, *beside)
    expect("fails as in the baseline: expected components at the end (1 verdict, 1 in the baseline)" in
           " ".join(said.split()) and said.splitlines()[-1] == "beside before.json: nothing new fails.", said)
    now = document("now.json")
    expect(now["summary"]["holds"] is False and now["baseline"]["new"] == [] and
           [one["name"] for one in now["baseline"]["known"]] == ["expected components at the end"], f"{now['baseline']}")
    cases = program.junit(0, "run", "scene.json", "--check", "--baseline", "before.json")
    expect(of(cases["expected components at the end"], "skipped")[0].startswith("fails as in the baseline: "), "JUnit")
    found = program.annotations(0, "run", "scene.json", "--check", "--baseline", "before.json")
    expect(found == ["::warning title=cutproof: fails as in the baseline::expected components at the end"], f"{found}")

    scene(components_at_end=7, clusters=1000)
    said = run(1, *beside)
    expect("new since the baseline: expected clusters" in said and said.splitlines()[-1].endswith("something new fails."),
           said)
    scene(components_at_end=1)
    said = run(0, *beside)
    expect("mended since the baseline: expected components at the end" in said, said)
    expect(document("now.json")["baseline"]["mended"] == ["expected components at the end"], "not mended")
    # A run that stops before says nothing of what failed then.
    said = run(0, *beside, "--frames", "1")
    expect(document("now.json")["baseline"]["not_judged"] == ["expected components at the end"] and "mended" not in said,
           said)

    # Slower by the times of the baseline, and never a failure.
    fast = document("before.json")
    for frame in fast["frames"]:
        frame["seconds"] = {stage: seconds / 1000 for stage, seconds in frame["seconds"].items()}
    (program.folder / "fast.json").write_text(json.dumps(fast))
    said = run(0, "--baseline", "fast.json", "--json", "now.json")
    expect("slower than in the baseline: " in said, said)
    slower = document("now.json")["baseline"]["slower"]
    expect(slower and all(one["seconds_per_frame"] > 100 * one["seconds_per_frame_then"] for one in slower), f"{slower}")

    # That nothing was judged is never known.
    scene()
    run(1, "--frames", "0", "--json", "empty.json")
    said = run(1, "--frames", "0", "--baseline", "empty.json")
    expect("new since the baseline: something was judged" in said, said)

    # A recording beside the run that it is of.
    scene(components_at_end=7)
    program.run("run", "scene.json", "--record", "seen")
    done = program.run("check", "seen", "--baseline", "before.json")
    expect(done.returncode == 0 and "nothing new fails" in done.stdout, f"{done}")

    # Another scene, no result, no file, nothing judged.
    (program.folder / "other.json").write_text(json.dumps(fast | {"scene": "another"}))
    (program.folder / "unjudged.json").write_text(json.dumps(fast | {"checked": False}))
    (program.folder / "broken.json").write_text(json.dumps(fast | {"verdicts": 3}))
    for file, words in (("other.json", ("other.json", "scene", "another")), ("scene.json", ("scene.json", "format")),
                        ("none.json", ("none.json",)), ("unjudged.json", ("checked", "nothing was judged")),
                        ("broken.json", ("verdicts", "no list"))):
        done = program.run("run", "scene.json", "--check", "--baseline", file, "--json", "refused.json")
        expect(done.returncode == 2 and all(word in done.stderr for word in words), f"{file}: {done}")
        expect(not (program.folder / "refused.json").exists(), f"{file}: something was written")
    done = program.run("run", "scene.json", "--baseline", "before.json")
    expect(done.returncode == 2 and "--baseline" in done.stderr, f"nothing is judged: {done}")


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
         "shrunk": {"particles": 1, "strokes": 0, "property": "isolation", "stage": "skin",
                        "text": "'isolation' fails: alone", "witness": "alone"}}]
    (program.folder / "2.json").write_text(json.dumps(failed))
    merging = ["fuzz", "--merge", "1.json", "2.json"]
    cases = program.junit(1, *merging)
    message, text = of(cases["coverage after skin"], "failure")
    expect(message == "5 % <of>\nit", f"message {message!r}")
    expect("cutproof replay 'found here.json'" in text and "case 4: 'coverage' fails: 5 % <of> it" in text, text)
    # Its command shows the shrunk case, so that is what is told of it.
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
        baselines(Program(program, folder))
        campaigns(Program(program, folder))
        vectors(Program(program, folder))
        replays(Program(program, folder), sources)
    print("reports: " + ("all as they should be" if not wrong else f"{len(wrong)} things are wrong"))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
