"""The motion with a given set of stuck interfaces, and which set holds after an event.

z'' = P (pull - sum of the slipping faces' pushes), pull = -omega^2 z - D z' - base a(t), P the projector on motions
that leave the stuck faces alone; their friction is what the projection takes. Dependent stuck faces (1-0, 2-0 and 1-2)
share it by least squares: the motion is unique, the split between them is not, and a face that this split would
overload while the others hold it carries its limit and leaves the rest to them.
"""

from itertools import product

import numpy as np

from ...core import NotConverged
from .signals import BERNSTEIN, EPS, ORDER, REACH, TERMS

NOISE = 64 * EPS
FEW, MANY = 4, 8  # interfaces at rest up to which every choice is tried at once, at last


class StickSet:
    """Series of a motion with the faces of `mask` stuck, as linear maps of (v, pull, drive), 2n + d numbers.

    pull (n,) [m/s2] at the piece's start, friction of the slipping faces included: small accelerations keep their
    digits, as they would not if every term were built from z. drive [m/s2]: of a sine of angular frequency omega a sin
    and a cos of its phase there, d = 2; with omega None the coefficients of its series from the second on, d = TERMS -
    1. motion (TERMS, n, 2n + d), its first term without z; watch (i, TERMS, 2n + d): reaction [N] of a stuck
    face, slip rate [m/s] of another; hull: the same in Bernstein form. pinv (n, s), react (i, n): slides to
    coordinates, pull to reactions. tied (i,): faces that the stuck ones hold.
    """

    __slots__ = ("flat", "frozen", "hull", "mask", "motion", "pinv", "project", "react", "size", "stuck", "tied",
                 "watch")

    def __init__(self, system, mask: tuple, omega: float | None, unit: float):
        faces, n, mass = system.faces, system.n, system.mass
        stuck = [c for c, held in enumerate(mask) if held]
        rows = faces[stuck]
        self.mask, self.stuck = mask, stuck
        self.pinv = np.linalg.pinv(rows, rcond=1e-10) if stuck else np.zeros((n, 0))
        project = np.eye(n) - self.pinv @ rows
        self.frozen = bool(stuck) and np.abs(project).max() < 1e-9
        if self.frozen:
            project = np.zeros((n, n))
        self.project = project
        self.tied = [bool(np.linalg.norm(f @ project) < 1e-9 * max(np.linalg.norm(f), 1e-300)) for f in faces]
        self.react = np.zeros((len(faces), n))
        if stuck:
            self.react[stuck] = mass * self.pinv.T
        move, pull = self._series(system, omega, unit)
        self.motion = move[:TERMS]
        rate = move[1:TERMS + 1] * ((ORDER + 1) / unit)[:, None, None]
        self.watch = np.stack([np.einsum("n,knj->kj", self.react[c], pull) if held else
                               np.einsum("n,knj->kj", faces[c], rate) for c, held in enumerate(mask)]) \
            if mask else np.zeros((0, TERMS, move.shape[2]))
        self.size = np.abs(self.watch)
        self.hull = np.einsum("bk,ckj->cbj", BERNSTEIN, self.watch)
        width = move.shape[2]
        self.flat = np.concatenate([self.motion.reshape(-1, width), self.hull.reshape(-1, width)])

    def _series(self, system, omega: float | None, unit: float) -> tuple:
        """Series of the motion (TERMS + 2, n, 2n + d) and of the pull (TERMS, n, 2n + d)."""
        n, drive = system.n, _drive_series(omega, unit)
        pull = np.zeros((TERMS, n, 2 * n + drive.shape[1]))
        move = np.zeros((TERMS + 2, n, pull.shape[2]))
        move[1, :, :n] = np.eye(n) * unit
        pull[0, :, n:2 * n] = np.eye(n)
        for k in range(TERMS):
            if k:
                pull[k] = -system.square[:, None] * move[k] - system.dampers @ move[k + 1] * ((k + 1) / unit)
                pull[k, :, 2 * n:] -= np.outer(system.base, drive[k])
            move[k + 2] = self.project @ pull[k] * (unit * unit / ((k + 1) * (k + 2)))
        return move, pull


def _drive_series(omega: float | None, unit: float) -> np.ndarray:
    """Series (TERMS, d) of the drive after its value at first, per number that says what it does (see StickSet)."""
    if omega is None:
        return np.eye(TERMS)[:, 1:]
    out, turn = np.zeros((TERMS, 2)), 1.0
    for k in range(TERMS):
        out[k] = turn * np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][k % 4])
        turn *= omega * unit / (k + 1)
    return out


class System:
    """Equations of motion of a basis with its interfaces that rub, and the stick sets met so far.

    faces (i, n), static, kinetic (i,) [N] of the interfaces with friction; entries: numbers that say what the drive
    does, 3 of a sine (its constant, a sin, a cos) or the TERMS coefficients of its series.
    """

    def __init__(self, modes, faces, static, kinetic, entries: int = 3):
        self.n, self.mass = modes.omega.size, modes.mass
        self.square, self.dampers, self.base = modes.omega**2, np.asarray(modes.dampers, float), modes.base
        self.faces, self.static, self.kinetic = faces, static, kinetic
        damper = float(np.linalg.norm(self.dampers, 2)) if self.n else 0.0
        self.fastest = float(damper + np.sqrt(damper**2 + 4 * self.square.max())) / 2
        n, self._sets, self._push = self.n, {}, -faces.T / self.mass
        self.given = slice(2 * n + entries, 2 * n + entries + len(faces))
        self.rows = np.zeros((2 * n + entries - 1, self.given.stop))
        self.rows[:n, n:2 * n] = np.eye(n)
        now = np.array([1, 1, 0]) if entries == 3 else np.eye(entries)[0]  # what of the drive acts at once
        self.rows[n:2 * n] = np.concatenate([-np.diag(self.square), -self.dampers, np.outer(-self.base, now),
                                             self._push], 1)
        self.rows[2 * n:, 2 * n + 1:self.given.start] = np.eye(entries - 1)
        self.sizes = np.abs(self.rows)

    def unit(self, rate: float) -> float:
        """Length of a piece [s] under a drive of this rate [1/s]."""
        return REACH / max(self.fastest, rate)

    def stick_set(self, mask: tuple, omega: float | None, unit: float) -> StickSet:
        """The (cached) stick set; mask: a bool per face."""
        key = mask, omega, unit
        if key not in self._sets:
            self._sets[key] = StickSet(self, mask, omega, unit)
        return self._sets[key]

    def push(self, given):
        """Constant friction of the slipping faces (n,) [m/s2]; given (i,) [N], 0 for the others."""
        return self._push @ given


class Entry:
    """Input of a choice: the motion just after an event.

    vector: (2n + d,) = (v, pull without friction, drive) of a StickSet; size: (2n + d,) the magnitudes it was added
    from, which set its round-off. drive: what it does from here on, as `Clock.drive_now` gives it.
    """

    __slots__ = ("size", "vector")

    def __init__(self, system, z, v, *drive):
        state = np.concatenate((z, v, drive))
        end = state.size
        self.vector, self.size = system.rows[:, :end] @ state, system.sizes[:, :end] @ np.abs(state)

    def under(self, system, given) -> tuple:
        """The Entry with the friction `given` (i,) [N] of the slipping faces."""
        column = system.given
        return self.vector + system.rows[:, column] @ given, self.size + system.sizes[:, column] @ np.abs(given)


class Choice:
    """State of the faces after an event.

    signs of slip, 0 where stuck; held: slipping by name only, at its limit but held by others; given: (i,) friction [N]
    of those that do not stick; orders up to which a watched signal is zero at the start.
    """

    __slots__ = ("given", "held", "orders", "signs")

    def __init__(self, signs, held, given, orders):
        self.signs, self.held, self.given, self.orders = signs, held, given, orders


def settle(system: System, entry: Entry, signs, resting, omega: float | None, unit: float) -> Choice:
    """Find the state of the faces just after an event.

    The faces `resting` have v = 0. signs: the first guess, for the others their slip. A choice holds when every stuck
    face is below its limit, or at it and going back, and every slipping face starts to move its own way, told by the
    first derivative that is not zero. NotConverged where no choice does.
    """
    for noise in (NOISE, 1e4 * NOISE):  # the second time for sets of badly conditioned faces
        for guess in _guesses(system, entry, tuple(signs), tuple(resting)):
            choice = _judge(system, entry, guess, resting, omega, unit, noise)
            if choice is not None:
                return choice
    raise NotConverged("dynamics: no state of stick and slip that satisfies the law of friction was found after an "
                       "event; bring friction.kinetic nearer to static, or use method = \"march\"")


def _guesses(system, entry, signs, resting):
    yield signs
    if len(resting) <= FEW:
        choices = sorted(product((0, 1, -1), repeat=len(resting)), key=lambda c: sum(map(abs, c)))
    else:
        choices = _by_squares(system, entry, signs, resting)
    for choice in choices:
        guess = list(signs)
        for c, s in zip(resting, choice):
            guess[c] = s
        if tuple(guess) != signs:
            yield tuple(guess)


def _judge(system, entry, signs, resting, omega, unit, noise) -> Choice | None:
    """The Choice of one guess, None where the law does not hold in it."""
    flow = system.stick_set(tuple([s == 0 for s in signs]), omega, unit)
    held = tuple([s != 0 and flow.tied[c] and c in resting for c, s in enumerate(signs)])
    given, orders = signs * (np.where(held, system.static, system.kinetic) if any(held) else system.kinetic), {}
    full, weight = entry.under(system, given)
    for c in resting:
        if held[c]:
            continue
        if signs[c]:
            order, lead = _leading(flow, c, full, weight, 0.0, signs[c], 1, noise)
            if lead <= 0:
                return None
            orders[c, signs[c]] = order
            continue
        for side in (1, -1):
            order, lead = _leading(flow, c, full, weight, system.static[c], -side, 0, noise)
            if lead < 0:
                return None
            if order and lead > 0:
                orders[c, side] = order
    return Choice(signs, held, given, orders)


def _leading(flow, c: int, full, weight, constant: float, sign: int, order: int, noise: float, last: int = 8) -> tuple:
    """Order and value of the first coefficient of constant + sign * watched signal that is above its round-off.

    The search goes from `order` on; (last, 0) where there is none.
    """
    while order < last:
        value, size = sign * float(flow.watch[c, order] @ full), float(flow.size[c, order] @ weight)
        if order == 0:
            value, size = value + constant, size + abs(constant)
        if abs(value) > noise * size:
            return order, value
        order += 1
    return last, 0.0


def _by_squares(system, entry, signs, resting):
    """Choices for many faces at rest, from forces that minimise the square of the accelerations.

    Then their own choice, within the static limits; or within the kinetic ones, where the law always has a solution; at
    last, for not too many faces, every choice.
    """
    rest = list(resting)
    static = system.static[rest]
    for limit in (static, np.maximum(system.kinetic[rest], 1e-9 * static)):
        yield from _within(system, entry, signs, rest, limit)
    if len(rest) <= MANY:
        yield from sorted(product((0, 1, -1), repeat=len(rest)), key=lambda c: sum(map(abs, c)))


def _within(system, entry, signs, rest, limit):
    """Choices by forces within `limit`, in every combination of the faces that are at theirs without moving."""
    faces, moving = system.faces[rest], np.array(signs)
    moving[rest] = 0
    pull = entry.under(system, moving * system.kinetic)[0][system.n:2 * system.n]
    large, fixed = np.abs(faces) @ np.abs(pull) + np.abs(faces @ faces.T) @ limit / system.mass, {}
    for _ in range(4 * len(rest)):
        force = _forces(faces, system.mass, pull, limit, {k: s * system.kinetic[rest[k]] for k, s in fixed.items()})
        left = faces @ (pull - faces.T @ force / system.mass)
        new = {k: int(np.sign(left[k])) for k in range(len(rest)) if k not in fixed and abs(left[k]) > 1e-7 * large[k]}
        lost = [k for k, s in fixed.items() if s * left[k] < -1e-7 * large[k]]
        if not new and not lost:
            break
        fixed = {k: s for k, s in fixed.items() if k not in lost} | new
    # at its limit, to that weight
    edge = [k for k in range(len(rest)) if k not in fixed and abs(force[k]) > limit[k] * (1 - 1e-6)]
    for choice in sorted(product((1, 0), repeat=min(len(edge), 10)), key=sum, reverse=True):
        slips = fixed | {k: int(np.sign(force[k])) for k, yes in zip(edge, choice) if yes}
        yield tuple(slips.get(k, 0) for k in range(len(rest)))


def _forces(faces, mass: float, pull, limit, fixed):
    """Forces within +-limit that minimise |pull - faces' force/mass|, of those the smallest; `fixed` ones given."""
    from scipy.optimize import lsq_linear

    force = np.zeros(len(limit))
    for k, f in fixed.items():
        force[k] = f
    free = [k for k in range(len(limit)) if k not in fixed]
    if free:
        rows = faces[free].T / mass
        small = 1e-6 * max(np.abs(rows).max(), 1e-300)  # weight that picks the smallest forces among equal ones
        want = np.concatenate([pull - faces.T @ force / mass, np.zeros(len(free))])
        found = lsq_linear(np.concatenate([rows, small * np.eye(len(free))]), want, (-limit[free], limit[free]),
                           method="bvls", tol=1e-14)
        force[free] = found.x
    return force
