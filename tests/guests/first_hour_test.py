"""docs/tutorial.md, word by word: its commands in an empty folder, and what it says that they print.
Usage: first_hour_test.py SOURCES CUTPROOF WORK"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

sources, program, work = (pathlib.Path(given).resolve() for given in sys.argv[1:4])
text = (sources / "docs/tutorial.md").read_text()
blocks = re.findall(r"```(sh|text|cpp)\n(.*?)```", text, re.S)


def words(printed):
    """Lines may be broken anywhere between words."""
    return " ".join(printed.split())


shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
shutil.copy(sources / "guests/examples/splitter.cpp", work)
environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}",
                   CPLUS_INCLUDE_PATH=str(sources / "guests/include"))
environment.pop("GITHUB_ACTIONS", None)
output, fixed, run = "", False, 0
for kind, block in blocks:
    if kind == "cpp":
        assert words(block) in words((work / "splitter.cpp").read_text()), f"the example has no such line: {block}"
    elif kind == "text":
        for line in block.strip().splitlines():
            assert words(line) in words(output), f"'{line}' is not printed:\n{output}"
    else:
        output = ""
        for command in block.strip().splitlines():
            fixed = fixed or command.startswith("sed ")
            wanted = 1 if command.startswith("cutproof") and not fixed else 0
            done = subprocess.run(command, shell=True, cwd=work, env=environment, capture_output=True, text=True,
                                  timeout=300)
            output += done.stdout + done.stderr
            run += 1
            assert done.returncode == wanted, f"{command}: status {done.returncode}, not {wanted}\n{output}"
assert fixed and run == 9, f"the page has {run} commands, and the fix is {'' if fixed else 'not '}among them"
print("the tutorial is true")
