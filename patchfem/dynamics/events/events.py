"""Coulomb friction exactly from event to event: any modes, any number of interfaces, any drive and free motion.

Between events the motion is the exponential of its linear system, summed to round-off piece by piece (signals,
stick_sets); `run` gives it as phases, one from each event to the next.
"""

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from ...core import ModalBasis, Start
from .engine import Engine
from .signals import TERMS, Signal, combine

__all__ = ["Engine", "Phase", "Signal", "combine", "run"]


@dataclass(frozen=True, eq=False, slots=True)
class Phase:
    """Motion from one event to the next, `span` [s] long from `time` [s] and drive phase `theta`.

    directions: (i,) of slip +1, -1, or stick 0; modal: a Signal of every coordinate; forces: a Signal of every
    interface's friction [N].
    """

    time: float
    theta: float
    span: float
    directions: tuple
    modal: list
    forces: list

    @property
    def direction(self) -> int:
        """Direction of slip of the first interface: +1, -1, or 0 in stick."""
        return self.directions[0]

    @property
    def force(self) -> Signal:
        """Friction Signal of the first interface."""
        return self.forces[0]


def _reaction(piece, row: int, system):
    """Series (TERMS,) of the friction [N] of a stuck face."""
    if isinstance(piece.drive, tuple):
        now, later = piece.drive[1] * sin(piece.theta), [piece.drive[1] * f(piece.theta) for f in (sin, cos)]
    else:
        now, later = piece.drive[0], piece.drive[1:]
    v = piece.coefs[1] / piece.unit
    pull = piece.push - system.square * piece.coefs[0] - system.dampers @ v - system.base * now
    return piece.flow.watch[row] @ np.concatenate([v, pull, later])


def _phase(pieces, count: int, live, system) -> Phase:
    """Pieces from one event to the next as signals."""
    times = np.cumsum([0.0, *(p.span for p in pieces)])
    unit = np.array([p.unit for p in pieces])
    coefs = np.stack([p.coefs for p in pieces])
    modal = [Signal(times, unit, coefs[:, :, i]) for i in range(coefs.shape[2])]
    forces, directions = [Signal(times, unit, np.zeros((len(pieces), TERMS)))] * count, [1] * count
    for row, c in enumerate(live):
        directions[c] = pieces[0].signs[row]
        series = np.zeros((len(pieces), TERMS))
        for k, p in enumerate(pieces):
            series[k, 0] = p.forces[row]
            if p.flow.mask[row]:
                series[k] = _reaction(p, row, system)
        forces[c] = Signal(times, unit, series)
    return Phase(pieces[0].time, pieces[0].theta, float(times[-1]), tuple(directions), modal, forces)


def run(modes: ModalBasis, drive, static, kinetic, duration: float, start: Start | None = None):
    """Yield the phases of a run in order, from rest or `start`, up to `duration` [s]; the last one is cut there.

    static, kinetic [N] >= 0: one for all interfaces or (i,). NotConverged after 1000 phases without progress.
    """
    engine, kept = Engine(modes, drive, static, kinetic, duration / drive.period, start), []
    for piece in engine.pieces():
        if piece.first and kept:
            yield _phase(kept, len(engine.static), engine.live, engine.system)
            kept = []
        kept.append(piece)
    if kept:
        yield _phase(kept, len(engine.static), engine.live, engine.system)
