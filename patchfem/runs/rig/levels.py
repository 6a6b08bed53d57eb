"""Motions under a drive that changes its amplitude in levels, each from the end of the one before.

In: a `RunEvaluator`. Out: the run joined over all levels, a `DriveLevel` with errors for each of them, and the level of the
onset, found by bisection.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ... import structure
from ...convergence import MAX_CONVERGENCE_ORDER, convergence_error
from ...core import Measure, Response, SineDrive
from ...measures.errors import estimate_errors, split_errors
from ...measures.events import (
    LEVEL_MEASURES,
    DriveLevel,
    bracket_onset,
    join_events,
    make_no_onset_reason,
    make_onset_test,
)
from ...measures.rows import MOTION_TABLE

# Relative error of the measures of an event-driven run, which has round-off only
EXACT_RELATIVE_ERROR = 1e-9


class LevelRuns(NamedTuple):
    """Levels of a run, in chronological order.

    - levels: DriveLevel of each drive level.
    - run_level: function (index, amplitude [m s-2]) that runs another level from the final state of the level with this
      index, or from rest for the index -1, and returns its DriveLevel.
    - stick_tolerance: largest slip per cycle [m] at which the interface counts as stuck.
    """

    levels: tuple[DriveLevel, ...]
    run_level: Callable[[int, float], DriveLevel]
    stick_tolerance: float


def run_levels(evaluator, n_frames: int = 0, progress=None):
    """Run the levels of a drive in order; return the joined run, and the LevelRuns.

    Parameters
    ----------
    evaluator : RunEvaluator
        Integrates and evaluates each level. Its model has the levels of the drive.
    n_frames : int
        Number of snapshots of the interface in the last cycle of the last level.
    progress : callable, optional
        Callback for the completed fraction of all levels.
    """
    drive = evaluator.model.rig.drive
    amplitudes = drive.levels.amplitudes
    sine = SineDrive(0.0, structure.drive_sizes.find_drive_omega(drive.signal), drive.signal.moving)
    runs = []

    def solve(amplitude: float, before, n_frames: int = 0, report=None):
        """Run a level, and return the run and its DriveLevel.

        Parameters
        ----------
        amplitude : float
            Drive level [m s-2].
        before
            Run from whose end the level goes on, or None for rest.
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        report : callable, optional
            Callback for the completed fraction.
        """
        signal = replace(sine, acceleration=amplitude)
        run = evaluator.integrate(signal, drive.levels.cycles, before, n_frames, report)
        values = evaluator.evaluate_measures(run, signal)
        values = {name: values[name] for name in LEVEL_MEASURES if name in values}
        errors = {name: EXACT_RELATIVE_ERROR * abs(value) for name, value in values.items()}
        return run, DriveLevel(amplitude, evaluator.is_stuck(run), values, errors)

    def run_level(number: int, amplitude: float) -> DriveLevel:
        """Run a level from the final state of level `number`, or from rest if it is -1."""
        return solve(amplitude, runs[number] if number >= 0 else None)[1]

    # Each level goes on from the end of the one before; a run that ends early is the last one.
    levels = []
    for amplitude in amplitudes:
        is_last = len(runs) + 1 == len(amplitudes)
        report = progress and partial(_report_level, progress, len(runs), len(amplitudes))
        run, level = solve(amplitude, runs[-1] if runs else None, n_frames * is_last, report)
        runs.append(run)
        levels.append(level)
        if run.outcome is not None:
            break

    # One run has the histories of all levels. The window and the friction loop are those of the last level.
    shifts = [k * drive.levels.cycles * drive.signal.period for k in range(len(runs))]
    ledger = {name: sum(run.ledger[name] for run in runs) for name in run.ledger}
    joined = replace(
        run,
        response=_join_histories([run.response for run in runs], shifts),
        window=replace(run.window, time=_shift_times(run.window.time, shifts[-1])),
        ledger=ledger | {"peak_stored": max(run.ledger["peak_stored"] for run in runs)},
        log=None if run.log is None else join_events([run.log for run in runs], shifts),
        extremes=np.concatenate([run.extremes for run in runs]),
        phasors=np.concatenate([run.phasors for run in runs]),
    )
    return joined, LevelRuns(tuple(levels), run_level, evaluator.stick_tolerance)


def _report_level(progress, number: int, n_levels: int, fraction: float) -> None:
    """Report the completed fraction of all levels, of which `number` are complete, and `fraction` of the next one."""
    progress((number + fraction) / n_levels)


def _join_histories(histories, shifts: list[float]) -> Response:
    """Join the histories of successive runs, and shift them by their start times [s]."""
    parts = []
    start = np.zeros((4, 1))
    for part, shift in zip(histories, shifts):
        # Work, dissipated and created energy go on from run to run. The stored energy does not add up.
        ledger = part.extra["ledger"] + start
        start = ledger[:, -1:].copy()
        start[1] = 0.0
        extra = part.extra | {"ledger": ledger}
        parts.append(replace(part, time=_shift_times(part.time, shift), extra=extra))

    # The last sample of a run equals the first sample of the next run.
    parts[:-1] = [part.select(slice(None, -1)) for part in parts[:-1]]
    extra = {}
    for name in parts[-1].extra:
        axis = int(name == "ledger")
        extra[name] = np.concatenate([part.extra[name] for part in parts], axis=axis)
    columns = {}
    for name in Response.__dataclass_fields__:
        if name != "extra":
            columns[name] = np.concatenate([getattr(part, name) for part in parts])
    return Response(**columns, extra=extra)


def _shift_times(time, shift: float) -> np.ndarray:
    """Shift times by `shift` [s] so that both samples of each event remain distinct."""
    moved = time + shift
    before = np.flatnonzero(moved[1:] <= moved[:-1])
    moved[before] = np.nextafter(moved[before], -np.inf)
    return moved


def add_level_errors(found: LevelRuns, coarser_runs, solutions) -> LevelRuns:
    """Add the differences from coarse runs to the errors of each drive level.

    A measure that a coarse run does not have gets its absolute value as error.

    Parameters
    ----------
    found : LevelRuns
        Levels of the finest run.
    coarser_runs : list of CoarserRuns
        Settings of the coarse runs by source of error.
    solutions : dict
        Solution of each coarse run by its Numerics.
    """
    levels = []
    for number, level in enumerate(found.levels):
        # A run that ended earlier has no measures at this level.
        missing = [replace(level, values={})] * len(found.levels)
        solved = {}
        for key, solution in solutions.items():
            solved[key] = (*solution.levels.levels, *missing)[number]
        sources = estimate_errors(None, level.values, coarser_runs, solved)
        errors = dict(level.errors)
        for name, parts in split_errors(level.values, sources).items():
            errors[name] = errors.get(name, 0.0) + sum(parts.values())
        levels.append(replace(level, errors=errors))
    return found._replace(levels=tuple(levels))


def find_onset(found: LevelRuns, tolerance: float, is_past_onset) -> tuple[float, float] | None:
    """Find the drive level of the onset by bisection, with its uncertainty, both [m s-2]; None if no level reaches it.

    The bisection starts between the last level before the onset and the first level after it, and
    ends when the bracket is smaller than `tolerance` times the level. If there is no level before
    the onset, the lower limit is 0 and the tolerance refers to the first level after the onset.

    Parameters
    ----------
    found : LevelRuns
        Levels of the run, and the function that runs others.
    tolerance : float
        Largest width of the bracket relative to the level.
    is_past_onset : callable
        Function of a DriveLevel that returns whether the onset is reached.
    """
    bracket = bracket_onset(found.levels, is_past_onset)
    if bracket is None:
        return None
    before, reached = bracket
    low = found.levels[before].drive if before >= 0 else 0.0
    high = first = found.levels[reached].drive
    # Largest number of bisections of an onset; 40 of them reduce the bracket to 1e-12.
    for _ in range(40):
        if high - low <= tolerance * (high if low else first):
            break
        middle = (low + high) / 2
        if is_past_onset(found.run_level(before, middle)):
            high = middle
        else:
            low = middle
    return (low + high) / 2, (high - low) / 2


def measure_onset_level(rig, found: LevelRuns, coarser, tolerance: float) -> Measure:
    """Return the drive level of the onset; without a value and with the reason if no level reaches it.

    Parameters
    ----------
    rig : Rig
        Defines the kind of onset.
    found : LevelRuns
        Levels of the run.
    coarser : sequence of (Solution, Solution or None)
        Coarse runs with their reference, None for the run itself; the difference of their onsets is added to the error.
    tolerance : float
        Largest width of the bracket relative to the level.
    """
    unit, factor = _find_level_unit(rig)
    floor = MOTION_TABLE["onset_level"].floor
    is_past_onset = make_onset_test(*rig.drive.levels.onset)
    onset = find_onset(found, tolerance, is_past_onset)
    if onset is None:
        reason = make_no_onset_reason(*rig.drive.levels.onset)
        return Measure(None, unit, None, floor, reason=reason)
    level, error = onset
    for run, beside in coarser:
        coarse = find_onset(run.levels, tolerance, is_past_onset)
        reference = onset
        if beside is not None:
            reference = find_onset(beside.levels, tolerance, is_past_onset)
        change = level
        if coarse is not None and reference is not None:
            change = coarse[0] - reference[0]
        error += convergence_error(change, order=MAX_CONVERGENCE_ORDER)
    return Measure(factor * level, unit, factor * error, floor)


def convert_to_scene_units(rig, levels) -> tuple[DriveLevel, ...]:
    """Return the drive levels of a run with their amplitudes in the unit of the scene: [m s-2], or [N] for a force."""
    unit, factor = _find_level_unit(rig)
    return tuple(replace(level, drive=factor * level.drive, unit=unit) for level in levels)


def _find_level_unit(rig) -> tuple[str, float]:
    """Return the unit of the drive levels in the scene, and the factor that converts a level [m s-2] to it."""
    return ("N", rig.modes.mass) if rig.drive.kind == "force" else ("m s-2", 1.0)
