"""Free decay of one mode that is released at a given amplitude."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import InitialState, NotConverged, PatchfemError, Response
from ...effects import NO_WAVEFORM, law_has_trait
from ...formatting import format_length
from ...model.model import Model
from ...model.rig import DriveLevels
from ...response.decay_curve import locate_reversals
from ...runs.rig import decays, numerics, solve
from ...runs.rig.engines import HYBRID
from ...structure import drives
from ...structure.drive_sizes import find_decay_rate
from .balance import HARMONIC_COUNTS, find_free_motions
from .decay_identification import identify_decay
from .joint import MIN_AMPLITUDE_FACTOR, RELEASE_FACTOR, JointMode

# Number of cycles of the first decay; longer ones follow until the amplitude is small enough.
FIRST_CYCLES = 50
# Largest number of cycles of the decay of one mode; a longer one takes minutes.
MAX_CYCLES_ONE_MODE = 12800
MAX_CYCLES = 3200  # Largest number of cycles with several modes, for which each cycle takes longer.
# Largest number of cycles of one mode with elastic elements, of which only reversals are stored.
MAX_CYCLES_TURNS = 102400
# Number of amplitudes, up to the initial one, at which the free motion after a release is computed.
N_START_STEPS = 12
MAX_RAISED = 3  # Largest number of repeated releases, each from a higher amplitude.
MAX_RAISE_FACTOR = 8.0  # Largest ratio of the amplitudes of two successive releases.
# Ratio of the final amplitude of the decay to the smallest requested one, such that coarser runs
# reach it too.
FINAL_AMPLITUDE_FACTOR = 0.8
# Number of periods of the free mode within which the first half cycles of a decay appear.
N_FREE_CYCLES = 3.0
ANNOUNCED_SECONDS = 20.0  # Smallest expected CPU time [s] of a decay that is announced.
# Ratio of the CPU time of a decay with its coarser runs to that without them.
COARSER_RUNS_FACTOR = 2.0


class Release(NamedTuple):
    """Run of a released mode: its model, numerical settings and Solution."""

    model: Model
    numerics: object
    solution: object


class DecayingRelease(NamedTuple):
    """Release whose motion decays, with the number of amplitudes up to the released one."""

    n_amplitudes: int
    release: Release


class _GrowingRelease(NotConverged):
    """Exception for a released motion that grows.

    Negative damping then supplies more energy than is dissipated.
    """


def run_release(joint: JointMode, model: Model, choice) -> Release:
    """Compute the motion of a model of a released mode.

    Parameters
    ----------
    joint : JointMode
    model : Model
        As from `release_model`.
    choice : Numerics
        Numerical settings.

    Returns
    -------
    Release
    """
    return Release(model, choice, solve.solve_rig(model, choice, joint.patch))


def release_from_largest_decaying(joint: JointMode, amplitudes, progress=None) -> DecayingRelease:
    """Release the mode at the largest amplitude from which its motion decays.

    Parameters
    ----------
    joint : JointMode
    amplitudes : (k,) array
        Increasing, at the output [m].
    progress : callable, optional
        Takes a sentence about the time that a long decay takes.

    Returns
    -------
    DecayingRelease

    Raises
    ------
    NotConverged
        If the motion grows from all amplitudes.
    """
    for count in range(amplitudes.size, 0, -1):
        try:
            release = _release_to_smallest(joint, amplitudes[:count], progress)
            return DecayingRelease(count, release)
        except _GrowingRelease:
            continue
    raise NotConverged(
        f"a release from {format_length(amplitudes[0], 3)} grows, because the negative damping "
        "supplies more energy than friction dissipates; give smaller amplitudes with --amplitudes"
    )


def _is_growing(joint: JointMode, motion: Response) -> bool:
    """Return whether the oscillation grows along the shape of the stuck mode."""
    shape = joint.shape
    _, reversals = locate_reversals(motion.time, motion.modal @ shape, motion.modal_rate @ shape)
    half_cycles = np.abs(np.diff(reversals))
    return (
        find_decay_rate(joint.modes) < 0
        and half_cycles.size > 2
        and half_cycles[-1] > half_cycles[0]
    )


def _release_to_smallest(joint: JointMode, amplitudes, progress=None) -> Release:
    """Release the mode and compute its decay down to the smallest requested amplitude.

    The release begins at an amplitude at which the first reading is above the largest amplitude.
    Each longer run is announced with a time that follows from the time per cycle of the previous
    run.
    """
    travel = joint.model.rig.springs.travel
    begin = min(RELEASE_FACTOR * float(amplitudes[-1]), travel)
    cycles = FIRST_CYCLES
    n_raised = 0
    seconds_per_cycle = 0.0
    free_omega = joint.modes.omega[joint.mode]
    free_swings = N_FREE_CYCLES * 2 * np.pi / free_omega if free_omega else np.inf
    lowest = FINAL_AMPLITUDE_FACTOR * amplitudes[0]
    while True:
        model, choice = _prepare_release(joint, begin, cycles)
        max_cycles = _max_cycles(joint, choice.engine)
        expected = COARSER_RUNS_FACTOR * seconds_per_cycle * cycles
        if progress is not None and expected > ANNOUNCED_SECONDS:
            progress(f"decay over {cycles} cycles: about {expected:.2g} s of computing time")
        release = run_release(joint, model, choice)
        motion = release.solution.response
        seconds_per_cycle = release.solution.seconds / cycles
        if _is_growing(joint, motion):
            raise _GrowingRelease("the release grows")
        decay = identify_decay(joint, motion)
        end = motion.time[-1]
        if not decay.time.size:
            if cycles >= max_cycles or end >= free_swings:
                return release
            # The unit is the cycle of the stuck mode; a half cycle in slip can last hundreds of
            # them.
            cycles = min(8 * cycles, max_cycles)
            continue
        high = decay.amplitude[0]
        low = decay.amplitude[-1]
        stops = decay.time[-1] < end - 3 / decay.frequency[-1]
        if high < amplitudes[-1] and begin < travel and n_raised < MAX_RAISED:
            begin = _raise_release_amplitude(joint, begin, high, amplitudes[-1])
            n_raised += 1
        elif low <= lowest or cycles >= max_cycles or stops:
            return release
        else:
            damping = decay.damping[-1]
            more = np.log(low / lowest) / (2 * np.pi * damping) if damping > 0 else np.inf
            cycles = int(min(np.clip(cycles + more, 2 * cycles, 8 * cycles), max_cycles))


def _max_cycles(joint: JointMode, engine: str) -> int:
    """Return the largest number of cycles that a release may take."""
    if joint.modes.omega.size > 1:
        return MAX_CYCLES
    return MAX_CYCLES_TURNS if engine == HYBRID.name else MAX_CYCLES_ONE_MODE


def _prepare_release(joint: JointMode, amplitude: float, cycles: int) -> tuple:
    """Return the model and the numerical settings of a release at an amplitude [m]."""
    model = release_model(joint, amplitude)
    drive = replace(model.rig.drive, cycles=float(cycles))
    model = replace(model, rig=replace(model.rig, drive=drive))
    choice = numerics.choose_numerics(model)
    is_timeless = model.friction is not None and law_has_trait(model.friction.law, "timeless")
    stores_reversals = joint.is_rigid or (choice.engine == HYBRID.name and is_timeless)
    if joint.modes.omega.size > 1 or not stores_reversals:
        choice = replace(choice, window=int(cycles))
    return model, choice


def _raise_release_amplitude(
    joint: JointMode, release_amplitude: float, first_amplitude: float, largest: float
) -> float:
    """Return a larger release amplitude [m] if the first amplitude of the decay is too small.

    Parameters
    ----------
    joint : JointMode
    release_amplitude : float
        Amplitude of the release so far [m].
    first_amplitude : float
        Its first reading [m].
    largest : float
        Amplitude [m] that the first reading must exceed.
    """
    # Friction reduces the amplitude by two static deflections per half cycle.
    deflection = joint.output_amplitude(joint.deflection) if joint.friction_limit else 0.0
    limit = max(
        MAX_RAISE_FACTOR * release_amplitude, RELEASE_FACTOR * (release_amplitude + 2 * deflection)
    )
    raised = release_amplitude * RELEASE_FACTOR * largest / first_amplitude
    return min(raised, limit, joint.model.rig.springs.travel)


def release_model(joint: JointMode, amplitude: float) -> Model:
    """Return the model of a mode that is released at an output amplitude [m]."""
    model = decays.with_automatic_method(joint.model)
    period = 2 * np.pi / (joint.omega)
    rig = model.rig.with_signal(
        drives.make_release(period),
        kind="free",
        waveform=NO_WAVEFORM,
        frequency=None,
        force=None,
        levels=DriveLevels(),
    )
    rig = replace(rig, start=_initial_state(joint, amplitude))
    return replace(model, rig=rig)


def _initial_state(joint: JointMode, amplitude: float) -> InitialState:
    """Return the initial state of a mode released at an output amplitude [m].

    It is the free motion by harmonic balance, in which no other mode is excited. If this is not
    known, it is the shape of the mode: with the contact stuck, or without the contact at amplitudes
    at which the complete contact slips.
    """
    modes = joint.modes
    at_rest = np.zeros(modes.omega.size)
    if at_rest.size > 1:
        try:
            joint.require_steady_loops("balance")
            first = float(joint.output_amplitude(MIN_AMPLITUDE_FACTOR * joint.slip_displacement))
            first = min(first or amplitude, amplitude)
            amplitudes = np.unique(np.geomspace(first, amplitude, N_START_STEPS))
            free = find_free_motions(joint.steady_laws(), joint, amplitudes, HARMONIC_COUNTS[0])[-1]
            if free is not None:
                order = np.arange(HARMONIC_COUNTS[0] + 1)[:, None]
                rates = 1j * free.omega * order * free.modal
                return InitialState(free.modal.real.sum(axis=0), rates.real.sum(axis=0))
        except (NotConverged, PatchfemError):
            pass
    output = float(modes.output[joint.mode])
    if amplitude > joint.slip_amplitude and output:
        free_shape = np.eye(at_rest.size)[joint.mode]
        return InitialState(free_shape * amplitude / abs(output), at_rest)
    return InitialState(joint.shape * amplitude / joint.reach, at_rest)
