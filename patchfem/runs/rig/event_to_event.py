"""Run of a rig whose friction law is smooth between events, by the engine `hybrid`.

In: a Model, its Numerics and its Patch. Out: a Solution whose measures the engine has summed over its steps. The samples of
the histories are those of the last cycles, of equal distances before them, and of the events.
"""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ... import compiled
from ...core import IntegratedMeasures, NotConverged, Outcome, Response
from ...hybrid import cases, laws
from ...hybrid import runs as engine
from ...hybrid.records import Status
from ...response.measures import MIN_SLIDE_RANGE, slip_round_off
from ...response.rows import ROWS_NEEDING_RUN, find_definition
from ...structure.drive_sizes import choose_samples_per_cycle, is_sinusoidal
from .evaluation import RunEvaluator, compute_sampled_work, compute_work_check, thin_samples
from .interface import make_contact
from .solution import Solution, first_mode_stiffness

SAMPLES_PER_CYCLE = 400  # samples of each of the last cycles
MIN_SAMPLES = 101  # samples of the last cycles of a run shorter than a cycle
MAX_EARLY_SAMPLES = 8_000  # samples of equal distances before the last cycles
EARLY_SAMPLES_PER_CYCLE = 40
MIN_SAMPLED_CYCLES = 2.0  # cycles at the end that have as many samples as the window
SAME_TIME_TOL = 1e-9  # distance of samples that are one, in cycles
WHOLE_CYCLES_TOL = 1e-12  # relative round-off of a number of cycles
# Smallest ratio of slip to its round-off at which an interface moves.
MIN_SLIP_OVER_ROUND_OFF = 1e3
STUCK_SLIP = 1e-3  # largest slip per cycle of an interface that counts as stuck, relative to its elastic length
STICK_MEASURES = ("stick_fraction", "slip_start_phase")
# Measures that exist only under a sine.
SINE_MEASURES = (
    "absolute_acceleration_fundamental",
    "acceleration_distortion",
    "slip_start_phase",
    "equivalent_stiffness",
    "equivalent_damping",
    "secant_stiffness",
    "harmonic_force_ratio",
)


@dataclass(frozen=True, eq=False, slots=True)
class HybridRun:
    """Run of the engine with histories.

    - values: measures of the last cycles by name.
    - response, window: histories of the run, and of its last cycles at equal distances.
    - with_events: histories of the last cycles with a sample at each event.
    - extremes (c, 2), phasors (c,): of the output in each cycle, see `hybrid.runs.Motion`.
    - ledger: energies [J] and numbers of steps by name.
    - outcome: how the run ended, if it ended early.
    """

    values: dict
    response: Response
    window: Response
    with_events: Response
    extremes: np.ndarray
    phasors: np.ndarray
    ledger: dict
    outcome: Outcome | None


class SampleTimes(NamedTuple):
    """Times [s] of samples: of the window, of the cycles just before it, and of all cycles before these."""

    window: np.ndarray
    before: np.ndarray
    early: np.ndarray


def integrate_from_event_to_event(
    model, numerics, patch, frames: int = 0, say=None, progress=None
) -> Solution:
    """Integrate the motion of a rig with a smooth friction law from event to event.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
        None under [normal] or between masses.
    frames : int
        Not used: the interface slips as a whole, so that its fields follow from the histories.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.

    Raises
    ------
    NotConverged
        If the law or a mode is too fast for the engine.
    """
    begin = perf_counter()
    evaluator = HybridEvaluator(model, numerics, patch)
    compiled.load("hybrid.engine_kernels", say)
    loaded = perf_counter() - begin
    begin = perf_counter()
    run = evaluator.integrate()
    if progress is not None:
        progress(1.0)
    return evaluator.make_solution(
        run,
        perf_counter() - begin,
        prepare={"compiled_code": loaded},
        extra={"step_tolerance": numerics.local, "steps_taken": int(run.ledger["steps"])},
    )


class HybridEvaluator(RunEvaluator):
    """Runs of the engine `hybrid` and their evaluation."""

    def __init__(self, model, numerics, patch):
        contact = make_contact(model, numerics, patch)
        super().__init__(
            model, numerics, patch, contact, STUCK_SLIP * contact.length, SAMPLES_PER_CYCLE
        )

    def integrate(self) -> HybridRun:
        """Integrate the motion of the rig from its start.

        A run that reaches the largest travel is repeated up to its end, because only a run with a known end has the
        measures and samples of its last cycles.
        """
        cycles = self.numerics.cycles
        outcome = None
        motion = self._run(cycles, self.model.rig.springs.travel)
        if motion.status is Status.EXCEEDS_TRAVEL:
            outcome = Outcome.EXCEEDS_TRAVEL
            cycles = motion.time / self.model.rig.drive.signal.period
            motion = self._run(cycles, np.inf)
        if motion.status is not Status.DONE:
            raise NotConverged(f'{motion.message}; or use accuracy.method = "march"')
        return self._make_run(motion, cycles, outcome)

    def _run(self, cycles: float, travel: float) -> engine.Motion:
        """Return the motion over a number of cycles, or up to the largest travel [m]."""
        rig = self.model.rig
        load = self.model.point.load if self.patch is None else self.patch.pressure.load
        law = laws.make_law(self.model.friction, load, rig.speed_scale)
        times = np.unique(np.concatenate(self._choose_times(cycles)))
        case = cases.make_rig_case(
            rig,
            [(law, cases.Load(float(load)))],
            cases.Schedule(cycles, self.numerics.window, times, travel),
            rtol=self.numerics.local,
            n_steps=self.numerics.steps,
        )
        return engine.run_case(case, has_errors=False, fills_histories=self.numerics.whole)

    def _choose_times(self, cycles: float) -> SampleTimes:
        """Return the times of the samples of a run over a number of cycles."""
        drive = self.model.rig.drive.signal
        period = drive.period
        end = cycles * period
        window_start = max(0.0, end - self.numerics.window * period)
        first = max(0.0, min(window_start, end - MIN_SAMPLED_CYCLES * period))
        even = choose_samples_per_cycle(drive, cycles, needs_history=bool(ROWS_NEEDING_RUN))
        count = even or max(1, min(EARLY_SAMPLES_PER_CYCLE, MAX_EARLY_SAMPLES // max(cycles, 1)))
        early = before = np.zeros(0)
        if self.numerics.whole:
            early = np.arange(0.0, first - SAME_TIME_TOL * period, period / count)
            if window_start > first:
                before = _divide(first, window_start, period, 2)
        return SampleTimes(_divide(window_start, end, period, MIN_SAMPLES), before, early)

    def _make_run(self, motion: engine.Motion, cycles: float, outcome: Outcome | None) -> HybridRun:
        """Return histories and energies of a motion."""
        drive = self.model.rig.drive.signal
        times = self._choose_times(cycles)
        time = motion.rows[:, 0]
        is_sample = np.isin(time, np.concatenate(times)) & (np.diff(time, prepend=-1.0) > 0)
        is_kept = is_sample
        if not hasattr(drive, "band"):  # Spectra need samples of equal distances.
            # Differences of rows at nearly the same time are round-off: the sample is kept, else the last event.
            group = np.cumsum(np.diff(time, prepend=time[0]) > SAME_TIME_TOL * drive.period)
            has_sample = np.bincount(group, is_sample) > 0
            is_last = np.append(np.diff(group) > 0, True)
            is_kept = is_sample | (is_last & ~has_sample[group])
        response = replace(motion, rows=motion.rows[is_kept]).make_response(
            self.model.rig.modes, drive
        )
        with_events = response.select(response.time >= times.window[0] * (1 - 1e-15))

        ledger = motion.find_energies() | compute_sampled_work(with_events)
        works = with_events.extra["ledger"][0]
        ledger |= {"booked": float(works[-1] - works[0]), "steps": float(motion.n_steps)}
        n_whole = max(1, int(cycles * (1 + WHOLE_CYCLES_TOL)))  # The first cycle may be a part.
        return HybridRun(
            values=dict(motion.values),
            response=response,
            window=with_events.select(np.isin(with_events.time, times.window)),
            with_events=with_events,
            extremes=motion.extremes[-n_whole:],
            phasors=motion.phasors[-n_whole:],
            ledger=ledger,
            outcome=outcome,
        )

    def compute_integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the measures of the engine.

        Parameters
        ----------
        run, drive, stuck
            See `RunEvaluator.compute_integrated_measures`.
        """
        values = dict.fromkeys(run.values)
        values |= {name: float(x) for name, x in run.values.items() if not np.isnan(x)}
        values.pop("energy_stored")
        if not is_sinusoidal(drive):
            values |= dict.fromkeys(SINE_MEASURES)

        # The samples show whether an interface that hardly slips sticks.
        if not _has_clear_slip(run):
            for name in STICK_MEASURES:
                values.pop(name)

        # A loop has no stiffness if the interface hardly moves, and no damping if it moves in several modes.
        if np.ptp(run.window.slide) <= MIN_SLIDE_RANGE:
            names = ("equivalent_stiffness", "secant_stiffness", "harmonic_force_ratio")
            values |= dict.fromkeys((*names, "equivalent_damping"))
        elif not first_mode_stiffness(self.model, run.window):
            values["equivalent_damping"] = None
        return IntegratedMeasures(values | {"work_check": compute_work_check(run.ledger)})

    def collect_cycle_data(self, run, drive, *, stuck: bool) -> dict:
        """Return the last cycles with and without samples at events.

        Parameters
        ----------
        run, drive, stuck
            See `RunEvaluator.collect_cycle_data`.
        """
        return {
            "window": run.with_events,
            "uniform_window": run.window,
            "reversal_rule": "rate",
        }

    def thin_run(self, run):
        """Return a run without every second sample of its window."""
        return replace(super().thin_run(run), with_events=thin_samples(run.with_events))

    def estimate_run_errors(self, run, drive, values: dict) -> dict:
        """Estimate the errors of the measures that are computed from samples.

        Parameters
        ----------
        run, drive, values
            See `RunEvaluator.estimate_run_errors`.
        """
        errors = self.compare_with_half_the_samples(run, drive, values)
        if not _has_clear_slip(run):
            errors |= {
                name: find_definition(name).sample_error / self.steps for name in STICK_MEASURES
            }
        return errors


def _has_clear_slip(run: HybridRun) -> bool:
    """Return whether the slip of a run clearly exceeds its round-off."""
    return np.ptp(run.window.slip) > MIN_SLIP_OVER_ROUND_OFF * slip_round_off(run.window)


def _divide(begin: float, end: float, period: float, minimum: int) -> np.ndarray:
    """Return times (k,) [s] of equal distances from begin to end, SAMPLES_PER_CYCLE in a period."""
    count = round((end - begin) / period * SAMPLES_PER_CYCLE) + 1
    return np.linspace(begin, end, max(minimum, count))
