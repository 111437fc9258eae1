"""cutproof.kick: the simulators of guests/examples/runs, right and with one solver for all pieces, and a global solve.

The environment names the program (CUTPROOF).
"""
import os
import pathlib
import sys
import unittest
import unittest.mock

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "guests" / "python"), str(ROOT / "tests" / "guests")]
import cutproof  # noqa: E402
import run_gallery_test as gallery  # noqa: E402

# Of the piece with particle 0, which falls freely: two kicks across the way of the blade, of the same length, and one
# away from the cut.
DIRECTIONS = [[0, 0.3, 0], [0, 0, -0.3], [-0.2, 0.1, 0]]
EQUAL = [0, 0, -1]


def kicked(name, fault=None, real=float):
    """What cutproof.kick takes, of a simulator of the gallery that is kicked once the blade has gone."""
    body, blade = gallery.small_scene(name)
    kicks = [None, *((gallery.WITHDRAWN + 1, np.array(each)) for each in DIRECTIONS)]
    runs = [gallery.simulated(name, dict(body, **({"kick": kick} if kick else {})), blade, fault) for kick in kicks]
    last = runs[0][-1]
    positions = np.full((4, gallery.FRAMES, len(last["positions"]), 3), np.nan)  # until a vertex is split off
    for k, run in enumerate(runs):
        for f, frame in enumerate(run):
            positions[k, f, :len(frame["positions"])] = frame["positions"]
    piece = last["labels"] if "labels" in last else gallery.pieces_of(last, body)
    return dict(positions=positions[0].astype(real), kicked=positions[1:].astype(real), piece=piece,
                mass=last.get("mass", body["mass"]), steps=body["steps"], directions=DIRECTIONS, equal=EQUAL,
                kicked_piece=piece[0])


def failed(document):
    return {verdict["property"] for verdict in document["verdicts"] if not verdict["holds"]}


class Kicks(unittest.TestCase):
    def failure(self, **arrays):
        with self.assertRaises(cutproof.Failed) as caught:
            cutproof.kick(**arrays)
        return str(caught.exception), failed(caught.exception.document)

    def test_right_simulators_hold_in_both_precisions(self):
        for name in gallery.PROGRAMS:
            for real in (float, np.float32):
                with self.subTest(f"{name} {real.__name__}"):
                    document = cutproof.kick(**kicked(name, real=real)).document
                    self.assertEqual(len(document["kicks"]), 3)
                    for each in document["kicks"]:
                        self.assertEqual([piece["of_kick"] for piece in each["pieces"]], [1, 0])
                        self.assertEqual(each["kick_frame"], gallery.WITHDRAWN + 1)
                    self.assertEqual({verdict["property"] for verdict in document["verdicts"] if verdict["checked"]},
                                     {"finite", "something was judged", "the kick was felt", "no ghost force",
                                      "the answer follows the kick", "equal answers"})
                    for verdict in document["verdicts"]:  # blunt tests would hold, too
                        if verdict["property"] == "equal answers":
                            self.assertLess(verdict["bound"], 1e-2 if real is np.float32 else 1e-11)

    def test_one_solver_for_all_pieces_is_felt(self):
        for name in gallery.PROGRAMS:
            with self.subTest(name):
                arrays = kicked(name, "global_solver")
                text, properties = self.failure(**arrays)
                self.assertIn("no ghost force", properties)
                self.assertIn("global coupling, 0.00", text)
                cutproof.kick(**arrays, tolerance=0.01)

    def test_a_piece_that_is_held_in_one_direction_answers_otherwise(self):
        for name in gallery.PROGRAMS:
            with self.subTest(name):
                arrays = kicked(name)
                arrays["kicked"][0] += 0.89 * (arrays["positions"] - arrays["kicked"][0])  # it goes 11 % of the way
                text, properties = self.failure(**arrays)
                self.assertEqual(properties, {"equal answers"})
                self.assertRegex(text, r"kick\s+1\s+moves\s+the\s+centre\s+of\s+piece\s+0\s+by\s+[0-9.e-]+\s+m")

    def test_a_kick_that_turns_back_is_found(self):
        arrays = kicked("springs")
        arrays["kicked"][2] = 2 * arrays["positions"] - arrays["kicked"][2]
        text, properties = self.failure(**arrays)
        self.assertEqual(properties, {"the answer follows the kick"})
        self.assertRegex(text, r"\(kick 2\) moves\s+against the kick")


def chains(push, solve):
    """Two chains of eight masses in the air, by implicit Euler's method; the second is pushed in frame 5."""
    n, dt, stiffness = 16, 0.01, 400.0
    laplacian = np.zeros((n, n))
    for i in range(n - 1):
        if i != 7:
            laplacian[i:i + 2, i:i + 2] += [[1, -1], [-1, 1]]
    x, v = np.zeros((n, 3)), np.zeros((n, 3))
    x[:, 0] = np.arange(n) + 0.1 * np.sin(np.arange(n))
    v[:, 2] = np.cos(np.arange(n))
    frames = []
    for frame in range(20):
        if frame == 5:
            v[8:, 1] += push
        matrix = np.eye(n) + dt**2 * stiffness * laplacian
        v = solve(matrix, v - dt * stiffness * laplacian @ (x - np.outer(np.arange(n), [1, 0, 0])))
        x = x + dt * v
        frames.append(x)
    return np.array(frames)


def conjugate_gradients(matrix, right, residual=1e-8):
    """Of all pieces and axes at once."""
    x, r = np.zeros_like(right), right.copy()
    p = r.copy()
    while (r * r).sum() > residual**2 * (right * right).sum():
        step = (r * r).sum() / (p * (matrix @ p)).sum()
        x, old = x + step * p, r
        r = r - step * (matrix @ p)
        p = r + (r * r).sum() / (old * old).sum() * p
    return x


def by_pieces(matrix, right):
    return np.concatenate([np.linalg.solve(matrix[k:k + 8, k:k + 8], right[k:k + 8]) for k in (0, 8)])


class GlobalSolvers(unittest.TestCase):
    def kick(self, solve, **arrays):
        return cutproof.kick(chains(0, solve), chains(1.0, solve), np.arange(16) // 8, again=chains(0, solve), **arrays)

    def test_a_solve_of_each_piece_is_felt_by_no_other(self):
        self.assertEqual(self.kick(by_pieces).document["kicks"][0]["pieces"][0]["of_kick"], 0)

    def test_a_solve_of_all_at_once_is_told_and_may_be_tolerated(self):
        with self.assertRaises(cutproof.Failed) as caught:
            self.kick(conjugate_gradients)
        self.assertEqual(failed(caught.exception.document), {"no ghost force"})
        share = caught.exception.document["kicks"][0]["pieces"][0]["of_kick"]
        self.assertGreater(share, 0)
        self.assertIn(f"global coupling, {share:.2g} of the kick", " ".join(str(caught.exception).split()))
        result = self.kick(conjugate_gradients, tolerance=1e-6)
        self.assertEqual(result.document["kicks"][0]["pieces"][0]["of_kick"], share)
        self.assertIn("Other pieces may feel 1e-06 of a kick", result.text)
        with self.assertRaises(cutproof.Failed):
            self.kick(conjugate_gradients, tolerance=share / 10)


class Arrays(unittest.TestCase):
    def test_what_cannot_be_understood_is_an_error(self):
        x = np.zeros((2, 2, 3))
        for words, arrays in (("Did you mean 'tolerance'", {"tolerence": 1e-6}), ("equal", {"equal": [0, 0]}),
                              ("less than 1", {"tolerance": 2.0})):
            with self.assertRaisesRegex(cutproof.Error, words):
                cutproof.kick(x, x, [0, 1], **arrays)

    def test_nothing_was_kicked(self):
        x = np.zeros((2, 2, 3))
        with self.assertRaises(cutproof.Failed) as caught:
            cutproof.kick(x, x, [0, 1], again=None)
        self.assertEqual(failed(caught.exception.document), {"the kick was felt"})
        self.assertIn("nothing was tested", str(caught.exception))
        self.assertNotIn("see it again", str(caught.exception))

    def test_another_program_is_an_error(self):
        x = np.zeros((1, 2, 3))
        with unittest.mock.patch.dict(os.environ, CUTPROOF="true"):
            with self.assertRaisesRegex(cutproof.Error, "is it cutproof"):
                cutproof.kick(x, x, [0, 1])

    def test_a_result_says_that_all_holds(self):
        x = np.zeros((2, 2, 3))
        moved = x.copy()
        moved[1, 1, 0] = 1
        self.assertEqual(repr(cutproof.kick(x, moved, [0, 1])), "<cutproof.Result: all hold>")


if __name__ == "__main__":
    unittest.main()
