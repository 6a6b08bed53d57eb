"""Frequency, damping and modal purity of a decaying motion, from reversal to reversal."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicHermiteSpline

from ...core import NotConverged, PatchfemError, Response
from ...dynamics.harmonic.forces import LawGroup
from ...dynamics.harmonic.laws import evaluate_series
from ...response.decay_curve import (
    DecayCurve,
    fit_decay_curve,
    locate_reversals,
    make_half_cycles,
)
from .balance import HARMONIC_COUNTS, find_free_motions
from .joint import JointMode

N_SAMPLES = 4096  # Number of samples of a cycle of a free motion.
# Number of half cycles on either side over which the largest effect of other modes is taken.
N_BEAT_HALF_CYCLES = 8
EQUAL_HALF_CYCLES_TOL = 1e-7  # Largest relative difference of two half cycles without slip.
# Smallest ratio of the stiffness to that without slip at which a contact counts as stuck.
STUCK_FRACTION = 0.999


def identify_decay(
    joint: JointMode, motion: Response, find_reversals=locate_reversals
) -> DecayCurve:
    """Identify frequency and damping of a decaying motion from its half cycles.

    With several modes, the reversals are those of the motion along the shape of the stuck mode, in
    which other modes move least. Where consecutive half cycles last equally long, nothing slips:
    the motion along this shape is then that of the mode alone, whatever else moves the output.

    Parameters
    ----------
    joint : JointMode
    motion : Response
    find_reversals : callable
        Of `response.decay_curve`: finds the reversals between samples.

    Returns
    -------
    DecayCurve
    """
    shape = joint.shape
    if shape.size == 1:
        turns = find_reversals(motion.time, motion.output, motion.output_rate)
        return fit_decay_curve(make_half_cycles(*turns))
    times, components = find_reversals(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    if times.size < 3:
        return fit_decay_curve(make_half_cycles(times, components))
    output = CubicHermiteSpline(motion.time, motion.output, motion.output_rate)(times)
    sizes = np.abs(np.diff(output))
    lengths = np.diff(times)
    are_equal = np.abs(np.diff(lengths)) <= EQUAL_HALF_CYCLES_TOL * lengths[1:]
    sticks = np.append(True, are_equal) & np.append(are_equal, True)
    at_output = fit_decay_curve(make_half_cycles(times, components, sizes))
    mode_sizes = joint.reach / (shape @ shape) * np.abs(np.diff(components))
    sizes = np.where(sticks, mode_sizes, sizes)
    curve = fit_decay_curve(make_half_cycles(times, components, sizes))
    change = _mode_coupling(joint) * np.abs(curve.damping - at_output.damping)
    if change.size:
        padded = np.pad(change, N_BEAT_HALF_CYCLES)
        change = sliding_window_view(padded, 2 * N_BEAT_HALF_CYCLES + 1).max(axis=1)
    return curve._replace(
        damping_error=curve.damping_error + change,
        frequency_error=curve.frequency_error + change * curve.frequency,
    )


def measure_other_modes(joint: JointMode, motion: Response, amplitudes) -> np.ndarray:
    """Return the ratio (k,) of the motion of other modes to the amplitude of a decay.

    It is the distance of the modal coordinates, and of their rates / omega, from those of the free
    motion by harmonic balance at the same amplitude, at a reversal; both are divided by their
    motion along the shape of the sticking mode. It is 0 if all contacts stick, because the motion
    along this shape is then free of other modes, provided that no displacement is larger than one
    at which the balance finds no slip. It is NaN if the motion or the balance is not known.

    Parameters
    ----------
    joint : JointMode
    motion : Response
        The decay.
    amplitudes : (k,) array
        At the output [m]; NaN where nothing is to be computed.

    Returns
    -------
    (k,) array
    """
    out = np.full(amplitudes.size, np.nan)
    shape = joint.shape
    if shape.size == 1 or joint.is_rigid:
        return out
    columns = np.flatnonzero(np.isfinite(amplitudes))
    try:
        joint.require_steady_loops("balance")
        group = joint.steady_laws()
        free_motions = find_free_motions(group, joint, amplitudes[columns], HARMONIC_COUNTS[0])
    except (NotConverged, PatchfemError):
        return out
    max_stuck = _max_stuck_displacements(group, free_motions)
    decay = identify_decay(joint, motion)
    times, _ = locate_reversals(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    for column, free in zip(columns, free_motions):
        if free is None:
            continue
        amplitude_time = np.interp(
            -np.log(amplitudes[column]), -np.log(decay.amplitude), decay.time
        )
        time = times[np.argmin(np.abs(times - amplitude_time))]
        k = int(np.clip(np.searchsorted(motion.time, time), 1, motion.time.size - 1))
        step = slice(k - 1, k + 1)
        cubic = CubicHermiteSpline(motion.time[step], motion.modal[step], motion.modal_rate[step])
        modal = cubic(time)
        scaled_rate = cubic(time, 1) / free.omega
        sizes = np.hypot(group.rows @ modal, group.rows @ scaled_rate)
        if (sizes <= max_stuck).all():
            out[column] = 0.0
        else:
            out[column] = _distance_to_free_motion(free, shape, modal, scaled_rate)
    return out


def _max_stuck_displacements(group: LawGroup, free_motions: list) -> np.ndarray:
    """Return the largest displacement (i,) of each interface in free motion without slip."""
    largest = np.zeros(len(group.rows))
    for free in free_motions:
        if free is not None:
            sizes = np.where(_is_stuck(group, free), np.abs(free.slides[:, 1]), 0.0)
            largest = np.maximum(largest, sizes)
    return largest


def _distance_to_free_motion(free, shape, modal, scaled_rate) -> float:
    """Return the distance between a modal state and a free motion, scaled along the mode shape.

    The state consists of coordinates (n,) and rates / omega (n,).

    Coordinates and free motion are divided by their component along the shape (n,) of the stuck
    mode.
    """
    order = np.arange(free.modal.shape[0])[:, None]
    free_modal = np.apply_along_axis(evaluate_series, 0, free.modal, N_SAMPLES)
    free_rate = np.apply_along_axis(evaluate_series, 0, 1j * order * free.modal, N_SAMPLES)
    component = modal @ shape
    sign = np.sign(component)
    reversal = int(np.argmax(sign * (free_modal @ shape)))
    free_component = sign * float(free_modal[reversal] @ shape)
    return np.hypot(
        np.linalg.norm(modal / abs(component) - free_modal[reversal] / free_component),
        np.linalg.norm(scaled_rate / abs(component) - free_rate[reversal] / free_component),
    )


def _is_stuck(group: LawGroup, free) -> np.ndarray:
    """Return for each interface (i,) whether its stiffness in a free motion is that without slip."""
    force = free.forces[:, 1]
    slide = free.slides[:, 1]
    stiffness = STUCK_FRACTION * group.stiffness()
    return np.real(force * np.conj(slide)) >= stiffness * np.abs(slide) ** 2


def _mode_coupling(joint: JointMode) -> float:
    """Return the coupling of other modes along the shape of the stuck mode, at most 1.

    It is the effect of other modes along this shape / their effect at the output. Dampers couple
    the modes.
    """
    modes = joint.modes
    omega = joint.omega
    others = np.delete(modes.omega, joint.mode)
    shape = joint.shape / np.linalg.norm(joint.shape)
    damping_force = modes.damping_matrix @ shape
    damping_force = damping_force - shape * (shape @ damping_force)
    output = modes.output - shape * (shape @ modes.output)
    distance = np.abs(others - omega**2 / np.maximum(others, omega)).min()
    effect_at_output = distance * np.linalg.norm(output) / joint.reach
    return float(np.clip(np.linalg.norm(damping_force) / max(effect_at_output, 1e-300), 0.0, 1.0))
