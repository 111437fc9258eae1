"""Setup and the state after each frame, from a recording of cutproof (docs/reference/recording.md)."""
import types

import h5py


class Recording:
    def __init__(self, path):
        self.index = h5py.File(f"{path}.cutproof.h5")
        self.points = h5py.File(f"{path}.particles.vtkhdf")["VTKHDF"]
        self.skin = h5py.File(f"{path}.skin.vtkhdf")["VTKHDF"]
        self.setup, self.rows = self.index["setup"], {k: v[:] for k, v in self.index["snapshots"].items()}
        self.count = len(self.setup["body/mass"])
        stage = self.rows["stage"]
        self.ends = [k for k in range(len(stage)) if stage[k] == 5]  # first the state as loaded, then each frame's last

    def state(self, frame):
        k, rows = self.ends[frame], self.rows

        def part(table, column, count):
            row = int(rows[column][k])
            return table[row:row + int(count)]

        data, skin, clusters = self.points["PointData"], self.skin["PointData"], self.index["clusters"]
        C, V, T = rows["cluster_count"][k], rows["vertex_count"][k], int(rows["triangle_count"][k])
        offsets = part(clusters["offsets"], "offsets_row", C + 1)
        members = part(clusters["members"], "members_row", rows["member_count"][k])
        triangle = 3 * int(rows["triangles_row"][k])
        listed = lambda name: rows[name][rows[f"{name}_offsets"][k]:rows[f"{name}_offsets"][k + 1]].tolist()
        return types.SimpleNamespace(
            frame=int(rows["frame"][k]), tau=int(rows["tau"][k]), cap=int(rows["cap"][k]),
            edge_covered=bool(rows["edge_covered"][k]), impulse=rows["impulse"][k],
            removed=listed("removed"), debris=listed("debris"),
            x=part(self.points["Points"], "position_row", self.count),
            v=part(data["velocity"], "velocity_row", self.count),
            alive=part(data["alive"], "alive_row", self.count) == 1,
            clusters=[members[a:b].tolist() for a, b in zip(offsets, offsets[1:])],
            numbers=part(clusters["number"], "number_row", C), centers=part(clusters["rest_center"], "rest_center_row", C),
            masses=part(clusters["mass"], "mass_row", C), rotations=part(clusters["rotation"], "rotation_row", C),
            flags=part(clusters["degenerate"], "degenerate_row", C) == 1,
            owner=part(skin["owner"], "owner_row", V), direction=part(skin["direction"], "direction_row", V),
            reach=part(skin["reach"], "reach_row", V), skin=part(self.skin["Points"], "skin_position_row", V),
            triangles=self.skin["Polygons/Connectivity"][triangle:triangle + 3 * T].reshape(-1, 3))
