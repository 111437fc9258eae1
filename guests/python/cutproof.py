"""cutproof.py: have your own kernels, or a whole simulator, judged from Python. Copy this file into your project.

SPDX-License-Identifier: MIT

    import cutproof

    def test_my_rotations():
        cutproof.judge(rotations=my_function)       # my_function(a, previous) -> r

`judge` asks your function many hard questions and raises Failed, with the smallest case that it could find, where an
answer is wrong. `kick` judges a simulator by where its particles were with and without a kick of one piece, `relate` by
two of its runs. It needs Linux, numpy and the program `cutproof`: in the environment variable CUTPROOF, beside this file,
or in PATH. What each function gets and returns: docs/reference/python.md.

This process answers questions that the program asks over a socket; arrays lie in memory that both map. The layouts
below repeat guests/wire.h.
"""
import ctypes
import json
import mmap
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import traceback
import unittest

import numpy

__all__ = ["judge", "replay", "kick", "relate", "mapped", "Failed", "Skipped", "Refused", "Error", "Result", "Tissue",
           "Scene", "DeviceArray"]


class Failed(AssertionError):
    """An answer was wrong, or nothing was judged. `document`: what `cutproof --json` writes; None of a replay."""

    def __init__(self, text, document=None):
        super().__init__(text)
        self.document = document


class Skipped(unittest.SkipTest):
    """Nothing could be judged on this machine. Both pytest and unittest take it for a skipped test."""


class Refused(Exception):
    """For your function to raise: it does not take this case. That counts as refused, not as passed."""


class Error(RuntimeError):
    """`cutproof` is not there, was called wrongly, or failed itself: no verdict on your function."""


# --- guests/wire.h ----------------------------------------------------------------------------------------------------

_PROTOCOL = 2
_PAGE = 4096
_ARRAY_BYTES = 16 << 30
_ARENA_BYTES = 2 << 30
_ARENA_COUNT = 24
_MEMORY_BYTES = _ARRAY_BYTES + _ARENA_COUNT * _ARENA_BYTES
_LEAST_GAP = 64 * _PAGE
_CANARY = 0xC5
_DEVICE_CANARY = 4096
_MOST_ARRAYS = 96
_MOST_GROWN = _ARENA_BYTES - 2 * _LEAST_GAP - 2 * _PAGE
_OPERATIONS = {"rotations": 0, "components": 1, "surface": 2, "clusters": 3, "dissect": 6}
_NAMES = {number: name for name, number in _OPERATIONS.items()}
_GIVEN, _ANSWER, _GROWN, _SETUP = range(4)
_ANSWERED, _REFUSED, _BROKE_A_RULE, _DEVICE_FAILED = range(4)
_READY = 0
_TYPES = {1: "int32", 2: "int64", 3: "uint8", 4: "float32", 5: "float64"}


class _Array(ctypes.Structure):
    _fields_ = [("name", ctypes.c_char * 40), ("type", ctypes.c_int32), ("role", ctypes.c_int32),
                ("rows", ctypes.c_int64), ("columns", ctypes.c_int64), ("offset", ctypes.c_int64),
                ("first_page", ctypes.c_int64), ("end_page", ctypes.c_int64), ("arena", ctypes.c_int64)]


class _Request(ctypes.Structure):
    _fields_ = [("operation", ctypes.c_uint32), ("instance", ctypes.c_uint32), ("first", ctypes.c_int32),
                ("last", ctypes.c_int32), ("at_end", ctypes.c_uint32), ("array_count", ctypes.c_uint32),
                ("arrays", _Array * _MOST_ARRAYS)]


class _Reply(ctypes.Structure):
    _fields_ = [("outcome", ctypes.c_int32), ("code", ctypes.c_int32), ("rows", ctypes.c_int64 * _MOST_ARRAYS),
                ("offset", ctypes.c_int64 * _MOST_ARRAYS), ("text", ctypes.c_char * 512)]


class _Hello(ctypes.Structure):
    _fields_ = [("protocol", ctypes.c_uint32), ("greeting", ctypes.c_int32), ("memory", ctypes.c_uint64),
                ("operations", ctypes.c_uint32), ("spans", ctypes.c_uint32), ("device", ctypes.c_int32),
                ("real", ctypes.c_int32), ("has_promises", ctypes.c_int32), ("remembers_faults", ctypes.c_int32),
                ("request_bytes", ctypes.c_uint32), ("reply_bytes", ctypes.c_uint32), ("name", ctypes.c_char * 64),
                ("version", ctypes.c_char * 64), ("promises", ctypes.c_char * 512),
                ("limits", ctypes.c_char * 512), ("text", ctypes.c_char * 512)]


def _place_in_arena(arena, size, at_end):
    """Of so many bytes: their offset, and the pages that hold them."""
    begin = _ARRAY_BYTES + arena * _ARENA_BYTES + _LEAST_GAP
    end = begin + _ARENA_BYTES - 2 * _LEAST_GAP
    if at_end:
        return end - size, (end - size) // _PAGE * _PAGE, end
    return begin, begin, (begin + size + _PAGE - 1) // _PAGE * _PAGE


# --- What functions get and return ------------------------------------------------------------------------------------


class Tissue:
    """A body at rest: n particles, of which some may be dead. Arrays are read-only; with device="cuda" they lie there.

    edge_offsets  int64 (n + 1)  the neighbours of particle i are edge_ends[edge_offsets[i]:edge_offsets[i + 1]]
    edge_ends     int32          each edge at both of its ends
    rest          real (n, 3)    m
    mass          real (n)       kg
    node          int32 (n, 3)   node x, y, z of the grid; None where there is no grid
    nodes         (x, y, z)      of the grid by axis, with an empty ring around the tissue; None where there is no grid
    spacing       float          of the grid, else the longest edge; m
    """
    __slots__ = ("edge_offsets", "edge_ends", "rest", "mass", "node", "nodes", "spacing")


class Scene:
    """What a whole simulator is asked: a body at rest, n particles, and what becomes of it. Arrays are read-only.

    rest, velocities  real (n, 3)           at the start: m, m/s
    mass              real (n)              kg
    held              bool (n)              it stays where it is
    nodes             int32 (n, 3)          of the grid
    edges             int32 (e, 2)          tissue: pairs of particles that belong together
    tetrahedra        int32 (c, 4)          of the grid, hexahedra int32 (k, 8) in VTK's order of corners
    spacing           float                 of the grid; m
    gravity           (x, y, z)             m/s^2
    frames            int                   that are wanted, of which the first is the start
    frame_time        float                 s
    blade             real (frames, q, 4, 3)  the quads that q strokes sweep on the way to each frame, where they lie at
                                            its end; NaN: none
    kick              real (n, 3)           m/s, added to velocities as the way to the frame kick_frame begins
    kick_frame        int                   -1: nothing is kicked
    """
    __slots__ = ("rest", "velocities", "mass", "held", "nodes", "edges", "tetrahedra", "hexahedra", "spacing",
                 "gravity", "frames", "frame_time", "blade", "kick", "kick_frame")


class _Broken(Exception):
    """A rule that an answer breaks; the text says which."""


class _Gone(Exception):
    """The program has ended: nobody waits for an answer."""


class _DeviceFailed(Exception):
    pass


class _OutOfTime(BaseException):
    """Raised inside a function that has not answered in time, so that it ends and its traceback says where it was."""


def _on_host(value, name, device):
    """An array of numpy; of one that lies on the device a copy."""
    interface = getattr(value, "__cuda_array_interface__", None)
    if interface is not None:
        if device is None:
            raise _Broken(f'{name} lies on a CUDA device; ask with device="cuda"')
        return device.fetch(interface, name)
    try:
        return numpy.asarray(value)
    except (TypeError, ValueError) as error:
        raise _Broken(f"{name} cannot become an array: {error}") from error


def _as_array(value, name, wanted, shape, device):
    """What a function returned as an array of this type and shape, of which None may be any number."""
    if value is None:
        raise _Broken(f"it returned no {name}")
    array = _on_host(value, name, device)
    wanted = numpy.dtype(wanted)
    if array.size == 0 and not shape[0]:  # what is empty holds nothing of a wrong type
        return numpy.zeros([extent or 0 for extent in shape], wanted)
    # Rounding to the precision that is asked for is fine; what has been lost before is not.
    fits = array.dtype.kind == "f" and array.dtype.itemsize >= wanted.itemsize if wanted.kind == "f" else \
        array.dtype.kind in "iu"
    if not fits:
        raise _Broken(f"{name} is {array.dtype}, {wanted} is wanted")
    if array.ndim != len(shape) or any(want not in (None, has) for has, want in zip(array.shape, shape)):
        words = ", ".join("any" if extent is None else str(extent) for extent in shape)
        raise _Broken(f"{name} has the shape {array.shape}, ({words}{',' if len(shape) == 1 else ''}) is wanted")
    if wanted.kind == "i" and array.size > 0:
        for extreme in (int(array.min()), int(array.max())):
            if not numpy.iinfo(wanted).min <= extreme <= numpy.iinfo(wanted).max:
                raise _Broken(f"{name} holds {extreme}, which {wanted} cannot")
    with numpy.errstate(all="ignore"):
        return array.astype(wanted, copy=False)


def _two(value, names):
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        what = f"{len(value)} values" if isinstance(value, (tuple, list)) else type(value).__name__
        raise _Broken(f"it returned {what}, ({names}) is wanted")
    return value


def _clusters_of(value):
    """(offsets, members), or a list with the members of each cluster."""
    if isinstance(value, tuple):
        return _two(value, "offsets, members")
    if not isinstance(value, list):
        raise _Broken(f"it returned {type(value).__name__}; (offsets, members) or a list of lists is wanted")
    members = [_as_array(cluster, f"cluster {k}", numpy.int32, (None,), None) for k, cluster in enumerate(value)]
    offsets = numpy.cumsum([0] + [len(cluster) for cluster in members])
    return offsets, numpy.concatenate(members) if members else []


# Of a frame: shapes, in which n is the number of its particles. The others are cells and groups.
_OF_FRAME = {"positions": ("position", "n3"), "velocities": ("velocity", "n3"), "spin": ("spin", "n3"),
             "mass": ("mass", "n"), "alive": ("alive", "n"), "parent": ("parent", "n"),
             "contact_impulse": ("contact_impulse", "3"), "energy": ("energy", ""), "steps": ("steps", ""),
             "damping": ("damping", ""), "seconds": ("seconds", "")}
_IGNORED = {"time", "blade", "removed"}  # what cutproof_run.Writer.frame takes too; `removed` says who is not alive
_WHOLE = {"parent": numpy.int32, "alive": numpy.uint8, "steps": numpy.int64}


def _run_of(frames, wanted, real, device):
    """Outputs by name, from what a simulator yields: a dict for each frame, as cutproof_run.Writer.frame takes it."""
    if len(frames) != wanted:
        raise _Broken(f"it gave {len(frames)} frames, {wanted} are wanted")
    made = {name: [] for name in _OF_FRAME}
    counts, groups, cells = [], [], []
    for f, frame in enumerate(frames):
        if not isinstance(frame, dict) or "positions" not in frame:
            raise _Broken(f"frame {f} is no dict that holds positions")
        strange = set(frame) - set(_OF_FRAME) - _IGNORED - {"groups", "cells"}
        if strange:
            raise _Broken(f"frame {f} holds {min(strange)}, which is not known")
        frame = dict(frame, positions=_on_host(frame["positions"], f"positions of frame {f}", device))
        n = len(frame["positions"]) if frame["positions"].ndim else 0
        counts.append(n)
        if "removed" in frame and "alive" not in frame:
            frame = dict(frame, alive=~_on_host(frame["removed"], f"removed of frame {f}", device).astype(bool))
        for name, (_, shape) in _OF_FRAME.items():
            if frame.get(name) is None:
                continue
            value = _on_host(frame[name], f"{name} of frame {f}", device)
            if name == "alive":
                value = value.astype(bool).view(numpy.uint8)
            elif name not in _WHOLE and value.dtype.kind != "f":  # whole numbers are places, too
                value = value.astype(float)
            made[name].append(_as_array(value, f"{name} of frame {f}", _WHOLE.get(name, real),
                                        tuple(n if c == "n" else int(c) for c in shape), device))
        groups.append(_groups_of(frame.get("groups"), f, real, device))
        cells.append(None if frame.get("cells") is None else
                     _as_array(frame["cells"], f"cells of frame {f}", numpy.int32, (None, None), device))
    run = {}
    for name, (output, shape) in _OF_FRAME.items():
        given, least = len(made[name]), {"steps": 1, "damping": 1}.get(name, wanted)
        if given not in (0, least, wanted):
            raise _Broken(f"{name} is in {given} of {wanted} frames")
        parts = made[name][:least]
        parts = parts if shape.startswith("n") else [part[None] for part in parts]
        empty = numpy.zeros((0, 3) if shape.endswith("3") else 0, _WHOLE.get(name, real))
        run["run/" + output] = numpy.concatenate(parts) if parts else empty
    run["run/particles"] = numpy.array(counts, numpy.int32)
    return run | _packed_groups(groups, real) | _packed_cells(cells)


def _groups_of(groups, f, real, device):
    """Offsets, members and weights, from a tuple (offsets, members, weights or none), a list of lists, or an array with
    a group in each row."""
    if groups is None:
        return None
    name = f"groups of frame {f}"
    if isinstance(groups, tuple) and len(groups) in (2, 3):
        return [None if part is None else _as_array(part, f"{what} of {name}", kind, (None,), device)
                for part, what, kind in zip((*groups, None), ("offsets", "members", "weights"),
                                            (numpy.int64, numpy.int32, real))]
    if hasattr(groups, "__cuda_array_interface__"):
        groups = _on_host(groups, name, device)
    members = numpy.concatenate([_on_host(group, name, device) for group in groups] or [numpy.zeros(0, int)])
    offsets = numpy.cumsum([0] + [len(group) for group in groups])
    return [offsets, _as_array(members, name, numpy.int32, (None,), device), None]


def _packed_groups(groups, real):
    given = [group for group in groups if group is not None]
    weighted = [group[2] for group in given if group[2] is not None]
    if weighted and len(weighted) != len(given):
        raise _Broken("groups have weights in some frames and none in others")
    offsets, total = [0], 0
    for ends, members, _ in given:
        if len(ends) == 0 or ends[0] != 0 or ends[-1] != len(members):
            raise _Broken(f"offsets of groups do not go from 0 to {len(members)}")
        offsets += [total + int(end) for end in ends[1:]]
        total += len(members)
    counts = [-1 if group is None else len(group[0]) - 1 for group in groups]
    return {"run/group_count": numpy.array(counts if given else [], numpy.int32),
            "run/offsets": numpy.array(offsets if given else [], numpy.int64),
            "run/members": numpy.concatenate([group[1] for group in given] or [numpy.zeros(0, numpy.int32)]),
            "run/weights": numpy.concatenate(weighted or [numpy.zeros(0, real)])}


def _packed_cells(cells):
    given = [cell for cell in cells if cell is not None]
    corners = {cell.shape[1] for cell in given}
    if not corners <= {4} and not corners <= {8}:
        raise _Broken(f"cells have {' and '.join(map(str, sorted(corners)))} corners, 4 or 8 are wanted")
    counts = [-1 if cell is None else len(cell) for cell in cells]
    packed = {"run/cell_count": numpy.array(counts if given else [], numpy.int32)}
    for name, count in (("run/tetrahedra", 4), ("run/hexahedra", 8)):
        packed[name] = numpy.concatenate(given) if corners == {count} else numpy.zeros((0, count), numpy.int32)
    return packed


# --- CUDA -------------------------------------------------------------------------------------------------------------

_U64, _SIZE = ctypes.c_uint64, ctypes.c_size_t
_DRIVER = {  # of cuda.h
    "cuInit": [ctypes.c_uint],
    "cuDeviceGet": [ctypes.POINTER(ctypes.c_int), ctypes.c_int],
    "cuDevicePrimaryCtxRetain": [ctypes.POINTER(ctypes.c_void_p), ctypes.c_int],
    "cuCtxSetCurrent": [ctypes.c_void_p],
    "cuCtxSynchronize": [],
    "cuMemAlloc_v2": [ctypes.POINTER(_U64), _SIZE],
    "cuMemFree_v2": [_U64],
    "cuMemcpyHtoD_v2": [_U64, ctypes.c_void_p, _SIZE],
    "cuMemcpyDtoH_v2": [ctypes.c_void_p, _U64, _SIZE],
    "cuMemsetD8_v2": [_U64, ctypes.c_ubyte, _SIZE],
}


class _Device:
    """The primary context of device 0, which CuPy, Numba, Warp and PyTorch share, through the driver alone."""

    def __init__(self):
        try:
            self.driver = ctypes.CDLL("libcuda.so.1")
        except OSError:
            raise Skipped("cutproof: there is no CUDA driver here") from None
        number, context = ctypes.c_int(), ctypes.c_void_p()
        try:
            for name, types in _DRIVER.items():
                getattr(self.driver, name).argtypes = types
            self.call("cuInit", 0)
            self.call("cuDeviceGet", ctypes.byref(number), 0)
            self.call("cuDevicePrimaryCtxRetain", ctypes.byref(context), number)
        except (AttributeError, _DeviceFailed) as error:
            raise Skipped(f"cutproof: there is no CUDA device here: {error}") from None
        self.context = context

    def call(self, name, *arguments):
        result = getattr(self.driver, name)(*arguments)
        if result != 0:
            text = ctypes.c_char_p()
            self.driver.cuGetErrorName(result, ctypes.byref(text))
            raise _DeviceFailed(f"{name}: {(text.value or b'error %d' % result).decode()}")

    def use(self):
        self.call("cuCtxSetCurrent", self.context)

    def synchronize(self):
        self.use()  # libraries may have made another context current
        self.call("cuCtxSynchronize")

    def fetch(self, interface, name):
        """A copy on the host of an array with any strides."""
        shape, kind = tuple(interface["shape"]), numpy.dtype(interface["typestr"])
        if interface.get("mask") is not None:
            raise _Broken(f"{name} has a mask")
        array = numpy.empty(shape, kind)
        if array.size == 0:
            return array
        strides = interface.get("strides") or array.strides
        steps = [(extent - 1) * stride for extent, stride in zip(shape, strides)]
        low, high = sum(min(step, 0) for step in steps), sum(max(step, 0) for step in steps)
        size = high - low + kind.itemsize
        held = ctypes.create_string_buffer(size)
        try:
            self.call("cuMemcpyDtoH_v2", held, interface["data"][0] + low, size)
        except _DeviceFailed as error:
            raise _Broken(f"{name} cannot be copied from the device: {error}") from None
        return numpy.ndarray(shape, kind, buffer=held, offset=-low, strides=strides)


class DeviceArray:
    """An input on the device, with __cuda_array_interface__: cupy.asarray(it), torch.as_tensor(it, device="cuda"),
    numba.cuda.as_cuda_array(it) and warp.array(it, copy=False) copy nothing. It is freed when nobody refers to it.

    The interface does not say that it is read-only, because PyTorch takes no arrays that do; whether somebody wrote to
    it, or beside it, is looked at afterwards."""

    def __init__(self, device, array, name):
        self._device, self._name, self._held = device, name, array.tobytes()
        self._memory = None
        memory, size = _U64(), len(self._held) + 2 * _DEVICE_CANARY
        device.call("cuMemAlloc_v2", ctypes.byref(memory), size)
        self._memory = memory.value
        device.call("cuMemsetD8_v2", self._memory, _CANARY, size)
        if self._held:
            device.call("cuMemcpyHtoD_v2", self._memory + _DEVICE_CANARY, self._held, len(self._held))
        self.shape, self.dtype = array.shape, array.dtype
        self.__cuda_array_interface__ = {"version": 3, "shape": array.shape, "typestr": array.dtype.str,
                                         "strides": None, "data": (self._memory + _DEVICE_CANARY, False),
                                         "stream": None}

    def __len__(self):
        return self.shape[0]

    def check(self):
        """Raises _Broken if somebody wrote to it, or beside it."""
        size = len(self._held)
        found = ctypes.create_string_buffer(size + 2 * _DEVICE_CANARY)
        self._device.call("cuMemcpyDtoH_v2", found, self._memory, len(found))
        found, whole = found.raw, bytes([_CANARY]) * _DEVICE_CANARY
        before, behind = found[:_DEVICE_CANARY], found[_DEVICE_CANARY + size:]
        if before != whole:
            far = next(k for k in range(1, _DEVICE_CANARY + 1) if before[-k] != _CANARY)
            raise _Broken(f"it wrote to byte {far} before the beginning of '{self._name}'")
        if behind != whole:
            far = next(k for k in range(_DEVICE_CANARY) if behind[k] != _CANARY)
            raise _Broken(f"it wrote to byte {far + 1} behind the end of '{self._name}', which has {len(self)} rows")
        if found[_DEVICE_CANARY:_DEVICE_CANARY + size] != self._held:
            raise _Broken(f"it wrote to '{self._name}', which is an input")

    def __del__(self):
        if self._memory is not None:
            self._device.driver.cuCtxSetCurrent(self._device.context)
            self._device.driver.cuMemFree_v2(self._memory)


# --- The guest --------------------------------------------------------------------------------------------------------


class _Guest:
    """This process as the program's guest: greets it, and answers its questions until it ends."""

    def __init__(self, functions, precision, device, promises, name, limits=None):
        for operation, function in functions.items():
            if not callable(function):
                raise TypeError(f"{operation} is {type(function).__name__}, a function is wanted")
        if not functions:
            raise TypeError(f"give a function for some of {', '.join(_OPERATIONS)}")
        if precision not in ("single", "double"):
            raise ValueError(f"precision is {precision!r}; \"single\" or \"double\" is wanted")
        if device not in ("host", "cuda"):
            raise ValueError(f"device is {device!r}; \"host\" or \"cuda\" is wanted")
        self.functions = functions
        self.device = _Device() if device == "cuda" else None
        self.real = numpy.float32 if precision == "single" else numpy.float64
        self.hello = _Hello(protocol=_PROTOCOL, greeting=_READY, device=self.device is not None,
                            real=4 if precision == "single" else 5, has_promises=promises is not None,
                            request_bytes=ctypes.sizeof(_Request), reply_bytes=ctypes.sizeof(_Reply),
                            operations=sum(1 << _OPERATIONS[operation] for operation in functions))
        self.hello.name = _cut(name or ", ".join(_name_of(function) for function in functions.values()), 63)
        for what, words in (("promises", promises), ("limits", limits)):
            if words is not None and len(words.encode()) > 511:
                raise ValueError(f"{what} is too long")
        self.hello.promises, self.hello.limits = (promises or "").encode(), (limits or "").encode()
        self.tracebacks = {}  # by the text of the fault
        self.lock = threading.Lock()
        self.thread = None  # in which a function is at work
        self.program_ended = self.interrupted = False

    def run(self, words, verbose):
        """Exit status, standard output and errors of `cutproof judge` with these words."""
        program = _find_program()
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        file = os.memfd_create("cutproof arrays")
        with ours, theirs, tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
            try:
                os.ftruncate(file, _MEMORY_BYTES)
                # Nothing is reserved: only pages that are touched cost memory.
                self.memory = mmap.mmap(file, _MEMORY_BYTES, mmap.MAP_SHARED | getattr(mmap, "MAP_NORESERVE", 0x4000))
                ours.send(self.hello)
                child = subprocess.Popen([program, "judge", f"--attached={theirs.fileno()},{file}", *words],
                                         pass_fds=(theirs.fileno(), file), stdin=subprocess.DEVNULL,
                                         stdout=None if verbose else output, stderr=errors)
            except OSError as error:
                raise Error(f"cutproof cannot be started: {error}") from error
            finally:
                os.close(file)
            watcher = threading.Thread(target=self._watch, args=(child,), daemon=True)
            watcher.start()
            try:
                theirs.close()
                self._serve(ours)
                ours.close()
                watcher.join()
            except _OutOfTime:
                watcher.join()
            finally:
                # Whatever happened, KeyboardInterrupt included: no child is left behind.
                if watcher.is_alive():
                    child.terminate()
                    watcher.join(5)
                    if watcher.is_alive():
                        child.kill()
                        watcher.join()
            texts = []
            for stream in (output, errors):
                stream.seek(0)
                texts.append(stream.read().decode(errors="replace").strip())
            return child.returncode, texts[0], texts[1]

    def _watch(self, child):
        child.wait()
        with self.lock:
            self.program_ended = True
            if self.thread is not None:
                # It waits for no answer any more: a function that never ends would keep us here for ever.
                self.interrupted = True
                ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self.thread), ctypes.py_object(_OutOfTime))

    def _call(self, function, arguments):
        with self.lock:
            if self.program_ended:
                raise _Gone
            self.thread = threading.get_ident()
        try:
            return function(*arguments)
        except _OutOfTime as error:
            self.tracebacks["out of time"] = _traceback_of(error)
            raise
        finally:
            with self.lock:
                if self.interrupted:  # and not raised yet
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self.thread), None)
                self.thread = None

    def _serve(self, channel):
        request, reply = _Request(), _Reply()
        while True:
            try:
                received = channel.recv_into(request)
                if received == 0:
                    return
                if received != ctypes.sizeof(request):
                    raise Error("cutproof is of another version than cutproof.py: install both again")
                ctypes.memset(ctypes.byref(reply), 0, ctypes.sizeof(reply))
                self._answer(request, reply)
                channel.send(reply)
            except (ConnectionError, _Gone):
                return

    def _answer(self, request, reply):
        arrays = request.arrays[:request.array_count]
        for k, array in enumerate(arrays):
            reply.rows[k], reply.offset[k] = array.rows, array.offset
        try:
            outputs = self._ask(_NAMES[request.operation], arrays)
            for k, array in enumerate(arrays):
                if array.role in (_ANSWER, _GROWN):
                    reply.rows[k], reply.offset[k] = self._write(array, outputs[array.name.decode()], request.at_end)
            reply.outcome = _ANSWERED
        except Refused:
            reply.outcome, reply.code = _REFUSED, 1
        except _Broken as error:
            reply.outcome, reply.text = _BROKE_A_RULE, _cut(str(error), 511)
        except _DeviceFailed as error:
            reply.outcome, reply.text = _DEVICE_FAILED, _cut(f"the CUDA device failed: {error}", 511)
        except _Gone:
            raise
        except Exception as error:  # of the function, whatever it is: a fault of this case
            reply.outcome, reply.text = _BROKE_A_RULE, _cut(f"it raised {type(error).__name__}: {error}", 511)
            self.tracebacks.setdefault(reply.text.decode(), _traceback_of(error))

    def _view(self, array):
        shape = (array.rows,) if array.columns == 1 else (array.rows, array.columns)
        return numpy.ndarray(shape, _TYPES[array.type], buffer=self.memory, offset=array.offset)

    def _ask(self, operation, arrays):
        """The operation's outputs by name, as arrays of the right type and shape."""
        given, on_device = {}, []
        if self.device is not None:
            self.device.use()
        for array in arrays:
            name = array.name.decode()
            if array.role not in (_GIVEN, _SETUP):
                continue
            view = self._view(array)
            if name in ("alive", "held"):
                view = view.view(bool)  # so that it is a mask, not a list of indices
            if operation == "rotations":
                view = view.reshape(-1, 3, 3)
            view.flags.writeable = False
            given[name] = view
            if self.device is not None and array.role == _GIVEN:
                given[name] = DeviceArray(self.device, view, name)
                on_device.append(given[name])
        if operation == "rotations":
            count, arguments = len(given["a"]), (given["a"], given["previous"])
        elif operation == "dissect":
            asked = self._scene_of(given, arrays)
            arguments = (asked,)
        else:
            tissue = Tissue()
            for name in ("edge_offsets", "edge_ends", "rest", "mass", "node"):
                setattr(tissue, name, given.get(name))
            tissue.nodes = tuple(int(k) for k in given["nodes"]) if "nodes" in given else None
            tissue.spacing = float(given["spacing"][0])
            count, arguments = len(given["alive"]), (tissue, given["alive"])
        if operation == "clusters":
            arguments = arguments[:1]
        if self.device is not None:
            self.device.synchronize()  # copies are there before work on any stream begins
        try:
            function = self.functions[operation]
            # Of a generator the frames are made here, where it can be interrupted.
            value = self._call(function if operation != "dissect" else lambda scene: list(function(scene)), arguments)
        finally:
            if self.device is not None:
                self.device.synchronize()
        for array in on_device:
            array.check()
        if operation == "dissect":
            return _run_of(value, asked.frames, self.real, self.device)
        if operation == "rotations":
            wanted = {"r": (value, self.real, (count, 3, 3))}
        elif operation == "components":
            wanted = {"label": (value, numpy.int32, (count,))}
        elif operation == "surface":
            vertices, triangles = _two(value, "vertices, triangles")
            wanted = {"vertices": (vertices, self.real, (None, 3)), "triangles": (triangles, numpy.int32, (None, 3))}
        else:
            offsets, members = _clusters_of(value)
            wanted = {"offsets": (offsets, numpy.int64, (None,)), "members": (members, numpy.int32, (None,))}
        return {name: _as_array(value, name, kind, shape, self.device) for name, (value, kind, shape) in wanted.items()}

    def _scene_of(self, given, arrays):
        host = {array.name.decode(): self._view(array) for array in arrays}
        scene = Scene()
        for name, of in (("rest", "rest"), ("velocities", "velocity"), ("mass", "mass"), ("held", "held"),
                         ("nodes", "node"), ("tetrahedra", "tetrahedra"), ("hexahedra", "hexahedra"), ("kick", "kick")):
            setattr(scene, name, given[of])
        first = numpy.repeat(numpy.arange(len(host["mass"]), dtype=numpy.int32), numpy.diff(host["edge_offsets"]))
        edges = numpy.stack([first, host["edge_ends"]], 1)
        edges = edges[edges[:, 0] < edges[:, 1]]
        scene.spacing, scene.frame_time = float(host["spacing"][0]), float(host["frame_time"][0])
        scene.gravity = host["gravity"].copy()
        scene.kick_frame = int(host["kick_frame"][0])
        blade = host["blade"].reshape(-1, int(host["blades"][0]), 4, 3)
        scene.frames = len(blade)
        blade.flags.writeable = False
        scene.edges, scene.blade = edges, blade
        if self.device is not None:
            scene.edges, scene.blade = (DeviceArray(self.device, array, name)
                                        for array, name in ((edges, "edges"), (blade, "blade")))
        return scene

    def _write(self, array, values, at_end):
        """Its rows and offset in memory."""
        if array.role == _GROWN:
            if values.nbytes > _MOST_GROWN:
                raise _Broken(f"{array.name.decode()} has {values.nbytes} bytes; possible are {_MOST_GROWN}")
            array.rows = len(values)
            array.offset, first, end = _place_in_arena(array.arena, values.nbytes, at_end)
            self.memory[first:array.offset] = bytes([_CANARY]) * (array.offset - first)
            behind = array.offset + values.nbytes
            self.memory[behind:end] = bytes([_CANARY]) * (end - behind)
        self._view(array)[...] = values.reshape(len(values), array.columns) if array.columns > 1 else values
        return array.rows, array.offset


def _name_of(function):
    return getattr(function, "__qualname__", type(function).__name__).replace("<locals>.", "")


def _cut(text, most):
    """At most so many bytes, in one line."""
    return " ".join(text.split()).replace("\0", "").encode()[:most].decode(errors="ignore").encode()


def _traceback_of(error):
    """Without the frames of this file."""
    trace = error.__traceback__
    while trace is not None and trace.tb_frame.f_code.co_filename == __file__:
        trace = trace.tb_next
    return "".join(traceback.format_exception(type(error), error, trace or error.__traceback__)).rstrip()


def _find_program():
    named = os.environ.get("CUTPROOF")
    if named:
        found = shutil.which(named)
        if found is None:
            raise Error(f"the environment variable CUTPROOF names '{named}', and there is no such program")
        return found
    here = os.path.dirname(os.path.abspath(__file__))
    for place in (os.path.join(here, "cutproof"), os.path.join(here, "..", "..", "..", "bin", "cutproof")):
        if os.path.isfile(place) and os.access(place, os.X_OK):
            return place
    found = shutil.which("cutproof")
    if found is None:
        raise Error("the program cutproof is not in PATH, nor beside cutproof.py; "
                    "the environment variable CUTPROOF can name it")
    return found


# --- Judging ----------------------------------------------------------------------------------------------------------


class Result:
    """Everything holds. `operations`: of judge, by name, with the fields of docs/reference/schemas/judge.json;
    `document`: the whole; `text`: what the program printed."""

    def __init__(self, text, document=None):
        self.text, self.document = text, document
        self.operations = {each["operation"]: each for each in (document or {}).get("operations", ())}

    def __repr__(self):
        counts = ", ".join(f"{name}: {each['cases']} {each['of']}" for name, each in self.operations.items())
        return f"<cutproof.Result: all hold{counts and f' ({counts})'}>"


def judge(*, rotations=None, components=None, surface=None, clusters=None, dissect=None, cases=None, sizes=None,
          seconds=None, seed=1, precision="single", device="host", promises=None, limits=None, name=None, time_limit=60,
          shrink=20, save=".", keep_going=False, verbose=False):
    """Asks the functions that are given, each in many cases. Returns a Result; raises Failed, Skipped or Error.

    cases, seconds: how many matrices, bodies or scenes for each function, or for how long. sizes: of large questions, as
    matrices or particles; (): none; None: beside 65536 and more. promises: words of what is judged; None: the default
    promises. limits: words of what `dissect` takes; None: all. time_limit: seconds for each answer. shrink:
    seconds for shrinking each failing case. save: folder for failing cases. keep_going: beyond ten questions that
    were not answered.
    """
    __tracebackhide__ = True  # pytest shows the caller, not us
    functions = _given(rotations=rotations, components=components, surface=surface, clusters=clusters, dissect=dissect)
    guest = _Guest(functions, precision, device, promises, name, limits)
    words = list(functions) + [f"--seed={seed}", f"--time-limit={time_limit}", f"--shrink={shrink}",
                               f"--save={os.fspath(save)}"]
    words += [f"--cases={cases}"] if cases is not None else []
    words += [f"--sizes={','.join(map(str, sizes)) or 0}"] if sizes is not None else []
    words += [f"--seconds={seconds}"] if seconds is not None else []
    words += ["--keep-going"] if keep_going else []
    with tempfile.TemporaryDirectory(prefix="cutproof") as folder:
        path = os.path.join(folder, "result.json")
        status, output, errors = guest.run(words + [f"--json={path}"], verbose)
        document = None
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                document = json.load(file)
    _raise_unless_judged(status, errors)
    if document is None:
        raise Error(errors or "the program has judged nothing: is it cutproof?")
    if status != 0:
        raise Failed(_describe(guest, document, seed, precision), document)
    return Result(output, document)


def replay(file, *, rotations=None, components=None, surface=None, clusters=None, dissect=None, precision=None,
           device="host", promises=None, name=None, time_limit=60, verbose=False):
    """Asks one saved question again, in the precision in which it failed. Returns, and raises, as judge does."""
    __tracebackhide__ = True
    functions = _given(rotations=rotations, components=components, surface=surface, clusters=clusters, dissect=dissect)
    if precision is None:
        try:
            with open(file, encoding="utf-8") as opened:
                precision = json.load(opened)["precision"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise Error(f"{os.fspath(file)}: it is no question that was saved: {error!r}") from error
    guest = _Guest(functions, precision, device, promises, name)
    status, output, errors = guest.run([f"--case={os.fspath(file)}", f"--time-limit={time_limit}"], verbose)
    _raise_unless_judged(status, errors)
    if status != 0:
        raise Failed("\n".join([output, *guest.tracebacks.values()]))
    return Result(output)


def kick(positions, kicked, piece, **arrays):
    """Whether a kick of one piece moves another. Returns, and raises, as judge does.

    positions (f, n, 3): where particles were, frame by frame, in m. kicked (f, n, 3): the same with a kick of one
    piece; or a list of such runs. piece (n): which particles belong together. arrays: again, alive, kicked_piece, directions,
    equal, tolerance, mass, steps, spacing, time: docs/reference/state.md, A kick.
    """
    __tracebackhide__ = True
    return _judge_arrays(["kick", "kick.npz"], kick=dict(arrays, positions=positions, kicked=kicked, piece=piece))


def relate(first, *others, map="same", noise=(), bits=False):
    """Whether runs of one simulator correspond as their inputs do. Returns, and raises, as judge does.

    first, others, noise: runs, each a dict of the arrays of docs/reference/run.md, or the path of a file. map, noise,
    bits: docs/reference/relate.md.
    """
    __tracebackhide__ = True
    runs, files, words = (first, *others, *noise), {}, []
    for k, run in enumerate(runs):
        if isinstance(run, dict):
            files[f"run{k}"] = run
        words.append(f"run{k}.npz" if isinstance(run, dict) else os.path.abspath(run))
    count = 1 + len(others)
    return _judge_arrays(["relate", *words[:count], "--map", map, *(["--noise", *words[count:]] if noise else []),
                          *(["--bits"] if bits else [])], **files)


def mapped(map, arrays, **dimensions):
    """The input that corresponds to this one, a dict of arrays, by a map of docs/reference/relate.md.

    dimensions: of arrays that docs/reference/run.md does not name, the powers of length, time and mass: (-1, -2, 1), or
    with how a vector follows: (1, -1, 0, "velocity").
    """
    words = ["relate", "--make", map, "given.npz", "mapped.npz"]
    words += [f"--dimension={name}={','.join(str(each) for each in powers)}" for name, powers in dimensions.items()]
    with tempfile.TemporaryDirectory(prefix="cutproof") as folder:
        _run_in(folder, words, given=arrays)
        with numpy.load(os.path.join(folder, "mapped.npz")) as made:
            return dict(made)


def _run_in(folder, words, **files):
    """`cutproof` with these words where each file lies as NAME.npz: its arrays by name."""
    __tracebackhide__ = True
    for name, arrays in files.items():
        numpy.savez(os.path.join(folder, name), **{key: array for key, array in arrays.items() if array is not None})
    try:
        done = subprocess.run([os.path.abspath(_find_program()), *words], cwd=folder, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise Error(f"cutproof cannot be started: {error}") from error
    text = re.sub(r"\n*see it again: .*", "", done.stderr.strip())  # the files are gone
    _raise_unless_judged(done.returncode, text)
    return done, text


def _judge_arrays(words, **files):
    __tracebackhide__ = True
    with tempfile.TemporaryDirectory(prefix="cutproof") as folder:
        done, text = _run_in(folder, [*words, "--json=-"], **files)
    if not done.stdout:
        raise Error("the program has judged nothing: is it cutproof?")
    document = json.loads(done.stdout)
    if done.returncode != 0:
        raise Failed(text, document)
    return Result(text, document)


def _given(**functions):
    return {name: function for name, function in functions.items() if function is not None}


def _raise_unless_judged(status, errors):
    __tracebackhide__ = True
    if status == 77:
        raise Skipped(errors)
    if status < 0:
        raise Error(f"cutproof was ended by signal {-status}\n{errors}".rstrip())
    if status not in (0, 1):
        raise Error(errors or f"cutproof ended with status {status}")


def _describe(guest, document, seed, precision):
    """What failed, for a person."""
    lines = [f"{document['plugin']['name']}: a verdict of cutproof fails (seed {seed}, {precision} precision)"]
    for operation in document["operations"]:
        name = operation["operation"]
        function = _name_of(guest.functions[name]).split(".")[-1]
        more = ', device="cuda"' if guest.device is not None else ""
        more += f', promises="{guest.hello.promises.decode()}"' if guest.hello.has_promises else ""
        for failure in operation["failures"]:
            measured, bound = (f"{value:.3g}" if isinstance(value, (int, float)) else "no finite number"
                               for value in (failure["measured"], failure["bound"]))
            unit = f" {failure['unit']}" if failure["unit"] != "1" else ""
            question = f"the question of size {failure['drawn_size']}" if "drawn_size" in failure \
                else f"question {failure['index']}"
            lines += [f"{name}: '{failure['property']}' fails in {question} ({failure['kind']})",
                      f"  {failure['text']}"]
            lines += [f"  shrunk to {failure['size']}: {failure['shrunk']}",
                      f"  measured {measured}{unit}, the bound is {bound}{unit}",
                      f"  saved; to see it again: "
                      f"cutproof.replay({failure['file']!r}, {name}={function}{more})"]
            trace = guest.tracebacks.get(failure["shrunk"]) or guest.tracebacks.get(failure["text"])
            if trace is None and failure["text"].startswith("it did not answer"):
                trace = guest.tracebacks.get("out of time")
            lines += ["  " + line for line in (trace or "").split("\n") if line]
        if operation["untested"]:
            lines.append(f"{name}: too little was judged: {operation['untested']}")
        if operation["ended"]:
            why = "a function that has not ended cannot be asked again" if guest.interrupted else \
                "after this nothing can be asked in this process"
            lines.append(f"{name}: no further question was asked: {why}")
        elif operation["gave_up"]:
            lines.append(f"{name}: given up after {operation['not_answered']} questions that were not answered; "
                         "keep_going=True goes on")
    return "\n".join(lines)


if __name__ == "__main__":  # python -m cutproof
    try:
        program = _find_program()
    except Error as error:
        print(f"cutproof: {error}", file=sys.stderr)
        sys.exit(3)
    os.execv(program, [program, *sys.argv[1:]])
