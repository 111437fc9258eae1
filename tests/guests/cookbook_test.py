"""docs/cookbook.md, word by word: its programs and commands in an empty folder, and what it says that they print. A
program that needs a library which is not installed is skipped, by name. The table has a row for each property of a run.
Usage: cookbook_test.py SOURCES CUTPROOF WORK"""
import importlib.util
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

sources, program, work = (pathlib.Path(given).resolve() for given in sys.argv[1:4])
page = (sources / "docs/cookbook.md").read_text()
environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}")
environment.pop("GITHUB_ACTIONS", None)


def words(printed):
    """Lines may be broken anywhere between words."""
    return " ".join(printed.split())


def own_lines(code):
    """Of a program, the lines that write the run."""
    lines = code.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("with cutproof_run.Writer"))
    return ["import cutproof_run", *lines[begin:]]


def judge_kernel(code):
    """A program that needs no run: cutproof.judge raises if a verdict fails."""
    for library in re.findall(r"^import (\w+)$", code, re.M):
        if library != "cutproof" and not importlib.util.find_spec(library):
            print(f"SKIPPED: the program that imports {library}, which is not installed")
            return
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    shutil.copy(sources / "guests/python/cutproof.py", work)
    (work / "kernel.py").write_text(code)
    subprocess.run([sys.executable, "-B", "kernel.py"], cwd=work, env=environment, check=True, timeout=300)


output, wanted, programs, red = "", 0, 0, 0
for kind, block in re.findall(r"^```(python|sh|text)\n(.*?)^```", page, re.S | re.M):
    if kind == "python" and "cutproof_run" not in block:
        judge_kernel(block)
    elif kind == "python":
        assert len(own_lines(block)) <= 15, f"{len(own_lines(block))} lines write the run:\n{block}"
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        shutil.copy(sources / "guests/python/cutproof_run.py", work)
        code, wanted, programs, begin = block, 0, programs + 1, time.monotonic()
    elif kind == "sh":
        output = ""
        for command in block.strip().splitlines():
            name = command.split()[-1]
            if command.startswith("python3"):
                command = f"{sys.executable} -B {name}"
                script = name
                if not (work / name).exists():
                    (work / name).write_text(code)
            before = (work / name).read_text() if command.startswith("sed ") else ""
            done = subprocess.run(command, shell=True, cwd=work, env=environment, capture_output=True, text=True,
                                  timeout=300)
            output += done.stdout + done.stderr
            assert done.returncode == (wanted if command.startswith("cutproof") else 0), f"{command}\n{output}"
            if command.startswith("sed "):
                assert (work / name).read_text() != before, f"{command} changes nothing"
                wanted, red = 1, red + 1
        print(f"{script}: {'red' if wanted else 'green'} after {time.monotonic() - begin:.1f} s")
    else:
        for line in block.strip().splitlines():
            assert words(line) in words(output), f"'{line}' is not printed:\n{output}"
assert programs == red == 3, f"{programs} programs, {red} of them with a fault"


def rows(text, after):
    """First columns of the first table after a heading."""
    table = re.search(r"^\|.*?(?=^[^|])", text[text.index(after):], re.S | re.M)[0]
    return [line.split("|")[1].strip() for line in table.splitlines()[2:]]


properties = rows((sources / "docs/reference/oracles.md").read_text(), "## A run of any simulator")
assert rows(page, "## Verdict, likely cause, first check") == properties, "the table does not list the properties of a run"
registry = (sources / "oracles/registry.cpp").read_text()
named = [name for row in rows(page, "Of states and stages") for name in row.split(", ")]
unknown = [name for name in named if f'("{name}"' not in registry]
assert not unknown, f"there are no properties {unknown}"
print(f"{programs} programs and {len(properties)} rows are true, {len(named)} properties of states and stages are there")
