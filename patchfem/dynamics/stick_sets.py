"""The motion with a given set of stuck interfaces, and which set holds after an event.

z'' = P (pull - sum of the slipping faces' pushes), pull = -omega^2 z - D z' - base a(t), P the projector on motions
that leave the stuck faces alone; their friction is what the projection takes. Dependent stuck faces (1-0, 2-0 and 1-2)
share it by least squares: the motion is unique, the split between them is not, and a face that this split would
overload while the others hold it carries its limit and leaves the rest to them.
"""

from itertools import product
from math import inf

import numpy as np

from ..core import NotConverged
from .signals import BERNSTEIN, EPS, ORDER, REACH, TERMS, leading

NOISE = 64 * EPS
FEW = 4  # interfaces at rest up to which every choice is tried


class StickSet:
    """Series of a motion with the faces of `mask` stuck, as linear maps of (z, v, push, sine, cosine).

    push (n,) [m/s2]: constant forces per mass, the drive's constant among them; sine, cosine [m/s2]: a sin and a cos of
    the drive's phase at the piece's start. motion (TERMS, n, 3n + 2); watch (i, TERMS, 3n + 2): reaction [N] of a stuck
    face, slip rate [m/s] of another; hull: the same in Bernstein form. pinv (n, s), react (i, n): slides to
    coordinates, pull to reactions. tied (i,): faces that the stuck ones hold.
    """

    __slots__ = ("flat", "frozen", "hull", "mask", "motion", "pinv", "react", "size", "stuck", "tied", "watch")

    def __init__(self, system, mask: tuple, omega: float, unit: float):
        faces, n, mass = system.faces, system.n, system.mass
        stuck = [c for c, held in enumerate(mask) if held]
        rows = faces[stuck]
        self.mask, self.stuck = mask, stuck
        self.pinv = np.linalg.pinv(rows, rcond=1e-10) if stuck else np.zeros((n, 0))
        project = np.eye(n) - self.pinv @ rows
        self.frozen = bool(stuck) and np.abs(project).max() < 1e-9
        if self.frozen:
            project = np.zeros((n, n))
        self.tied = [bool(np.linalg.norm(f @ project) < 1e-9 * max(np.linalg.norm(f), 1e-300)) for f in faces]
        self.react = np.zeros((len(faces), n))
        if stuck:
            self.react[stuck] = mass * self.pinv.T
        pull = np.zeros((TERMS, n, 3 * n + 2))
        move = np.zeros((TERMS + 2, n, 3 * n + 2))
        move[0, :, :n] = np.eye(n)
        move[1, :, n:2 * n] = np.eye(n) * unit
        drive = [(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)]
        turn = 1.0
        for k in range(TERMS):
            pull[k] = -system.square[:, None] * move[k] - system.dampers @ move[k + 1] * ((k + 1) / unit)
            pull[k, :, 3 * n:] += turn * np.outer(system.base, drive[k % 4])
            if k == 0:
                pull[k, :, 2 * n:3 * n] += np.eye(n)
            move[k + 2] = project @ pull[k] * (unit * unit / ((k + 1) * (k + 2)))
            turn *= omega * unit / (k + 1)
        self.motion = move[:TERMS]
        rate = move[1:TERMS + 1] * ((ORDER + 1) / unit)[:, None, None]
        self.watch = np.zeros((len(faces), TERMS, 3 * n + 2))
        for c, held in enumerate(mask):
            self.watch[c] = np.einsum("n,knj->kj", self.react[c], pull) if held else \
                np.einsum("n,knj->kj", faces[c], rate)
        self.size = np.abs(self.watch)
        self.hull = np.einsum("bk,ckj->cbj", BERNSTEIN, self.watch)
        self.flat = np.concatenate([self.motion.reshape(-1, 3 * n + 2), self.hull.reshape(-1, 3 * n + 2)])


class System:
    """Equations of motion of a basis with its interfaces that rub, and the stick sets met so far.

    faces (i, n), static, kinetic (i,) [N] of the interfaces with friction.
    """

    def __init__(self, modes, faces, static, kinetic):
        self.n, self.mass = modes.omega.size, modes.mass
        self.square, self.dampers, self.base = modes.omega**2, np.asarray(modes.dampers, float), modes.base
        self.faces, self.static, self.kinetic = faces, static, kinetic
        damper = float(np.linalg.norm(self.dampers, 2)) if self.n else 0.0
        self.fastest = float(damper + np.sqrt(damper**2 + 4 * self.square.max())) / 2
        self._sets = {}

    def unit(self, omega: float, period: float) -> float:
        """Length of a piece [s] under a drive of angular frequency omega."""
        return REACH / max(self.fastest, omega, 1 / period)

    def stick_set(self, mask: tuple, omega: float, unit: float) -> StickSet:
        """The (cached) stick set; mask: a bool per face."""
        key = mask, omega, unit
        if key not in self._sets:
            self._sets[key] = StickSet(self, mask, omega, unit)
        return self._sets[key]

    def push(self, signs, forces):
        """Constant friction of the slipping faces (n,) [m/s2]."""
        return -(self.faces.T @ (np.asarray(signs) * forces)) / self.mass


class Choice:
    """What the faces do after an event: signs of slip (0: stuck), forces [N] of those that do not stick, and the order
    up to which each watched signal is zero at the start."""

    __slots__ = ("forces", "held", "orders", "signs")

    def __init__(self, signs, held, forces, orders):
        self.signs, self.held, self.forces, self.orders = signs, held, forces, orders


def settle(system: System, entry, signs, resting, omega: float, unit: float) -> Choice:
    """State of the faces just after an event.

    entry (3n + 2,): (z, v, constant drive, sine, cosine) with v = 0 at the faces `resting`; signs: the first guess, for
    the others their slip. A choice holds when every stuck face is below its limit, or at it and going back, and every
    slipping face starts to move its own way, told by the first derivative that is not zero. NotConverged where no
    choice does.
    """
    best = (inf, None)
    for guess in _guesses(system, entry, tuple(signs), tuple(resting), omega, unit):
        miss, choice = _judge(system, entry, guess, resting, omega, unit)
        if miss == 0.0:
            return choice
        best = min(best, (miss, choice), key=lambda pair: pair[0])
    if best[1] is not None and best[0] < 1e-9:
        return best[1]
    raise NotConverged("dynamics: no state of stick and slip satisfies the law of friction after an event; with "
                       "friction.kinetic below static and coupled interfaces there may be none: raise kinetic")


def _guesses(system, entry, signs, resting, omega, unit):
    yield signs
    if len(resting) <= FEW:
        choices = sorted(product((0, 1, -1), repeat=len(resting)), key=lambda c: sum(map(abs, c)))
    else:
        choices = _by_descent(system, entry, signs, resting, omega, unit)
    for choice in choices:
        guess = list(signs)
        for c, s in zip(resting, choice):
            guess[c] = s
        if tuple(guess) != signs:
            yield tuple(guess)


def _judge(system, entry, signs, resting, omega, unit) -> tuple:
    """(relative violation, Choice) of one guess; 0.0: it holds."""
    n = system.n
    flow = system.stick_set(tuple(s == 0 for s in signs), omega, unit)
    held = tuple(bool(s) and c in resting and flow.tied[c] for c, s in enumerate(signs))
    forces = np.where(held, system.static, system.kinetic)
    full = entry.copy()
    full[2 * n:3 * n] += system.push(signs, forces)
    weight = np.abs(entry)
    weight[2 * n:3 * n] += np.abs(system.faces.T) @ (np.abs(signs) * forces) / system.mass
    orders, worst = {}, 0.0
    for c in resting:
        if held[c]:
            continue
        coefs, noise = flow.watch[c] @ full, NOISE * (flow.size[c] @ weight)
        if signs[c]:
            coefs[0] = 0.0
            order, sign = leading(signs[c] * coefs, noise)
            if sign <= 0:
                size = noise / NOISE
                worst = max(worst, abs(coefs[order]) / size[order] if sign else 1.0)
            orders[c, signs[c]] = order
            continue
        for side in (1, -1):
            margin = -side * coefs
            margin[0] += system.static[c]
            noise[0] += NOISE * system.static[c]
            order, sign = leading(margin, noise)
            if sign < 0:
                worst = max(worst, abs(margin[order]) / max(noise[order] / NOISE, 1e-300))
            if order and sign > 0:
                orders[c, side] = order
    return worst, Choice(signs, held, forces, orders)


def _by_descent(system, entry, signs, resting, omega, unit):
    """Choices for many faces at rest: forces that minimise the square of the accelerations within the static limits,
    face by face; then both choices for every face left at its limit without acceleration."""
    n, rest = system.n, list(resting)
    faces = system.faces[rest]
    moving = [0 if c in resting else s for c, s in enumerate(signs)]
    full = entry.copy()
    full[2 * n:3 * n] += system.push(moving, system.kinetic)
    free = system.stick_set((False,) * len(signs), omega, unit)
    pull = 2 / unit**2 * (free.motion[2] @ full)
    gram, want = faces @ faces.T / system.mass, faces @ pull
    fixed = {}
    for _ in range(4 * len(rest)):
        force = _box(gram, want, system.static[rest], {k: s * system.kinetic[rest[k]] for k, s in fixed.items()})
        left = want - gram @ force
        tiny = 1e-10 * (np.abs(want) + np.abs(gram) @ system.static[rest])
        new = {k: int(np.sign(left[k])) for k in range(len(rest)) if k not in fixed and abs(left[k]) > tiny[k]}
        lost = [k for k, s in fixed.items() if s * left[k] < -tiny[k]]
        if not new and not lost:
            break
        fixed = {k: s for k, s in fixed.items() if k not in lost} | new
    edge = [k for k in range(len(rest)) if k not in fixed
            and abs(force[k]) > system.static[rest[k]] * (1 - 1e-9)]
    for choice in sorted(product((0, 1), repeat=min(len(edge), 10)), key=sum):
        slips = fixed | {k: int(np.sign(force[k])) for k, yes in zip(edge, choice) if yes}
        yield tuple(slips.get(k, 0) for k in range(len(rest)))


def _box(gram, want, limit, fixed):
    """Forces within +-limit that minimise F gram F/2 - want F, `fixed` ones given: coordinate descent."""
    force = np.zeros(len(want))
    for k, f in fixed.items():
        force[k] = f
    free = [k for k in range(len(want)) if k not in fixed]
    for _ in range(20_000):
        change = 0.0
        for k in free:
            new = force[k] + (want[k] - gram[k] @ force) / gram[k, k]
            new = min(max(new, -limit[k]), limit[k])
            change = max(change, abs(new - force[k]) / max(limit[k], 1e-300))
            force[k] = new
        if change < 1e-14:
            break
    return force
