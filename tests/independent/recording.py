"""Setup, first state and trajectory from a recording of cutproof (docs/reference/recording.md): which nodes are tissue,
which clusters it was cooked into, and the tables of blade and grips are taken from there, so that sampling, cooking and
schedules need not be invented again. Nothing else is: edges, weights and rest frames are made anew."""
import types

import h5py
import numpy as np


def text(value):
    return value.decode().rstrip("\0") if isinstance(value, bytes) else str(value)


class Recording:
    def __init__(self, path):
        index, particles = h5py.File(f"{path}.cutproof.h5"), h5py.File(f"{path}.particles.vtkhdf")
        given = index["setup"]
        body, step, detect = given["body"].attrs, given["step"].attrs, given["detect"].attrs
        n = len(given["body/mass"])
        nodes, h = body["nodes"], float(body["spacing"])
        node = given["body/node"][:]
        place = np.stack([node % nodes[0], node // nodes[0] % nodes[1], node // (int(nodes[0]) * nodes[1])])
        rows = index["snapshots"]
        points = particles["VTKHDF/Points"]
        setup = types.SimpleNamespace(
            h=h, mass=given["body/mass"][:], rest=h * place.astype(float), edges=grid_edges(place),
            solver=text(step["solver"]), substeps=int(step["substeps"]), iterations=int(step["iterations"]),
            stiffness=float(step["stiffness"]), acceleration=text(step["acceleration"]), damping=float(step["damping"]),
            retardation=float(step.get("retardation", 0)),
            gravity=step["gravity"][:], criterion=text(detect["criterion"]), remove=text(detect["remove"]),
            epsilon=float(detect["epsilon"]), without_blade=bool(detect["without_blade"]),
            strain=float(detect["strain"]), debris=int(given["split"].attrs["debris"]),
            merge=text(given["merge"].attrs["rule"]), expand=text(given["expand"].attrs["rule"]),
            depth=int(given["expand"].attrs["depth"]),
            substep_length=given["substep_length"][:])
        setup.walls = [types.SimpleNamespace(axis=int(a), side=int(s), offset=float(o), friction=float(f)) for a, s, o, f in
                       zip(*(given[f"walls/{name}"][:] for name in ("axis", "side", "offset", "friction")))]
        setup.grips = grips(given["grips"])
        blade = given["blade"].attrs
        setup.moves = moves(given["blade_moves"]) if blade["present"] else []
        for name in ("length", "depth", "thickness", "friction"):
            setattr(setup, f"blade_{name}", float(blade[name]))
        self.setup, self.count, self.scene = setup, n, index["scene"][:].tobytes().decode()

        cover = index["clusters"]
        clusters = int(rows["cluster_count"][0])
        offsets = cover["offsets"][rows["offsets_row"][0]:][:clusters + 1]
        members = cover["members"][rows["members_row"][0]:][:int(rows["member_count"][0])]
        velocity, alive = particles["VTKHDF/PointData/velocity"], particles["VTKHDF/PointData/alive"]
        at = lambda table, column, k: table[int(rows[column][k]):int(rows[column][k]) + n]
        self.state = types.SimpleNamespace(
            x=at(points, "position_row", 0).T.copy(), v=at(velocity, "velocity_row", 0).T.copy(),
            alive=at(alive, "alive_row", 0) == 1, tau=int(rows["tau"][0]), cap=int(rows["cap"][0]),
            edge_covered=bool(rows["edge_covered"][0]),
            clusters=[members[offsets[c]:offsets[c + 1]].astype(int) for c in range(clusters)],
            rotations=cover["rotation"][rows["rotation_row"][0]:][:clusters].reshape(-1, 3, 3))

        # What the program has made of it: the last snapshot of each frame.
        self._points, self._alive = points, alive
        frame, stage = rows["frame"][:], rows["stage"][:]
        self._ends = [k for k in range(1, len(frame)) if stage[k] == 5]
        self._rows = {name: rows[name][:] for name in ("position_row", "alive_row", "cluster_count")}
        self.times = np.cumsum(setup.substep_length * setup.substeps)[:len(self._ends)]

    def after(self, frame):
        """Positions [3, n], who is alive, and the number of clusters."""
        k = self._ends[frame]
        row, alive = int(self._rows["position_row"][k]), int(self._rows["alive_row"][k])
        return (self._points[row:row + self.count].T, self._alive[alive:alive + self.count] == 1,
                int(self._rows["cluster_count"][k]))


def grid_edges(place):
    """Pairs of particles on neighbouring nodes."""
    at = {tuple(p): i for i, p in enumerate(place.T.tolist())}
    found = []
    for (i, j, k), particle in at.items():
        for other in ((i + 1, j, k), (i, j + 1, k), (i, j, k + 1)):
            if other in at:
                found.append((particle, at[other]))
    return np.array(found, int).reshape(-1, 2).T


def grips(group):
    tables = {name: (group[name][:], group[f"{name}_offsets"][:]) for name in ("particles", "active", "displacement")}
    cut = lambda name, g: tables[name][0][tables[name][1][g]:tables[name][1][g + 1]]
    return [types.SimpleNamespace(**{name: cut(name, g) for name in tables})
            for g in range(len(tables["particles"][1]) - 1)]


def moves(group):
    columns = {name: group[name][:] for name in ("from_edge", "from_along", "from_back", "to_edge", "to_along", "to_back",
                                                 "down")}
    pose = lambda end, k: tuple(columns[f"{end}_{part}"][k] for part in ("edge", "along", "back"))
    return [types.SimpleNamespace(before=pose("from", k), after=pose("to", k), down=bool(columns["down"][k]))
            for k in range(len(columns["down"]))]
