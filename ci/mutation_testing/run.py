#!/usr/bin/env python3
"""Mutation testing: applies one mutant at a time to a copy of the code and asks the gate to find it.

Usage: run.py [--only NAME...] [--shard I/N] [--jobs N] [--json F] [--check] [--prepare]
       run.py --alone [--only NAME...] [--shard I/N] [--jobs N] --json F
                                  finds of a user's commands without this project's tests (ALONE, below)
       run.py --merge JSON...     makes the table from runs of parts; runs nothing. Results of --alone
                                  make only their section

A mutant is a patch, mutants/NN_name.patch, with a head of lines `Field: text` (a line that begins with a space
continues the previous one):
  Stage     step detect split merge expand skin, or launch: code that runs kernels and composes frames; judge: code
            that judges, reads, draws, searches or prints, whose faults may hide a wrong program;
            baseline: another method
  Fault     the program's fault, for a person
  Suspect   the gate's command that is expected to find it; may be given several times, tried in this order. It names
            a program by its CMake target, a test in Python by its file
  Livelock  yes: the mutated program may never end, so a timeout counts as found

There is one copy (build/mutation_testing/tree) with one build folder, without CUDA. The unchanged code must pass every
command that is used. Then for each mutant: patch, build what its suspects need, run them until one finds it; if none
does, the tests of its stage, the properties, and five minutes of `cutproof fuzz`; for one of the judge the tests of the
folders that it patches, because a campaign on right programs cannot show that a judge accepts too much. A mutant that
does not apply or does not compile is an error, not a find. Writes results/mutation_testing.json and the tables of its
page (ci/results.sh) unless --only or --shard is given. Exit status: 0 every mutant was found, 1 one was not or the
unchanged code fails, 2 bad usage or a bad patch.
"""
import argparse
import contextlib
import dataclasses
import filecmp
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
WORK = ROOT / "build" / "mutation_testing"
TREE, BUILD, RUN = WORK / "tree", WORK / "build", WORK / "run"
TABLE = ROOT / "results" / "mutation_testing.json"
STAGES = ("step", "detect", "split", "merge", "expand", "skin", "launch", "judge", "baseline")
# Folders that a mutant may patch: simulators; with the stage `judge` all that judges them. For the latter also the
# tests that run after suspects have failed, without those that take minutes.
SIMULATORS = ("gpu", "reference_cpu")
HARNESS = "harness_test --gtest_filter=-*FaultySimulator*"
TESTS_OF_JUDGES = {
    "oracles": ("registry_test", "oracles_test", HARNESS),
    "harness": (HARNESS,),
    "model": ("model_test", HARNESS),
    "fixtures": ("fixtures_test", HARNESS),
    "property_tests": ("cases_test", HARNESS),
    "tuning": ("tuning_test",),
    "benchmarks": ("benchmarks_test", "tuning_test"),
    "cli": ("cli_test --gtest_filter=-*Allocations*:Interrupted.*:Screen.*",),
    "report": ("report_test",),
    "guests": ("guests_test",),
}
FIELDS = ("Stage", "Fault", "Suspect", "Livelock")
# Commands that find a simulator's fault without this project's tests: campaigns, and checked scenes.
ALONE = {
    "dissections": [f"fuzz --cases 2000 --seed 1 --shrink 0 --save {RUN}"],
    "moving cases": [f"fuzz --dynamics --cases 2000 --seed 1 --shrink 0 --save {RUN}"],
    "scenes": [f"run fixtures/scenes/{scene}.json --check" for scene in ("three_cuts", "cuboid_press", "small_block")],
}
ALONE_FORMAT = "cutproof.mutants_alone"
MOST_SECONDS = 420  # of one command
FUZZ_SECONDS = 300  # of the last resort
FUZZ_FAILS = re.compile(r"case (\d+) FAILS: '(.*?)' fails after")
# The size of a counterexample that a person understands, and the share that should have it.
MOST_STROKES, MOST_PARTICLES, WANTED_SIMPLE = 3, 30, 0.8


class BadMutant(Exception):
    """A mutant without information about the gate: it does not apply, does not compile, or its suspect runs nothing."""


@dataclasses.dataclass
class Mutant:
    name: str
    path: pathlib.Path
    stage: str
    text: str
    suspects: list
    livelock: bool
    files: list  # that the mutant patches

    @property
    def code(self):
        folders = {file.split("/")[0] for file in self.files}
        return " and ".join(sorted(folders))


def read_mutant(path):
    fields = {}
    last = None
    lines = path.read_text().splitlines()
    for number, line in enumerate(lines):
        if line.startswith("--- "):
            break
        if line.startswith(" ") and last:
            fields[last][-1] += " " + line.strip()
            continue
        last, separator, text = line.partition(":")
        if not separator or last not in FIELDS:
            raise BadMutant(f"{path.name}, line {number + 1}: '{line}' is none of {', '.join(FIELDS)}")
        fields.setdefault(last, []).append(text.strip())
    missing = [field for field in ("Stage", "Fault", "Suspect") if field not in fields]
    if missing:
        raise BadMutant(f"{path.name}: {', '.join(missing)} is missing in its head")
    stage = fields["Stage"][0]
    if stage not in STAGES:
        raise BadMutant(f"{path.name}: Stage: '{stage}' is none of {', '.join(STAGES)}")
    files = [line[6:].split("\t")[0] for line in lines if line.startswith("+++ b/")]
    allowed = {"judge": tuple(TESTS_OF_JUDGES), "baseline": ("baselines",)}.get(stage, SIMULATORS)
    if not files or any(file.split("/")[0] not in allowed for file in files):
        raise BadMutant(f"{path.name}: a mutant of stage {stage} patches files of {', '.join(allowed)}, and nothing else")
    return Mutant(path.stem, path, stage, fields["Fault"][0], fields["Suspect"],
                 fields.get("Livelock") == ["yes"], files)


# --- The copy --------------------------------------------------------------------------------------------------------

def copy_tree():
    """Makes TREE the working tree; unchanged files keep their times, so that little is rebuilt."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                            check=True, capture_output=True, text=True).stdout.split("\0")
    wanted = {name for name in listed if name and (ROOT / name).is_file()}
    for name in wanted:
        source, copy = ROOT / name, TREE / name
        if copy.is_file() and filecmp.cmp(source, copy, shallow=False):
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, copy)
    for copy in TREE.rglob("*"):
        if copy.is_file() and str(copy.relative_to(TREE)) not in wanted:
            copy.unlink()


def apply(mutant, check_only=False, tree=TREE):
    # Outside of any repository for git: inside one it would skip ignored files.
    environment = dict(os.environ, GIT_CEILING_DIRECTORIES=str(tree.parent))
    command = ["git", "apply", "--whitespace=nowarn"] + (["--check"] if check_only else []) + [str(mutant.path)]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise BadMutant(f"{mutant.path.name} does not apply: {done.stderr.strip()}")


@contextlib.contextmanager
def applied(mutant):
    """Keeps the mutant in the copy while this lasts."""
    before = {file: (TREE / file).read_bytes() for file in mutant.files}
    apply(mutant)
    try:
        yield
    finally:
        for file, content in before.items():
            (TREE / file).write_bytes(content)


def configure():
    environment = dict(os.environ, CCACHE_BASEDIR=str(TREE))
    command = ["cmake", "-S", str(TREE), "-B", str(BUILD), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
               "-DCUTPROOF_CUDA=OFF", "-DBUILD_TESTING=ON"]
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)


def build(targets, jobs):
    environment = dict(os.environ, CCACHE_BASEDIR=str(TREE))
    done = subprocess.run(["cmake", "--build", str(BUILD), "-j", str(jobs), "--target", *sorted(targets)],
                          env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        errors = [line for line in done.stdout.splitlines() if "error:" in line or "FAILED" in line]
        raise BadMutant("does not compile: " + "\n  ".join(errors[:5] or done.stdout.splitlines()[-5:]))


# --- The gate --------------------------------------------------------------------------------------------------------

def targets_of(commands):
    targets = set()
    for name in (shlex.split(command)[0] for command in commands):
        targets |= {"cutproof", "wire_layout"} if name.endswith(".py") else {name}
    return targets


def program(name):
    programs = [path for path in BUILD.glob(f"**/{name}") if path.is_file() and os.access(path, os.X_OK)]
    if name.endswith(".py"):
        programs = list((TREE / "tests").glob(f"**/{name}"))
    if len(programs) != 1:
        raise BadMutant(f"there is no program '{name}'")
    return str(programs[0])


def fallbacks(mutant):
    if mutant.stage == "baseline":
        return ["baselines_test"]
    if mutant.stage == "judge":
        tests = [test for folder in TESTS_OF_JUDGES if folder in mutant.code for test in TESTS_OF_JUDGES[folder]]
        return [test for test in dict.fromkeys(tests) if test not in mutant.suspects]
    if mutant.code == "reference_cpu":
        backend, kinds, tests = "reference", "*/reference*", "reference_test"
    else:
        backend, kinds, tests = "host", "*/host*:*/simulated*", "kernels_test"
    return [tests, f"property_tests --gtest_filter='{kinds}'",
            f"cutproof fuzz --backend {backend} --cases 1000000000 --seconds {FUZZ_SECONDS}"]


@dataclasses.dataclass
class Outcome:
    found: bool
    by: str = ""      # which property or test
    took: str = ""    # how many cases, for a person
    message: str = ""
    strokes: int = None  # of the shrunk counterexample; None: there is none
    particles: int = None


def run(command, may_hang=False):
    """One command of the gate. Raises BadMutant if it ran no test or rejected its options."""
    name, *arguments = shlex.split(command)
    is_fuzz, is_python = name == "cutproof", name.endswith(".py")
    started = ["/usr/bin/python3", "-B", program(name)] if is_python else [program(name)]
    if not is_fuzz:
        arguments.append("--failfast" if is_python else "--gtest_fail_fast")
    RUN.mkdir(exist_ok=True)
    # Counterexamples of `cutproof fuzz` are shrunk and counted; those of rapidcheck are not used.
    saved = RUN / "counterexamples"
    shutil.rmtree(saved, ignore_errors=True)
    saved.mkdir()
    if is_fuzz:
        arguments += ["--save", str(saved)]
    environment = dict(os.environ, RC_PARAMS="noshrink=1 seed=1")
    if is_python:
        environment.update(CUTPROOF=program("cutproof"), CUTPROOF_WIRE_LAYOUT=program("wire_layout"))
    process = subprocess.Popen([*started, *arguments], cwd=RUN, env=environment, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, errors="replace")
    late = threading.Event()
    timer = threading.Timer(MOST_SECONDS, lambda: (late.set(), process.kill()))
    timer.start()
    text = ""
    violation = False
    for line in process.stdout:
        text += line
        violation = violation or (is_fuzz and FUZZ_FAILS.match(line) is not None)
    status = process.wait()
    timer.cancel()
    if late.is_set() and not violation:
        if may_hang:
            return Outcome(True, f"`{command}`", "livelock", f"does not end within {MOST_SECONDS} s")
        raise BadMutant(f"'{command}' does not end within {MOST_SECONDS} s, and the mutant is not marked as a livelock")
    if is_fuzz and status == 2:
        raise BadMutant(f"'{command}': {text.strip()}")
    outcome = (read_fuzz if is_fuzz else read_python if is_python else read_tests)(text)
    outcome.found = status != 0
    if not outcome.found:
        return outcome
    for path in saved.glob("*.json"):
        document = json.loads(path.read_text())
        if document.get("format") == "cutproof.counterexample":
            outcome.strokes = len(document["case"]["strokes"])
            outcome.particles = len(document["case"]["nodes"])
    if status < 0 and not violation:
        outcome.took = f"crash, signal {-status}"
    if not outcome.by:
        outcome.by, outcome.message = f"`{command}`", text.strip()[-300:]
    return outcome


def read_fuzz(text):
    failure = next((match for match in map(FUZZ_FAILS.match, text.splitlines()) if match), None)
    if not failure:
        return Outcome(False)
    backend = re.search(r"^fuzzing backend ([^:]+)", text, re.MULTILINE).group(1)
    return Outcome(True, f"fuzz on {backend}: {failure.group(2)}", plural(int(failure.group(1)) + 1, "case"),
                   failure.group(0))


def read_tests(text):
    ran = re.search(r"^\[==========\] Running (\d+) test", text, re.MULTILINE)
    if not ran or int(ran.group(1)) == 0:
        raise BadMutant("its suspect runs no test: " + text.strip()[-200:])
    tests = re.findall(r"^\[ RUN      \] (\S+)", text, re.MULTILINE)
    if "[  FAILED  ]" not in text:
        # A crash names no test: the last one that began has crashed. Otherwise nothing failed.
        return Outcome(False, by=tests[-1] if tests and "[  PASSED  ]" not in text else "")
    failed = re.search(r"^\[  FAILED  \] (\S+?),? ", text, re.MULTILINE).group(1)
    cases = re.search(r"Falsifiable after (\d+) test", text)
    schedules = re.search(r"after (\d+) schedules?\b", text)
    took = (plural(int(cases.group(1)), "case") if cases else
            plural(int(schedules.group(1)), "schedule") if schedules else "unit test")
    failure = re.search(r"Failure\n(.*(?:\n.*){0,4})", text)
    return Outcome(True, failed, took, failure.group(1) if failure else "")


def read_python(text):
    ran = re.search(r"^Ran (\d+) test", text, re.MULTILINE)
    if not ran or int(ran.group(1)) == 0:
        raise BadMutant("its suspect runs no test: " + text.strip()[-200:])
    failed = re.search(r"^(?:FAIL|ERROR): (\w+) \((?:__main__\.)?(\w+)", text, re.MULTILINE)
    if not failed:
        return Outcome(False)
    return Outcome(True, f"{failed.group(2)}.{failed.group(1)}", "unit test", text.strip()[-300:])


def plural(count, noun):
    return f"{count} {noun}{'' if count == 1 else 's'}"


def judge(mutant, jobs):
    """Applies one mutant. Returns the outcome and the command that gave it; (None, None) if the mutant survives."""
    with applied(mutant):
        built = set()
        for command in mutant.suspects + fallbacks(mutant):
            needed = targets_of(mutant.suspects if command in mutant.suspects else [command])
            if not needed <= built:
                build(needed, jobs)
                built |= needed
            outcome = run(command, mutant.livelock)
            if outcome.found:
                return outcome, command
    return None, None


def passes_unchanged(command, jobs):
    build(targets_of([command]), jobs)
    outcome = run(command)
    if outcome.found:
        print(f"FAILS on the unchanged code: {command}: {outcome.by}: {outcome.message}", flush=True)
    return not outcome.found


def backends_of(mutant):
    return [backend for folder, backend in (("reference_cpu", "reference"), ("gpu", "host")) if folder in mutant.code]


def alone(backends):
    """For each of ALONE the first property that the built program fails; "" if everything holds."""
    RUN.mkdir(parents=True, exist_ok=True)
    result = RUN / "alone.json"
    found = {}
    for name, commands in ALONE.items():
        found[name] = ""
        for command in [f"{c} --backend {backend}" for backend in backends for c in commands]:
            result.unlink(missing_ok=True)
            try:
                done = subprocess.run([program("cutproof"), *command.split(), "--json", str(result)], cwd=TREE,
                                      capture_output=True, text=True, errors="replace", timeout=MOST_SECONDS)
            except subprocess.TimeoutExpired:
                found[name] = "no end"
                break
            if done.returncode == 2:
                raise BadMutant(f"'{command}': {done.stderr.strip()}")
            if done.returncode != 0:
                found[name] = first_failure(result) or f"status {done.returncode}"
                break
    return found


def first_failure(result):
    try:
        document = json.loads(result.read_text())
    except (OSError, ValueError):
        return None
    if isinstance(document.get("verdicts"), list):  # of `run`; `fuzz` counts them and lists what fails
        return next((v["property"] for v in document["verdicts"] if not v["holds"]), None)
    return next((v["property"] for v in document["violations"]), None)


# --- Results ---------------------------------------------------------------------------------------------------------

def is_simple(row):
    return row["strokes"] <= MOST_STROKES and row["particles"] <= MOST_PARTICLES


def simplicity(rows):
    sized = [row for row in rows if row["strokes"] is not None]
    simple = sum(1 for row in sized if is_simple(row))
    return (f"Of {plural(len(sized), 'counterexample')} that `cutproof fuzz` has shrunk, {simple} "
            f"{'has' if simple == 1 else 'have'} at most {MOST_STROKES} strokes and {MOST_PARTICLES} particles.")


def read_table():
    """The present table; a run keeps the parts that it does not make."""
    return json.loads(TABLE.read_text()) if TABLE.exists() else {"rows": [], "alone": None, "hours": 0}


def write_document(hours, rows, alone):
    """One line for each mutant; the page's tables are made from it."""
    head = {"format": "cutproof.mutants", "format_version": 1, "hours": round(hours, 1), "stages": STAGES, "alone": alone}
    lines = [f" {json.dumps(key)}: {json.dumps(value)}," for key, value in head.items()]
    lines += [' "rows": [', ",\n".join("  " + json.dumps(row, ensure_ascii=False) for row in rows), " ]"]
    TABLE.write_text("\n".join(["{", *lines, "}"]) + "\n")
    subprocess.run([ROOT / "ci" / "results.sh"], check=True)


def write_alone(by_itself):
    """Puts the finds of --alone into the table: for each stage [found, asked] by each of ALONE and by any."""
    stages = {name: read_mutant(HERE / "mutants" / f"{name}.patch").stage for name in by_itself}
    counts = {}
    for stage in (*STAGES, "all"):
        of_stage = [found for name, found in by_itself.items() if stage in (stages[name], "all")]
        if of_stage:
            asked = [[found[name] for found in of_stage if name in found] for name in ALONE]
            counts[stage] = [[sum(map(bool, answers)), len(answers)] for answers in asked]
            counts[stage].append([sum(any(found.values()) for found in of_stage), len(of_stage)])
    missed = [name for name in sorted(by_itself) if not any(by_itself[name].values())]
    before = read_table()
    write_document(before["hours"], before["rows"], {"columns": list(ALONE), "stages": counts, "missed": missed})


def write_table(rows):
    kept = ("name", "stage", "found", "by", "took", "strokes", "particles")
    write_document(sum(row["seconds"] for row in rows) / 3600, [{key: row[key] for key in kept} for row in rows],
                   read_table()["alone"])


def merge(files):
    rows, by_itself = {}, {}
    for file in files:
        try:
            document = json.loads(pathlib.Path(file).read_text())
            if document["format"] == ALONE_FORMAT:
                by_itself.update(document["rows"])
                continue
            if not document["unchanged_passes"]:
                raise BadMutant(f"{file}: the unchanged code failed")
            for row in document["faults"]:
                if row["name"] in rows:
                    raise BadMutant(f"{file}: {row['name']} is in another file too; give each part once")
                rows[row["name"]] = row
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise BadMutant(f"{file} is no result of --json: {error!r}") from None
    names = {path.stem for path in (HERE / "mutants").glob("*.patch")}
    missing = names - rows.keys() if rows else set()
    for what, wrong in (("missing", missing), ("no mutants any more", (rows.keys() | by_itself.keys()) - names)):
        if wrong:
            named = ", ".join(sorted(wrong)[:5]) + (f" and {len(wrong) - 5} more" if len(wrong) > 5 else "")
            raise BadMutant(f"--merge: {what}: {named}; run these parts again")
    status = conclude([rows[name] for name in sorted(rows)], True, True) if rows else 0
    if by_itself:
        write_alone(by_itself)
    return status


def conclude(rows, holds, whole):
    if whole:
        write_table(rows)
    survivors = [row["name"] for row in rows if not row["found"]]
    print(simplicity(rows))
    print(f"{len(rows) - len(survivors)} of {plural(len(rows), 'mutant')} found"
          + (", not found: " + ", ".join(survivors) if survivors else ""))
    return 0 if holds and not survivors else 1


def run_alone(mutants, options):
    build({"cutproof"}, options.jobs)
    unchanged = alone(("reference", "host"))
    if any(unchanged.values()):
        raise BadMutant(f"the unchanged code fails: {unchanged}")
    rows = {}
    for mutant in mutants:
        with applied(mutant):
            build({"cutproof"}, options.jobs)
            rows[mutant.name] = alone(backends_of(mutant))
        print(f"{mutant.name}: " + "; ".join(f"{name}: {by or 'not found'}" for name, by in rows[mutant.name].items()),
              flush=True)
        if options.json:
            pathlib.Path(options.json).write_text(json.dumps({"format": ALONE_FORMAT, "rows": rows}, indent=1) + "\n")
    return 0


def main():
    parser = argparse.ArgumentParser(description="Applies mutants and asks the gate to find them.")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="mutants whose name begins with one of these")
    parser.add_argument("--shard", metavar="I/N", help="every N-th of these mutants, beginning with the I-th")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="of the builds")
    parser.add_argument("--json", metavar="F", help="write the results there as well")
    parser.add_argument("--alone", action="store_true", help="what campaigns and checked scenes find of simulators' mutants")
    parser.add_argument("--prepare", action="store_true", help="only make and build the copy")
    parser.add_argument("--check", action="store_true", help="only whether every mutant applies to the code as it is")
    parser.add_argument("--merge", nargs="+", metavar="JSON", help="the table of runs of parts; runs nothing")
    options = parser.parse_args()

    if options.merge:
        return merge(options.merge)
    paths = sorted((HERE / "mutants").glob("*.patch"))
    if options.only:
        for name in options.only:
            if not any(path.stem.startswith(name) for path in paths):
                raise BadMutant(f"--only: there is no mutant '{name}' in {HERE / 'mutants'}")
        paths = [path for path in paths if any(path.stem.startswith(name) for name in options.only)]
    if options.shard:
        shard = re.fullmatch(r"(\d+)/(\d+)", options.shard)
        if not shard or not 1 <= int(shard.group(1)) <= int(shard.group(2)):
            raise BadMutant(f"--shard: '{options.shard}' is not I/N with 1 <= I <= N")
        paths = paths[int(shard.group(1)) - 1::int(shard.group(2))]
    mutants = [read_mutant(path) for path in paths]
    if not mutants:
        raise BadMutant(f"there are no mutants in {HERE / 'mutants'}")
    if options.check:
        for mutant in mutants:
            apply(mutant, check_only=True, tree=ROOT)
        print(plural(len(mutants), "mutant") + " apply")
        return 0

    copy_tree()
    for mutant in mutants:
        apply(mutant, check_only=True)
    configure()
    if options.prepare:
        build({"all"}, options.jobs)
        return 0
    if options.alone:
        return run_alone([mutant for mutant in mutants if mutant.stage not in ("judge", "baseline")], options)
    holds = True
    commands = sorted({command for mutant in mutants for command in mutant.suspects})
    build(targets_of(commands), options.jobs)
    begin = time.monotonic()
    for command in commands:
        holds = passes_unchanged(command, options.jobs) and holds
    print(f"unchanged: {plural(len(commands), 'command')}, {'all pass' if holds else 'FAILS'}"
          f" ({time.monotonic() - begin:.0f} s)", flush=True)

    rows = []
    for mutant in mutants:
        begin = time.monotonic()
        try:
            outcome, command = judge(mutant, options.jobs)
        except BadMutant as error:
            raise BadMutant(f"{mutant.path.name}: {error}") from None
        # A command that is no suspect has not run on the unchanged code.
        if outcome and command not in commands:
            holds = passes_unchanged(command, options.jobs) and holds
        row = {"name": mutant.name, "stage": mutant.stage, "fault": mutant.text, "code": mutant.code,
               "found": outcome is not None, "command": command or "", "by": outcome.by if outcome else "",
               "took": outcome.took if outcome else "", "message": outcome.message if outcome else "",
               "strokes": outcome.strokes if outcome else None,
               "particles": outcome.particles if outcome else None,
               "suspected": command in mutant.suspects, "seconds": round(time.monotonic() - begin, 1)}
        rows.append(row)
        result = f"{row['by']} ({row['took']})" if outcome else "NOT FOUND"
        if row["strokes"] is not None:
            result += f", {plural(row['strokes'], 'stroke')}, {plural(row['particles'], 'particle')}"
        note = "" if row["suspected"] or not outcome else " [not by its suspect]"
        print(f"{mutant.name}: {result}{note} ({row['seconds']:.0f} s)", flush=True)
        if options.json:
            pathlib.Path(options.json).write_text(json.dumps(
                {"format": "cutproof.mutation_testing", "format_version": 1, "unchanged_passes": holds, "faults": rows},
                indent=1) + "\n")
    return conclude(rows, holds, not options.only and not options.shard)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except BadMutant as error:
        print(f"mutation testing: {error}", file=sys.stderr)
        sys.exit(2)
