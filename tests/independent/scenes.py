"""Small scenes that reach the requirements of docs/design/method.md. Those in SHORT run in every build."""
import math


def block(x, y, z, **more):
    return {"shape": {"kind": "box", "size": [0.01 * x, 0.01 * y, 0.01 * z]}, "spacing": 0.01, **more}


def stroke(*points, **more):
    return {"points": [list(p) for p in points], **more}


PRESS = [stroke((0.5, 0.5, 1.1), (0.5, 0.5, -0.15), along=[0, 1, 0])]
ZIGZAG = [stroke((-0.1, 0.5, -0.1), (0.5, 0.5, -0.1), (0.5, 1.1, -0.1), (0.2, 1.1, -0.1), (0.2, -0.3, -0.1))]
TURNS = [stroke((-0.2, 0.5, -0.2), (0.3, 0.5, -0.2), (0.6, 1.1, -0.2), (0.2, 0.9, -0.2), (0.2, -0.1, -0.2))]
ENDS = [{"low": [0, 0, 0], "high": [0.12, 1, 1]}, {"low": [0.88, 0, 0], "high": [1, 1, 1]}]
DOWN = {"gravity": [0, 0, -9.81]}



def prism(ends, height, turn):
    """An OBJ file of a straight or tapered prism; corners (x, y) of both ends, counter-clockwise; turned by an angle."""
    n, angle = len(ends[0]), [math.cos(turn), math.sin(turn)]
    points = [(x, y, z) for end, z in zip(ends, (0, height)) for x, y in end]
    for a, b in ((0, 1), (1, 2)):
        points = [tuple(angle[0] * p[a] - angle[1] * p[b] if k == a else angle[1] * p[a] + angle[0] * p[b] if k == b else p[k]
                        for k in range(3)) for p in points]
    faces = [(0, k + 1, k) for k in range(1, n - 1)] + [(n, n + k, n + k + 1) for k in range(1, n - 1)]
    faces += [f for k in range(n) for f in ((k, (k + 1) % n, n + k), ((k + 1) % n, n + (k + 1) % n, n + k))]
    return "".join("v %r %r %r\n" % p for p in points) + "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces)


def mesh_scene(align, **more):
    return {"body": {"mesh": {"file": "body.obj", "unit": 0.001}, "spacing": 0.0093, "align": align}, "clusters": {"side": 3}, "frame": {"count": 3},
            "step": DOWN, "ground": {}, "blade": {"speed": 2, "strokes": [stroke((0.5, 0.5, 1.1), (0.45, 0.5, -0.1), along=[0, 1, 0])]}, **more}


def polygon(n, radius):
    return [(radius * math.cos(2 * math.pi * k / n), radius * math.sin(2 * math.pi * k / n)) for k in range(n)]


RECTANGLE = [(0, 0), (80, 0), (80, 50), (0, 50)]
MESHES = {  # beside the scene of the same name, as body.obj
    "wedge": prism([RECTANGLE, [(0, 0), (40, 5), (35, 40), (0, 50)]], 30, 0.7),
    "wedge_as_given": prism([RECTANGLE, [(0, 0), (40, 5), (35, 40), (0, 50)]], 30, 0.7),
    "brick": prism([RECTANGLE, RECTANGLE], 30, 0.4),
    "long_prism": prism([polygon(3, 32)] * 2, 90, 0.5),  # two equal moments: the lesser ones
    "flat_prism": prism([polygon(3, 45)] * 2, 25, 2.1),  # the greater ones
    "cube": prism([polygon(4, 35)] * 2, 35 * 2**0.5, 0.3),
}

SCENES = {
    **{name: mesh_scene(name != "wedge_as_given") for name in MESHES},
    # friction of walls and blade, Chebyshev, `nearer`, cut vertices
    "friction": {
        "body": block(10, 5, 4), "clusters": {"side": 3}, "frame": {"count": 12},
        "step": {"gravity": [0.5, 0.3, -9.81], "damping": 2}, "ground": {"friction": 0.5},
        "walls": [{"axis": 0, "side": 1, "offset": -0.01, "friction": 0.3}, {"axis": 1, "side": -1, "offset": 1.001, "friction": 0.2}],
        "blade": {"thickness": 0.5, "friction": 0.4, "speed": 0.4, "strokes": PRESS}},
    # blade and walls in turn, without friction: refusals
    "frictionless": {
        "body": block(10, 5, 4), "clusters": {"side": 3}, "frame": {"count": 14}, "step": DOWN, "ground": {}, "detect": {"epsilon": 1.8},
        "blade": {"speed": 0.6, "strokes": [stroke((0.5, 0.5, 1.1), (0.45, 0.6, -0.15), along=[0.2, 1, 0], back=[0.1, 0, 1])]}},
    "between_walls": {
        "body": block(8, 5, 3), "clusters": {"side": 3}, "step": {**DOWN, "iterations": 6, "stiffness": 2e4}, "detect": {"criterion": "none"},
        "ground": {}, "walls": [{"axis": 0, "side": 1}, {"axis": 0, "side": -1, "offset": 1.0}, {"axis": 2, "side": -1, "offset": 1.1}],
        "blade": {"speed": 0.5, "thickness": 2, "depth": 0.4,
                  "strokes": [stroke((0.4, 0.5, 1.3), (0.5, 0.5, 0.2), along=[0.1, 1, 0.3], back=[0.3, 0, 1])]}},
    "pushed_around": {
        "body": block(6, 5, 4), "clusters": {"side": 3}, "step": {**DOWN, "iterations": 8, "acceleration": "none"}, "ground": {},
        "detect": {"criterion": "none"}, "walls": [{"axis": 0, "side": 1}, {"axis": 0, "side": -1, "offset": 1.0}, {"axis": 1, "side": 1}],
        "blade": {"speed": 0.9, "length": 0.5, "depth": 0.3, "strokes": [
            stroke((-0.2, 0.3, -0.3), (0.6, 0.6, 0.5), (0.4, 0.3, 0.2), (0.1, 0.1, 0), along=[0.3, 1, -0.3])]}},
    # acceleration beside a wall without friction, while another has some
    "mixed_walls": {
        "body": block(6, 4, 3), "clusters": {"side": 3}, "frame": {"count": 12}, "step": {"gravity": [3, 1, -9.81], "iterations": 6},
        "ground": {"friction": 0.3}, "walls": [{"axis": 0, "side": -1, "offset": 1.02}, {"axis": 1, "side": -1, "offset": 1.0}]},
    "smooth_walls": {
        "body": block(6, 4, 3), "clusters": {"side": 3}, "frame": {"count": 12}, "step": {"gravity": [3, 1, -9.81], "iterations": 6},
        "ground": {}, "walls": [{"axis": 0, "side": -1, "offset": 1.02}, {"axis": 1, "side": -1, "offset": 1.0}]},
    # retardation; grips that move, start, end, and hold a layer
    "retardation": {
        "body": block(8, 5, 5), "clusters": {"side": 3}, "frame": {"count": 14}, "step": {**DOWN, "retardation": 0.004}, "ground": {"friction": 0.2},
        "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "end": 0.1, "velocity": [0, 0, 0.2]},
                  {"low": [0.95, -0.2, 0], "high": [1.1, -0.1, 1], "velocity": [0.1, 0, 0], "start": 0.03}],
        "blade": {"speed": 0.8, "start": 0.03, "friction": 0.1, "strokes": PRESS}},
    "retardation_smooth": {
        "body": block(6, 4, 3), "clusters": {"side": 3}, "frame": {"count": 10},
        "step": {**DOWN, "retardation": 0.02, "acceleration": "none", "damping": 1, "stiffness": 3e4}, "ground": {},
        "detect": {"remove": "both", "epsilon": 1.3}, "blade": {"speed": 0.8, "strokes": PRESS}},
    # volume kept: with everything that acts; in a layer and a rod; wildly stretched
    "volume": {
        "body": block(8, 5, 5), "clusters": {"side": 3}, "frame": {"count": 12}, "step": {**DOWN, "volume_share": 0.9, "retardation": 0.002},
        "ground": {"friction": 0.2}, "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "end": 0.1, "velocity": [0, 0, 0.2]}],
        "blade": {"speed": 0.8, "start": 0.03, "friction": 0.1, "strokes": PRESS}},
    "volume_of_sheets": {
        "body": block(8, 5, 1), "clusters": {"side": 3}, "frame": {"count": 8}, "step": {**DOWN, "volume_share": 0.8},
        "detect": {"criterion": "none"}, "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1]}]},
    "volume_stretched": {
        "body": block(8, 4, 4), "clusters": {"method": "tiles", "side": 2}, "frame": {"count": 10}, "step": {"volume_share": 0.94, "stiffness": 1e6, "iterations": 8},
        "detect": {"criterion": "none"}, "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "velocity": [-0.2, 0, 0]},
                                                   {"low": [0.9, 0, 0], "high": [1, 1, 1], "velocity": [0.2, 0, 0.1]}]},
    # a rounded body, cut
    "tiles": {
        "body": {"shape": {"kind": "kidney", "size": [0.1, 0.06, 0.05]}, "spacing": 0.008}, "frame": {"count": 14},
        "clusters": {"method": "tiles", "side": 2}, "step": {**DOWN, "volume_share": 0.93, "stiffness": 2e5},
        "ground": {}, "blade": {"speed": 0.8, "strokes": PRESS}},
    "grips_alone": {
        "body": block(8, 4, 3), "clusters": {"side": 2, "cap": 1.2, "small": 0.9}, "frame": {"settle": 0.05},
        "step": {"acceleration": "none", "substeps": 3, "iterations": 5}, "merge": {"rule": "published"}, "expand": {"rule": "published"},
        "detect": {"without_blade": True, "remove": "one", "epsilon": 1.2},
        "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "end": 0.1, "velocity": [-0.4, 0.1, 0]},
                  {"low": [0.9, 0, 0], "high": [1, 1, 1], "start": 0.22}]},
    "grips_after_strokes": {
        "body": block(8, 4, 3), "clusters": {"side": 3}, "frame": {"settle": 0.1}, "step": {"damping": 4}, "blade": {"speed": 2, "strokes": PRESS},
        "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "end": 0.05, "after_strokes": True, "start": 0.01, "velocity": [-0.2, 0, 0]},
                  {"low": [0.9, 0, 0], "high": [1, 1, 1], "start": 0.02}, {"low": [0.9, -0.5, 0.2], "high": [0.97, -0.3, 0.5], "end": 0.01},
                  {"low": [0.5, -0.5, 0.2], "high": [0.7, -0.3, 0.5], "end": 0.03, "velocity": [0, 0, 0.1]}]},
    # sampled clusters, expanded at cooking; an organ; turns at corners; debris; no merging
    "sampled": {
        "seed": 7, "body": {"shape": {"kind": "kidney", "size": [0.11, 0.06, 0.05]}, "spacing": 0.0085}, "frame": {"count": 16},
        "clusters": {"method": "sampled", "spacing": 2, "radius": 2}, "step": {"iterations": 6, "stiffness": 2e6, "damping": 5},
        "detect": {"remove": "both"}, "split": {"debris": 8}, "merge": {"rule": "none"},
        "grips": [ENDS[0], {"low": [0.9, 0, 0], "high": [1, 1, 1], "velocity": [0.1, 0, 0]}],
        "blade": {"length": 0.3, "depth": 2, "thickness": 0.5, "speed": 1, "strokes": [
            stroke((0.2, -0.1, 0.25), (0.27, 0.45, 0.25), (0.36, 0.15, 0.25), (0.4, 0.6, 0.25), (0.5, 0.3, 0.25), (0.8, 0.9, 0.25))]}},
    "sampled_deep": {
        "seed": 11, "body": block(9, 6, 5), "clusters": {"method": "sampled", "spacing": 2.3, "radius": 2.3, "small": 0.9}, "frame": {"count": 8},
        "expand": {"depth": 2}, "detect": {"criterion": "geometric"}, "blade": {"speed": 0.6, "strokes": PRESS}},
    "sampled_published": {
        "seed": 3, "body": block(9, 6, 5), "clusters": {"method": "sampled", "spacing": 2.3, "radius": 2.5, "small": 0.9}, "frame": {"count": 14},
        "step": {**DOWN, "solver": "published", "relaxation": 0.4}, "detect": {"remove": "one"}, "merge": {"rule": "published"},
        "expand": {"rule": "published", "depth": 2}, "ground": {"friction": 0.3},
        "blade": {"speed": 0.5, "strokes": [stroke((0.3, 0.5, 1.1), (0.3, 0.5, -0.1), along=[0, 1, 0], pause=0.02),
                                            stroke((0.7, 0.5, 1.1), (0.6, 0.5, -0.1), along=[0, 1, 0])]}},
    # given clusters become covered after the first cut
    "sampled_uncovered": {
        "seed": 5, "body": block(9, 5, 4), "clusters": {"method": "sampled", "spacing": 2, "radius": 2, "small": 1, "cap": 2}, "frame": {"count": 8},
        "expand": {"rule": "published", "depth": 3}, "detect": {"criterion": "geometric"}, "blade": {"length": 0.4, "speed": 0.8, "strokes": ZIGZAG}},
    # a cluster that is isolated by a cut; unions of exactly `cap` particles
    "isolated": {
        "seed": 12, "body": block(8, 4, 3), "clusters": {"method": "sampled", "spacing": 1.5, "radius": 1.5}, "frame": {"count": 8},
        "merge": {"rule": "none"}, "expand": {"rule": "published", "depth": 2}, "detect": {"criterion": "geometric"},
        "blade": {"length": 0.4, "speed": 0.8, "strokes": ZIGZAG}},
    "filled": {"body": block(9, 5, 4), "clusters": {"side": 2, "small": 1.0, "cap": 1.2}, "frame": {"count": 1}},
    # arcs: with contacts, turning fast, tilted, and geometric
    "arc": {
        "body": {"shape": {"kind": "liver", "size": [0.11, 0.07, 0.06]}, "spacing": 0.0088}, "clusters": {"side": 3}, "frame": {"settle": 0.03},
        "step": {"damping": 5}, "grips": ENDS, "blade": {"length": 0.5, "depth": 1.6, "thickness": 0.5, "speed": 1.5, "friction": 0.3, "strokes": [
            stroke((0.4, -0.3, -0.3), (0.6, 0.5, -0.3), (0.4, 1.3, -0.3), curve="arc")]}},
    "arc_fast": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "frame": {"settle": 0.03}, "step": {"damping": 3}, "detect": {"remove": "one"},
        "blade": {"length": 0.4, "speed": 12, "friction": 0.5, "strokes": [
            stroke((-0.1, -0.1, -0.1), (0.5, 0.5, -0.1), (-0.1, 1.1, -0.2), curve="arc", back=[0.2, 0.1, 1])]}},
    "arc_geometric": {
        "body": {"shape": {"kind": "capsule", "radius": 0.03, "length": 0.05, "along": [1, 0.2, 0]}, "spacing": 0.009}, "clusters": {"side": 3},
        "frame": {"settle": 0.03}, "detect": {"criterion": "geometric"}, "blade": {"length": 0.5, "depth": 1.6, "thickness": 0.5, "speed": 1.5, "strokes": [
            stroke((0.4, -0.3, -0.3), (0.6, 0.5, -0.2), (0.4, 1.3, -0.3), curve="arc", back=[0.2, 0.1, 1])]}},
    # corners of 90° and others
    "corners": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "split": {"debris": 10}, "step": {"iterations": 3},
        "blade": {"length": 0.2, "speed": 0.9, "strokes": ZIGZAG}},
    "corners_geometric": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "detect": {"criterion": "geometric"}, "split": {"debris": 10},
        "blade": {"length": 0.2, "speed": 0.9, "strokes": ZIGZAG}},
    "turning_friction": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "step": {"iterations": 6}, "detect": {"criterion": "none"}, "ground": {"friction": 0.4},
        "frame": {"count": 12}, "blade": {"length": 0.3, "speed": 0.9, "friction": 0.6, "strokes": TURNS}},
    "turning_fast": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "step": {"iterations": 6}, "blade": {"length": 0.9, "speed": 4, "friction": 0.6, "strokes": TURNS}},
    "longest_piece": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "detect": {"criterion": "geometric"}, "blade": {"length": 0.2, "speed": 0.4, "strokes": [
            stroke((0.1, 0.2, -0.1), (0.395, 0.2, -0.1), (0.694, 0.2, -0.1), (0.8, 0.2, 0.4), along=[0.2, 1, 0.1])]}},
    "divided_and_counted": {
        "body": block(8, 6, 3), "clusters": {"side": 3}, "frame": {"count": 6}, "blade": {"speed": 6, "start": 0.016, "strokes": PRESS}},
    # strain, with and without a blade
    "strain": {
        "body": block(10, 4, 4), "clusters": {"side": 3}, "frame": {"count": 16}, "step": {"stiffness": 2e4},
        "detect": {"criterion": "strain", "strain": 1.25, "without_blade": True},
        "grips": [ENDS[0], {**ENDS[1], "velocity": [0.8, 0, 0], "end": 0.15}]},
    "strain_blade": {
        "body": block(8, 5, 4), "clusters": {"side": 3}, "ground": {"friction": 0.3}, "step": {"stiffness": 2e4},
        "detect": {"criterion": "strain", "strain": 1.05}, "blade": {"speed": 0.8, "strokes": PRESS}},
    # a tilted ground; detection in every substep; debris
    "tilted": {
        "body": block(8, 5, 3), "clusters": {"side": 3}, "frame": {"count": 9}, "step": {"gravity": [3, 1, -9], "damping": 1},
        "ground": {"friction": 0.3, "offset": -0.05}, "detect": {"every": "substep"}, "split": {"debris": 20},
        "blade": {"speed": 0.9, "friction": 0.2, "strokes": PRESS}},
    "debris": {
        "body": block(9, 5, 4), "clusters": {"side": 2, "small": 1.0, "cap": 3}, "split": {"debris": 60}, "frame": {"settle": 0.03},
        "blade": {"speed": 1.4, "strokes": [stroke((0.25, 0.5, 1.1), (0.25, 0.5, -0.1), along=[0, 1, 0], pause=0.01),
                                            stroke((0.5, 0.5, 1.1), (0.7, 0.5, -0.1), along=[0, 1, 0])]}},
    # a core in two parts; a blade that begins inside tissue; tissue that falls through a plate within a substep
    "fork": {
        "body": {"shape": {"kind": "difference", "parts": [{"kind": "box", "size": [0.12, 0.05, 0.05]}, {
            "kind": "box", "size": [0.1001, 0.01, 0.1], "center": [0.01, 0, 0]}]}, "spacing": 0.01},
        "frame": {"count": 8}, "step": DOWN, "ground": {"friction": 0.3}, "detect": {"epsilon": 1.4}, "blade": {"speed": 0.7, "strokes": [
            stroke((0.45, 0.5, 1.1), (0.55, 0.5, -0.15), along=[0, 1, 0])]}},
    "begun_inside": {
        "body": block(7, 5, 4), "clusters": {"side": 3}, "step": {"iterations": 6}, "detect": {"criterion": "none"}, "blade": {
            "speed": 0.9, "length": 0.7, "depth": 0.6, "strokes": [stroke((0.48, 0.5, 0.4), (0.8, 0.5, 0.3), along=[0.02, 1, 0])]}},
    "fallen": {
        "body": block(6, 5, 3), "clusters": {"side": 3}, "frame": {"count": 5}, "step": {"gravity": [5, 0, -150]}, "detect": {"criterion": "none"},
        "blade": {"length": 0.8, "depth": 0.7, "speed": 0.02, "strokes": [stroke((0.1, 0.5, -1.1), (0.12, 0.5, -1.1), along=[0, 1, 0], back=[1, 0, 0])]}},
    # nodes on surfaces, in numbers that are exact
    "on_surfaces": {
        "body": {"shape": {"kind": "difference", "parts": [{"kind": "union", "parts": [
            {"kind": "box", "size": [8 / 128, 4 / 128, 4 / 128]}, {"kind": "box", "size": [3 / 128] * 3, "center": [5 / 128, 0, 0]}]},
            {"kind": "box", "size": [3 / 128] * 3, "center": [0, 0, 2 / 128]}]}, "spacing": 1 / 128},
        "clusters": {"side": 3}, "frame": {"count": 2}, "step": DOWN, "ground": {}},
    # cubes that touch along an edge and at a corner: ambiguous faces
    "diagonal": {
        "body": {"shape": {"kind": "union", "parts": [{"kind": "box", "size": [0.03, 0.03, 0.03], "center": c} for c in (
            [0, 0, 0], [0.03, 0.03, 0], [0, 0.03, 0.03], [0.06, 0, 0.03])]}, "spacing": 0.01}, "clusters": {"side": 3}, "frame": {"count": 3},
        "step": DOWN, "ground": {}, "detect": {"criterion": "geometric"}, "blade": {"speed": 1.2, "strokes": PRESS}},
    # a union without a ball; a skin without cut vertices, or without the body's surface, or none
    "shapes": {
        "body": {"shape": {"kind": "difference", "parts": [{"kind": "union", "parts": [
            {"kind": "torus", "radius": 0.03, "tube": 0.0151, "along": [0, 1, 0]},
            {"kind": "cylinder", "radius": 0.0153, "length": 0.05, "along": [0.3, 0.1, 1], "center": [0.045, 0, 0]}]},
            {"kind": "ball", "radius": 0.012, "center": [0.03, 0, 0.01]}]}, "spacing": 0.0083},
        "clusters": {"side": 3}, "frame": {"count": 10}, "step": DOWN, "ground": {"friction": 1.5}, "skin": {"alpha": 0.3, "fit_cuts": False},
        "detect": {"remove": "both"}, "blade": {"speed": 1, "strokes": PRESS}},
    "alpha": {
        "body": block(6, 5, 4, fit_skin=False), "clusters": {"side": 3}, "skin": {"alpha": 0.3}, "detect": {"criterion": "geometric"}, "step": DOWN,
        "ground": {"offset": -0.2}, "blade": {"speed": 3, "strokes": [stroke((0.5, 0.5, 1.1), (0.4, 0.5, -0.1), along=[0, 1, 0])]}},
    "slanted_skin": {
        "body": {"shape": {"kind": "ball", "radius": 0.041}, "spacing": 0.01}, "clusters": {"side": 3}, "step": {"damping": 20, "stiffness": 3e4},
        "detect": {"epsilon": 1.3}, "blade": {"thickness": 0.3, "speed": 0.7, "strokes": [
            stroke((0.45, 0.5, 1.1), (0.6, 0.5, -0.1), along=[0.4, 1, 0.2], back=[-0.5, 0.1, 1])]}},
    "no_skin": {"body": block(6, 5, 4), "clusters": {"side": 3}, "skin": {"wanted": False}, "blade": {"speed": 1, "strokes": PRESS}},
    # ambiguous rotations, and few iterations
    "rods": {
        "body": block(6, 1, 1), "clusters": {"side": 2, "small": 0}, "frame": {"count": 8}, "ground": {"offset": -0.3},
        "step": {"gravity": [0, 2, -9.81], "iterations": 3}, "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "velocity": [0, 0.1, 0.1]}]},
    "points": {
        "body": block(3, 1, 1), "clusters": {"side": 1, "small": 0}, "frame": {"count": 5}, "step": DOWN, "ground": {"offset": -0.1}},
    "no_iteration": {
        "body": block(4, 3, 2), "clusters": {"side": 2}, "frame": {"count": 5}, "step": {**DOWN, "iterations": 0}, "ground": {"offset": -0.1},
        "blade": {"speed": 1, "strokes": PRESS}},
    "one_iteration": {
        "body": block(4, 3, 2), "clusters": {"side": 2}, "frame": {"count": 5}, "step": {**DOWN, "iterations": 1}, "ground": {"offset": -0.1},
        "blade": {"speed": 1, "strokes": PRESS}},
}
for scene in SCENES.values():
    scene["version"] = 5

SHORT = ("wedge", "long_prism", "friction", "frictionless", "mixed_walls", "retardation", "volume", "volume_of_sheets", "tiles", "grips_alone", "grips_after_strokes", "sampled", "sampled_deep",
         "sampled_published", "arc_fast", "arc_geometric", "corners", "strain", "tilted", "debris", "shapes", "alpha", "slanted_skin", "fork", "on_surfaces", "isolated", "diagonal", "begun_inside", "fallen", "rods")
