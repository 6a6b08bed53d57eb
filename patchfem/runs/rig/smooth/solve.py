"""A rig whose law is smooth between reversals: the high order of `dynamics.smooth` as a Solution."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....dynamics.second_book import gap
from ....dynamics.smooth import run as hub
from ....response.errors import change
from ....response.measures import slip_measures
from ....response.rows import measures_of
from ....structure.drive_sizes import sinusoidal, whole
from ..interface import model_of
from ..march import Read
from ..solution import Solution, seen

# of the change at half the samples, the error: of what is of second order in them, the others are of fourth
SAFE = {"stick_fraction": 2.5, "slip_start_phase": 2.5}
GRAIN = {"stick_fraction": 0.5, "slip_start_phase": 1.0}  # and the samples that one of them may be off by besides


def run_smooth(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """One run with steps that meet numerics.local; patch: the solved Patch or None."""
    rig, begin = model.rig, perf_counter()
    contact = model_of(model, numerics, patch)
    hub.loops_of(contact.element.kernels, say)
    loaded = perf_counter() - begin
    begin = perf_counter()
    done = hub.simulate(rig.modes, rig.drive, contact.element, numerics.cycles, numerics.local, numerics.window,
                        rig.travel, frames, rig.start, progress)
    reader = _Smooth(model, replace(numerics, steps=hub.SAMPLES), patch, contact)
    found = reader.solution(done, perf_counter() - begin, {"load": loaded})
    return replace(found, errors=reader.sampling(done), extra={"step_tolerance": numerics.local,
                                                               "steps_taken": int(done.ledger["steps"])})


class _Smooth(Read):
    """The measures of a run of high order: what the integrator knows comes before what samples show."""

    def summed(self):
        """None: no list of bonds."""

    def values(self, part, extremes, ledger, stuck: bool = False, drive=None) -> dict:
        """Measures of a SmoothResult; ledger (4, k) [J] or None."""
        return self._measured(part, part.turned, part.window, extremes, ledger)

    def _measured(self, part, turned, even, extremes, ledger) -> dict:
        """Measures off the samples `turned`, and off evenly spaced ones where the spacing counts."""
        fine, book, drive = part.fine, part.ledger, self.model.rig.drive
        steps = max(1, round((even.time.size - 1) * drive.period / (even.time[-1] - even.time[0])))
        slips = slip_measures(even, drive, steps)
        known = {"relative_displacement_amplitude": fine.swing, "absolute_acceleration_peak": fine.acceleration,
                 "friction_force_peak": fine.force, "slip_amplitude": fine.slip,
                 "stick_fraction": slips["stick_fraction"],
                 "slip_start_phase": slips.get("slip_start_phase") if sinusoidal(drive) else None,
                 "work_check": gap(book["sampled"], book["booked"], book["passed"],
                                   book["power"] + book["peak_stored"])}
        span, loop = even.time[-1] - even.time[0], None
        if whole(span, drive):
            loop = turned.slide, fine.slide, fine.pull, fine.work * drive.period / span
        return measures_of(seen(self.model, self.patch, turned, extremes, book, self.numerics.steps, loop=loop,
                                ledger=ledger, known=known))

    def sampling(self, done) -> dict:
        """Errors of the measures that are read off the samples of a SmoothResult, by those off every second one."""
        even, turned = done.window, done.turned
        half = _picked(even, np.arange(even.time.size) % 2 == (even.time.size - 1) % 2)
        fewer = _picked(turned, np.isin(turned.time, half.time) | ~np.isin(turned.time, even.time))
        every, second = (self._measured(done, *pair, done.amplitudes, None) for pair in (
            (turned, even), (fewer, half)))
        return {name: SAFE.get(name, 0.2) * gap + GRAIN.get(name, 0.0) / hub.SAMPLES
                for name, gap in change(every, second).items()}


def _picked(response, pick):
    """Some samples (k,) bool of a Response."""
    columns = {name: getattr(response, name)[pick] for name in response.__dataclass_fields__ if name != "extra"}
    return replace(response, **columns, extra={k: v[:, pick] for k, v in response.extra.items()})
