"""Drive in levels: the amplitude changes in steps with the state carried over.

In: the runs of successive levels. Out: `Level`s with errors, the onset between two levels by
bisection, and the joined run.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from ...core import Measure, SineDrive
from ...response import run_events
from ...response.levels import (
    MIN_JUMP_FACTOR,
    Level,
    bracket_onset,
    largest_hysteresis,
    largest_jump,
    make_no_onset_reason,
    make_onset_test,
)
from ...response.rows import TABLE
from ...structure.drive_sizes import find_drive_omega

# Relative error of the measures of an event-driven run, whose motion has round-off only.
EXACT_RELATIVE_ERROR = 1e-9
MAX_BISECTIONS = 40  # largest number of bisections of an onset, to 1e-12 of its bracket


def list_level_ends(rig) -> tuple:
    """Return the cycles (l,) after which the levels of a drive end."""
    return tuple(rig.drive.levels.cycles * (k + 1) for k in range(len(rig.drive.levels.amplitudes)))


def add_level_errors(levels, coarser_runs: list, solutions: dict) -> tuple:
    """Widen the errors at every drive level by the differences from coarse runs.

    The error of a measure that a coarse run does not have is its absolute value.

    Parameters
    ----------
    levels : sequence of Level
    coarser_runs : list of CoarserRuns
    solutions : dict
        Solution of each coarse run by its Numerics.
    """

    levels_with_errors = []
    for number, level in enumerate(levels):
        parts = []
        for kind in coarser_runs:
            reference = level.values
            if kind.beside is not None:
                reference = _values_at_level(solutions[kind.beside], number)
            coarse_values = [_values_at_level(solutions[run], number) for run in kind.runs]
            parts.append(kind.rule(reference, *coarse_values))
        errors = {}
        for name, value in level.values.items():
            error = sum(part.get(name, abs(value)) for part in parts)
            errors[name] = level.errors.get(name, 0.0) + error
        levels_with_errors.append(replace(level, errors=errors))
    return tuple(levels_with_errors)


def _values_at_level(solution, number: int) -> dict:
    """Return the measures at one drive level; {} if the run ended before this level."""
    return solution.levels[number].values if number < len(solution.levels) else {}


def find_onset(levels, probe, tolerance: float, past=None) -> tuple | None:
    """Find the drive level [m s-2] at which slip starts by bisection, with its uncertainty.

    The bracket is the last level below the onset and the first level above it. The bisection ends when
    the bracket is `tolerance` times the level; if all levels down to 0 are above the onset, times the
    first level above it. A law for which every level is above the onset (bonds that chatter) has no
    onset.

    Parameters
    ----------
    levels : sequence of Level
    probe : callable
        Function (index of the previous level or -1, level) -> Level that runs another level from
        the end of the previous one.
    tolerance : float
    past : callable, optional
        Function of a Level from `make_onset_test`; by default that of slip.

    Returns
    -------
    tuple or None
        None if no level is above the onset.
    """
    past = make_onset_test("slip") if past is None else past
    bracket = bracket_onset(levels, past)
    if bracket is None:
        return None
    before, first = bracket
    first = levels[first]
    low = levels[before].drive if before >= 0 else 0.0
    high = first.drive
    for _ in range(MAX_BISECTIONS):
        if high - low <= tolerance * (high if low else first.drive):
            break
        middle = (low + high) / 2
        if past(probe(before, middle)):
            high = middle
        else:
            low = middle
    return (low + high) / 2, (high - low) / 2


def replace_level(drive, number: int, level: float):
    """Return a drive that ends after one of its levels, with another amplitude there.

    Parameters
    ----------
    drive
        Drive in levels.
    number : int
        Index of the level that is replaced.
    level : float
        [m s-2].
    """
    segment = replace(drive.segments[number], amplitude=level)
    return replace(drive, segments=(*drive.segments[:number], segment))


def compute_level_measures(
    rig, levels, probe, tolerance: float, *, has_friction: bool, coarser=()
) -> dict:
    """Compute onset, largest jump and hysteresis over all levels of a drive.

    These are onset_level, jump_level and level_hysteresis, with a reason if there is no value.

    Parameters
    ----------
    rig : Rig
        Has the kind of onset.
    levels : sequence of Level
    probe : callable
        See `find_onset`.
    tolerance : float
    has_friction : bool
        Whether friction acts.
    coarser : sequence
        See `Solution`; the distance between the onsets of each pair is added to the error.
    """
    unit = _level_unit(rig)
    size = _level_factor(rig)
    measures = {}
    past = make_onset_test(*rig.drive.levels.onset)
    lowest = find_onset(levels, probe, tolerance, past) if has_friction else None
    if lowest is not None:
        level, half_width = lowest
        change = 0.0
        for run, beside in coarser:
            coarse_onset = find_onset(run.levels, run.probe, tolerance, past)
            reference = lowest
            if beside is not None:
                reference = find_onset(beside.levels, beside.probe, tolerance, past)
            is_missing = coarse_onset is None or reference is None
            change += level if is_missing else abs(coarse_onset[0] - reference[0])
        measures["onset_level"] = Measure(size * level, unit, size * (half_width + change), 1e-9)
    elif has_friction:
        measures["onset_level"] = Measure(
            None,
            unit,
            None,
            TABLE["onset_level"].floor,
            reason=make_no_onset_reason(*rig.drive.levels.onset),
        )
    if (leap := largest_jump(levels)) is not None:
        width = size * float(leap[2])  # the jump lies anywhere between two levels
        measures["jump_level"] = Measure(size * leap[0], unit, width, width)
    else:
        measures["jump_level"] = Measure(
            None,
            unit,
            None,
            TABLE["jump_level"].floor,
            reason="the amplitude does not jump: between neighbouring drive levels the ratio of the "
            f"amplitudes is always below {MIN_JUMP_FACTOR:g} times the ratio of the levels",
        )
    if (loop := largest_hysteresis(levels)) is not None:
        measures["level_hysteresis"] = Measure(float(loop[0]), "m", float(loop[1]), 1e-10)
    return measures


def convert_to_scene_units(rig, levels) -> tuple:
    """Convert drive levels to the unit of the scene, [m s-2] or [N]."""
    size = _level_factor(rig)
    unit = _level_unit(rig)
    return tuple(replace(level, drive=size * level.drive, unit=unit) for level in levels)


def _level_unit(rig) -> str:
    """Return the unit in which the scene gives the drive levels."""
    return "N" if rig.drive.kind == "force" else "m s-2"


def _level_factor(rig) -> float:
    """Return the factor that converts a drive level [m s-2] to the unit of the scene."""
    return rig.modes.mass if rig.drive.kind == "force" else 1.0


def run_levels(reader, integrate, state, end, progress=None) -> tuple:
    """Run the levels of a drive in order, each from the final state of the previous one.

    Parameters
    ----------
    reader : Reader
    integrate : callable
        Function (sine, state, watch, is_last) -> run.
    state
        Initial state.
    end : callable
        Function of a run that returns its final state.
    progress : callable, optional

    Returns
    -------
    tuple
        The joined run, and the fields `levels` and `probe` of its Solution.
    """
    rig = reader.model.rig
    omega = find_drive_omega(rig.drive.signal)
    moving = rig.drive.signal.moving
    states = [state]
    runs = []
    level_results = []

    def probe(number: int, level: float) -> Level:
        """Run a level from the end of an earlier one; number -1 means a start from rest."""
        sine = SineDrive(level, omega, moving)
        run = integrate(sine, states[number + 1], None, False)
        return reader.level(level, run, sine, EXACT_RELATIVE_ERROR)

    amplitudes = rig.drive.levels.amplitudes
    n_levels = len(amplitudes)
    for k, amplitude in enumerate(amplitudes):
        watch = None
        if progress is not None:
            watch = partial(_report_fraction, progress, k, n_levels)
        sine = SineDrive(amplitude, omega, moving)
        run = integrate(sine, states[-1], watch, k + 1 == n_levels)
        runs.append(run)
        level_results.append(reader.level(amplitude, run, sine, EXACT_RELATIVE_ERROR))
        states.append(end(run))
        if run.outcome is not None:
            break
    joined = join_runs(runs, rig.drive.levels.cycles * rig.drive.signal.period)
    return joined, {"levels": tuple(level_results), "probe": probe}


def _report_fraction(progress, level: int, n_levels: int, fraction: float) -> None:
    """Report the completed fraction of all levels to the progress callback."""
    progress((level + fraction) / n_levels)


def remove_incomplete_cycle(done):
    """Remove the extremes and the Fourier coefficient of an incomplete last cycle from a run."""
    count = int(done.cycles_done + 1e-9)
    if not count or count >= len(done.amplitudes):
        return done
    return replace(done, amplitudes=done.amplitudes[:count], phasors=done.phasors[:count])


def join_runs(runs: list, duration: float):
    """Join the runs of successive drive levels to a single run.

    Window and loop are those of the last run.
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
        log=run_events.join_logs([run.log for run in runs], shifts),
        amplitudes=np.concatenate([run.amplitudes for run in runs]),
        phasors=np.concatenate([run.phasors for run in runs]),
        events=sum(run.events for run in runs),
    )


def _join_histories(histories: list, shifts: list):
    """Join the histories of successive runs, each shifted by its start time [s]."""
    last = histories[-1]
    # the last sample of a run is the first one of the next
    samples = [slice(None, -1)] * (len(histories) - 1) + [slice(None)]

    def join(arrays) -> np.ndarray:
        """Join one history of all runs without repeating the sample at each border."""
        return np.concatenate([array[part] for array, part in zip(arrays, samples)])

    columns = {}
    for name in type(last).__dataclass_fields__:
        if name not in ("time", "extra"):
            columns[name] = join([getattr(part, name) for part in histories])
    columns["time"] = join([_shift_times(part.time, t) for part, t in zip(histories, shifts)])
    extra = {}
    for name in last.extra:
        arrays = [part.extra[name] for part in histories]
        if name == "ledger":
            extra[name] = join([array.T for array in arrays]).T
        else:
            extra[name] = join(arrays)
    return replace(last, extra=extra, **columns)


def _shift_times(time, shift: float):
    """Shift times by `shift` [s] and keep both sides of each event distinct."""
    moved = time + shift
    before = np.flatnonzero(moved[1:] <= moved[:-1])
    moved[before] = np.nextafter(moved[before], -np.inf)
    return moved
