#!/usr/bin/env python3
"""The JSON Schema of scenes beside the reader, by Debian's python3-jsonschema: all scenes of the project are valid; of the
documents that model_test has written, with what the reader said of each, those that it reads are valid, and those that it
refuses are not, but for conditions that no schema can say.
Usage: scene_schema_test.py FOLDER SOURCES"""
import json
import pathlib
import sys

import jsonschema

# Conditions of the reader that JSON Schema cannot say: each must have occurred.
BEYOND = ("leave no room", "lies above the upper one", "The grip ends at", "all points of this stroke are the same",
          "This is not a direction", "closes the hole", "shapes in it, more than", "too large to be exact",
          "bytes, more than", "is greater than at_most")

folder, sources = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
schema = json.loads((folder / "schema.json").read_text())
jsonschema.Draft7Validator.check_schema(schema)
validator = jsonschema.Draft7Validator(schema)
wrong = []

scenes = [*sorted((sources / "fixtures/scenes").glob("*.json")), sources / "docs/images/bridge.json"]
for path in scenes:
    scene = json.loads(path.read_text())
    for error in validator.iter_errors(scene):
        wrong.append(f"{path}: {error.json_path}: {error.message[:200]}")
    # A scene with a slip is wrong where the slip is.
    for slip, place in ((lambda s: s["body"].update(spacng=1), "$.body"), (lambda s: s.update(version=4), "$.version"),
                        (lambda s: s.setdefault("step", {}).update(substeps="4"), "$.step.substeps")):
        damaged = json.loads(path.read_text())
        slip(damaged)
        if place not in [error.json_path for error in validator.iter_errors(damaged)]:
            wrong.append(f"{path}: a slip in {place} is valid")

documents = json.loads((folder / "documents.json").read_text())
occurred = set()
for document in documents:
    refusal = document["refusal"]
    reasons = [reason for reason in BEYOND if reason in refusal]
    is_valid = validator.is_valid(document["scene"])
    if is_valid:
        occurred.update(reasons)
    if is_valid != (not refusal) and not (is_valid and reasons):
        said = refusal or next(validator.iter_errors(document["scene"])).message
        wrong.append(f"{'the schema' if is_valid else 'the reader'} alone accepts {json.dumps(document['scene'])[:400]}: {said}")
wrong += [f"no document was refused because of '{reason}' alone" for reason in BEYOND if reason not in occurred]

print("\n".join(wrong[:40]) or f"{len(scenes)} scenes of the project and {len(documents)} documents: schema and reader agree")
sys.exit(1 if wrong else 0)
