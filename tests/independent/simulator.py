"""The simulator once more, in numpy alone, from the equations of docs/design/method.md: the step (§3, §11), contacts,
detection (§4), removal, splitting (§5), merging (§6). It shares nothing with the program: no line, no library, no
intermediate result. What it is given is a setup and a first state (recording.py): particles, clusters, and by how much
the outside world moves blade and grips in each substep.

What it does not do is refused by name: the rule `published`, expansion by more than one layer, a
geometric blade that turns, and frictionless walls beside a blade. No skin is made. Lengths in m, points [3, n].

`Wrong` makes it a wrong simulator on purpose, so that a test can show that it would be found."""
import dataclasses

import numpy as np

TOUCH_MARGIN = 1 / 1024  # h, method.md §11
MOST_TURNS = 16  # of blade and walls, method.md §3
MOST_ITERATIONS = 2000  # where a substep is solved


@dataclasses.dataclass
class Wrong:
    damping: float = 1.0  # times the rate
    relaxation: float | None = None  # instead of s = k dt² / (1 + k dt²): the same whatever dt
    late_gravity: bool = False  # gravity moves a particle one substep later than it should
    decay: float | None = None  # of velocities in a substep, whatever dt
    detect_late: bool = False  # detection sees the positions at which the frame began
    retardation: float = 1.0  # times the time
    keep_cut_clusters: bool = False  # clusters that lost a particle are not split


def sums(values, offsets):
    """Of the last axis, over [offsets[k], offsets[k + 1]); none of these is empty."""
    return np.add.reduceat(values, offsets[:-1], axis=-1)


class Cover:
    """Clusters as lists of members; what the step needs of them (method.md §2, Rest frames)."""

    def __init__(self, sets, rotations, rest, mass):
        self.sets, self.rotations = sets, rotations
        self.cluster = np.repeat(np.arange(len(sets)), [len(s) for s in sets])
        self.member = np.concatenate(sets) if sets else np.zeros(0, int)
        self.offsets = np.concatenate([[0], np.cumsum([len(s) for s in sets])]).astype(int)
        self.holders = np.bincount(self.member, minlength=len(mass))  # n_i
        self.weight = mass[self.member] / self.holders[self.member]
        self.mass = sums(self.weight, self.offsets)
        self.center = sums(self.weight * rest[:, self.member], self.offsets) / self.mass
        self.arm = rest[:, self.member] - self.center[:, self.cluster]
        # The same memberships, particle by particle.
        self.by_particle = np.argsort(self.member, kind="stable")
        self.held = np.flatnonzero(self.holders)
        self.held_offsets = np.concatenate([[0], np.cumsum(self.holders[self.held])]).astype(int)

    def goals(self, x):
        """Mean of the best rigid fits of each particle's clusters; of particles in none, where they are."""
        at = x[:, self.member]
        mean = sums(self.weight * at, self.offsets) / self.mass
        self.rotations = best_rotations(self.moments(x), self.rotations)
        fit = mean[:, self.cluster]
        for i in range(3):
            for k in range(3):
                fit[i] += self.rotations[:, i, k][self.cluster] * self.arm[k]
        goal = x.copy()
        goal[:, self.held] = sums(fit[:, self.by_particle], self.held_offsets) / self.holders[self.held]
        return goal

    def moments(self, x):
        """A of each cluster [C, 3, 3]."""
        at = x[:, self.member]
        off = self.weight * (at - (sums(self.weight * at, self.offsets) / self.mass)[:, self.cluster])
        return np.stack([sums(off[i] * self.arm, self.offsets).T for i in range(3)], axis=1)


def best_rotations(moment, previous):
    """argmax of tr(Rᵀ A) over rotations. Of a matrix that is far from singular and has a positive determinant it is the
    orthogonal factor of the polar decomposition, by Newton's iteration (Higham 1986)."""
    best = np.empty_like(moment)
    scale = np.sqrt((moment**2).sum(axis=(1, 2)))
    plain = np.linalg.det(moment) > 1e-3 * scale**3
    best[~plain] = by_singular_values(moment[~plain], previous[~plain])
    x = np.ascontiguousarray((moment[plain] / scale[plain, None, None]).transpose(1, 2, 0))
    for _ in range(30):
        cofactors = np.stack([cross(x[1], x[2]), cross(x[2], x[0]), cross(x[0], x[1])])
        inverse = cofactors / (x[0] * cofactors[0]).sum(axis=0)  # transposed
        gamma = np.sqrt(np.sqrt((inverse**2).sum(axis=(0, 1)) / (x**2).sum(axis=(0, 1))))
        new = (gamma * x + inverse / gamma) / 2
        change = np.abs(new - x).max(initial=0)
        x = new
        if change < 1e-9:  # converges quadratically: what is left is rounding
            break
    best[plain] = x.transpose(2, 0, 1)
    return best


def cross(a, b):
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def by_singular_values(moment, previous):
    """The same of any matrix; where the answer is not unique, of the best ones the nearest to the previous one."""
    u, sigma, vt = np.linalg.svd(moment)
    sign = np.where(np.linalg.det(u) * np.linalg.det(vt) < 0, -1.0, 1.0)
    least = sigma[:, 1] + sign * sigma[:, 2]
    last = u.copy()
    last[:, :, 2] *= sign[:, None]
    best = last @ vt
    for c in np.flatnonzero(least <= 1e-12 * sigma[:, 0]):
        if sigma[c, 0] == 0:
            best[c] = previous[c]
            continue
        # u₁ v₁ᵀ is certain; beside it any turn about it is as good, and tr of this block is what the previous one wants.
        block = last[c].T @ previous[c] @ vt[c].T
        angle = np.arctan2(block[2, 1] - block[1, 2], block[1, 1] + block[2, 2])
        turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
        best[c] = last[c] @ turn @ vt[c]
    return best


class Blade:
    """A plate in one substep: poses before and after (edge, along, back), method.md §3."""

    def __init__(self, setup, before, after):
        self.half, self.depth, self.friction = setup.blade_length / 2, setup.blade_depth, setup.blade_friction
        self.clearance = 1.001 * max(setup.blade_thickness, setup.epsilon * setup.h) / 2
        self.before, self.after = self.frame(before), self.frame(after)

    @staticmethod
    def frame(pose):
        edge, along, back = pose
        return edge[:, None], np.stack([along, back, np.cross(along, back)])  # rows: axes of (u, w, n)

    @staticmethod
    def local(frame, x):
        return frame[1] @ (x - frame[0])

    def sides(self, x):
        return np.where(self.local(self.before, x)[2] < 0, -1.0, 1.0)

    def over(self, c):
        return (np.abs(c[0]) < self.half) & (c[1] > 0) & (c[1] < self.depth)

    def from_plate(self, c):
        on = np.stack([np.clip(c[0], -self.half, self.half), np.clip(c[1], 0, self.depth), np.zeros_like(c[0])])
        return c - on

    def way_off(self, x, side):
        """The shortest way to where a particle may be that began the substep on `side`; zero if it may be at x."""
        c, rho = self.local(self.after, x), self.clearance
        way = np.zeros_like(c)
        over, height = self.over(c), side * c[2]
        near = over & (height >= 0) & (height < rho)
        way[2, near] = (side * rho - c[2])[near]
        through = np.flatnonzero(over & (height < 0))
        if len(through):
            t, s = c[:, through], side[through]
            zero = np.zeros_like(s)
            beside = -s * np.maximum(np.abs(t[2]), rho) - t[2]
            ways = np.stack([np.stack([zero, zero, s * rho - t[2]]), np.stack([zero, -t[1], beside]),
                             np.stack([zero, self.depth - t[1], beside]), np.stack([-self.half - t[0], zero, beside]),
                             np.stack([self.half - t[0], zero, beside])])
            way[:, through] = ways[np.argmin((ways**2).sum(axis=1), axis=0), :, np.arange(len(through))].T
        off = self.from_plate(c)
        distance = np.sqrt((off**2).sum(axis=0))
        rim = ~over & (distance < rho) & (distance > 0)
        way[:, rim] = ((rho - distance[rim]) / distance[rim]) * off[:, rim]
        border = ~over & (distance == 0)
        way[2, border] = side[border] * rho
        return self.after[1].T @ way

    def gap(self, x, side):
        c = self.local(self.after, x)
        return np.where(self.over(c), side * c[2], np.sqrt((self.from_plate(c)**2).sum(axis=0))) - self.clearance

    def carried(self, x):
        """How far the blade's own point at x has come in this substep."""
        return x - (self.before[0] + self.before[1].T @ self.local(self.after, x))


class Contacts:
    def __init__(self, setup, blade, start):
        self.setup, self.blade, self.start = setup, blade, start
        self.side = blade.sides(start) if blade else np.ones(start.shape[1])
        self.any = bool(setup.walls) or blade is not None
        self.rubs = any(w.friction > 0 for w in setup.walls) or (blade is not None and blade.friction > 0)
        self.path_matters = blade is not None or self.rubs
        if blade and setup.walls and not self.rubs:
            raise NotImplementedError("frictionless walls beside a blade")

    def on_walls(self, x):
        x = x.copy()
        for wall in self.setup.walls:
            outside = wall.side * (x[wall.axis] - wall.offset) < 0
            x[wall.axis, outside] = wall.offset
        return x

    def allowed(self, x):
        """Blade, then walls and blade in turn, the blade last. And whether both have moved a particle."""
        both = np.zeros(x.shape[1], bool)
        if not self.blade:
            return self.on_walls(x), both
        way = self.blade.way_off(x, self.side)
        by_blade = (way != 0).any(axis=0)
        x = x + way
        if not self.setup.walls:
            return x, both
        going = np.arange(x.shape[1])
        for _ in range(MOST_TURNS):
            inside = self.on_walls(x[:, going])
            moved = (inside != x[:, going]).any(axis=0)
            going, inside = going[moved], inside[:, moved]
            if not len(going):
                break
            way = self.blade.way_off(inside, self.side[going])
            again = (way != 0).any(axis=0)
            x[:, going] = inside + way
            by_blade[going] |= again
            both[going] |= by_blade[going]
            going = going[again]
        return x, both

    def project(self, free):
        if not self.any:
            return free
        projected, both = self.allowed(free)
        touched = (projected != free).any(axis=0) | both
        if not self.rubs or not touched.any():
            return projected
        result = projected.copy()

        def rub(slid, normal, reach, where):
            along = slid - (slid * normal).sum(axis=0) * normal
            length = np.sqrt((along**2).sum(axis=0))
            where = where & (length > 0)
            share = np.minimum(1, reach[where] / length[where])
            result[:, where] -= share * along[:, where]

        for wall in self.setup.walls:
            depth = wall.side * (wall.offset - free[wall.axis])
            if wall.friction > 0:
                normal = np.zeros((3, 1))
                normal[wall.axis] = wall.side
                rub(result - self.start, normal, wall.friction * depth, touched & (depth > 0))
        if self.blade and self.blade.friction > 0:
            way = self.blade.way_off(free, self.side)
            depth = np.sqrt((way**2).sum(axis=0))
            normal = way / np.where(depth > 0, depth, 1)
            rub(result - self.start - self.blade.carried(result), normal, self.blade.friction * depth,
                touched & (depth > 0))
        result[:, ~touched] = projected[:, ~touched]
        return self.allowed(result)[0]

    def touching(self, x):
        margin = TOUCH_MARGIN * self.setup.h
        found = np.zeros(x.shape[1], bool)
        for wall in self.setup.walls:
            found |= wall.side * (x[wall.axis] - wall.offset) < margin
        if self.blade:
            found |= self.blade.gap(x, self.side) < margin
        return found


class Simulator:
    def __init__(self, setup, state, wrong=None, solve_to=None):
        """`solve_to`: iterate until no particle moves by more than this [h], instead of a number of times."""
        self.setup, self.wrong, self.solve_to = setup, wrong or Wrong(), solve_to
        for name, given, known in (("solver", setup.solver, ("implicit",)), ("depth", setup.depth, (1,)),
                                   ("merge", setup.merge, ("none", "deterministic")),
                                   ("expand", setup.expand, ("none", "edge_cover"))):
            if given not in known:
                raise NotImplementedError(f"{name}: {given}")
        self.x, self.v = state.x.copy(), state.v.copy()
        self.alive = state.alive.copy()
        self.tau, self.cap, self.edge_covered = state.tau, state.cap, state.edge_covered
        self.cover = Cover(list(state.clusters), state.rotations.copy(), setup.rest, setup.mass)
        self.frame = 0

    # §3, §11
    def substep(self, index, dt):
        setup, wrong = self.setup, self.wrong
        move = setup.moves[index] if setup.moves else None
        lowered = move is not None and move.down and setup.criterion != "geometric"
        blade = Blade(setup, move.before, move.after) if lowered else None
        start = self.x
        contacts = Contacts(setup, blade, start)
        held, shift = np.zeros(start.shape[1], bool), np.zeros_like(start)
        for grip in setup.grips:
            if grip.active[index]:
                held[grip.particles] = True
                shift[:, grip.particles] = grip.displacement[index][:, None]
        predicted = start + dt * self.v
        if not wrong.late_gravity:
            predicted = predicted + dt * dt * setup.gravity[:, None]
        free_to_move = ~held & self.alive & (self.cover.holders > 0)
        still = ~free_to_move & ~held  # dead, or in no cluster
        x = contacts.project(predicted)
        x[:, held] = (start + shift)[:, held]
        x[:, still] = start[:, still]
        # Elasticity acts τ later: at y = x + τ v, v = (x - start) / dt, where the same force makes the same motion.
        lead = setup.retardation * wrong.retardation / dt
        to_y, to_x = (lambda x: x + lead * (x - start)), (lambda y: (y + lead * start) / (1 + lead))
        aim = to_y(predicted)
        stiff = setup.stiffness * dt * dt * (1 + lead)
        s = stiff / (1 + stiff) if wrong.relaxation is None else wrong.relaxation
        before, omega = x, 1.0
        b = min(s, 0.95)
        rho = b / (2 - b)
        for j in range(setup.iterations if self.solve_to is None else MOST_ITERATIONS):
            plain = to_x(aim + s * (self.cover.goals(to_y(x)) - aim))
            if setup.acceleration == "chebyshev" and j > 0:
                omega = 2 / (2 - rho * rho) if j == 2 else omega if j == 1 else 4 / (4 - rho * rho * omega)
                mixed = x + omega * 2 / (2 - b) * (plain - x) + (omega - 1) * (x - before)
                if contacts.path_matters:
                    touched = contacts.touching(mixed) | contacts.touching(plain)
                    mixed[:, touched] = plain[:, touched]
            else:
                mixed = plain
            new = contacts.project(mixed)
            new[:, ~free_to_move] = x[:, ~free_to_move]
            before, x = x, new
            if self.solve_to is not None and np.abs(x - before).max(initial=0) < self.solve_to * setup.h:
                break
        decay = np.exp(-wrong.damping * setup.damping * dt) if wrong.decay is None else wrong.decay
        self.v = decay * (x - start) / dt
        if wrong.late_gravity:
            self.v = self.v + dt * setup.gravity[:, None]
        self.x = x

    # §4
    def edges(self):
        """Of G: both ends alive."""
        e = self.setup.edges
        return e[:, self.alive[e[0]] & self.alive[e[1]]]

    def detect(self, first, x):
        setup, e = self.setup, self.edges()
        lowered = [m for m in setup.moves[first:first + setup.substeps] if m.down] if setup.moves else []
        if setup.criterion == "none" or not (setup.moves or setup.without_blade):
            return np.zeros(0, int)
        if setup.criterion == "strain":
            arm, cover = self.cover.arm, self.cover
            at_rest = np.stack([sums(cover.weight * arm[i] * arm, cover.offsets).T for i in range(3)], axis=1)
            gradient = cover.moments(x) @ np.linalg.pinv(at_rest, rcond=1e-9, hermitian=True)
            stretched = np.flatnonzero(np.linalg.svd(gradient, compute_uv=False)[:, 0] > setup.strain)
            return np.unique(np.concatenate([cover.sets[c] for c in stretched] or [np.zeros(0, int)]))
        length = np.sqrt(((x[:, e[0]] - x[:, e[1]])**2).sum(axis=0))
        if setup.criterion == "geometric":
            stretch = np.zeros(x.shape[1])
            for end in e:
                np.maximum.at(stretch, end, length)
            reach = (1 + 1e-9) * np.maximum(stretch, max(setup.blade_thickness, setup.h)) / 2
            gone = np.zeros(x.shape[1], bool)
            for m in lowered:
                gone |= distance_from_sweep(setup, m, x) <= reach
            return np.flatnonzero(gone & self.alive)
        is_open = length > setup.epsilon * setup.h
        e = e[:, is_open]
        if setup.remove == "both":
            return np.unique(e)
        count = np.bincount(e.ravel(), minlength=x.shape[1])
        lower, upper = e.min(axis=0), e.max(axis=0)
        goes = np.where(count[upper] > count[lower], upper, lower)
        if lowered:
            edge, along, back = lowered[-1].after
            above = np.cross(along, back) @ (x - edge[:, None]) >= 0
            parted = above[lower] != above[upper]
            goes = np.where(parted, np.where(above[lower], upper, lower), goes)
        return np.unique(goes)

    # §5
    def split(self, removed):
        gone = np.zeros(self.x.shape[1], bool)
        gone[removed] = True
        self.alive = self.alive & ~gone
        if self.setup.debris:
            for piece in components(np.flatnonzero(self.alive), self.neighbours()):
                if len(piece) < self.setup.debris:
                    gone[piece] = True
                    self.alive[piece] = False
        neighbours = self.neighbours()
        sets, rotations, new = [], [], []
        for members, rotation in zip(self.cover.sets, self.cover.rotations):
            left = members[~gone[members]]
            if len(left) == len(members) or self.wrong.keep_cut_clusters:
                pieces = [left] if len(left) else []
            else:
                pieces = components(left, neighbours)
            for piece in pieces[:1]:
                sets.append(piece)
                rotations.append(rotation)
            if not pieces:  # its number stays free until the frame ends
                sets.append(left)
                rotations.append(rotation)
            new += [(piece, rotation) for piece in pieces[1:]]
        return sets + [piece for piece, _ in new], rotations + [rotation for _, rotation in new]

    def neighbours(self):
        found = [[] for _ in range(self.x.shape[1])]
        for i, j in self.edges().T.tolist():
            found[i].append(j)
            found[j].append(i)
        return found

    # §6
    def merge(self, sets):
        """Which clusters there are then: members by number."""
        now = {number: set(members.tolist()) for number, members in enumerate(sets) if len(members)}
        if self.setup.merge == "none":
            return now
        neighbours = self.neighbours()
        holders = [set() for _ in range(self.x.shape[1])]
        for number, members in now.items():
            for i in members:
                holders[i].add(number)
        turn = 0
        while True:
            proposals = {}
            for s, members in now.items():
                if len(members) >= self.tau:
                    continue
                touched = set()
                for i in members:
                    touched |= holders[i]
                    for j in neighbours[i]:
                        touched |= holders[j]
                touched.discard(s)
                may = [t for t in touched if len(members | now[t]) <= self.cap or members <= now[t]]
                if may:
                    t = min(may, key=lambda t: (len(now[t]), t))
                    low, high = min(s, t), max(s, t)
                    proposals[s] = ((mix(0x9E3779B9 * low ^ 0x85EBCA6B * high ^ 0xC2B2AE35 * turn), low, high, s), t)
            if not proposals:
                return now
            least = {}
            for s, (key, t) in proposals.items():
                for named in (s, t):
                    least[named] = min(least.get(named, key), key)
            for s, (key, t) in proposals.items():
                if least[s] == key and least[t] == key:
                    for i in now[s]:
                        holders[i].discard(s)
                        holders[i].add(t)
                    now[t] = now[t] | now.pop(s)
            turn += 1

    # §7
    def expand(self, now):
        """For every edge that no cluster contains the smaller cluster of one end takes in the other end."""
        if self.setup.expand == "none" or self.edge_covered:
            return
        holders = [set() for _ in range(self.x.shape[1])]
        for number, members in now.items():
            for i in members:
                holders[i].add(number)
        taken = []
        for i, j in self.edges().T.tolist():
            if not holders[i] & holders[j]:
                _, number, other = min((len(now[c]), c, other) for end, other in ((i, j), (j, i)) for c in holders[end])
                taken.append((number, other))
        for number, other in taken:
            now[number] = now[number] | {other}
        self.edge_covered = True

    # §9
    def run_frame(self):
        setup, substeps = self.setup, self.setup.substeps
        began = self.x
        for k in range(substeps):
            self.substep(self.frame * substeps + k, setup.substep_length[self.frame])
        removed = self.detect(self.frame * substeps, began if self.wrong.detect_late else self.x)
        if len(removed):
            sets, rotations = self.split(removed)
            sets = self.merge(sets)
            self.expand(sets)
            numbers = sorted(sets)
            self.cover = Cover([np.array(sorted(sets[k])) for k in numbers],
                               np.array([rotations[k] for k in numbers]).reshape(-1, 3, 3), setup.rest, setup.mass)
        self.frame += 1


def components(particles, neighbours):
    """Connected components of what some particles induce, by smallest particle; each ascending."""
    left, found = set(particles.tolist()), []
    for first in sorted(left):
        if first not in left:
            continue
        piece, front = [], [first]
        left.discard(first)
        while front:
            i = front.pop()
            piece.append(i)
            for j in neighbours[i]:
                if j in left:
                    left.discard(j)
                    front.append(j)
        found.append(np.array(sorted(piece)))
    return found


def mix(x):
    x &= 0xFFFFFFFF
    x ^= x >> 16
    x = x * 0x7FEB352D & 0xFFFFFFFF
    x ^= x >> 15
    x = x * 0x846CA68B & 0xFFFFFFFF
    return x ^ x >> 16


def distance_from_sweep(setup, move, x):
    """From what the mid-surface sweeps while it moves without turning: all edge + a along + b back + c way, a, b, c
    within a box. The nearest point has each of the three at its low end, at its high end, or free; all 27 are tried,
    and those that lie in the box count."""
    if not (np.allclose(move.before[1], move.after[1], atol=1e-12, rtol=0) and
            np.allclose(move.before[2], move.after[2], atol=1e-12, rtol=0)):
        raise NotImplementedError("a geometric blade that turns")
    edge, along, back = move.before
    axes = np.stack([along, back, move.after[0] - edge])
    low, high = np.array([-setup.blade_length / 2, 0, 0]), np.array([setup.blade_length / 2, setup.blade_depth, 1])
    off = x - edge[:, None]
    best = np.full(x.shape[1], np.inf)
    for choice in np.ndindex(3, 3, 3):
        free = [k for k in range(3) if choice[k] == 2]
        fixed = np.array([(low, high, low * 0)[choice[k]][k] for k in range(3)])
        rest = off - (fixed @ axes)[:, None]
        inside = np.ones(x.shape[1], bool)
        if free:
            basis = axes[free]
            gram = basis @ basis.T
            scale = np.sqrt(np.diag(gram))
            if (scale == 0).any() or np.linalg.det(gram / np.outer(scale, scale)) < 1e-12:
                continue  # on a line of nearest points one has another coordinate at an end
            coordinates = np.linalg.solve(gram, basis @ rest)
            for k, c in zip(free, coordinates):
                inside &= (c >= low[k]) & (c <= high[k])
            rest = rest - basis.T @ coordinates
        best[inside] = np.minimum(best[inside], np.sqrt((rest[:, inside]**2).sum(axis=0)))
    return best
