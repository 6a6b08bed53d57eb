"""Test whether a motion under a periodic drive has become periodic.

The remaining cycles are then equal to the last one.

The motion is checked after APART cycles, then after twice as many each time. The changes between
three checks bound the change in the remaining cycles: the changes either decrease by a constant
factor, as in a decaying transient, or stay equal, as in a creeping motion. A period of two cycles
shows only in the change over the last cycle.
"""

import numpy as np

APART = 4  # cycles after which a motion is first checked


def looked_at(number: int) -> bool:
    """Return whether a motion is checked after this number of cycles."""
    return number >= APART and number & (number - 1) == 0


def until_look(number: int) -> int:
    """Return the cycles from the end of cycle `number` to one cycle before the next check."""
    at = APART
    while at <= number:
        at *= 2
    return max(at - 1 - number, 1)


def ahead(change: float, before: float, left: int, far: int) -> float:
    """Return a bound of the change of a motion in the remaining `left` cycles.

    Parameters
    ----------
    change, before : float
        Relative changes between the last two checks, and between the two before.
    left : int
    far : int
        Number of cycles at the last check.

    Returns
    -------
    float
    """
    if before == 0.0:
        return change * max(1.0, 2 * left / far)
    fell = (
        np.sqrt(1 + 4 * change / before) - 1
    ) / 2  # a + a^2 = change/before for a decay by the factor a
    return change * max(1.0, min(fell**2 / (1 - fell**2) if fell < 1 else np.inf, 2 * left / far))
