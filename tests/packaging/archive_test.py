#!/usr/bin/env python3
"""Packs a build with cpack, unpacks the archive and the Debian package, and runs the program of each in an empty folder.

Exit status: 0 all is as it should be, 1 something is not, 77 the Debian package could not be made here (the archive was
tested all the same).
"""
import argparse
import gzip
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile

wrong = []


def expect(holds, what):
    if not holds:
        wrong.append(what)
        print("WRONG:", what)


def run(command, **more):
    return subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **more)


def must(command, **more):
    done = run(command, **more)
    if done.returncode != 0:
        sys.exit(f"{command} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


def pack(options, kind):
    """The one package of this kind, made anew."""
    folder = options.work / kind
    must([options.cpack, "--config", options.build / "CPackConfig.cmake", "-C", options.config, "-G", kind, "-B", folder])
    packages = [path for path in folder.iterdir() if path.name.endswith({"TGZ": ".tar.gz", "DEB": ".deb"}[kind])]
    if len(packages) != 1:
        sys.exit(f"cpack -G {kind} made {packages}")
    return packages[0]


def judge(options, root, name):
    """`root`: where bin, share, … lie."""
    empty = options.work / f"empty_{name}"
    empty.mkdir()
    # Nothing of the build or of this shell may be needed.
    surroundings = {"cwd": empty, "env": {"PATH": "/usr/bin:/bin", "HOME": str(empty)}}
    program = root / "bin/cutproof"
    info = run([program, "info"], **surroundings)
    expect(info.returncode == 0 and "reference" in info.stdout, f"{name}: cutproof info: {info.stdout}")
    version = run([program, "--version"], **surroundings).stdout.strip()
    expect(version == f"cutproof {options.version}", f"{name}: it says that it is '{version}'")
    scenes = root / "share/cutproof/scenes"
    ours = {path.name for path in (options.source / "fixtures/scenes").glob("*.json")}
    theirs = {path.name for path in scenes.glob("*")}
    expect(ours == theirs, f"{name}: scenes that only one side has: {ours ^ theirs}")
    # Where scenes name it: "../scene.schema.json".
    expect((scenes.parent / "scene.schema.json").is_file(), f"{name}: the schema of scenes is missing")
    # As the README says it: the scene by its name, from any folder.
    done = run([program, "run", "small_block", "--check", "topology"], **surroundings)
    expect(done.returncode == 0 and "everything holds." in done.stdout, f"{name}: cutproof run: {done.stdout}")
    expect(not list(empty.iterdir()), f"{name}: the program has written {list(empty.iterdir())}")
    # The tutorial's first steps: its simulator is there, builds against the header that is there, and fails.
    shutil.copy(root / "share/cutproof/examples/splitter.cpp", empty)
    built = run([options.cxx, "-std=c++20", "-shared", "-fPIC", "splitter.cpp", "-o", "libsplitter.so",
                 "-I", root / "include"], **surroundings)
    expect(built.returncode == 0, f"{name}: the tutorial's simulator does not build: {built.stdout}")
    done = run([program, "run", "three_cuts", "--backend", "plugin:./libsplitter.so", "--check"], **surroundings)
    expect(done.returncode == 1 and "cluster connectivity" in done.stdout, f"{name}: the tutorial: {done.stdout}")
    # The page's program in C writes a run with the header that is there.
    page = (options.source / "docs/reference/run.md").read_text()
    (empty / "writes.cpp").write_text(page.split("```c\n")[1].split("```")[0])
    built = run([options.cxx, "writes.cpp", "-o", "writes", "-I", root / "include"], **surroundings)
    expect(built.returncode == 0, f"{name}: the page's writer of runs does not build: {built.stdout}")
    done = run(["./writes"], **surroundings)
    expect(done.returncode == 0, f"{name}: the page's writer of runs: {done.stdout}")
    done = run([program, "check", "run"], **surroundings)
    expect(done.returncode == 0, f"{name}: cutproof check run: {done.stdout}")
    expect((root / "share/cutproof/python/cutproof_run.py").is_file(), f"{name}: the writer in Python is missing")
    # Scripts for clusters find the program that they were installed with.
    found = run([root / "share/cutproof/cluster/fuzz_shard.sh", "--program"], **surroundings)
    expect(found.returncode == 0 and os.path.realpath(found.stdout.strip()) == os.path.realpath(program),
           f"{name}: the scripts for clusters run {found.stdout}")
    page = gzip.decompress((root / "share/man/man1/cutproof.1.gz").read_bytes()).decode()
    expect(page.startswith(".TH CUTPROOF 1") and "cutproof fuzz" in page, f"{name}: the manual page is {page[:200]}")
    for place, words in (("bash-completion/completions/cutproof", "complete -F _cutproof cutproof"),
                         ("zsh/site-functions/_cutproof", "#compdef cutproof\n"),
                         ("zsh/vendor-completions/_cutproof", "#compdef cutproof\n"),
                         ("fish/vendor_completions.d/cutproof.fish", "complete -c cutproof ")):
        offers = (root / "share" / place).read_text()
        expect(words in offers, f"{name}: completion in {place} is {offers[:200]}")
    licence = (root / "share/doc/cutproof/copyright").read_text()
    expect("MIT" in licence and "GPL" in licence, f"{name}: the licence of the sources or of the program is missing")
    # Where it was built is nowhere written down for those who look for files.
    for path in root.rglob("*"):
        if path.suffix in (".cmake", ".json", ".sh", ".h"):
            text = path.read_text(errors="replace")
            for place in (options.source, options.build):
                expect(str(place) not in text, f"{name}: {path} names {place}")
    # A project of somebody else finds every library in it.
    configured = run([options.cmake, "-S", options.source / "tests/packaging/outside", "-B", options.work / f"outside_{name}",
                      f"-DCMAKE_PREFIX_PATH={root}", f"-DCMAKE_CXX_COMPILER={options.cxx}", "-G", "Ninja"])
    expect(configured.returncode == 0, f"{name}: find_package(cutproof): {configured.stdout}")


def main():
    parser = argparse.ArgumentParser()
    for name in ("build", "source", "work"):
        parser.add_argument(f"--{name}", type=pathlib.Path, required=True)
    for name in ("config", "version", "cmake", "cpack", "cxx"):
        parser.add_argument(f"--{name}", required=True)
    options = parser.parse_args()
    shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True)

    with tarfile.open(pack(options, "TGZ")) as archive:
        archive.extractall(options.work / "unpacked")
    tops = list((options.work / "unpacked").iterdir())
    expect(len(tops) == 1, f"the archive does not unpack into one folder: {tops}")
    judge(options, tops[0], "archive")

    tools = [tool for tool in ("dpkg", "dpkg-deb", "dpkg-shlibdeps", "file") if shutil.which(tool) is None]
    if not tools:
        package = pack(options, "DEB")
        must(["dpkg", "-x", package, options.work / "installed"])
        judge(options, options.work / "installed/usr", "package")
        field = lambda name: must(["dpkg-deb", "-f", package, name]).strip()  # noqa: E731
        expect(field("Package") == "cutproof" and field("Version").startswith(options.version), "name and version")
        needed = field("Depends")
        for library in ("libc6", "libstdc++6", "libhdf5", "libfmt", "libcholmod", "libspqr"):
            expect(library in needed, f"the package does not depend on {library}: {needed}")
        for name in ("Section", "Description", "Maintainer", "Architecture", "Suggests"):
            expect(field(name), f"the package has no {name}")
        expect("GPL" in field("Description"), "the package does not say under which licence its program is")
    shutil.rmtree(options.work)
    if wrong:
        print(f"{len(wrong)} things are wrong")
        return 1
    if tools:
        print(f"SKIPPED: the Debian package was not made, because these are missing: {', '.join(tools)}")
        return 77
    print("both packages are as they should be")
    return 0


if __name__ == "__main__":
    sys.exit(main())
