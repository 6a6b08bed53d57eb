"""Schedule of the checks whether a motion has become periodic, and their error bound.

The remaining cycles of a periodic motion equal the last one and need not be computed.

The motion is checked after FIRST_CHECK cycles, then after twice as many each time. The changes
between three checks bound the change in the remaining cycles: either the changes decrease by a
constant factor, as in a decaying transient, or they stay equal, as in a ratchetting motion. A period
of two cycles shows only in the change over the last cycle.
"""

import numpy as np

# Number of cycles before the first check; the later checks are at 8, 16, 32, ... cycles.
FIRST_CHECK = 4


def is_check_cycle(n_cycles: int) -> bool:
    """Return whether the motion is checked for periodicity at the end of this cycle."""
    return n_cycles >= FIRST_CHECK and n_cycles & (n_cycles - 1) == 0


def cycles_to_next_check(n_cycles: int) -> int:
    """Return the number of cycles from now to one cycle before the next periodicity check."""
    check = FIRST_CHECK
    while check <= n_cycles:
        check *= 2
    return max(check - 1 - n_cycles, 1)


def bound_remaining_change(
    change: float, previous_change: float, n_remaining: int, n_checked: int
) -> float:
    """Return a bound of the relative change that a marched motion undergoes in its remaining cycles.

    Parameters
    ----------
    change, previous_change : float
        Relative changes between the last two checks, and between the two checks before.
    n_remaining : int
        Number of remaining cycles.
    n_checked : int
        Number of cycles at the last check.

    Returns
    -------
    float
    """
    creep = 2 * n_remaining / n_checked
    if previous_change == 0.0:
        return change * max(1.0, creep)
    # A decay by the factor a per half of the interval gives a + a^2 = change/previous_change.
    factor = (np.sqrt(1 + 4 * change / previous_change) - 1) / 2
    decay = factor**2 / (1 - factor**2) if factor < 1 else np.inf
    return change * max(1.0, min(decay, creep))
