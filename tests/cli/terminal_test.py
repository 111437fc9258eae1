#!/usr/bin/env python3
"""What is seen in a terminal: colours, errors, and a line of progress that never wraps. Usage: terminal_test.py CUTPROOF SOURCES"""
import fcntl
import json
import os
import pathlib
import pty
import re
import struct
import subprocess
import sys
import tempfile
import termios

wrong = []


def expect(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what)


def in_terminal(command, folder, columns, environment=None, pipe_output=False):
    """Status, and the bytes that a terminal of 24 lines gets."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    plain = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TERM", "COLUMNS")}
    process = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stderr=slave,
                               stdout=subprocess.DEVNULL if pipe_output else slave,
                               env=plain | {"TERM": "xterm"} | (environment or {}))
    os.close(slave)
    seen = b""
    while True:
        try:
            more = os.read(master, 65536)
        except OSError:  # the program has ended
            break
        if not more:
            break
        seen += more
    os.close(master)
    return process.wait(), seen.decode("utf-8", "replace")


COLOUR = re.compile("\x1b\\[[0-9;]*m")
CLEAR = "\r\x1b[K"


def lines_drawn(seen):
    """Each state of each line, without colours: the terminal clears a line and draws it anew."""
    return [part for line in COLOUR.sub("", seen).replace("\r\n", "\n").split("\n") for part in line.split(CLEAR)]


def colours(program, folder):
    run = [program, "run", "scene.json", "--check"]
    for arguments, environment, coloured in (([], {}, True), ([], {"NO_COLOR": "1"}, False), ([], {"NO_COLOR": ""}, True),
                                             ([], {"TERM": "dumb"}, False), (["--color", "never"], {}, False),
                                             (["--color", "always"], {"NO_COLOR": "1", "TERM": "dumb"}, True)):
        status, seen = in_terminal(run + arguments, folder, 80, environment)
        expect(status == 0, f"{arguments}: status {status}: {seen}")
        expect(bool(COLOUR.search(seen)) == coloured, f"{arguments} with {environment}: colours: {not coloured}")
    good = in_terminal(run, folder, 80)[1]
    expect("\x1b[32meverything holds.\x1b[0m" in good, f"what holds is not green: {good!r}")
    status, bad = in_terminal([program, "run", "wrong.json", "--check"], folder, 80)
    expect(status == 1 and "\x1b[31mFAILS\x1b[0m" in bad, f"what fails is not red: {bad!r}")
    # Where standard output is no terminal there is no colour, whatever standard error is.
    done = subprocess.run(run, cwd=folder, capture_output=True, env=os.environ | {"TERM": "xterm"})
    expect(b"\x1b" not in done.stdout + done.stderr, "colours or progress in a pipe")


def progress(program, folder):
    fuzz = [program, "fuzz", "--seconds", "4", "--cases", "100000000", "--sizes", "0-30", "--backend", "reference"]
    for columns in (80, 40, 12):
        status, seen = in_terminal(fuzz, folder, columns)
        # Bodies of these sizes need not meet every class of cases, which 4 s may or may not.
        expect(status == 0, f"fuzz: status {status}")
        drawn = [line for line in lines_drawn(seen) if line.startswith("case ")]
        expect(len(drawn) > 5, f"{columns} columns: {len(drawn)} lines of progress: {seen!r}")
        widest = max(map(len, drawn), default=0)
        expect(widest < columns, f"{columns} columns: a line of progress takes {widest}")
        parts = (r"case \d+( of \d+)?", r", elapsed \d+ (s|min)", r"(, about \d+ (s|min) left|, nearly done)?: \d+ violations",
                 r", \d+ cases/s", r", \d+ of \d+ classes met")
        for line in drawn:
            expect(any(re.fullmatch("".join(parts[:k + 1]), line) for k in range(len(parts))) or columns == 12 and
                   re.fullmatch(r"case( \d+)?( of)?", line), f"{columns} columns: a line ends inside of a word: {line!r}")
        if columns == 80:
            expect(any(re.search(r"elapsed [0-9]+ s, about [0-9]+ s left", line) for line in drawn),
                   f"no time that is left: {drawn[-3:]}")
            remaining = [int(m.group(1)) for line in drawn if (m := re.search(r"about ([0-9]+) s left", line))]
            expect(remaining and max(remaining) <= 8, f"of 4 s up to {max(remaining, default=0)} are said to be left")
        expect(not lines_drawn(seen)[-1].startswith("case "), "the line of progress stays")
    for arguments, word in ((["run", "scene.json"], "frame "), (["check", "seen"], "frame "),
                            (["tune", "scene.json", "--tolerance", "0.5", "--reference", "substeps", "--repeats", "1"],
                             "trial "),
                            (["bench", "scale", "--sizes", "1000,1000", "--frames", "1", "--repeats", "1"], "row ")):
        status, seen = in_terminal([program, *arguments], folder, 80, pipe_output=True)
        drawn = [line for line in lines_drawn(seen) if line.startswith(word)]
        expect(status == 0 and drawn and all("elapsed" in line for line in drawn), f"{arguments}: {status} {seen!r}")
    # A page of 80 columns holds every line whole.
    for arguments in (["run", "scene.json", "--check", "--verbose"], ["info"], ["bench", "--help"]):
        _, seen = in_terminal([program, *arguments], folder, 80)
        expect(max(map(len, lines_drawn(seen))) <= 80, f"{arguments}: a line is wider than the terminal")


def errors(program, folder):
    """Broken on a terminal, at words, as standard output is; one line each where a tool reads them."""
    wrong_field = [program, "run", "scene.json", "--set", "step.iteration=8"]
    done = subprocess.run(wrong_field, cwd=folder, capture_output=True, text=True, env=os.environ | {"COLUMNS": "40"})
    piped = done.stderr
    expect(done.returncode == 2 and done.stdout == "", f"in a pipe: {done}")
    error, remedy = (piped.splitlines() + ["", ""])[:2]
    expect(piped == f"{error}\n{remedy}\n" and error.startswith("cutproof: ") and remedy.startswith("  remedy: "),
           f"in a pipe there is one line each: {piped!r}")
    # To be broken in the middle of any of these terminals.
    expect(max(map(len, (error, remedy))) > 80, f"nothing to be broken: {piped!r}")
    for columns, environment, most in ((80, {}, 80), (200, {}, 80), (40, {}, 40), (80, {"COLUMNS": "60"}, 60),
                                       (80, {"COLUMNS": "200"}, 200), (80, {"COLUMNS": "many"}, 80),
                                       (80, {"COLUMNS": "0"}, 80), (80, {"COLUMNS": "-1"}, 80)):
        where = f"{columns} columns, {environment}"
        status, seen = in_terminal(wrong_field, folder, columns, environment)
        lines = seen.replace("\r\n", "\n").split("\n")
        expect(status == 2, f"{where}: status {status}")
        expect(" ".join(seen.split()) == " ".join(piped.split()), f"{where}: other words: {seen!r}")
        expect(max(map(len, lines)) <= most, f"{where}: wider than {most}: {seen!r}")
        # No narrower than need be: a line takes the first word of the next if there is room.
        for line, following in zip(lines, lines[1:]):
            if not following or following.startswith("  remedy: "):
                continue
            expect(following.startswith("  "), f"{where}: a line stands as if it were an error: {seen!r}")
            expect(len(line) + 1 + len(following.split()[0]) > most, f"{where}: broken too early: {seen!r}")
    path = "./" + "/".join(["a_folder_that_is_not_there"] * 4)
    _, seen = in_terminal([program, "run", path], folder, 40)
    expect(path in seen, f"a path to be copied is in pieces: {seen!r}")
    _, seen = in_terminal([program, "run"], folder, 80)
    expect("cutproof info --scenes" in seen and max(map(len, lines_drawn(seen))) <= 80, f"usage: {seen!r}")


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        scene = {"version": 5, "name": "small", "frame": {"count": 3}, "step": {"gravity": [0, 0, -9.81]},
                 "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]}, "spacing": 0.01}}
        (pathlib.Path(folder) / "scene.json").write_text(json.dumps(scene))
        (pathlib.Path(folder) / "wrong.json").write_text(json.dumps(scene | {"expect": {"components_at_end": 7}}))
        subprocess.run([program, "run", "scene.json", "--record", "seen"], cwd=folder, capture_output=True, check=True)
        colours(program, folder)
        progress(program, folder)
        errors(program, folder)
    print("terminal: " + ("all as it should be" if not wrong else f"{len(wrong)} things are wrong"))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
