"""Drive in levels: the amplitude changes in steps with the state carried over.

In: the runs of successive levels. Out: `Level`s with errors, the onset between two levels by
bisection, and the joined run.
"""

from dataclasses import replace

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

EXACT = 1e-9  # relative error of measures of a motion in closed form
MAX_BISECTIONS = 40  # most bisections of the bracket of an onset


def level_ends(rig) -> tuple:
    """Return the cycles (l,) after which the levels of a drive end; () without levels."""
    return tuple(rig.drive.levels.cycles * (k + 1) for k in range(len(rig.drive.levels.amplitudes)))


def levels_with_errors(levels, ways, made: dict) -> tuple:
    """Return the levels with the errors from their coarse runs in addition to their own errors.

    The error of a measure that a coarse run does not have is its absolute value.

    Parameters
    ----------
    levels : sequence of Level
    ways : sequence of CoarserRuns
    made : dict
        Solution by variant of the coarse runs.
    """

    def seen(variant, number: int) -> dict:
        """Return the measures of a level in a coarse run; {} if the run ended before it."""
        found = made[variant].levels
        return found[number].values if number < len(found) else {}

    def open_at(number: int, level: Level) -> dict:
        """Return the errors of a level by measure name."""
        parts = [
            way.rule(
                level.values if way.beside is None else seen(way.beside, number),
                *(seen(run, number) for run in way.runs),
            )
            for way in ways
        ]
        return {
            name: level.errors.get(name, 0.0) + sum(part.get(name, abs(value)) for part in parts)
            for name, value in level.values.items()
        }

    return tuple(
        replace(level, errors=open_at(number, level)) for number, level in enumerate(levels)
    )


def onset(levels, probe, tolerance: float, past=None) -> tuple | None:
    """Return the onset [m s-2] and half its bracket, by bisection between two levels.

    They are the last level below the onset and the first one above it. The bisection ends when the
    bracket is `tolerance` times the level; if all levels down to 0 are above the onset, times the
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
    found = bracket_onset(levels, past)
    if found is None:
        return None
    before, first = found
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


def drive_at_level(drive, number: int, level: float):
    """Return the drive that ends with `level` [m s-2] in place of the level of this index."""
    return replace(
        drive, segments=(*drive.segments[:number], replace(drive.segments[number], amplitude=level))
    )


def level_measures(rig, levels, probe, tolerance: float, rubs: bool, coarser=()) -> dict:
    """Return the measures over all levels, with a reason for those without a value.

    They are onset_level, jump_level and level_hysteresis.

    Parameters
    ----------
    rig : Rig
        Has the kind of onset.
    levels : sequence of Level
    probe : callable
        See `onset`.
    tolerance : float
    rubs : bool
        Whether an interface carries a load.
    coarser : sequence
        See `Solution`; the distance between the onsets of each pair is added to the error.
    """
    unit = _unit(rig)
    size = _size(rig)
    out = {}
    past = make_onset_test(*rig.drive.levels.onset)
    lowest = onset(levels, probe, tolerance, past) if rubs else None
    if lowest is not None:
        apart = 0.0
        for pair in coarser:
            ends = [
                lowest if one is None else onset(one.levels, one.probe, tolerance, past)
                for one in pair
            ]
            apart += lowest[0] if None in ends else abs(ends[0][0] - ends[1][0])
        out["onset_level"] = Measure(size * lowest[0], unit, size * (lowest[1] + apart), 1e-9)
    elif rubs:
        out["onset_level"] = Measure(
            None,
            unit,
            None,
            TABLE["onset_level"].floor,
            reason=make_no_onset_reason(*rig.drive.levels.onset),
        )
    if (leap := largest_jump(levels)) is not None:
        width = size * float(leap[2])  # the jump lies between two levels
        out["jump_level"] = Measure(size * leap[0], unit, width, width)
    else:
        out["jump_level"] = Measure(
            None,
            unit,
            None,
            TABLE["jump_level"].floor,
            reason="the amplitude does not jump: between neighbouring drive levels the ratio of the "
            f"amplitudes is always below {MIN_JUMP_FACTOR:g} times the ratio of the levels",
        )
    if (loop := largest_hysteresis(levels)) is not None:
        out["level_hysteresis"] = Measure(float(loop[0]), "m", float(loop[1]), 1e-10)
    return out


def in_scene_units(rig, levels) -> tuple:
    """Return the levels in the units of the scene: of a force drive with the force [N]."""
    return tuple(
        replace(level, drive=_size(rig) * level.drive, unit=_unit(rig)) for level in levels
    )


def _unit(rig) -> str:
    """Return the unit of the levels in the scene."""
    return "N" if rig.drive.kind == "force" else "m s-2"


def _size(rig) -> float:
    """Return the factor from a level of the drive [m s-2] to its unit in the scene."""
    return rig.modes.mass if rig.drive.kind == "force" else 1.0


def run_levels(reader, go, state, end, progress=None) -> tuple:
    """Run all levels of a drive, each from the state at the end of the previous one.

    Parameters
    ----------
    reader : Reader
    go : callable
        Function (sine, state, watch, last) -> run.
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
    states = [state]
    parts = []
    found = []

    def at(level, state, watch=None, last=False) -> tuple:
        """Run one level from a state, and return the run and its Level."""
        sine = SineDrive(level, find_drive_omega(rig.drive.signal), rig.drive.signal.moving)
        done = go(sine, state, watch, last)
        return done, reader.level(level, done, sine, EXACT)

    amplitudes = rig.drive.levels.amplitudes
    count = len(amplitudes)
    for k, level in enumerate(amplitudes):
        watch = None if progress is None else (lambda part, k=k: progress((k + part) / count))
        done, seen = at(level, states[-1], watch, k + 1 == count)
        parts.append(done)
        found.append(seen)
        states.append(end(done))
        if done.outcome is not None:
            break
    return joined_runs(parts, rig.drive.levels.cycles * rig.drive.signal.period), {
        "levels": tuple(found),
        "probe": lambda number, level: at(level, states[number + 1])[1],
    }


def remove_incomplete_cycle(done):
    """Return the run without the extremes and the phasor of an incomplete last cycle."""
    count = int(done.cycles_done + 1e-9)
    if not count or count >= len(done.amplitudes):
        return done
    return replace(done, amplitudes=done.amplitudes[:count], phasors=done.phasors[:count])


def joined_runs(parts, each: float):
    """Join successive runs of `each` [s] to a single one.

    Window and loop are those of the last run.
    """
    shift = [k * each for k in range(len(parts))]
    # the last sample of a run is the first one of the next
    last = parts[-1]
    rows = [slice(None, -1)] * (len(parts) - 1) + [slice(None)]

    def column(of):
        """Return the concatenation of a history over all runs."""
        return np.concatenate([of(p)[part] for p, part in zip(parts, rows)])

    columns = {
        name: column(lambda p, name=name: getattr(p.response, name))
        for name in type(last.response).__dataclass_fields__
        if name not in ("time", "extra")
    }
    time = np.concatenate(
        [_shift_times(p.response.time, t)[part] for p, part, t in zip(parts, rows, shift)]
    )
    extra = {
        name: column(lambda p, name=name: p.response.extra[name])
        for name in last.response.extra
        if name != "ledger"
    }
    if "ledger" in last.response.extra:
        extra["ledger"] = column(lambda p: p.response.extra["ledger"].T).T
    response = replace(last.response, time=time, extra=extra, **columns)
    window = replace(last.window, time=_shift_times(last.window.time, shift[-1]))
    ledger = {name: sum(p.ledger[name] for p in parts) for name in last.ledger}
    ledger["peak_stored"] = max(p.ledger["peak_stored"] for p in parts)
    return replace(
        last,
        response=response,
        window=window,
        ledger=ledger,
        log=run_events.join_logs([p.log for p in parts], shift),
        amplitudes=np.concatenate([p.amplitudes for p in parts]),
        phasors=np.concatenate([p.phasors for p in parts]),
        events=sum(p.events for p in parts),
    )


def _shift_times(time, shift: float):
    """Return times shifted by `shift` [s], with the two sides of an event still distinct."""
    moved = time + shift
    before = np.flatnonzero(moved[1:] <= moved[:-1])
    moved[before] = np.nextafter(moved[before], -np.inf)
    return moved
