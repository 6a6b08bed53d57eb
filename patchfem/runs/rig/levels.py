"""Drive whose amplitude changes in levels, with the state continued from level to level.

In: the runs of successive levels. Out: a `Level` with errors for each of them, the onset level
found by bisection, and the joined run.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ...core import Measure, Response, SineDrive
from ...response.coarser import ComparisonRuns, estimate_errors
from ...response.errors import split_errors
from ...response.events import join_events
from ...response.levels import (
    LEVEL_MEASURES,
    Level,
    bracket_onset,
    make_no_onset_reason,
    make_onset_test,
)
from ...response.rows import MOTION_TABLE
from ...structure.drive_sizes import find_drive_omega
from .solution import Fields

# Relative error of the measures of an event-driven run, which has round-off only.
EXACT_RELATIVE_ERROR = 1e-9
# Largest number of bisections of an onset; 40 of them reduce the bracket to 1e-12.
MAX_ONSET_BISECTIONS = 40


def add_level_errors(
    drive_levels: Sequence[Level], coarser_runs: ComparisonRuns, solutions
) -> tuple[Level, ...]:
    """Add the differences from coarse runs to the errors of each drive level.

    A measure that a coarse run does not have gets its absolute value as error.

    Parameters
    ----------
    drive_levels : sequence of Level
        Levels of the run, in chronological order.
    coarser_runs : list of CoarserRuns
        Settings of the coarse runs by source of error.
    solutions : dict
        Solution of each coarse run by its Numerics.
    """
    levels_with_errors = []
    for number, level in enumerate(drive_levels):
        # A run that ended earlier has no measures at this level.
        missing = replace(level, values={})
        solved = {
            key: (*run.levels, *[missing] * len(drive_levels))[number]
            for key, run in solutions.items()
        }
        sources = estimate_errors(None, level.values, coarser_runs, solved)
        errors = dict(level.errors)
        for name, parts in split_errors(level.values, sources).items():
            errors[name] = errors.get(name, 0.0) + sum(parts.values())
        levels_with_errors.append(replace(level, errors=errors))
    return tuple(levels_with_errors)


class Onset(NamedTuple):
    """Drive level of an onset, from a bracket of two levels [m s-2].

    - level: middle of the bracket
    - error: half its width
    """

    level: float
    error: float


def find_onset(drive_levels, run_level, tolerance: float, is_past_onset) -> Onset | None:
    """Find the drive level [m s-2] of the onset by bisection, with its uncertainty; None if no level reaches the onset.

    The bisection starts between the last level before the onset and the first level after it, and
    ends when the bracket is smaller than `tolerance` times the level. If there is no level before
    the onset, the lower limit is 0 and the tolerance refers to the first level after the onset.

    Parameters
    ----------
    drive_levels : sequence of Level
        Levels of the run, in chronological order.
    run_level : callable
        Function (index, level) -> Level that runs a level [m s-2] from the final state of the level
        with this index, or from rest for the index -1.
    tolerance : float
        Largest width of the bracket relative to the level.
    is_past_onset : callable
        Function of a Level that returns whether the onset is reached.
    """
    bracket = bracket_onset(drive_levels, is_past_onset)
    if bracket is None:
        return None
    before, reached = bracket
    first = drive_levels[reached]
    low = drive_levels[before].drive if before >= 0 else 0.0
    high = first.drive
    for _ in range(MAX_ONSET_BISECTIONS):
        if high - low <= tolerance * (high if low else first.drive):
            break
        middle = (low + high) / 2
        if is_past_onset(run_level(before, middle)):
            high = middle
        else:
            low = middle
    return Onset((low + high) / 2, (high - low) / 2)


def measure_onset_level(rig, solution, tolerance: float) -> Measure:
    """Return the drive level of the onset; without a value and with the reason if no level reaches it.

    Parameters
    ----------
    rig : Rig
        Defines the kind of onset.
    solution : Solution
        The difference of the onset levels of its coarse runs is added to the error.
    tolerance : float
        Largest width of the bracket relative to the level.
    """
    unit, factor = _find_level_unit(rig)
    is_past_onset = make_onset_test(*rig.drive.levels.onset)

    def find(run) -> Onset | None:
        """Return the onset of slip in a run with drive levels, or None if no level reaches it."""
        return find_onset(run.levels, run.run_level, tolerance, is_past_onset)

    onset = find(solution)
    if onset is None:
        reason = make_no_onset_reason(*rig.drive.levels.onset)
        return Measure(None, unit, None, MOTION_TABLE["onset_level"].floor, reason=reason)
    level, error = onset
    for run, beside in solution.coarser:
        coarse_onset = find(run)
        reference = onset if beside is None else find(beside)
        is_missing = coarse_onset is None or reference is None
        error += level if is_missing else abs(coarse_onset.level - reference.level)
    return Measure(factor * level, unit, factor * error, 1e-9)


def convert_to_scene_units(rig, drive_levels) -> tuple[Level, ...]:
    """Return the drive levels of a run with their amplitudes in the unit of the scene: [m s-2], or [N] for a force."""
    unit, factor = _find_level_unit(rig)
    return tuple(replace(level, drive=factor * level.drive, unit=unit) for level in drive_levels)


def _find_level_unit(rig) -> tuple[str, float]:
    """Return the unit of the drive levels in the scene, and the factor that converts a level [m s-2] to it."""
    return ("N", rig.modes.mass) if rig.drive.kind == "force" else ("m s-2", 1.0)


def run_levels(evaluator, frames: int = 0, progress=None) -> tuple[Any, Fields]:
    """Run the levels of a drive in order, each from the final state of the previous one.

    Parameters
    ----------
    evaluator : RunEvaluator
        Integrates and evaluates each level. Its model has the levels of the drive.
    frames : int
        Number of snapshots of the interface in the last cycle of the last level.
    progress : callable, optional
        Callback for the completed fraction of all levels.

    Returns
    -------
    tuple
        Joined run, and the fields `levels` and `run_level` of its Solution.
    """
    drive = evaluator.model.rig.drive
    amplitudes = drive.levels.amplitudes
    omega = find_drive_omega(drive.signal)
    runs = []
    level_results = []

    def solve(level: float, before, n_frames: int = 0, report=None) -> tuple[Any, Level]:
        """Run a level, and return the run and its Level.

        Parameters
        ----------
        level : float
            Drive level [m s-2].
        before
            Run from whose end the level goes on, or None for rest.
        n_frames : int
            Number of snapshots of the interface in the last cycle.
        report : callable, optional
            Callback for the completed fraction.
        """
        sine = SineDrive(level, omega, drive.signal.moving)
        run = evaluator.integrate(sine, drive.levels.cycles, before, n_frames, report)
        values = evaluator.evaluate_measures(run, sine)
        values = {name: values[name] for name in LEVEL_MEASURES if name in values}
        errors = {name: EXACT_RELATIVE_ERROR * abs(value) for name, value in values.items()}
        return run, Level(level, evaluator.is_stuck(run), values, errors)

    def run_level(number: int, level: float) -> Level:
        """Run the drive at an amplitude `level` [m s-2] from the final state of level `number`, or from rest if it is -1."""
        return solve(level, runs[number] if number >= 0 else None)[1]

    # Each level goes on from the end of the one before; a run that ends early is the last one.
    n_levels = len(amplitudes)
    report = None if progress is None else partial(_report_fraction, progress, runs, n_levels)
    for amplitude in amplitudes:
        is_last = len(runs) + 1 == n_levels
        run, result = solve(amplitude, runs[-1] if runs else None, frames * is_last, report)
        runs.append(run)
        level_results.append(result)
        if run.outcome is not None:
            break

    # One run has the histories of all levels; `run_level` computes further levels in the search for the onset of slip.
    joined = join_runs(runs, drive.levels.cycles * drive.signal.period)
    return joined, {"levels": tuple(level_results), "run_level": run_level}


def _report_fraction(progress, runs, n_levels: int, fraction: float) -> None:
    """Report the completed fraction of all levels: `runs` are complete, and `fraction` of the next level."""
    progress((len(runs) + fraction) / n_levels)


def join_runs(runs, duration: float):
    """Join the runs of successive drive levels, each of `duration` [s], to a single run with histories over all of them.

    The window and the friction loop are those of the last level.
    """
    shifts = [k * duration for k in range(len(runs))]
    last = runs[-1]
    window = replace(last.window, time=_shift_times(last.window.time, shifts[-1]))
    ledger = {name: sum(run.ledger[name] for run in runs) for name in last.ledger}
    ledger["peak_stored"] = max(run.ledger["peak_stored"] for run in runs)
    return replace(
        last,
        response=_join_histories([run.response for run in runs], shifts),
        window=window,
        ledger=ledger,
        log=None if last.log is None else join_events([run.log for run in runs], shifts),
        extremes=np.concatenate([run.extremes for run in runs]),
        phasors=np.concatenate([run.phasors for run in runs]),
    )


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
