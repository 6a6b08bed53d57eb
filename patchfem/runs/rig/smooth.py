"""Run of a rig whose friction law is smooth between reversals, integrated at high order.

In: a Model, its Numerics and its pressed patch. Out: a Solution (`dynamics.smooth`) whose
measures come from the polynomials of the steps.
"""

from dataclasses import replace
from time import perf_counter

from ...core import IntegratedMeasures
from ...dynamics.smooth import run as engine
from ...response.measures import slip_round_off
from ...response.rows import NEEDS_RUN, find_row
from .interface import make_contact
from .reading import Reader, thin_samples
from .solution import Solution

# factor on the round-off of the slip, above which the fraction of slip is known inside a step
CLEAR = 1e3
# error of the instant at which this fraction crosses a limit: the extension of a step is less
# accurate than its end
CROSSING_FRACTION_ERROR = 1e-7


def run_smooth(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Run with steps that meet numerics.local, and return the Solution with its errors.

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
    found, done, reader = smooth_run(model, numerics, patch, frames, say, progress)
    return replace(found, errors=reader.left_open(done, found.values))


def smooth_run(model, numerics, patch, frames: int = 0, say=None, progress=None) -> tuple:
    """Return the Solution without its own errors, the SmoothResult, and its SmoothReader.

    The parameters are those of `run_smooth`.
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
        even=bool(NEEDS_RUN),
    )
    reader = SmoothReader(model, numerics, patch, contact)
    return (
        reader.solution(
            done,
            perf_counter() - begin,
            prepare={"compiled_code": loaded},
            extra={"step_tolerance": numerics.local, "steps_taken": int(done.ledger["steps"])},
        ),
        done,
        reader,
    )


class SmoothReader(Reader):
    """Reader of a finished run of high order; values of the integrator precede those of samples."""

    def __init__(self, model, numerics, patch, contact):
        super().__init__(
            model, numerics, patch, contact, 1e-3 * contact.length, engine.SAMPLES_PER_CYCLE
        )

    def integrated_measures(self, run, drive) -> IntegratedMeasures:
        """Return the measures from the polynomials of the steps."""
        book = run.ledger
        fine = run.integrated
        if not _clear(run):
            fine = replace(
                fine, loops=(fine.loops[0]._replace(stuck_time=None),), slip_start_phases=None
            )
        return replace(fine, friction_works=(book["sampled"], book["booked"], book["passed"]))

    def further_fields(self, run, drive, stuck: bool) -> dict:
        """Return the samples including the reversals, and the equally spaced ones."""
        return {"window": run.with_reversals, "even": run.window, "by": "rate"}

    def with_half_the_samples(self, run):
        """Return the run with every second one of its samples."""
        return replace(
            super().with_half_the_samples(run), with_reversals=thin_samples(run.with_reversals)
        )

    def left_open(self, run, values: dict) -> dict:
        """Return the errors of measures by name that a SmoothResult states itself.

        They are those of samples, of peaks, and of cycles that were skipped. values: measures by
        name.
        """
        found = self.sampling_errors(run, self.model.rig.drive.signal, values)
        size = values.get("relative_displacement_amplitude", 0.0)
        for name in ("stick_fraction", "slip_start_phase"):
            found[name] = (
                CROSSING_FRACTION_ERROR
                if _clear(run)
                else found.get(name, find_row(name).sample_error / self.steps)
            )
        return {
            name: found.get(name, 0.0)
            + run.peak_errors.get(name, 0.0)
            + run.repeat_change * (size if name == "drift_per_cycle" else abs(value))
            for name, value in values.items()
        }


def _clear(run) -> bool:
    """Return whether the slip of a SmoothResult exceeds round-off."""
    return run.integrated.loops[0].slip_range > CLEAR * slip_round_off(run.window)
