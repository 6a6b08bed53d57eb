"""When a motion under a periodic drive has become periodic, so that the rest of its cycles are as the last one.

It is looked at after APART cycles, then after twice as many each time. What it changed by between two looks, and
between the two before, tells what it will change by yet: less and less by the share by which the changes fell, as what
dies out does, or as much each time, as what creeps does. A period of two cycles shows in the last cycle alone.
"""

import numpy as np

APART = 4  # cycles after which a motion is first looked at


def looked_at(number: int) -> bool:
    """Whether a motion is looked at after this number of cycles."""
    return number >= APART and number & (number - 1) == 0


def until_look(number: int) -> int:
    """Cycles from the end of cycle `number` to the next look, or to one cycle before it."""
    at = APART
    while at <= number:
        at *= 2
    return max(at - 1 - number, 1)


def ahead(change: float, before: float, left: int, far: int) -> float:
    """What a motion will change by in `left` cycles, over its size as the changes are.

    change: between the last two looks, the last one after `far` cycles; before: between the two looks before.
    """
    if before == 0.0:
        return change * max(1.0, 2 * left / far)
    fell = (
        np.sqrt(1 + 4 * change / before) - 1
    ) / 2  # a + a^2 = change/before of what dies out by a
    return change * max(1.0, min(fell**2 / (1 - fell**2) if fell < 1 else np.inf, 2 * left / far))
