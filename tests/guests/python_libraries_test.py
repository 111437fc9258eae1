"""SciPy and scikit-image, judged: docs/results/libraries.md says what is found. Usage: python_libraries_test.py LIBRARY

What is right must stay right; what is wrong must still be found, with its witness. Exit status 77, and the reason,
where the library is not installed.
"""
import collections
import importlib
import sys
import tempfile
import unittest
import warnings

import numpy

from run_test import JudgedRuns
import cutproof
import cutproof_run


def judge(**options):
    with tempfile.TemporaryDirectory() as folder:
        return cutproof.judge(**{"save": folder, "shrink": 5, "sizes": (), **options})


class Library(unittest.TestCase):
    def failures(self, **options):
        """What fails, by property: the page is to be changed if that is nothing any more."""
        with self.assertRaises(cutproof.Failed) as caught:
            judge(**options)
        return {each["property"]: each for each in caught.exception.document["operations"][0]["failures"]}


def each(function):
    """Of one matrix at a time, in double precision; the previous rotation where nothing is known of one."""
    def rotations(a, previous):
        r = previous.copy()
        for k, matrix in enumerate(a):
            if numpy.isfinite(matrix).all() and matrix.any():
                r[k] = function(matrix.astype(numpy.float64))
        return r
    return rotations


def implicit_springs(solve, kick=0.0):
    """Springs on a grid by implicit Euler, cut in two: what is given once, and the frames. The linear system of all
    pieces is solved at once, for each axis: (M + dt² K) v' = M v - dt K (x - rest)."""
    from scipy.sparse import coo_matrix, identity
    from scipy.sparse.csgraph import connected_components, laplacian
    h, dt, mass, stiffness = 0.01, 0.01, 1e-3, 2.0
    nodes = numpy.indices((6, 3, 3)).reshape(3, -1).T
    rest, n = h * nodes, len(nodes)
    springs = numpy.argwhere(numpy.triu(abs(nodes[:, None] - nodes).sum(2) == 1))
    cut, x, frames = 2.5 * h, rest, []
    v = numpy.random.default_rng(1).normal(scale=0.05, size=(n, 3)) + [0.3, 0.2, 0.1]
    for frame in range(20):
        if frame == 10:
            v[0] += kick
        if frame > 0:
            graph = coo_matrix((numpy.ones(len(springs)), springs.T), (n, n))
            elastic = stiffness * laplacian(graph + graph.T)
            system, pushed = (mass * identity(n) + dt**2 * elastic).tocsc(), mass * v - dt * elastic @ (x - rest)
            v = numpy.stack([solve(system, pushed[:, axis]) for axis in range(3)], 1)
            x = x + dt * v
        blade = None
        if frame == 5:
            here = cut + (x - rest)[:, 0].mean()
            blade = [[[here, y, z] for y, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]]
            springs = springs[(rest[springs, 0] < cut).all(1) | (rest[springs, 0] > cut).all(1)]
        graph = coo_matrix((numpy.ones(len(springs)), springs.T), (n, n))
        frames.append(dict(positions=x, velocities=v.copy(), time=dt * frame, groups=springs, blade=blade,
                           piece=connected_components(graph, directed=False)[1]))
    return dict(rest=rest, mass=numpy.full(n, mass), spacing=h, promises="free"), frames


class SciPy(Library, JudgedRuns):
    def test_connected_components_is_right(self):
        from scipy.sparse import csr_matrix
        from scipy.sparse.csgraph import connected_components

        def components(tissue, alive):
            count = len(alive)
            begin = numpy.repeat(numpy.arange(count), numpy.diff(tissue.edge_offsets))
            living = alive[begin] & alive[tissue.edge_ends]
            graph = csr_matrix((living[living], (begin[living], tissue.edge_ends[living])), shape=(count, count))
            return connected_components(graph, directed=False)[1]

        result = judge(components=components, cases=2000, sizes=None)
        self.assertEqual(result.operations["components"]["refused"], 0)

    def test_label_is_right(self):
        from scipy.ndimage import label

        def components(tissue, alive):
            if tissue.node is None:
                raise cutproof.Refused
            volume = numpy.zeros(tissue.nodes, int)
            volume[tuple(tissue.node[alive].T)] = 1
            return label(volume)[0][tuple(tissue.node.T)]

        judged = judge(components=components, cases=2000).operations["components"]
        self.assertGreater(judged["questions"] - judged["refused"], 500)

    def test_align_vectors_is_right(self):
        from scipy.spatial.transform import Rotation
        warnings.simplefilter("ignore")  # several rotations may be best: that is what is asked
        # The rotation R that takes the axes nearest to the columns of A has the greatest tr(R'A).
        align = each(lambda a: Rotation.align_vectors(a.T, numpy.eye(3))[0].as_matrix())
        for precision in ("single", "double"):
            judge(rotations=align, cases=10000, precision=precision)

    def test_polar_gives_reflections(self):
        from scipy.linalg import polar
        failures = self.failures(rotations=each(lambda a: polar(a)[0]), cases=5000)
        self.assertEqual(set(failures), {"rotation"})
        self.assertIn("a reflection", failures["rotation"]["shrunk"])
        # As it says: orthogonal, with the sign of the determinant.
        self.assertLess(numpy.linalg.det(polar(numpy.diag([1.0, 1.0, -1.0]))[0]), 0)

    def test_polar_is_right_where_it_gives_a_rotation(self):
        from scipy.linalg import polar

        def rotation(a):
            u = polar(a)[0]
            if numpy.linalg.det(u) < 0:
                left, _, right = numpy.linalg.svd(a)
                left[:, 2] *= numpy.linalg.det(left) * numpy.linalg.det(right)
                u = left @ right
            return u

        for precision in ("single", "double"):
            judge(rotations=each(rotation), cases=10000, precision=precision)

    def judged_run(self, solve):
        once, frames = implicit_springs(solve)
        with cutproof_run.Writer(self.folder / "run", **once) as run:
            for frame in frames:
                run.frame(**frame)
        return self.check(self.folder / "run")

    def felt(self, solve):
        """By how many particles of the other piece a kick of particle 0 is felt."""
        kicked, plain = implicit_springs(solve, 0.1)[1], implicit_springs(solve)[1]
        off = [(one["positions"] != other["positions"]).any(1) for one, other in zip(kicked, plain)]
        return numpy.any(off, 0)[plain[-1]["piece"] != plain[-1]["piece"][0]].sum()

    def test_a_run_by_spsolve_holds(self):
        from scipy.sparse.linalg import spsolve
        status, document, text = self.judged_run(spsolve)
        self.assertEqual(status, 0, text)
        judged = {verdict["property"] for verdict in document["verdicts"]}
        self.assertLessEqual({"linear momentum", "centre of mass", "no coupling across pieces", "pieces coupled within",
                              "pieces as said"}, judged)
        self.assertEqual(self.felt(spsolve), 0)

    def test_conjugate_gradients_lose_momentum_and_couple_pieces(self):
        from scipy.sparse.linalg import cg

        def solve(system, pushed):
            return cg(system, pushed)[0]

        status, document, _ = self.judged_run(solve)
        self.assertEqual((status, self.failed(document)), (1, ["linear momentum"]))
        self.assertEqual(self.felt(solve), 27)


def marching_cubes(method, direction, inside=1.0, value=None):
    """A surface around a volume: `inside` where tissue lives and 1 - inside elsewhere, or what `value` makes of it."""
    from skimage.measure import marching_cubes as march

    def surface(tissue, alive):
        if not alive.any():
            return [], []
        volume = numpy.zeros(tissue.nodes, numpy.float32)
        volume[tuple(tissue.node[alive].T)] = 1
        volume = value(volume) if value else volume if inside == 1 else 1 - volume
        return march(volume, 0.5, spacing=(tissue.spacing,) * 3, method=method, gradient_direction=direction)[:2]
    return surface


class ScikitImage(Library):
    def test_lorensen_is_right_with_the_other_direction_than_the_default(self):
        judge(surface=marching_cubes("lorensen", "ascent"), cases=2000)
        failures = self.failures(surface=marching_cubes("lorensen", "descent"), cases=200)
        self.assertEqual(set(failures), {"surface shells"})
        self.assertEqual(failures["surface shells"]["size"], "1 particle")
        self.assertIn("1 shells are inside out", failures["surface shells"]["shrunk"])

    def test_lorensen_with_inside_and_outside_exchanged_has_the_other_polarity(self):
        failures = self.failures(surface=marching_cubes("lorensen", "descent", inside=0.0), cases=200)
        self.assertEqual(set(failures), {"surface shells"})
        self.assertEqual(failures["surface shells"]["size"], "2 particles")
        self.assertIn("It is right in the other polarity", failures["surface shells"]["shrunk"])

    def test_lewiner_is_no_manifold_where_its_decision_is_a_tie(self):
        failures = self.failures(surface=marching_cubes("lewiner", "ascent"), cases=60)
        self.assertEqual(set(failures), {"surface", "surface vertices", "surface shells"})
        self.assertEqual(failures["surface"]["size"], "4 particles")
        self.assertIn("both run from vertex", failures["surface"]["shrunk"])
        # Its own vertices inside of cells are no error, but not on edges of the grid.
        self.assertIn("lies between the ends of no edge", failures["surface vertices"]["shrunk"])
        self.assertIn("It is right in the other polarity", failures["surface shells"]["shrunk"])

    def test_the_witness_by_itself(self):
        from skimage.measure import marching_cubes as march
        volume = numpy.zeros((4, 4, 5), numpy.float32)
        for node in ((1, 1, 1), (1, 1, 3), (1, 2, 2), (2, 1, 2)):
            volume[node] = 1
        _, triangles, _, _ = march(volume, 0.5)
        edges = collections.Counter(tuple(sorted(pair)) for a, b, c in triangles for pair in ((a, b), (b, c), (c, a)))
        self.assertEqual(sorted(set(edges.values())), [2, 4])
        self.assertEqual(sum(count == 4 for count in edges.values()), 3)

    def test_lewiner_is_closed_where_nothing_is_a_tie(self):
        random = numpy.random.default_rng(1)

        def any_values(volume):
            return numpy.where(volume == 1, random.uniform(0.6, 1, volume.shape),
                               random.uniform(0, 0.4, volume.shape)).astype(numpy.float32)

        with self.assertRaises(cutproof.Failed) as caught:
            judge(surface=marching_cubes("lewiner", "ascent", value=any_values), cases=2000, shrink=0)
        found = {each["property"]: each for each in caught.exception.document["operations"][0]["properties"]}
        self.assertEqual(found["surface"]["failed"], 0)
        self.assertGreater(found["surface"]["checked"], 100000)


LIBRARIES = {"scipy": SciPy, "skimage": ScikitImage}

if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] not in LIBRARIES:
        sys.exit(f"usage: python_libraries_test.py {'|'.join(LIBRARIES)}")
    try:
        version = importlib.import_module(sys.argv[1]).__version__
    except ImportError as why:
        print(f"SKIPPED: {why}")
        sys.exit(77)
    print(f"{sys.argv[1]} {version}")
    unittest.main(argv=sys.argv[:1], defaultTest=LIBRARIES[sys.argv[1]].__name__)
