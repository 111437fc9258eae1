"""The tutorial of docs/reference/plugins.md, word by word: its files and commands are taken from the page, tried in an
empty folder, and what it says that is printed is printed."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

page, program, include, work = (pathlib.Path(given).resolve() for given in sys.argv[1:5])
text = page.read_text()
blocks = re.findall(r"```(\w+)\n(.*?)```", text, re.S)
sources = [block for kind, block in blocks if kind == "cpp"]
commands = [block.strip().splitlines() for kind, block in blocks if kind == "sh"]
expected = [block.strip().splitlines() for kind, block in blocks if kind == "text"]
cmake = [block for kind, block in blocks if kind == "cmake"]
assert len(sources) == 1 and len(commands) == 2 and len(expected) == 1 and len(cmake) == 1, "the page has other blocks"
assert sum(map(len, commands[:1])) <= 4, "more than four commands to the first verdict"
plugin = sources[0][sources[0].index("// The plugin."):]
statements = [line for line in plugin.splitlines() if line.strip() and not line.startswith("//")]
assert len(statements) <= 8, f"what makes it a plugin has grown to {len(statements)} lines"

shutil.rmtree(work, ignore_errors=True)
work.mkdir(parents=True)
(work / "polar.cpp").write_text(sources[0])
environment = dict(os.environ, PATH=f"{program.parent}:{os.environ['PATH']}", CPLUS_INCLUDE_PATH=str(include))
begin = time.monotonic()
output = ""
for command in commands[0]:
    done = subprocess.run(command, shell=True, cwd=work, env=environment, capture_output=True, text=True, timeout=300)
    output = done.stdout + done.stderr
    assert done.returncode == (1 if command.startswith("cutproof") else 0), f"{command}: {done.returncode}\n{output}"
print(f"first verdict after {time.monotonic() - begin:.1f} s")
for line in output.splitlines():
    assert len(line) <= 80 or line.strip().startswith("cutproof judge "), f"wider than 80 columns: {line}"
for line in expected[0]:
    assert any(printed.startswith(line) for printed in output.splitlines()), f"'{line}' is not printed:\n{output}"
again = subprocess.run(commands[1][0], shell=True, cwd=work, env=environment, capture_output=True, text=True, timeout=300)
assert again.returncode == 1 and "FAILS: 'rotation'" in again.stdout, f"{commands[1][0]}\n{again.stdout}{again.stderr}"

# From CMake, as a project of somebody else that has found the package.
(work / "CMakeLists.txt").write_text(f"""cmake_minimum_required(VERSION 3.25)
project(mine CXX)
enable_testing()
add_library(cutproof_plugin INTERFACE)
target_include_directories(cutproof_plugin INTERFACE {include})
add_library(cutproof::plugin ALIAS cutproof_plugin)
set(CUTPROOF_PROGRAM_FOLDER {program.parent})
include({page.parents[2]}/cmake/CutproofTest.cmake)
{cmake[0]}""")
for command, status in (("cmake -S . -B build -DCMAKE_BUILD_TYPE=Release", 0), ("cmake --build build", 0),
                        ("ctest --test-dir build", 8)):
    done = subprocess.run(command, shell=True, cwd=work, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == status, f"{command}: {done.returncode}\n{done.stdout}{done.stderr}"
assert (work / "build/polar_is_right.junit.xml").read_text().count("<failure") == 2
print("the tutorial is true")
