"""Batch of elastic patches with bonds, each reduced to a few contact points.

In: models of a group. Out: `CaseResults`, without fields and histories.

Cases with one or two modes under sinusoidal drive are integrated in parallel lanes of a kernel
(`dynamics.march.lanes`). Each patch is reduced to N_POINTS contact points and N_PIECE_MODES shear modes
of the pieces. The error of this reduction in the backbone curve is at most REDUCTION_TOL_FRACTION of the
tolerance and is included in the error estimates. As in a single run, the coarse runs have half and a quarter
of the steps, and a coarser mesh.

A case that sticks, may ring during stick or needs more modes is computed by a single run. There,
the error of the reduction is a thousandth of the tolerance (`rig.interface.REDUCTION_TOL_FRACTION`) and
needs no estimate.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import STICK_SPEED_RATIO
from ...dynamics.march import lanes
from ...dynamics.march.lane_rows import LANES, N_PIECE_MODES, N_POINTS
from ...effects import law_has_trait, needs_bond_list
from ...model.model import Model
from ...response import run_events
from ...response.errors import (
    FrictionScale,
    convergence_errors,
    friction_errors,
    split_errors,
)
from ...response.measures import energy_balance, interpolate_peaks, interpolate_ranges
from ...response.reasons import MAX_OTHER_MODES_FRACTION
from ...response.ringing import MIN_PERIODS, MIN_REFINED_FRACTION
from ..rig.bond_lists import choose_bond_summation
from ..rig.costs import MAX_MARCH_STEPS, MAX_RUN_STEPS
from ..rig.engines import MARCH, choose_engine
from ..rig.interface import reduce_to_few_points
from . import solved_patches
from .case_results import CaseResults, has_unreadable_measurements
from .lumped.columns import MAIN_MEASURE, Runs, assemble_results
from .samples import Samples

MAX_CASES_PER_CALL = 256  # largest number of patches in one call
# Largest number of stored samples of all cases in one call; their evaluation needs 200 MB.
MAX_SAMPLES = 1_200_000
# Largest ratio of the error of the backbone curve to the tolerance, for the reduction to few modes and for
# the reduction to few points.
REDUCTION_TOL_FRACTION = 3e-2
# Ratio of the error of a friction loop to that of the backbone curve: a loop has two branches.
LOOP_ERROR_FACTOR = 2.0
MAX_STICKING_SLIP = 1e-3  # largest slip amplitude of a sticking case, in bond lengths
RING_MEASURES = "ring_frequency", "ring_damping"
# Sources of error: time steps, mesh, reduction to few modes and points, and peak sampling or ringing fit.
ERROR_KINDS = ("steps", "mesh", "modes", "own")


def refusal_reason(model: Model) -> str:
    """Return why a model is not an elastic patch with bonds that is integrated in time, or "".

    The normal load must be constant.
    """
    if (
        model.patch is None
        or not model.partial_slip
        or model.friction is None
        or not law_has_trait(model.friction.law, "bonds")
        or needs_bond_list(model.friction)
    ):
        return "the case is not an elastic patch with a law of bonds"
    if (
        model.rig.friction.load_varies
        or model.patch.interface.strips is not None
        or model.grooves is not None
        or model.wear is not None
    ):
        return "the load of the case changes, or the case has strips, grooves or wear"
    return "" if choose_engine(model) is MARCH else "the case is not integrated in time"


def group_key(model: Model) -> Hashable:
    """Return a hashable key; models with equal keys can be integrated together, None: none."""
    if reason_not_in_lanes(model):
        return None
    modes = model.rig.modes
    arrays = modes.omega, modes.zeta, modes.slide, modes.base, modes.output
    key = [np.asarray(array, float).tobytes() for array in arrays]
    drive = model.rig.drive
    key += [modes.mass, drive.signal.omega, int(drive.cycles), model.accuracy.tolerance]
    return tuple(key)


def reason_not_in_lanes(model: Model) -> str:
    """Return why a model cannot be integrated in lanes together with others, or ""."""
    rig = model.rig
    law = model.bonds
    if (
        not rig.drive.waveform.is_sine
        or rig.drive.kind != "base"
        or rig.drive.levels.amplitudes
        or rig.start is not None
        or rig.springs.is_nonlinear
        or rig.friction.names
    ):
        return (
            "the case is not a rig that starts at rest and is driven by a base motion of one sine"
        )
    if (
        rig.modes.gauge is not None
        or rig.structure.richer_rig is not None
        or np.isfinite(rig.springs.travel)
    ):
        return "the case has a gauge, a reduced structure or a stop"
    if rig.drive.cycles != int(rig.drive.cycles) or rig.drive.cycles < 20:
        return "the case has fewer than 20 cycles, or a number of cycles that is not whole"
    if (
        law.has_growth
        or law.order != 1
        or law.initial != 1
        or law.breakaway
        or law.ratio != 1
        or not law.static > 0
    ):
        return "the bonds of the case change in number or length"
    if (
        model.heat is not None
        or model.accuracy.shear_modes is not None
        or has_unreadable_measurements(model)
    ):
        return (
            "the case has [friction.temperature] or accuracy.shear_modes, or its table of measured responses "
            "cannot be read"
        )
    return "" if lanes.can_march(rig.modes) else "the case has too many modes"


def solve(models: Sequence[Model], report=None) -> CaseResults:
    """Compute the case results of a group of elastic patches with bonds."""
    patches = [model.patch.with_mesh(can_gather_points=True) for model in models]
    reducible_models = [replace(model, patch=patch) for model, patch in zip(models, patches)]
    batch = solved_patches.PatchBatch(
        MARCH.name, _reduce_patch, _compute_motions, MAX_CASES_PER_CALL
    )
    return solved_patches.solve(reducible_models, batch, report)


class _ReducedPatch(NamedTuple):
    """Few contact points that represent a patch, and the error of this reduction.

    - case: input of the lane kernel.
    - error: error of the reduction relative to the friction limit.
    """

    case: lanes.PointsCase
    error: float


def _reduce_patch(model: Model, numerics, patch) -> _ReducedPatch | None:
    """Reduce a solved patch to a few contact points; return None if the case needs a single run."""
    if reason_not_in_lanes(model) or numerics.steps % 4:
        return None
    if choose_bond_summation(model, numerics).engine != "recursion":
        return None
    tolerance = REDUCTION_TOL_FRACTION * model.accuracy.tolerance
    points = reduce_to_few_points(patch, model.bonds, tolerance, N_POINTS, N_PIECE_MODES)
    if points is None:
        return None
    pieces, limit, error = points
    case = lanes.PointsCase(
        limit,
        pieces.shape,
        pieces.stiffness,
        model.bonds.length,
        model.rig.drive.signal.acceleration,
    )
    return _ReducedPatch(case, error)


def _compute_motions(models: list, cases: list, report) -> tuple[CaseResults, np.ndarray]:
    """Compute the motions of solved cases; return the results and a mask of needed single runs."""
    results = CaseResults.blank(len(models))
    needs_single_run = np.zeros(len(models), bool)
    all_steps = np.array([case.numerics.steps for case in cases])
    for steps in np.unique(all_steps).tolist():
        indices = np.flatnonzero(all_steps == steps)
        part, needs_single_run[indices] = _march_in_lanes(
            [models[k] for k in indices], [cases[k] for k in indices], steps
        )
        results.insert(indices, part)
    return results, needs_single_run


def _march_in_lanes(models: list, cases: list, steps: int) -> tuple[CaseResults, np.ndarray]:
    """Compute the results of cases with solved patches by time integration in lanes.

    The number of steps per cycle is doubled for cases whose displacement error exceeds the tolerance,
    unless the scene fixes it. Cases with similar slides are computed in neighbouring lanes. Returns also a
    mask (n,) of the cases that need a single run.
    """
    results = CaseResults.blank(len(models))
    needs_single_run = np.zeros(len(models), bool)
    relative_drives = [case.fine.case.amplitude / case.fine.case.limit.sum() for case in cases]
    order = np.argsort(relative_drives, kind="stable")
    size = max(1, MAX_SAMPLES // (steps * cases[0].numerics.window * LANES)) * LANES
    for first in range(0, len(models), size):
        indices = order[first : first + size]
        marched = _march_cases([models[k] for k in indices], [cases[k] for k in indices], steps)
        needs_single_run[indices] = marched.needs_single_run
        results.insert(indices, marched.results)
        finer = indices[marched.needs_more_steps]
        if finer.size:
            part, needs_single_run[finer] = _march_in_lanes(
                [models[k] for k in finer], [cases[k] for k in finer], 2 * steps
            )
            results.remove(finer.tolist())
            results.insert(finer, part)
    return results, needs_single_run


class _MarchedCases(NamedTuple):
    """Results of n cases that were integrated together with the same number of steps.

    - results: CaseResults.
    - needs_single_run: mask (n,) of the cases that need a single run.
    - needs_more_steps: mask (n,) of the cases that need twice the steps.
    """

    results: CaseResults
    needs_single_run: np.ndarray
    needs_more_steps: np.ndarray


def _march_cases(models: list, cases: list, steps: int) -> _MarchedCases:
    """Integrate cases with the same steps, and estimate their errors by coarse runs."""
    rig = models[0].rig
    numerics = cases[0].numerics
    window = numerics.window
    cycles = int(rig.drive.cycles)

    def march(divisor: int, points: list, searches_ringing=None) -> _EvaluatedMarch:
        """Integrate the cases with fewer steps and evaluate them.

        Parameters
        ----------
        divisor : int
            Divisor of the number of steps per cycle.
        points : list
            Reduced patches of the cases, on the fine or on the coarser mesh.
        searches_ringing : (n,) of bool, optional
            Mask of the cases in which ringing is sought; None: all.
        """
        lane_cases = [gathered.case for gathered in points]
        marched = lanes.march(
            rig.modes, rig.drive.signal, lane_cases, cycles, steps // divisor, window
        )
        return _evaluate_march(models, cases, marched, steps // divisor, searches_ringing)

    fine_points = [case.fine for case in cases]
    fine = march(1, fine_points)
    rings = ~np.isnan(fine.values[RING_MEASURES[0]])
    half = march(2, fine_points, rings)
    quarter = march(4, fine_points, rings)
    coarse = march(4, [case.coarse for case in cases], rings)
    runs, causes = _estimate_run_errors(models, cases, (fine, half, quarter, coarse), steps)
    settings = {"engine": MARCH.name, "steps_per_cycle": steps, "window_cycles": window}
    results, needs_single_run, _ = assemble_results(models, runs, settings)
    needs_single_run |= runs.is_stuck | runs.needs_single_run
    allowed_error = (
        models[0].accuracy.tolerance * np.abs(results.values[MAIN_MEASURE])
        + results.floors[MAIN_MEASURE]
    )
    needs_more_steps = ~needs_single_run & (results.errors[MAIN_MEASURE] > allowed_error)
    if (
        2 * steps > MAX_MARCH_STEPS
        or 2 * steps * cycles > MAX_RUN_STEPS
        or "steps_per_cycle" in numerics.pinned
    ):
        needs_more_steps[:] = False
    for index in np.flatnonzero(~needs_single_run & ~needs_more_steps).tolist():
        case = cases[index]
        results.numerics[index] = results.numerics[index] | {
            "shear_modes": int(case.fine.case.stiffness.size),
            "quadrature": "recursion",
            "interface_nodes": int(case.patch.x.size),
        }
        solved_patches.add_patch_results(
            results,
            index,
            models[index],
            case,
            float(fine.reach[index]),
            extra=results.numerics[index] | {"cycles": rig.drive.cycles},
            causes=causes[index],
        )
    return _MarchedCases(results, needs_single_run, needs_more_steps)


class _EvaluatedMarch(NamedTuple):
    """Measures, energies and error estimates of n cases that were integrated together.

    - values: measures (n,) by name.
    - energies: energies (n,) by name [J].
    - marched: motion, extremes and phasors of the cycles.
    - error_estimates: errors of peak sampling and of the ringing fit by name, a dict per case.
    - needs_single_run: mask (n,) of the cases that need a single run.
    """

    values: dict
    energies: dict
    marched: lanes.MarchedCases
    error_estimates: list
    needs_single_run: np.ndarray

    @property
    def reach(self) -> np.ndarray:
        """Largest absolute relative displacement of each case (n,) [m]."""
        return self.marched.reach


def _evaluate_march(
    models: list, cases: list, marched: lanes.MarchedCases, steps: int, searches_ringing=None
) -> _EvaluatedMarch:
    """Compute measures, energies and ringing of n cases from their last cycles.

    Parameters
    ----------
    models : list of Model
    cases : list of solved_patches.SolvedCase
    marched : lanes.MarchedCases
    steps : int
        Steps per cycle.
    searches_ringing : (n,) of bool, optional
        Cases that are searches_ringing for ringing; None: all.
    """
    rig = models[0].rig
    modes = rig.modes
    drive = rig.drive.signal
    amplitudes = np.array([model.rig.drive.signal.acceleration for model in models])
    samples = Samples(marched, modes, drive.omega, amplitudes, steps, cases[0].numerics.window)
    energies = {"friction": marched.energies["lost"], "peak_stored": marched.energies["peak"]}
    energies |= marched.energies
    load = np.array([case.patch.pressure.load for case in cases])
    points = [case.fine.case for case in cases]
    with np.errstate(all="ignore"):
        stiffness = np.array([model.rig.first_mode.stiffness for model in models])
        values = samples.values(energies, stiffness * ~_has_other_modes(models[0], marched), load)
        # upper bound of the natural frequencies [rad/s] of the rig with all bonds sticking
        contact_stiffness = np.array([case.limit.sum() / case.length for case in points])
        fastest = np.sqrt(
            (modes.omega**2).max() + (modes.slide**2).sum() / modes.mass * contact_stiffness
        )
        min_phase = 2 * np.pi * MIN_REFINED_FRACTION * MIN_PERIODS
        may_ring = samples.longest_stick_duration(STICK_SPEED_RATIO) * fastest >= min_phase
        if searches_ringing is not None:
            may_ring &= searches_ringing
        accelerations = samples.acceleration()
        peak_errors = {
            "absolute_acceleration_peak": interpolate_peaks(np.abs(accelerations))[1],
            "friction_force_peak": interpolate_peaks(np.abs(marched.force))[1],
            "slip_amplitude": interpolate_ranges(marched.slip)[1] / 2,
        }
    last = marched.extremes[:, -samples.window :]
    values[MAIN_MEASURE] = (last[:, :, 1].max(axis=1) - last[:, :, 0].min(axis=1)) / 2
    values["energy_balance"] = energy_balance(energies)
    for name in RING_MEASURES:
        values[name] = np.full(len(models), np.nan)
    error_estimates = []
    for case in range(len(models)):
        error_estimates.append({name: float(errors[case]) for name, errors in peak_errors.items()})
    for case in np.flatnonzero(may_ring).tolist():
        window = samples.response(case, accelerations[:, case])
        with np.errstate(all="ignore"):
            rings, errors = run_events.measure_ringing_in_sticks(
                window, modes, drive, max_stick_slip=MAX_STICKING_SLIP * points[case].length
            )
        for name, value in rings.items():
            values[name][case] = value
        error_estimates[case] |= errors
    needs_single_run = (marched.n_unsolved > 0) | ~np.isfinite(marched.energies["work_in"])
    return _EvaluatedMarch(values, energies, marched, error_estimates, needs_single_run)


def _has_other_modes(model: Model, marched: lanes.MarchedCases) -> np.ndarray:
    """Return a mask (n,) of the cases in which modes other than the first carry the slide."""
    fraction = model.rig.first_mode.fraction_of_other_modes
    motions = np.moveaxis(marched.z, 2, 0)
    return np.array([fraction(motion) > MAX_OTHER_MODES_FRACTION for motion in motions])


def _estimate_run_errors(
    models: list, cases: list, evaluated: tuple, steps: int
) -> tuple[Runs, list]:
    """Estimate the errors of the cases from coarse runs, in total and by source.

    Parameters
    ----------
    models : list of Model
    cases : list of solved_patches.SolvedCase
    evaluated : tuple of _EvaluatedMarch
        Runs with all, half and a quarter of the steps, and one with a quarter on the coarser mesh.
    steps : int
        Steps per cycle.
    """
    fine = evaluated[0]
    cycles = int(models[0].rig.drive.cycles)
    window = cases[0].numerics.window
    errors = {name: np.zeros(len(models)) for name in fine.values}
    causes = []
    for case, (model, solved_case) in enumerate(zip(models, cases)):
        known_values = [_select_known_values(run.values, case) for run in evaluated]
        values, half, quarter, coarse = known_values
        kinds = (
            convergence_errors(values, half, quarter, steps=steps),
            convergence_errors(quarter, coarse, order=2.0),
            _reduction_errors(values, solved_case.fine, model, fine.energies["passed"][case]),
            dict.fromkeys(values, 0.0) | fine.error_estimates[case],
        )
        kind_errors = zip(ERROR_KINDS, kinds, strict=True)
        causes.append(split_errors(values, list(kind_errors), (values, half, quarter)))
        for name in values:
            errors[name][case] = sum(causes[-1][name].parts.values())
    ends = np.arange(cycles - 1, -1, -window)[::-1]
    max_slip = MAX_STICKING_SLIP * np.array([case.fine.case.length for case in cases])
    runs = Runs(
        cycles,
        window,
        fine.values,
        fine.marched.extremes,
        fine.marched.phasors[:, ends],
        fine.values["slip_amplitude"] <= max_slip,
        fine.needs_single_run,
        errors,
        MARCH.min_relative_error,
        MARCH.max_balance_error,
        refines_steps=False,
    )
    return runs, causes


def _select_known_values(measures: dict, case: int) -> dict:
    """Return the finite values of one case from a dict of columns."""
    values = {name: float(column[case]) for name, column in measures.items()}
    return {name: value for name, value in values.items() if not np.isnan(value)}


def _reduction_errors(
    values: dict, reduced_patch: _ReducedPatch, model: Model, work: float
) -> dict:
    """Estimate the errors due to the reduction to few shear modes and contact points.

    Parameters
    ----------
    values : dict
        Measures by name.
    reduced_patch : _ReducedPatch
    model : Model
    work : float
        Sum of the absolute work of the friction force [J].
    """
    length = reduced_patch.case.length
    limit = reduced_patch.case.limit.sum()
    cycle_work = 4 * limit * (values["slip_amplitude"] + length)
    scale = FrictionScale(model.friction.static, limit, length, work, cycle_work)
    return friction_errors(values, LOOP_ERROR_FACTOR * reduced_patch.error, scale)
