#!/usr/bin/env bash
# Makes a wheel from the .tar.gz in the same folder: cutproof.py, cutproof_run.py, program, scenes, headers for plugins.
# Its platform is the oldest manylinux that suffices, or linux if it needs more than glibc (PEP 600).
# Usage: ci/wheel.sh [FOLDER]     default: dist
set -euo pipefail
cd "$(dirname "$0")/.."
exec python3 - "${1:-dist}" <<'PYTHON'
import base64
import hashlib
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile

GLIBC = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "ld-linux-x86-64.so.2",
         "ld-linux-aarch64.so.1"}
PYTHON_FILES = ("share/cutproof/python/cutproof.py", "share/cutproof/python/cutproof_run.py")
PROGRAMS = ("bin/cutproof", "libexec/cutproof/cutproof-guest")


def platform(programs, machine):
    versions = []
    for program in programs:
        shown = subprocess.run(["readelf", "--wide", "--dynamic", "--version-info", program], check=True,
                               capture_output=True, text=True).stdout
        needed = set(re.findall(r"\(NEEDED\).*\[(.+)\]", shown))
        if not needed <= GLIBC:
            return f"linux_{machine}"
        versions += [tuple(map(int, version.split("."))) for version in re.findall(r"Name: GLIBC_([\d.]+)", shown)]
    return "manylinux_{}_{}_{}".format(*max(versions)[:2], machine)


def main(folder):
    archives = list(folder.glob("cutproof-*.tar.gz"))
    if len(archives) != 1:
        print(f"ci/wheel.sh: {folder}: There are {len(archives)} archives, and one is to be packed: run ci/package.sh",
              file=sys.stderr)
        sys.exit(2)
    version, machine = re.fullmatch(r"cutproof-([\d.]+)-linux-(\w+)\.tar\.gz", archives[0].name).groups()
    summary = re.search(r'DESCRIPTION_SUMMARY "(.+)"', pathlib.Path("cmake/Package.cmake").read_text()).group(1)
    with tempfile.TemporaryDirectory() as unpacked:
        with tarfile.open(archives[0]) as archive:
            archive.extractall(unpacked)
        top, = pathlib.Path(unpacked).iterdir()
        tag = f"py3-none-{platform([top / name for name in PROGRAMS], machine)}"
        wheel = folder / f"cutproof-{version}-{tag}.whl"
        info, data = f"cutproof-{version}.dist-info", f"cutproof-{version}.data"
        files = []  # names, contents, executable or not
        for path in sorted(top.rglob("*")):
            name = path.relative_to(top).as_posix()
            # Libraries are for CMake; a plugin needs only the plugin headers.
            if not path.is_file() or name.startswith("lib/") or re.match(r"include/cutproof/\w+/", name):
                continue
            place = (path.name if name in PYTHON_FILES else f"{data}/scripts/cutproof" if name == PROGRAMS[0]
                     else f"{data}/data/{name}")
            files.append((place, path.read_bytes(), path.stat().st_mode & 0o100 != 0))
        files.append((f"{info}/METADATA", f"""\
Metadata-Version: 2.1
Name: cutproof
Version: {version}
Summary: {summary}
License: MIT; the program as a binary GPL-3.0-or-later
Requires-Python: >=3.9
Requires-Dist: numpy
Requires-Dist: h5py; extra == "hdf5"
Provides-Extra: hdf5
""".encode(), False))
        files.append((f"{info}/WHEEL", f"Wheel-Version: 1.0\nGenerator: ci/wheel.sh\nRoot-Is-Purelib: false\nTag: {tag}\n"
                      .encode(), False))
    record = "".join(f"{place},sha256={base64.urlsafe_b64encode(hashlib.sha256(contents).digest()).rstrip(b'=').decode()},"
                     f"{len(contents)}\n" for place, contents, _ in files)
    files.append((f"{info}/RECORD", f"{record}{info}/RECORD,,\n".encode(), False))
    # Without times: the same archive gives the same wheel.
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for place, contents, is_run in files:
            entry = zipfile.ZipInfo(place)
            entry.external_attr = (0o100755 if is_run else 0o100644) << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, contents)
    print(wheel)


main(pathlib.Path(sys.argv[1]))
PYTHON
