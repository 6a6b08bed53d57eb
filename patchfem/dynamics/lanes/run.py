"""Cases of one mode, one interface and a sine as numbers, and their march in lanes."""

from typing import NamedTuple

import numpy as np

from ...compiled import instance, load
from . import names_kernels as at

HERE = "dynamics.lanes"
MASING = "masing", "table"  # laws of Masing's rule, by the curve of their first loading
TERMS = 24  # of a Taylor series over a step; what is left falls below round-off for rates up to 2 a step
BEYOND = 1e300  # place of a yield that there is not
# slide [m] beyond which a march ran away by too long steps, and energies would overflow
AWAY = 1e100
ONCE = 3  # cycles that are read of a motion that repeats


class Cases(NamedTuple):
    """n cases of x'' + D x' + W x = P sin - f in the angle of their drive, x the slide [m].

    damp, square, push (n,): D, W, P; slip, stick (n,): f in a slip and the most of a stick; spring (n,): slope of f in
    a stick, 0 of a rigid contact, length (n,) [m] over which it yields; out, base (n,) [m s-2]: acceleration of the
    output over x'' and of the base over the sine; x, v (n,): start; law (n, k): what else a law asks for, of a law of a
    stretch as its `rate_equation` takes it, of Masing's two numbers of its curve, chi + 1 and q of a power, the share of
    `length` at which half of the friction slips, and the table of a table (`tables_of`).
    """

    damp: np.ndarray
    square: np.ndarray
    push: np.ndarray
    slip: np.ndarray
    stick: np.ndarray
    spring: np.ndarray
    length: np.ndarray
    out: np.ndarray
    base: np.ndarray
    x: np.ndarray
    v: np.ndarray
    law: np.ndarray


class Marched(NamedTuple):
    """Cases after their march: motion (n, STATE) at the start, where the cycles begin that were read, and at the end;
    history (n, c, 4) of all cycles; shown (n, SHOWN); ended, cycles (n,): cycles before those that were read, and how
    many these are; numbers (n, NUMBERS and a table); step: angle."""

    start: np.ndarray
    begun: np.ndarray
    motion: np.ndarray
    history: np.ndarray
    shown: np.ndarray
    ended: np.ndarray
    cycles: np.ndarray
    numbers: np.ndarray
    step: float


def flows(law: str) -> bool:
    """Whether a law is one of a stretch, named as its kernels are: "friction.laws.tanh_kernels"."""
    return "." in law


def kernels(law: str):
    """Load the compiled loop of a law: "rigid", "yielding", "masing", "table" or the kernels of a stretch law."""
    loop = f"{HERE}.loop_kernels"
    if flows(law):
        return instance(loop, {"law": instance(f"{HERE}.flowing_kernels", {"friction": law})})
    if law == "table":
        return instance(loop, {"law": own_state(law)})
    return load(loop) if law == "rigid" else instance(loop, {"law": f"{HERE}.{law}_kernels"})


def own_state(law: str):
    """The kernels that name what a law has of its own in the state of a case; None where it has nothing."""
    if law in ("rigid", "yielding"):
        return None
    if law == "table":
        return instance(f"{HERE}.masing_kernels", {"curve": f"{HERE}.table_curve_kernels"})
    return load(f"{HERE}.{'flowing' if flows(law) else law}_kernels")


def tables_of(groups) -> np.ndarray:
    """(n, m) what Masing's rule asks for of n sets of elements, each (stiffness (t,) [N/m], yield slide (t,) [m],
    rising): two numbers of no meaning, the share of the last yield slide at which half of the friction slips, the table
    of `table_curve_kernels`, which says how many they may be."""
    of = load(f"{HERE}.table_curve_kernels")
    head, whole = np.ones((len(groups), 3)), np.zeros((len(groups), of.SIZE))
    out = whole[:, : of.BEGINS].reshape(len(groups), of.YIELDS, of.COLUMNS)
    out[:, 1:, of.YIELD], out[:, 0, of.SLOPE] = BEYOND, 1.0
    for first, one, of_parts, (k, y) in zip(head, out, whole, groups):
        w, part, t = y / y[-1], k / k.sum(), len(k)
        one[1 : t + 1, of.YIELD] = w
        for column, values in ((of.FORCE, part * w), (of.MOMENT, part * w * w)):
            one[1:, column] = np.append(np.cumsum(values), np.zeros(of.YIELDS - 1 - t))
        # of those that are left: the last has none
        one[1:t, of.SLOPE] = np.cumsum(part[:0:-1])[::-1]
        first[2] = w[np.searchsorted(one[1:t, of.FORCE], 0.5 * one[t, of.FORCE])]
        edges = np.linspace(w[0], w[-1], of.PARTS + 1)
        of_parts[of.BEGINS : of.BEGINS + of.PARTS] = np.searchsorted(w, edges[:-1])
        of_parts[of.LOWEST], of_parts[of.PER_PART] = w[0], of.PARTS / max(w[-1] - w[0], 1e-300)
    return np.concatenate([head, whole], axis=1)


def scales(law: str, force, omega) -> np.ndarray:
    """(n, k) what turns the numbers of a law of a stretch into those of cases; force (n,) [m/N]: of a case over that in
    N; omega (n,) [rad/s]."""
    one = np.ones(np.shape(omega))
    units = {
        "1": one,
        "m": one,
        "m/s": one / omega,
        "s/m": omega,
        "N": force,
        "N/m": force,
        "N_s/m": force * omega,
    }
    return np.stack([units[unit] for unit in load(law).NUMBER_UNITS.split()], axis=-1)


def after(damp, square, h: float, begin: tuple, forces: tuple) -> tuple:
    """(x, x') (n,) after an angle h of x'' + D x' + W x = g from (x, x') `begin`, by its Taylor series.

    forces: derivatives of g at the start, from order 0 on; those left out are 0.
    """
    y = [np.full(damp.shape, float(one)) for one in begin]
    x, v, power = y[0] + h * y[1], y[1], 1.0
    for k in range(TERMS):
        y.append((forces[k] if k < len(forces) else 0.0) - damp * y[k + 1] - square * y[k])
        power *= h / (k + 1)
        x, v = x + y[k + 2] * power * h / (k + 2), v + y[k + 2] * power
    return x, v


def numbers_of(law: str, cases: Cases, steps: int) -> np.ndarray:
    """(n, NUMBERS) of cases that march by so many steps a cycle, and behind them the table of a table."""
    table = cases.law[:, 3:] if law == "table" else np.empty((len(cases.damp), 0))
    found, h = (
        np.concatenate([np.zeros((len(table), at.NUMBERS)), table], axis=1),
        2 * np.pi / steps,
    )
    found[:, at.D - at.NUMBER : at.NUMBERS] = np.array(cases[:9]).T
    if own_state(law):
        found[:, at.H - at.NUMBER], found[:, at.MIDDLE - at.NUMBER] = h, 0.5 / np.cos(h / 2)
        first = at.FIRST_OF_LAW - at.NUMBER
        found[:, first : first + at.OF_LAW] = 1.0
        found[:, first : first + min(at.OF_LAW, cases.law.shape[1])] = cases.law[:, : at.OF_LAW]
        return found
    sine, cosine = (
        [float(np.round(wave(k * np.pi / 2))) for k in range(TERMS)] for wave in (np.sin, np.cos)
    )
    for stiff, first in ((0.0, at.A11), (cases.spring, at.B11)):
        parts = [
            after(cases.damp, cases.square + stiff, h, begin, forces)
            for begin, forces in (
                ((1, 0), ()),
                ((0, 1), ()),
                ((0, 0), (1.0,)),
                ((0, 0), cosine),
                ((0, 0), sine),
            )
        ]
        (xx, vx), (xv, vv), force, *drive = parts
        drive = [cases.push * one for pair in drive for one in pair]
        found[:, first - at.NUMBER : first - at.NUMBER + 10] = np.array(
            [xx, xv, vx, vv, *force, *drive]
        ).T
    return found


def table_of(steps: int) -> np.ndarray:
    """(3, s + 1) sine and cosine at the steps of a cycle, and the step."""
    angle = 2 * np.pi * np.arange(steps + 1) / steps
    waves = np.array([np.sin(angle), np.cos(angle)])
    waves[np.abs(waves) < 1e-15] = 0.0  # so that cycles are alike to the last bit
    return np.concatenate([waves, np.full((1, steps + 1), 2 * np.pi / steps)])


def begun_at(law: str, cases: Cases) -> np.ndarray:
    """(n, STATE and more) motion of cases at their start."""
    own = own_state(law)
    motion = np.zeros((len(cases.damp), at.STATE + (own.OWN_STATE if own else 0)))
    motion[:, at.X], motion[:, at.V], motion[:, at.PLACE] = cases.x, cases.v, cases.x
    motion[:, at.WAY] = np.sign(cases.v) * (cases.spring == 0)
    if flows(law):
        motion[:, at.WAY], motion[:, at.PLACE] = (
            np.where(cases.v == 0, np.sign(cases.push), np.sign(cases.v)),
            0.0,
        )
    if law in MASING:
        way = np.sign(np.select([cases.v != 0, cases.x != 0], [cases.v, -cases.x], cases.push))
        way[way == 0] = 1.0
        first, half = way * cases.length, cases.law[:, 2]
        for place, value in (
            (own.SIDE, way),
            (own.M, 1.0),
            (own.VIRGIN, 1.0),
            (own.FROM, cases.x),
            (own.STIFF, cases.spring),
            (own.NEXT, cases.x + first * half),
        ):
            motion[:, place - at.OWN + at.STATE] = value
        motion[:, at.PLACE] = 0.0
    motion[:, at.HIGH] = motion[:, at.LOW] = cases.x
    return motion


def own_of(law: str, motion, name: str) -> np.ndarray:
    """(n,) a number of the own state of a law by its name."""
    return motion[:, at.STATE + getattr(own_state(law), name) - at.OWN]


def march_on(law: str, cases: Cases, motion, cycles: int, steps: int) -> tuple:
    """(history (n, c, 4), motion at the end) of cases that march over `cycles` more from a motion (n, STATE and
    more), or until they repeat; the last cycle then stands for those that follow."""
    n, history = len(cases.damp), np.zeros((len(cases.damp), cycles, 4))
    ended, motion, numbers = np.zeros(n, np.int64), motion.copy(), numbers_of(law, cases, steps)
    kernels(law).march(
        numbers,
        np.arange(n),
        motion,
        table_of(steps),
        cycles,
        history,
        ended,
        *room_of(numbers, motion),
    )
    for case in np.flatnonzero(ended < cycles):
        history[case, ended[case] :] = history[case, ended[case] - 1]
    return history, motion


def accelerations(law: str, cases: Cases, motion, cycles: int, steps: int) -> np.ndarray:
    """(n, cycles steps + 1) absolute acceleration of the output [m s-2] at every step from a motion (n, STATE and more)
    on."""
    n, numbers, motion = len(cases.damp), numbers_of(law, cases, steps), motion.copy()
    out, ended = np.empty((n, cycles * steps + 1)), np.zeros(n, np.int64)
    kernels(law).read(
        numbers,
        np.arange(n),
        motion,
        table_of(steps),
        cycles,
        np.zeros((n, cycles, 4)),
        ended,
        np.zeros((n, at.SHOWN)),
        out,
        *room_of(numbers, motion),
    )
    return out


def room_of(numbers, motion) -> tuple:
    """Room for the lanes of cases with such numbers and motions, and for the marks of their events."""
    each = at.OWN + motion.shape[1] - at.STATE + numbers.shape[1] - at.NUMBERS
    return np.zeros(each * at.LANES), np.zeros(at.LANES + 1, np.int64)


def march(law: str, cases: Cases, cycles: int, window: int, steps: int) -> Marched:
    """March cases over `cycles` by so many steps each; the last `window` of them are read, fewer of what repeats. All
    numbers of a march that ran away are NaN.
    """
    loop, n = kernels(law), len(cases.damp)
    numbers, table, order = numbers_of(law, cases, steps), table_of(steps), np.arange(n)
    motion, history = begun_at(law, cases), np.zeros((n, cycles, 4))
    start, ended, shown = motion.copy(), np.zeros(n, np.int64), np.zeros((n, at.SHOWN))
    workspace = room_of(numbers, motion)
    loop.march(numbers, order, motion, table, cycles - window, history, ended, *workspace)
    begun, read = motion.copy(), np.where(ended < cycles - window, min(ONCE, window), window)
    for count in np.unique(read).tolist():
        loop.read(
            numbers,
            order[read == count],
            motion,
            table,
            count,
            history,
            ended,
            shown,
            np.empty((n, 0)),
            *workspace,
        )
    done = ended + read
    for case in np.flatnonzero(done < cycles):  # a motion that repeats goes on as it is
        history[case, done[case] :] = history[case, done[case] - 1]
    away = ~(np.abs(history[:, :, :2]).max(axis=(1, 2), initial=0.0) < AWAY)
    for one in (begun, motion, history, shown):
        one[away] = np.nan
    return Marched(start, begun, motion, history, shown, ended, read, numbers, 2 * np.pi / steps)
