"""A recording of this project as a run of anybody's simulator: the judge of runs accepts it, and finds what is planted in
it. The environment names the program (CUTPROOF).
"""
import os
import subprocess
import unittest

import h5py
import numpy

from run_test import ACROSS, WITHIN, JudgedRuns
import cutproof_run

SKIN = 5  # the stage with which a frame ends


def from_recording(name, run_path, fault=None):
    """What docs/reference/recording.md lists, by the names of docs/reference/run.md."""
    with h5py.File(f"{name}.cutproof.h5") as index, h5py.File(f"{name}.particles.vtkhdf") as particles:
        setup, at, clusters = index["setup"], index["snapshots"], index["clusters"]
        body, step, moves = setup["body"].attrs, setup["step"].attrs, setup["blade_moves"]
        counts, mass = body["nodes"], setup["body/mass"][:]
        nodes = numpy.stack(numpy.unravel_index(setup["body/node"][:], counts, order="F"), 1)
        steps, n = int(step["substeps"]), len(mass)
        length, back = (setup["blade"].attrs[of] for of in ("length", "depth"))

        def rows(table, row, count=n):
            return table[at[row][snapshot]:at[row][snapshot] + count]

        def plate(when, substep):
            """Corners of the blade's mid-surface."""
            edge, along, up = (moves[f"{when}_{of}"][substep] for of in ("edge", "along", "back"))
            ends = edge - along * length / 2, edge + along * length / 2
            return numpy.array([ends[0], ends[1], ends[1] + up * back, ends[0] + up * back])

        once = dict(rest=nodes * body["spacing"], mass=mass, spacing=body["spacing"], nodes=nodes, steps=steps,
                    gravity=step["gravity"], damping=step["damping"],
                    cut_resolution=2 * body["spacing"] + setup["blade"].attrs["thickness"],
                    unit_roundoff=index.attrs["unit_roundoff"])
        time, removed = 0.0, numpy.zeros(n, int)
        with cutproof_run.Writer(run_path, **once) as run:
            for snapshot in range(len(at["frame"])):
                removed[at["removed"][at["removed_offsets"][snapshot]:at["removed_offsets"][snapshot + 1]]] = 1
                if at["stage"][snapshot] != SKIN:
                    continue
                frame, blade = int(at["frame"][snapshot]), numpy.full((2, 4, 3), numpy.nan)
                if frame > 0:
                    time += steps * setup["substep_length"][frame - 1]
                    first, last = (frame - 1) * steps, frame * steps - 1
                    if moves["down"][first] or moves["down"][last]:
                        was, now = plate("from", first), plate("to", last)
                        blade = [now, [was[0], was[1], now[1], now[0]]]  # the plate, and what its edge has swept
                offsets = rows(clusters["offsets"], "offsets_row", at["cluster_count"][snapshot] + 1)
                groups = offsets, rows(clusters["members"], "members_row", at["member_count"][snapshot])
                if fault == "whole clusters":
                    groups = kept = groups if frame == 0 else kept
                run.frame(rows(particles["VTKHDF/Points"], "position_row"), time=time, groups=groups, removed=removed,
                          velocities=rows(particles["VTKHDF/PointData/velocity"], "velocity_row"), blade=blade,
                          alive=rows(particles["VTKHDF/PointData/alive"], "alive_row"),
                          contact_impulse=at["impulse"][snapshot] * (fault != "no impulse"))


class RecordedRuns(JudgedRuns):
    def judged(self, scene, fault=None):
        name = self.folder / "recording"
        if not (self.folder / "recording.cutproof.h5").exists():
            subprocess.run([os.environ["CUTPROOF"], "run", scene, "--record", name], check=True,
                           stdout=subprocess.DEVNULL)
        from_recording(name, self.folder / "run.h5", fault)
        return self.check(self.folder / "run.h5")

    def test_a_recording_holds_and_what_is_planted_in_it_does_not(self):
        status, document, text = self.judged("small_block")
        self.assertEqual(status, 0, text)
        judged = {verdict["property"] for verdict in document["verdicts"]}
        self.assertLessEqual({ACROSS, WITHIN, "linear momentum", "what is gone stays gone", "something was cut"}, judged)
        for fault, wanted in (("no impulse", "linear momentum"), ("whole clusters", ACROSS)):
            with self.subTest(fault):
                status, document, _ = self.judged("small_block", fault)
                self.assertEqual(status, 1)
                self.assertIn(wanted, self.failed(document))


if __name__ == "__main__":
    unittest.main(verbosity=2)
