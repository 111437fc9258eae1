#!/usr/bin/env python3
"""Prints a header with its comments as Doxygen reads them. Usage: doxygen_comments.py FILE      (ci/docs.sh)

The first comment describes the file, a comment on lines of its own the next declaration, a trailing comment its line.
Comments are plain text: no command of Doxygen, and no markup but `code`.
"""
import re
import sys

TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])\'|//|/\*')
MARKUP = re.compile(r"[\\@<>#&%$]|(?<= )\.(?=\.)|(?<=\.)\.(?!\w)")


def as_text(comment):
    parts = comment.split("`")
    parts[::2] = [MARKUP.sub(lambda found: "\\" + found.group(), part) for part in parts[::2]]
    return "`".join(parts)


def begin_of_comment(line):
    return next((found.start() for found in TOKEN.finditer(line) if found.group() in ("//", "/*")), None)


def declares(code):
    """A member, an argument or an enumerator with a trailing comment."""
    return code.endswith((";", ",")) and not code.lstrip().startswith("{") or re.fullmatch(r"\s*\w+( = [^{}]*)?", code)


def converted(lines):
    in_block, column, is_first = False, None, True
    for line in lines:
        if in_block:
            in_block = "*/" not in line
            star, text, end = re.fullmatch(r"(\s*\*?(?!/) ?)(.*?)(\*/.*)?", line).groups()
            yield star + as_text(text) + (end or "")
            continue
        at = begin_of_comment(line)
        if at is None or line.lstrip().startswith("#"):
            column = None
            yield line
            continue
        code, text = line[:at].rstrip(), line[at + 2:]
        text, end, rest = text.partition("*/") if line[at + 1] == "*" else (text, "", "")
        in_block = line[at + 1] == "*" and not end
        if re.match(r"\S.*{$", code) and not in_block:  # of the block that begins here
            yield f"/** {as_text(text.strip())} */"
            yield code
        elif code and not declares(code):
            yield f"{line[:at]}/*{as_text(text)}{end}{rest}" if in_block else code
        else:
            goes_on = bool(code) or column == at
            column = at if goes_on and not in_block else None
            file = "@file\n *" if is_first and not code else ""
            if line[at + 1] == "/":
                yield line[:at] + ("///<" if goes_on else "/// @file\n///" if file else "///") + as_text(text)
            else:
                yield f"{line[:at]}/**{'<' if goes_on else ' ' if file else ''}{file}{as_text(text)}{end}{rest}"
        is_first = False


def main():
    text = open(sys.argv[1], encoding="utf-8").read()
    if "struct fmt::" in text:  # Doxygen needs the namespace
        print("namespace fmt {}")
    print("\n".join(converted(text.splitlines())))


if __name__ == "__main__":
    main()
