"""A rig whose law is smooth between reversals: the high order of `dynamics.smooth` as a Solution."""

from dataclasses import replace
from time import perf_counter

from ...core import IntegratedMeasures
from ...dynamics.smooth import run as engine
from ...response.measures import slip_noise
from ...response.rows import NEEDS_RUN, row_of
from .interface import contact_of
from .reading import Reader, every_second
from .solution import Solution

CLEAR = 1e3  # times the round-off of the slip, beyond which its share of the slide is known inside a step
# what a crossing of that share may be off: the extension of a step errs more than its end
LOCATED = 1e-7


def run_smooth(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """One run with steps that meet numerics.local; patch: the solved Patch or None."""
    found, done, reader = smooth_run(model, numerics, patch, frames, say, progress)
    return replace(found, errors=reader.left_open(done, found.values))


def smooth_run(model, numerics, patch, frames: int = 0, say=None, progress=None) -> tuple:
    """(Solution without what it leaves open itself, SmoothResult, Smooth that tells it); arguments as `run_smooth`."""
    rig, begin = model.rig, perf_counter()
    contact = contact_of(model, numerics, patch)
    engine.loops_of(contact.element.kernels, say)
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
    """What a finished run of high order shows: what the integrator knows comes before what samples show."""

    def __init__(self, model, numerics, patch, contact):
        super().__init__(model, numerics, patch, contact, 1e-3 * contact.length, engine.SAMPLES)

    def integrated(self, run, drive) -> IntegratedMeasures:
        """What the polynomials of the steps give."""
        book, fine = run.ledger, run.fine
        if not _clear(run):
            fine = replace(
                fine, loops=(fine.loops[0]._replace(stuck_time=None),), slip_start_phases=None
            )
        return replace(fine, friction_works=(book["sampled"], book["booked"], book["passed"]))

    def more(self, run, drive, stuck: bool) -> dict:
        """The samples with the reversals among them, and the evenly spaced ones where the spacing counts."""
        return {"window": run.turned, "even": run.window, "by": "rate"}

    def fewer(self, run):
        """The run with every second of its samples."""
        return replace(super().fewer(run), turned=every_second(run.turned))

    def left_open(self, run, values: dict) -> dict:
        """Errors of the measures `values` by name that a SmoothResult leaves open itself: those of samples, of peaks,
        and of cycles that were left out."""
        found = self.sampled(run, self.model.rig.drive.signal, values)
        size = values.get("relative_displacement_amplitude", 0.0)
        for name in ("stick_fraction", "slip_start_phase"):
            found[name] = (
                LOCATED if _clear(run) else found.get(name, row_of(name).sample_error / self.steps)
            )
        return {
            name: found.get(name, 0.0)
            + run.unsure.get(name, 0.0)
            + run.unlike * (size if name == "drift_per_cycle" else abs(value))
            for name, value in values.items()
        }


def _clear(run) -> bool:
    """Whether the slip of a SmoothResult is no round-off."""
    return run.fine.loops[0].slip_range > CLEAR * slip_noise(run.window)
