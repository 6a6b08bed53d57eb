"""Coupled run from its plan to its result: the solution of an engine, then several passes.

In: a plan with a rig, and its pressed patch. Out: a Result. `_solve` computes the Solution
with its errors from coarse runs; the passes add measures over levels, the outcome, reasons for
missing values, the decay curve, and final floors.
"""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np

from ...core import NotConverged, Outcome, PatchfemError
from ...effects import law_has_trait
from ...model.rig import MAX_TRAVEL
from ...response import reasons, run_events, stationary
from ...response.coarser import estimate_errors, find_open_kinds
from ...response.errors import add_errors
from ...response.outcome import judge_outcome, remove_errors
from ...response.rows import NEEDS_RUN, set_final_floors
from ...response.settling import slip_period
from ...structure.drive_sizes import find_decay_rate, is_periodic
from ..patch import faces
from ..results.result import FRAMES, Result, has_known_mesh_error, remove_unknown_errors
from ..results.travel import outcome_on_piece
from . import decays, flutter, levels, lists, motion_warnings
from .costs import MOST_STEPS
from .engines import ENGINES, Variant, describe_balance_error
from .fields import collect_frames
from .numerics import choose
from .solution import Solution, curve_measures

EARLY_OUTCOMES = (
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
)  # outcomes of a run that ended early
# relative difference from the amplitude of a coarse run, above which it may belong to another peak
OTHER_PEAK_RATIO = 0.1
MIN_STEP_ERROR = 1e-12  # error of a step [1] below which round-off dominates


@dataclass(frozen=True, eq=False, slots=True)
class Coupled:
    """Coupled run between two of its passes.

    - model, numerics, patch: what was solved.
    - raw: Solution of the engine.
    - drive: drive of the motion that is shown.
    - estimated: whether the errors are known.
    - measures: by name.
    - outcome: None before the pass that determines it.
    """

    model: object
    numerics: object
    patch: object
    raw: Solution
    drive: object
    estimated: bool
    measures: dict
    outcome: Outcome | None = None

    @property
    def rubs(self) -> bool:
        """Whether the run has friction."""
        return self.model.friction is not None


def run_coupled(what, patch, coarse, seconds, warnings, say, progress, estimate) -> Result:
    """Run a plan of kind rig or linear.

    The parameters are those of `run.run`; patch and coarse belong to its [contact].
    """
    model = what.model
    rig = what.model.rig
    if rig.start is None and rig.drive.kind != "free" and not np.any(rig.modes.base):
        raise PatchfemError(
            "the drive excites no mode, so nothing moves; give a mode the key `base` or `output`",
            "drive.kind",
        )
    numerics = choose(model)
    engine = ENGINES[numerics.engine]
    engine.call("refuse", model, numerics)
    raw, numerics, measures = _solve(
        model, numerics, patch, coarse[0], seconds, say, progress, estimate
    )
    if wrong := describe_balance_error(engine, measures):
        raw = replace(raw, outcome=Outcome.NOT_CONVERGED, message=raw.message or wrong)
    known = (
        estimate
        and raw.outcome is not Outcome.NOT_CONVERGED
        and has_known_mesh_error(model, patch, coarse)
        and (not rig.friction.has_partial_slip or faces.has_error_meshes(model))
    )
    run = Coupled(
        model, numerics, patch, raw, raw.extra.get("at", rig.drive.signal), known, measures
    )
    for go in (_add_level_measures, _add_outcome, _add_reasons):
        run = go(run)
    run, decay, left_out = _add_decay(run, coarse[0])
    warned = [
        *motion_warnings.collect_warnings(run),
        *motion_warnings.peak_at_an_end(run, lambda: what.modes(what.chain)),
    ]
    notes = [*motion_warnings.collect_notes(run), *left_out]
    if find_decay_rate(rig.modes) < 0 and run.rubs:
        fluttering, more = flutter.find_limit_cycles(run)
        run = replace(run, measures=run.measures | fluttering)
        notes = [*notes, *more]
    run = _set_floors(run)
    outcome = outcome_on_piece(run.outcome, model.patch, patch, raw.response.slide)
    for face in faces.press_faces(model) if model.has_interface_patches else ():
        outcome = outcome_on_piece(outcome, face.model.patch, face.patch, face.slide(raw.response))
    fields = {} if patch is None else collect_frames(model, numerics, patch, raw)
    return Result(
        what,
        outcome,
        run.measures,
        raw.response,
        raw.window,
        patch,
        fields,
        seconds,
        [*warnings, *warned],
        _extra(run, notes) | ({} if decay is None else {"decay": decay}),
    )


def _add_level_measures(run: Coupled) -> Coupled:
    """Return the run with the measures over all levels of its drive."""
    raw = run.raw
    model = run.model
    if not raw.levels:
        return run
    return replace(
        run,
        measures=run.measures
        | levels.level_measures(
            model.rig, raw.levels, raw.probe, model.accuracy.tolerance, run.rubs, raw.coarser
        ),
    )


def _add_outcome(run: Coupled) -> Coupled:
    """Return the run with its outcome, and errors that include those the run itself states."""
    found = remove_unknown_errors(
        run_events.add_uncertainty(run.measures, run.raw.stated_errors), run.estimated
    )
    rig = run.model.rig
    outcome, found = judge_outcome(
        run.raw,
        found,
        run.model.accuracy.tolerance,
        run.drive,
        rig.drive.levels.cycles,
        find_decay_rate(rig.modes),
    )
    if (
        outcome is Outcome.EXCEEDS_TRAVEL and rig.springs.travel == MAX_TRAVEL
    ):  # the limit is not a stop of the scene: nothing bounds the motion
        outcome = Outcome.GROWS
        found = remove_errors(found)
    return replace(run, outcome=outcome, measures=found)


def _add_reasons(run: Coupled) -> Coupled:
    """Return the run with a reason for each measure that lacks a value."""
    found = run.measures
    window = run.raw.window
    rig = run.model.rig
    rigid = (
        run.rubs
        and law_has_trait(run.model.friction.law, "set-valued")
        and not (run.model.partial_slip or rig.friction.has_partial_slip)
    )
    stops = reasons.find_missing_secant(found) if rigid else {}
    return replace(
        run,
        measures=found
        | stops
        | reasons.find_missing_loops(found, window, run.drive)
        | reasons.find_missing_drift(found, run.drive)
        | reasons.find_missing_steady(found, run.outcome, run.drive)
        | reasons.find_missing(
            found, window, run.drive, run.rubs, rig.first_mode.fraction_of_other_modes(window.modal)
        ),
    )


def _add_decay(run: Coupled, coarse) -> tuple:
    """Return the run, its decay curve and notes, with errors not below those due to the mesh.

    The ringing has the error at half the swing in the last stick interval. The curve is None
    without a release. coarse: Patch on a coarser mesh or None. The notes say for which errors the
    mesh is not included.
    """
    found = (
        decays.compute_decay(run.raw)
        if run.model.rig.drive.kind == "free" and run.estimated
        else None
    )
    raw = run.raw
    if (
        run.model.rig.drive.kind != "free"
        or not run.estimated
        or not (run.model.partial_slip or run.model.rig.friction.has_partial_slip)
    ):
        return run, found, []
    ring = run.measures.get("ring_frequency")
    own = (run.model, run.patch, coarse)
    whys = {}
    sticks = run_events.find_stick_intervals(raw.window, run.drive, raw.log, raw.held)
    if ring is not None and ring.value and ring.error is not None and sticks:
        swing = np.ptp(raw.window.output[raw.window.time >= sticks[-1][0]]) / 2
        if swing > 0:
            left, whys["ring_frequency and ring_damping"] = decays.left_by_mesh_on(
                np.array([swing]), ring.value, *own
            )
            wider = {
                name: replace(run.measures[name], error=max(run.measures[name].error, float(one)))
                for name, one in zip(("ring_frequency", "ring_damping"), left[:, 0])
            }
            run = replace(run, measures=run.measures | wider)
    if found is not None:
        mesh, whys["the decay curve"] = decays.left_by_mesh_on(
            found.amplitude, found.frequency[-1], *own
        )
        found = found._replace(
            frequency_error=np.fmax(found.frequency_error, mesh[0]),
            damping_error=np.fmax(found.damping_error, mesh[1]),
        )
    return (
        run,
        found,
        decays.slip_sentences(
            whys,
            lambda: ENGINES[run.numerics.engine].coarser_in_space(
                run.model, run.numerics, run.patch, coarse, raw
            ),
        ),
    )


def _set_floors(run: Coupled) -> Coupled:
    """Return the run with final floors of its measures, and no values of an unbounded motion."""
    found = set_final_floors(run.measures, run.model.accuracy.tolerance)
    if ENGINES[run.numerics.engine].finds_periodic_motion and run.outcome is Outcome.GROWS:
        found = reasons.find_missing_unbounded(found)
    return replace(run, measures=found)


def _extra(run: Coupled, notes: list) -> dict:
    """Return the other data of a Result: settings, levels, events, energies, notes."""
    raw = run.raw
    numerics = run.numerics
    rig = run.model.rig
    tells = ENGINES[numerics.engine].summary_numbers
    numbers = {"steps_per_cycle": numerics.steps, "iterations": raw.book.get("iterations")}
    out = (
        {"engine": numerics.engine, "cycles": numerics.cycles}
        | raw.extra
        | {"window": numerics.window}
    )
    out |= {name: numbers[name] for name in tells}
    for name in ("at", "at_error", "tail"):
        out.pop(name, None)
    if raw.levels:
        out["levels"] = levels.in_scene_units(rig, raw.levels)
    if rig.friction.has_partial_slip and raw.snapshots and "faces" in raw.snapshots[0]:
        out["shots"] = raw.snapshots
    if run.rubs:
        out["events"] = run_events.list_events(raw.window, run.drive, raw.log, raw.held)
    reduced = getattr(raw.contact, "reduction", None)
    if reduced is not None:
        out["elements" if hasattr(reduced, "yield_displacement") else "shear_modes"] = int(
            np.size(reduced.stiffness)
        )
    if raw.summed is not None:
        out["quadrature"] = raw.summed.engine
    if rig.drive.waveform.is_random:
        out["spectra"] = stationary.compute_spectra(raw.window, rig.drive.signal)
        notes = [*notes, *stationary.warn_if_short(run.measures, raw.window)]
    return out | {"book": raw.book, "period": run.drive.period, "notes": notes}


def _solve(model, numerics, patch, coarse, seconds, say, progress, estimated) -> tuple:
    """Return the Solution of the engine, its Numerics, and measures with errors from coarse runs.

    Steps per cycle that the scene does not fix are doubled until the error of the displacement is
    within the tolerance.
    """
    run = _RefinedRun(model, numerics, patch, coarse, say, progress, estimated)
    engine = run.engine
    size = model.rig.displacement_scale
    found = run.solve_fine(numerics)
    seconds |= {"march": found.seconds} | (found.prepare or {})
    n_cycles = _whole_period(model, numerics, found)
    if n_cycles > numerics.window:
        numerics = replace(numerics, window=n_cycles)
        found = run.solve_fine(numerics)
    if not estimated or found.outcome is Outcome.NOT_CONVERGED:
        return found, numerics, add_errors(found.values, size=size) | curve_measures(found.extra)

    def estimate(coarser_runs: list) -> tuple:
        """Return the errors by measure of each kind of coarse run, and the CPU seconds spent."""
        return estimate_errors(
            lambda variant: run.solve_variant(variant, found),
            found.values,
            coarser_runs,
            run.solutions,
        )

    in_space = [
        *engine.coarser_in_space(model, numerics, patch, coarse, found),
        *engine.richer_in_modes(model, numerics, patch),
    ]
    space_errors, spent = estimate(in_space)
    displacement_errors = []  # [m] after each doubling of the steps
    while True:
        in_time = engine.coarser_in_time(model, numerics, patch)
        time_errors, spent_in_time = estimate(in_time)
        spent += spent_in_time
        measures = add_errors(
            found.values,
            *time_errors,
            *space_errors,
            min_relative_error=engine.min_relative_error,
            size=size,
        )
        if numerics.pairs and not errors_met(measures, model.accuracy.tolerance):
            return _solve(model, numerics.finer(), patch, coarse, seconds, say, progress, estimated)
        if found.levels or model.rig.drive.kind == "free":
            found = _with_level_errors(found, [*in_time, *in_space], run.solutions)
        displacement_errors.append(measures["relative_displacement_amplitude"].error or 0.0)
        if _enough(model, numerics, found, measures, displacement_errors) or not time_errors:
            if spent:
                seconds["error"] = spent
            halved = [
                run.solutions[halved_variant]
                for halved_variant in _halved_variants(engine, model, numerics, patch)
            ]
            late = [one for one in (found.extra.get("late"),) if one]
            left_open = find_open_kinds(
                [*(one.of for one in (*in_time, *in_space)), *["end"] * len(late)],
                [*time_errors, *space_errors, *late],
                [one.values for one in (found, *halved)],
            )
            found = replace(found, extra=found.extra | {"left_open": left_open})
            return found, numerics, measures | curve_measures(found.extra, run.solutions.values())
        run.solutions[Variant(numerics, patch)] = found
        spent += found.seconds
        numerics = numerics.finer()
        found = run.solve_fine(numerics)
        seconds["march"] = found.seconds


class _RefinedRun:
    """Successive runs of a model by one engine; `solutions` stores coarse runs by their Variant.

    Parameters
    ----------
    model : Model
    numerics : Numerics
        Settings of the first pass.
    patch : Patch or None
    coarse : Patch or None
        Patch on the coarser mesh.
    say : callable or None
        Receives sentences during the run.
    progress : callable or None
        Receives the completed fraction of all passes.
    estimated : bool
        Whether coarse runs estimate the errors.
    """

    def __init__(self, model, numerics, patch, coarse, say, progress, estimated):
        self.model = model
        self.patch = patch
        self.say = say
        self.engine = ENGINES[numerics.engine]
        self.solutions = {}
        n_steps = _expected_steps(self.engine, model, numerics, patch, coarse, estimated)
        self.passes = Passes(progress, n_steps)
        has_fields = patch is not None and not model.patch.mesh.can_gather_points
        self.frames = FRAMES if has_fields or model.rig.friction.has_partial_slip else 0

    def solve_fine(self, numerics) -> Solution:
        """Return the Solution of the model with its fields."""
        return self._run_pass(self.model, numerics, self.patch, self.frames, self.say)

    def solve_variant(self, variant, found: Solution) -> Solution:
        """Return the Solution of a Variant.

        That of a curve is computed only around the peak of the fine run `found` if that suffices.
        """
        model = self.model
        if variant.numerics.richer:
            model = replace(model, rig=model.rig.structure.richer_rig)
        # the decay curve and some measures need the histories of the whole run
        needs_whole = self.model.rig.drive.kind == "free" or bool(NEEDS_RUN)
        numerics = replace(variant.numerics, whole=needs_whole)
        near_peak = _rerun_around_peak(
            model, found, lambda narrow: self._run_pass(narrow, numerics, variant.patch)
        )
        return near_peak or self._run_pass(model, numerics, variant.patch)

    def _run_pass(self, model, numerics, patch, frames: int = 0, say=None) -> Solution:
        """Run the engine as one pass, and return the Solution."""
        return self.passes.run_pass(
            numerics.steps,
            lambda progress: self.engine.run(model, numerics, patch, frames, say, progress),
        )


def _with_level_errors(found: Solution, coarser_runs: list, solutions: dict) -> Solution:
    """Return a run whose levels have errors from coarse runs, with the coarse runs of its decay.

    Parameters
    ----------
    found : Solution
    coarser_runs : list of CoarserRuns
    solutions : dict
        Solution of each coarse run by its Variant.
    """
    # without coarse runs the levels have errors of their own
    used = [coarser_run for coarser_run in coarser_runs if coarser_run.runs or found.errors is None]
    pairs = [
        (solutions[one.runs[0]], one.beside and solutions[one.beside])
        for one in used
        # a list of bonds has a bound of its error instead of a coarse run
        if one.runs and one.runs[0].numerics.choice is None
    ]
    of_levels = ()
    if found.levels:
        of_levels = levels.levels_with_errors(found.levels, used, solutions)
    return replace(found, levels=of_levels, coarser=tuple(pairs))


def _rerun_around_peak(model, found: Solution, go) -> Solution | None:
    """Return a coarse or richer run of a curve, computed only around its largest amplitude.

    Parameters
    ----------
    model : Model
    found : Solution
        The whole curve of the fine run.
    go : callable
        Function of a Model that returns a Solution.

    Returns
    -------
    Solution or None
        None if there is no curve, or if the run has its largest amplitude elsewhere.
    """
    if (
        "at_error" not in found.extra
        or model.rig.drive.levels.amplitudes
        or model.rig.springs.is_nonlinear
    ):
        return None
    from .steady.curves import sweep_around_peak

    drive = sweep_around_peak(
        model.rig.drive.signal, found.extra["curve"], found.extra["at"].omega / (2 * np.pi)
    )
    if drive is None:
        return None
    try:
        near = go(replace(model, rig=model.rig.with_signal(drive)))
    except NotConverged:  # the whole curve may start at a frequency at which a motion is found
        return None
    name = "relative_displacement_amplitude"
    if (
        "at" not in near.extra
        or name not in near.values
        or motion_warnings.nearest_sweep_end(
            near.extra["at"].omega / (2 * np.pi), drive.low, drive.high
        )
        is not None
    ):
        return None
    return near if abs(near.values[name] / found.values[name] - 1) <= OTHER_PEAK_RATIO else None


class Passes:
    """Progress over all passes of a run, each weighted by its steps; it never decreases.

    Parameters
    ----------
    progress : callable or None
        Called with the completed fraction.
    expected_steps : float
        Expected steps per cycle of all passes together.
    """

    def __init__(self, progress, expected_steps: float):
        self.progress = progress
        self.expected_steps = expected_steps
        self.done = 0.0
        self.shown = 0.0

    def run_pass(self, steps: float, solve):
        """Return the result of solve(progress) for a pass with this number of steps per cycle.

        solve gets None without a progress callback.
        """
        report = None
        if self.progress is not None:

            def report(fraction):
                """Report the completed fraction of this pass."""
                self._report(self.done + fraction * steps, steps)

        found = solve(report)
        self.done += steps
        return found

    def _report(self, done: float, steps: float) -> None:
        """Report the fraction that `done` steps are of the expected ones."""
        self.shown = max(self.shown, done / max(self.expected_steps, self.done + steps))
        self.progress(self.shown)


def _expected_steps(engine, model, numerics, patch, coarse, estimated: bool) -> float:
    """Return the steps per cycle of a run and of its coarse runs together.

    A run on a coarser mesh has the smallest number of steps.
    """
    if not estimated:
        return numerics.steps
    ways = [
        *engine.coarser_in_time(model, numerics, patch),
        *engine.richer_in_modes(model, numerics, patch),
    ]
    each = {numerics: numerics.steps} | {
        run.numerics: run.numerics.steps for way in ways for run in way.runs
    }
    meshed = (coarse is not None and bool(model.partial_slip)) + (
        len(faces.interfaces_with_coarse_mesh(model)) if model.rig.friction.has_partial_slip else 0
    )
    return sum(each.values()) + meshed * min(each.values())


def _halved_variants(engine, model, numerics, patch) -> tuple:
    """Return the Variants at half and a quarter of the steps, for `left_open`; () without steps."""
    ways = engine.coarser_in_time(model, numerics, patch)
    return ways[0].runs if ways and not numerics.local else ()


def errors_met(measures, tolerance: float) -> bool:
    """Return whether the errors of all measures are within the tolerance, or their floors."""
    return all(measure.error_ratio(tolerance) <= 1 for measure in measures.values())


def _whole_period(model, numerics, found) -> int:
    """Return the cycles of a window that contains a whole stick-slip period of a belt.

    No periodic drive sets the period of such a run. It is 0 if there is no period, or if the run is
    shorter than two windows.
    """
    drive = model.rig.drive.signal
    if model.friction is None or not drive.segments or is_periodic(drive):
        return 0
    cycles = ceil(slip_period(found.response.time, found.response.slide_rate) / drive.period)
    return cycles if 2 * cycles <= numerics.cycles else 0


def _enough(model, numerics, found, measures, bars) -> bool:
    """Return whether the displacement is accurate enough, or steps cannot be doubled again."""
    main = measures["relative_displacement_amplitude"]
    again = numerics.steps * 2
    met = main.error_ratio(model.accuracy.tolerance) <= 1
    if numerics.local:
        return met or numerics.local < MIN_STEP_ERROR
    return (
        met
        or "steps_per_cycle" in numerics.pinned
        or again > MOST_STEPS
        or again * numerics.cycles > 1e7
        or lists.is_list_too_long(model, numerics, found.book)
        or lists.doubling_does_not_help(found.book, bars)
        or found.outcome in EARLY_OUTCOMES
    )
