"""A rig whose law is smooth between reversals: the high order of `dynamics.smooth` as a Solution."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....dynamics.second_book import gap
from ....dynamics.smooth import run as hub
from ....response.errors import change
from ....response.measures import slip_measures, slip_noise
from ....response.rows import measures_of
from ....response.spectrum import wave_measures
from ....structure.drive_sizes import sinusoidal, whole
from ..interface import model_of
from ..march import Read
from ..solution import Solution, seen

SAFE = 0.2  # of the change at half the samples, the error: what is read off them is of fourth order
CLEAR = 1e3  # times the round-off of the slip, beyond which its share of the slide is known inside a step
LOCATED = 1e-7  # what a crossing of that share may be off: the extension of a step errs more than its end
# of what is read off samples below that, of second order in them: times the change, and the samples that it may be off
STUCK = {"stick_fraction": (2.5, 0.5), "slip_start_phase": (2.5, 1.0)}


def run_smooth(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """One run with steps that meet numerics.local; patch: the solved Patch or None."""
    return moved(model, numerics, patch, frames, say, progress)[0]


def moved(model, numerics, patch, frames: int = 0, say=None, progress=None) -> tuple:
    """(Solution, SmoothResult) of a run; arguments as `run_smooth`."""
    rig, begin = model.rig, perf_counter()
    contact = model_of(model, numerics, patch)
    hub.loops_of(contact.element.kernels, say)
    loaded = perf_counter() - begin
    begin = perf_counter()
    done = hub.simulate(rig.modes, rig.drive, contact.element, numerics.cycles, numerics.local, numerics.window,
                        rig.travel, frames, rig.start, progress)
    reader = Smooth(model, replace(numerics, steps=hub.SAMPLES), patch, contact)
    found = reader.solution(done, perf_counter() - begin, {"compiled_code": loaded})
    return replace(found, errors=reader.left_open(done, found.values), extra={
        "step_tolerance": numerics.local, "steps_taken": int(done.ledger["steps"])}), done


class Smooth(Read):
    """The measures of a run of high order: what the integrator knows comes before what samples show."""

    def between(self, window) -> dict:
        """{}: peaks are looked for inside the steps, and it ends where it is asked to."""
        return {}

    late = between

    def summed(self):
        """None: no list of bonds."""

    def values(self, run, drive=None, stuck: bool = False, ledger=None) -> dict:
        """Measures of a SmoothResult; ledger (4, k) [J] or None."""
        last = run.amplitudes[-min(self.numerics.window, len(run.amplitudes)):]
        return self._measured(run, run.turned, run.window, last, ledger)

    def _measured(self, part, turned, even, extremes, ledger) -> dict:
        """Measures off the samples `turned`, and off evenly spaced ones where the spacing counts."""
        fine, book, drive = part.fine, part.ledger, self.model.rig.drive
        steps = max(1, round((even.time.size - 1) * drive.period / (even.time[-1] - even.time[0])))
        slips = slip_measures(even, drive, steps)
        known = {"relative_displacement_amplitude": fine.swing, "absolute_acceleration_peak": fine.acceleration,
                 "friction_force_peak": fine.force, "slip_amplitude": fine.slip,
                 "work_check": gap(book["sampled"], book["booked"], book["passed"],
                                   book["power"] + book["peak_stored"])}
        span, loop = even.time[-1] - even.time[0], None
        if self._clear(part, even):
            slips = {"stick_fraction": min(fine.held / span, 1.0), "slip_start_phase": fine.start}
        known |= {"stick_fraction": slips["stick_fraction"],
                  "slip_start_phase": slips.get("slip_start_phase") if sinusoidal(drive) else None}
        if fine.drift is not None:
            known |= {"drift_per_cycle": fine.drift}
        if whole(span, drive):
            known |= self._waves(fine)
            loop = fine.slide, fine.pull, fine.work * drive.period / span
        return measures_of(seen(self.model, self.patch, turned, extremes, book, self.numerics.steps, loop=loop,
                                ledger=ledger, known=known))

    def _waves(self, fine) -> dict:
        """What the first and the third harmonic of the absolute acceleration at the output tell, `wave_measures`."""
        drive = self.model.rig.drive
        if not sinusoidal(drive):
            return {}
        last = drive.segments[-1]
        base = -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start)) if drive.moving else 0.0
        return wave_measures(abs(fine.first + base), abs(fine.third), abs(last.amplitude))

    @staticmethod
    def _clear(part, even) -> bool:
        """Whether the slip of a SmoothResult with samples `even` is no round-off."""
        return 2 * part.fine.slip > CLEAR * slip_noise(even)

    def left_open(self, done, values: dict) -> dict:
        """Errors of the measures `values` by name that a SmoothResult leaves open itself: those of samples, of peaks,
        and of cycles that were left out."""
        found, size = self.sampling(done), values.get("relative_displacement_amplitude", 0.0)
        return {name: found.get(name, 0.0) + done.fine.unsure.get(name, 0.0)
                + done.unlike * (size if name == "drift_per_cycle" else abs(value)) for name, value in values.items()}

    def sampling(self, done) -> dict:
        """Errors of the measures that are read off the samples of a SmoothResult, by those off every second one."""
        even, turned = done.window, done.turned
        half = even.at(np.arange(even.time.size) % 2 == (even.time.size - 1) % 2)
        fewer = turned.at(np.isin(turned.time, half.time) | ~np.isin(turned.time, even.time))
        every, second = (self._measured(done, *pair, done.amplitudes, None) for pair in (
            (turned, even), (fewer, half)))
        clear = self._clear(done, even)
        read = {} if clear else STUCK
        share = {name: read.get(name, (SAFE, 0.0)) for name in every}
        found = {name: share[name][0] * gap + share[name][1] / hub.SAMPLES
                 for name, gap in change(every, second).items()}
        return found | {name: LOCATED for name in STUCK if name in found} if clear else found
