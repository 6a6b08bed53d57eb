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
from ..results.result import FRAMES, Result, on_a_mesh_of_known_error, remove_unknown_errors
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


def run_coupled(
    what, patch, coarse, seconds, warnings, say, progress, per_point, estimate
) -> Result:
    """Run a plan of kind rig or linear.

    The parameters are those of `run.run`; patch and coarse belong to its [contact].
    """
    model, rig = what.model, what.model.rig
    if rig.start is None and rig.drive.kind != "free" and not np.any(rig.modes.base):
        raise PatchfemError(
            "the drive excites no mode, so nothing moves; give a mode the key `base` or `output`",
            "drive.kind",
        )
    numerics = choose(model, per_point)
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
        and on_a_mesh_of_known_error(model, patch, coarse)
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
        run, notes = replace(run, measures=run.measures | fluttering), [*notes, *more]
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
    raw, model = run.raw, run.model
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
        run_events.add_uncertainty(run.measures, run.raw.own), run.estimated
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
        outcome, found = Outcome.GROWS, remove_errors(found)
    return replace(run, outcome=outcome, measures=found)


def _add_reasons(run: Coupled) -> Coupled:
    """Return the run with a reason for each measure that it could have but has not."""
    found, window, rig = run.measures, run.raw.window, run.model.rig
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
    """Return the run, its decay curve and notes, with errors not below those by the mesh.

    The ringing has the error at half the swing in the last stick. The curve is None without a
    release. coarse: Patch on a coarser mesh or None. The notes say for which errors the mesh is not
    included.
    """
    found, raw = (
        decays.compute_decay(run.raw)
        if run.model.rig.drive.kind == "free" and run.estimated
        else None,
        run.raw,
    )
    if (
        run.model.rig.drive.kind != "free"
        or not run.estimated
        or not (run.model.partial_slip or run.model.rig.friction.has_partial_slip)
    ):
        return run, found, []
    ring, own, whys = run.measures.get("ring_frequency"), (run.model, run.patch, coarse), {}
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
            lambda: ENGINES[run.numerics.engine].in_space(
                run.model, run.numerics, run.patch, coarse, raw
            ),
        ),
    )


def _set_floors(run: Coupled) -> Coupled:
    """Return the run with the final floors of its measures, without values if no motion exists."""
    found = set_final_floors(run.measures, run.model.accuracy.tolerance)
    if ENGINES[run.numerics.engine].steady and run.outcome is Outcome.GROWS:
        found = reasons.find_missing_unbounded(found)
    return replace(run, measures=found)


def _extra(run: Coupled, notes: list) -> dict:
    """Return the other data of a Result: settings, levels, events, energies, notes."""
    raw, numerics, rig = run.raw, run.numerics, run.model.rig
    tells = ENGINES[numerics.engine].tells
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
    """Return the Solution of the engine, its Numerics, and measures with errors by coarse runs.

    Steps per cycle that the scene does not fix are doubled until the error of the displacement is
    within the tolerance.
    """
    engine, made = ENGINES[numerics.engine], {}
    has_fields = patch is not None and not model.patch.mesh.can_gather_points
    frames = FRAMES if has_fields or model.rig.friction.has_partial_slip else 0
    passes = Passes(progress, _expected_steps(engine, model, numerics, patch, coarse, estimated))
    size = model.rig.displacement_scale

    def go(meant, numerics, patch, frames=0, say=None):
        """Run the engine as one pass, and return the Solution."""
        return passes.told(
            numerics.steps,
            lambda progress: engine.run(meant, numerics, patch, frames, say, progress),
        )

    found = go(model, numerics, patch, frames, say)
    seconds |= {"march": found.seconds} | (found.prepare or {})
    wide = _whole_period(model, numerics, found)
    if wide > numerics.window:
        numerics = replace(numerics, window=wide)
        found = go(model, numerics, patch, frames, say)
    if not estimated or found.outcome is Outcome.NOT_CONVERGED:
        return found, numerics, add_errors(found.values, size=size) | curve_measures(found.extra)

    def solve(variant):
        """Return the Solution of a Variant; for a curve, only around its peak if that suffices."""
        meant = (
            replace(model, rig=model.rig.structure.richer_rig) if variant.numerics.richer else model
        )
        # the decay curve and some measures need the histories of the whole run
        how = replace(variant.numerics, whole=model.rig.drive.kind == "free" or bool(NEEDS_RUN))
        near = _rerun_around_peak(meant, found, lambda narrow: go(narrow, how, variant.patch))
        return near or go(meant, how, variant.patch)

    meshed = [
        *engine.in_space(model, numerics, patch, coarse, found),
        *engine.in_modes(model, numerics, patch),
    ]
    space, spent = estimate_errors(solve, found.values, meshed, made)
    bars = []  # errors of the displacement [m] after each doubling of the steps
    while True:
        ways = engine.in_time(model, numerics, patch)
        time, more = estimate_errors(solve, found.values, ways, made)
        spent += more
        measures = add_errors(found.values, *time, *space, least=engine.least, size=size)
        if numerics.pairs and not errors_met(measures, model.accuracy.tolerance):
            return _solve(model, numerics.finer(), patch, coarse, seconds, say, progress, estimated)
        if found.levels or model.rig.drive.kind == "free":
            # otherwise the levels have errors of their own
            apart = [one for one in (*ways, *meshed) if one.runs or found.errors is None]
            of_levels = levels.levels_with_errors(found.levels, apart, made) if found.levels else ()
            # a list of bonds has a bound of its error instead of a coarse run
            found = replace(
                found,
                levels=of_levels,
                coarser=tuple(
                    (made[one.runs[0]], one.beside and made[one.beside])
                    for one in apart
                    if one.runs and one.runs[0].numerics.choice is None
                ),
            )
        bars.append(measures["relative_displacement_amplitude"].error or 0.0)
        if _enough(model, numerics, found, measures, bars) or not time:
            if spent:
                seconds["error"] = spent
            runs = [
                found.values,
                *(made[one].values for one in _halved_variants(engine, model, numerics, patch)),
            ]
            late = [one for one in (found.extra.get("late"),) if one]
            kinds = [*(one.of for one in (*ways, *meshed)), *["end"] * len(late)]
            left = find_open_kinds(kinds, [*time, *space, *late], runs)
            found = replace(found, extra=found.extra | {"left_open": left})
            return found, numerics, measures | curve_measures(found.extra, made.values())
        made[Variant(numerics, patch)] = found
        spent += found.seconds
        numerics = numerics.finer()
        found = go(model, numerics, patch, frames, say)
        seconds["march"] = found.seconds


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
    foreseen : float
        Expected steps per cycle of all passes together.
    """

    def __init__(self, progress, foreseen: float):
        self.progress, self.foreseen, self.done, self.shown = progress, foreseen, 0.0, 0.0

    def told(self, steps: float, go):
        """Return the result of go(progress) for a pass with this number of steps per cycle.

        go gets None without a progress callback.
        """
        found = go(
            None
            if self.progress is None
            else lambda share: self._tell(self.done + share * steps, steps)
        )
        self.done += steps
        return found

    def _tell(self, done: float, steps: float) -> None:
        """Report the fraction that `done` steps are of the expected ones."""
        self.shown = max(self.shown, done / max(self.foreseen, self.done + steps))
        self.progress(self.shown)


def _expected_steps(engine, model, numerics, patch, coarse, estimated: bool) -> float:
    """Return the steps per cycle of a run and of its coarse runs together.

    A run on a coarser mesh has the smallest number of steps.
    """
    if not estimated:
        return numerics.steps
    ways = [*engine.in_time(model, numerics, patch), *engine.in_modes(model, numerics, patch)]
    each = {numerics: numerics.steps} | {
        run.numerics: run.numerics.steps for way in ways for run in way.runs
    }
    meshed = (coarse is not None and bool(model.partial_slip)) + (
        len(faces.interfaces_with_coarse_mesh(model)) if model.rig.friction.has_partial_slip else 0
    )
    return sum(each.values()) + meshed * min(each.values())


def _halved_variants(engine, model, numerics, patch) -> tuple:
    """Return the Variants at half and a quarter of the steps, for `left_open`; () without steps."""
    ways = engine.in_time(model, numerics, patch)
    return ways[0].runs if ways and not numerics.local else ()


def errors_met(measures, tolerance: float) -> bool:
    """Return whether the errors of all measures are within the tolerance, or their floors."""
    return all(one.error_ratio(tolerance) <= 1 for one in measures.values())


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
    main, again = measures["relative_displacement_amplitude"], numerics.steps * 2
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
