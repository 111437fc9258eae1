#!/usr/bin/env python3
"""Every letter that a page may show is in DejaVu Sans, the font that comes with a browser on a bare Debian.
Usage: glyphs_test.py SOURCES. Exit status 77 without the font."""
import pathlib
import struct
import sys

sources = pathlib.Path(sys.argv[1])
font = pathlib.Path("/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf")
if not font.exists():
    print("skipped: fonts-dejavu-core is not installed")
    sys.exit(77)


def letters(ttf):
    """Of a TrueType font, by its table of 32-bit characters: cmap, format 12."""
    tables = {ttf[k:k + 4]: struct.unpack(">II", ttf[k + 8:k + 16])
              for k in range(12, 12 + 16 * struct.unpack(">H", ttf[4:6])[0], 16)}
    cmap = ttf[tables[b"cmap"][0]:]
    for k in range(struct.unpack(">H", cmap[2:4])[0]):
        table = cmap[struct.unpack(">I", cmap[8 + 8 * k:12 + 8 * k])[0]:]
        if struct.unpack(">H", table[:2])[0] == 12:
            groups = struct.unpack(">I", table[12:16])[0]
            return {code for g in range(groups)
                    for low, high, _ in [struct.unpack(">III", table[16 + 12 * g:28 + 12 * g])]
                    for code in range(low, high + 1)}
    raise AssertionError("the font has no table of format 12")


there = letters(font.read_bytes())
assert ord("a") in there and 0x23f8 not in there, "the font is read wrongly"
files = [path for pattern in ("report/**/*", "oracles/**/*.cpp", "harness/*.cpp", "docs/design/method.md",
                              "docs/design/tolerances.md", "docs/reference/oracles.md")
         for path in sources.glob(pattern) if path.is_file()]
assert len(files) > 80, len(files)
missing = {letter: path.name for path in files for letter in path.read_text() if letter > "~" and ord(letter) not in there}
assert not missing, missing
print(f"{len(files)} files: every letter is in {font.name}")
