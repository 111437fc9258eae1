#!/usr/bin/env python3
"""Writes the tables of defaults and constants into docs/design/method.md, from the schema of scenes (a test holds it
against the table of fields in the code) and from the constants in the code.

Usage: make_defaults.py [--check]     --check: writes nothing, and reports whether the page is up to date
Exit status: 0 up to date or written, 1 out of date, 2 a constant is missing.
"""
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs/design/method.md"
BEGIN, END = "<!-- defaults: begin -->\n", "<!-- defaults: end -->\n"
# Irrelevant to the simulation.
OTHERS = re.compile(r"\$schema|version|name|description|body\.(?:origin|mesh)|expect")
# Value, file, pattern and the requirement that uses it. The pattern's groups are C++ numbers.
CONSTANTS = [
    ("clearance of the blade, factor", "model/setup.h", r"return (1\.\d+) \* \(setup\.blade\.thickness", "M3.8"),
    ("most turns of blade and walls", "reference_cpu/contacts.cpp", r"kMostTurns = (\S+);", "M3.11"),
    ("refusal, in units of 2⁻⁵³", "model/setup.h", r"kRefusalRoundings = (\S+);", "M3.13"),
    ("`nearer`, in h", "model/setup.h", r"kNearerBy = (\S+);", "M4.2"),
    ("sweep of a turning blade, in h", "reference_cpu/detect.cpp", r"arc / \((\S+) \* spacing\)", "M4.3"),
    ("ties of a geometric cut", "reference_cpu/detect.cpp", r"kTie = 1 \+ (\S+);", "M4.3"),
    ("parts of a crossing", "model/body.h", r"kCrossingSteps = (\d+)", "M1.8"),
    ("least crossing, parts", "model/body.h", r"kLeastCrossing = kCrossingSteps / (\d+)", "M1.8"),
    ("products that count as integers", "fixtures/cook.cpp", r"kSlack = (\S+);", "M2.6"),
    ("equal moments", "fixtures/import/mesh.cpp", r"kEqual = (\S+);", "M1.7"),
    ("flat edge of a skin", "reference_cpu/skin.cpp", r"kFlat = (\S+);", "M8.3"),
    ("greatest eigenvalue", "reference_cpu/step.cpp", r"kGreatestEigenvalue = (\S+);", "M11.1"),
    ("margin of touching, in h", "model/setup.h", r"kTouchMargin = (\S+);", "M11.3"),
    ("eigenvalues of a flat cluster", "model/setup.h", r"kFlatExtent = (\S+);", "M3.17"),
    ("equal eigenvalues", "reference_cpu/rotation.cpp", r"kSameEigenvalue = (\S+);", "M12.1"),
    ("most frames of a scene", "fixtures/schedule.cpp", r"kMostFrames = (\S+);", "M9.4"),
    ("most substeps of a scene", "fixtures/schedule.cpp", r"kMostSubsteps = (\S+);", "M9.4"),
]


def number(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return "(" + ", ".join(number(entry) for entry in value) + ")"
    if isinstance(value, str):
        return f"`{value}`"
    return re.sub(r"e\+?(-?)0*", r"e\1", f"{value:.7g}" if abs(value) < 1e5 else f"{value:.2e}".replace(".00", ""))


def fields(path, tree):
    for name, field in tree["properties"].items():
        inner = f"{path}.{name}" if path else name
        entry = field.get("items", {})
        if OTHERS.fullmatch(inner) or "$ref" in field:
            continue
        if "properties" in field:
            yield from fields(inner, field)
        elif "properties" in entry:
            yield from fields(inner, entry)
        else:
            yield inner, field


def limits(field):
    bounds = field if field.get("type") != "array" else field["items"]
    if "enum" in field:
        return ", ".join(f"`{choice}`" for choice in field["enum"])
    if bounds.get("type") == "array":  # a list of points
        bounds = bounds["items"]
    low = bounds.get("minimum", bounds.get("exclusiveMinimum"))
    high = bounds.get("maximum", bounds.get("exclusiveMaximum"))
    if low is None:
        return ""
    return ("[" if "minimum" in bounds else "(") + f"{number(low)}, {number(high)}" + ("]" if "maximum" in bounds else ")")


def tables():
    lines = ["| field | default | range | unit |", "|---|---|---|---|"]
    for path, field in fields("", json.loads((ROOT / "fixtures/scene.schema.json").read_text(encoding="utf-8"))):
        unit = re.search(r"\[([^\[\]]+)\]$", field.get("description", ""))
        default = number(field["default"]) if "default" in field else ""
        lines.append(f"| `{path}` | {default} | {limits(field)} | {unit.group(1) if unit else ''} |")
    lines += ["", "| constant | value | used by |", "|---|---|---|"]
    for what, file, pattern, used in CONSTANTS:
        found = re.findall(pattern, (ROOT / file).read_text(encoding="utf-8"))
        if len(found) != 1:
            print(f"{file}: {len(found)} places match {pattern}, and one was looked for: change ci/make_defaults.py")
            sys.exit(2)
        text = found[0].replace("'", "")
        value = float.fromhex(text) if text.startswith("0x") else float(text)
        lines.append(f"| {what} | {number(value)} | {used} |")
    return "\n".join(lines) + "\n"


def main():
    page = PAGE.read_text(encoding="utf-8")
    before, begin, rest = page.partition(BEGIN)
    old, end, after = rest.partition(END)
    if not begin or not end:
        print(f"{PAGE}: the marks {BEGIN.strip()} and {END.strip()} are missing")
        return 2
    if old == tables():
        return 0
    if "--check" in sys.argv[1:]:
        print("docs/design/method.md, Defaults: out of date. Make it anew: python3 ci/make_defaults.py")
        return 1
    PAGE.write_text(before + begin + tables() + end + after, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
