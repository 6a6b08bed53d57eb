"""When a motion under a periodic drive has become periodic.

From there on the remaining cycles equal the last one.

The motion is looked at after APART cycles, then after twice as many each time. Its changes between
three looks bound what it would still change by: the changes decrease by a constant factor, as of a
motion that dies out, or stay equal, as of one that creeps. A period of two cycles shows in the
last cycle alone.
"""

import numpy as np

APART = 4  # cycles after which a motion is first looked at


def looked_at(number: int) -> bool:
    """Return whether a motion is looked at after this number of cycles."""
    return number >= APART and number & (number - 1) == 0


def until_look(number: int) -> int:
    """Return the cycles from the end of cycle `number` to the next look, or one before it."""
    at = APART
    while at <= number:
        at *= 2
    return max(at - 1 - number, 1)


def ahead(change: float, before: float, left: int, far: int) -> float:
    """Return what a motion would still change by in `left` cycles.

    Parameters
    ----------
    change, before : float
        Relative changes between the last two looks, and between the two before.
    left : int
    far : int
        Cycles after which the last look was.

    Returns
    -------
    float
    """
    if before == 0.0:
        return change * max(1.0, 2 * left / far)
    fell = (
        np.sqrt(1 + 4 * change / before) - 1
    ) / 2  # a + a^2 = change/before of what dies out by a
    return change * max(1.0, min(fell**2 / (1 - fell**2) if fell < 1 else np.inf, 2 * left / far))
