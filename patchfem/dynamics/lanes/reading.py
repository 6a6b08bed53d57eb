"""What lanes show of their last cycles, as the numbers that runs from event to event give of theirs."""

import numpy as np

from ..events import names_kernels as of
from ..events.reading import Reading
from . import names_kernels as at
from .run import MASING, Cases, Marched, flows, own_of, own_state


def books(law: str, cases: Cases, found: Marched, energy) -> dict:
    """Energies (n,) [J] of whole runs by name; energy (n,) [kg s-2]: what a square of lengths stands for."""
    h, b, e, first = found.step, found.begun, found.motion, found.start
    left = found.history.shape[1] - found.ended - found.cycles
    sums = {
        k: e[:, k] + left * (e[:, k] - b[:, k]) / found.cycles
        for k in (at.PATH, at.IN, at.LOST, at.POWER)
    }
    (x0, v0), (x1, v1) = ((m[:, at.X], m[:, at.V]) for m in (first, e))
    gains = [
        v * (-cases.damp * v - cases.square * x - _held(law, cases, m))
        for x, v, m in ((x0, v0, first), (x1, v1, e))
    ]
    # the sums are those of the trapezoidal rule; its ends by Euler and Maclaurin
    viscous = h * sums[at.LOST] + h / 2 * (v0**2 - v1**2) + h * h / 6 * (gains[0] - gains[1])
    reach = np.abs(found.history[:, :, :2]).max(axis=(1, 2))
    elastic = _elastic(law, cases, e) - _elastic(law, cases, first)
    lost = sums[at.PATH] - elastic if flows(law) else cases.slip * sums[at.PATH]
    out = {
        "work_in": cases.push * (h * sums[at.IN] + h * h / 12 * (v0 - v1)),
        "viscous": cases.damp * viscous,
        "power": np.abs(cases.push) * h * sums[at.POWER],
        "friction": lost + elastic,
        "lost": lost,
        "stored": 0.5 * (v1**2 - v0**2 + cases.square * (x1**2 - x0**2)),
        "peak_stored": 0.5 * np.maximum(cases.square * reach**2, v0**2 + cases.square * x0**2),
    }
    return {name: energy * value for name, value in out.items()}


def _held(law: str, cases: Cases, motion) -> np.ndarray:
    """Friction where the drive passes 0."""
    x, place, way = (motion[:, k] for k in (at.X, at.PLACE, at.WAY))
    if law in MASING:
        return place
    if flows(law):
        return own_of(law, motion, "FELT")
    return np.where(
        way != 0,
        way * cases.slip,
        -cases.square * x if law == "rigid" else cases.spring * (x - place),
    )


def _elastic(law: str, cases: Cases, motion) -> np.ndarray:
    """Energy in the contact."""
    if law in MASING:
        return _of_sliders(law, cases, motion)
    square = (
        own_of(law, motion, "SQUARE")
        if flows(law)
        else (motion[:, at.X] - motion[:, at.PLACE]) ** 2
    )
    return 0.5 * cases.spring * square


def _of_sliders(law: str, cases: Cases, motion) -> np.ndarray:
    """Energy in the sliders of Masing's rule, as `masing_kernels.energy` has it."""
    own = own_state(law)
    side, m, begun, held, _, energy = (
        motion[:, k - at.OWN + at.STATE] for k in range(own.SIDE, own.ENERGY_FROM + 1)
    )
    far, force = side * (motion[:, at.X] - begun) / m, side * (motion[:, at.PLACE] - held) / m
    w, whole = np.minimum(far / cases.length, 1.0), cases.spring * cases.length**2
    g = force / (cases.spring * cases.length)
    if law == "masing":
        e = cases.law[:, 0]
        work, lost = w * (w / 2 - (w - g) / (e + 2)), e / (e + 2) * w * (w - g)
    else:
        table = cases.law[:, 3 : 3 + own.curve.BEGINS].reshape(
            len(w), own.curve.YIELDS, own.curve.COLUMNS
        )
        last = np.sum(table[:, 1:, own.curve.YIELD] <= w[:, None], axis=1)
        full, moment = (
            table[np.arange(len(w)), last, column] for column in (own.curve.FORCE, own.curve.MOMENT)
        )
        work, lost = (w * (g + full) - moment) / 2, full * w - moment
    work, lost = (whole * one + cases.slip * (far - w * cases.length) for one in (work, lost))
    return energy + m * (side * held * far + m * work - lost)


def reading_of(law: str, cases: Cases, found: Marched, energy, omega, outward) -> Reading:
    """Reading of the last cycles, (n,) runs alike; omega (n,) [rad/s]; outward (n, c, 2) [m]: extremes of the output in
    the cycles at the end."""
    n, b, e = len(omega), found.begun, found.motion
    shown = {
        name: found.shown[:, getattr(at, name) - at.SHOW]
        for name in (
            "ACCELERATION",
            "STARTS",
            "START_COS",
            "START_SIN",
            "SLIP_HIGH",
            "SLIP_LOW",
            "FORCE",
            "STUCK",
            "TURNED",
            "PASSED",
            "FIRST",
            "LAST",
            "F_FIRST",
            "F_LAST",
            "RANGE",
            "SECANT",
            "SEEN",
        )
    }
    run, face, angle = np.zeros((n, of.OF_RUN)), np.zeros((n, of.OF_FACE)), 2 * np.pi * found.cycles
    slide, push, pull, third = harmonics(law, cases, found, angle)
    run[:, of.OUT_LOW], run[:, of.OUT_HIGH] = (
        outward[:, :, 0].min(axis=1),
        outward[:, :, 1].max(axis=1),
    )
    run[:, of.REACH] = np.abs(outward).max(axis=(1, 2))
    run[:, [of.A_COS, of.A_SIN, of.A3_COS, of.A3_SIN]] = (
        np.array([*push, *third]).T / omega[:, None]
    )
    for name in ("ACCELERATION", "STARTS", "START_COS", "START_SIN"):
        run[:, getattr(of, name)] = shown[name]
    last = found.history[:, -outward.shape[1] :]
    face[:, of.LOW], face[:, of.HIGH] = last[..., 0].min(axis=1), last[..., 1].max(axis=1)
    for name, unit in (
        ("SLIP_HIGH", 1.0),
        ("SLIP_LOW", 1.0),
        ("RANGE", 1.0),
        ("FORCE", energy),
        ("TURNED", energy),
        ("PASSED", energy),
        ("STUCK", 1 / omega),
        ("FIRST", 1 / omega),
        ("LAST", 1 / omega),
        ("F_FIRST", energy / omega),
        ("F_LAST", energy / omega),
    ):
        face[:, getattr(of, name)] = unit * shown[name]
    path = e[:, at.PATH] - b[:, at.PATH]  # friction work of a law of a stretch
    face[:, of.WORK] = energy * (
        path
        if flows(law)
        else cases.slip * path + _elastic(law, cases, e) - _elastic(law, cases, b)
    )
    face[:, [of.Q_COS, of.Q_SIN]] = np.array(slide).T / omega[:, None]
    face[:, [of.F_COS, of.F_SIN]] = np.array(pull).T * (energy / omega)[:, None]
    face[:, of.BEGIN], face[:, of.END] = b[:, at.X], e[:, at.X]
    seen = shown["SEEN"] > 0
    face[:, of.SECANT] = np.where(
        seen, energy * shown["SECANT"] / np.where(seen, shown["SEEN"], 1.0), np.nan
    )
    return Reading(run, face[:, None], angle / omega, 2 * np.pi / omega)


def harmonics(law: str, cases: Cases, found: Marched, angle) -> tuple:
    """Integrals with cosine and sine over the last cycles: of the slide, of the acceleration of the output, of the
    friction, which the equation leaves, and of the acceleration with those of three times the angle.

    Those of x'' follow from those of x by parts; the sums of x have their ends by Euler and Maclaurin, to the sixth
    order but for laws of a stretch.
    """
    h, b, e = found.step, found.begun, found.motion
    x, v = b[:, at.X] - e[:, at.X], b[:, at.V] - e[:, at.V]
    a, j = _bends(law, cases, b, e)
    c, s, c3, s3 = (h * found.shown[:, k - at.SHOW] for k in (at.C1, at.S1, at.C3, at.S3))
    two, four = h * h / 12, h**4 / 720
    c, c3 = (
        c + h / 2 * x + two * v - four * (j - 3 * v),
        c3 + h / 2 * x + two * v - four * (j - 27 * v),
    )
    s, s3 = s + two * x - four * (3 * a - x), s3 + 3 * two * x - four * (9 * a - 27 * x)
    gain, side = -v - c, x - s
    push = cases.out * gain, cases.out * side + cases.base * angle / 2
    pull = (
        -gain - cases.damp * (s - x) - cases.square * c,
        cases.push * angle / 2 - side + cases.damp * c - cases.square * s,
    )
    return (c, s), push, pull, (cases.out * (-v - 9 * c3), cases.out * (3 * x - 9 * s3))


def _bends(law: str, cases: Cases, begun, motion) -> tuple:
    """Differences of x'' and of x''' between two motions where the drive passes 0; as if the friction stayed under a
    law of a stretch, whose steps are finer."""
    x, v = (begun[:, k] - motion[:, k] for k in (at.X, at.V))
    if flows(law):
        return -cases.damp * v - cases.square * x, 0 * v
    a = -cases.damp * v - cases.square * x - _held(law, cases, begun) + _held(law, cases, motion)
    one, other = (
        m[:, at.V]
        * (own_of(law, m, "STIFF") if law in MASING else cases.spring * (m[:, at.WAY] == 0))
        for m in (begun, motion)
    )
    return a, -cases.damp * a - cases.square * v - one + other
