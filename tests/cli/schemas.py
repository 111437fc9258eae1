#!/usr/bin/env python3
"""Documents of --json beside their schemas (docs/reference/schemas/).

Usage: schemas.py FILE...     Exit status: 0 every document follows its schema, 1 one does not
"""
import json
import pathlib
import sys

import jsonschema

FOLDER = pathlib.Path(__file__).resolve().parent.parent.parent / "docs" / "reference" / "schemas"
NOT_OF_A_DOCUMENT = {"common", "against", "errors"}  # parts, to which the others refer


def name_of(document):
    """Of its schema, without the extension."""
    kind, suite = document["format"].removeprefix("cutproof."), document.get("suite")
    return kind if kind != "bench" else suite if suite == "tune" else f"bench_{suite}"


class Schemas:
    def __init__(self):
        self.all = {file.stem: json.loads(file.read_text()) for file in sorted(FOLDER.glob("*.json"))}
        self.store = {(FOLDER / f"{name}.json").as_uri(): schema for name, schema in self.all.items()}

    def validator(self, name):
        uri = (FOLDER / f"{name}.json").as_uri()
        resolver = jsonschema.RefResolver(uri, self.all[name], store=self.store)
        return jsonschema.Draft202012Validator(self.all[name], resolver=resolver)

    def errors(self, document):
        if "format" not in document or name_of(document) not in self.all:
            return [jsonschema.ValidationError(f"no schema for {document.get('format')} {document.get('suite', '')}")]
        return list(self.validator(name_of(document)).iter_errors(document))


def in_words(error):
    return f"{error.json_path}: {error.message[:300]}"


def main():
    schemas, status = Schemas(), 0
    for file in sys.argv[1:]:
        for error in schemas.errors(json.loads(pathlib.Path(file).read_text())):
            status = 1
            print(f"{file}: {in_words(error)}")
    return status


if __name__ == "__main__":
    sys.exit(main())
