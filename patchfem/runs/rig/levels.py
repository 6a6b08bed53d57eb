"""Levels: the level of the drive changed in steps with the state carried over, and the onset of slip between two."""

from dataclasses import replace

from ...core import Measure
from ...response.errors import step_error
from ...response.levels import KEPT, Level, bracket, hysteresis, jump

MOST = 40  # halvings of the bracket of an onset


def ends(rig) -> tuple:
    """Cycles (l,) after which the levels of a drive end; () without levels."""
    return tuple(rig.level_cycles * (k + 1) for k in range(len(rig.levels)))


def rows(sizes, marks, values, held: float | None) -> tuple:
    """A Level for each size [m s-2] and Mark of a march.

    values(mark) -> its measures; held [m]: slip amplitude below which a level sticks, None where nothing rubs.
    """
    out = []
    for size, mark in zip(sizes, marks):
        found = values(mark)
        kept = {name: found[name] for name in KEPT if name in found}
        out.append(Level(size, held is not None and found["slip_amplitude"] < held, kept, {}))
    return tuple(out)


def with_errors(fine, half, quarter, steps: int) -> tuple:
    """The levels with the error of the time step, from runs at `steps`, half and a quarter of them per cycle.

    The rule is that of `response.errors.step_error`.
    """
    return tuple(replace(a, errors=step_error(a.values, b.values, c.values, steps))
                 for a, b, c in zip(fine, half, quarter))


def onset(levels, slips, tolerance: float) -> tuple | None:
    """Onset of slip [m s-2] and half its bracket, by halving between the last level that held and the first that slips.

    slips(number of the level that held or -1, level) -> bool runs one more level from the state that it left.
    """
    found = bracket(levels)
    if found is None:
        return None
    held, first = found
    low, high = levels[held].drive if held >= 0 else 0.0, levels[first].drive
    for _ in range(MOST):
        if high - low <= tolerance * high:
            break
        middle = (low + high) / 2
        if slips(held, middle):
            high = middle
        else:
            low = middle
    return (low + high) / 2, (high - low) / 2


def drive_with(drive, number: int, level: float):
    """The drive with `level` [m s-2] in place of the level of this number (from 0), and none after it."""
    return replace(drive, segments=(*drive.segments[:number], replace(drive.segments[number], amplitude=level)))


def measures(levels, found: tuple | None) -> dict:
    """Measures over all levels: onset_level, jump_level, level_hysteresis, as far as there are any."""
    out = {}
    if found is not None:
        out["onset_level"] = Measure(found[0], "m s-2", found[1], 1e-9)
    if (leap := jump(levels)) is not None:
        out["jump_level"] = Measure(leap[0], "m s-2", float(leap[2]), float(leap[2]))  # it lies between two levels
    if (loop := hysteresis(levels)) is not None:
        out["level_hysteresis"] = Measure(float(loop[0]), "m", float(loop[1]), 1e-10)
    return out
