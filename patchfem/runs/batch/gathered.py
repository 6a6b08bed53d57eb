"""Batch of patches with bonds and shear: pressed together, each reduced to a few points.

In: models of a group, whose fields and histories nobody reads. Out: `CaseResults`.

Cases with one or two modes under a sine march side by side (`dynamics.march.lanes`), with N_POINTS
points and N_PIECE_MODES modes of the pieces, whose error in the backbone is below REDUCTION_TOL_FRACTION of the
tolerance; this error is part of the stated errors. Their coarse runs are those of a single run: half and a
quarter of the steps, and the coarser mesh. A case that sticks, may ring during stick, or needs
more modes runs by itself, and its earlier cycles are evaluated during the run
(`dynamics.march.passing_kernels`); there, points and modes each have an error of a thousandth
of the tolerance (`rig.interface.REDUCTION_TOL_FRACTION`), so that no further run estimates the error of the
modes.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import STICK_SPEED_RATIO
from ...dynamics.march import lanes
from ...dynamics.march.lane_rows import LANES, N_PIECE_MODES, N_POINTS
from ...effects import is_bond_list, law_has_trait
from ...model.model import Model
from ...response import run_events
from ...response.errors import (
    FrictionScale,
    coarser_errors,
    friction_errors,
    split_errors,
    step_errors,
)
from ...response.measures import energy_balance
from ...response.reasons import MAX_OTHER_MODES_FRACTION
from ...response.ringing import MIN_PERIODS, MIN_REFINED_FRACTION
from ..rig.bond_lists import choose_bond_summation
from ..rig.costs import MAX_MARCH_STEPS
from ..rig.engines import MARCH, choose_engine
from ..rig.interface import reduce_to_few_points
from . import pressed
from .case_results import CaseResults, has_unreadable_table
from .lumped.columns import MAIN_MEASURE, Runs, assemble_results
from .lumped.pieces import select_known_values
from .samples import Samples, find_peaks

MAX_CASES_PER_CALL = 256  # largest number of patches that are solved in one call
# largest number of kept samples of all cases in one call, which need 200 MB with their evaluation
MAX_SAMPLES = 1_200_000
MAX_TOTAL_STEPS = 1e7  # largest number of time steps of a run to which the steps are doubled
# largest error of the backbone curve over the tolerance, for the reduction to few modes and for that to
# few points
REDUCTION_TOL_FRACTION = 3e-2
# ratio of the error of a friction loop to the error of the backbone curve, of which a loop has two branches
LOOP_ERROR_FACTOR = 2.0
MAX_STICKING_SLIP = 1e-3  # slip amplitude in bond lengths, up to which a case sticks
RING_MEASURES = "ring_frequency", "ring_damping"
# kinds of errors: time steps, mesh, few modes and points, and errors that the march itself states
ERROR_KINDS = ("steps", "mesh", "modes", "own")


def refuses(model: Model) -> str:
    """Return the reason why this batch (elastic patches with bonds) refuses a model, or "".

    The batch takes elastic patches with bonds under a constant load that are integrated in time.
    """
    if (
        model.patch is None
        or not model.partial_slip
        or model.friction is None
        or not law_has_trait(model.friction.law, "bonds")
        or is_bond_list(model.friction)
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


def group(model: Model) -> Hashable:
    """Return a hashable key that is equal for models that can be integrated in one batch."""
    if why_no_lanes(model):
        return None
    modes = model.rig.modes
    arrays = modes.omega, modes.zeta, modes.slide, modes.base, modes.output
    key = [np.asarray(array, float).tobytes() for array in arrays]
    drive = model.rig.drive
    key += [modes.mass, drive.signal.omega, int(drive.cycles), model.accuracy.tolerance]
    return tuple(key)


def why_no_lanes(model: Model) -> str:
    """Return the reason why a model cannot be integrated in one batch with others, or ""."""
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
        or has_unreadable_table(model)
    ):
        return (
            "the case has [friction.temperature] or accuracy.shear_modes, or its table of measured responses "
            "cannot be read"
        )
    return "" if lanes.can_march(rig.modes) else "the case has too many modes"


def solve(models: Sequence[Model], say=None) -> CaseResults:
    """Compute the case results of a group of elastic patches with bonds."""
    few = [replace(model, patch=model.patch.with_mesh(can_gather_points=True)) for model in models]
    batch = pressed.PatchBatch(MARCH.name, _gather_points, _compute_motions, MAX_CASES_PER_CALL)
    return pressed.solve(few, batch, say)


class _GatheredPoints(NamedTuple):
    """Few contact points that represent a patch, with the error of this reduction.

    - case: as lanes march it.
    - error: error of this reduction as a fraction of the friction limit.
    """

    case: lanes.PointsCase
    error: float


def _gather_points(model: Model, numerics, patch) -> _GatheredPoints | None:
    """Reduce a pressed patch to a few contact points; None if the case is run by itself."""
    if why_no_lanes(model) or numerics.steps % 4:
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
    return _GatheredPoints(case, error)


def _compute_motions(models: list, cases: list, say) -> tuple[CaseResults, np.ndarray]:
    """Compute the motions of solved patches, and the mask (n,) of cases that need a single run."""
    results = CaseResults.blank(len(models))
    runs_singly = np.zeros(len(models), bool)
    all_steps = np.array([case.numerics.steps for case in cases])
    for steps in np.unique(all_steps).tolist():
        indices = np.flatnonzero(all_steps == steps)
        part, runs_singly[indices] = _march_side_by_side(
            [models[k] for k in indices], [cases[k] for k in indices], steps
        )
        results.insert(indices, part)
    return results, runs_singly


def _march_side_by_side(models: list, cases: list, steps: int) -> tuple[CaseResults, np.ndarray]:
    """Compute the results of cases with solved patches by time integration in one batch.

    The cases march with `steps` per cycle, or with twice as many if the displacement needs them and the
    scene does not fix them. Cases with similar slides are neighbours. Returns also which cases (n,) must
    be run by themselves.
    """
    results = CaseResults.blank(len(models))
    runs_singly = np.zeros(len(models), bool)
    relative_drives = [case.fine.case.amplitude / case.fine.case.limit.sum() for case in cases]
    order = np.argsort(relative_drives, kind="stable")
    size = max(1, MAX_SAMPLES // (steps * cases[0].numerics.window * LANES)) * LANES
    for first in range(0, len(models), size):
        indices = order[first : first + size]
        marched = _march_cases([models[k] for k in indices], [cases[k] for k in indices], steps)
        runs_singly[indices] = marched.runs_singly
        results.insert(indices, marched.results)
        finer = indices[marched.needs_more_steps]
        if finer.size:
            part, runs_singly[finer] = _march_side_by_side(
                [models[k] for k in finer], [cases[k] for k in finer], 2 * steps
            )
            results.remove(finer.tolist())
            results.insert(finer, part)
    return results, runs_singly


class _MarchedCases(NamedTuple):
    """Results of n cases that were integrated in one batch with the same time steps.

    - results: CaseResults.
    - runs_singly: which cases (n,) must be run by themselves.
    - needs_more_steps: which (n,) need twice the steps.
    """

    results: CaseResults
    runs_singly: np.ndarray
    needs_more_steps: np.ndarray


def _march_cases(models: list, cases: list, steps: int) -> _MarchedCases:
    """Integrate cases with solved patches in one batch, with coarse runs for their errors."""
    rig = models[0].rig
    numerics = cases[0].numerics
    window = numerics.window
    cycles = int(rig.drive.cycles)

    def march(divisor: int, points: list, searched=None) -> _EvaluatedMarch:
        """Integrate and evaluate the cases with a given fraction of the time steps.

        Parameters
        ----------
        divisor : int
            Fraction of the time steps, as 1/divisor.
        points : list
            Contact points of the cases, on the mesh of the run or on the coarser one.
        searched : (n,) of bool, optional
            Cases that are searched for ringing; None: all.
        """
        lane_cases = [gathered.case for gathered in points]
        marched = lanes.march(
            rig.modes, rig.drive.signal, lane_cases, cycles, steps // divisor, window
        )
        return _evaluate_march(models, cases, marched, steps // divisor, searched)

    fine_points = [case.fine for case in cases]
    fine = march(1, fine_points)
    rings = ~np.isnan(fine.values[RING_MEASURES[0]])
    half = march(2, fine_points, rings)
    quarter = march(4, fine_points, rings)
    coarse = march(4, [case.coarse for case in cases], rings)
    runs, causes = _estimate_run_errors(models, cases, (fine, half, quarter, coarse), steps)
    settings = {"engine": MARCH.name, "steps_per_cycle": steps, "window_cycles": window}
    results, runs_singly, _ = assemble_results(models, runs, settings)
    runs_singly |= runs.stuck | runs.lost
    allowed = (
        models[0].accuracy.tolerance * np.abs(results.values[MAIN_MEASURE])
        + results.floors[MAIN_MEASURE]
    )
    needs_more_steps = ~runs_singly & (results.errors[MAIN_MEASURE] > allowed)
    if (
        2 * steps > MAX_MARCH_STEPS
        or 2 * steps * cycles > MAX_TOTAL_STEPS
        or "steps_per_cycle" in numerics.pinned
    ):
        needs_more_steps[:] = False
    for index in np.flatnonzero(~runs_singly & ~needs_more_steps).tolist():
        case = cases[index]
        results.numerics[index] = results.numerics[index] | {
            "shear_modes": int(case.fine.case.stiffness.size),
            "quadrature": "recursion",
            "interface_nodes": int(case.patch.x.size),
        }
        pressed.add_patch_results(
            results,
            index,
            models[index],
            case,
            float(fine.reach[index]),
            extra=results.numerics[index] | {"cycles": rig.drive.cycles},
            causes=causes[index],
        )
    return _MarchedCases(results, runs_singly, needs_more_steps)


class _EvaluatedMarch(NamedTuple):
    """Measures, energies and stated errors of n cases that were integrated in one batch.

    - values: measures (n,) by name.
    - energies: (n,) by name [J].
    - marched: extremes and phasors of the cycles.
    - stated_errors: errors by name that each case states itself.
    - is_lost (n,): whether the case must be run by itself.
    """

    values: dict
    energies: dict
    marched: lanes.MarchedCases
    stated_errors: list
    is_lost: np.ndarray

    @property
    def reach(self) -> np.ndarray:
        """Largest relative displacement (n,) [m] of each case."""
        return self.marched.reach


def _evaluate_march(
    models: list, cases: list, marched: lanes.MarchedCases, steps: int, searched=None
) -> _EvaluatedMarch:
    """Compute measures, energies and ringing of the cases of a batch from their last cycles.

    Parameters
    ----------
    models : list of Model
    cases : list of pressed.PressedCase
    marched : lanes.MarchedCases
    steps : int
        Steps per cycle.
    searched : (n,) of bool, optional
        Cases that are searched for ringing; None: all.
    """
    rig = models[0].rig
    modes = rig.modes
    drive = rig.drive.signal
    amplitudes = np.array([model.rig.drive.signal.acceleration for model in models])
    samples = Samples(marched, modes, drive.omega, amplitudes, steps, cases[0].numerics.window)
    energies = {"friction": marched.book["lost"], "peak_stored": marched.book["peak"]}
    energies |= marched.book
    load = np.array([case.patch.pressure.load for case in cases])
    points = [case.fine.case for case in cases]
    with np.errstate(all="ignore"):
        stiffness = np.array([model.rig.first_mode.stiffness for model in models])
        values = samples.values(energies, stiffness * ~_has_other_modes(models[0], marched), load)
        # this upper bound of the natural frequencies [rad/s] of the rig takes the bonds as springs
        contact_stiffness = np.array([case.limit.sum() / case.length for case in points])
        fastest = np.sqrt(
            (modes.omega**2).max() + (modes.slide**2).sum() / modes.mass * contact_stiffness
        )
        min_phase = 2 * np.pi * MIN_REFINED_FRACTION * MIN_PERIODS
        may_ring = samples.longest_stick(STICK_SPEED_RATIO) * fastest >= min_phase
        if searched is not None:
            may_ring &= searched
        accelerations = samples.acceleration()
        peak_errors = find_peaks(np.abs(accelerations))[1]
    for name in RING_MEASURES:
        values[name] = np.full(len(models), np.nan)
    stated_errors = [{"absolute_acceleration_peak": float(error)} for error in peak_errors]
    for case in np.flatnonzero(may_ring).tolist():
        window = samples.response(case, accelerations[:, case])
        with np.errstate(all="ignore"):
            rings, errors = run_events.measure_ringing_in_sticks(
                window, modes, drive, max_stick_slip=MAX_STICKING_SLIP * points[case].length
            )
        for name, value in rings.items():
            values[name][case] = value
        stated_errors[case] |= errors
    is_lost = (marched.bad > 0) | ~np.isfinite(marched.book["work_in"])
    return _EvaluatedMarch(values, energies, marched, stated_errors, is_lost)


def _has_other_modes(model: Model, marched: lanes.MarchedCases) -> np.ndarray:
    """Return a mask (n,) of the cases whose slide contains modes other than the first."""
    fraction = model.rig.first_mode.fraction_of_other_modes
    motions = np.moveaxis(marched.z, 2, 0)
    return np.array([fraction(motion) > MAX_OTHER_MODES_FRACTION for motion in motions])


def _estimate_run_errors(
    models: list, cases: list, evaluated: tuple, steps: int
) -> tuple[Runs, list]:
    """Estimate the errors of the cases from coarse runs, in total and by kind of coarse run.

    Parameters
    ----------
    models : list of Model
    cases : list of pressed.PressedCase
    evaluated : tuple of _EvaluatedMarch
        Runs with all, half and a quarter of the steps, and with a quarter on the coarser mesh.
    steps : int
        Steps per cycle.
    """
    fine = evaluated[0]
    cycles = int(models[0].rig.drive.cycles)
    window = cases[0].numerics.window
    columns = []
    for run in evaluated:
        last = run.marched.extremes[:, -window:]
        amplitude = (last[:, :, 1].max(axis=1) - last[:, :, 0].min(axis=1)) / 2
        others = {MAIN_MEASURE: amplitude, "energy_balance": energy_balance(run.energies)}
        columns.append(run.values | others)
    errors = {name: np.zeros(len(models)) for name in columns[0]}
    causes = []
    for case, (model, pressed_case) in enumerate(zip(models, cases)):
        values, half, quarter, coarse = (select_known_values(run, case) for run in columns)
        kinds = (
            step_errors(values, half, quarter, steps=steps),
            coarser_errors(quarter, coarse, order=2.0),
            _reduction_errors(values, pressed_case.fine, model, fine.energies["passed"][case]),
            dict.fromkeys(values, 0.0) | fine.stated_errors[case],
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
        fine.energies,
        fine.marched.extremes,
        fine.marched.phasors[:, ends],
        fine.values["slip_amplitude"] <= max_slip,
        fine.is_lost,
        errors,
        MARCH.min_relative_error,
        MARCH.max_balance_error,
        again=False,
    )
    return runs, causes


def _reduction_errors(values: dict, points: _GatheredPoints, model: Model, work: float) -> dict:
    """Estimate the errors due to few shear modes and few contact points.

    Parameters
    ----------
    values : dict
        Measures by name.
    points : _GatheredPoints
    model : Model
    work : float
        Work that friction exchanged [J].
    """
    length = points.case.length
    limit = points.case.limit.sum()
    cycle_work = 4 * limit * (values["slip_amplitude"] + length)
    scale = FrictionScale(model.friction.static, limit, length, work, cycle_work)
    return friction_errors(values, LOOP_ERROR_FACTOR * points.error, scale)
