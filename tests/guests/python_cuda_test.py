"""cutproof.py with arrays on a CUDA device. Exit status 77, and the reason, where there is none.

Only the driver is called, through ctypes: no CuPy, no PyTorch, no kernel. With a stand-in for the driver
(stand_in_cuda.c) it runs on machines without a device.
"""
import ctypes
import pathlib
import sys
import tempfile
import types
import unittest

import numpy

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "guests" / "python"))
sys.path[:0] = [str(ROOT / "tests" / "guests"), str(ROOT / "guests" / "examples" / "runs")]
import cutproof  # noqa: E402
import scene  # noqa: E402
import springs as simulator  # noqa: E402
from python_test import labels_by_union_find, rotations_by_svd  # noqa: E402

try:
    driver = cutproof._Device()
except cutproof.Skipped as why:
    print(f"SKIPPED: {why}")
    sys.exit(77)
driver.driver.cuMemcpyDtoD_v2.argtypes = [ctypes.c_uint64, ctypes.c_uint64, ctypes.c_size_t]


def address(array):
    return array.__cuda_array_interface__["data"][0]


def to_host(array):
    interface = array.__cuda_array_interface__
    host = numpy.empty(interface["shape"], interface["typestr"])
    if host.size:
        driver.call("cuMemcpyDtoH_v2", host.ctypes.data, address(array), host.nbytes)
    return host


class Mine:
    """An array of somebody else's on the device, with the strides of `array`."""

    def __init__(self, array):
        whole = numpy.ascontiguousarray(array) if array.base is None else array.base
        self.memory = ctypes.c_uint64()
        driver.call("cuMemAlloc_v2", ctypes.byref(self.memory), max(whole.nbytes, 1))
        if whole.size:
            driver.call("cuMemcpyHtoD_v2", self.memory, whole.ctypes.data, whole.nbytes)
        shift = array.ctypes.data - whole.ctypes.data if array.base is not None else 0
        self.__cuda_array_interface__ = {"version": 3, "shape": array.shape, "typestr": array.dtype.str,
                                         "strides": array.strides if array.base is not None else None,
                                         "data": (self.memory.value + shift, False)}

    def __del__(self):
        driver.call("cuMemFree_v2", self.memory)


class Judged(unittest.TestCase):
    def judge(self, **options):
        with tempfile.TemporaryDirectory() as folder:
            return cutproof.judge(**{"save": folder, "shrink": 0, "cases": 60, "device": "cuda", **options})

    def fault(self, **options):
        with self.assertRaises(cutproof.Failed) as caught:
            self.judge(**options)
        return {each["property"]: each["text"]
                for each in caught.exception.document["operations"][0]["failures"]}


class OnTheDevice(Judged):
    def test_right_rotations(self):
        for precision in ("single", "double"):
            result = self.judge(rotations=lambda a, p: Mine(rotations_by_svd(to_host(a), to_host(p)).astype(
                "f4" if precision == "single" else "f8")), precision=precision)
            self.assertEqual(result.document["plugin"]["device"], "cuda")
            self.assertEqual(result.operations["rotations"]["refused"], 0)

    def test_right_rotations_from_the_host(self):
        self.judge(rotations=lambda a, p: rotations_by_svd(to_host(a), to_host(p)))

    def test_the_previous_ones_are_not_the_best(self):
        def previous_ones(a, previous):
            answer = Mine(numpy.zeros(previous.shape, previous.dtype))
            driver.call("cuMemcpyDtoD_v2", address(answer), address(previous), 36 * len(previous))
            return answer

        self.assertIn("of Σσ below the best", self.fault(rotations=previous_ones)["best rotation"])
        self.assertIn("of Σσ below the best", self.fault(rotations=lambda a, previous: previous)["best rotation"])

    def test_components(self):
        class OnTheHost:
            pass

        def labels(tissue, alive):
            host = OnTheHost()
            host.edge_offsets, host.edge_ends = to_host(tissue.edge_offsets), to_host(tissue.edge_ends)
            self.assertIsInstance(tissue.spacing, float)
            return Mine(numpy.array(labels_by_union_find(host, to_host(alive)), dtype=numpy.int32))

        self.judge(components=labels)
        self.assertIn("components", self.fault(components=lambda t, alive: Mine(
            numpy.zeros(len(alive), dtype=numpy.int32))))
        self.assertEqual(self.fault(components=lambda t, alive: alive)["answers"], "label is bool, int32 is wanted")

    def test_a_whole_simulator(self):
        def springs(change):
            def dissect(asked):
                host = types.SimpleNamespace(**{name: to_host(value) if hasattr(
                    value, "__cuda_array_interface__") else value for name in cutproof.Scene.__slots__
                    for value in [getattr(asked, name)]})
                for frame in scene.dissection(simulator.simulate)(host):
                    frame = change(frame)
                    yield {name: Mine(numpy.ascontiguousarray(value)) if isinstance(value, numpy.ndarray)
                           and value.ndim > 0 else value for name, value in frame.items()}
            return dissect

        options = {"cases": 10, "precision": "double", "limits": "diagonals",
                   "promises": "free angular_momentum deterministic no_ghost_force mirror"}
        result = self.judge(dissect=springs(dict), **options).operations["dissect"]
        self.assertEqual((result["cases"], result["refused"]), (10, 0))
        self.assertIn("run as asked", self.fault(
            dissect=springs(lambda frame: dict(frame, positions=frame["positions"] + 1e-3)), **options))

    def test_strides(self):
        def transposed(a, previous):
            whole = rotations_by_svd(to_host(a), to_host(previous)).transpose(0, 2, 1).copy()
            return Mine(whole.transpose(0, 2, 1))

        def backwards(a, previous):
            whole = rotations_by_svd(to_host(a), to_host(previous))[::-1].copy()
            return Mine(whole[::-1])

        self.judge(rotations=transposed)
        self.judge(rotations=backwards)

    def test_who_writes_to_an_input_is_found(self):
        def writes(where):
            def write(a, previous):
                answer = rotations_by_svd(to_host(a), to_host(previous))
                driver.call("cuMemsetD8_v2", address(a) + (where if where < 1 else 36 * len(a) + where - 1), 1, 1)
                return answer
            return write

        self.assertEqual(self.fault(rotations=writes(0))["answers"], "it wrote to 'a', which is an input")
        self.assertEqual(self.fault(rotations=writes(-3))["answers"], "it wrote to byte 3 before the beginning of 'a'")
        self.assertRegex(self.fault(rotations=writes(7))["answers"],
                         "it wrote to byte 7 behind the end of 'a', which has 2[0-9]+ rows")

    def test_an_address_that_is_none(self):
        class Nowhere:
            __cuda_array_interface__ = {"version": 3, "shape": (256, 3, 3), "typestr": "<f4", "data": (64, False)}

        self.assertIn("r cannot be copied from the device", self.fault(rotations=lambda a, p: Nowhere())["answers"])

    def test_on_the_host_nothing_is_taken_from_the_device(self):
        text = self.fault(rotations=lambda a, p: Mine(numpy.zeros(a.shape, "f4")), device="host")["answers"]
        self.assertEqual(text, 'r lies on a CUDA device; ask with device="cuda"')


# A real device would be lost to the tests that follow, and does not count what is allocated.
if hasattr(driver.driver, "stand_in_break"):
    class WithTheStandIn(Judged):
        def test_a_device_that_fails(self):
            asked = []

            def breaks(a, previous):
                asked.append(len(a))
                driver.driver.stand_in_break(1)
                return previous

            try:
                with self.assertRaises(cutproof.Failed) as caught:
                    self.judge(rotations=breaks, components=lambda t, alive: asked.append(0))
            finally:
                driver.driver.stand_in_break(0)
            self.assertEqual(len(asked), 1)
            self.assertIn("the CUDA device failed: cuCtxSynchronize: CUDA_ERROR_ILLEGAL_ADDRESS", str(caught.exception))
            self.assertIn("nothing can be asked in this process", str(caught.exception))

        def test_nothing_is_left_on_the_device(self):
            before = driver.driver.stand_in_count()
            self.judge(rotations=lambda a, p: rotations_by_svd(to_host(a), to_host(p)))
            self.assertEqual(driver.driver.stand_in_count(), before)

        def test_a_driver_without_a_device(self):
            driver.driver.stand_in_break(1)
            try:
                with self.assertRaisesRegex(cutproof.Skipped, "no CUDA device here: cuInit: CUDA_ERROR_NO_DEVICE"):
                    self.judge(rotations=rotations_by_svd)
            finally:
                driver.driver.stand_in_break(0)


if __name__ == "__main__":
    unittest.main()
