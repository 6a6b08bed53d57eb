"""Steady response of one mode with one Coulomb interface under a sine, found directly as a periodic motion."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ...compiled import load
from ...core import ModalBasis, PatchfemError, Start
from . import orbit_kernels
from .jenkins import Jenkins
from .sdof import scene_of


class Regime(StrEnum):
    """How the interface moves in steady motion.

    UNSETTLED: no periodic motion was found.
    """

    STUCK = "stuck"
    STOPS = "stops"
    SLIDING = "sliding"
    UNBOUNDED = "unbounded"
    UNSETTLED = "unsettled"


@dataclass(frozen=True, eq=False, slots=True)
class Steady:
    """A steady motion of one mode.

    stops: sticks per drive cycle; amplitude: half peak to peak of the output [m]; starts: drive phases [rad] at which
    slips begin out of a stick; stick_fraction of the time; multipliers: of a small disturbance (z, v) over the time
    after which the motion repeats, `periods` drive periods (0: lost in a stick); condition: change of amplitude
    omega^2/|base a| per change of D, static friction over the drive's force; symmetric: the second half turns the first
    over; residual of the periodicity over the amplitude.
    """

    regime: Regime
    stops: float
    amplitude: float
    starts: np.ndarray
    stick_fraction: float
    multipliers: tuple
    condition: float
    periods: int
    symmetric: bool
    residual: float


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """A frequency response, arrays (k,) with the meanings of Steady.

    omega [rad/s] of the drive; regime: of Regime; stops; amplitude [m]; stick_fraction; multiplier: the larger one;
    condition; residual.
    """

    omega: np.ndarray
    regime: np.ndarray
    stops: np.ndarray
    amplitude: np.ndarray
    stick_fraction: np.ndarray
    multiplier: np.ndarray
    condition: np.ndarray
    residual: np.ndarray


REGIMES = tuple(Regime)  # in the order of the codes of `orbit_kernels`


def _row(modes: ModalBasis, drive, static: float, kinetic: float, start: Start | None) -> tuple:
    """(w, decay, static, kinetic, B, om, z, v) of a case, and output over coordinate. PatchfemError for a drive that is
    not one sine without a constant part."""
    parts = drive.segments
    if len(parts) != 1 or parts[0].constant != 0 or parts[0].omega <= 0 or parts[0].phase != 0:
        raise PatchfemError("drive.waveform: the steady response is that of a sine without a constant part")
    scene = scene_of(modes, drive, static, kinetic, drive.period)
    b = scene.segments[0, 3]
    z, v = (float(start.z[0]), float(start.v[0])) if start is not None else (0.0, 0.0)
    return (scene.w, scene.decay, *scene.friction, float(b), float(parts[0].omega), z, v), abs(scene.output)


def _condition(row, found, output: float) -> float:
    """d(amplitude omega^2/|B|) / d(static/|B|): free of units; with the drive's omega for a rigid mode."""
    return float(found[3] * output * (row[0] if row[0] > 0 else row[5])**2)


def point(modes: ModalBasis, drive, static: float, kinetic: float, start: Start | None = None, patience: int = 4000,
          compiled: bool = False) -> Steady:
    """Steady motion under a sine with friction forces [N].

    It is the one reached from rest or `start` where there are several (static > kinetic friction). At most `patience`
    cycles are marched in search of it.
    """
    row, output = _row(modes, drive, static, kinetic, start)
    found, phases = np.zeros(12), np.full(orbit_kernels.PHASES, np.nan)
    if compiled:
        load("dynamics.one_mode.steady_kernels").points(np.array([row], float), patience, found[None], phases[None])
    else:
        orbit_kernels.point(*row, patience, np.empty(orbit_kernels.OUT), phases, found)
    return _steady(row, found, phases, output)


def _steady(row, found, phases, output: float) -> Steady:
    regime = REGIMES[int(found[0])]
    starts = np.sort(phases[~np.isnan(phases)]) if regime == Regime.STOPS else np.empty(0)
    pair = (complex(found[5], found[6]), complex(found[10], found[11]))
    return Steady(regime, float(found[1]), float(found[2]) * output, starts, float(found[4]), pair,
                  _condition(row, found, output), int(found[7]), not found[8], float(found[9]))


def response(modes: ModalBasis, drives, static: float, kinetic: float, patience: int = 4000) -> Curve:
    """Steady motions under each of `drives` from rest, compiled."""
    rows, output = zip(*(_row(modes, drive, static, kinetic, None) for drive in drives))
    table, found = np.array(rows, float), np.zeros((len(rows), 12))
    phases = np.full((len(rows), orbit_kernels.PHASES), np.nan)
    load("dynamics.one_mode.steady_kernels").points(table, patience, found, phases)
    condition = np.array([_condition(*case) for case in zip(rows, found, output)])
    regime = np.array([REGIMES[int(k)] for k in found[:, 0]])
    return Curve(table[:, 5].copy(), regime, found[:, 1], found[:, 2] * output[0], found[:, 4],
                 found[:, 5] + 1j * found[:, 6], condition, found[:, 9])


def jenkins_point(modes: ModalBasis, drive, limit: float, stiffness: float) -> tuple:
    """Steady motion with a Jenkins spring: (amplitude of the output [m], multipliers (3,) of a period, residual).

    stiffness: tangential [N/m]; limit [N]. Amplitude 0 and residual inf where no motion that slips was found.
    """
    row, output = _row(modes, drive, limit, limit, None)
    share = float(modes.interfaces[0, 0])**2 / modes.mass
    size, multipliers, miss = Jenkins(row[0], row[1], stiffness * share, row[2], row[4], row[5]).steady()
    return size * output, multipliers, miss
