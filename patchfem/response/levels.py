"""Measures of a run whose drive level changes in steps: onset of slip, jump, hysteresis.

In: the `Level` at the end of each level of the drive, in order. Out: the bracket of the onset
of slip, the largest jump of the amplitude, and the hysteresis between increasing and decreasing
levels.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core import Outcome
from ..formatting import format_length

LEVEL_MEASURES = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    "absolute_acceleration_fundamental",
    "acceleration_distortion",
    "slip_amplitude",
    "stick_fraction",
    "friction_force_peak",
    "loop_area",
    "equivalent_stiffness",
    "secant_stiffness",
    "equivalent_damping",
)
AMPLITUDE_MEASURE = LEVEL_MEASURES[0]
# Ratio of third to first acceleration harmonic [1] above which distortion is visible in the curve.
MIN_DISTORTION = 0.03
# Smallest factor of a jump between neighbouring levels, relative to the factor of the drive [1].
MIN_JUMP_FACTOR = 1.5


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """State and measures of a run at the end of one level of the drive.

    - drive: acceleration [m s-2]; for a force drive the force over the modal mass, or the force [N]
      if `unit` says so.
    - stuck: nothing slipped.
    - values, errors: measures and their errors by name, as far as they are known.
    - outcome: how the motion ended under this level; "" if only the outcome of the last level is
      computed.
    """

    drive: float
    stuck: bool
    values: dict
    errors: dict
    unit: str = "m s-2"
    outcome: str = ""


def make_onset_test(kind: str, length: float | None = None) -> Callable[[Level], bool]:
    """Return a function that decides whether slip has started at a drive level.

    A motion that grows without bound lies above every onset.

    Parameters
    ----------
    kind : str
        "slip": some slip occurs; "distortion": H3/H1 of the acceleration exceeds MIN_DISTORTION;
        "gauge": half peak-to-peak at the output exceeds `length`.
    length : float, optional
        Amplitude for "gauge" [m].
    """
    beyond = {
        "slip": lambda level: not level.stuck,
        "gauge": lambda level: level.values[AMPLITUDE_MEASURE] > length,
    }.get(kind, lambda level: level.values.get("acceleration_distortion", 0.0) > MIN_DISTORTION)
    return lambda level: level.outcome == Outcome.GROWS or beyond(level)


def make_no_onset_reason(kind: str, length: float | None = None) -> str:
    """Return the reason why a sequence of drive levels has no onset."""
    far = f"has an amplitude of more than {format_length(length)} at the output" if length else ""
    what = {"slip": "slips", "gauge": far}.get(
        kind,
        f"has an acceleration whose third harmonic is more than {MIN_DISTORTION:g} of its first harmonic",
    )
    return f"no level of the increasing sequence {what}"


def bracket_onset(levels, is_above_onset: Callable[[Level], bool]) -> tuple | None:
    """Return the indices of the drive levels just below and just above the onset of slip.

    Only the levels before the first decrease count.

    Parameters
    ----------
    levels : sequence of Level
    is_above_onset : callable
        Decides whether a level lies above the onset (see `make_onset_test`).

    Returns
    -------
    tuple or None
        Two indices, the first of which is -1 for the start of the run; None if no level lies above
        the onset.
    """
    for k, level in enumerate(levels):
        if is_above_onset(level):
            return k - 1, k
        if k + 1 < len(levels) and levels[k + 1].drive < level.drive:
            return None
    return None


def largest_jump(levels, name: str = AMPLITUDE_MEASURE) -> tuple | None:
    """Return the largest relative jump of a measure between successive drive levels.

    The factor of the measure is divided by the factor of the drive.

    Parameters
    ----------
    levels : sequence of Level
    name : str
        Measure.

    Returns
    -------
    tuple or None
        Drive of the level after the jump, factor [1], and distance between the two levels in the
        unit of the drive; None if no factor reaches MIN_JUMP_FACTOR, up or down.
    """
    found = []
    for a, b in pairwise(levels):
        sizes = a.drive, b.drive, a.values[name], b.values[name]
        if all(0 < size < np.inf for size in sizes) and not (a.stuck or b.stuck):
            factor = (b.values[name] / a.values[name]) / (b.drive / a.drive)
            found.append((abs(np.log(factor)), b.drive, factor, abs(b.drive - a.drive)))
    return max(found)[1:] if found and max(found)[0] >= np.log(MIN_JUMP_FACTOR) else None


def largest_hysteresis(levels, name: str = AMPLITUDE_MEASURE) -> tuple | None:
    """Return the largest difference of a measure between increasing and decreasing levels.

    Parameters
    ----------
    levels : sequence of Level
    name : str
        Measure.

    Returns
    -------
    tuple or None
        Difference at one drive, and its error; None if no drive occurs in both directions.
    """
    drives = np.array([level.drive for level in levels])
    top = int(np.argmax(drives))
    back = {round(level.drive, 9): level for level in levels[top + 1 :]}
    pairs = [
        (level, back[round(level.drive, 9)])
        for level in levels[:top]
        if round(level.drive, 9) in back
    ]
    if not pairs:
        return None
    gaps = [
        (abs(a.values[name] - b.values[name]), a.errors.get(name, 0.0) + b.errors.get(name, 0.0))
        for a, b in pairs
    ]
    return max((gap for gap in gaps if np.isfinite(gap[0])), default=None)
