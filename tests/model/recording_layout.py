"""Reads what the recorder writes with h5py, as somebody without our code would.

usage: recording_layout.py FOLDER

FOLDER holds the recordings `cut`, `nothing` and `one` that recording_test writes. Each of their particles, skin and
blade files must be temporal VTKHDF 2.0 of type PolyData; what stands in them is compared with the index, and for
`cut` with what its run is known to be.
"""
import sys

import h5py
import numpy as np

TOPOLOGIES = ["Vertices", "Lines", "Polygons", "Strips"]
checks = 0


def require(condition, what):
    global checks
    checks += 1
    if not condition:
        sys.exit(f"recording_layout.py: {what}")


def require_array(dataset, dtype, shape, what):
    require(isinstance(dataset, h5py.Dataset), f"{what} is no dataset")
    require(dataset.dtype == np.dtype(dtype), f"{what} is {dataset.dtype}, not {dtype}")
    require(dataset.shape == shape, f"{what} has shape {dataset.shape}, not {shape}")
    require(dataset.maxshape[0] is None, f"{what} cannot be extended")
    require(dataset.compression == "gzip" and dataset.fletcher32, f"{what} is not compressed with checksums")


def first_offset_2023(start, part, cells):
    """Where VTK 9.3 (ParaView 5.12) begins to read Offsets."""
    return start + part


def first_offset_2024(start, part, cells):
    """Where VTK 9.4 (ParaView 5.13) and later do."""
    parts = total = 0
    for count in cells[:part]:
        if total >= start:
            break
        parts += 1
        total += count
    return start + parts


def read_steps(path):
    """Checks the layout of one file and returns its steps: time, points, cells per topology, point data."""
    with h5py.File(path, "r") as file:
        root = file["VTKHDF"]
        version = root.attrs["Version"]
        require(version.shape == (2,) and version.dtype.kind == "i" and list(version) == [2, 0], f"{path}: Version")
        kind = root.attrs.get_id("Type").get_type()
        require(isinstance(kind, h5py.h5t.TypeStringID) and not kind.is_variable_str(), f"{path}: Type is not fixed text")
        require(kind.get_cset() == h5py.h5t.CSET_ASCII and kind.get_size() == len("PolyData"), f"{path}: Type's length")
        require(root.attrs["Type"] == b"PolyData", f"{path}: Type is {root.attrs['Type']}")

        steps = root["Steps"]
        count = steps.attrs["NSteps"]
        require(np.ndim(count) == 0 and np.dtype(type(count)).kind == "i" and count >= 1, f"{path}: NSteps is {count}")
        count = int(count)
        parts = root["NumberOfPoints"].shape[0]
        require_array(root["NumberOfPoints"], "int64", (parts,), f"{path}: NumberOfPoints")
        require_array(root["Points"], "float64", (root["Points"].shape[0], 3), f"{path}: Points")
        cells = {}
        for name in TOPOLOGIES:
            group = root[name]
            require_array(group["NumberOfCells"], "int64", (parts,), f"{path}: {name}/NumberOfCells")
            require_array(group["NumberOfConnectivityIds"], "int64", (parts,), f"{path}: {name}/NumberOfConnectivityIds")
            cells[name] = group["NumberOfCells"][:]
            # Each part has one offset more than cells.
            require_array(group["Offsets"], "int64", (int(cells[name].sum()) + parts,), f"{path}: {name}/Offsets")
            ids = int(group["NumberOfConnectivityIds"][:].sum())
            require_array(group["Connectivity"], "int64", (ids,), f"{path}: {name}/Connectivity")

        require_array(steps["Values"], "float64", (count,), f"{path}: Steps/Values")
        for name in ["PartOffsets", "NumberOfParts", "PointOffsets"]:
            require_array(steps[name], "int64", (count,), f"{path}: Steps/{name}")
        for name in ["CellOffsets", "ConnectivityIdOffsets"]:
            require_array(steps[name], "int64", (count, 4), f"{path}: Steps/{name}")
        require(set(steps["PointDataOffsets"]) == set(root["PointData"]), f"{path}: PointDataOffsets and PointData differ")
        for name in root["PointData"]:
            require_array(steps["PointDataOffsets"][name], "int64", (count,), f"{path}: PointDataOffsets/{name}")
        require((np.diff(steps["Values"][:]) > 0).all(), f"{path}: times do not rise")
        require((steps["NumberOfParts"][:] == 1).all(), f"{path}: more than one part in a step")

        result = []
        for k in range(count):
            part = int(steps["PartOffsets"][k])
            require(0 <= part < parts, f"{path}: step {k} names part {part} of {parts}")
            n = int(root["NumberOfPoints"][part])
            first = int(steps["PointOffsets"][k])
            require(0 <= first and first + n <= root["Points"].shape[0], f"{path}: step {k} lacks points")
            step = {"time": steps["Values"][k], "points": root["Points"][first : first + n], "cells": {}, "data": {}}
            for t, name in enumerate(TOPOLOGIES):
                group = root[name]
                start, ids_start = int(steps["CellOffsets"][k, t]), int(steps["ConnectivityIdOffsets"][k, t])
                at = first_offset_2023(start, part, cells[name])
                if cells[name][part] > 0:
                    require(at == first_offset_2024(start, part, cells[name]), f"{path}: step {k}, {name}: readers differ")
                for begin in (at, first_offset_2024(start, part, cells[name])):
                    offsets = group["Offsets"][begin : begin + cells[name][part] + 1]
                    ids = int(group["NumberOfConnectivityIds"][part])
                    require(len(offsets) == cells[name][part] + 1, f"{path}: step {k}, {name}: offsets are missing")
                    require(offsets[0] == 0 and offsets[-1] == ids and (np.diff(offsets) > 0).all(),
                            f"{path}: step {k}, {name}: offsets {offsets}")
                connectivity = group["Connectivity"][ids_start : ids_start + ids]
                require(len(connectivity) == ids, f"{path}: step {k}, {name}: connectivity is missing")
                require(((0 <= connectivity) & (connectivity < n)).all(), f"{path}: step {k}, {name}: no such point")
                step["cells"][name] = [connectivity[a:b] for a, b in zip(offsets[:-1], offsets[1:])]
            for name, data in root["PointData"].items():
                first = int(steps["PointDataOffsets"][name][k])
                require(0 <= first and first + n <= data.shape[0], f"{path}: step {k} lacks {name}")
                step["data"][name] = data[first : first + n]
            result.append(step)
        return result


def read_all(stem):
    files = {name: read_steps(f"{stem}.{name}.vtkhdf") for name in ["particles", "skin", "blade"]}
    times = [[step["time"] for step in steps] for steps in files.values()]
    require(times[0] == times[1] == times[2], f"{stem}: the three files have different times")
    with h5py.File(f"{stem}.cutproof.h5", "r") as index:
        ids = {index.attrs["cutproof_recording"]}
        for name in files:
            with h5py.File(f"{stem}.{name}.vtkhdf", "r") as file:
                ids.add(file.attrs["cutproof_recording"])
                require(file.attrs["cutproof_file"] == f"recording {name}".encode(), f"{stem}: cutproof_file of {name}")
        require(len(ids) == 1, f"{stem}: files of different recordings")
        require(index.attrs["cutproof_file"] == b"recording index", f"{stem}: cutproof_file")
        require(index.attrs["cutproof_format"] == 9, f"{stem}: cutproof_format")
    return files


def only(step, topology):
    for name in TOPOLOGIES:
        require(name == topology or not step["cells"][name], f"a step has {name}")
    return step["cells"][topology]


def check_cut(folder):
    files = read_all(f"{folder}/cut")
    particles, skin, blade = files["particles"], files["skin"], files["blade"]
    # Loaded, and three frames of two substeps each; the snapshots within frame 1 are no steps.
    require(np.array_equal([step["time"] for step in particles], np.cumsum([0, 2 * 0.004, 2 * 0.005, 2 * (0.1 / 3)])),
            "times of the steps")
    with h5py.File(f"{folder}/cut.cutproof.h5", "r") as index:
        body = index["setup/body"]
        nodes, h = body.attrs["nodes"], body.attrs["spacing"]
        node = body["node"][:]
        rest = h * np.stack([node % nodes[0], node // nodes[0] % nodes[1], node // (nodes[0] * nodes[1])], axis=1)
        require(index["scene"][:].tobytes() == b'{"version": 1}', "the scene")
        require(index.attrs["backend"] == b"reference", "the backend")
        require(list(index["snapshots/stage"]) == [5, 5, 1, 2, 3, 5, 5], "stages")
        require(list(index["snapshots/frame"]) == [0, 1, 1, 1, 1, 2, 3], "frames")
        # The example of docs/reference/recording.md: the clusters of one snapshot.
        i = 3
        s, clusters = index["snapshots"], index["clusters"]
        row = s["offsets_row"][i]
        offsets = clusters["offsets"][row : row + s["cluster_count"][i] + 1]
        row = s["members_row"][i]
        members = clusters["members"][row : row + s["member_count"][i]]
        found = [list(members[a:b]) for a, b in zip(offsets[:-1], offsets[1:])]
        require(found == [[1, 2, 4], [4, 5, 6], [6, 7]], f"clusters after split are {found}")
        removed = s["removed"][s["removed_offsets"][2] : s["removed_offsets"][3]]
        require(list(removed) == [0, 3], f"removed are {removed}")
        with h5py.File(f"{folder}/cut.particles.vtkhdf", "r") as file:
            row = s["position_row"][6]
            require(np.array_equal(file["VTKHDF/Points"][row : row + len(node)], particles[3]["points"]),
                    "the index and the last step name different positions")

    n = len(rest)
    require(np.array_equal(particles[0]["points"], rest), "positions of the first step are not those at rest")
    shift = np.stack([1e-3 * np.arange(1, n + 1), np.full(n, -1e-4), np.full(n, 1 / 3)], axis=1)
    expected = rest
    for k in range(1, 4):
        expected = expected + shift
        require(np.array_equal(particles[k]["points"], expected), f"positions of step {k}")
    dead = [[], [], [0, 3, 7], [0, 3, 7]]
    for k, step in enumerate(particles):
        require([list(cell) for cell in only(step, "Vertices")] == [[i] for i in range(n)], f"vertices of step {k}")
        require(list(np.flatnonzero(step["data"]["alive"] == 0)) == dead[k], f"alive in step {k}")
        require(list(step["data"]["particle"]) == list(range(n)), f"particle in step {k}")
        require(step["data"]["velocity"].shape == (n, 3), f"velocity in step {k}")
    require(list(particles[0]["data"]["cluster"]) == [0, 0, 0, 0, 0, 1, 1, 1], "cluster in step 0")
    require(list(particles[2]["data"]["cluster"]) == [-1, 0, 0, -1, 0, 1, 1, 2], "cluster in step 2")
    require(particles[1]["data"]["velocity"][3, 0] == 0.1 * 3, "velocity in step 1")

    require([len(only(step, "Polygons")) for step in skin] == [0, 4, 6, 6], "triangles of the skin")
    require([list(c) for c in skin[2]["cells"]["Polygons"]] == [[3 * i, 3 * i + 1, 3 * i + 2] for i in range(6)], "skin")
    require(list(skin[2]["data"]["owner"]) == [i for i in range(6) for _ in range(3)], "owners of the skin")
    require(list(skin[2]["data"]["direction"]) == 6 * [0, 2, 4], "directions of the skin")
    require(list(skin[2]["data"]["reach"]) == 6 * [0.25, 0.375, 0.5], "reaches of the skin")
    require(np.array_equal(skin[3]["points"][0], particles[3]["points"][0] + [0.05, 0, 0]), "positions of the skin")

    require([len(only(step, "Polygons")) for step in blade] == [0, 0, 6, 0], "the blade is up, up, down, up")
    box = blade[2]
    quads, points = box["cells"]["Polygons"], box["points"]
    edges = [(quad[i], quad[(i + 1) % 4]) for quad in quads for i in range(4)]
    require(len(set(edges)) == 24 and all((b, a) in edges for a, b in edges), "the blade is no closed box")
    volume = sum(np.dot(points[q[0]], np.cross(points[q[i]], points[q[i + 1]])) / 6 for q in quads for i in (1, 2))
    length, depth, thickness = 0.5, 0.4, 0.02
    require(abs(volume - (length + thickness) * (depth + thickness) * thickness) < 1e-15, f"the blade's volume {volume}")
    # It stands where substep 3 ends, with its edge along x and its back along z.
    require(np.allclose(points.min(axis=0), [0.4 - 0.26, 0.2 - 0.01, 0.3 - 0.01], rtol=0, atol=1e-15), "the blade's place")


def check_small(folder):
    # A recording without a snapshot: readers need one step, and it shows nothing.
    for name, steps in read_all(f"{folder}/nothing").items():
        require(len(steps) == 1 and len(steps[0]["points"]) == 0, f"nothing: {name}")
    one = read_all(f"{folder}/one")
    require(one["particles"][0]["points"].tolist() == [[0.1, 0.1, 0.1]], "one: its place")
    require(len(one["skin"][0]["points"]) == 0 and len(one["blade"][0]["points"]) == 0, "one: skin and blade")


check_cut(sys.argv[1])
check_small(sys.argv[1])
print(f"recording_layout.py: {checks} checks passed")
