"""Onset of slip of a run whose drive level changes in steps.

In: a `Level` record for each drive level, in chronological order. Out: the two levels that bracket the
onset of slip.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ..formatting import format_length
from .measures import Values
from .rows import AMPLITUDE, select_names

LEVEL_MEASURES = select_names("level")
# Smallest ratio of the third to the first harmonic of the acceleration that indicates slip.
MIN_SLIP_DISTORTION = 0.03


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """Measures and state of a run at the end of one drive level.

    - drive: acceleration amplitude [m s-2]; for a force drive, force over modal mass [m s-2] or force
      [N], depending on `unit`.
    - stuck: whether no interface slips.
    - values, errors: known measures and their errors by name.
    - unit: unit of `drive`.
    """

    drive: float
    stuck: bool
    values: Values
    errors: Values
    unit: str = "m s-2"


def make_onset_test(kind: str, length: float | None = None) -> Callable[[Level], bool]:
    """Return a function that decides whether a drive level lies above the onset of slip.

    Parameters
    ----------
    kind : str
        "slip": an interface slips; "distortion": H3/H1 of the acceleration exceeds MIN_SLIP_DISTORTION;
        "gauge": the amplitude at the output (half peak-to-peak) exceeds `length`.
    length : float, optional
        Limit of the amplitude for "gauge" [m].
    """
    return {
        "slip": lambda level: not level.stuck,
        "gauge": lambda level: level.values[AMPLITUDE] > length,
    }.get(
        kind, lambda level: level.values.get("acceleration_distortion", 0.0) > MIN_SLIP_DISTORTION
    )


def make_no_onset_reason(kind: str, length: float | None = None) -> str:
    """Return the sentence why no level of a drive reached its onset, which is of a given kind.

    The onset is the first level with slip ("slip"), with an amplitude above `length` [m] at the output ("gauge"), or with a
    third harmonic of the acceleration (other kinds).
    """
    event = f"has an acceleration whose third harmonic is more than {MIN_SLIP_DISTORTION:g} of its first harmonic"
    if kind == "slip":
        event = "slips"
    elif kind == "gauge":
        event = f"has an amplitude of more than {format_length(length)} at the output"
    return f"no level of the increasing sequence {event}"


def bracket_onset(levels, is_above_onset: Callable[[Level], bool]) -> tuple[int, int] | None:
    """Return the indices of the drive levels just below and just above the onset of slip.

    Only the levels before the first decrease are considered.

    Parameters
    ----------
    levels : sequence of Level
        Levels in chronological order.
    is_above_onset : callable
        Function that returns whether a level lies above the onset.

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
