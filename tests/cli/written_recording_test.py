#!/usr/bin/env python3
"""The recording that docs/reference/recording.md writes in Python, as the page has it: it holds, and what is spoilt in it
does not. Usage: written_recording_test.py CUTPROOF SOURCES WORK"""
import os
import pathlib
import re
import shutil
import subprocess
import sys

program, sources, work = (pathlib.Path(given).resolve() for given in sys.argv[1:4])
section = (sources / "docs/reference/recording.md").read_text().split("## Written by somebody else")[1]
scene = re.search(r"```json\n(.*?)```", section, re.S).group(1)
writer = re.search(r"```python writer\n(.*?)```", section, re.S).group(1)
commands = re.search(r"```sh\n(.*?)```", section, re.S).group(1).strip().splitlines()
assert len(writer.splitlines()) <= 40, f"the writer has grown to {len(writer.splitlines())} lines"
assert len(commands) == 3

environment = dict(os.environ, PATH=f"{program.parent}:/usr/bin:{os.environ['PATH']}")


def run(name, spoil):
    """Status and output of the page's last command, with the writer spoilt in one way."""
    folder = work / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / "falling.json").write_text(scene)
    assert spoil == (None, None) or writer.count(spoil[0]) == 1, f"{name}: the page has no line '{spoil[0]}'"
    (folder / "write.py").write_text(writer if spoil[0] is None else writer.replace(*spoil))
    for command in commands:
        done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True,
                              timeout=120)
        if command != commands[-1]:
            assert done.returncode == 0, f"{name}: {command}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.returncode, done.stdout + done.stderr


status, output = run("as_written", (None, None))
assert status == 0 and "everything holds" in output and "backend mine" in output, f"{status}\n{output}"
for name, spoil, verdict in (
        ("heavier", ('dt * step["gravity"]', '1.01 * dt * step["gravity"]'), "linear momentum after step"),
        ("not_a_number", ("v = v * np.exp", "v = np.nan * v * np.exp"), "finite after step"),
        ("a_frame_short", ('enumerate(index["setup/substep_length"][:])', 'enumerate(index["setup/substep_length"][:-1])'),
         "the run is whole")):
    status, output = run(name, spoil)
    assert status == 1 and f"FAILS: {verdict}, " in output, f"{name}: status {status}, not '{verdict}':\n{output}"
# Rows that are not there are a damaged file, not a verdict.
status, output = run("beyond_the_rows", ("= append(points, x)", "= append(points, x) + 1"))
assert status == 2 and "position_row" in output, f"{status}\n{output}"
print("the page's writer is true")
