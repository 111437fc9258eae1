"""Files of arrays by numpy and h5py, for array_file_test, and what it writes, read by them.

usage: array_files.py write FOLDER     files that our reader reads or refuses
       array_files.py check FOLDER     reads ours.npz and ours.h5, which our writer wrote
"""
import io
import pathlib
import struct
import sys
import zipfile

import h5py
import numpy as np

NUMBERS = {
    "truth": np.array([True, False, True]),
    "int8": np.array([1, 2, 127], "i1"),
    "negative_int8": np.array([1, -2, -128], "i1"),
    "uint8": np.array([0, 255], "u1"),
    "int16": np.array([-32768, 32767], "i2"),
    "uint16": np.array([0, 65535], "u2"),
    "int32": np.array([[-2**31, 2**31 - 1]], "i4"),
    "uint32": np.array([0, 2**31 - 1], "u4"),
    "large_uint32": np.array([0, 2**32 - 1], "u4"),
    "int64": np.array([-2**63, 2**63 - 1], "i8"),
    "uint64": np.array([0, 2**63 - 1], "u8"),
    "columns": np.asfortranarray(np.arange(24, dtype="f8").reshape(2, 3, 4)),
    "table": np.arange(6, dtype="i2").reshape(3, 2).T,
    "single": np.array([[0.1, -np.inf], [1e-45, 3e38]], "f4"),
    "double": np.arange(24, dtype="f8").reshape(2, 3, 4) / 7,
    "scalar": np.float64(0.1),
    "whole": np.int64(7),
    "nothing": np.zeros((0, 3)),
    "column": np.arange(3.0)[::-1],
}
WORDS = "covered connected"


def write_npy(archive, name, version, header, data):
    text = header.encode()
    length = struct.pack("<H" if version == 1 else "<I", len(text))
    archive.writestr(name, b"\x93NUMPY" + bytes([version, 0]) + length + text + data)


def write_good(folder):
    np.savez(folder / "plain.npz", promises=WORDS, **NUMBERS)
    np.savez_compressed(folder / "deflated.npz", promises=np.array(WORDS.split()), **NUMBERS)
    np.savez(folder / "bytes.npz", promises=np.bytes_(WORDS), **NUMBERS)
    np.savez(folder / "big_endian.npz", promises=np.array(WORDS, ">U17"),
             **{name: np.asarray(values).astype(np.asarray(values).dtype.newbyteorder(">"))
                for name, values in NUMBERS.items()})
    with open(folder / "streamed.npz", "wb") as file:  # sizes and sums stand behind each array
        stream = type("Stream", (), {"read": None, "write": file.write, "flush": file.flush})
        np.savez_compressed(stream(), promises=np.array(WORDS.split()), **NUMBERS)
    limit, zipfile.ZIP64_LIMIT = zipfile.ZIP64_LIMIT, 10  # as if all were larger than 4 GiB
    np.savez(folder / "large_numbers.npz", promises=WORDS, **NUMBERS)
    zipfile.ZIP64_LIMIT = limit
    with zipfile.ZipFile(folder / "deflated.npz", "a") as archive:
        archive.comment = b"PK\5\6" * 16000
    with h5py.File(folder / "plain.h5", "w") as file:
        for name, values in NUMBERS.items():
            file[name] = values
        file["promises"] = WORDS
    with h5py.File(folder / "packed.h5", "w") as file:
        for name, values in NUMBERS.items():
            if np.ndim(values) > 0 and np.size(values) > 0:
                file.create_dataset(name, data=values, compression="gzip", shuffle=True, fletcher32=True)
            else:
                file[name] = values
        file.attrs["promises"] = WORDS
    with h5py.File(folder / "list.h5", "w") as file:
        for name, values in NUMBERS.items():  # big endian is no trouble to HDF5
            values = np.asarray(values)
            file[name] = values.astype(values.dtype.newbyteorder(">"))
        file["promises"] = np.array(WORDS.split(), "S9")
    # As MATLAB 7.3 writes: behind a block of its own, with a class beside each array and texts of 16-bit letters. What
    # else is in the root is nobody's business here.
    with h5py.File(folder / "matlab.mat", "w", userblock_size=4096) as file:
        for name, values in NUMBERS.items():
            file[name] = values
            file[name].attrs["MATLAB_class"] = np.bytes_(np.asarray(values).dtype.name)
        file["promises"] = np.array([[ord(letter)] for letter in WORDS], "u2")
        file["promises"].attrs["MATLAB_class"] = np.bytes_("char")
        file.attrs["frame_rate"] = 30.0
        file.attrs["nothing"] = h5py.Empty("f8")
        file.attrs["pairs"] = np.zeros(2, [("a", "f8")])
        file.attrs["long"] = "a" * 40000
        file.attrs["author"] = "somebody"
    with open(folder / "matlab.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file")
    with zipfile.ZipFile(folder / "version_2.npz", "w") as archive:
        write_npy(archive, "a.npy", 2, "{'descr': '<i4', 'fortran_order': False, 'shape': (2,), }\n", b"\1\0\0\0\2\0\0\0")
        write_npy(archive, "b.npy", 1, "{\"shape\": (2,),'fortran_order':True,'descr':\"<i4\"}", b"\1\0\0\0\2\0\0\0")


def write_bad(folder):
    x = np.arange(6.0).reshape(2, 3)
    np.savez(folder / "half.npz", x=x.astype("f2"))
    np.savez(folder / "objects.npz", x=np.array([{}, None], object))
    np.savez(folder / "complex.npz", x=x.astype(complex))
    np.savez(folder / "long_double.npz", x=x.astype(np.longdouble))
    np.savez(folder / "dates.npz", x=np.array(["2026-01-01"], "M8[D]"))
    np.savez(folder / "structure.npz", x=np.zeros(2, [("a", "f8"), ("b", "i4")]))
    np.savez(folder / "too_large_integer.npz", x=np.array([2**63], "u8"))
    np.savez(folder / "text_table.npz", x=np.array([["a", "b"]]))
    np.savez(folder / "umlaut.npz", x="gr\u00fcn")
    np.savez(folder / "long_text.npz", x="a" * 40000)
    np.savez(folder / "many.npz", **{f"x{k}": x for k in range(65)})
    np.savez(folder / "axes.npz", x=np.zeros((1,) * 9))
    np.savez(folder / "whole.npz", x=x, y=x)
    whole = (folder / "whole.npz").read_bytes()
    (folder / "cut_off.npz").write_bytes(whole[:-30])
    flipped = bytearray(whole)
    flipped[flipped.index(x.tobytes()) + 3] ^= 1
    (folder / "flipped.npz").write_bytes(flipped)
    header = whole.index(b"PK\3\4", 1)
    directory = whole.index(b"PK\1\2")
    for name, at, value in (("header", header, b"PK\3\5"), ("other_name", header + 30, b"z"),
                            ("directory", directory, b"PK\3\4"), ("encrypted", directory + 8, b"\1"),
                            ("longer", directory + 20, b"\xb1"), ("claims_4_gib", directory + 24, b"\xff\xff\xff\xff"),
                            ("outside", directory + 42, b"\xff\xff\xff\x7f"),
                            ("fewer", len(whole) - 12, b"\1"), ("far_directory", len(whole) - 6, b"\xff\xff\xff\x7f")):
        (folder / f"{name}.npz").write_bytes(whole[:at] + value + whole[at + len(value):])
    (folder / "whole.npz").unlink()
    large = (folder / "large_numbers.npz").read_bytes()
    directory = large.index(b"PK\1\2")
    extra = directory + 46 + large[directory + 28]
    (folder / "no_size.npz").write_bytes(large[:extra + 2] + b"\0" + large[extra + 3:])
    np.savez_compressed(folder / "whole.npz", x=np.random.default_rng(1).random(100000))
    whole = (folder / "whole.npz").read_bytes()
    for name, at in (("inflated_otherwise", len(whole) // 2), ("no_deflation", whole.index(b"x.npy") + 26)):
        (folder / f"{name}.npz").write_bytes(whole[:at] + b"\xff\xff\xff" + whole[at + 3:])
    (folder / "whole.npz").unlink()
    np.save(folder / "alone.npy", x)
    (folder / "alone.npy").rename(folder / "alone.npz")
    (folder / "empty.npz").write_bytes(b"")
    (folder / "text.h5").write_text("positions: 1 2 3")

    def archive(name, entries, compression=zipfile.ZIP_STORED):
        with zipfile.ZipFile(folder / name, "w", compression) as file:
            for entry, data in entries:
                file.writestr(entry, data)

    npy = io.BytesIO()
    np.save(npy, x)
    npy = npy.getvalue()
    archive("folder.npz", [("a/x.npy", npy)])
    archive("no_array.npz", [("readme.txt", "hello")])
    archive("bzip2.npz", [("x.npy", npy)], zipfile.ZIP_BZIP2)
    archive("short.npz", [("x.npy", npy[:-1])])
    archive("long.npz", [("x.npy", npy + b"!")])
    archive("no_header.npz", [("x.npy", npy[:9])])
    archive("no_magic.npz", [("x.npy", b"!" + npy[1:])])
    archive("version_3.npz", [("x.npy", npy[:6] + b"\3" + npy[7:])])
    archive("nothing_known.npz", [("x.npy", npy.replace(b"descr", b"descs"))])
    archive("negative.npz", [("x.npy", npy.replace(b"(2, 3)", b"(-2,3)"))])
    archive("many_numbers.npz", [("x.npy", npy.replace(b"(2, 3), }         ", b"(99999999999,), } "))])
    with zipfile.ZipFile(folder / "twice.npz", "w") as file:
        import warnings
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file.writestr("x.npy", npy)
            file.writestr("x.npy", npy)
    def claim(name, size):
        """Makes the archive say that each of its files has this size."""
        data = bytearray((folder / name).read_bytes())
        for signature, at in ((b"PK\3\4", 22), (b"PK\1\2", 24)):
            begin = -1
            while (begin := data.find(signature, begin + 1)) >= 0:
                data[begin + at:begin + at + 4] = struct.pack("<I", size)
        (folder / name).write_bytes(data)

    archive("claims.npz", [("x.npy", npy)], zipfile.ZIP_DEFLATED)
    claim("claims.npz", 4_000_000_000)  # of some hundred bytes
    noise = np.random.default_rng(1).bytes(2_200_000)
    archive("too_much.npz", [("x.npy", noise), ("y.npy", noise)], zipfile.ZIP_DEFLATED)
    claim("too_much.npz", 2_200_000_000)

    with h5py.File(folder / "elsewhere.h5", "w") as file:
        file["x"] = h5py.ExternalLink("plain.h5", "/double")
    with h5py.File(folder / "soft.h5", "w") as file:
        file["x"] = x
        file["y"] = h5py.SoftLink("/x")
    with h5py.File(folder / "group.h5", "w") as file:
        file["a/x"] = x
    with h5py.File(folder / "external.h5", "w") as file:
        file.create_dataset("x", (2, 3), "f8", external=[("plain.h5", 0, 48)])
    with h5py.File(folder / "virtual.h5", "w") as file:
        layout = h5py.VirtualLayout((2, 3), "f8")
        layout[:] = h5py.VirtualSource("plain.h5", "double", (2, 3))
        file.create_virtual_dataset("x", layout)
    with h5py.File(folder / "unwritten.h5", "w") as file:
        file.create_dataset("x", (1000, 3), "f8")
    with h5py.File(folder / "huge.h5", "w") as file:
        file.create_dataset("x", (10**9, 3), "f8", chunks=(1000, 3))
    with h5py.File(folder / "compound.h5", "w") as file:
        file["x"] = np.zeros(2, [("a", "f8")])
    with h5py.File(folder / "null.h5", "w") as file:
        file["x"] = h5py.Empty("f8")
    with h5py.File(folder / "half.h5", "w") as file:
        file["x"] = x.astype("f2")
    with h5py.File(folder / "umlaut.mat", "w", userblock_size=512) as file:
        file["x"] = np.array([[0x142]], "u2")
        file["x"].attrs["MATLAB_class"] = np.bytes_("char")
    (folder / "block.h5").write_bytes(b"x" * 512 + (folder / "plain.h5").read_bytes()[:-20])
    with h5py.File(folder / "many.h5", "w") as file:
        for k in range(65):
            file[f"x{k}"] = x
    with h5py.File(folder / "text_table.h5", "w") as file:
        file["x"] = np.array([["a", "b"]], "S1")
    with h5py.File(folder / "whole.h5", "w") as file:
        file["x"] = x
    (folder / "cut_off.h5").write_bytes((folder / "whole.h5").read_bytes()[:-20])
    (folder / "whole.h5").unlink()


def check(folder):
    expected = {
        "i32": np.array([[1, -2, 3], [4, 5, 6]], "i4"),
        "i64": np.array([2**40], "i8"),
        "u8": np.array([0, 1, 255], "u1"),
        "f32": np.array([0.1, np.inf], "f4"),
        "f64": np.array([[[0.1]], [[-0.0]]], "f8"),
        "scalar": np.array(2.5),
        "none": np.zeros((0, 3)),
    }
    with np.load(folder / "ours.npz") as ours:
        found = {name: ours[name] for name in ours.files}
    assert str(found.pop("words")) == WORDS, found
    assert str(found.pop("no_words")) == "", found
    with h5py.File(folder / "ours.h5") as ours:
        hdf5 = {name: ours[name][()] for name in ours}
        assert dict(ours.attrs.items()) == {"words": WORDS.encode(), "no_words": b""} or \
            {k: v if isinstance(v, bytes) else v.encode() for k, v in ours.attrs.items()} == \
            {"words": WORDS.encode(), "no_words": b""}, dict(ours.attrs)
    for arrays in (found, hdf5):
        assert arrays.keys() == expected.keys(), arrays.keys()
        for name, values in expected.items():
            assert arrays[name].dtype == values.dtype, (name, arrays[name].dtype)
            assert arrays[name].shape == values.shape, (name, arrays[name].shape)
            assert arrays[name].tobytes() == values.tobytes(), name


if __name__ == "__main__":
    command, where = sys.argv[1], pathlib.Path(sys.argv[2])
    if command == "write":
        write_good(where)
        write_bad(where)
    else:
        check(where)
