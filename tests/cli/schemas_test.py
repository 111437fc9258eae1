#!/usr/bin/env python3
"""The JSON Schemas of docs/reference/schemas/: every subcommand with --json writes documents that follow its schema, a
field that no schema knows is found, and stored results follow too.

Usage: schemas_test.py CUTPROOF SOURCES KERNELS STAGES     KERNELS, STAGES: plugins that parameters make wrong
"""
import collections
import copy
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from schemas import NOT_OF_A_DOCUMENT, Schemas, in_words, name_of

MOST_WORDS = 25  # of a description
FREE = ("coverage",)  # an object whose fields are names of data
# Of stored documents: fields and words that the program no longer writes.
RETIRED = ("'rotation' was unexpected", "'rotation', 'split' were unexpected", "'split' was unexpected",
           "'single_pass' is not one of")
SCENE = {"version": 5, "name": "small", "frame": {"count": 3}, "step": {"gravity": [0, 0, -9.81]},
         "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]}, "spacing": 0.01}}
CLOSED = "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
OPEN = CLOSED.replace("4 4 0", "4 3 0").replace("3 2 0 3\n", "")
wrong = []


def expect(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what)


# --- Schemas by themselves

def parts_of(schema, path=""):
    """A schema and all schemas in it, each with its path."""
    yield path, schema
    for word, inner in schema.items():
        if word in ("properties", "$defs"):
            for name, one in inner.items():
                yield from parts_of(one, f"{path}/{name}")
        elif word in ("anyOf", "oneOf") and isinstance(inner, list):
            for one in inner:
                yield from parts_of(one, path)
        elif word in ("items", "additionalProperties") and isinstance(inner, dict):
            yield from parts_of(inner, path)


def are_complete(schemas):
    for name, schema in schemas.all.items():
        schemas.validator(name).check_schema(schema)
        for path, part in parts_of(schema):
            for field, of_field in part.get("properties", {}).items():
                expect("description" in of_field, f"{name}{path}/{field} has no description")
            is_closed = "properties" not in part or part.get("additionalProperties") is False
            expect(is_closed, f"{name}{path} takes any field")
            words = len(part.get("description", "").split())
            expect(words <= MOST_WORDS, f"{name}{path}: {words} words, more than {MOST_WORDS}")


def places(value, path=()):
    """Of every object in a document; of a list, of its first and last entry."""
    if isinstance(value, dict):
        if path[-1:] != FREE:
            yield path
        for name, inner in value.items():
            yield from places(inner, (*path, name))
    elif isinstance(value, list):
        for number in sorted({0, len(value) - 1} if value else ()):
            yield from places(value[number], (*path, number))


def find_what_is_new(schemas, document):
    for path in list(places(document)):
        changed = copy.deepcopy(document)
        place = changed
        for step in path:
            place = place[step]
        place["not_in_the_schema"] = 1
        expect(schemas.errors(changed), f"{name_of(document)}: a new field passes at {'/'.join(map(str, path))}")


# --- What the program writes

class Program:
    def __init__(self, program, folder, schemas):
        self.program, self.folder, self.schemas = program, folder, schemas
        self.seen = {}  # subcommand or suite -> documents
        self.kinds = collections.Counter()

    def write(self, name, what):
        (self.folder / name).write_text(what if isinstance(what, str) else json.dumps(what))

    def run(self, *arguments):
        return subprocess.run([self.program, *arguments], cwd=self.folder, capture_output=True, text=True)

    def document(self, line, *more, status=0):
        arguments = [*line.split(), *more]
        done = self.run(*arguments, "--json", "out.json")
        expect(done.returncode == status, f"{line}: status {done.returncode}: {done.stdout[-500:]}{done.stderr}")
        file = self.folder / "out.json"
        if not file.exists():
            expect(False, f"{line}: it has written nothing")
            return {}
        document = json.loads(file.read_text())
        file.unlink()
        for error in self.schemas.errors(document)[:3]:
            expect(False, f"{line}: {in_words(error)}")
        verb = " ".join(arguments[:2]) if arguments[0] == "bench" else arguments[0]
        self.seen.setdefault(verb, []).append(document)
        self.kinds[name_of(document)] += 1
        return document

    def subcommands(self, *of):
        listed = self.run(*of, "--help").stdout.partition("Subcommands:\n")[2].partition("\n\n")[0]
        return re.findall(r"^  (\S+)", listed, re.M)

    def that_write(self):
        verbs = [[verb] for verb in self.subcommands()]
        verbs = [verb for verb in verbs if verb != ["bench"]] + \
            [["bench", suite] for verb in verbs if verb == ["bench"] for suite in self.subcommands("bench")]
        return {" ".join(verb) for verb in verbs if re.search(r"^  --json ", self.run(*verb, "--help").stdout, re.M)}


def judged(program):
    run, scenes = program.document, pathlib.Path(sys.argv[2]) / "fixtures/scenes"
    program.write("small.json", SCENE | {"expect": {"components_at_end": 1}})
    program.write("wrong.json", SCENE | {"expect": {"components_at_end": 7}})
    program.write("closed.off", CLOSED)
    program.write("open.off", OPEN)
    run("run small.json --backend host --set step.iterations=3 --seed 7")
    run("run small.json --check --record small")
    (program.folder / "then.json").write_text(json.dumps(run("run wrong.json --check --record wrong", status=1)))
    run("run wrong.json --check --baseline then.json")
    run("run small.json --check --backend", f"plugin:{sys.argv[4]}")
    run("run", str(scenes / "small_block.json"), "--check", "topology", "--mesh", "open.off", "--unit", "cm",
        "--repair", "--repair-change", "1", "--spacing", "0.001", "--frames", "2")
    run("run", str(scenes / "three_cuts.json"), "--check", "--frames", "25", "--backend", "host", "--errors", "all",
        "--against", "reference")
    run("check small")
    run("check wrong --check topology --baseline then.json")
    run("info --mesh closed.off")
    run("info --mesh open.off --unit cm", status=1)


def of_others(program):
    run, folder = program.document, program.folder
    two = {"edges": [[0, 1]], "cluster_offsets": [0, 2], "cluster_members": [0, 1]}
    numpy.savez(folder / "state.npz", positions=numpy.eye(3)[:2], **{name: numpy.int32(of) for name, of in two.items()})
    run("check state.npz")
    still = numpy.zeros((4, 2, 3)) + [[[0, 0, 0], [1, 0, 0]]]
    kicked, pushed = still.copy(), still.copy()
    kicked[1:, 1, 0] += 0.1
    pushed[1:, :, 0] += 0.1
    piece = numpy.int32([0, 1])
    numpy.savez(folder / "kick.npz", positions=still, kicked=kicked, piece=piece, time=numpy.arange(4.0))
    numpy.savez(folder / "felt.npz", positions=still, kicked=pushed, piece=piece, again=still + 1e-9,
                kicked_piece=numpy.int32(1))
    run("kick kick.npz")
    run("kick felt.npz", status=1)
    rest, x = still[0], still + 1e-3 * numpy.arange(4)[:, None, None]
    drift = 1e-3 * numpy.arange(4)[:, None, None]
    for name, steps, positions in (("one", 1, x), ("same", 1, x), ("two", 2, x + drift), ("four", 4, x + 3 * drift)):
        numpy.savez(folder / f"{name}.npz", positions=positions, rest=rest, edges=numpy.int32([[0, 1]]), spacing=1.0,
                    steps=numpy.int32(steps))
    run("check one.npz")
    run("relate one.npz same.npz --map same")
    run("relate one.npz two.npz --map same", status=1)
    run("relate one.npz two.npz four.npz --map refine", status=1)
    program.run("vectors", "merge", "-o", "vectors.npz", "--cases", "1")
    questions = numpy.load(folder / "vectors.npz")
    for name, prefix in (("right", "example_"), ("unmerged", "")):
        numpy.savez(folder / f"{name}.npz", **{each: questions[prefix + each]
                                               for each in ("cluster_offsets", "offsets", "members", "number")
                                               if prefix + each in questions})
    run("check-vectors vectors.npz right.npz --promises covered")
    run("check-vectors vectors.npz unmerged.npz", status=1)


def drawn(program):
    run, folder = program.document, program.folder
    run("fuzz --cases 20 --sizes 0-20")
    run("fuzz --backend simulated --schedule random --seconds 0.2 --sizes 0-9 --batch 2")
    for shard in ("1", "2"):
        (folder / f"{shard}.json").write_text(json.dumps(
            run(f"fuzz --backend host --dynamics --cases 20 --sizes 0-20 --shard {shard}/2")))
    run("fuzz --merge 1.json 2.json")
    run("fuzz --merge 2.json", status=1)
    run("fuzz --sizes 0-20 --seed 7 --cases 50 --shrink 1 --backend", f"plugin:{sys.argv[4]},split", status=1)
    run("judge", sys.argv[3], "components", "--cases", "30", "--sizes", "0")
    run("judge", sys.argv[3], "components", "--cases", "30", "--parameters", "labels16", "--shrink", "1", status=1)
    run("judge", sys.argv[3], "components", "--cases", "60", "--parameters", "refuse", status=1)
    run("judge", sys.argv[4], "stages", "--cases", "30", "--parameters", "split", "--shrink", "1", status=1)


def measured(program):
    run = program.document
    run("tune small.json --tolerance 0.5 --reference substeps --repeats 1 --frames 1")
    run("tune small.json --tolerance 1e-9 --repeats 1 --frames 1", status=1)
    for suite in ("stages --backend host --sizes 1000 --frames 1 --repeats 1",
                  "sampling --frames 1 --repeats 1", "clusters --particles 500 --tau 0.5",
                  "scale --sizes 1000 --frames 1 --repeats 1", "rotations --matrices 10 --timed 100 --repeats 1",
                  "machine_limits --repeats 1", "solver --particles 0 --stiffness 1e5 --iterations 1,64 --samples 1",
                  "baselines --particles 300", "sensitivity --particles 100 --moments 1 --backend host",
                  "parts small.json --repeats 1 --backend host", "campaigns --kinds moving --cases 4 --backend host",
                  "material --sides 2 --poisson-ratio 0.3 --across 4 --iterations 4 --backend host"):
        run("bench " + suite)


# --- What is stored

def stored(schemas, sources):
    """Documents of today's versions: what they lack may have come later, and some fields have gone."""
    of_today, others = collections.Counter(), 0
    for file in sorted((sources / "results").glob("*.json")):
        document = json.loads(file.read_text())
        known = isinstance(document, dict) and "format" in document and schemas.all.get(name_of(document))
        if not known or known["properties"]["format_version"]["const"] != document.get("format_version"):
            others += 1
            continue
        of_today[name_of(document)] += 1
        for error in schemas.errors(document):
            if error.validator != "required" and not any(words in error.message for words in RETIRED):
                expect(False, f"{file.relative_to(sources)}: {in_words(error)}")
    expect(of_today, "no stored document was looked at")
    print(f"stored: {sum(of_today.values())} documents, and {others} of other versions or kinds")


def main():
    schemas = Schemas()
    are_complete(schemas)
    with tempfile.TemporaryDirectory() as folder:
        program = Program(sys.argv[1], pathlib.Path(folder), schemas)
        for part in (judged, of_others, drawn, measured):
            part(program)
        writing = program.that_write()
    expect(len(writing) > 10, f"subcommands with --json: {writing}")
    expect(writing == set(program.seen), f"subcommands with --json that were not run: {writing ^ set(program.seen)}")
    kinds = set(schemas.all) - NOT_OF_A_DOCUMENT
    expect(kinds == set(program.kinds), f"schemas without a document: {kinds - set(program.kinds)}")
    newest = {name_of(document): document for documents in program.seen.values() for document in documents}
    for document in newest.values():
        find_what_is_new(schemas, document)
    stored(schemas, pathlib.Path(sys.argv[2]))
    print(f"schemas: {sum(program.kinds.values())} documents of {len(program.kinds)} kinds; " +
          ("all as they should be" if not wrong else f"{len(wrong)} things are wrong"))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
