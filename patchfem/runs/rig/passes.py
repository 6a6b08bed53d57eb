"""Passes that complete a coupled run after its solution is known, in their order.

In: `Coupled`, a run between two of its passes. Out: the same with further measures, its outcome,
its warnings and its notes. `PASSES` lists them.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core import Outcome
from ...effects import law_has_trait
from ...model.rig import MAX_TRAVEL
from ...response import reasons, run_events, stationary
from ...response.decay_curve import DecayCurve
from ...response.outcome import judge_outcome, remove_errors
from ...response.rows import set_final_floors
from ...structure.drive_sizes import find_decay_rate
from ..patch import faces
from ..results.result import RunInputs, has_known_mesh_error, remove_unknown_errors
from ..results.travel import outcome_on_piece
from . import decays, flutter, levels, motion_warnings
from .engines import ENGINES, describe_balance_error
from .numerics import Numerics
from .solution import Solution


@dataclass(frozen=True, eq=False, slots=True)
class Coupled:
    """Coupled run between two of its passes.

    - inputs: plan and pressed patch.
    - numerics, solution: settings and Solution of the engine.
    - measures: by name.
    - outcome: None before the pass that determines it.
    - decay: decay curve of a release, or None.
    - warnings, notes: sentences.
    """

    inputs: RunInputs
    numerics: Numerics
    solution: Solution
    measures: dict
    outcome: Outcome | None = None
    decay: DecayCurve | None = None
    warnings: tuple = ()
    notes: tuple = ()

    @property
    def model(self):
        """Model that was solved."""
        return self.inputs.plan.model

    @property
    def patch(self):
        """Pressed patch of [contact], or None."""
        return self.inputs.patch

    @property
    def drive(self):
        """Drive of the motion that is shown."""
        return self.solution.extra.get("at", self.model.rig.drive.signal)

    @property
    def has_friction(self) -> bool:
        """Whether friction acts."""
        return self.model.friction is not None

    @property
    def has_errors(self) -> bool:
        """Whether the errors of the measures are known."""
        model = self.model
        return (
            self.inputs.estimate
            and self.solution.outcome is not Outcome.NOT_CONVERGED
            and has_known_mesh_error(model, self.patch, self.inputs.coarse)
            and (not model.rig.friction.has_partial_slip or faces.has_error_meshes(model))
        )

    @property
    def extra(self) -> dict:
        """Other data of the Result: settings, levels, events, energies and notes."""
        solution = self.solution
        numerics = self.numerics
        rig = self.model.rig
        numbers = {
            "steps_per_cycle": numerics.steps,
            "iterations": solution.book.get("iterations"),
        }
        extra = {"engine": numerics.engine, "cycles": numerics.cycles}
        extra |= solution.extra | {"window": numerics.window}
        extra |= {name: numbers[name] for name in ENGINES[numerics.engine].summary_numbers}
        for name in ("at", "at_error", "tail"):
            extra.pop(name, None)
        if solution.levels:
            extra["levels"] = levels.in_scene_units(rig, solution.levels)
        snapshots = solution.snapshots
        if rig.friction.has_partial_slip and snapshots and "faces" in snapshots[0]:
            extra["shots"] = snapshots
        if self.has_friction:
            extra["events"] = run_events.list_events(
                solution.window, self.drive, solution.log, solution.held
            )
        reduced = getattr(solution.contact, "reduction", None)
        if reduced is not None:
            name = "elements" if hasattr(reduced, "yield_displacement") else "shear_modes"
            extra[name] = int(np.size(reduced.stiffness))
        if solution.summed is not None:
            extra["quadrature"] = solution.summed.engine
        notes = list(self.notes)
        if rig.drive.waveform.is_random:
            extra["spectra"] = stationary.compute_spectra(solution.window, rig.drive.signal)
            notes += stationary.warn_if_short(self.measures, solution.window)
        extra |= {"book": solution.book, "period": self.drive.period, "notes": notes}
        return extra if self.decay is None else extra | {"decay": self.decay}


def check_energy_balance(run: Coupled) -> Coupled:
    """Return the run as not converged if its energy balance has too large an error."""
    text = describe_balance_error(ENGINES[run.numerics.engine], run.measures)
    if not text:
        return run
    solution = run.solution
    message = solution.message or text
    return replace(run, solution=replace(solution, outcome=Outcome.NOT_CONVERGED, message=message))


def add_level_measures(run: Coupled) -> Coupled:
    """Return the run with the measures over all levels of its drive."""
    solution = run.solution
    model = run.model
    if not solution.levels:
        return run
    measures = levels.level_measures(
        model.rig,
        solution.levels,
        solution.probe,
        model.accuracy.tolerance,
        has_friction=run.has_friction,
        coarser=solution.coarser,
    )
    return replace(run, measures=run.measures | measures)


def add_outcome(run: Coupled) -> Coupled:
    """Return the run with its outcome, and errors that include those the run itself states."""
    rig = run.model.rig
    measures = run_events.add_uncertainty(run.measures, run.solution.stated_errors)
    outcome, measures = judge_outcome(
        run.solution,
        remove_unknown_errors(measures, run.has_errors),
        run.model.accuracy.tolerance,
        run.drive,
        rig.drive.levels.cycles,
        find_decay_rate(rig.modes),
    )
    # without a stop in the scene the limit of the motion is that of the program
    if outcome is Outcome.EXCEEDS_TRAVEL and rig.springs.travel == MAX_TRAVEL:
        outcome = Outcome.GROWS
        measures = remove_errors(measures)
    return replace(run, outcome=outcome, measures=measures)


def add_reasons(run: Coupled) -> Coupled:
    """Return the run with a reason for each measure that lacks a value."""
    measures = run.measures
    window = run.solution.window
    model = run.model
    rig = model.rig
    is_rigid = (
        run.has_friction
        and law_has_trait(model.friction.law, "set-valued")
        and not (model.partial_slip or rig.friction.has_partial_slip)
    )
    other_modes = rig.first_mode.fraction_of_other_modes(window.modal)
    missing = reasons.find_missing_secant(measures) if is_rigid else {}
    missing |= reasons.find_missing_loops(measures, window, run.drive)
    missing |= reasons.find_missing_drift(measures, run.drive)
    missing |= reasons.find_missing_steady(measures, run.outcome, run.drive)
    missing |= reasons.find_missing(measures, window, run.drive, run.has_friction, other_modes)
    return replace(run, measures=measures | missing)


def add_decay(run: Coupled) -> Coupled:
    """Return the run of a release with its decay curve, and errors not below those of the mesh.

    The ringing has the error at half the swing in the last stick interval. The notes say for which
    errors the mesh is not included.
    """
    model = run.model
    if model.rig.drive.kind != "free" or not run.has_errors:
        return run
    solution = run.solution
    run = replace(run, decay=decays.compute_decay(solution))
    if not (model.partial_slip or model.rig.friction.has_partial_slip):
        return run
    coarse = run.inputs.coarse[0]
    causes = {}
    half_swing = _half_swing_of_ringing(run)
    if half_swing > 0:
        errors, causes["ring_frequency and ring_damping"] = decays.mesh_errors_of_stuck_mode(
            np.array([half_swing]),
            run.measures["ring_frequency"].value,
            model,
            run.patch,
            coarse,
        )
        measures = dict(run.measures)
        for name, error in zip(("ring_frequency", "ring_damping"), errors[:, 0]):
            measure = measures[name]
            measures[name] = replace(measure, error=max(measure.error, float(error)))
        run = replace(run, measures=measures)
    if run.decay is not None:
        errors, causes["the decay curve"] = decays.mesh_errors_of_stuck_mode(
            run.decay.amplitude, run.decay.frequency[-1], model, run.patch, coarse
        )
        decay = run.decay._replace(
            frequency_error=np.fmax(run.decay.frequency_error, errors[0]),
            damping_error=np.fmax(run.decay.damping_error, errors[1]),
        )
        run = replace(run, decay=decay)
    engine = ENGINES[run.numerics.engine]
    notes = decays.slip_sentences(
        causes,
        lambda: engine.coarser_in_space(model, run.numerics, run.patch, coarse, solution),
    )
    return replace(run, notes=tuple(notes))


def _half_swing_of_ringing(run: Coupled) -> float:
    """Return half the swing [m] in the last stick interval; 0 if no ringing is measured in it."""
    solution = run.solution
    window = solution.window
    ring = run.measures.get("ring_frequency")
    if ring is None or not ring.value or ring.error is None:
        return 0.0
    sticks = run_events.find_stick_intervals(window, run.drive, solution.log, solution.held)
    if not sticks:
        return 0.0
    return np.ptp(window.output[window.time >= sticks[-1][0]]) / 2


def add_warnings(run: Coupled) -> Coupled:
    """Return the run with its warnings, and its notes before those on its decay."""
    plan = run.inputs.plan
    warnings = [
        *motion_warnings.collect_warnings(run),
        *motion_warnings.peak_at_an_end(run, lambda: plan.modes(plan.chain)),
    ]
    notes = [*motion_warnings.collect_notes(run), *run.notes]
    return replace(run, warnings=tuple(warnings), notes=tuple(notes))


def add_limit_cycles(run: Coupled) -> Coupled:
    """Return the run with the unstable limit cycle of a mode that gains energy."""
    if not run.has_friction or find_decay_rate(run.model.rig.modes) >= 0:
        return run
    measures, notes = flutter.find_limit_cycles(run)
    return replace(run, measures=run.measures | measures, notes=(*run.notes, *notes))


def set_floors(run: Coupled) -> Coupled:
    """Return the run with final floors of its measures, and no values of an unbounded motion."""
    measures = set_final_floors(run.measures, run.model.accuracy.tolerance)
    if ENGINES[run.numerics.engine].finds_periodic_motion and run.outcome is Outcome.GROWS:
        measures = reasons.find_missing_unbounded(measures)
    return replace(run, measures=measures)


def check_travel(run: Coupled) -> Coupled:
    """Return the run with the outcome LEAVES_CONTACT if a piece slides off the other one."""
    model = run.model
    response = run.solution.response
    outcome = outcome_on_piece(run.outcome, model.patch, run.patch, response.slide)
    if model.has_interface_patches:
        for face in faces.press_faces(model):
            outcome = outcome_on_piece(outcome, face.model.patch, face.patch, face.slide(response))
    return replace(run, outcome=outcome)


PASSES = (
    check_energy_balance,
    add_level_measures,
    add_outcome,
    add_reasons,
    add_decay,
    add_warnings,
    add_limit_cycles,
    set_floors,
    check_travel,
)
