"""Ring-down of a mode predicted from its free motions, without a run of the decay.

At a reversal the rig stores the energy E(a) of the structure and of the contact, and a cycle of amplitude a
loses L(a). A half cycle from a to b therefore satisfies E(a) - E(b) = L((a + b)/2)/2 to second order in
a - b. The damping ratio of `balance` is L over 2 pi m omega^2 Z^2, whereas the amplitude of a ring-down
falls by L/(a E'(a)) per cycle. Both agree only where E grows as the square of the amplitude: a joint that
stiffens as the amplitude falls makes a ring-down faster.

The damping ratio of a ring-down is the logarithmic decrement of one cycle, from three half cycles around
the amplitude. E and L are therefore computed at free motions within these half cycles, whose width follows
from the damping ratio itself. With an elastic contact the prediction at an amplitude does not depend on the
other given amplitudes. With a rigid contact it is interpolated between them.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from ...dynamics.harmonic.forces import LawGroup
from .balance import HARMONIC_COUNTS, find_free_motions, half_peak_to_peak
from .joint import JointMode
from .records import Curve

# Number of half cycles on either side of an amplitude from which its decrement is computed.
N_SIDE_HALF_CYCLES = 1.5
# Amplitudes of the free motions around an amplitude, in half cycles before or after it. Three suffice for a
# smooth contact; seven, at all reversals and middles of the half cycles, resolve an onset of slip.
SMOOTH_OFFSETS = N_SIDE_HALF_CYCLES * np.linspace(-1, 1, 3)
FINE_OFFSETS = N_SIDE_HALF_CYCLES * np.linspace(-1, 1, 7)
# Largest difference of a free motion from its requested amplitude, relative to the smallest range
# of the half cycles.
OFFSET_TOL = 0.05
MAX_HALF_CYCLE_LOSS = 1.5  # Largest decrease of the logarithm of the amplitude in half a cycle.


class RingDown(NamedTuple):
    """Predicted ring-down of a mode at amplitudes of the output; NaN where it is not known.

    Attributes
    ----------
    frequency, damping : (k,) array
        Frequency [Hz], without its fall by viscous damping, and damping ratio, of three half cycles.
    slow_damping : (k,) array
        Damping ratio of the limit of an infinitely small loss per cycle.
    shape_change : (k,) array
        Relative change of output over modal amplitude while one cycle lowers the amplitude; the
        largest at this amplitude and the default ones above it, 0 if it is not known.
    """

    frequency: np.ndarray
    damping: np.ndarray
    slow_damping: np.ndarray
    shape_change: np.ndarray


class _MotionTable(NamedTuple):
    """Interpolants of the free motions around an amplitude, over the log output amplitude x.

    Each column is an interpolant: log energy [J], log loss per cycle [J], frequency [Hz], and log of the modal
    amplitude [m]; low and high are the limits of x.
    """

    energy: PchipInterpolator
    loss: PchipInterpolator
    frequency: PchipInterpolator
    modal: PchipInterpolator
    low: float
    high: float


class _MotionRows(NamedTuple):
    """Properties (k, m) of free motions at m amplitudes around each of k amplitudes; NaN where not known.

    Attributes
    ----------
    x : array
        Log amplitude at the output.
    energy, loss : array
        Log of the energy at a reversal and of the loss per cycle [J].
    frequency : array
        [Hz]
    modal : array
        Log of the modal amplitude [m].
    damping : array
        Damping ratio.
    """

    x: np.ndarray
    energy: np.ndarray
    loss: np.ndarray
    frequency: np.ndarray
    modal: np.ndarray
    damping: np.ndarray

    def at(self, points) -> "_MotionRows":
        """Return the motions around some of the k amplitudes."""
        return _MotionRows(*(column[points] for column in self))


def predict_ring_down(joint: JointMode, curve: Curve) -> RingDown | None:
    """Predict the ring-down from a harmonic balance curve; None if no amplitude has a result.

    Parameters
    ----------
    joint : JointMode
    curve : Curve
        By balance.
    """
    defaults = np.empty(0)
    if joint.is_rigid or joint.is_linear:
        compute = partial(_compute_rigid_motions, joint, curve)
    else:
        compute = partial(_compute_free_motions, joint, joint.steady_laws())
        if joint.modes.omega.size > 1:
            defaults = joint.default_amplitudes()
    amplitudes = np.union1d(curve.amplitude, defaults)
    is_given = np.isin(amplitudes, curve.amplitude)
    damping = np.full(amplitudes.size, np.nan)
    damping[is_given] = curve.damping
    if not is_given.all():
        others = np.log(amplitudes[~is_given])
        damping[~is_given] = compute(others[:, None], OFFSET_TOL).damping[:, 0]
    ring_down = _predict_at_amplitudes(joint, compute, np.log(amplitudes), damping)
    # Other modes that a ring-down from a large amplitude excites still move at a small one.
    change = np.nan_to_num(ring_down.shape_change)
    is_default = np.isin(amplitudes, defaults)
    from_above = np.maximum.accumulate(np.where(is_default, change, 0.0)[::-1])[::-1]
    ring_down = ring_down._replace(shape_change=np.maximum(change, from_above))
    ring_down = RingDown(*(column[is_given] for column in ring_down))
    return ring_down if np.isfinite(ring_down.slow_damping).any() else None


def _predict_at_amplitudes(joint: JointMode, compute: Callable, x, damping) -> RingDown:
    """Predict the ring-down at log amplitudes x (k,) from free motions around each of them.

    compute: maps log amplitudes (k, m) and their tolerance to `_MotionRows`; damping: approximate damping ratio (k,).
    """
    columns = np.full((len(RingDown._fields), x.size), np.nan)
    known = np.flatnonzero(damping > 0)
    if not known.size:
        return RingDown(*columns)
    rows = _compute_motions_around(compute, x[known], damping[known], SMOOTH_OFFSETS)
    columns[:, known] = _predict_from_motions(rows, x[known])
    # Motions between the ends of the half cycles are needed where a slope changes within them.
    bent = known[_interpolation_error(rows) > joint.model.accuracy.tolerance]
    if bent.size:
        finer_damping = np.fmax(columns[1, bent], damping[bent])
        rows = _compute_motions_around(compute, x[bent], finer_damping, FINE_OFFSETS)
        columns[:, bent] = _predict_from_motions(rows, x[bent])
    return RingDown(*columns)


def _compute_motions_around(compute: Callable, x, damping, offsets) -> _MotionRows:
    """Compute free motions around log amplitudes x (k,), at offsets (m,) in half cycles.

    compute: see `_predict_at_amplitudes`; damping: ratio (k,).
    """
    fall = _half_cycle_fall(damping)
    return compute(x[:, None] + fall[:, None] * offsets, OFFSET_TOL * float(fall.min()))


def _half_cycle_fall(damping) -> np.ndarray:
    """Return the fall (k,) of the log amplitude in half a cycle, at most MAX_HALF_CYCLE_LOSS."""
    damping = np.minimum(damping, 1.0)
    with np.errstate(divide="ignore"):
        fall = np.pi * damping / np.sqrt(1 - damping**2)
    return np.minimum(fall, MAX_HALF_CYCLE_LOSS)


def _interpolation_error(rows: _MotionRows) -> np.ndarray:
    """Return a bound (k,) of the relative damping error by interpolation between three motions.

    Log energy and log loss have a change of slope s between the motions, which are w apart. If it happens in a
    single point, linear interpolation is wrong by up to s w/4. A motion that is not known gives inf.
    """
    steps = np.diff(rows.x, axis=1)
    # The differences are 0 where a motion was not found, or where its damping is below round-off.
    with np.errstate(invalid="ignore", divide="ignore"):
        energy_slope = np.diff(rows.energy, axis=1) / steps
        loss_slope = np.diff(rows.loss, axis=1) / steps
        width = steps.max(axis=1)
        energy_error = np.abs(np.diff(energy_slope, axis=1)[:, 0]) * width / 4
        loss_error = np.abs(np.diff(loss_slope, axis=1)[:, 0]) * width / 4
        # The energy decreases by this fraction in half a cycle.
        fall = np.abs(energy_slope).max(axis=1) * width / N_SIDE_HALF_CYCLES
        error = energy_error / fall + loss_error
    return np.where(np.isfinite(error), error, np.inf)


def _compute_free_motions(joint: JointMode, laws: LawGroup, x, tolerance: float) -> _MotionRows:
    """Compute the free motions near log amplitudes x (k, m) by harmonic balance."""
    targets, places = np.unique(x, return_inverse=True)
    motions = find_free_motions(laws, joint, np.exp(targets), HARMONIC_COUNTS[0], tolerance)
    rows = np.full((targets.size, len(_MotionRows._fields)), np.nan)
    rows[:, 0] = targets
    for row, motion in zip(rows, motions):
        measures = None if motion is None else _measure_motion(joint, motion)
        if measures is not None:
            row[0] = np.log(half_peak_to_peak(motion.modal @ joint.modes.output))
            row[1:] = measures
    return _MotionRows(*np.moveaxis(rows[places.reshape(x.shape)], -1, 0))


def _compute_rigid_motions(joint: JointMode, curve: Curve, x, tolerance: float) -> _MotionRows:
    """Compute motions of a rig whose contact stores no energy, from its harmonic balance curve.

    Constant friction does not change the length of a half cycle, which is that of the free mode.
    """
    free = joint.modes.omega[joint.mode] or joint.omega
    amplitude = np.exp(x)
    omega = 2 * np.pi * np.interp(amplitude, curve.amplitude, curve.frequency)
    # The damping ratio by rigid friction is inversely proportional to the amplitude, that of the structure constant.
    structure = curve.damping
    if not joint.is_linear:
        structure = joint.modes.damping_matrix[joint.mode, joint.mode] / (
            4 * np.pi * curve.frequency
        )
    friction = (curve.damping - structure) * curve.amplitude
    damping = np.interp(amplitude, curve.amplitude, friction) / amplitude
    damping += np.interp(amplitude, curve.amplitude, structure)
    loss = 2 * np.pi * damping * omega**2 * amplitude**2
    return _MotionRows(
        x=x,
        energy=np.log(0.5 * free**2 * amplitude**2),
        loss=np.log(np.where(loss > 0, loss, np.nan)),
        frequency=np.full(x.shape, free / (2 * np.pi)),
        modal=x,
        damping=damping,
    )


def _measure_motion(joint: JointMode, motion) -> np.ndarray | None:
    """Return log energy [J], log loss [J], frequency [Hz], log modal amplitude [m] and damping ratio.

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
    amplitude = np.sqrt(squares.sum())
    frequency = motion.omega / (2 * np.pi)
    return np.array([np.log(energy), np.log(loss), frequency, np.log(amplitude), motion.zeta])


def _predict_from_motions(rows: _MotionRows, x) -> np.ndarray:
    """Predict the fields of the ring-down (4, k) at log amplitudes x (k,) from the motions around them."""
    tables = [_make_motion_table(rows.at(k)) for k in range(x.size)]
    return np.transpose([_predict_from_half_cycles(*pair) for pair in zip(tables, x)])


def _make_motion_table(rows: _MotionRows) -> _MotionTable | None:
    """Return interpolants of the motions around an amplitude; None if fewer than two are known."""
    known = np.isfinite(rows.loss)
    known[known] = np.diff(rows.x[known], prepend=-np.inf) > 0
    if known.sum() < 2:
        return None
    x = rows.x[known]
    columns = (rows.energy, rows.loss, rows.frequency, rows.modal)
    interpolants = [PchipInterpolator(x, column[known]) for column in columns]
    return _MotionTable(*interpolants, low=float(x[0]), high=float(x[-1]))


def _predict_from_half_cycles(table: _MotionTable | None, x: float) -> RingDown:
    """Predict the ring-down at the log amplitude x from three half cycles around it.

    The three half cycles have their middle at the amplitude. They are NaN if the motion stops before.
    """
    if table is None:
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
    """Solve for half the fall of the log amplitude in a half cycle; ValueError if there is no solution.

    ends: log amplitudes at the begin and at the end for a fall of 0; directions: their changes per half the fall.
    """

    scale = np.exp(_interpolate_log_energy(table, ends[0]))

    def excess(step: float) -> float:
        """Return the energy decrease in a half cycle minus the loss, relative to the energy."""
        begin = ends[0] + directions[0] * step
        end = ends[1] + directions[1] * step
        middle = np.log(0.5 * (np.exp(begin) + np.exp(end)))
        middle = np.clip(middle, table.low, table.high)
        fall = np.exp(_interpolate_log_energy(table, begin)) - np.exp(
            _interpolate_log_energy(table, end)
        )
        return float((fall - 0.5 * np.exp(table.loss(middle))) / scale)

    return brentq(excess, 0.0, MAX_HALF_CYCLE_LOSS / 2, xtol=1e-12)


def _interpolate_log_energy(table: _MotionTable, x: float) -> float:
    """Interpolate the log energy at a log amplitude; extrapolate beyond the table with slope 2."""
    inside = min(max(x, table.low), table.high)
    return float(table.energy(inside)) + 2 * (x - inside)
