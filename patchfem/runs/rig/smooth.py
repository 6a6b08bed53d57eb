"""Run of a rig whose friction law is smooth between reversals, by high-order integration.

In: a Model, its Numerics and its Patch. Out: a Solution whose measures are integrals over the
interpolating polynomials of the time steps (`dynamics.smooth`).
"""

from dataclasses import replace
from time import perf_counter

from ...core import IntegratedMeasures
from ...dynamics.cycles import SAMPLES_PER_CYCLE
from ...dynamics.smooth import run as engine
from ...dynamics.smooth.reader import CROSSING_FRACTION_ERROR
from ...response.measures import slip_round_off
from ...response.rows import ROWS_NEEDING_RUN, find_definition
from .evaluation import RunEvaluator, compute_work_check, thin_samples
from .interface import make_contact
from .solution import Solution

# Smallest ratio of slip to its round-off at which the onset of slip is located within a step.
MIN_SLIP_OVER_ROUND_OFF = 1e3


def integrate_smooth_motion(
    model, numerics, patch, frames: int = 0, say=None, progress=None
) -> Solution:
    """Integrate the motion of a rig with a smooth friction law at high order.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.
    """
    rig = model.rig
    begin = perf_counter()
    contact = make_contact(model, numerics, patch)
    engine.load_loop(contact.element.kernels, say)
    loaded = perf_counter() - begin
    begin = perf_counter()
    run = engine.simulate(
        rig.modes,
        rig.drive.signal,
        contact.element,
        numerics.cycles,
        numerics.local,
        numerics.window,
        rig.springs.travel,
        frames,
        rig.start,
        progress,
        even=bool(ROWS_NEEDING_RUN),
    )
    evaluator = SmoothEvaluator(model, numerics, patch, contact)
    solution = evaluator.make_solution(
        run,
        perf_counter() - begin,
        prepare={"compiled_code": loaded},
        extra={"step_tolerance": numerics.local, "steps_taken": int(run.ledger["steps"])},
    )
    return replace(solution, errors=evaluator.estimate_integration_errors(run, solution.values))


class SmoothEvaluator(RunEvaluator):
    """Evaluation of the runs of the smooth engine, whose measures are integrals over its steps."""

    def __init__(self, model, numerics, patch, contact):
        super().__init__(model, numerics, patch, contact, 1e-3 * contact.length, SAMPLES_PER_CYCLE)

    def compute_integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the measures integrated over the polynomials of the time steps.

        Parameters
        ----------
        run, drive, stuck
            See `RunEvaluator.compute_integrated_measures`.
        """
        integrated = run.integrated
        if not _has_clear_slip(run):
            loop = integrated.loops[0]._replace(stuck_time=None)
            integrated = replace(integrated, loops=(loop,), slip_start_phases=None)
        check = {"work_check": compute_work_check(run.ledger)}
        return replace(integrated, values=integrated.values | check)

    def collect_cycle_data(self, run, drive, *, stuck: bool) -> dict:
        """Return the last cycles with additional samples at the reversals.

        Parameters
        ----------
        run, drive, stuck
            See `RunEvaluator.collect_cycle_data`.
        """
        return {"window": run.with_reversals, "uniform_window": run.window, "reversal_rule": "rate"}

    def thin_run(self, run):
        """Return a run without every second sample of its window."""
        thinned = super().thin_run(run)
        return replace(thinned, with_reversals=thin_samples(run.with_reversals))

    def estimate_integration_errors(self, run, values: dict) -> dict:
        """Estimate the errors of the measures due to sampling and skipped cycles.

        The errors are those of the samples, of peaks between samples, and of cycles that were
        skipped because the motion had become periodic. `values` are the measures by name.
        """
        sampling = self.estimate_sampling_errors(run, self.model.rig.drive.signal, values)
        for name in ("stick_fraction", "slip_start_phase"):
            if _has_clear_slip(run):
                sampling[name] = CROSSING_FRACTION_ERROR  # of the run [1], or of the phase [rad]
            elif name not in sampling:
                sampling[name] = find_definition(name).sample_error / self.steps
        errors = {}
        for name, value in values.items():
            size = abs(value)
            if name == "drift_per_cycle":
                size = values.get("relative_displacement_amplitude", 0.0)
            error = sampling.get(name, 0.0) + run.peak_errors.get(name, 0.0)
            errors[name] = error + run.repeat_change * size
        return errors


def _has_clear_slip(run) -> bool:
    """Return whether the slip of a run clearly exceeds its round-off."""
    slip_range = run.integrated.loops[0].slip_range
    return slip_range > MIN_SLIP_OVER_ROUND_OFF * slip_round_off(run.window)
