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
from ...response.measures import (
    relative_gap,
    slip_round_off,
    window_amplitudes,
    window_end_values,
)
from ...response.outcome import estimate_steady
from ...response.rows import ROWS_NEEDING_RUN, LastCycles, compute_measures, find_definition
from ...structure.drive_sizes import choose_samples_per_cycle, is_sinusoidal
from .solution import Solution, find_release_amplitude, mode_stiffness, normal_load


class Reader:
    """Evaluation of the runs of a model by one engine.

    The methods `integrated_measures` and `further_fields` return what an engine computes itself.

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
        self.has_friction = model.friction is not None
        # a law that creeps never sticks
        self.creeps = self.has_friction and law_has_trait(model.friction.law, "creeps")
        self.held = 0.0 if self.creeps else held

    def integrated_measures(self, run, drive, *, stuck: bool = False) -> IntegratedMeasures:
        """Return the measures that the engine itself integrates over the last cycles.

        Parameters
        ----------
        run
            Run or mark.
        drive
            Drive of the run.
        stuck : bool
            Whether the interface sticks.
        """
        return IntegratedMeasures()

    def loops(self, run, drive) -> tuple:
        """Return the friction loops that the engine itself integrates."""
        return self.integrated_measures(run, drive).loops

    def further_fields(self, run, drive, *, stuck: bool) -> dict:
        """Return data that the engine knows more accurately than samples, as fields of `LastCycles`.

        Parameters
        ----------
        run, drive, stuck
            See `integrated_measures`.
        """
        return {}

    def values(self, run, drive=None, ledger=None, *, stuck: bool = False) -> dict:
        """Compute the measures of a run from its last cycles.

        Parameters
        ----------
        run
            Run or mark.
        drive : optional
            Drive, if it is not that of the model.
        ledger : (4, k), optional
            See `LastCycles`.
        stuck : bool
            Whether the interface sticks.
        """
        model = self.model
        drive = drive or model.rig.drive.signal
        fields = {
            "window": run.window,
            "book": run.ledger,
            "integrated": self.integrated_measures(run, drive, stuck=stuck),
            "run": self.whole_run(run, drive),
        }
        if self.has_friction:
            fields |= {"by": reversal_evaluation(model), "ledger": ledger}
        fields |= self.further_fields(run, drive, stuck=stuck)
        window = fields["window"]
        n_cycles = min(self.numerics.window, len(run.amplitudes))
        last_cycles = LastCycles(
            drive=drive,
            extremes=run.amplitudes[-n_cycles:],
            load=normal_load(model, self.patch),
            stiffness=mode_stiffness(model, window),
            sine=is_sinusoidal(drive),
            **fields,
        )
        values = compute_measures(last_cycles)
        if model.rig.drive.kind == "free":
            name = "relative_displacement_amplitude"
            values[name] = find_release_amplitude(window, drive.period, values[name])
        return values

    def sticks(self, run) -> bool:
        """Return whether all interfaces stick during the last cycles of a run."""
        if not self.has_friction or self.creeps:
            return False
        if loops := self.loops(run, self.model.rig.drive.signal):
            limit = max(self.held, slip_round_off(run.window))
            return all(loop.slip_range / 2 <= limit for loop in loops)
        return run_events.is_all_stuck(run.window, self.held)

    def rings(self, run, drive) -> tuple:
        """Measure frequency and damping of the ringing during stick, with errors."""
        if not self.has_friction or self.creeps:
            return {}, {}
        return run_events.measure_ringing_in_sticks(
            run.window, self.model.rig.modes, drive, getattr(run, "log", None), self.held
        )

    def stated_errors(self, run, drive, values: dict) -> dict:
        """Return the errors of measures that the run states itself, except those of ringing.

        Parameters
        ----------
        run
            Run of the engine.
        drive
            Drive of the run.
        values : dict
            Measures by name.
        """
        return {}

    def with_half_the_samples(self, run):
        """Return a run with every second sample removed."""
        return replace(run, window=thin_samples(run.window))

    def sampling_errors(self, run, drive, values: dict) -> dict:
        """Estimate the errors of the measures of an exact motion due to sampling.

        The errors follow from the change with every second sample. Measures that the engine integrated
        have no such error.

        Parameters
        ----------
        run
            Run of the engine.
        drive
            Drive of the run.
        values : dict
            Measures by name.
        """
        if not self.loops(run, drive) and not hasattr(drive, "band"):
            return {}
        ledger = run.response.extra.get("ledger")
        coarse_values = self.values(self.with_half_the_samples(run), drive, ledger)
        errors = {}
        for name, change in absolute_change(values, coarse_values).items():
            if change > 0 and name not in ERROR_MEASURES:
                row = find_definition(name)
                error = error_of_change(change, order=row.order)
                errors[name] = error + row.sample_error / self.steps
        return errors

    def whole_run(self, run, drive):
        """Return the histories of all cycles, or None if they are not equally sampled.

        None if they are not kept at equal steps.
        """
        histories = getattr(run, "response", None)
        kept = (
            ROWS_NEEDING_RUN
            and histories is not None
            and choose_samples_per_cycle(drive, self.numerics.cycles, needs_history=True)
        )
        return histories if kept and histories.time.size and histories.time[0] == 0 else None

    def between_samples(self, run, drive, values: dict) -> dict:
        """Estimate the sampling errors of measures that depend on all cycles of a run.

        The changes without the even and without the odd samples are added, because each reversal
        has neighbours of one kind.

        Parameters
        ----------
        run
            Run of the engine.
        drive
            Drive of the run.
        values : dict
            Measures by name.
        """
        rows = [row for row in ROWS_NEEDING_RUN if row.name in values]
        if not rows:
            return {}
        errors = dict.fromkeys([row.name for row in rows], 0.0)
        for parity in (0, 1):
            thinned = replace(run, response=_thin_between_reversals(run.response, parity))
            coarse_values = self.values(thinned, drive)
            for row in rows:
                change = values[row.name] - coarse_values[row.name]
                errors[row.name] += error_of_change(change, order=row.order)
        return errors

    def solution_fields(self, run, drive) -> dict:
        """Return fields of a Solution that only this engine provides."""
        return {}

    def solution(self, run, seconds: float, drive=None, **more) -> Solution:
        """Evaluate a run and return it as a Solution.

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
        n_cycles = self.numerics.window
        stuck = self.sticks(run)
        rings, ring_errors = self.rings(run, drive)
        values = self.values(run, drive, run.response.extra.get("ledger"), stuck=stuck) | rings
        ends = window_end_values(run.amplitudes, run.phasors, n_cycles)
        fields = {
            "message": getattr(run, "message", ""),
            "log": getattr(run, "log", None),
            "snapshots": getattr(run, "snapshots", []),
            "steady": estimate_steady(drive, *ends),
        }
        fields |= self.solution_fields(run, drive)
        return Solution(
            values=values,
            response=run.response,
            window=run.window,
            amplitudes=window_amplitudes(run.amplitudes, n_cycles),
            outcome=run.outcome or (Outcome.STUCK if stuck else None),
            book=run.ledger,
            seconds=seconds,
            contact=self.contact,
            held=self.held,
            stated_errors=ring_errors
            | self.stated_errors(run, drive, values)
            | self.between_samples(run, drive, values),
            extremes=run.amplitudes,
            **(fields | more),
        )

    def level(self, size: float, run, drive=None, relative_error: float = 0.0) -> Level:
        """Evaluate a run as one level of the drive.

        Parameters
        ----------
        size : float
            Level of the drive [m s-2].
        run
            Run or mark.
        drive : optional
            Drive, if it is not that of the model.
        relative_error : float
            Relative error of the measures.
        """
        values = self.values(run, drive)
        values = {name: values[name] for name in LEVEL_MEASURES if name in values}
        errors = {}
        if relative_error:
            errors = {name: relative_error * abs(value) for name, value in values.items()}
        return Level(size, self.sticks(run), values, errors)


def _thin_between_reversals(histories, parity: int):
    """Remove every second sample of histories, except the ends and the reversals.

    parity: 0 or 1, remainder of the index of the samples that are kept on division by 2.
    """
    step = np.diff(histories.slide)
    kept = np.arange(histories.time.size) % 2 == parity
    kept[1:-1] |= step[1:] * step[:-1] < 0
    kept[[0, -1]] = True
    return histories.select(kept)


def thin_samples(window):
    """Remove every second sample of an equally sampled window.

    The last sample, and those of events between the others, are kept.
    """
    place = (window.time - window.time[0]) / np.diff(window.time).max()
    number = np.round(place).astype(int)
    kept = (np.abs(place - number) > 1e-6) | (number % 2 == 0)
    kept[-1] = True
    return window.select(kept)


def sample_friction_works(response) -> dict:
    """Return the friction work of a response and the sum of its absolute values [J] as a dict.

    They follow from the samples of all interfaces by the trapezoidal rule.
    """
    slides = response.extra.get("slides", response.slide[:, None])
    forces = response.extra.get("forces", response.force[:, None])
    parts = [path_work.sampled_work(slide, force) for slide, force in zip(slides.T, forces.T)]
    sampled = sum(float(part.sum()) for part in parts)
    return {"sampled": sampled, "passed": sum(float(abs(part).sum()) for part in parts)}


def compute_work_check(energies: dict) -> float:
    """Return the relative difference [1] of the friction work from samples and from energies.

    Parameters
    ----------
    energies : dict
        Energies of a run, with its friction work from samples, from energies and the sum of |work|
        as "sampled", "booked" and "passed" [J].
    """
    scale = energies["power"] + energies["peak_stored"]
    return relative_gap(energies["sampled"], energies["booked"], energies["passed"], scale)
