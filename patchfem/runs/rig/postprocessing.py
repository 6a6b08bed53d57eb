"""Completion of a run of a rig after its motion is solved, in the order of `rig.run_rig`.

In: a `CoupledRun`. Out: the same with further measures, its outcome and its notes, and finally the
warnings and other data of its Result.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...core import Outcome
from ...model.rig import MAX_TRAVEL
from ...response import reasons, stationary
from ...response.decay_curve import DecayCurve
from ...response.errors import add_run_error_estimates
from ...response.measures import Measures
from ...response.outcome import judge_outcome, remove_errors
from ...structure.drive_sizes import find_decay_rate
from ..patch import faces
from ..results.result import RunInputs, can_estimate_mesh_error
from ..results.travel import check_pieces_overlap
from . import decays, flutter, levels
from .engines import ENGINES, describe_balance_error
from .numerics import Numerics
from .solution import Fields, Solution


@dataclass(frozen=True, eq=False, slots=True)
class CoupledRun:
    """Run of a rig whose Result is completed step by step.

    - inputs: plan and Patch of the run.
    - numerics, solution: settings and Solution of the engine.
    - measures: measures by name.
    - outcome: Outcome, or None before `add_outcome_and_errors`.
    - decay: decay curve of a release, or None.
    - notes: sentences on the decay and on limit cycles.
    """

    inputs: RunInputs
    numerics: Numerics
    solution: Solution
    measures: Measures
    outcome: Outcome | None = None
    decay: DecayCurve | None = None
    notes: tuple[str, ...] = ()

    @property
    def model(self):
        """Model of the run."""
        return self.inputs.plan.model

    @property
    def patch(self):
        """Patch of the table [contact] with its static solution; None without that table."""
        return self.inputs.patch

    @property
    def drive(self):
        """Drive at which the measures are evaluated."""
        return self.solution.drive or self.model.rig.drive.signal

    @property
    def has_friction(self) -> bool:
        """Whether the rig has friction."""
        return self.model.friction is not None

    @property
    def has_errors(self) -> bool:
        """Whether the errors of the measures are known."""
        model = self.model
        return (
            self.inputs.estimate
            and self.solution.outcome is not Outcome.NOT_CONVERGED
            and can_estimate_mesh_error(model, self.patch, self.inputs.coarse)
            and (not model.rig.friction.has_partial_slip or faces.has_error_meshes(model))
        )


def add_onset_level(run: CoupledRun) -> CoupledRun:
    """Return the run with the drive level at the onset of slip."""
    model = run.model
    onset = levels.measure_onset_level(model.rig, run.solution, model.accuracy.tolerance)
    return replace(run, measures=run.measures | {"onset_level": onset})


def add_outcome_and_errors(run: CoupledRun) -> CoupledRun:
    """Return the run with its outcome, and with all error estimates of its measures.

    The errors that the run itself shows (`Solution.run_errors`) are added to the errors from coarse
    runs. A motion that grows has no errors. The outcome is NOT_CONVERGED if the error of the energy
    balance is too large.
    """
    solution = run.solution
    if text := describe_balance_error(ENGINES[run.numerics.engine], run.measures):
        message = solution.message or text
        solution = replace(solution, outcome=Outcome.NOT_CONVERGED, message=message)
        run = replace(run, solution=solution)

    rig = run.model.rig
    measures = add_run_error_estimates(run.measures, solution.run_errors)
    if not run.has_errors:
        measures = remove_errors(measures)

    outcome, steady = judge_outcome(
        solution,
        measures,
        run.model.accuracy.tolerance,
        run.drive,
        rig.drive.levels.cycles,
        find_decay_rate(rig.modes),
    )

    # Without a stop in the scene, the motion has not hit anything: it exceeded the limit of the
    # program.
    if outcome is Outcome.EXCEEDS_TRAVEL and rig.springs.travel == MAX_TRAVEL:
        outcome = Outcome.GROWS
    # A growing motion has no final values, so the errors of its measures are unknown.
    if outcome is Outcome.GROWS and solution.outcome is not Outcome.GROWS:
        measures = remove_errors(measures)
    return replace(run, outcome=outcome, measures=measures | steady)


def add_missing_value_reasons(run: CoupledRun) -> CoupledRun:
    """Return the run with a reason for each measure without a value."""
    measures = run.measures
    window = run.solution.window
    model = run.model
    is_rigid = run.has_friction and model.sticks_rigidly
    other_modes = model.rig.first_mode.fraction_of_other_modes(window.modal)
    missing = reasons.find_missing_secant(measures) if is_rigid else {}
    missing |= reasons.find_missing_loops(measures, window, run.drive)
    missing |= reasons.find_missing_drift(measures, run.drive)
    missing |= reasons.find_missing_steady(measures, run.outcome, run.drive)
    missing |= reasons.find_missing(measures, window, run.drive, run.has_friction, other_modes)
    return replace(run, measures=measures | missing)


def add_decay_curve(run: CoupledRun) -> CoupledRun:
    """Return a released run with its decay curve, including mesh errors.

    A note says where the mesh error is unknown.
    """
    model = run.model
    solution = run.solution
    run = replace(run, decay=decays.compute_decay_curve(solution))
    has_partial_slip = model.partial_slip or model.rig.friction.has_partial_slip
    if run.decay is None or not has_partial_slip:
        return run

    # Below the slip of the first node, two meshes have the same decay, so that static loops give the mesh error.
    decay = run.decay
    coarse = run.inputs.coarse[0]
    stiffer = run.inputs.stiffer
    errors, reason = decays.estimate_stuck_mode_mesh_errors(
        decay.amplitude, decay.frequency[-1], model, run.patch, coarse, stiffer
    )
    decay = decay._replace(
        frequency_error=np.fmax(decay.frequency_error, errors[0]),
        damping_error=np.fmax(decay.damping_error, errors[1]),
    )

    if not reason:
        return replace(run, decay=decay)
    engine = ENGINES[run.numerics.engine]
    coarser = engine.coarser_in_space(model, run.numerics, run.patch, coarse, solution)
    return replace(run, decay=decay, notes=(decays.describe_unknown_mesh_error(reason, coarser),))


def add_flutter_amplitude(run: CoupledRun) -> CoupledRun:
    """Return the run with the amplitude of the unstable limit cycle of a self-excited mode."""
    measures, notes = flutter.compute_flutter_amplitude(run)
    return replace(run, measures=run.measures | measures, notes=(*run.notes, *notes))


def find_final_outcome(run: CoupledRun) -> Outcome:
    """Return the outcome of a run, or LEAVES_CONTACT if a piece slides off the other."""
    model = run.model
    response = run.solution.response
    outcome = check_pieces_overlap(run.outcome, model.patch, run.patch, response.slide)
    if model.has_interface_patches:
        for face in faces.solve_interface_patches(model):
            outcome = check_pieces_overlap(
                outcome, face.model.patch, face.patch, face.slide(response)
            )
    return outcome


def collect_summary_data(run: CoupledRun, measures: Measures, notes: list[str]) -> Fields:
    """Collect settings, levels, events, energies and notes of a run for its Result.

    Parameters
    ----------
    run : CoupledRun
        Completed run.
    measures : dict
        Final measures by name.
    notes : list
        Sentences.
    """
    solution = run.solution
    numerics = run.numerics
    rig = run.model.rig
    numbers = {"steps_per_cycle": numerics.steps, "iterations": solution.book.get("iterations")}
    extra = {"engine": numerics.engine, "cycles": numerics.cycles}
    extra |= solution.extra | {"window": numerics.window}
    extra |= {name: numbers[name] for name in ENGINES[numerics.engine].summary_numbers}

    if solution.levels:
        extra["levels"] = levels.convert_to_scene_units(rig, solution.levels)
    snapshots = solution.snapshots
    if rig.friction.has_partial_slip and snapshots and hasattr(snapshots[0], "faces"):
        extra["shots"] = snapshots
    if solution.log is not None:
        extra["events"] = solution.log

    # A patch that slips part by part is a set of elements, or of shear modes if its load varies.
    reduced = getattr(solution.contact, "reduction", None)
    if reduced is not None:
        name = "elements" if hasattr(reduced, "yield_displacement") else "shear_modes"
        extra[name] = int(np.size(reduced.stiffness))

    if solution.bond_summation is not None:
        extra["quadrature"] = solution.bond_summation.engine
    if rig.drive.waveform.is_random:
        extra["spectra"] = stationary.compute_spectra(solution.window, rig.drive.signal)
        notes = [*notes, *stationary.warn_if_short(measures, solution.window)]

    extra |= {"book": solution.book, "period": run.drive.period, "notes": notes}
    return extra if run.decay is None else extra | {"decay": run.decay}
