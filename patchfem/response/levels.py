"""Measures of a run whose drive level changes in steps: onset of slip, jump, hysteresis.

In: a `Level` record for each drive level, in chronological order. Out: the two levels that bracket the
onset of slip, the largest jump of the amplitude, and the hysteresis between increasing and decreasing
levels.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core import Outcome
from ..formatting import format_length
from .rows import AMPLITUDE, select_names

LEVEL_MEASURES = select_names("level")
# Smallest ratio of the third to the first harmonic of the acceleration that indicates slip.
MIN_DISTORTION = 0.03
# Smallest ratio of a measure at neighbouring levels, divided by the ratio of the drive levels, that
# counts as a jump.
MIN_JUMP_FACTOR = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """Measures and state of a run at the end of one drive level.

    - drive: acceleration amplitude [m s-2]; for a force drive, force over modal mass [m s-2] or force
      [N], depending on `unit`.
    - stuck: whether no interface slips.
    - values, errors: known measures and their errors by name.
    - unit: unit of `drive`.
    - outcome: outcome of the motion at this level; "" if it was not computed.
    """

    drive: float
    stuck: bool
    values: dict
    errors: dict
    unit: str = "m s-2"
    outcome: str = ""


def make_onset_test(kind: str, length: float | None = None) -> Callable[[Level], bool]:
    """Return a function that decides whether a drive level lies above the onset of slip.

    A motion that grows without bound counts as slip.

    Parameters
    ----------
    kind : str
        "slip": an interface slips; "distortion": H3/H1 of the acceleration exceeds MIN_DISTORTION;
        "gauge": the amplitude at the output (half peak-to-peak) exceeds `length`.
    length : float, optional
        Limit of the amplitude for "gauge" [m].
    """
    exceeds_onset = {
        "slip": lambda level: not level.stuck,
        "gauge": lambda level: level.values[AMPLITUDE] > length,
    }.get(kind, lambda level: level.values.get("acceleration_distortion", 0.0) > MIN_DISTORTION)
    return lambda level: level.outcome == Outcome.GROWS or exceeds_onset(level)


def make_no_onset_reason(kind: str, length: float | None = None) -> str:
    """Return the reason why no onset of slip was found in a sequence of drive levels."""
    amplitude_text = (
        f"has an amplitude of more than {format_length(length)} at the output" if length else ""
    )
    event = {"slip": "slips", "gauge": amplitude_text}.get(
        kind,
        f"has an acceleration whose third harmonic is more than {MIN_DISTORTION:g} of its first harmonic",
    )
    return f"no level of the increasing sequence {event}"


def bracket_onset(levels, is_above_onset: Callable[[Level], bool]) -> tuple | None:
    """Return the indices of the drive levels just below and just above the onset of slip.

    Only the levels before the first decrease are considered.

    Parameters
    ----------
    levels : sequence of Level
    is_above_onset : callable
        Function that returns whether a level lies above the onset (see `make_onset_test`).

    Returns
    -------
    tuple or None
        Two indices; the first is -1 if the first level lies above the onset. None if no level lies above
        the onset.
    """
    for k, level in enumerate(levels):
        if is_above_onset(level):
            return k - 1, k
        if k + 1 < len(levels) and levels[k + 1].drive < level.drive:
            return None
    return None


def largest_jump(levels) -> tuple | None:
    """Return the largest relative jump of the amplitude between successive drive levels.

    The jump is the ratio of the measures divided by the ratio of the drive levels.

    Parameters
    ----------
    levels : sequence of Level

    Returns
    -------
    tuple or None
        Drive of the level after the jump, factor [1], and distance between the two levels in the
        unit of the drive; None if no factor, upwards or downwards,
        reaches MIN_JUMP_FACTOR.
    """
    jumps = []
    for level, next_level in pairwise(levels):
        sizes = level.values[AMPLITUDE], next_level.values[AMPLITUDE]
        amounts = level.drive, next_level.drive, *sizes
        if all(0 < size < np.inf for size in amounts) and not (level.stuck or next_level.stuck):
            factor = sizes[1] / sizes[0] / (next_level.drive / level.drive)
            jumps.append(
                (abs(np.log(factor)), next_level.drive, factor, abs(next_level.drive - level.drive))
            )
    return max(jumps)[1:] if jumps and max(jumps)[0] >= np.log(MIN_JUMP_FACTOR) else None


def largest_hysteresis(levels) -> tuple | None:
    """Return the largest difference of the amplitude between increasing and decreasing levels.

    Parameters
    ----------
    levels : sequence of Level

    Returns
    -------
    tuple or None
        Difference at equal drive, and its error; None if no drive level occurs in both directions.
    """
    drives = np.array([level.drive for level in levels])
    highest = int(np.argmax(drives))
    decreasing_levels = {round(level.drive, 9): level for level in levels[highest + 1 :]}
    differences = []
    for rising in levels[:highest]:
        falling = decreasing_levels.get(round(rising.drive, 9))
        if falling is not None:
            difference = abs(rising.values[AMPLITUDE] - falling.values[AMPLITUDE])
            if np.isfinite(difference):
                error = sum(level.errors.get(AMPLITUDE, 0.0) for level in (rising, falling))
                differences.append((difference, error))
    return max(differences, default=None)
