"""Backbone of a mode from a decay after release at the largest amplitude."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import NotConverged
from ...formatting import format_length
from ...response.decay_curve import find_reversals_by_extrapolation
from ...runs.rig import decays, solve
from ...runs.rig.engines import ENGINES, HYBRID
from .decay_identification import identify_decay, measure_other_modes
from .joint import JointMode
from .records import ROUND_OFF_ERROR, Curve, make_curve
from .release import Release, release_from_largest_decaying, run_release

MAX_DOUBLINGS = 3  # Largest number of times that the time steps are halved.
# Largest ratio of the motion of other modes to the amplitude at which a decay counts as that of a
# single mode.
MAX_OTHER_MODES = 0.1


class IdentifiedDecay(NamedTuple):
    """Frequency [Hz] and damping ratio (2, k) identified from a decay, with error estimates (2, k).

    evaluation_error: of the evaluation from reversal to reversal; run_error: from coarser runs.
    """

    value: np.ndarray
    evaluation_error: np.ndarray
    run_error: np.ndarray

    def known_amplitudes(self) -> np.ndarray:
        """Return a mask (k,) of the amplitudes with known values and errors."""
        return np.isfinite(self.value + self.run_error).all(axis=0)


def compute_decay_curve(joint: JointMode, amplitudes, progress=None) -> Curve:
    """Compute the backbone of a mode from its decay after release at the largest amplitude.

    Parameters
    ----------
    joint : JointMode
    amplitudes : (k,) array
        Increasing, at the output [m].
    progress : callable, optional
        Takes a sentence about the time that a long decay takes.

    Returns
    -------
    Curve

    Raises
    ------
    NotConverged
        If no amplitude has a value.
    """
    n_decaying, release = release_from_largest_decaying(joint, amplitudes, progress)
    release, identified = _refine_time_steps(joint, release, amplitudes)
    known = identified.known_amplitudes()
    if not known.any():
        raise NotConverged("the free decay gave no frequency and damping at these amplitudes")
    motion = release.solution.response
    other_modes = measure_other_modes(joint, motion, np.where(known, amplitudes, np.nan))
    last_mixed = amplitudes[other_modes > MAX_OTHER_MODES].max(initial=0.0)
    mixed = known & (other_modes > 0) & (amplitudes <= last_mixed)
    known &= ~mixed
    if not known.any():
        raise NotConverged(
            "at these amplitudes the free decay is no longer a motion of this mode alone: the "
            f"motion of other modes is more than {100 * MAX_OTHER_MODES:.0f} % of its amplitude"
        )
    mesh_error, reason = decays.estimate_decay_mesh_errors(
        joint.model, joint.patch, joint.coarse, amplitudes, lambda laws: joint.mode, joint.stiffer
    )
    error = np.fmax(identified.run_error, mesh_error) + identified.evaluation_error
    notes = [
        *decays.describe_unknown_mesh_errors(
            {"method decay": reason}, lambda: _list_spatial_coarsenings(joint, release)
        ),
        *_note_other_modes(amplitudes[mixed]),
        *_note_growing_motion(amplitudes[n_decaying:]),
        *_note_unknown_modes(joint, known, other_modes),
    ]
    curve = make_curve(
        amplitudes, identified.value, error, notes=tuple(notes), other_modes=other_modes
    )
    return curve.at(known)


def _list_spatial_coarsenings(joint: JointMode, release: Release) -> list:
    """List the runs of a release on coarser meshes or with fewer elements."""
    engine = ENGINES[release.numerics.engine]
    return engine.coarser_in_space(
        release.model, release.numerics, joint.patch, joint.coarse, release.solution
    )


def _note_other_modes(amplitudes) -> list:
    """Return a note on amplitudes (k,) [m] at which other modes move too much in a decay."""
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


def _note_growing_motion(amplitudes) -> list:
    """Return a note on the amplitudes (k,) [m] from which a released motion grows."""
    if not amplitudes.size:
        return []
    return [
        f"method decay: a release from {format_length(amplitudes[0], 3)} grows, because the "
        "negative damping supplies more energy than friction dissipates"
    ]


def _note_unknown_modes(joint: JointMode, known, other_modes) -> list:
    """Return a note on amplitudes at which the motion of other modes is not known."""
    unknown = known & np.isnan(other_modes)
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
    """Release of a mode and its decay curve, with time steps that meet the tolerance.

    If no steps meet it, they are the smallest ones.
    """

    release: Release
    identified: IdentifiedDecay


def _refine_time_steps(joint: JointMode, release: Release, amplitudes) -> RefinedRelease:
    """Halve the time steps of a release until its estimated errors meet the tolerance."""
    model, choice, _ = release
    engine = ENGINES[choice.engine]
    tolerance = joint.model.accuracy.tolerance
    has_steps = "steps_per_cycle" not in choice.pinned and bool(
        engine.coarser_in_time(model, choice)
    )
    for doublings in range(MAX_DOUBLINGS + 1):
        identified = _identify_with_errors(joint, release, amplitudes)
        known = identified.known_amplitudes()
        limit = np.maximum(tolerance * np.abs(identified.value), identified.evaluation_error)
        is_small = (identified.run_error <= limit).all(axis=0)
        is_met = known.any() and is_small[known].all()
        if is_met or doublings == MAX_DOUBLINGS or not has_steps:
            break
        choice = choice.finer()
        release = run_release(joint, model, choice)
    return RefinedRelease(release, identified)


class _CoarserReleases:
    """Frequency [Hz] and damping (2, k) of coarser runs of a release, each computed once.

    Parameters
    ----------
    joint : JointMode
    release : Release
    amplitudes : (k,) array
        At the output [m].
    """

    def __init__(self, joint: JointMode, release: Release, amplitudes):
        self.joint = joint
        self.release = release
        self.amplitudes = amplitudes
        self.computed: dict = {}

    def evaluate_run(self, settings) -> np.ndarray:
        """Return frequency and damping of a coarser run; NaN at amplitudes it does not reach."""
        if settings not in self.computed:
            patch = self.joint.coarse if settings.coarse_patch else self.joint.patch
            solution = solve.solve_rig(self.release.model, replace(settings, whole=True), patch)
            decay = identify_decay(self.joint, solution.response).interpolate(self.amplitudes)
            self.computed[settings] = np.array([decay.frequency, decay.damping])
        return self.computed[settings]

    def compute_change(self, coarsening, value) -> np.ndarray:
        """Return the change (2, k) of frequency and damping due to a given kind of coarsening."""
        base = value if coarsening.reference is None else self.evaluate_run(coarsening.reference)
        runs = coarsening.runs if coarsening.source == "cells" else coarsening.runs[:1]
        return np.max([np.abs(self.evaluate_run(run) - base) for run in runs], axis=0)


def _identify_with_errors(joint: JointMode, release: Release, amplitudes) -> IdentifiedDecay:
    """Identify frequency and damping at amplitudes (k,) [m] from a release, with errors."""
    model, choice, solution = release
    decay = identify_decay(joint, solution.response)
    if choice.engine == HYBRID.name:
        other = identify_decay(joint, solution.response, find_reversals_by_extrapolation)
        decay = decay.add_sampling_error(other)
    decay = decay.interpolate(amplitudes)
    value = np.array([decay.frequency, decay.damping])
    evaluation_error = np.array([decay.frequency_error, decay.damping_error])
    error = ROUND_OFF_ERROR * np.abs(value)
    in_time = ENGINES[choice.engine].coarser_in_time(model, choice)
    coarser_releases = _CoarserReleases(joint, release, amplitudes)
    for coarsening in [*in_time, *_list_spatial_coarsenings(joint, release)]:
        if coarsening.runs:
            error += coarser_releases.compute_change(coarsening, value)
    return IdentifiedDecay(value, evaluation_error, error)
