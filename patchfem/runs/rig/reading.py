"""Evaluation of the run of any engine: measures, stick, ringing, outcome and levels.

In: a run of an engine. Out: its Solution. Engines override the methods of `Reader` for values
that they know better than their samples.
"""

from dataclasses import replace

import numpy as np

from ...core import IntegratedMeasures, Outcome
from ...effects import law_has_trait
from ...friction import path_work
from ...response import run_events
from ...response.errors import ERROR_MEASURES, absolute_change, error_of_change
from ...response.levels import LEVEL_MEASURES, Level
from ...response.loops import reversal_evaluation
from ...response.measures import slip_round_off, window_amplitudes, window_end_values
from ...response.outcome import estimate_steady
from ...response.rows import NEEDS_RUN, compute_measures, find_row
from ...structure.drive_sizes import choose_samples_per_cycle
from .solution import Solution, last_cycle_amplitude, last_cycles


class Reader:
    """Evaluator of the runs of a model by one engine.

    The methods `integrated` and `more` return the measures that an engine computes itself.

    Parameters
    ----------
    model : Model
    numerics : Numerics
    patch : Patch or None
    contact : optional
        Contact that the engine moves.
    held : float
        Slip in a cycle [m] below which the interface sticks in it.
    steps : int, optional
        Samples per cycle; None: those of `numerics`.
    """

    def __init__(
        self, model, numerics, patch, contact=None, held: float = 0.0, steps: int | None = None
    ):
        self.model = model
        self.numerics = numerics
        self.patch = patch
        self.contact = contact
        self.steps = steps or numerics.steps
        self.rubs = model.friction is not None
        self.creeps = self.rubs and law_has_trait(
            model.friction.law, "creeps"
        )  # such a law never sticks
        self.held = 0.0 if self.creeps else held

    def integrated_measures(self, run, drive) -> IntegratedMeasures:
        """Return the measures that the engine integrated over the last cycles of a run."""
        return IntegratedMeasures()

    def further_fields(self, run, drive, stuck: bool) -> dict:
        """Return further fields of `response.rows.LastCycles` that the engine knows, by name."""
        return {}

    def values(self, run, drive=None, stuck: bool = False, ledger=None) -> dict:
        """Return the measures of the last cycles of a run, or of a mark of it, by name.

        Parameters
        ----------
        run
            Run or mark.
        drive : optional
            Drive, if it is not that of the model.
        stuck : bool
            Whether the interface sticks.
        ledger : (4, k), optional
            See `LastCycles`.
        """
        drive = drive or self.model.rig.drive.signal
        given = {
            "integrated": self.integrated_measures(run, drive),
            "run": self.whole_run(run, drive),
        } | self.further_fields(run, drive, stuck)
        if self.rubs:
            given = {"by": reversal_evaluation(self.model), "ledger": ledger} | given
        window = given.pop("window", run.window)
        book = given.pop("book", run.ledger)
        last = run.amplitudes[-min(self.numerics.window, len(run.amplitudes)) :]
        found = compute_measures(
            last_cycles(self.model, self.patch, window, last, book, drive=drive, **given)
        )
        if self.model.rig.drive.kind == "free":
            found["relative_displacement_amplitude"] = last_cycle_amplitude(
                window, drive.period, found["relative_displacement_amplitude"]
            )
        return found

    def sticks(self, run) -> bool:
        """Return whether no interface slips in the last cycles by more than `held` or round-off."""
        loops = self.integrated_measures(run, self.model.rig.drive.signal).loops
        if not self.rubs or self.creeps:
            return False
        if loops:
            return all(
                loop.slip_range / 2 <= max(self.held, slip_round_off(run.window)) for loop in loops
            )
        return run_events.is_all_stuck(run.window, self.held)

    def rings(self, run, drive) -> tuple:
        """Return the measures of the ringing during stick by name, and their errors."""
        if not self.rubs or self.creeps:
            return {}, {}
        return run_events.measure_rings(
            run.window, self.model.rig.modes, drive, getattr(run, "log", None), self.held
        )

    def stated_errors(self, run, drive, values: dict) -> dict:
        """Return the errors that the run itself states, by name, except those of its ringing."""
        return {}

    def with_half_the_samples(self, run):
        """Return the run with every second one of its samples."""
        return replace(run, window=thin_samples(run.window))

    def sampling_errors(self, run, drive, values: dict) -> dict:
        """Estimate the sampling errors of the measures of an exact motion, by name.

        They follow from the change with every second sample. Measures that the engine integrated
        have no such error.
        """
        fewer = self.values(
            self.with_half_the_samples(run), drive, ledger=run.response.extra.get("ledger")
        )
        integrated = self.integrated_measures(run, drive)
        apart = {
            name: gap
            for name, gap in absolute_change(values, fewer).items()
            if gap > 0 and name not in ERROR_MEASURES
        }
        return (
            {
                name: error_of_change(gap, order=find_row(name).order)
                + find_row(name).sample_error / self.steps
                for name, gap in apart.items()
            }
            if integrated.loops or hasattr(drive, "band")
            else {}
        )

    def whole_run(self, run, drive):
        """Return the histories of a run, or of a mark of it, from t = 0 on.

        None if they are not kept at equal steps.
        """
        histories = getattr(run, "response", None)
        kept = (
            NEEDS_RUN
            and histories is not None
            and choose_samples_per_cycle(drive, self.numerics.cycles, needs_history=True)
        )
        return histories if kept and histories.time.size and histories.time[0] == 0 else None

    def between_samples(self, run, drive, values: dict) -> dict:
        """Estimate the sampling errors of the measures that use the whole run, by name.

        The changes without the even and without the odd samples are added, because each reversal
        has neighbours of one kind.
        """
        rows = [row for row in NEEDS_RUN if row.name in values]
        if not rows:
            return {}
        out = dict.fromkeys([row.name for row in rows], 0.0)
        for parity in (0, 1):
            fewer = self.values(
                replace(run, response=_between_reversals(run.response, parity)), drive
            )
            for row in rows:
                out[row.name] += error_of_change(
                    values[row.name] - fewer[row.name], order=row.order
                )
        return out

    def solution(self, run, seconds: float, drive=None, **more) -> Solution:
        """Return the Solution of a run.

        Parameters
        ----------
        run
            Run of the engine.
        seconds : float
            CPU seconds of the run.
        drive : optional
            Drive, if it is not that of the model.
        more
            Other fields of the Solution.
        """
        drive = drive or self.model.rig.drive.signal
        window = self.numerics.window
        stuck, (rings, ring_errors) = self.sticks(run), self.rings(run, drive)
        values = self.values(run, drive, stuck, run.response.extra.get("ledger")) | rings
        kept = {"message": "", "log": None, "snapshots": []}
        more = (
            {name: getattr(run, name, none) for name, none in kept.items()}
            | {
                "steady": estimate_steady(
                    drive, *window_end_values(run.amplitudes, run.phasors, window)
                )
            }
            | more
        )
        return Solution(
            values=values,
            response=run.response,
            window=run.window,
            amplitudes=window_amplitudes(run.amplitudes, window),
            outcome=run.outcome or (Outcome.STUCK if stuck else None),
            book=run.ledger,
            seconds=seconds,
            contact=self.contact,
            held=self.held,
            stated_errors=ring_errors
            | self.stated_errors(run, drive, values)
            | self.between_samples(run, drive, values),
            extremes=run.amplitudes,
            **more,
        )

    def level(self, size: float, run, drive=None, left: float = 0.0) -> Level:
        """Return the Level of a run, or of a mark of it.

        Parameters
        ----------
        size : float
            Level of the drive [m s-2].
        run
            Run or mark.
        drive : optional
            Drive, if it is not that of the model.
        left : float
            Relative error of the measures.
        """
        found = self.values(run, drive)
        kept = {name: found[name] for name in LEVEL_MEASURES if name in found}
        return Level(
            size,
            self.sticks(run),
            kept,
            {name: left * abs(v) for name, v in kept.items()} if left else {},
        )


def _between_reversals(histories, parity: int):
    """Return histories thinned to samples of one parity, with both ends and all reversals kept.

    parity: 0 or 1, remainder of the index of the samples that are kept on division by 2.
    """
    step = np.diff(histories.slide)
    kept = np.arange(histories.time.size) % 2 == parity
    kept[1:-1] |= step[1:] * step[:-1] < 0
    kept[[0, -1]] = True
    return histories.select(kept)


def thin_samples(window):
    """Return a window without every second one of its equally spaced samples.

    The last sample, and those of events between the others, are kept.
    """
    place = (window.time - window.time[0]) / np.diff(window.time).max()
    number = np.round(place).astype(int)
    kept = (np.abs(place - number) > 1e-6) | (number % 2 == 0)
    kept[-1] = True
    return window.select(kept)


def friction_works(response, work: float, passed: float | None = None) -> tuple:
    """Return the friction work [J] from samples and from a ledger, and the exchanged work [J].

    Parameters
    ----------
    response : Response
    work : float
        Friction work of the ledger [J].
    passed : float, optional
        Sum of |work| [J], if it is known better than from samples.
    """
    extra = response.extra
    slides, forces = (
        extra.get(name, one[:, None])
        for name, one in (("slides", response.slide), ("forces", response.force))
    )
    parts = [path_work.sampled_work(slide, force) for slide, force in zip(slides.T, forces.T)]
    to_and_fro = sum(float(abs(one).sum()) for one in parts)
    return sum(float(one.sum()) for one in parts), work, to_and_fro if passed is None else passed
