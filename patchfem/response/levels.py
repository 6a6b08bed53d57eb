"""Measures of a run whose level is raised or lowered in steps: onset of slip, jump, hysteresis."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

KEPT = ("relative_displacement_amplitude", "absolute_acceleration_peak", "slip_amplitude", "stick_fraction",
        "friction_force_peak", "loop_area", "equivalent_stiffness", "equivalent_damping")


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """The end of one level of the drive.

    drive: acceleration [m s-2]; stuck: nothing slipped; values: measures by name; errors: theirs, as far as they are
    known.
    """

    drive: float
    stuck: bool
    values: dict
    errors: dict


def bracket(levels) -> tuple | None:
    """Numbers of the last level that still held and of the first that slips, on the way up; None where none slips.

    -1 stands for the start.
    """
    for k, level in enumerate(levels):
        if not level.stuck:
            return k - 1, k
        if k + 1 < len(levels) and levels[k + 1].drive < level.drive:
            return None
    return None


def jump(levels, name: str = "relative_displacement_amplitude") -> tuple | None:
    """Largest change of a measure between neighbouring levels, up or down, over what the drive itself changed.

    Returns (drive of the level after it, factor, distance of the two levels); None with fewer than two levels that
    move.
    """
    found = []
    for a, b in pairwise(levels):
        if min(a.drive, b.drive, a.values[name], b.values[name]) > 0 and not (a.stuck or b.stuck):
            factor = (b.values[name] / a.values[name]) / (b.drive / a.drive)
            found.append((abs(np.log(factor)), b.drive, factor, abs(b.drive - a.drive)))
    return max(found)[1:] if found else None


def hysteresis(levels, name: str = "relative_displacement_amplitude") -> tuple | None:
    """Hysteresis of a measure between the upward and the downward series of levels, and its error.

    It is the largest difference at one drive that is passed both ways; None where no drive is.
    """
    drives = np.array([level.drive for level in levels])
    top = int(np.argmax(drives))
    back = {round(level.drive, 9): level for level in levels[top + 1:]}
    pairs = [(level, back[round(level.drive, 9)]) for level in levels[:top] if round(level.drive, 9) in back]
    if not pairs:
        return None
    gaps = [(abs(a.values[name] - b.values[name]), a.errors.get(name, 0.0) + b.errors.get(name, 0.0)) for a, b in pairs]
    return max(gaps)
