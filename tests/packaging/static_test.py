#!/usr/bin/env python3
"""Makes packages as ci/package.sh does, and asks of them what it says: glibc 2.34 and nothing else, wherever they lie.

Then runs the program of the archive and of the wheel, and what the examples for CI systems call. Exit status: 0 all is as
it should be, 1 something is not, 77 this is no Debian 12.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile

from archive_test import expect, judge, must, run, wrong

OLDEST = (2, 34)
GLIBC = {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2"}
SCENE = ["run", "small_block", "--check", "topology"]


def needs_glibc_alone(program, name):
    shown = must(["readelf", "--wide", "--dynamic", "--dyn-syms", program])
    needed = set(re.findall(r"\(NEEDED\).*\[(.+)\]", shown))
    expect(needed and needed <= GLIBC, f"{name} needs {needed - GLIBC}")
    symbols = {found: tuple(map(int, version.split(".")))
               for found, version in re.findall(r"(\S+)@GLIBC_([\d.]+)", shown)}
    newer = {found: version for found, version in symbols.items() if version[:2] > OLDEST}
    expect(symbols and not newer, f"{name} needs a glibc later than {OLDEST}: {newer}")


def judge_wheel(wheel, options):
    named = re.fullmatch(rf"cutproof-{re.escape(options.version)}-py3-none-manylinux_2_(\d+)_\w+\.whl", wheel.name)
    expect(named and (2, int(named.group(1))) <= OLDEST, f"the wheel is called {wheel.name}")
    environment, empty = options.work / "venv", options.work / "empty_wheel"
    empty.mkdir()
    surroundings = {"cwd": empty, "env": {"PATH": "/usr/bin:/bin", "HOME": str(empty)}}
    must(["/usr/bin/python3", "-m", "venv", "--system-site-packages", environment], **surroundings)
    before = {path for path in environment.rglob("*") if path.suffix != ".pyc"}
    # numpy is the system's: nothing comes over the network.
    must([environment / "bin/pip", "install", "--no-index", wheel], **surroundings)
    version = must([environment / "bin/python", "-m", "cutproof", "--version"], **surroundings)
    expect(version == f"cutproof {options.version}\n", f"python -m cutproof says {version}")
    for command in ([environment / "bin/cutproof"], [environment / "bin/python", "-m", "cutproof"]):
        done = run([*command, *SCENE], **surroundings)
        expect(done.returncode == 0 and "everything holds." in done.stdout, f"{command}: {done.stdout}")
    done = run([environment / "bin/python", "-m", "cutproof", "run", "nowhere"], **surroundings)
    expect(done.returncode == 2, f"python -m cutproof loses the exit status, {done.returncode}: {done.stdout}")
    done = run([environment / "bin/python", "-c", "import cutproof\ncutproof.judge(rotations=lambda a, previous: a)"],
               **surroundings)
    expect(done.returncode == 1 and "'best rotation' fails" in done.stdout, f"cutproof.judge: {done.stdout}")
    # A plugin has the header, and the process that it lives in.
    data = environment / "share/cutproof/examples/splitter.cpp"
    must([options.cxx, "-std=c++20", "-shared", "-fPIC", data, "-o", "libsplitter.so", "-I", environment / "include"],
         **surroundings)
    done = run([environment / "bin/cutproof", "run", "three_cuts", "--backend", "plugin:./libsplitter.so", "--check"],
               **surroundings)
    expect(done.returncode == 1 and "cluster connectivity" in done.stdout, f"the wheel's tutorial: {done.stdout}")
    must([environment / "bin/pip", "uninstall", "-y", "cutproof"], **surroundings)
    left = {path for path in environment.rglob("*") if path.is_file() and path.suffix != ".pyc"} - before
    expect(not left, f"pip uninstall leaves {left}")


def judge_lying_wheel(top, options):
    """A program that needs more than glibc makes no manylinux."""
    folder = options.work / "lying"
    shutil.copytree(top, folder / top.name, symlinks=True)
    shutil.copy(shutil.which("ninja"), folder / top.name / "bin/cutproof")
    with tarfile.open(folder / f"{top.name}.tar.gz", "w:gz", compresslevel=1) as archive:
        archive.add(folder / top.name, top.name)
    made = must([options.source / "ci/wheel.sh", folder])
    expect("py3-none-linux_" in made, f"a wheel that needs libstdc++ is called {made}")
    shutil.rmtree(folder)
    done = run([options.source / "ci/wheel.sh", options.work / "unpacked"])
    expect(done.returncode == 2 and "0 archives" in done.stdout, f"ci/wheel.sh packs nothing: {done.stdout}")


def judge_examples(archive, options):
    """What the examples for CI systems call, in a project that has the script as its own."""
    texts = {name: (options.source / name).read_text() for name in
             ("action.yml", "docs/examples/gitlab_job.yml", "docs/examples/Jenkinsfile")}
    commands = {"GitHub": re.findall(r"run: (.+judge\.sh.+)", texts["action.yml"]),
                "GitLab": re.findall(r"- (.+judge\.sh .+)", texts["docs/examples/gitlab_job.yml"]),
                "Jenkins": re.findall(r"sh '(.+judge\.sh .+)'", texts["docs/examples/Jenkinsfile"])}
    for system, lines in commands.items():
        expect(len(lines) == 1, f"{system}: its example calls {lines}")
        folder = options.work / system
        (folder / "ci").mkdir(parents=True)
        shutil.copy(options.source / "ci/judge.sh", folder / "ci")
        for arguments, status in (("run small_block --check topology", 0), ("fuzz --backend host --cases 20", 0),
                                  ("run small_block --frames -1", 2)):
            surroundings = {"PATH": "/usr/bin:/bin", "HOME": str(folder), "CUTPROOF_PACKAGE": str(archive),
                            "GITHUB_ACTION_PATH": str(options.source), "PACKAGE": str(archive), "FOLDER": "found",
                            "ARGUMENTS": arguments}
            shutil.rmtree(folder / "found", ignore_errors=True)
            line = lines[0].replace("run three_cuts --check", arguments)
            done = run(["bash", "-e", "-c", line], cwd=folder, env=surroundings)
            expect(done.returncode == status, f"{system}: {line} ended with {done.returncode}: {done.stdout}")
            left = {path.name for path in (folder / "found").iterdir()} - {"program"}
            written = {"results.json", "junit.xml", "page.html"} | ({"cases"} if "fuzz" in arguments else set())
            expect(left == (written if status == 0 else set()),
                   f"{system}: {line} leaves {left}")
    script = options.source / "ci/judge.sh"
    for command, word in (([script, options.work / "none", options.work / "found", "run"], "no package"),
                          ([script, archive, options.work / "found", "info"], "no subcommand"),
                          ([script, script, options.work / "found", "run"], "no whole"), ([script], "usage")):
        done = run(command)
        expect(done.returncode == 2 and word in done.stdout, f"{command} ended with {done.returncode}: {done.stdout}")


def main():
    parser = argparse.ArgumentParser()
    for name in ("source", "work"):
        parser.add_argument(f"--{name}", type=pathlib.Path, required=True)
    for name in ("version", "cmake", "cxx"):
        parser.add_argument(f"--{name}", required=True)
    options = parser.parse_args()
    if "VERSION_CODENAME=bookworm" not in pathlib.Path("/etc/os-release").read_text():
        print("SKIPPED: this is no Debian 12, whose archives the program is linked from")
        return 77
    options.build = options.source / "build/package"
    shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True)
    made = subprocess.run([options.source / "ci/package.sh"], stdout=subprocess.DEVNULL,
                          env={**os.environ, "CUTPROOF_DIST": str(options.work / "dist")})
    if made.returncode != 0:
        sys.exit(f"ci/package.sh ended with {made.returncode}")
    packages = {path.suffix: path for path in (options.work / "dist").iterdir() if path.suffix != ".sha256"}
    expect(set(packages) == {".gz", ".deb", ".whl"}, f"ci/package.sh made {packages}")

    with tarfile.open(packages[".gz"]) as archive:
        archive.extractall(options.work / "unpacked")
    top, = (options.work / "unpacked").iterdir()
    for program in ("bin/cutproof", "libexec/cutproof/cutproof-guest"):
        needs_glibc_alone(top / program, program)
    for licence in ("libcgal-dev", "libhdf5-dev", "libstdc++-12-dev"):
        expect((top / "share/doc/cutproof/licences" / licence).is_file(), f"the licence of {licence} is missing")
    judge(options, top, "archive")
    needed = must(["dpkg-deb", "-f", packages[".deb"], "Depends"]).strip()
    only = re.fullmatch(r"libc6 \(>= (2\.\d+)\)", needed)
    expect(only and tuple(map(int, only.group(1).split("."))) <= OLDEST, f"the .deb depends on {needed}")
    judge_wheel(packages[".whl"], options)
    judge_lying_wheel(top, options)
    judge_examples(packages[".gz"], options)
    shutil.rmtree(options.work)
    if wrong:
        print(f"{len(wrong)} things are wrong")
        return 1
    print("the packages are as they should be")
    return 0


if __name__ == "__main__":
    sys.exit(main())
