"""Curve of a mode by a release from the largest amplitude, read from reversal to reversal."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import CubicHermiteSpline

from ...core import InitialState, NotConverged, PatchfemError
from ...dynamics.harmonic.forces import LawGroup
from ...dynamics.harmonic.laws import evaluate_series
from ...effects import NO_WAVEFORM
from ...formatting import format_length
from ...model.model import Model
from ...model.rig import DriveLevels
from ...response.decay_curve import (
    DecayCurve,
    compute_swing_curve,
    find_turning_points,
    find_turning_points_outside,
    half_swings_between,
)
from ...runs.rig import decays, numerics, solve
from ...runs.rig.engines import ENGINES, PIECES, SMOOTH
from ...structure import drives
from ...structure.drive_sizes import find_decay_rate
from .balance import HARMONICS, find_free_motions
from .joint import MIN_AMPLITUDE_FACTOR, RELEASE_FACTOR, Joint
from .records import Curve

ROUND_OFF_ERROR = 1e-9  # Relative error of a value due to round-off.
N_SAMPLES = 4096  # Samples of a cycle of a free motion.
# Cycles of the first decay; longer ones follow until the amplitude is small enough.
FIRST_CYCLES = 50
MAX_CYCLES_ONE_MODE = 12800  # Cycles of the longest decay of one mode; a longer one takes minutes.
MAX_CYCLES = 3200  # The same for several modes, for which each cycle takes longer.
MAX_CYCLES_TURNS = 102400  # For one mode with elastic elements, of which only reversals are stored.
# Amplitudes at which the free motion of a release is computed, up to that of the release.
N_START_STEPS = 12
MAX_RAISED = 3  # Maximum number of repeated releases, each from a higher amplitude.
MAX_RAISE_FACTOR = 8.0  # Largest ratio of the amplitudes of two successive releases.
# End of a decay / smallest amplitude, by which coarser runs reach this amplitude as well.
END_FACTOR = 0.8
N_FREE_SWINGS = 3.0  # Periods of the free mode within which the first swings of a decay appear.
MAX_DOUBLINGS = 3  # Largest number of times that the time steps are halved.
# Motion of other modes / amplitude, above which the decay is not one of this mode.
MAX_OTHER_MODES = 0.1
# Half swings before and after, over which the maximum effect of other modes is taken.
N_BEAT_SWINGS = 8
EQUAL_SWINGS_TOL = 1e-7  # Relative difference of two half swings, up to which nothing slips.
STUCK_FRACTION = 0.999  # Stiffness / stiffness without slip, above which a contact sticks.
ANNOUNCED_SECONDS = 20.0  # CPU seconds of a decay, above which it is announced.
COARSER_RUNS_FACTOR = 2.0  # CPU seconds of a decay with its coarser runs / without them.


class Release(NamedTuple):
    """Run of a release: its model, its numerical settings and its Solution."""

    model: Model
    numerics: object
    solution: object


class DecayReading(NamedTuple):
    """Frequency [Hz] and damping ratio (2, k) read from a release, and their errors (2, k).

    reading_error: of the reading from reversal to reversal; run_error: from coarser runs.
    """

    value: np.ndarray
    reading_error: np.ndarray
    run_error: np.ndarray

    def known_amplitudes(self) -> np.ndarray:
        """Return the amplitudes (k,) bool at which values and errors are known."""
        return np.isfinite(self.value + self.run_error).all(axis=0)


class _GrowingRelease(NotConverged):
    """Raised if a released motion grows: negative damping supplies more energy than is dissipated."""


def compute_decay_curve(joint: Joint, amplitudes, progress=None) -> Curve:
    """Return the curve of a release from the largest amplitude, as far as it decays.

    Parameters
    ----------
    joint : Joint
    amplitudes : (k,) array
        Increasing, at the output [m].
    progress : callable, optional
        Takes a sentence about the time that a long decay takes.
    """
    n_decaying, release = _release_from_largest_decaying(joint, amplitudes, progress)
    release, reading = _refine_release(joint, release, amplitudes)
    known = reading.known_amplitudes()
    if not known.any():
        raise NotConverged("the free decay gave no frequency and damping at these amplitudes")
    motion = _measure_other_modes(joint, release.solution, np.where(known, amplitudes, np.nan))
    last_mixed = amplitudes[motion > MAX_OTHER_MODES].max(initial=0.0)
    mixed = known & (motion > 0) & (amplitudes <= last_mixed)
    known &= ~mixed
    if not known.any():
        raise NotConverged(
            "at these amplitudes the free decay is no longer a motion of this mode alone: the "
            f"motion of other modes is more than {100 * MAX_OTHER_MODES:.0f} % of its amplitude"
        )
    mesh_error, reason = decays.mesh_errors_of_decay(
        joint.model, joint.patch, joint.coarse, amplitudes, lambda laws: joint.mode
    )
    error = np.fmax(reading.run_error, mesh_error) + reading.reading_error
    engine = ENGINES[release.numerics.engine]
    notes = [
        *decays.slip_sentences(
            {"method decay": reason},
            lambda: engine.coarser_in_space(
                release.model, release.numerics, joint.patch, joint.coarse, release.solution
            ),
        ),
        *_note_mixed(amplitudes[mixed]),
        *_note_growing(amplitudes[n_decaying:]),
        *_note_unknown_modes(joint, known, motion),
    ]
    curve = Curve(
        amplitude=amplitudes,
        frequency=reading.value[0],
        frequency_error=error[0],
        damping=reading.value[1],
        damping_error=error[1],
        loss=np.full(amplitudes.size, np.nan),
        notes=tuple(notes),
        other_modes=motion,
    )
    return curve.at(known)


def _note_mixed(amplitudes) -> list:
    """Return a sentence about amplitudes (k,) [m] at which other modes move too much."""
    count = amplitudes.size
    if not count:
        return []
    plural = "s" if count > 1 else ""
    return [
        f"method decay: when the decay has fallen to {format_length(amplitudes[-1], 3)}, the motion "
        f"of other modes is more than {100 * MAX_OTHER_MODES:.0f} % of its amplitude; from there on "
        f"the values with slip are left out ({count} amplitude{plural}), because they do not "
        "describe this mode alone"
    ]


def _note_growing(amplitudes) -> list:
    """Return a note about the amplitudes (k,) [m] from which a released motion grows."""
    if not amplitudes.size:
        return []
    return [
        f"method decay: a release from {format_length(amplitudes[0], 3)} grows, because the "
        "negative damping supplies more energy than friction dissipates"
    ]


def _note_unknown_modes(joint: Joint, known, motion) -> list:
    """Return a sentence about amplitudes at which the motion of other modes is not known."""
    unknown = known & np.isnan(motion)
    if joint.modes.omega.size == 1 or not unknown.any():
        return []
    reason = "harmonic balance gave no free motion to compare with"
    if joint.is_rigid:
        reason = "with rigid friction it is not computed"
    return [
        "method decay: how much other modes move in the decay is not known at "
        f"{unknown.sum()} of {known.sum()} amplitudes, because {reason}"
    ]


class RefinedRelease(NamedTuple):
    """A release and its reading, with time steps that meet the tolerance or the smallest ones."""

    release: Release
    reading: DecayReading


def _refine_release(joint: Joint, release: Release, amplitudes) -> RefinedRelease:
    """Halve the time steps until the errors from coarser runs meet the tolerance."""
    model, how, _ = release
    engine = ENGINES[how.engine]
    tolerance = joint.model.accuracy.tolerance
    for doublings in range(MAX_DOUBLINGS + 1):
        reading = _read_with_errors(joint, release, amplitudes)
        known = reading.known_amplitudes()
        limit = np.maximum(tolerance * np.abs(reading.value), reading.reading_error)
        is_small = (reading.run_error <= limit).all(axis=0)
        is_met = known.any() and is_small[known].all()
        has_steps = engine.coarser_in_time(model, how) and "steps_per_cycle" not in how.pinned
        if is_met or doublings == MAX_DOUBLINGS or not has_steps:
            break
        how = how.finer()
        found = solve.solve(model, how, joint.patch)
        release = Release(model, how, found)
    return RefinedRelease(release, reading)


def _read_with_errors(joint: Joint, release: Release, amplitudes) -> DecayReading:
    """Read a release at amplitudes (k,) [m], with errors from coarser runs."""
    model, how, found = release
    engine = ENGINES[how.engine]
    read = _read_decay(joint, found)
    if how.engine == SMOOTH.name:
        read = read.add_sampling_error(_read_decay(joint, found, find_turning_points_outside))
    read = read.over(amplitudes)
    value = np.array([read.frequency, read.damping])
    reading_error = np.array([read.frequency_error, read.damping_error])
    error = ROUND_OFF_ERROR * np.abs(value)
    known: dict = {}

    def curve(settings) -> np.ndarray:
        """Return frequency [Hz] and damping (2, k) of another run at the same amplitudes."""
        if settings not in known:
            patch = joint.coarse if settings.coarse_patch else joint.patch
            run = solve.solve(model, replace(settings, whole=True), patch)
            other = _read_decay(joint, run).over(amplitudes)
            known[settings] = np.array([other.frequency, other.damping])
        return known[settings]

    coarser = [
        *engine.coarser_in_time(model, how),
        *engine.coarser_in_space(model, how, joint.patch, joint.coarse, found),
    ]
    for one in coarser:
        if one.runs:
            beside = value if one.beside is None else curve(one.beside)
            runs = one.runs if one.of == "cells" else one.runs[:1]
            # NaN if one of the runs does not decay to this amplitude.
            error += np.max([np.abs(curve(run) - beside) for run in runs], axis=0)
    return DecayReading(value, reading_error, error)


def _measure_other_modes(joint: Joint, found, amplitudes) -> np.ndarray:
    """Return the motion of other modes / amplitude (k,) in a Solution, at amplitudes (k,) [m].

    It is the distance of the modal coordinates, and of their rates / omega, from those of the free
    motion by harmonic balance at the same amplitude, at a reversal; both are divided by their
    motion along the shape of the sticking mode. It is 0 if all contacts stick, because the motion
    along this shape is then free of other modes, provided that no displacement is larger than one
    at which the balance finds no slip. It is NaN if the motion or the balance is not known.
    """
    out = np.full(amplitudes.size, np.nan)
    motion = found.response
    shape = joint.shape
    asked = np.flatnonzero(np.isfinite(amplitudes))
    if shape.size == 1 or joint.is_rigid:
        return out
    try:
        joint.require_steady_loops("balance")
        group = joint.steady_laws()
        free = find_free_motions(group, joint, amplitudes[asked], HARMONICS[0])
    except (NotConverged, PatchfemError):
        return out
    stuck = [
        np.where(_is_stuck(group, one), np.abs(one.slides[:, 1]), 0.0)
        for one in free
        if one is not None
    ]
    max_stuck = np.max(stuck or [np.zeros(len(group.rows))], axis=0)
    read = _read_decay(joint, found)
    times, _ = find_turning_points(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    for column, one in zip(asked, free):
        if one is None:
            continue
        wanted = np.interp(-np.log(amplitudes[column]), -np.log(read.amplitude), read.time)
        time = times[np.argmin(np.abs(times - wanted))]
        k = int(np.clip(np.searchsorted(motion.time, time), 1, motion.time.size - 1))
        step = slice(k - 1, k + 1)
        cubic = CubicHermiteSpline(motion.time[step], motion.modal[step], motion.modal_rate[step])
        place = cubic(time)
        rate = cubic(time, 1) / one.omega
        if (np.hypot(group.rows @ place, group.rows @ rate) <= max_stuck).all():
            out[column] = 0.0
        else:
            out[column] = _distance_to_free_motion(one, shape, place, rate)
    return out


def _distance_to_free_motion(free, shape, place, rate) -> float:
    """Return the distance of modal coordinates (n,) and rates / omega (n,) from a free motion.

    Both are divided by their component along the shape (n,) of the sticking mode.
    """
    order = np.arange(free.modal.shape[0])[:, None]
    free_place = np.apply_along_axis(evaluate_series, 0, free.modal, N_SAMPLES)
    free_rate = np.apply_along_axis(evaluate_series, 0, 1j * order * free.modal, N_SAMPLES)
    own = place @ shape
    side = np.sign(own)
    reversal = int(np.argmax(side * (free_place @ shape)))
    size = side * float(free_place[reversal] @ shape)
    return np.hypot(
        np.linalg.norm(place / abs(own) - free_place[reversal] / size),
        np.linalg.norm(rate / abs(own) - free_rate[reversal] / size),
    )


def _is_stuck(group: LawGroup, free) -> np.ndarray:
    """Return whether each interface (i,) of a free motion has its stiffness without slip."""
    force = free.forces[:, 1]
    slide = free.slides[:, 1]
    stiffness = STUCK_FRACTION * group.stiffness()
    return np.real(force * np.conj(slide)) >= stiffness * np.abs(slide) ** 2


def _release_from_largest_decaying(joint: Joint, amplitudes, progress=None) -> tuple:
    """Release the mode from the largest amplitude from which its motion does not grow.

    Parameters
    ----------
    joint : Joint
    amplitudes : (k,) array
        Increasing, at the output [m].
    progress : callable, optional
        Takes a sentence about the time that a long decay takes.

    Returns
    -------
    tuple
        Number of amplitudes up to the one of the release, and the Release.
    """
    for count in range(amplitudes.size, 0, -1):
        try:
            return count, _release_to_smallest(joint, amplitudes[:count], progress)
        except _GrowingRelease:
            continue
    raise NotConverged(
        f"a release from {format_length(amplitudes[0], 3)} grows, because the negative damping "
        "supplies more energy than friction dissipates; give smaller amplitudes with --amplitudes"
    )


def _is_growing(joint: Joint, found) -> bool:
    """Return whether the swings of a Solution grow along the shape of the sticking mode."""
    motion = found.response
    shape = joint.shape
    _, places = find_turning_points(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    swings = np.abs(np.diff(places))
    return find_decay_rate(joint.modes) < 0 and swings.size > 2 and swings[-1] > swings[0]


def _release_to_smallest(joint: Joint, amplitudes, progress=None) -> Release:
    """Release the mode and compute as many cycles as the decay to the smallest amplitude takes.

    The release begins at an amplitude at which the first reading is above the largest amplitude.
    Each longer run is announced with a time that follows from the time per cycle of the run before.
    """
    travel = joint.model.rig.springs.travel
    omega = joint.modes.omega
    has_several_modes = omega.size > 1
    begin = min(RELEASE_FACTOR * float(amplitudes[-1]), travel)
    cycles = FIRST_CYCLES
    n_raised = 0
    seconds_per_cycle = 0.0
    free_swings = np.inf
    if omega[joint.mode]:
        free_swings = N_FREE_SWINGS * 2 * np.pi / omega[joint.mode]
    while True:
        model, how = _choose_numerics(joint, begin, cycles)
        max_cycles = MAX_CYCLES if has_several_modes else MAX_CYCLES_ONE_MODE
        if how.engine == PIECES.name and not has_several_modes:
            max_cycles = MAX_CYCLES_TURNS
        expected = COARSER_RUNS_FACTOR * seconds_per_cycle * cycles
        if progress is not None and expected > ANNOUNCED_SECONDS:
            progress(f"decay over {cycles} cycles: about {expected:.2g} s of computing time")
        found = solve.solve(model, how, joint.patch)
        release = Release(model, how, found)
        seconds_per_cycle = found.seconds / cycles
        if _is_growing(joint, found):
            raise _GrowingRelease("the release grows")
        read = _read_decay(joint, found)
        end = found.response.time[-1]
        if not read.time.size:
            if cycles >= max_cycles or end >= free_swings:
                return release
            # The cycles are those of the sticking mode; a swing in slip can last hundreds of them.
            cycles = min(8 * cycles, max_cycles)
            continue
        high = read.amplitude[0]
        low = read.amplitude[-1]
        rests = read.time[-1] < end - 3 / read.frequency[-1]
        lowest = END_FACTOR * amplitudes[0]
        if high < amplitudes[-1] and begin < travel and n_raised < MAX_RAISED:
            begin = _raise_release(joint, begin, high, amplitudes[-1])
            n_raised += 1
        elif low <= lowest or cycles >= max_cycles or rests:
            return release
        else:
            damping = read.damping[-1]
            more = np.inf
            if damping > 0:
                more = np.log(low / lowest) / (2 * np.pi * damping)
            cycles = int(min(np.clip(cycles + more, 2 * cycles, 8 * cycles), max_cycles))


def _choose_numerics(joint: Joint, begin: float, cycles: int) -> tuple:
    """Return the model of a release from an amplitude `begin` [m], and its numerical settings."""
    model = release_model(joint, begin)
    drive = replace(model.rig.drive, cycles=float(cycles))
    model = replace(model, rig=replace(model.rig, drive=drive))
    how = numerics.choose(model)
    stores_reversals = joint.is_rigid or how.engine == PIECES.name
    if joint.modes.omega.size > 1 or not stores_reversals:
        how = replace(how, window=int(cycles))
    return model, how


def _raise_release(joint: Joint, begin: float, high: float, largest: float) -> float:
    """Return a higher amplitude [m] for a release whose first reading is below `largest`.

    Parameters
    ----------
    joint : Joint
    begin : float
        Amplitude of the release so far [m].
    high : float
        Its first reading [m].
    largest : float
        Amplitude [m] that the first reading must exceed.
    """
    # Friction reduces the amplitude by two static deflections per half swing.
    rest = joint.output_amplitude(joint.deflection) if joint.friction_limit else 0.0
    limit = max(MAX_RAISE_FACTOR * begin, RELEASE_FACTOR * (begin + 2 * rest))
    raised = begin * RELEASE_FACTOR * largest / high
    return min(raised, limit, joint.model.rig.springs.travel)


def release_model(joint: Joint, amplitude: float) -> Model:
    """Return the model of a mode that is released at an amplitude [m] of the output."""
    model = decays.with_automatic_method(joint.model)
    period = 2 * np.pi / (joint.held[0] or joint.modes.omega[joint.mode])
    rig = model.rig.with_signal(
        drives.make_release(period),
        kind="free",
        waveform=NO_WAVEFORM,
        frequency=None,
        force=None,
        levels=DriveLevels(),
    )
    rig = replace(rig, start=_start_release(joint, amplitude))
    return replace(model, rig=rig)


def _start_release(joint: Joint, amplitude: float) -> InitialState:
    """Return the initial state of a release at an amplitude [m] of the output.

    It is the free motion by harmonic balance, in which no other mode is excited. If this is not
    known, it is the shape of the mode: with the contact stuck, or without the contact at amplitudes
    at which all of it slips.
    """
    modes = joint.modes
    at_rest = np.zeros(modes.omega.size)
    if at_rest.size > 1:
        try:
            joint.require_steady_loops("balance")
            first = float(joint.output_amplitude(MIN_AMPLITUDE_FACTOR * joint.slip_displacement))
            first = min(first or amplitude, amplitude)
            path = np.unique(np.geomspace(first, amplitude, N_START_STEPS))
            free = find_free_motions(joint.steady_laws(), joint, path, HARMONICS[0])[-1]
            if free is not None:
                order = np.arange(HARMONICS[0] + 1)[:, None]
                rates = 1j * free.omega * order * free.modal
                return InitialState(free.modal.real.sum(axis=0), rates.real.sum(axis=0))
        except (NotConverged, PatchfemError):
            pass
    output = float(modes.output[joint.mode])
    if amplitude > joint.slip_amplitude and output:
        own = np.eye(at_rest.size)[joint.mode]
        return InitialState(own * amplitude / abs(output), at_rest)
    return InitialState(joint.shape * amplitude / joint.reach, at_rest)


def _read_decay(joint: Joint, found, turns=find_turning_points) -> DecayCurve:
    """Read a Solution from reversal to reversal.

    With several modes, the reversals are those of the motion along the shape of the sticking mode, in
    which other modes move least. Where consecutive swings last equally long, nothing slips: the motion
    along this shape is then the mode's own, whatever else moves the output.

    Parameters
    ----------
    joint : Joint
    found : Solution
    turns : callable
        Of `response.decay_curve`: finds the reversals between samples.
    """
    motion = found.response
    shape = joint.shape
    if shape.size == 1:
        return compute_swing_curve(
            half_swings_between(*turns(motion.time, motion.output, motion.output_rate))
        )
    times, places = turns(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    if times.size < 3:
        return compute_swing_curve(half_swings_between(times, places))
    output = CubicHermiteSpline(motion.time, motion.output, motion.output_rate)(times)
    sizes = np.abs(np.diff(output))
    lengths = np.diff(times)
    equal = np.abs(np.diff(lengths)) <= EQUAL_SWINGS_TOL * lengths[1:]
    sticks = np.append(True, equal) & np.append(equal, True)
    at_output = compute_swing_curve(half_swings_between(times, places, sizes))
    own = joint.reach / (shape @ shape) * np.abs(np.diff(places))
    curve = compute_swing_curve(half_swings_between(times, places, np.where(sticks, own, sizes)))
    change = _mode_coupling(joint) * np.abs(curve.damping - at_output.damping)
    if change.size:
        padded = np.pad(change, N_BEAT_SWINGS)
        change = sliding_window_view(padded, 2 * N_BEAT_SWINGS + 1).max(axis=1)
    return curve._replace(
        damping_error=curve.damping_error + change,
        frequency_error=curve.frequency_error + change * curve.frequency,
    )


def _mode_coupling(joint: Joint) -> float:
    """Return the coupling of other modes along the shape of the sticking mode, at most 1.

    It is the effect of other modes along this shape / their effect at the output. Dampers couple
    the modes.
    """
    modes = joint.modes
    omega = joint.held[0] or modes.omega[joint.mode]
    others = np.delete(modes.omega, joint.mode)
    shape = joint.shape / np.linalg.norm(joint.shape)
    damper_force, output = (
        part - shape * (shape @ part) for part in (modes.damping_matrix @ shape, modes.output)
    )
    distance = np.abs(others - omega**2 / np.maximum(others, omega)).min()
    seen = np.linalg.norm(output) / joint.reach
    return float(np.clip(np.linalg.norm(damper_force) / max(distance * seen, 1e-300), 0.0, 1.0))
