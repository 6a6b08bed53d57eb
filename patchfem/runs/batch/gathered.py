"""Batch of patches with bonds and shear: pressed together, each reduced to a few points.

In: models of a group, whose fields and histories nobody reads. Out: `CaseResults`.

Cases with one or two modes under a sine march side by side (`dynamics.march.lanes`), with N_POINTS
points and N_PIECE_MODES modes of the pieces, whose error in the backbone is below SHARE of the
tolerance; this error is part of the stated errors. Their coarse runs are those of a single run: half and a
quarter of the steps, and the coarser mesh. A case that sticks, may ring during stick, or needs
more modes runs by itself, and its earlier cycles are evaluated during the run
(`dynamics.march.passing_kernels`); there, points and modes each have an error of a thousandth
of the tolerance (`rig.interface.FEWER`), so that no further run estimates the error of the
modes.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ...compiled import load
from ...core import STICK_SPEED_RATIO, Outcome
from ...dynamics.march import lanes
from ...effects import is_bond_list, law_has_trait
from ...model.model import Model
from ...model.source import locate_errors
from ...response import run_events
from ...response.coarser import find_open_kinds
from ...response.errors import FrictionScale, coarser_errors, friction_errors, step_errors
from ...response.measures import energy_balance
from ...response.reasons import MAX_OTHER_MODES_FRACTION
from ...response.ringing import MIN_PERIODS, MIN_REFINED_FRACTION
from ..accuracy_warnings import Finding, tolerance_warnings
from ..patch import result as of_patch
from ..results.result import shorten_file_names
from ..results.travel import outcome_on_piece, warn_of_large_slide
from ..rig.costs import MOST_STEPS
from ..rig.engines import MARCH, choose_engine, unused_settings
from ..rig.interface import few_points
from ..rig.lists import choose_quadrature
from ..rig.motion_warnings import law_warnings
from ..rig.numerics import choose
from . import one_by_one, patches
from .case_results import CaseResults, has_unreadable_table
from .lumped.columns import MAIN_MEASURE, Runs, batch_answers, known_measures
from .lumped.lumped import take_out
from .samples import Samples, peaks

MAX_CASES_PER_CALL = 256  # cases whose patches are pressed in one call
# samples of all cases that march in one call and are kept: 200 MB with the evaluation
SAMPLES = 1_200_000
# fraction of the tolerance by which modes, and points, may each miss the backbone of the patch
SHARE = 3e-2
LOOP_ERROR_FACTOR = (
    2.0  # factor from the error of the backbone to that of a loop, which passes it twice
)
MAX_STICKING_SLIP = 1e-3  # slip in bond lengths up to which a case sticks
RINGS = "ring_frequency", "ring_damping"


class _PressedCase(NamedTuple):
    """Case that marches in a lane.

    - fine, coarse: points of its patch, and of the coarser mesh.
    - error: error of both reductions as a fraction of the friction limit.
    - measures, warnings, notes: of its pressed patch.
    - patch: the pressed Patch.
    - numerics: as of a single run.
    """

    fine: lanes.PointsCase
    coarse: lanes.PointsCase
    error: float
    measures: dict
    warnings: list
    notes: list
    patch: Any
    numerics: Any


def refuses(model: Model) -> str:
    """Return why the batch does not take a model; "" if it does.

    It takes elastic patches with bonds under a constant load that are integrated in time.
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
    """Return a key that is equal for models that march side by side; None for single runs."""
    if no_lanes(model):
        return None
    modes = model.rig.modes
    parts = modes.omega, modes.zeta, modes.slide, modes.base, modes.output
    return (
        *(np.asarray(part, float).tobytes() for part in parts),
        modes.mass,
        model.rig.drive.signal.omega,
        int(model.rig.drive.cycles),
        model.accuracy.tolerance,
    )


def no_lanes(model: Model) -> str:
    """Return why a model that is not refused does not march in a lane; "" if it may."""
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
    """Return the case results of models of a group."""
    few = [replace(model, patch=model.patch.with_mesh(can_gather_points=True)) for model in models]
    return patches.pressed_first(few, MAX_CASES_PER_CALL, lambda part: _solve_cases(part, say))


def _solve_cases(models: list, say) -> CaseResults:
    """Return the case results of models whose patches are pressed."""
    begin = perf_counter()
    out = CaseResults.blank(len(models))
    alone = set(range(len(models)))
    held = (
        {}
        if no_lanes(models[0])
        else {
            case: one
            for case, model in enumerate(models)
            if (one := _press_case(model)) is not None
        }
    )
    for steps in sorted({one.numerics.steps for one in held.values()}):
        cases = [case for case, one in held.items() if one.numerics.steps == steps]
        answers, lost = _side_by_side(
            [models[case] for case in cases], [held[case] for case in cases], steps
        )
        answers.seconds[:] = (perf_counter() - begin) / len(models)
        take_out(answers, np.flatnonzero(lost).tolist())
        out.place(cases, answers)
        alone -= {cases[k] for k in np.flatnonzero(~lost)}
    if alone:
        rest = sorted(alone)
        out.place(rest, one_by_one.solve([models[case] for case in rest], say))
    return out


def _side_by_side(models: list, held: list, steps: int) -> tuple:
    """Return the results of pressed cases, and which (n,) must be run by themselves.

    They march with `steps` per cycle, or with twice as many if the displacement needs them and the
    scene does not fix them. Cases with similar slides are neighbours.
    """
    found = CaseResults.blank(len(models))
    lost = np.zeros(len(models), bool)
    many = load(lanes.LANES_KERNELS).LANES
    order = np.argsort([one.fine.amplitude / one.fine.limit.sum() for one in held], kind="stable")
    size = max(1, SAMPLES // (steps * held[0].numerics.window * many)) * many
    for first in range(0, len(models), size):
        cases = order[first : first + size]
        answers, lost[cases], more = _march_cases(
            [models[k] for k in cases], [held[k] for k in cases], steps
        )
        found.place(cases, answers)
        if (again := cases[more]).size:
            finer, lost[again] = _side_by_side(
                [models[k] for k in again], [held[k] for k in again], 2 * steps
            )
            take_out(found, again.tolist())
            found.place(again, finer)
    return found, lost


def _press_case(model: Model) -> _PressedCase | None:
    """Return a case with its pressed patch on few points; None if it runs by itself."""
    try:
        with locate_errors(model.source):
            patch, *coarse = of_patch.solve_all(model.patch, model.accuracy.tolerance)
            numerics = choose(model)
            if (
                coarse[0] is None
                or patch.pressure.outcome is Outcome.NO_CONTACT
                or numerics.steps % 4
                or choose_quadrature(model, numerics).engine != "recursion"
            ):
                return None
            kernels = load(lanes.LANES_KERNELS)
            tolerance = SHARE * model.accuracy.tolerance
            found = [
                few_points(one, model.bonds, tolerance, kernels.N_POINTS, kernels.N_PIECE_MODES)
                for one in (patch, coarse[0])
            ]
            if None in found:
                return None
            points = [
                lanes.PointsCase(
                    limit,
                    few.shape,
                    few.stiffness,
                    model.bonds.length,
                    model.rig.drive.signal.acceleration,
                )
                for few, limit, _ in found
            ]
            warnings = [
                *model.source.remarks,
                *unused_settings(model, MARCH.name),
                *of_patch.warn_of_strains(model.patch, patch),
            ]
            return _PressedCase(
                *points,
                found[0][2],
                of_patch.static_measures(model, patch, coarse),
                warnings,
                of_patch.notes_on_neglected_effects(model, patch, coarse),
                patch,
                numerics,
            )
    except Exception:  # the case is run by itself, which reports the error
        return None


def _march_cases(models: list, held: list, steps: int) -> tuple:
    """March pressed cases with `steps` per cycle.

    Returns their results, which (n,) must be run by themselves, and which need twice the steps.
    """
    rig = models[0].rig
    window = held[0].numerics.window
    cycles = int(models[0].rig.drive.cycles)

    def read(share: int, coarse: bool = False, asked=None) -> _Read:
        """Return the evaluation of a march with a fraction of the steps, or on the coarser mesh."""
        cases = [one.coarse if coarse else one.fine for one in held]
        done = lanes.march(rig.modes, rig.drive.signal, cases, cycles, steps // share, window)
        return _read(models, held, done, steps // share, asked)

    fine = read(1)
    rings = ~np.isnan(fine.values[RINGS[0]])
    half = read(2, False, rings)
    quarter = read(4, False, rings)
    coarse = read(4, True, rings)
    runs, parts = _with_errors(models, held, (fine, half, quarter, coarse), (steps, window, cycles))
    found, alone, _ = batch_answers(
        models, runs, {"engine": MARCH.name, "steps_per_cycle": steps, "window_cycles": window}
    )
    alone |= runs.stuck | runs.lost
    tolerance = models[0].accuracy.tolerance
    more = ~alone & (
        found.errors[MAIN_MEASURE]
        > tolerance * np.abs(found.values[MAIN_MEASURE]) + found.floors[MAIN_MEASURE]
    )
    if (
        2 * steps > MOST_STEPS
        or 2 * steps * cycles > 1e7
        or "steps_per_cycle" in held[0].numerics.pinned
    ):
        more[:] = False
    for case in np.flatnonzero(~alone & ~more).tolist():
        _tell(found, case, models[case], held[case], (fine, half, quarter), parts[case], steps)
    return found, alone, more


class _Read(NamedTuple):
    """Evaluation of a march of n cases.

    - values: measures (n,) by name.
    - book: energies (n,) by name [J].
    - extremes, phasors: of the cycles.
    - reach (n,): largest slide [m].
    - own: errors by name that each case states itself.
    - lost (n,): whether the case must be run by itself.
    """

    values: dict
    book: dict
    extremes: np.ndarray
    phasors: np.ndarray
    reach: np.ndarray
    own: list
    lost: np.ndarray


def _read(models: list, held: list, done: lanes.MarchedCases, steps: int, asked=None) -> _Read:
    """Evaluate a march with `steps` per cycle.

    asked: which cases (n,) are searched for ringing; None: all.
    """
    modes = models[0].rig.modes
    omega = models[0].rig.drive.signal.omega
    window = held[0].numerics.window
    seen = Samples(
        done,
        modes,
        omega,
        np.array([model.rig.drive.signal.acceleration for model in models]),
        steps,
        window,
    )
    book = {"friction": done.book["lost"], "peak_stored": done.book["peak"]} | done.book
    load = np.array([one.patch.pressure.load for one in held])
    with np.errstate(all="ignore"):
        stiffness = np.array([model.rig.first_mode.stiffness for model in models])
        values = seen.values(book, stiffness * ~_has_other_modes(models[0], done), load)
        # upper bound of the natural frequencies [rad/s] of the rig, with its bonds as springs
        fastest = np.sqrt(
            (modes.omega**2).max()
            + (modes.slide**2).sum()
            / modes.mass
            * np.array([one.fine.limit.sum() / one.fine.length for one in held])
        )
        may = (
            seen.longest_stick(STICK_SPEED_RATIO) * fastest
            >= 2 * np.pi * MIN_REFINED_FRACTION * MIN_PERIODS
        )
        accelerations = seen.acceleration()
        if asked is not None:
            may &= asked
        rings = [
            seen.window_of(case, accelerations[:, case]) if one else None
            for case, one in enumerate(may)
        ]
        drive = models[0].rig.drive.signal
        rings = [
            ({}, {})
            if one is None
            else run_events.measure_rings(
                one, modes, drive, held=MAX_STICKING_SLIP * held[case].fine.length
            )
            for case, one in enumerate(rings)
        ]
        values |= {name: np.array([ring[0].get(name, np.nan) for ring in rings]) for name in RINGS}
        beyond = peaks(np.abs(accelerations))[1]
    own = [
        {"absolute_acceleration_peak": float(above)} | errors
        for above, (_, errors) in zip(beyond, rings)
    ]
    lost = (done.bad > 0) | ~np.isfinite(done.book["work_in"])
    return _Read(values, book, done.extremes, done.phasors, done.reach, own, lost)


def _has_other_modes(model: Model, done: lanes.MarchedCases) -> np.ndarray:
    """Return whether modes other than the first contribute to the slide (n,)."""
    return np.array(
        [
            model.rig.first_mode.fraction_of_other_modes(done.z[:, :, k]) > MAX_OTHER_MODES_FRACTION
            for k in range(done.z.shape[2])
        ]
    )


def _with_errors(models: list, held: list, reads: tuple, counts: tuple) -> tuple:
    """Return the Runs with their errors, and the parts of the errors of each case."""
    fine, (steps, window, cycles), n = reads[0], counts, len(models)
    whole = []
    for one in reads:
        last = one.extremes[:, -window:]
        amplitude = (last[:, :, 1].max(axis=1) - last[:, :, 0].min(axis=1)) / 2
        whole.append(
            one.values | {MAIN_MEASURE: amplitude, "energy_balance": energy_balance(one.book)}
        )
    errors = {name: np.zeros(n) for name in whole[0]}
    parts = []
    for case in range(n):
        a, b, c, d = (
            {name: float(part[case]) for name, part in one.items() if not np.isnan(part[case])}
            for one in whole
        )
        few = _left_out(
            a,
            LOOP_ERROR_FACTOR * held[case].error,
            models[case].friction.static,
            held[case].fine,
            fine.book["passed"][case],
        )
        own = fine.own[case]
        parts.append((step_errors(a, b, c, steps=steps), coarser_errors(c, d, order=2.0), few, own))
        for name, value in a.items():
            errors[name][case] = sum(
                part.get(name, abs(value)) for part in parts[-1][:3]
            ) + own.get(name, 0.0)
    ends = np.arange(cycles - 1, -1, -window)[::-1]
    least = MAX_STICKING_SLIP * np.array([one.fine.length for one in held])
    runs = Runs(
        cycles,
        window,
        fine.values,
        fine.book,
        fine.extremes,
        fine.phasors[:, ends],
        fine.values["slip_amplitude"] <= least,
        fine.lost,
        errors,
        MARCH.min_relative_error,
        MARCH.max_balance_error,
        again=False,
    )
    return runs, parts


def _left_out(
    values: dict, fraction: float, static: float, points: lanes.PointsCase, work: float
) -> dict:
    """Return the errors of the measures due to the small number of modes and points, by name.

    Parameters
    ----------
    values : dict
        Measures by name.
    fraction : float
        Error over the friction limit [1].
    static : float
        Coefficient of friction [1].
    points : lanes.PointsCase
    work : float
        Work that friction exchanged [J].
    """
    limit = points.limit.sum()
    cycle_work = 4 * limit * (values["slip_amplitude"] + points.length)
    return friction_errors(
        values, fraction, FrictionScale(static, limit, points.length, work, cycle_work)
    )


def _tell(
    found: CaseResults,
    case: int,
    model: Model,
    one: _PressedCase,
    reads: tuple,
    parts: tuple,
    steps: int,
) -> None:
    """Add measures of the patch, outcome, settings, warnings and notes, as in a single run."""
    reach = reads[0].reach[case : case + 1]
    known = known_measures(found, case)
    outcome = outcome_on_piece(Outcome(found.outcome[case]), model.patch, one.patch, reach)
    found.outcome[case] = str(outcome)
    found.fill(case, one.measures)
    found.numerics[case] = found.numerics[case] | {
        "shear_modes": int(one.fine.stiffness.size),
        "quadrature": "recursion",
        "interface_nodes": int(one.patch.x.size),
    }
    measures = one.measures | {name: m for name, m in known.items() if name != "normal_load"}
    tolerance = model.accuracy.tolerance
    warned = []
    if any(m.error_ratio(tolerance) > 1 for m in measures.values()):
        runs = [
            {name: float(column[case]) for name, column in read.values.items()} for read in reads
        ]
        extra = found.numerics[case] | {
            "cycles": model.rig.drive.cycles,
            "left_open": find_open_kinds(("steps", "mesh", "modes", "own"), parts, runs),
        }
        warned = tolerance_warnings(Finding(model, measures, one.patch, extra))
    drift = {name: m for name, m in known.items() if name == "drift_per_cycle"}
    warned = shorten_file_names(
        [
            *one.warnings,
            *model.rig.structure.notes,
            *law_warnings(model, outcome, drift, 0.0),
            *warn_of_large_slide(one.patch, reach),
            *warned,
        ],
        model.source.path,
    )
    found.warnings.pop(case, None)
    if warned:
        found.warnings[case] = warned
    if noted := shorten_file_names([*model.source.notes, *one.notes], model.source.path):
        found.notes[case] = noted
