"""Periodic response by shooting on the event map: one drive period of the exact engine and its derivative.

The derivative is the product of the pieces' own maps and of the saltation of every event: a perturbation dx moves the
event by dt = -(grad e . dx)/e', so dx+ = R (dx + f- dt) - f+ dt with the motions f before and after and R taking the
velocity of stopped faces out (Leine and Nijmeijer 2004, ch. 7). Its eigenvalues are the Floquet multipliers.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import cos

import numpy as np

from ...core import ModalBasis, NotConverged, PatchfemError, Start, frozen_array
from .batches import gather, turning_points, values_at
from .engine import Engine
from .signals import ORDER


@dataclass(frozen=True, eq=False, slots=True)
class Steady:
    """A motion that repeats from period to period.

    start: state at phase 0 of the drive; residual: |state after a period - start| over the size of the motion;
    multipliers (2n,) complex, largest first: stable where all are < 1 in magnitude (a stuck slide that may rest
    anywhere in a range keeps a 1); amplitude [m]: half the peak-to-peak output; regime: "stuck", "sliding" (no stop
    lasts), "n stops" per period of the interface with the most, or "unbounded"; stops (i,) that last, per period;
    alone: no two events coincide, else the multipliers hold for one order of them; iterations of Newton's method.
    Unbounded: start is the last state of the run, residual and multipliers are those there.
    """

    start: Start
    residual: float
    multipliers: np.ndarray
    amplitude: float
    regime: str
    stops: tuple
    alone: bool
    iterations: int


@dataclass(frozen=True, eq=False, slots=True)
class Map:
    """Map of the state over one period.

    state: x = (z, v) (2n,) at its end; its derivative (2n, 2n); pieces; stops (i,); alone as in Steady.
    """

    end: np.ndarray
    slope: np.ndarray
    pieces: list
    stops: tuple
    alone: bool


def period_map(modes: ModalBasis, drive, static, kinetic, state, periods: int = 1) -> Map:
    """The map of state (2n,) over whole drive periods, by the exact engine."""
    n = modes.omega.size
    engine = Engine(modes, drive, static, kinetic, periods, Start(state[:n], state[n:]))
    pieces = list(engine.pieces())
    system = engine.system
    slope, alone = _projected(pieces[0].flow, n), True
    for piece, after in zip(pieces, [*pieces[1:], None]):
        slope = _piece_map(piece, system) @ slope
        if after is not None and after.first and piece.ends is not None:
            slope = _saltation(piece, after, system) @ slope
            alone = alone and not any(a not in (0, b) for c, (a, b) in enumerate(zip(piece.signs, after.signs))
                                      if c != piece.ends[0])
    stops = [0] * len(engine.static)
    for before, piece in pairwise(pieces):
        for row, c in enumerate(engine.live):
            stops[c] += before.signs[row] != 0 and piece.signs[row] == 0
    return Map(np.concatenate([engine.z, engine.v]), slope, pieces, tuple(stops), alone)


def _projected(flow, n: int):
    out = np.eye(2 * n)
    out[n:, n:] = flow.project
    return out


def _piece_map(piece, system):
    """Derivative (2n, 2n) of the state at a piece's end to that at its start."""
    n, u = system.n, piece.span / piece.unit
    if piece.flow.frozen:
        return _projected(piece.flow, n)
    motion = piece.flow.motion
    place = np.tensordot(u**ORDER, motion, 1)
    rate = np.tensordot(ORDER[1:] * u**ORDER[:-1], motion[1:], 1) / piece.unit
    out = np.empty((2 * n, 2 * n))
    for rows, part in ((slice(0, n), place), (slice(n, 2 * n), rate)):
        out[rows, :n] = -part[:, n:2 * n] * system.square
        out[rows, n:] = part[:, :n] - part[:, n:2 * n] @ system.dampers
    out[:n, :n] += np.eye(n)
    return out


def _ending(piece, system) -> tuple:
    """State (v, a, pull) at a piece's end."""
    n, u = system.n, piece.span / piece.unit
    v = np.zeros(n) if piece.flow.frozen else (ORDER[1:] * u**ORDER[:-1]) @ piece.coefs[1:] / piece.unit
    z = u**ORDER @ piece.coefs
    phase = piece.theta + piece.drive[2] * piece.span
    pull = piece.push - system.square * z - system.dampers @ v - system.base * piece.drive[1] * np.sin(phase)
    return v, piece.flow.project @ pull, phase


def _saltation(piece, after, system):
    """Derivative (2n, 2n) of the state after an event to that before it."""
    n, (face, sign) = system.n, piece.ends
    v, a, phase = _ending(piece, system)
    gradient = np.zeros(2 * n)
    if sign:
        row = piece.flow.react[face]
        gradient[:n], gradient[n:] = -row * system.square, -row @ system.dampers
        speed = gradient[:n] @ v + gradient[n:] @ a - row @ system.base * piece.drive[1] * piece.drive[2] * cos(phase)
    else:
        gradient[n:] = system.faces[face]
        speed = float(system.faces[face] @ a)
    begin = 2 * after.coefs[2] / after.unit**2
    if sign and system.static[face] == system.kinetic[face]:
        jump = np.zeros(2 * n)  # nothing jumps at a release of this kind
    else:
        jump = np.concatenate([np.zeros(n), a - begin])
    out = _projected(after.flow, n)
    if speed != 0:
        out -= np.outer(out @ jump, gradient) / speed
    return out


def steady(modes: ModalBasis, drive, static, kinetic, start: Start | None = None, cycles: int = 30,
           periods: int = 1, tolerance: float = 1e-12, most: int = 60) -> Steady:
    """Periodic response to a sine from rest or `start`, after `cycles` of a run that bring it near.

    drive: one Segment of a sine; static, kinetic [N]: one or (i,). Newton's method on the period map; where it leads
    away, more cycles are run. NotConverged where neither settles, PatchfemError for a drive that does not repeat.
    """
    if len(drive.segments) != 1:
        raise PatchfemError("drive: a periodic response needs one sine that goes on; march this one")
    n = modes.omega.size
    begin = np.zeros(2 * n) if start is None else np.concatenate([start.z, start.v])
    state, used = _after(modes, drive, static, kinetic, begin, cycles), 0
    one = period_map(modes, drive, static, kinetic, state, periods)
    for used in range(1, most + 1):
        miss = one.end - state
        size = _size(one, n)
        better = _newton(modes, drive, static, kinetic, state, one, size, periods)
        if _norm(miss, size, n) <= tolerance:  # the last step squares what is left
            state, one = better or (state, one)
            break
        if better is None:
            cycles = min(2 * cycles, 400)  # Newton's direction leads away: come nearer by more cycles of the run
            state = _after(modes, drive, static, kinetic, state, cycles)
            one = period_map(modes, drive, static, kinetic, state, periods)
        else:
            state, one = better
        if better is None and _grows(modes, drive, static, kinetic, state, one, periods):
            return _result(modes, state, one, n, "unbounded", used)
    else:
        raise NotConverged(f"dynamics: no periodic response after {most} steps of Newton's method; give a start nearer "
                           "to it, or march")
    return _result(modes, state, one, n, None, used - 1)


def _after(modes, drive, static, kinetic, state, cycles: int):
    """State after some cycles of the run."""
    n = modes.omega.size
    engine = Engine(modes, drive, static, kinetic, cycles, Start(state[:n], state[n:]))
    for _ in engine.pieces():
        pass
    return np.concatenate([engine.z, engine.v])


def _size(one: Map, n: int):
    """Magnitudes of place and rate over the period, for both halves of the state."""
    places = np.array([np.abs(p.coefs).sum(axis=0) for p in one.pieces]).max()
    rates = max(float((np.abs(p.coefs[1:]) * ORDER[1:, None]).sum(axis=0).max() / p.unit) for p in one.pieces)
    moved = max(places, 1e-300)
    return np.concatenate([np.full(n, moved), np.full(n, max(rates, 1e-300))])


def _norm(miss, size, n: int) -> float:
    return float(np.abs(miss / size).max()) if size[n] > 1e-299 else 0.0


def _newton(modes, drive, static, kinetic, state, one, size, periods):
    """A better (state, Map) along Newton's direction, None where there is none."""
    n = modes.omega.size
    # least squares: a stuck slide may rest anywhere in a range, which makes the matrix singular
    left = (one.slope - np.eye(2 * n)) * size / size[:, None]
    step = np.linalg.lstsq(left, -(one.end - state) / size, rcond=1e-11)[0] * size
    now = _norm(one.end - state, size, n)
    held = _projected(one.pieces[0].flow, n)
    for share in (1.0, 0.5, 0.2, 0.05):
        trial = held @ (state + share * step)
        try:
            other = period_map(modes, drive, static, kinetic, trial, periods)
        except NotConverged:
            continue
        if _norm(other.end - trial, np.maximum(size, _size(other, n)), n) < (1 - 0.4 * share) * now:
            return trial, other
    return None


def _grows(modes, drive, static, kinetic, state, one, periods) -> bool:
    """Whether the output gains as much in the second of two runs of 60 cycles as in the first."""
    sizes, here = [_swing(one, modes)], state
    for _ in range(2):
        here = _after(modes, drive, static, kinetic, here, 60)
        sizes.append(_swing(period_map(modes, drive, static, kinetic, here, periods), modes))
    first, second = sizes[1] - sizes[0], sizes[2] - sizes[1]
    return first > 1e-6 * sizes[0] and second > 0.99 * first


def _swing(one: Map, modes) -> float:
    """Half the peak-to-peak output over the period."""
    batch = gather(one.pieces)
    series, share = batch.coefs @ modes.output, batch.share
    piece, u = turning_points(series, share)
    values = series[:, 0], values_at(series, np.arange(len(batch)), share), values_at(series, piece, u)
    return float(np.ptp(np.concatenate(values))) / 2


def _result(modes, state, one, n, regime, used) -> Steady:
    values = np.linalg.eigvals(one.slope)
    values = values[np.argsort(-np.abs(values))]
    signs = np.array([p.signs for p in one.pieces if p.span > 0])
    if regime is None:
        slips = bool(np.any(signs != 0)) or signs.shape[1] == 0
        rests = bool(np.any(signs == 0))
        most = max(one.stops)
        regime = "stuck" if not slips else "sliding" if not rests else f"{most} stop{'s' if most != 1 else ''}"
    return Steady(Start(frozen_array(state[:n]), frozen_array(state[n:])), _norm(one.end - state, _size(one, n), n),
                  frozen_array(values, complex), _swing(one, modes), regime, one.stops, one.alone, used)
