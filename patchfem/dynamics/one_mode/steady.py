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
    """Steady motions under many sines, arrays of one shape with the meanings of Steady.

    omega [rad/s] of the drive; regime: of Regime; stops; amplitude [m]; stick_fraction; multiplier: the larger one;
    condition; residual; place [m] and rate [m/s] of the coordinate at phase 0 of the drive; periods of the drive after
    which the motion repeats.
    """

    omega: np.ndarray
    regime: np.ndarray
    stops: np.ndarray
    amplitude: np.ndarray
    stick_fraction: np.ndarray
    multiplier: np.ndarray
    condition: np.ndarray
    residual: np.ndarray
    place: np.ndarray
    rate: np.ndarray
    periods: np.ndarray


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
    found, phases = np.zeros(orbit_kernels.FOUND), np.full(orbit_kernels.PHASES, np.nan)
    if compiled:
        load("dynamics.one_mode.steady_kernels").points(np.array([row], float), patience, np.empty(orbit_kernels.OUT),
                                                           found[None], phases[None])
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
    sines = [(abs(row[4]) / max(abs(float(modes.base[0])), 1e-300), row[5]) for row, _ in
             (_row(modes, drive, static, kinetic, None) for drive in drives)]
    level, omega = np.array(sines, float).T
    return motions(modes, level, omega, static, kinetic, patience)


def motions(modes: ModalBasis, level, omega, static, kinetic=None, patience: int = 4000) -> Curve:
    """Steady motions from rest, compiled, as `point` finds them one by one: a map over level, frequency and load.

    level >= 0 [m s-2]: amplitude of the drive, an acceleration or a force over the modal mass; omega > 0 [rad/s];
    static, kinetic >= 0 [N], kinetic = static without it. Each is a number or an array, broadcast together; the Curve
    has their shape. PatchfemError for other sizes, and as `sdof.scene_of`.
    """
    level, omega, static, kinetic = np.broadcast_arrays(level, omega, static, static if kinetic is None else kinetic)
    size, share = level.size, abs(float(modes.slide[0])) / modes.mass
    if modes.omega.size != 1 or modes.interfaces.shape[0] != 1 or (share == 0 and np.any(static > 0)):
        raise PatchfemError("structure: a map of steady motions is of one mode that moves one interface")
    if not (np.all(level >= 0) and np.all(omega > 0) and np.all(kinetic >= 0) and np.all(kinetic <= static)):
        raise PatchfemError("friction.kinetic: a map of steady motions wants levels >= 0, frequencies > 0 and "
                            "0 <= kinetic <= static friction")
    table, found = np.zeros((size, 8)), np.zeros((size, orbit_kernels.FOUND))
    w, decay, output = float(modes.omega[0]), float(modes.dampers[0, 0]) / 2, abs(float(modes.output[0]))
    for place, column in enumerate((w, decay, static * share, kinetic * share, -float(modes.base[0]) * level, omega)):
        table[:, place] = np.ravel(column)
    phases = np.full((1, orbit_kernels.PHASES), np.nan)
    load("dynamics.one_mode.steady_kernels").points(table, patience, np.empty(orbit_kernels.OUT), found, phases)
    columns = (found[:, 1], found[:, 2] * output, found[:, 4], found[:, 5] + 1j * found[:, 6],
               found[:, 3] * output * (w**2 if w > 0 else table[:, 5]**2), found[:, 9], found[:, 12], found[:, 13],
               found[:, 7].astype(int))
    regime = np.array(REGIMES)[found[:, 0].astype(int)]
    return Curve(omega.copy(), regime.reshape(omega.shape), *(one.reshape(omega.shape) for one in columns))


def jenkins_point(modes: ModalBasis, drive, limit: float, stiffness: float) -> tuple:
    """Steady motion with a Jenkins spring: (amplitude of the output [m], multipliers (3,) of a period, residual).

    stiffness: tangential [N/m]; limit [N]. Amplitude 0 and residual inf where no motion that slips was found.
    """
    row, output = _row(modes, drive, limit, limit, None)
    share = float(modes.interfaces[0, 0])**2 / modes.mass
    size, multipliers, miss = Jenkins(row[0], row[1], stiffness * share, row[2], row[4], row[5]).steady()
    return size * output, multipliers, miss
