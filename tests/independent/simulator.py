"""A second simulator, written from docs/design/method.md alone. Numbers in comments are that page's requirements.
It begins with a scene (docs/reference/scene.md): body, clusters and schedule are its own."""
import collections
import itertools
import math
import types

import numpy as np

DIRECTIONS = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])  # M1.5

DEFAULTS = {  # §14
    "seed": 1,
    "body": {"density": 1000, "fit_skin": True, "align": True},
    "clusters": {"method": "boxes", "side": 5, "spacing": 3.0, "radius": 4.0, "small": 0.5, "cap": 1.4},
    "frame": {"length": 0.016, "count": 0, "settle": 0},
    "step": {"solver": "implicit", "substeps": 4, "iterations": 4, "stiffness": 1e5, "volume_share": 0, "relaxation": 0.5, "damping": 0,
             "retardation": 0, "gravity": (0, 0, 0)},
    "detect": {"criterion": "distance", "epsilon": 1.5, "strain": 1.2, "without_blade": False, "every": "frame"},
    "split": {"debris": 0},
    "merge": {"rule": "deterministic"},
    "expand": {"rule": "edge_cover", "depth": 1},
    "skin": {"wanted": True, "alpha": 0.5, "fit_cuts": True},
}
SHAPE = {"center": (0, 0, 0), "size": (0.1, 0.1, 0.1), "radius": 0.05, "tube": 0.02, "length": 0.1, "along": (0, 0, 1)}
BLADE = {"length": 1.5, "depth": 1.5, "thickness": 1, "friction": 0, "speed": 0.1, "start": 0}
STROKE = {"curve": "line", "back": (0, 0, 1), "along": None, "pause": 0}
WALL = {"axis": 2, "side": 1, "offset": 0, "friction": 0}
GRIP = {"start": 0, "end": -1, "after_strokes": False, "velocity": (0, 0, 0)}


def with_defaults(scene):
    full = dict(scene)
    for name, default in DEFAULTS.items():
        full[name] = {**default, **scene.get(name, {})} if isinstance(default, dict) else scene.get(name, default)
    full["step"].setdefault("acceleration", "chebyshev" if full["step"]["solver"] == "implicit" else "none")
    full["detect"].setdefault("remove", "nearer" if full["detect"]["criterion"] == "distance" else "both")
    full["walls"] = [{**WALL, **scene["ground"], "axis": 2, "side": 1}] if "ground" in scene else []  # M9.3
    full["walls"] += [{**WALL, **wall} for wall in scene.get("walls", [])]
    full["grips"] = [{**GRIP, **grip} for grip in scene.get("grips", [])]
    if scene.get("blade"):
        full["blade"] = {**BLADE, **scene["blade"]}
        full["blade"]["strokes"] = [{**STROKE, **stroke} for stroke in scene["blade"]["strokes"]]
    return full


def unit(a):
    a = np.asarray(a, float)
    return a / math.sqrt(a @ a)


def whole(x):
    """M9.3."""
    return math.ceil(x * (1 - 1e-12) - 1e-9)


def ceil_product(x):
    """M2.6: products near an integer round to it."""
    return round(x) if abs(x - round(x)) <= 1e-9 else math.ceil(x)


def floor_product(x):
    return round(x) if abs(x - round(x)) <= 1e-9 else math.floor(x)


# ---------------------------------------------------------------------------------------------------------- 1. Tissue

def organ(kind, q):
    """M1.2: the f of the organ, and its middles and half axes along y and z."""
    x = np.clip(q[:, 0], -1, 1)
    if kind == "kidney":
        cy, cz, ay, az = -0.8 * x**2, 0 * x, 1 + 0 * x, 1 + 0 * x
        dent = 1.1 * np.maximum(0, 1 - (q[:, 0] / 0.45)**2 - ((q[:, 1] + 1) / 0.7)**2 - (q[:, 2] / 0.6)**2)**3
    else:
        u = (x + 1) / 2
        w = u**2 * (3 - 2 * u)
        ay, az = 1 - 0.5 * w, 1 - 0.8 * w
        cy, cz, dent = 0.7 * w, 0.7 * (1 - az), 0
    f = q[:, 0]**2 + ((q[:, 1] - cy) / ay)**2 + ((q[:, 2] - cz) / az)**2 - 1 + dent
    return f, (cy, cz), (ay, az)


def solid(shape):
    """M1.1: a function that is negative inside and positive strictly outside, and the bounds."""
    kind, shape = shape["kind"], {**SHAPE, **shape}
    if kind in ("union", "difference"):
        parts = [solid(part) for part in shape["parts"]]
        functions = [part[0] for part in parts]
        if kind == "union":
            return (lambda p: np.min([f(p) for f in functions], axis=0), np.min([part[1] for part in parts], axis=0),
                    np.max([part[2] for part in parts], axis=0))
        return (lambda p: np.max([functions[0](p)] + [-f(p) for f in functions[1:]], axis=0)), parts[0][1], parts[0][2]
    center, size, a = np.array(shape["center"], float), np.array(shape["size"], float), unit(shape["along"])
    radius, tube, length = shape["radius"], shape["tube"], shape["length"]
    across = np.sqrt(np.maximum(0, 1 - a**2))
    half = {"box": size / 2, "ball": np.full(3, radius), "cylinder": length * abs(a) / 2 + radius * across,
            "capsule": length * abs(a) / 2 + radius, "torus": radius * across + tube}.get(kind, size / 2)

    if kind in ("kidney", "liver"):
        x = np.linspace(-1, 1, 4001)
        _, c, b = organ(kind, np.stack([x, 0 * x, 0 * x], axis=1))
        r = np.sqrt(1 - x**2)
        bounds = [(-1, 1)] + [(np.min(c[k] - b[k] * r), np.max(c[k] + b[k] * r)) for k in (0, 1)]
        low, high = np.array(bounds, float).T
        inside = lambda p: organ(kind, low + (p - (center - half)) / (2 * half) * (high - low))[0]
    else:
        def inside(p):
            d = p - center
            along = d @ a
            r = np.linalg.norm(d - along[:, None] * a, axis=1)
            if kind == "box":
                return np.max(abs(d) - size / 2, axis=1)
            if kind == "ball":
                return np.linalg.norm(d, axis=1) - radius
            if kind == "cylinder":
                return np.maximum(r - radius, abs(along) - length / 2)
            if kind == "capsule":
                return np.hypot(r, np.maximum(0, abs(along) - length / 2)) - radius
            return np.hypot(r - radius, along) - tube
    return inside, center - half, center + half


def mesh_solid(path, unit_length, align):
    """M1.6, M1.7 for a sound mesh in an OBJ file: as `solid`, and the frame's origin and axes."""
    rows = [line.split() for line in path.read_text().splitlines()]
    corners = unit_length * np.array([row[1:] for row in rows if row[0] == "v"], float)
    faces_ = np.array([row[1:] for row in rows if row[0] == "f"], int) - 1

    def volumes():  # of tetrahedra with the origin
        t = corners[faces_]
        return t, np.linalg.det(t) / 6

    t, volume = volumes()
    centroid, axes = volume @ t.sum(axis=1) / 4 / volume.sum(), np.eye(3)
    corners = corners - centroid
    t, volume = volumes()
    if align:
        total = t.sum(axis=1)
        squares = np.einsum("tki,tkj->tij", t, t) + total[:, :, None] * total[:, None, :]
        second = np.einsum("t,tij->ij", volume, squares) / 20 / volume.sum()
        moments, axes = np.linalg.eigh(second)
        moments, axes = moments[::-1], axes.T[::-1].copy()
        equal = [moments[0] - moments[1] <= 1e-6 * moments[0], moments[1] - moments[2] <= 1e-6 * moments[0]]
        if all(equal):
            axes = np.eye(3)
        elif any(equal):
            third, first = (2, 0) if equal[0] else (0, 1)
            n = axes[third]
            e = np.eye(3)[np.argmin(abs(n))]
            axes[first] = unit(e - (e @ n) * n)
            axes[first + 1] = np.cross(n, axes[first])
        if not all(equal):
            for k in (0, 1):
                a = (t @ axes[k]).T
                mixed = sum(a[i]**2 * a[j] for i in range(3) for j in range(3) if i != j)
                third_moment = volume @ ((a**3).sum(axis=0) + mixed + a.prod(axis=0)) / 20 / volume.sum()
                if abs(third_moment) < 1e-6 * moments[k]**1.5:
                    third_moment = axes[k][np.argmax(abs(axes[k]))]
                axes[k] *= np.sign(third_moment)
        axes[2] = np.cross(axes[0], axes[1])
        corners = corners @ axes.T

    def inside(p):  # half less the winding number
        a, b, c = np.moveaxis(corners[faces_] - p[:, None, None, :], 2, 0)
        la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
        below = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
        return 0.5 - np.arctan2((a * np.cross(b, c)).sum(axis=2), below).sum(axis=1) / (2 * np.pi)
    return inside, corners.min(axis=0), corners.max(axis=0), centroid, axes


def make_body(scene, folder):
    center, axes = np.zeros(3), np.eye(3)
    if "mesh" in scene["body"]:
        mesh = scene["body"]["mesh"]
        value, low, high, center, axes = mesh_solid(folder / mesh["file"], mesh["unit"], scene["body"]["align"])
    else:
        value, low, high = solid(scene["body"]["shape"])
    h = scene["body"]["spacing"]
    counts = np.ceil((high - low) / h).astype(int)
    candidates = np.array(list(itertools.product(*map(range, counts))))
    candidates = candidates[value(low + h * (candidates + 0.5)) < 0]  # M1.3
    first = candidates.min(axis=0) - 1
    nodes = candidates.max(axis=0) - first + 2
    place = candidates - first
    number = place @ [1, nodes[0], nodes[0] * nodes[1]]
    place = place[np.argsort(number)]  # M1.4
    n = len(place)
    at = np.full(nodes, -1)
    at[tuple(place.T)] = np.arange(n)
    around = np.stack([at[tuple((place + d).T)] for d in DIRECTIONS], axis=1)
    crossing = np.zeros((n, 6))
    if scene["body"]["fit_skin"]:  # M1.8
        for d, direction in enumerate(DIRECTIONS):
            start = low + h * (place + first + 0.5)
            inside, outside = np.zeros(n, int), np.full(n, 512)
            while (outside - inside > 1).any():
                middle = (inside + outside) // 2
                within = value(start + (h / 512) * middle[:, None] * direction) < 0
                inside, outside = np.where(within, middle, inside), np.where(within, outside, middle)
            crossing[:, d] = np.where(around[:, d] < 0, np.clip(outside // 2, 16, 240), 0)
    i, d = np.nonzero(around[:, ::2] >= 0)
    edges = np.stack([i, around[i, 2 * d]], axis=1)
    return types.SimpleNamespace(h=h, count=n, nodes=nodes, node=np.sort(number), place=place, at=at,
                                 rest=h * place.astype(float),
                                 around=around, crossing=crossing, edges=edges, axes=axes,
                                 origin=center + (low + h * (first + 0.5)) @ axes,
                                 mass=np.full(n, scene["body"]["density"] * h**3))


def components(body, particles):
    """Components of G within a set of particles, each ascending, by smallest particle."""
    left, found = set(int(i) for i in particles), []
    for start in sorted(left):
        if start in left:
            left.remove(start)
            queue, part = [start], []
            while queue:
                i = queue.pop()
                part.append(i)
                for j in body.around[i].tolist():
                    if j in left:
                        left.remove(j)
                        queue.append(j)
            found.append(sorted(part))
    return found


# -------------------------------------------------------------------------------------------------------- 2. Clusters

class Cluster:
    def __init__(self, number, members, rotation=None, flag=False):
        self.number, self.members = number, set(members)
        self.rotation, self.flag = np.eye(3) if rotation is None else rotation, flag


def numbers_mt64(seed):
    """The C++ standard's mt19937_64 (M2.5)."""
    full = 2**64 - 1
    state = [seed]
    for k in range(1, 312):
        state.append((6364136223846793005 * (state[-1] ^ state[-1] >> 62) + k) & full)
    while True:
        for k in range(312):
            y = (state[k] >> 31 << 31) | (state[(k + 1) % 312] & (2**31 - 1))
            state[k] = state[(k + 156) % 312] ^ y >> 1 ^ (0xB5026F5AA96619E9 if y & 1 else 0)
        for z in list(state):
            z ^= z >> 29 & 0x5555555555555555
            z ^= z << 17 & 0x71D67FFFEDA60000
            z ^= z << 37 & 0xFFF7EEE000000000
            yield (z ^ z >> 43) & full


def random_order(n, seed):
    order, source, z = list(range(n)), numbers_mt64(seed), 2**64 - 1
    for k in range(n, 1, -1):
        number = next(x for x in source if x < z - z % k)
        order[k - 1], order[number % k] = order[number % k], order[k - 1]
    return order


def boxes(body, side):
    """M2.3."""
    low = body.place.min(axis=0)
    cores = collections.defaultdict(list)
    for i, cube in enumerate(((body.place - low) // side).tolist()):
        cores[tuple(cube[::-1])].append(i)
    cores = [Cluster(c, cores[cube]) for c, cube in enumerate(sorted(cores))]
    cores = merge(body, cores, "deterministic", ceil_product(0.75 * side**3), floor_product(1.4 * side**3))
    found, steps = [], np.array(list(itertools.product((-1, 0, 1), repeat=3)))
    for core in cores:
        near = (body.place[sorted(core.members)][:, None] + steps).reshape(-1, 3)
        grown = set(body.at[tuple(near.T)].tolist()) - {-1}
        parts = [part for part in components(body, grown) if core.members & set(part)]
        found += sorted(parts, key=lambda part: min(core.members & set(part)))
    return [Cluster(c, part) for c, part in enumerate(found)]


def tiles(body, side):
    """M2.8."""
    place, found = body.place - body.place.min(axis=0), []
    last = place.max(axis=0) // side
    for cube in sorted(itertools.product(*(range(n + 1) for n in last)), key=lambda cube: cube[::-1]):
        low = np.array(cube) * side
        inside = np.nonzero(((low <= place) & (place <= low + side)).all(axis=1))[0]
        found += sorted(components(body, inside), key=min)
    found = [set(part) for part in found]
    layer = lambda part: (np.ptp(place[sorted(part)], axis=0) == 0).any()
    pairs = lambda part: {(i, j) for i in part for j in body.around[i] if j in part} | {(i, i) for i in part}
    held = collections.Counter(pair for part in found for pair in pairs(part))
    for part in sorted((part for part in found if layer(part)), key=len):
        if all(held[pair] > 1 for pair in pairs(part)):
            held.subtract(pairs(part))
            found.remove(part)
    return [Cluster(c, sorted(part)) for c, part in enumerate(found)]


def sampled(body, spacing, radius, seed):
    """M2.4."""
    covered, found = set(), []
    for i in random_order(body.count, seed):
        if i not in covered:
            distance = np.sqrt(((body.place - body.place[i])**2).sum(axis=1))
            ball = lambda r: next(part for part in components(body, np.nonzero(distance <= r)[0]) if i in part)
            found.append(ball(radius))
            covered |= set(ball(min(spacing, radius)))
    return [Cluster(c, part) for c, part in enumerate(found)]


def cook(scene, body):
    """M2.6: clusters, tau, cap, and whether every edge is covered."""
    options = scene["clusters"]
    if options["method"] == "boxes":
        clusters = boxes(body, options["side"])
    elif options["method"] == "tiles":
        clusters = tiles(body, options["side"])
    else:
        clusters = sampled(body, options["spacing"], options["radius"], scene["seed"])
    sizes = sorted(len(c.members) for c in clusters)
    usual = options["side"]**3 if options["method"] == "tiles" else sizes[(len(sizes) - 1) // 2]
    tau = ceil_product(options["small"] * usual)
    cap = floor_product(options["cap"] * sizes[-1])
    clusters = merge(body, clusters, scene["merge"]["rule"], tau, cap)
    expanded = options["method"] == "sampled" and scene["expand"]["rule"] == "edge_cover"
    if expanded:
        clusters = expand(body, clusters, np.ones(body.count, bool), "edge_cover", scene["expand"]["depth"])
        clusters = merge(body, clusters, scene["merge"]["rule"], tau, cap)
    for number, cluster in enumerate(clusters):
        cluster.number = number
    return clusters, tau, cap, expanded or options["method"] != "sampled"


# -------------------------------------------------------------------------------------------------------- 9. Schedule

Pose = collections.namedtuple("Pose", "edge along back")
Move = collections.namedtuple("Move", "before after down")


def turned(pose, angle):
    """The pose, turned about its back."""
    along = math.cos(angle) * pose.along + math.sin(angle) * np.cross(pose.back, pose.along)
    return Pose(pose.edge, along, pose.back)


def angle_about_back(a, b):
    return math.atan2(np.cross(a.along, b.along) @ a.back, a.along @ b.along)


def orthogonal_unit(a, back):
    return unit(a - (np.asarray(a, float) @ back) * back)


def pieces_of(stroke, place, half_length):
    """M9.6: (way, pose at a share of the way) of each piece."""
    back, points = unit(stroke["back"]), [place(p) for p in stroke["points"]]
    along = None if stroke["along"] is None else orthogonal_unit(stroke["along"], back)
    if stroke["curve"] == "arc":
        a, b = points[1] - points[0], points[2] - points[0]
        axis = np.cross(a, b)
        center = points[0] + (np.cross(axis, a) * (b @ b) + np.cross(b, axis) * (a @ a)) / (2 * axis @ axis)
        axis, first = unit(axis), points[0] - center
        side = np.cross(axis, first)
        angle = math.atan2((points[2] - center) @ side, (points[2] - center) @ first) % (2 * math.pi)

        def on_arc(share):
            c, s = math.cos(share * angle), math.sin(share * angle)
            return Pose(center + c * first + s * side,
                        orthogonal_unit(c * side - s * first, back) if along is None else along, back)
        return [(angle * math.sqrt(first @ first), on_arc)]
    pieces, last = [], None
    for a, b in zip(points, points[1:]):
        if (a == b).all():
            continue
        direction = orthogonal_unit(b - a, back) if along is None else along
        if last is not None:
            if last @ direction < 0:
                direction = -direction
            corner = Pose(a, last, back)
            phi = angle_about_back(corner, Pose(a, direction, back))
            if abs(phi) > 1e-12:
                pieces.append((abs(phi) * half_length, lambda share, p=corner, phi=phi: turned(p, share * phi)))
        pieces.append((math.dist(a, b), lambda share, a=a, b=b, d=direction: Pose(a + share * (b - a), d, back)))
        last = direction
    return pieces


def make_blade(scene, body, place, extent):
    """M9.5, with half the length of the first stroke's edge that ways of turns need (M9.7)."""
    blade, width = scene["blade"], lambda e: abs(e) @ extent
    first = pieces_of(blade["strokes"][0], place, 0)[0][1](0)
    thickness = blade["thickness"] * body.h
    return types.SimpleNamespace(length=blade["length"] * width(first.along), depth=blade["depth"] * width(first.back),
                                 thickness=thickness, friction=blade["friction"],
                                 clearance=1.001 * max(thickness, scene["detect"]["epsilon"] * body.h) / 2)  # M3.8


def substeps_of_stroke(stroke, place, blade, speed, frame_length, S):
    """M9.7: each substep's pose at shares of it."""
    pieces = pieces_of(stroke, place, blade.length / 2)
    counts = [max(1, whole(way / (speed * frame_length / S))) for way, _ in pieces]
    longest = max(range(len(pieces)), key=lambda k: (pieces[k][0], -k))
    counts[longest] += -sum(counts) % S
    return [lambda share, pose=pose, j=j, count=count: pose((j + share) / count)
            for (_, pose), count in zip(pieces, counts) for j in range(count)]


def parts_of_frame(substeps, blade):
    """M9.9."""
    for p in itertools.count(1):
        moves = [Move(pose(k / p), pose((k + 1) / p), True) for pose in substeps for k in range(p)]
        fits = True
        for move in moves:
            turning = abs(angle_about_back(move.before, move.after)) * blade.length / 2
            travel = math.dist(move.before.edge, move.after.edge) + turning
            fits &= whole(travel / blade.clearance) <= 1 and whole(turning / (min(blade.length, blade.depth) / 2)) <= 1
        if fits:
            return [moves[k * len(substeps):(k + 1) * len(substeps)] for k in range(p)]


def make_schedule(scene, body):
    F, S = scene["frame"]["length"], scene["step"]["substeps"]
    low = body.rest.min(axis=0) - body.h / 2
    extent = body.rest.max(axis=0) + body.h / 2 - low
    place = lambda p: low + np.asarray(p, float) * extent  # M9.3
    setup = types.SimpleNamespace(blade=None, substeps=S, walls=[types.SimpleNamespace(
        axis=w["axis"], side=w["side"], friction=w["friction"], offset=low[w["axis"]] + w["offset"] * extent[w["axis"]])
        for w in scene["walls"]])
    frames, strokes_end, count = [], 0, scene["frame"]["count"]  # each: its substeps' poses, or one pose: the blade is up
    if "blade" in scene:  # M9.4
        blade = setup.blade = make_blade(scene, body, place, extent)
        strokes = [substeps_of_stroke(s, place, blade, scene["blade"]["speed"], F, S) for s in scene["blade"]["strokes"]]
        frames += [strokes[0][0](0)] * whole(scene["blade"]["start"] / F)
        for k, stroke in enumerate(strokes):
            frames += [stroke[j:j + S] for j in range(0, len(stroke), S)]
            if k + 1 < len(strokes):
                frames += [strokes[k + 1][0](0)] * whole(scene["blade"]["strokes"][k]["pause"] / F)  # M9.8
        strokes_end = len(frames)
        rest, settle = strokes[-1][-1](1), whole(scene["frame"]["settle"] / F)
    else:
        rest, settle = None, whole(max([g["end"] for g in scene["grips"]] + [0]) / F) + whole(scene["frame"]["settle"] / F)
    frames += [rest] * (max(settle, count - len(frames)))
    if count > 0:
        frames = frames[:count]

    setup.frames, times = [], []  # of the simulation: dt and one move per substep
    for k, frame in enumerate(frames):
        if isinstance(frame, list) and scene["detect"]["criterion"] != "geometric":
            parts = parts_of_frame(frame, setup.blade)
        elif isinstance(frame, list):
            parts = [[Move(pose(0), pose(1), True) for pose in frame]]
        else:
            parts = [[Move(frame, frame, False)] * S]
        dt = F / (S * len(parts))
        setup.frames += [(dt, part) for part in parts]
        times += [k * F + dt * (j + 0.5) for j in range(S * len(parts))]
    make_grips(scene, body, place, setup, np.array(times), strokes_end * F)
    if scene["detect"]["every"] == "substep":  # M9.12
        setup.substeps = 1
        setup.frames = [(dt, [move]) for dt, moves in setup.frames for move in moves]
    return setup


def make_grips(scene, body, place, setup, times, strokes_end):
    """M9.10, M9.11."""
    distance = []
    for grip in scene["grips"]:
        a, b = place(grip["low"]), place(grip["high"])
        distance.append(np.linalg.norm(body.rest - np.clip(body.rest, a, b), axis=1))
    taken = np.zeros(body.count, bool)
    for d in distance:
        taken |= d == 0
    setup.grips = []
    for grip, d in zip(scene["grips"], distance):
        held = d == 0
        if not held.any():
            held = ~taken & (d < d[~taken].min() + body.h * (1 - 1e-6))
            taken |= held
        since = strokes_end if grip["after_strokes"] else 0
        active = (times >= since + grip["start"]) & ((times < since + grip["end"]) | (grip["end"] < 0))
        setup.grips.append(types.SimpleNamespace(particles=np.nonzero(held)[0], active=active,
                                                 velocity=np.array(grip["velocity"], float)))


# ------------------------------------------------------------------------------------------------ 12. Rotations

def davenport(A):
    """M12.1: N with qᵀ N q = tr(Rᵀ A)."""
    a = lambda i, j: A[:, i, j]
    N = np.empty((len(A), 4, 4))
    N[:, 0, 0] = a(0, 0) + a(1, 1) + a(2, 2)
    for k in range(3):
        N[:, k + 1, k + 1] = 2 * a(k, k) - N[:, 0, 0]
        i, j = (k + 1) % 3, (k + 2) % 3
        N[:, 0, k + 1] = N[:, k + 1, 0] = a(j, i) - a(i, j)
        N[:, i + 1, j + 1] = N[:, j + 1, i + 1] = a(i, j) + a(j, i)
    return N


def matrix(q):
    w, x, y, z = q.T
    return np.stack([w*w + x*x - y*y - z*z, 2 * (x*y - w*z), 2 * (x*z + w*y),
                     2 * (x*y + w*z), w*w - x*x + y*y - z*z, 2 * (y*z - w*x),
                     2 * (x*z - w*y), 2 * (y*z + w*x), w*w - x*x - y*y + z*z], axis=1).reshape(-1, 3, 3)


def rotations(A, last):
    """M3.4, M12.1: rotations, flags, and the gap below the greatest eigenvalue and its equals."""
    greatest = abs(A).max(axis=(1, 2))
    usable = np.isfinite(A).all(axis=(1, 2)) & (greatest > 0)
    A = np.where(usable[:, None, None], A, 0) / np.where(usable, greatest, 1)[:, None, None]
    values, vectors = np.linalg.eigh(davenport(A))
    q = vectors[:, :, 3].copy()
    equal = values >= values[:, 3:] - 1e-12 * np.maximum(abs(values[:, 3:]), 1)
    flags = equal.sum(axis=1) > 1
    for c in np.nonzero(flags & usable)[0]:
        previous = np.linalg.eigh(davenport(last[c:c + 1]))[1][0, :, 3]
        space = vectors[c][:, equal[c]]
        near = space @ (space.T @ previous)
        length = math.sqrt(near @ near)
        q[c] = near / length if length >= 1e-9 else space[:, -1]
    R = matrix(q)
    R[~usable] = last[~usable]
    gap = np.where(equal, np.inf, values[:, 3:] - values).min(axis=1)
    return R, flags | ~usable, gap


# ------------------------------------------------------------------------------------------------------ 3. Contacts

class Contacts:
    """M3.7 to M3.13 and the nearness of M11.3, in one substep."""

    def __init__(self, setup, body, move, before, geometric):
        self.walls, self.blade, self.h = setup.walls, setup.blade, body.h
        self.touching = setup.blade is not None and move.down and not geometric  # M3.8
        self.x_before, self.move = before, move
        if self.touching:
            self.frames = [np.stack([pose.along, pose.back, np.cross(pose.along, pose.back)]) for pose in move[:2]]
            self.side = np.where((before - move.before.edge) @ self.frames[0][2] < 0, -1.0, 1.0)
        self.wall_friction = any(wall.friction > 0 for wall in self.walls)
        self.friction_anywhere = self.wall_friction or (self.touching and self.blade.friction > 0)

    def coordinates(self, x):
        return (x - self.move.after.edge) @ self.frames[1].T

    def over(self, c):
        return (abs(c[:, 0]) < self.blade.length / 2) & (0 < c[:, 1]) & (c[:, 1] < self.blade.depth)

    def rim(self, c):
        """o of M3.9."""
        half = self.blade.length / 2
        nearest = np.stack([np.clip(c[:, 0], -half, half), np.clip(c[:, 1], 0, self.blade.depth), 0 * c[:, 2]], axis=1)
        return c - nearest

    def way(self, x):
        """M3.9, as vectors of the world."""
        c, rho, side = self.coordinates(x), self.blade.clearance, self.side
        u, w, n = c.T
        z, zero, half, depth = side * n, 0 * n, self.blade.length / 2, self.blade.depth
        straight = side * rho - n
        b = -side * np.maximum(abs(n), rho) - n
        five = np.stack([np.stack(v, axis=1) for v in (
            (zero, zero, straight), (zero, -w, b), (zero, depth - w, b), (-half - u, zero, b), (half - u, zero, b))])
        shortest = five[np.argmin((five**2).sum(axis=2), axis=0), np.arange(len(x))]
        over_plate = np.where((z >= rho)[:, None], 0, np.where((z >= 0)[:, None], five[0], shortest))
        o = self.rim(c)
        distance = np.linalg.norm(o, axis=1)
        safe = np.where(distance > 0, distance, 1)
        away = np.where((distance > 0)[:, None], (rho / safe - 1)[:, None] * o, np.stack([zero, zero, side * rho], axis=1))
        beside = np.where((distance >= rho)[:, None], 0, away)
        return np.where(self.over(c)[:, None], over_plate, beside) @ self.frames[1]

    def push_walls(self, x, active):
        """M3.10: who moved."""
        moved = np.zeros(len(x), bool)
        for wall in self.walls:
            fails = active & (wall.side * (x[:, wall.axis] - wall.offset) < 0)
            x[fails, wall.axis] = wall.offset
            moved |= fails
        return moved

    def project(self, x):
        """M3.11: the result, and where blade and walls acted in turn."""
        x, active = x.copy(), np.ones(len(x), bool)
        if not self.touching:
            self.push_walls(x, active)
            return x, ~active
        way = self.way(x)
        x += way
        by_blade, by_walls = (way != 0).any(axis=1), ~active
        for _ in range(16):
            active = self.push_walls(x, active)
            by_walls |= active
            if not active.any():
                break
            way = np.where(active[:, None], self.way(x), 0)
            x += way
            active = (way != 0).any(axis=1)
            by_blade |= active
            if not active.any():
                break
        return x, by_blade & by_walls

    def friction(self, f):
        """M3.12: the result, and where blade and walls acted in turn."""
        r, in_turn = self.project(f)
        if not self.friction_anywhere:
            return r, in_turn
        rubs = (r != f).any(axis=1) | in_turn
        first = r.copy()
        for wall in self.walls:
            depth = wall.side * (wall.offset - f[:, wall.axis])
            a = r - self.x_before
            a[:, wall.axis] = 0
            r = self.slow(r, a, wall.friction, depth)
        if self.touching and self.blade.friction > 0:
            way = self.way(f)
            depth = np.linalg.norm(way, axis=1)
            direction = way / np.where(depth > 0, depth, 1)[:, None]
            a = self.coordinates(r) @ self.frames[0] + self.move.before.edge - self.x_before
            a -= (a * direction).sum(axis=1)[:, None] * direction
            r = self.slow(r, a, self.blade.friction, depth)
        r, again = self.project(r)
        return np.where(rubs[:, None], r, first), in_turn | again

    def slow(self, r, a, mu, depth):
        length = np.linalg.norm(a, axis=1)
        share = np.minimum(1, mu * np.maximum(depth, 0) / np.where(length > 0, length, 1))
        return r - share[:, None] * a

    def next(self, f, x):
        """M3.13."""
        found, in_turn = self.friction(f)
        if self.friction_anywhere or not in_turn.any():
            return found
        new, old = np.linalg.norm(found - f, axis=1), np.linalg.norm(x - f, axis=1)
        worse = in_turn & (new > old + 64 * 2.0**-53 * (old + np.linalg.norm(x, axis=1)))
        return np.where(worse[:, None], x, found)

    def near(self, x):
        """M11.3."""
        margin, found = self.h / 1024, np.zeros(len(x), bool)
        for wall in self.walls:
            found |= wall.side * (x[:, wall.axis] - wall.offset) < margin
        if self.touching:
            c = self.coordinates(x)
            reach = self.blade.clearance + margin
            found |= np.where(self.over(c), self.side * c[:, 2] < reach, np.linalg.norm(self.rim(c), axis=1) < reach)
        return found


def nearest_product(sigma, product):
    """M3.16: p, by all sign changes of p_1 p_2 p_3 - product over p_3."""
    def p_of(p3):
        mu = p3 * (p3 - sigma[2])
        return np.array([(s + np.sqrt(np.maximum(s * s + 4 * mu, 0))) / 2 for s in sigma[:2]] + [p3])
    grid = np.geomspace(1e-9, 3, 2000) * max(abs(sigma).max(), product ** (1 / 3))
    above = p_of(grid).prod(axis=0) > product
    found = []
    for k in np.nonzero(above[1:] != above[:-1])[0]:
        low, high = grid[k], grid[k + 1]
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if (p_of(middle).prod() > product) == above[k] else (low, middle)
        found.append(p_of(low))
    return min(reversed(found), key=lambda p: np.linalg.norm(p - sigma))


def volume(A, A0, R):
    """M3.16, M3.17: V, and V - F."""
    if not np.isfinite(A).all():
        return R, 0 * R
    extents, axes = np.linalg.eigh(A0)
    if np.linalg.det(A0) > (np.trace(A0) / 15) ** 3:
        inverse_root = axes / np.sqrt(extents) @ axes.T
        U, sigma, Zt = np.linalg.svd(A @ inverse_root)
        for turn in (U.T, Zt):  # make it a rotation
            if np.linalg.det(turn) < 0:
                turn[2] *= -1
                sigma[2] *= -1
        V = U * nearest_product(sigma, np.sqrt(extents.prod())) @ Zt @ inverse_root
        return V, V - A @ np.linalg.inv(A0)
    along = axes[:, extents > 1e-3 * extents.max()]
    inverse = along / extents[extents > 1e-3 * extents.max()] @ along.T
    return A @ inverse + R @ (np.eye(3) - along @ along.T), 0 * R


# ------------------------------------------------------------------------------------------------ the stages

class Cover:
    """Pairs (cluster, particle) with their weights, and rest frames (M2.1, M5.3)."""

    def __init__(self, body, clusters):
        members = [np.array(sorted(c.members)) for c in clusters]
        sizes = [len(m) for m in members]
        self.i = np.concatenate(members)
        self.c = np.repeat(np.arange(len(members)), sizes)
        self.starts = np.concatenate([[0], np.cumsum(sizes)])[:-1]
        self.n = np.bincount(self.i, minlength=body.count)
        self.w = body.mass[self.i] / self.n[self.i]
        self.M = np.add.reduceat(self.w, self.starts)
        self.T = self.mean(body.rest)
        self.r = body.rest[self.i] - self.T[self.c]
        self.R = np.array([c.rotation for c in clusters])
        self.offset = np.add.reduceat(self.w[:, None] * self.r, self.starts)  # 0 but for rounding
        self.A0 = np.add.reduceat(self.w[:, None, None] * self.r[:, :, None] * self.r[:, None, :], self.starts)
        self.A0[np.array(sizes) == 1] = 0  # M3.17
        self.body = body

    def mean(self, y):
        """M3.5."""
        first = y[self.i[self.starts]]
        return first + np.add.reduceat(self.w[:, None] * (y[self.i] - first[self.c]), self.starts) / self.M[:, None]

    def moments(self, y, t):
        return np.add.reduceat((self.w[:, None] * (y[self.i] - t[self.c]))[:, :, None] * self.r[:, None, :], self.starts)

    def maps(self, beta, y, t):
        """M3.15: β, C and B."""
        if beta == 0:
            return beta, self.R, self.R
        V, pull = np.array([volume(A, A0, R) for A, A0, R in zip(self.moments(y, t), self.A0, self.R)]).swapaxes(0, 1)
        return beta, (1 - beta) * self.R + beta * pull, (1 - beta) * self.R + beta * V

    def exact_mean(self, y, t, maps):
        """M3.5, last sentence."""
        beta, C, _ = maps
        error = np.add.reduceat(self.w[:, None] * (y[self.i] - t[self.c]), self.starts)
        return t + (error - np.einsum("cij,cj->ci", C, self.offset) / (1 - beta)) / self.M[:, None]

    def carried(self, t, maps, y, shift=None):
        """M3.2, M8.1: the mean place where its clusters carry each particle, or a point that rests `shift` beside it."""
        beta, C, B = maps
        place = (1 - beta) * t[self.c] + np.einsum("pij,pj->pi", C[self.c], self.r)
        if shift is not None:
            place += np.einsum("pij,pj->pi", B[self.c], shift[self.i])
        total = np.stack([np.bincount(self.i, place[:, k], len(self.n)) for k in range(3)], axis=1)
        alone = y if shift is None else y + shift
        return np.where((self.n > 0)[:, None], beta * y + total / np.maximum(self.n, 1)[:, None], alone)


def merge(body, clusters, rule, tau, cap):
    """M6.2 to M6.5."""
    if rule == "none":
        return clusters
    clusters = {c.number: c for c in clusters}

    def preferences():
        of = collections.defaultdict(set)
        for c in clusters.values():
            for i in c.members:
                of[i].add(c.number)
        for s in sorted(clusters):
            members = clusters[s].members
            if len(members) < tau:
                around = set(body.around[sorted(members)].ravel().tolist()) - {-1} | members
                may = [t for t in set().union(*(of[i] for i in around)) - {s}
                       if len(members | clusters[t].members) <= cap or members <= clusters[t].members]
                if may:
                    yield s, min(may, key=lambda t: (len(clusters[t].members), t))

    def join(s, t):
        clusters[t].members |= clusters.pop(s).members

    for r in itertools.count():
        proposals, pairs = list(preferences()), []
        if rule == "published":
            roles = set()
            for s, t in proposals:
                if not {s, t} & roles:
                    roles |= {s, t}
                    pairs.append((s, t))
        else:
            keys, least = {}, {}
            for s, t in proposals:
                a, b = min(s, t), max(s, t)
                keys[s, t] = key = (mix(0x9E3779B9 * a ^ 0x85EBCA6B * b ^ 0xC2B2AE35 * r), a, b, s)
                least[s], least[t] = min(least.get(s, key), key), min(least.get(t, key), key)
            pairs = [(s, t) for (s, t), key in keys.items() if least[s] == key == least[t]]
        if not pairs:
            return [clusters[number] for number in sorted(clusters)]
        for s, t in pairs:
            join(s, t)


def mix(x):
    x &= 0xFFFFFFFF
    x = (x ^ x >> 16) * 0x7FEB352D & 0xFFFFFFFF
    x = (x ^ x >> 15) * 0x846CA68B & 0xFFFFFFFF
    return x ^ x >> 16


def expand(body, clusters, alive, rule, depth):
    """M7.1 to M7.4."""
    of = collections.defaultdict(set)
    for k, c in enumerate(clusters):
        for i in c.members:
            of[i].add(k)
    edges = [(i, j) for i, j in body.edges.tolist() if alive[i] and alive[j]]
    layers = [set() for _ in clusters]
    if rule == "edge_cover":
        for i, j in edges:
            if not of[i] & of[j]:
                k = min(of[i] | of[j], key=lambda k: (len(clusters[k].members), clusters[k].number), default=None)
                if k is not None:
                    layers[k].add(j if i in clusters[k].members else i)
    else:
        for k, c in enumerate(clusters):
            if all(len(of[i]) == 1 for i in c.members):
                for i, j in edges:
                    if (i in c.members) != (j in c.members):
                        layers[k].add(j if i in c.members else i)
    taken = [c.members | layer for c, layer in zip(clusters, layers)]
    for _ in range(depth - 1):
        for k, layer in enumerate(layers):
            near = {q for p in layer for q in body.around[p].tolist() if q >= 0 and alive[q] and of[p] & of[q]}
            layers[k] = near - taken[k]
            taken[k] |= near
    return [Cluster(c.number, members, c.rotation, c.flag) for c, members in zip(clusters, taken)]


def distance_to(points, origin, vectors):
    """The distance from { origin + Σ s_k vector_k : 0 ≤ s_k ≤ 1 }."""
    d = points - origin
    if not len(vectors):
        return np.linalg.norm(d, axis=1)
    V = np.array(vectors)
    gram = V @ V.T
    best, inside = np.full(len(points), np.inf), np.zeros(len(points), bool)
    if np.linalg.det(gram) > 1e-24 * np.prod(np.diag(gram)):
        s = np.linalg.solve(gram, V @ d.T)
        inside = ((s >= 0) & (s <= 1)).all(axis=0)
        best[inside] = np.linalg.norm(d - s.T @ V, axis=1)[inside]
    for k in range(len(V)):
        rest = [v for j, v in enumerate(vectors) if j != k]
        for at in (origin, origin + V[k]):
            best[~inside] = np.minimum(best, distance_to(points, at, rest))[~inside]
    return best


class Simulator:
    def __init__(self, scene, folder):
        self.scene = with_defaults(scene)
        self.body = make_body(self.scene, folder)
        self.setup = make_schedule(self.scene, self.body)
        self.clusters, self.tau, self.cap, self.edge_covered = cook(self.scene, self.body)
        n = self.body.count
        self.x, self.v = self.body.rest.copy(), np.zeros((n, 3))  # M2.7
        self.alive, self.frame, self.substep = np.ones(n, bool), 0, 0
        self.removed = self.debris = []
        self.impulse, self.skin = np.zeros(3), None
        self.gap = np.ones(len(self.clusters))
        self.cover = Cover(self.body, self.clusters)

    def run_frame(self):
        """M9.1."""
        dt, moves = self.setup.frames[self.frame]
        self.plane = next((move.after for move in reversed(moves) if move.down), None)  # M4.2
        self.step(dt, moves)
        self.removed, self.debris = self.detect(moves), []
        if len(self.removed):
            self.alive[self.removed] = False
            self.split()
            self.clusters = merge(self.body, self.clusters, self.scene["merge"]["rule"], self.tau, self.cap)
            rule = self.scene["expand"]["rule"]
            if rule == "published" or (rule == "edge_cover" and not self.edge_covered):
                self.clusters = expand(self.body, self.clusters, self.alive, rule, self.scene["expand"]["depth"])
                self.edge_covered |= rule == "edge_cover"
        self.cover = Cover(self.body, self.clusters)
        if self.scene["skin"]["wanted"]:
            self.make_skin()
        for number, cluster in enumerate(self.clusters):
            cluster.number = number
        self.frame += 1

    # ------------------------------------------------------------------------------------------------------- step

    def step(self, dt, moves):
        self.impulse = np.zeros(3)
        for move in moves:
            self.one_substep(dt, move)
            self.substep += 1
        for c, R, flag in zip(self.clusters, self.cover.R, self.flags):
            c.rotation, c.flag = R, bool(flag)

    def one_substep(self, dt, move):
        """M3.2."""
        o, cover, alive = self.scene["step"], self.cover, self.alive
        published, m = o["solver"] == "published", self.body.mass[:, None]
        tau = 0 if published else o["retardation"]
        sigma, kappa = dt / (dt + tau), o["stiffness"] * dt * (dt + tau)
        s = o["relaxation"] if published else kappa / (1 + kappa)
        before = self.x.copy()
        ahead = lambda x: before + (x - before) / sigma
        back = lambda y: before + sigma * (y - before)
        held, displaced = ~alive, before.copy()  # the dead stay, too
        for grip in self.setup.grips:
            if grip.active[self.substep]:
                held = held.copy()
                held[grip.particles] = True
                displaced[grip.particles] = before[grip.particles] + dt * grip.velocity
        displaced[~alive] = before[~alive]
        keep = lambda x: np.where(held[:, None], displaced, x)
        contacts = Contacts(self.setup, self.body, move, before, self.scene["detect"]["criterion"] == "geometric")
        guess = before + dt * self.v + dt**2 * np.array(o["gravity"], float)
        guess[~alive] = before[~alive]
        guess_ahead = ahead(guess)
        x = keep(contacts.friction(guess)[0])
        P = (m * (x - guess))[alive].sum(axis=0)
        P_last = P
        y = y_last = ahead(x)
        b = min(s, 0.95)  # M11.1
        r, omega = b / (2 - b), 1.0
        self.flags = np.array([c.flag for c in self.clusters])
        for j in range(o["iterations"]):
            t = cover.mean(y)
            cover.R, self.flags, self.gap = rotations(cover.moments(y, t), cover.R)
            maps = cover.maps(o["volume_share"], y, t)
            g = cover.carried(cover.exact_mean(y, t, maps), maps, y)
            p = y + s * (g - y) if published else guess_ahead + s * (g - guess_ahead)
            combined = lambda new, now, last: new
            if o["acceleration"] == "chebyshev" and j > 0:
                omega = 1.0 if j == 1 else 2 / (2 - r * r) if j == 2 else 4 / (4 - r * r * omega)
                combined = lambda new, now, last: now + omega * 2 / (2 - b) * (new - now) + (omega - 1) * (now - last)
            q = combined(p, y, y_last)
            candidate = back(q)
            if o["acceleration"] == "chebyshev" and (contacts.touching or contacts.wall_friction):  # M11.3
                plain = back(p)
                candidate = np.where((contacts.near(plain) | contacts.near(candidate))[:, None], plain, candidate)
            x = keep(contacts.next(candidate, x))
            P, P_last = combined((1 if published else s) * P, P, P_last) + (m * (x - back(q)))[alive].sum(axis=0), P  # M3.6
            y, y_last = ahead(x), y
        decay = math.exp(-o["damping"] * dt)
        self.v = np.where(alive[:, None], decay * (x - before) / dt, self.v)
        self.x = x
        self.impulse = decay * (self.impulse + P / dt)

    # ----------------------------------------------------------------------------------------------------- detect

    def detect(self, moves):
        """M4.1: who is removed."""
        o = self.scene["detect"]
        if o["criterion"] == "none" or not (self.setup.blade or o["without_blade"]):
            return []
        found = {"distance": self.detect_distance, "geometric": self.detect_geometric, "strain": self.detect_strain}
        gone = found[o["criterion"]](moves)
        return np.nonzero(gone & self.alive)[0].tolist()

    def height(self, x):
        return (x - self.plane.edge) @ np.cross(self.plane.along, self.plane.back)

    def edges(self):
        edges = self.body.edges
        return edges[self.alive[edges].all(axis=1)]

    def detect_distance(self, moves):
        """M4.2."""
        o, edges, n = self.scene["detect"], self.edges(), self.body.count
        length = np.linalg.norm(self.x[edges[:, 0]] - self.x[edges[:, 1]], axis=1)
        edges = edges[length > o["epsilon"] * self.body.h]
        gone = np.zeros(n, bool)
        if o["remove"] == "both":
            gone[edges.ravel()] = True
            return gone
        count = np.bincount(edges.ravel(), minlength=n)
        height = np.zeros(n) if self.plane is None else self.height(self.x)
        if self.plane is not None and o["remove"] == "nearer":
            carried = abs(self.height(self.cover.carried(*self.places(), self.x)))
        for i, j in edges.tolist():  # i < j
            if (height[i] < 0) != (height[j] < 0):
                low, high = (i, j) if height[i] < 0 else (j, i)
                positive = o["remove"] == "nearer" and carried[low] > carried[high] + self.body.h / 8
                gone[high if positive else low] = True
            else:
                gone[j if count[j] > count[i] else i] = True
        return gone

    def detect_geometric(self, moves):
        """M4.3."""
        blade, body = self.setup.blade, self.body
        gone, farthest = np.zeros(body.count, bool), np.zeros(body.count)
        for i, j in self.edges().tolist():
            d = math.dist(self.x[i], self.x[j])
            farthest[i], farthest[j] = max(farthest[i], d), max(farthest[j], d)
        reach = np.maximum(max(blade.thickness, body.h), farthest) / 2 if blade else None
        for move in moves:
            if move.down:
                phi = angle_about_back(move.before, move.after)
                sweep = abs(phi) * math.hypot(blade.length / 2, blade.depth)
                N = max(1, math.ceil(sweep / (0.05 * body.h)))
                shift = (move.after.edge - move.before.edge) / N
                for k in range(N):
                    pose = turned(move.before, phi * k / N)
                    corner = pose.edge + k * shift - blade.length / 2 * pose.along
                    vectors = [blade.length * pose.along, blade.depth * pose.back, shift]
                    distance = distance_to(self.x, corner, vectors)
                    gone |= distance <= (1 + 1e-9) * reach + sweep / N
        return gone

    def detect_strain(self, moves):
        """M4.4."""
        cover, gone = self.cover, np.zeros(self.body.count, bool)
        A = cover.moments(self.x, cover.mean(self.x))
        A0 = np.add.reduceat((cover.w[:, None] * cover.r)[:, :, None] * cover.r[:, None, :], cover.starts)
        for c, cluster in enumerate(self.clusters):
            if np.isfinite(A[c]).all():
                F = A[c] @ np.linalg.pinv(A0[c], rcond=3 * 2.0**-52, hermitian=True)
                if np.linalg.svd(F, compute_uv=False)[0] > self.scene["detect"]["strain"]:
                    gone[sorted(cluster.members)] = True
        return gone

    # ------------------------------------------------------------------------------------------------------ split

    def split(self):
        """M5.1, M5.2."""
        least = self.scene["split"]["debris"]
        if least > 0:
            for part in components(self.body, np.nonzero(self.alive)[0]):
                if len(part) < least:
                    self.debris = self.debris + part
            self.alive[self.debris] = False
            self.debris = sorted(self.debris)
        kept, new, number = [], [], max(c.number for c in self.clusters) + 1
        for c in self.clusters:
            members = [i for i in c.members if self.alive[i]]
            if len(members) == len(c.members):
                kept.append(c)
                continue
            for k, part in enumerate(components(self.body, members)):
                (new if k else kept).append(Cluster(number if k else c.number, part, c.rotation, c.flag))
                number += k > 0
        self.clusters = kept + new

    # ------------------------------------------------------------------------------------------------------- skin

    def places(self):
        """t_c, and the maps of M4.2."""
        t = self.cover.mean(self.x)
        return t, self.cover.maps(self.scene["step"]["volume_share"], self.x, t)

    def skin_positions(self, owner, direction, reach):
        """M8.1."""
        (t, maps), place = self.places(), np.empty((len(owner), 3))
        for d in range(6):
            shift = np.zeros((self.body.count, 3))
            which = direction == d
            shift[owner[which]] = (reach[which] * self.body.h)[:, None] * DIRECTIONS[d]
            place[which] = self.cover.carried(t, maps, self.x, shift)[owner[which]]
        return place

    def make_skin(self):
        body, o = self.body, self.scene["skin"]
        if self.skin is None or self.removed or self.debris:
            tissue = np.where(body.around >= 0, self.alive[body.around], False)
            owner, direction = np.nonzero(self.alive[:, None] & ~tissue)
            other = body.around[owner, direction]
            died = np.zeros(body.count + 1, bool)  # the last entry: no particle
            died[list(self.removed) + list(self.debris)] = True
            reach = np.where(body.crossing[owner, direction] > 0, body.crossing[owner, direction] / 256, o["alpha"])  # M8.2
            if o["fit_cuts"] and self.plane is not None:
                reach = np.where(died[other], self.cut_reach(owner, direction), reach)
            old, keys = {} if self.skin is None else self.skin.reaches, list(zip(owner.tolist(), direction.tolist()))
            reach = np.array([old.get(key, a) for key, a in zip(keys, reach)])
            self.skin = types.SimpleNamespace(owner=owner, direction=direction, reach=reach, reaches=dict(zip(keys, reach)),
                                              triangles=triangles(body, self.alive, keys))
        self.skin.positions = self.skin_positions(self.skin.owner, self.skin.direction, self.skin.reach)

    def cut_reach(self, owner, direction):
        """M8.3."""
        alpha = self.scene["skin"]["alpha"]
        reaches = np.zeros(len(owner)), np.ones(len(owner))
        d0, d1 = (self.height(self.skin_positions(owner, direction, a)) / self.body.h for a in reaches)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = d0 / (d0 - d1)
        fits = (-1 < t) & (t < 3)
        t = np.where(fits, t, 0)
        f = np.where(t < 0, 1 / 16 - t * (alpha - 1 / 16),
                     np.where(t > 2, 15 / 16 + (t - 2) * (alpha - 15 / 16), np.clip(t, 1 / 16, 15 / 16)))
        return np.where(fits, alpha + np.minimum(1, 4 * abs(d0 - d1)) * (f - alpha), alpha)


# ---------------------------------------------------------------------------------------------------- 8. Triangles

CELL_EDGES = [(c, k) for c in range(8) for k in range(3) if not c >> k & 1]  # M8.4


def faces():
    """M8.5: the corners of each face."""
    for k in range(3):
        u, v = 1 << (k + 1) % 3, 1 << (k + 2) % 3
        yield [c + (1 << k) for c in (0, u, u + v, v)]
        yield [0, v, u + v, u]


def cell_triangles(inside):
    """M8.5, M8.6: triples of cell edges, for a pattern of inside corners."""
    number = {edge: k for k, edge in enumerate(CELL_EDGES)}
    between = lambda a, b: number[min(a, b), (a ^ b).bit_length() - 1]
    successor, faces_of = {}, collections.defaultdict(set)
    for f, corners in enumerate(faces()):
        ring = [(corners[k], corners[(k + 1) % 4]) for k in range(4)]
        for a, b in ring:
            faces_of[between(a, b)].add(f)
        crossed = [(a, b) for a, b in ring if (inside >> a & 1) != (inside >> b & 1)]
        for k, (a, b) in enumerate(crossed):
            if inside >> b & 1:  # enters a run; the next crossed edge leaves it
                successor[between(a, b)] = between(*crossed[(k + 1) % len(crossed)])
    found, left = [], set(successor)
    while left:
        polygon = [min(left)]
        while successor[polygon[-1]] != polygon[0]:
            polygon.append(successor[polygon[-1]])
        left -= set(polygon)
        m = len(polygon)
        at = lambda k: polygon[k % m]
        b = next(b for b in range(m) if not any(faces_of[at(b)] & faces_of[at(b + j)] for j in range(2, m - 1)))
        found += [(at(b), at(b + j), at(b + j + 1)) for j in range(1, m - 1)]
    return found


def triangles(body, alive, keys):
    """M8.4, M8.6: triples of vertices, which are pairs (owner, direction)."""
    vertex = {key: k for k, key in enumerate(keys)}
    inside = np.zeros(body.nodes, int)
    inside[tuple(body.place.T)] = alive
    corners = [np.array([c & 1, c >> 1 & 1, c >> 2 & 1]) for c in range(8)]
    last = body.nodes - 1
    pattern = sum(inside[tuple(slice(a, a + b) for a, b in zip(corner, last))] << c for c, corner in enumerate(corners))
    found, table = [], {}
    cells = np.argwhere((pattern > 0) & (pattern < 255))
    for cell in cells[np.lexsort(cells.T)]:  # x fastest
        shape = int(pattern[tuple(cell)])
        if shape not in table:
            table[shape] = cell_triangles(shape)
        vertices = {}
        for k, (c, axis) in enumerate(CELL_EDGES):
            d = c | 1 << axis
            if (shape >> c & 1) != (shape >> d & 1):
                a = c if shape >> c & 1 else d
                vertices[k] = vertex[int(body.at[tuple(cell + corners[a])]), 2 * axis + (a == d)]
        found += [[vertices[k] for k in triangle] for triangle in table[shape]]
    return np.array(found, int).reshape(-1, 3)
