"""Levels: the level of the drive changed in steps with the state carried over, and the onset between two."""

from dataclasses import replace

import numpy as np

from ...core import Measure, SineDrive
from ...response import run_events
from ...response.levels import JUMP, Level, bracket, hysteresis, jump, no_onset, past_onset
from ...response.rows import TABLE
from ...structure.drive_sizes import drive_omega

EXACT = 1e-9  # relative error of what is read off a motion in closed form
MOST = 40  # halvings of the bracket of an onset


def level_ends(rig) -> tuple:
    """Cycles (l,) after which the levels of a drive end; () without levels."""
    return tuple(rig.drive.levels.cycles * (k + 1) for k in range(len(rig.drive.levels.amplitudes)))


def levels_with_errors(levels, ways, made: dict) -> tuple:
    """The levels with what the coarser runs of theirs leave open at each of them, over what is a level's own.

    made: variant -> Solution of the runs that the ladder takes. What a coarser run does not reach is as uncertain as it
    is large.
    """

    def seen(variant, number: int) -> dict:
        found = made[variant].levels
        return found[number].values if number < len(found) else {}

    def open_at(number: int, level: Level) -> dict:
        parts = [
            way.rule(
                level.values if way.beside is None else seen(way.beside, number),
                *(seen(one, number) for one in way.runs),
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
    """Onset [m s-2] and half its bracket, by halving between the last level before it and the first beyond it.

    probe(number of the level before or -1, level) -> Level runs one more level from the state that it left; past(Level)
    -> bool, of slip unless given, as `response.levels.past_onset` makes it.

    The halving goes on until the bracket is `tolerance` of the level, or of the first one beyond where all down to
    nought are: a law under which every level is past the onset (bonds that chatter) has none to be found.
    """
    past = past_onset("slip") if past is None else past
    found = bracket(levels, past)
    if found is None:
        return None
    before, first = found
    first = levels[first]
    low, high = levels[before].drive if before >= 0 else 0.0, first.drive
    for _ in range(MOST):
        if high - low <= tolerance * (high if low else first.drive):
            break
        middle = (low + high) / 2
        if past(probe(before, middle)):
            high = middle
        else:
            low = middle
    return (low + high) / 2, (high - low) / 2


def drive_with(drive, number: int, level: float):
    """The drive with `level` [m s-2] in place of the level of this number (from 0), and none after it."""
    return replace(
        drive, segments=(*drive.segments[:number], replace(drive.segments[number], amplitude=level))
    )


def level_measures(rig, levels, probe, tolerance: float, rubs: bool, coarser=()) -> dict:
    """Measures over all levels: onset_level, jump_level, level_hysteresis, with a reason where they have no value.

    rig: model.rig, with the kind of onset; probe as in `onset`; rubs: whether an interface bears a load; coarser: as in
    Solution; by the distance of the onsets of each pair that of the run may be off.
    """
    unit, size, out = _unit(rig), _size(rig), {}
    past = past_onset(*rig.drive.levels.onset)
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
            None, unit, None, TABLE["onset_level"].floor, reason=no_onset(*rig.drive.levels.onset)
        )
    if (leap := jump(levels)) is not None:
        width = size * float(leap[2])  # it lies between two levels
        out["jump_level"] = Measure(size * leap[0], unit, width, width)
    else:
        out["jump_level"] = Measure(
            None,
            unit,
            None,
            TABLE["jump_level"].floor,
            reason="the amplitude does not jump: between neighbouring drive levels the ratio of the "
            f"amplitudes is always below {JUMP:g} times the ratio of the levels",
        )
    if (loop := hysteresis(levels)) is not None:
        out["level_hysteresis"] = Measure(float(loop[0]), "m", float(loop[1]), 1e-10)
    return out


def in_scene_units(rig, levels) -> tuple:
    """The levels as the results show them: of a force drive with the force [N]."""
    return tuple(
        replace(level, drive=_size(rig) * level.drive, unit=_unit(rig)) for level in levels
    )


def _unit(rig) -> str:
    return "N" if rig.drive.kind == "force" else "m s-2"


def _size(rig) -> float:
    """What a level of the drive [m s-2] is in the unit of the scene, over it."""
    return rig.modes.mass if rig.drive.kind == "force" else 1.0


def by_levels(reader, go, state, end, progress=None) -> tuple:
    """Runs of all levels of a drive one after the other, each from where the one before it ended: (their run, the
    fields `levels` and `probe` of its Solution).

    reader: Reader of the runs; go(sine, state, watch, last) -> run; state: to begin from; end(run) -> state.
    """
    rig, states, parts, found = reader.model.rig, [state], [], []

    def at(level, state, watch=None, last=False) -> tuple:
        sine = SineDrive(level, drive_omega(rig.drive.signal), rig.drive.signal.moving)
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


def without_part_of_cycle(done):
    """The run without the extremes and the phasor of a last cycle that is cut short."""
    count = int(done.cycles_done + 1e-9)
    if not count or count >= len(done.amplitudes):
        return done
    return replace(done, amplitudes=done.amplitudes[:count], phasors=done.phasors[:count])


def joined_runs(parts, each: float):
    """Runs of `each` [s] one after the other as one EventRun or PieceRun; its window and loop are those of the last."""
    shift = [k * each for k in range(len(parts))]
    # where one ends the next begins
    last, rows = (
        parts[-1],
        [slice(None, -1)] * (len(parts) - 1) + [slice(None)],
    )

    def column(of):
        return np.concatenate([of(p)[part] for p, part in zip(parts, rows)])

    columns = {
        name: column(lambda p, name=name: getattr(p.response, name))
        for name in type(last.response).__dataclass_fields__
        if name not in ("time", "extra")
    }
    time = np.concatenate(
        [_later(p.response.time, t)[part] for p, part, t in zip(parts, rows, shift)]
    )
    extra = {
        name: column(lambda p, name=name: p.response.extra[name])
        for name in last.response.extra
        if name != "ledger"
    }
    if "ledger" in last.response.extra:
        extra["ledger"] = column(lambda p: p.response.extra["ledger"].T).T
    response = replace(last.response, time=time, extra=extra, **columns)
    window = replace(last.window, time=_later(last.window.time, shift[-1]))
    ledger = {name: sum(p.ledger[name] for p in parts) for name in last.ledger}
    ledger["peak_stored"] = max(p.ledger["peak_stored"] for p in parts)
    return replace(
        last,
        response=response,
        window=window,
        ledger=ledger,
        log=run_events.joined_logs([p.log for p in parts], shift),
        amplitudes=np.concatenate([p.amplitudes for p in parts]),
        phasors=np.concatenate([p.phasors for p in parts]),
        events=sum(p.events for p in parts),
    )


def _later(time, shift: float):
    """Times moved by `shift` [s], the two sides of an event still apart."""
    moved = time + shift
    before = np.flatnonzero(moved[1:] <= moved[:-1])
    moved[before] = np.nextafter(moved[before], -np.inf)
    return moved
