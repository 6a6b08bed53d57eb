"""Measures of a run whose level is raised or lowered in steps: onset, jump, hysteresis."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core import Outcome
from ..formatting import format_length

KEPT = (
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
AMPLITUDE = KEPT[0]
DISTORTED = 0.03  # third over first harmonic of the acceleration: from there on a person sees it in the curve
JUMP = 1.5  # factor beyond what the drive changed, between neighbouring levels


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """The end of one level of the drive.

    drive: acceleration [m s-2], of a force drive the force over the modal mass, or the force [N] where `unit` says so;
    stuck: nothing slipped; values: measures by name; errors: theirs, as far as they are known; outcome:
    how the motion under this level ended, "" where only the last one was asked.
    """

    drive: float
    stuck: bool
    values: dict
    errors: dict
    unit: str = "m s-2"
    outcome: str = ""


def past_onset(kind: str, length: float | None = None) -> Callable[[Level], bool]:
    """What tells whether a level lies beyond the onset, by the kind of onset that the scene asks for.

    "slip": some irreversible motion; "distortion": H3/H1 of the acceleration above DISTORTED; "gauge": half
    peak-to-peak at the output above `length` [m]. A motion that nothing bounds lies beyond every onset.
    """
    beyond = {
        "slip": lambda level: not level.stuck,
        "gauge": lambda level: level.values[AMPLITUDE] > length,
    }.get(kind, lambda level: level.values.get("acceleration_distortion", 0.0) > DISTORTED)
    return lambda level: level.outcome == Outcome.GROWS or beyond(level)


def no_onset(kind: str, length: float | None = None) -> str:
    """The reason why a run of levels has no onset; arguments as in `past_onset`."""
    far = f"has an amplitude of more than {format_length(length)} at the output" if length else ""
    what = {"slip": "slips", "gauge": far}.get(
        kind,
        f"has an acceleration whose third harmonic is more than {DISTORTED:g} of its first harmonic",
    )
    return f"no level of the rising sequence {what}"


def bracket(levels, past: Callable[[Level], bool]) -> tuple | None:
    """Numbers of the last level before the onset and of the first beyond it, on the way up; None where none is beyond.

    past: what tells, as `past_onset` gives it; -1 stands for the start.
    """
    for k, level in enumerate(levels):
        if past(level):
            return k - 1, k
        if k + 1 < len(levels) and levels[k + 1].drive < level.drive:
            return None
    return None


def jump(levels, name: str = AMPLITUDE) -> tuple | None:
    """Largest change of a measure between neighbouring levels, up or down, over what the drive itself changed.

    Returns (drive of the level after it, factor, distance of the two levels); None where no factor reaches JUMP, up or
    down.
    """
    found = []
    for a, b in pairwise(levels):
        sizes = a.drive, b.drive, a.values[name], b.values[name]
        if all(0 < size < np.inf for size in sizes) and not (a.stuck or b.stuck):
            factor = (b.values[name] / a.values[name]) / (b.drive / a.drive)
            found.append((abs(np.log(factor)), b.drive, factor, abs(b.drive - a.drive)))
    return max(found)[1:] if found and max(found)[0] >= np.log(JUMP) else None


def hysteresis(levels, name: str = AMPLITUDE) -> tuple | None:
    """Hysteresis of a measure between the upward and the downward series of levels, and its error.

    It is the largest difference at one drive that is passed both ways; None where no drive is.
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
    return max((one for one in gaps if np.isfinite(one[0])), default=None)
