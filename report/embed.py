#!/usr/bin/env python3
"""Puts the page's template, style and script into a C++ source, with their hashes for the Content-Security-Policy.
Usage: embed.py PAGE.html PAGE.css BUNDLE.js OUT.cpp"""
import base64
import hashlib
import pathlib
import re
import sys


def digest(text):
    return "sha256-" + base64.b64encode(hashlib.sha256(text).digest()).decode()


def literal(text):
    """A C++ literal in pieces: no compiler likes a line of half a megabyte."""
    pieces = []
    for first in range(0, len(text), 8000):
        piece = "".join(chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}"
                        for b in text[first:first + 8000])
        pieces.append(f'"{piece}"')
    return "\n".join(pieces) or '""'


*given, out = sys.argv[1:]
html, style, script = (pathlib.Path(name).read_bytes() for name in given)
# Nothing in a script or a style may end its element. In a text of a script, \! is an exclamation mark.
script = script.replace(b"<!--", b"<\\!--")
for name, text in (("script", script), ("style", style)):
    if re.search(rb"</" + name.encode() + rb"|<!--", text, re.I):
        sys.exit(f"embed.py: the {name} holds what would end its element")
values = {"kPageHtml": html, "kPageStyle": style, "kPageStyleHash": digest(style).encode(),
          "kPageScript": script, "kPageScriptHash": digest(script).encode()}
text = '#include "report/assets.h"\n\nnamespace cutproof::report {\n'
for name, value in values.items():
    # The length is said because a literal may hold a NUL.
    text += f"const std::string_view {name}({literal(value)},\n                                  {len(value)});\n"
pathlib.Path(out).write_text(text + "}  // namespace cutproof::report\n")
