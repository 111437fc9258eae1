"""Engines of npm, judged: docs/results/libraries.md says what is found. Usage: javascript_test.py PACKAGE

The programs of guests/examples/javascript print runs as lines of JSON, of which this makes files. What is right must
stay right; what is wrong must still be found, by the property that is named. Exit status 77, and the reason, where node
or the package is not installed. The environment names both programs (CUTPROOF, CUTPROOF_NODE).
"""
import json
import os
import subprocess
import sys
import unittest

import numpy

from run_test import ACROSS, ROOT, WITHIN, JudgedRuns
import cutproof
import cutproof_run

ENGINES = ROOT / "guests" / "examples" / "javascript"


class Engine(JudgedRuns):
    def lines(self, program, *options):
        """What a program prints: a dict of what is given once, then one for each frame."""
        done = subprocess.run([os.environ["CUTPROOF_NODE"], ENGINES / program, *options], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [json.loads(line) for line in done.stdout.splitlines()]

    def judged(self, program, *options):
        once, *frames = self.lines(program, *options)
        with cutproof_run.Writer(self.folder / "run", **once) as run:
            for frame in frames:
                run.frame(**frame)
        return self.check(self.folder / "run")

    def kicked(self, program, *options, by):
        """What cutproof.kick says of a kick of particle 0: whether it holds, and the piece that was not kicked."""
        once, *frames = self.lines(program, *options, "0")
        others = {name: [frame["positions"] for frame in self.lines(program, *options, kick)[1:]]
                  for name, kick in (("kicked", by), ("again", "0"))}
        piece = numpy.arange(len(once["rest"]))
        for _ in range(len(piece)):  # the smallest number to which groups lead
            for group in frames[-1]["groups"]:
                piece[group] = piece[group].min()
        try:
            document = cutproof.kick([frame["positions"] for frame in frames], piece=piece, kicked_piece=0,
                                     **others).document
        except cutproof.Failed as failed:
            document = failed.document
        pieces = document["kicks"][0]["pieces"]
        self.assertEqual(len(pieces), 2)
        return document["summary"]["holds"], pieces[1]

    def expect_to_hold(self, program):
        status, document, text = self.judged(program)
        self.assertEqual(status, 0, text)
        self.assertEqual((document["pieces"]["sure"], document["pieces"]["coupled"]), (2, 2), text)
        for wanted in (ACROSS, WITHIN, "no teleport", "linear momentum", "centre of mass"):
            self.assertIn(wanted, [verdict["property"] for verdict in document["verdicts"]])


class CannonEs(Engine):
    def test_a_cut_through_constraints_holds(self):
        self.expect_to_hold("cannon_cloth.mjs")

    def test_its_solver_ends_for_all_pieces_together(self):
        holds, other = self.kicked("cannon_cloth.mjs", "gs", "constraints", by="0.5")
        self.assertFalse(holds)
        self.assertGreater(other["felt"], 0)

    def test_the_solver_by_islands_does_not(self):
        holds, other = self.kicked("cannon_cloth.mjs", "split", "constraints", by="0.5")
        self.assertEqual((holds, other["felt"]), (True, 0), other)

    def test_constraints_of_removed_bodies_go_on_pulling(self):
        status, document, _ = self.judged("cannon_cloth.mjs", "gs", "bodies")
        self.assertEqual(status, 1)
        self.assertIn("linear momentum", self.failed(document))
        done = subprocess.run([os.environ["CUTPROOF_NODE"], ENGINES / "cannon_cloth.mjs", "split", "bodies"],
                              capture_output=True, text=True)
        self.assertIn("TypeError", done.stderr)


class MatterJs(Engine):
    def test_a_cut_through_constraints_holds(self):
        self.expect_to_hold("matter_soft_body.mjs")

    def test_no_piece_feels_a_kick_to_the_other(self):
        holds, other = self.kicked("matter_soft_body.mjs", by="0.2")
        self.assertEqual((holds, other["felt"]), (True, 0), other)


class MuJoCo(Engine):
    def test_a_cut_by_equalities_holds(self):
        self.expect_to_hold("mujoco_sheet.mjs")

    def test_its_solvers_end_for_all_pieces_together(self):
        for solver in ("Newton", "PGS", "CG"):
            with self.subTest(solver):
                holds, other = self.kicked("mujoco_sheet.mjs", solver, by="0.5")
                self.assertFalse(holds)
                self.assertGreater(other["felt"], 0)

    def test_conjugate_gradients_lose_momentum(self):
        status, document, _ = self.judged("mujoco_sheet.mjs", "CG")
        self.assertEqual((status, self.failed(document)), (1, ["linear momentum"]))


class ThreeJs(Engine):
    def judge(self, cases, *options):
        """What fails of the marching cubes, by property."""
        node = subprocess.Popen([os.environ["CUTPROOF_NODE"], ENGINES / "three_surface.mjs", *options], text=True,
                                stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.addCleanup(node.communicate)

        def surface(tissue, alive):
            volume = numpy.zeros(tissue.nodes, bool)
            volume[tuple(tissue.node[alive].T)] = True
            question = {"nodes": volume.shape, "tissue": numpy.flatnonzero(volume).tolist()}
            print(json.dumps(question), file=node.stdin, flush=True)
            answer = json.loads(node.stdout.readline())
            return (numpy.reshape(answer["vertices"], (-1, 3)) * tissue.spacing,
                    numpy.reshape(answer["triangles"], (-1, 3)).astype(int))

        try:
            cutproof.judge(surface=surface, cases=cases, sizes=(), shrink=5, save=self.folder)
        except cutproof.Failed as failed:
            return {each["property"]: each for each in failed.document["operations"][0]["failures"]}
        return {}

    def test_surfaces_join_what_meets_across_a_diagonal(self):
        failures = self.judge(2000)
        self.assertEqual(set(failures), {"surface shells"})
        self.assertEqual(failures["surface shells"]["size"], "2 particles")
        self.assertIn("It is right in the other polarity", failures["surface shells"]["shrunk"])

    def test_with_inside_and_outside_exchanged_they_are_right(self):
        self.assertEqual(self.judge(2000, "exchanged"), {})


PACKAGES = {"cannon-es": CannonEs, "matter-js": MatterJs, "mujoco-js": MuJoCo, "three": ThreeJs}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in PACKAGES:
        sys.exit(f"usage: javascript_test.py {'|'.join(PACKAGES)}")
    package = ENGINES / "node_modules" / sys.argv[1] / "package.json"
    if not os.environ.get("CUTPROOF_NODE") or not package.exists():
        print(f"SKIPPED: node, or its package {sys.argv[1]}, is not installed (ci/install.sh libraries)")
        sys.exit(77)
    print(f"{sys.argv[1]} {json.loads(package.read_text())['version']}")
    unittest.main(argv=sys.argv[:1], defaultTest=PACKAGES[sys.argv[1]].__name__)
