#!/usr/bin/env python3
"""Checks that the build and the tests use only packages that ci/install.sh installs, on a Debian 12.

Usage: packages.py BUILD               every file that the build in this folder has read, the programs that it calls, the
                                       Python modules that tests import; and the program cutproof alone, against its own
                                       list of packages
       packages.py BUILD --self-test   whether it finds a file of no package, a package missing in the lists, and a
                                       program that tests must not see
       packages.py --path FOLDER       prints a PATH for tests: FOLDER, with a link to each program of these packages. So a
                                       test that calls another program fails here as it would on a bare machine
These packages: those that ci/install.sh lists for the program and the tests, their dependencies, and those of every
Debian (essential or required packages, and apt). Exit status: 0 nothing is missing, 1 something is, 77 this is no
Debian 12, so packages have other names (--path prints the unchanged PATH).
"""
import argparse
import ast
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

SOURCE = pathlib.Path(__file__).resolve().parent.parent
GROUPS = ("tests", "browser", "docs")
PYTHON = "/usr/bin/python3"
MERGED = {"/bin": "/usr/bin", "/sbin": "/usr/sbin", "/lib": "/usr/lib", "/lib32": "/usr/lib32", "/lib64": "/usr/lib64"}
ALTERNATIVES = "/etc/alternatives/"
TESTS = ("tests", "property_tests", "ci", "docs", "guests/python")  # places that name programs and modules


def output(*command, **more):
    return subprocess.run(command, check=True, capture_output=True, text=True, **more).stdout


def is_debian_12():
    release = pathlib.Path("/etc/os-release")
    return shutil.which("dpkg") and release.exists() and "\nVERSION_CODENAME=bookworm\n" in release.read_text()


def alternatives():
    """By the name of each alternative, master or slave: its possible targets."""
    choices = {}
    for file in pathlib.Path("/var/lib/dpkg/alternatives").glob("*"):
        lines = iter(file.read_text().splitlines()[2:])
        names = [file.name]
        while name := next(lines, ""):
            names.append(name)
            next(lines)  # its link
        while choice := next(lines, ""):
            next(lines)  # the priority
            for name, target in zip(names, [choice, *(next(lines) for _ in names[1:])]):
                choices.setdefault(name, set()).add(target)
    return choices


def steps(path):
    """The symbolic links through which a path leads, then the file itself: all in folders that are none, the merged /usr
    apart."""
    seen, place, rest = [], "/", [part for part in path.split("/") if part]
    while rest:
        part = rest.pop(0)
        if part in (".", ".."):
            place = os.path.dirname(place) if part == ".." else place
            continue
        link = os.path.join(place, part)
        if not os.path.islink(link) or len(seen) > 40:
            place = link
            continue
        target = os.readlink(link)
        if link not in MERGED:
            seen.append(link)
        if target.startswith(ALTERNATIVES):  # each target that it may have decides
            return [*seen, target]
        place = "/" if target.startswith("/") else place
        rest = [name for name in target.split("/") if name] + rest
    return [*seen, place]


class Packages:
    """The installed packages, and those of a bare machine: `listed` and their dependencies."""
    owners = {}  # of each file in a query to dpkg

    def __init__(self, listed):
        fields = ("Package", "Essential", "Priority", "db:Status-Status", "Pre-Depends", "Depends", "Provides")
        self.needs, providers, base = {}, {}, ["apt"]
        for line in output("dpkg-query", "-W", "-f", "\\t".join(f"${{{name}}}" for name in fields) + "\\n").splitlines():
            name, essential, priority, status, before, needed, provided = line.split("\t")
            if status != "installed":
                continue
            self.needs[name] = [[re.split(r"[\s(:]", one.strip())[0] for one in choice.split("|")]
                                for choice in f"{before},{needed}".split(",") if choice.strip()]
            for one in filter(None, provided.split(",")):
                providers.setdefault(one.split()[0], []).append(name)
            if essential == "yes" or priority == "required":
                base.append(name)
        self.closed = set()
        new = [*base, *listed]
        while new:
            name = new.pop()
            if name in self.closed or name not in self.needs:
                continue
            self.closed.add(name)
            for choice in self.needs[name]:  # apt takes the first; of a virtual one, the installed one
                here = (one if one in self.needs else providers.get(one, [None])[0] for one in choice)
                new.append(next(filter(None, here), name))
        self.choices = alternatives()

    def ask(self, paths):
        """Asks dpkg for the owners of these paths and of their targets, all at once."""
        names = set()
        for path in paths:
            for step in steps(path):
                names.add(step)
                if step.startswith(ALTERNATIVES):
                    for choice in self.choices.get(step[len(ALTERNATIVES):], ()):
                        names.update(steps(choice))
        names -= set(self.owners)
        self.owners.update({name: set() for name in names})
        forms = {form: name for name in names for form in
                 (name, *(old + name[len(new):] for old, new in MERGED.items() if name.startswith(new + "/")))}
        every = [re.sub(r"([][*?\\])", r"\\\1", form) for form in forms]
        for begin in range(0, len(every), 4000):
            done = subprocess.run(["dpkg", "-S", *every[begin:begin + 4000]], capture_output=True, text=True,
                                  env={**os.environ, "LC_ALL": "C"})
            for line in done.stdout.splitlines():
                owners, _, form = line.partition(": ")
                if not line.startswith("diversion ") and form in forms:
                    self.owners[forms[form]].update(one.split(":")[0] for one in owners.split(", "))

    def why_not(self, path):
        """The package (or "no package") and the file that a path would miss on a bare machine, or None. After ask()."""
        for step in steps(path):
            if step.startswith(ALTERNATIVES):
                reasons = [self.why_not(choice) for choice in self.choices.get(step[len(ALTERNATIVES):], ())]
                return None if None in reasons or not reasons else reasons[0]
            if os.path.islink(step) and os.readlink(step).startswith(ALTERNATIVES):
                continue
            if not self.owners[step] & self.closed:
                return ", ".join(sorted(self.owners[step])) or "no package", step
        return None


class Build:
    """The files that a Ninja build has read: {path: how}."""

    def __init__(self, folder):
        self.folder = folder.resolve()
        self.cache = dict(re.findall(r"^([^:#\n]+):[A-Z]+=(.*)$", (self.folder / "CMakeCache.txt").read_text(), re.M))

    def ninja(self, *words):
        return output("ninja", "-C", str(self.folder), *words)

    def files(self, target="all"):
        read = {}
        who = ""
        inputs = {line.strip() for line in self.ninja("-t", "inputs", target).splitlines()}
        for line in self.ninja("-t", "deps").splitlines():
            if not line.startswith("    "):
                who = line.partition(":")[0]
            elif who in inputs:
                read.setdefault(line.strip(), f"read to compile {who}")
        for path in inputs:
            read.setdefault(path, "linked, or read by a command of the build")
        if target == "all":
            for line in self.ninja("-t", "query", "build.ninja").splitlines():
                read.setdefault(line.strip().lstrip("| "), "read by CMake")
        for name in ("CMAKE_MAKE_PROGRAM", "CMAKE_COMMAND", "CMAKE_CTEST_COMMAND", "CMAKE_CPACK_COMMAND"):
            read[self.cache[name]] = "called for the build, the tests or a package"
        compiler = self.cache["CMAKE_CXX_COMPILER"]
        for part in ("cc1plus", "collect2", "as", "ld"):
            read[output(compiler, f"-print-prog-name={part}").strip()] = "called by the compiler"
        libraries, folders = set(), set()
        for line in set(self.ninja("-t", "commands", target).splitlines()):
            first = True
            for word in shlex.split(line):
                if first or word.startswith("/"):
                    read.setdefault(shutil.which(word) or word, "called by the build")
                first = word in ("&&", "||", "|", ";")
                libraries.update(re.findall(r"^-l(.+)", word))
                folders.update(re.findall(r"^-L(.+)", word))
        for name in libraries:
            for form in (f"lib{name}.so", f"lib{name}.a"):
                path = next((f"{folder}/{form}" for folder in folders if os.path.exists(f"{folder}/{form}")), None)
                path = path or output(compiler, f"-print-file-name={form}").strip()
                if "/" in path:
                    read[path] = f"linked, as -l{name}"
                    break
        return {path: who for path, who in read.items() if path.startswith("/") and os.path.isfile(path)}

    def left_out(self):
        """Places whose files need no package, by name."""
        source = pathlib.Path(self.cache["CMAKE_HOME_DIRECTORY"])
        rules = [("the source tree", source), ("the build folder", self.folder),
                 ("VTK's headers, as ci/install.sh unpacks them", source / "build/libraries"),
                 ("ccache, which is used where it is installed", pathlib.Path(self.cache["CCACHE"])),
                 # its compiler may be a script elsewhere that calls it
                 ("the CUDA toolkit", pathlib.Path(self.cache.get("CMAKE_CUDA_COMPILER", "/none")))]
        toolkit = pathlib.Path(self.cache.get("CUDAToolkit_BIN_DIR", "/none")).parent
        if toolkit != pathlib.Path("/usr"):
            rules.append(("the CUDA toolkit", toolkit))
        return {str(place): name for name, path in rules for place in {path, path.resolve()}}


def named_in_tests():
    """Programs that tests name by their path, and files of the Python modules that they import."""
    programs, modules = {}, set()
    for top in TESTS:
        for file in (SOURCE / top).rglob("*"):
            if file.suffix not in (".py", ".sh", ".cpp", ".h", ".cmake", ".txt", ".md") or file == pathlib.Path(__file__):
                continue
            text = file.read_text(errors="replace")
            if file.suffix != ".md":
                for path in re.findall(r"(?<![\w}])/(?:usr/)?s?bin/[\w.+-]+", text):
                    programs.setdefault(path, f"named in {file.relative_to(SOURCE)}")
            if file.suffix == ".py":
                for node in ast.walk(ast.parse(text)):
                    modules.update(one.name for one in getattr(node, "names", ()) if isinstance(node, ast.Import))
                    if isinstance(node, ast.ImportFrom) and node.module:
                        modules.add(node.module)
            else:
                modules.update(re.findall(r'^\W*(?:import|from) ([a-z]\w*)', text, re.M))
    importing = """
import importlib, sys
before = set(sys.modules)
for name in sys.argv[1:]:
    try:
        importlib.import_module(name)
    except Exception:
        pass
files = {getattr(sys.modules[name], "__file__", None) or "" for name in set(sys.modules) - before}
files |= {line.split()[-1] for line in open("/proc/self/maps") if "/" in line}
sys.__stdout__.write("\\nFILES\\n" + "\\n".join(files))
"""
    with tempfile.TemporaryDirectory() as empty:
        seen = output(PYTHON, "-B", "-c", importing, *sorted(modules), cwd=empty)
    files = {path: "a Python module that a test imports" for path in seen.partition("\nFILES\n")[2].splitlines()}
    return {path: who for path, who in {**files, **programs}.items() if os.path.isfile(path)}


def check(packages, build, used):
    """Used files that would be missing on a bare machine: {package: [(file, who uses it)]}."""
    left_out = build.left_out()
    asked = {path: who for path, who in used.items()
             if not any(path == place or path.startswith(f"{place}/") for place in left_out)}
    packages.ask(asked)
    missing = {}
    for path, who in sorted(asked.items()):
        if reason := packages.why_not(path):
            missing.setdefault(reason[0], []).append((path, who))
    return missing, len(asked)


def programs(packages):
    """By name, the programs of these packages: {name: path}."""
    found = {}
    for folder in ("/usr/bin", "/usr/sbin", "/usr/games"):
        for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else ():
            found.setdefault(name, f"{folder}/{name}")
    packages.ask(found.values())
    seen = {}
    for name, path in found.items():
        last = steps(path)[-1]
        choices = sorted(packages.choices.get(last[len(ALTERNATIVES):], ())) if last.startswith(ALTERNATIVES) else ()
        for choice in (os.path.realpath(path), *choices) if choices else (path,):
            if packages.why_not(choice) is None:
                seen[name] = choice
                break
    return seen


def listed(*groups):
    return output(str(SOURCE / "ci/install.sh"), "--list", *groups).split()


def self_test(build):
    wrong = []
    used = {**build.files(), **named_in_tests()}
    with tempfile.TemporaryDirectory(dir="/var/tmp") as folder:
        planted = pathlib.Path(folder) / "planted.h"
        planted.touch()
        missing, _ = check(Packages(listed(*GROUPS)), build, {**used, str(planted): "planted"})
        if missing != {"no package": [(str(planted), "planted")]}:
            wrong.append(f"a planted file of no package: {missing}")
        for name, file in (("libgmock-dev", "/usr/include/gmock/gmock.h"), ("python3-h5py", "h5py"), ("esbuild", "esbuild"),
                           ("ninja-build", "ninja"), ("libjs-three", "three.module.js"), ("libsuitesparse-dev", "spqr")):
            missing, _ = check(Packages([one for one in listed(*GROUPS) if one != name]), build, used)
            if not any(name in package and any(file in path for path, _ in files) for package, files in missing.items()):
                wrong.append(f"without {name}: {missing}")
    without = programs(Packages([one for one in listed(*GROUPS) if one not in ("zsh", "openmpi-bin")]))
    seen = programs(Packages(listed(*GROUPS)))
    for name in ("zsh", "mpirun"):
        if name not in seen or name in without:
            wrong.append(f"{name} is seen: {name in seen}, without its package: {name in without}")
    return wrong


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", nargs="?", type=pathlib.Path)
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--path", type=pathlib.Path)
    options = parser.parse_args()
    if not is_debian_12():
        print(os.environ["PATH"] if options.path else "SKIPPED: this is no Debian 12 with dpkg")
        return 0 if options.path else 77
    if options.path:
        shutil.rmtree(options.path, ignore_errors=True)
        options.path.mkdir(parents=True)
        for name, path in programs(Packages(listed(*GROUPS))).items():
            (options.path / name).symlink_to(path)
        print(options.path.resolve())
        return 0
    build = Build(options.build)
    if options.self_test:
        wrong = self_test(build)
        print("\n".join(wrong) or "everything that is missing is found and named")
        return 1 if wrong else 0
    missing, count = check(Packages(listed(*GROUPS)), build, {**build.files(), **named_in_tests()})
    missing.update(check(Packages(listed()), build, build.files("cutproof"))[0])
    for package, files in missing.items():
        print(f"MISSING: {package}: {len(files)} files, e.g.")
        for path, who in files[:5]:
            print(f"  {path} ({who})")
    if missing:
        print("ci/install.sh does not install these packages, so a bare machine does not have these files.\n"
              "  remedy: add the package to its list in ci/install.sh, or do without the file")
        return 1
    print(f"{count} files are used, each of a package that ci/install.sh installs. Left out: "
          + ", ".join(sorted(set(build.left_out().values()))) + ".")
    return 0


if __name__ == "__main__":
    sys.exit(main())
