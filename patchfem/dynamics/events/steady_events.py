"""Periodic response by shooting on the event map: one drive period of the exact engine and its derivative.

The derivative is the product of the pieces' own maps and of the saltation of every event: a perturbation dx moves the
event by dt = -(grad e . dx)/e', so dx+ = R (dx + f- dt) - f+ dt with the motions f before and after and R taking the
velocity of stopped faces out (Leine and Nijmeijer 2004, ch. 7). Its eigenvalues are the Floquet multipliers.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import cos

import numpy as np

from ...core import ModalBasis, PatchfemError, Start, frozen_array
from ..periodic import Grows, Lap, Shooting
from .batches import gather, turning_points, values_at
from .engine import Engine
from .signals import ORDER

LONGEST = 400  # cycles of the run between steps of Newton's method that lead away


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
           periods: int = 1) -> Steady:
    """Periodic response to a sine from rest or `start`, after `cycles` of a run that bring it near.

    drive: one Segment of a sine; static, kinetic [N]: one or (i,). NotConverged as `periodic.Shooting.repeating`,
    PatchfemError for a drive that does not repeat.
    """
    if len(drive.segments) != 1:
        raise PatchfemError("drive: a periodic response needs one sine that goes on; march this one")
    n = modes.omega.size
    begin = np.zeros(2 * n) if start is None else np.concatenate([start.z, start.v])
    shooting = Events(modes, drive, static, kinetic, periods)
    try:
        lap, used = shooting.repeating(shooting.run(begin, cycles), (2 * cycles, LONGEST))
    except Grows as found:
        return _result(modes, found.lap, "unbounded", found.steps)
    return _result(modes, lap, None, used)


class Events(Shooting):
    """The map from event to event over whole periods of a drive; arguments as `steady`."""

    def __init__(self, modes: ModalBasis, drive, static, kinetic, periods: int = 1):
        self.modes, self.drive, self.forces, self.periods = modes, drive, (static, kinetic), periods
        part = drive.segments[0]
        self.moved_by = max(abs(part.amplitude) / part.omega**2 * float(np.abs(modes.base).max()), 1e-300)

    def lap(self, point) -> Lap:
        """The Lap of a state (2n,)."""
        found = period_map(self.modes, self.drive, *self.forces, point, self.periods)
        scale = _size(found, self.modes.omega.size)
        return Lap(point, found, found.slope, scale, (point - found.end) / scale, scale[0] / self.moved_by)

    def moved(self, lap: Lap, step):
        """The state a step away, whose stuck faces stay at rest."""
        return _projected(lap.found.pieces[0].flow, self.modes.omega.size) @ (lap.point + step)

    def after(self, lap: Lap, periods: int):
        """The state after some periods of the run from that of a Lap."""
        return self.run(lap.point, periods)

    def run(self, state, periods: int):
        """The state after some periods of the run."""
        n = self.modes.omega.size
        engine = Engine(self.modes, self.drive, *self.forces, periods, Start(state[:n], state[n:]))
        for _ in engine.pieces():
            pass
        return np.concatenate([engine.z, engine.v])


def _size(one: Map, n: int):
    """Magnitudes of place and rate over the period, for both halves of the state."""
    places = np.array([np.abs(p.coefs).sum(axis=0) for p in one.pieces]).max()
    rates = max(float((np.abs(p.coefs[1:]) * ORDER[1:, None]).sum(axis=0).max() / p.unit) for p in one.pieces)
    moved = max(places, 1e-300)
    return np.concatenate([np.full(n, moved), np.full(n, max(rates, 1e-300))])


def _swing(one: Map, modes) -> float:
    """Half the peak-to-peak output over the period."""
    batch = gather(one.pieces)
    series, share = batch.coefs @ modes.output, batch.share
    piece, u = turning_points(series, share)
    values = series[:, 0], values_at(series, np.arange(len(batch)), share), values_at(series, piece, u)
    return float(np.ptp(np.concatenate(values))) / 2


def _result(modes, lap: Lap, regime, used) -> Steady:
    one, state, n = lap.found, lap.point, modes.omega.size
    signs = np.array([p.signs for p in one.pieces if p.span > 0])
    if regime is None:
        slips = bool(np.any(signs != 0)) or signs.shape[1] == 0
        rests = bool(np.any(signs == 0))
        most = max(one.stops)
        regime = "stuck" if not slips else "sliding" if not rests else f"{most} stop{'s' if most != 1 else ''}"
    return Steady(Start(frozen_array(state[:n]), frozen_array(state[n:])), lap.miss,
                  frozen_array(lap.multipliers(), complex), _swing(one, modes), regime, one.stops, one.alone, used)
