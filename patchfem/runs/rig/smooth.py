"""Run of a rig whose friction law is smooth between reversals, integrated at high order.

In: a Model, its Numerics and its pressed patch. Out: a Solution (`dynamics.smooth`) whose
measures come from the polynomials of the steps.
"""

from dataclasses import replace
from time import perf_counter

from ...core import IntegratedMeasures
from ...dynamics.cycles import SAMPLES_PER_CYCLE
from ...dynamics.smooth import run as engine
from ...response.measures import slip_round_off
from ...response.rows import ROWS_NEEDING_RUN, find_definition
from .evaluation import Reader, compute_work_check, thin_samples
from .interface import make_contact
from .solution import Solution

# Smallest ratio of the slip to its round-off, with which the onset of slip is located within a step.
MIN_SLIP_OVER_ROUND_OFF = 1e3
# Error of the stick fraction [1] and of the phase at slip start [rad]: the dense output within a step is
# less accurate than its end.
CROSSING_FRACTION_ERROR = 1e-7


def run_smooth(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Compute the motion of a rig with a smooth friction law by high-order integration.

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
    done = engine.simulate(
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
    reader = SmoothReader(model, numerics, patch, contact)
    solution = reader.solution(
        done,
        perf_counter() - begin,
        prepare={"compiled_code": loaded},
        extra={"step_tolerance": numerics.local, "steps_taken": int(done.ledger["steps"])},
    )
    return replace(solution, errors=reader.integration_errors(done, solution.values))


class SmoothReader(Reader):
    """Evaluation of the runs of the smooth engine, whose measures are integrals over its steps."""

    def __init__(self, model, numerics, patch, contact):
        super().__init__(model, numerics, patch, contact, 1e-3 * contact.length, SAMPLES_PER_CYCLE)

    def integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the measures integrated over the polynomials of the time steps.

        Parameters
        ----------
        run, drive, stuck
            See `Reader.integrated_measures`.
        """
        integrated = run.integrated
        if not _has_clear_slip(run):
            loop = integrated.loops[0]._replace(stuck_time=None)
            integrated = replace(integrated, loops=(loop,), slip_start_phases=None)
        check = {"work_check": compute_work_check(run.ledger)}
        return replace(integrated, values=integrated.values | check)

    def further_fields(self, run, drive, *, stuck: bool) -> dict:
        """Return the last cycles with samples added at the reversals, for the evaluation.

        Parameters
        ----------
        run, drive, stuck
            See `Reader.further_fields`.
        """
        return {"window": run.with_reversals, "even": run.window, "by": "rate"}

    def with_half_the_samples(self, run):
        """Return a run with every second sample removed."""
        thinned = super().with_half_the_samples(run)
        return replace(thinned, with_reversals=thin_samples(run.with_reversals))

    def integration_errors(self, run, values: dict) -> dict:
        """Estimate the errors of measures due to sampling and skipped cycles of a smooth run.

        The errors are due to sampling, to peaks between samples, and to skipped cycles of a periodic
        motion. values: measures by name.
        """
        sampling = self.sampling_errors(run, self.model.rig.drive.signal, values)
        for name in ("stick_fraction", "slip_start_phase"):
            if _has_clear_slip(run):
                sampling[name] = CROSSING_FRACTION_ERROR
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
    """Return whether the slip of a smooth run exceeds round-off."""
    slip_range = run.integrated.loops[0].slip_range
    return slip_range > MIN_SLIP_OVER_ROUND_OFF * slip_round_off(run.window)
