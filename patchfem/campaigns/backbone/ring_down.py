"""Ring-down of a mode predicted from its free motions, without a run of the decay.

At a reversal the rig stores the energy E(a) of the structure and of the contact, and a cycle of amplitude a
loses L(a). A half cycle from a to b therefore satisfies E(a) - E(b) = L((a + b)/2)/2 to second order in
a - b. The damping ratio of `balance` is L over 2 pi m omega^2 Z^2, whereas the amplitude of a ring-down
falls by L/(a E'(a)) per cycle. Both agree only where E grows as the square of the amplitude: a joint that
stiffens as the amplitude falls makes a ring-down faster.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from ...core import NotConverged
from .balance import HARMONIC_COUNTS, find_free_motions, half_range
from .joint import Joint
from .records import Curve

POINTS_PER_DECADE = 12  # Number of free motions per decade; fewer blur the onset of slip.
# Ratio of the last amplitude of the free motions to the last one of the curve, and of the first ones:
# three half cycles around an amplitude reach so far with a damping ratio of 0.1.
MARGIN_FACTOR = 1.8
MAX_HALF_CYCLE_LOSS = 1.5  # Largest fall of the logarithm of the amplitude in half a cycle.


class RingDown(NamedTuple):
    """Predicted ring-down of a mode at amplitudes of the output; NaN where it is not known.

    Attributes
    ----------
    frequency, damping : (k,) array
        Frequency [Hz], without its fall by viscous damping, and damping ratio, of three half cycles.
    slow_damping : (k,) array
        Damping ratio of the limit of an infinitely small loss per cycle.
    shape_change : (k,) array
        Relative change of output over modal amplitude while one cycle lowers the amplitude.
    """

    frequency: np.ndarray
    damping: np.ndarray
    slow_damping: np.ndarray
    shape_change: np.ndarray


class _MotionTable(NamedTuple):
    """Free motions against log amplitude x at the output.

    Each column is an interpolant: log energy [J], log loss per cycle [J], frequency [Hz], and log of the modal
    amplitude [m]; low and high are the limits of x.
    """

    energy: PchipInterpolator
    loss: PchipInterpolator
    frequency: PchipInterpolator
    modal: PchipInterpolator
    low: float
    high: float


def predict_ring_down(joint: Joint, curve: Curve) -> RingDown | None:
    """Predict the ring-down that belongs to a curve by balance; None if it is not known.

    Parameters
    ----------
    joint : Joint
    curve : Curve
        By balance.
    """
    try:
        table = _tabulate_motions(joint, curve)
    except NotConverged:
        return None
    columns = [_read_half_cycles(table, float(x)) for x in np.log(curve.amplitude)]
    return RingDown(*np.array(columns).T)


def _tabulate_motions(joint: Joint, curve: Curve) -> _MotionTable:
    """Tabulate energy and loss of the free motions around the amplitudes of a curve."""
    low = curve.amplitude[0] / MARGIN_FACTOR
    high = curve.amplitude[-1] * MARGIN_FACTOR
    if joint.is_rigid or joint.is_linear:
        return _tabulate_rigid_motions(joint, curve, low, high)
    count = 2 + int(np.ceil(POINTS_PER_DECADE * np.log10(high / low)))
    amplitudes = np.geomspace(low, high, count)
    motions = find_free_motions(
        joint.steady_laws(), joint, amplitudes, HARMONIC_COUNTS[0], exact=False
    )
    x = []
    rows = []
    for motion in motions:
        row = None if motion is None else _measure_motion(joint, motion)
        amplitude = 0.0 if row is None else half_range(motion.modal @ joint.modes.output)
        if row is not None and (not x or np.log(amplitude) > x[-1]):
            x.append(np.log(amplitude))
            rows.append(row)
    return _interpolate_table(np.array(x), rows)


def _interpolate_table(x, rows: list) -> _MotionTable:
    """Return the interpolants of rows (energy, loss, frequency, modal amplitude) over x (k,)."""
    if len(rows) < 2:
        raise NotConverged("too few free motions were found")
    energy, loss, frequency, modal = np.array(rows).T
    return _MotionTable(
        PchipInterpolator(x, np.log(energy)),
        PchipInterpolator(x, np.log(loss)),
        PchipInterpolator(x, frequency),
        PchipInterpolator(x, np.log(modal)),
        low=float(x[0]),
        high=float(x[-1]),
    )


def _tabulate_rigid_motions(joint: Joint, curve: Curve, low: float, high: float) -> _MotionTable:
    """Tabulate motions of a rig whose contact stores no energy, from its curve by balance.

    Constant friction does not change the length of a half cycle, which is that of the free mode.
    """
    free = joint.modes.omega[joint.mode] or joint.omega
    amplitude = np.unique([low, *curve.amplitude, high])
    values = curve.interpolate(amplitude)
    # Damping times amplitude is linear in the amplitude for rigid friction, also beyond the curve.
    force = curve.damping * curve.amplitude
    slope = 0.0
    if curve.amplitude.size > 1:
        slope = (force[-1] - force[0]) / np.ptp(curve.amplitude)
    damping = (force[0] + slope * (amplitude - curve.amplitude[0])) / amplitude
    omega = 2 * np.pi * values["frequency"]
    energy = 0.5 * free**2 * amplitude**2
    loss = 2 * np.pi * damping * omega**2 * amplitude**2
    if not (loss > 0).all():
        raise NotConverged("the motion gains energy")
    free_frequency = np.full(amplitude.size, free / (2 * np.pi))
    rows = np.column_stack([energy, loss, free_frequency, amplitude])
    return _interpolate_table(np.log(amplitude), list(rows))


def _measure_motion(joint: Joint, motion) -> np.ndarray | None:
    """Return energy [J], loss [J], frequency [Hz] and modal amplitude [m] of a free motion.

    The energy that elastic-plastic elements store at a reversal is half of tip displacement times tip
    force less an eighth of the loop area (Masing). It is None for a motion that gains energy.
    """
    modes = joint.modes
    order = np.arange(motion.modal.shape[0])
    tip = motion.modal.real.sum(axis=0)
    # The cubic spring is the last row. It is elastic and not linear, so Masing's rule does not hold for it.
    cubic = joint.model.rig.springs.cubic
    n_friction = len(motion.slides) - (cubic is not None)
    slides = motion.slides[:n_friction]
    forces = motion.forces[:n_friction]
    areas = np.pi * np.sum(order * (np.conj(slides) * forces).imag, axis=1)
    work = 0.5 * slides.real.sum(axis=1) * forces.real.sum(axis=1)
    stored = np.maximum(work - areas / 8, 0.0).sum()
    stored += (cubic or 0.0) * float(tip @ modes.output) ** 4 / 4
    energy = 0.5 * modes.mass * np.sum((modes.omega * tip) ** 2) + stored
    squares = np.sum(np.abs(motion.modal) ** 2, axis=1)
    # 4 times the mean kinetic energy
    kinetic = modes.mass * motion.omega**2 * np.sum(order**2 * squares)
    loss = 2 * np.pi * kinetic * motion.zeta
    if not (energy > 0 and loss > 0):
        return None
    return np.array([energy, loss, motion.omega / (2 * np.pi), np.sqrt(squares.sum())])


def _read_half_cycles(table: _MotionTable, x: float) -> RingDown:
    """Read a ring-down around the log amplitude x.

    The three half cycles have their middle at the amplitude. They are NaN if the motion stops before.
    """
    if not table.low <= x <= table.high:
        return RingDown(*[np.nan] * len(RingDown._fields))
    loss = np.exp(table.loss(x))
    slope = float(np.exp(table.energy(x)) * table.energy(x, 1))
    slow_damping = loss / (2 * np.pi * slope) if slope > 0 else np.nan
    change = abs(1 - table.modal(x, 1)) * 2 * np.pi * slow_damping
    try:
        half = _solve_half_cycle(table, (x, x), (1, -1))
        before = _solve_half_cycle(table, (x + half, x + half), (2, 0))
        after = _solve_half_cycle(table, (x - half, x - half), (0, -2))
    except ValueError:
        return RingDown(np.nan, np.nan, slow_damping, change)
    sizes = np.exp([x + half + 2 * before, x + half, x - half, x - half - 2 * after])
    middles = 0.5 * (sizes[1:] + sizes[:-1])
    decrement = np.log(middles[0] / middles[2]) / (2 * np.pi)
    frequency = float(np.mean(table.frequency(np.log(middles))))
    return RingDown(frequency, decrement / np.sqrt(1 + decrement**2), slow_damping, change)


def _solve_half_cycle(table: _MotionTable, ends: tuple, directions: tuple) -> float:
    """Return half the fall of the log amplitude in a half cycle; ValueError if there is none.

    ends: log amplitudes at the begin and at the end for a fall of 0; directions: their changes per half the fall.
    """

    scale = np.exp(_extend_energy(table, ends[0]))

    def excess(step: float) -> float:
        """Return the energy given up in a half cycle less its loss, over the energy."""
        begin = ends[0] + directions[0] * step
        end = ends[1] + directions[1] * step
        middle = np.log(0.5 * (np.exp(begin) + np.exp(end)))
        middle = np.clip(middle, table.low, table.high)
        fall = np.exp(_extend_energy(table, begin)) - np.exp(_extend_energy(table, end))
        return float((fall - 0.5 * np.exp(table.loss(middle))) / scale)

    return brentq(excess, 0.0, MAX_HALF_CYCLE_LOSS / 2, xtol=1e-12)


def _extend_energy(table: _MotionTable, x: float) -> float:
    """Return the log energy at a log amplitude, beyond the table with a slope of 2."""
    inside = min(max(x, table.low), table.high)
    return float(table.energy(inside)) + 2 * (x - inside)
