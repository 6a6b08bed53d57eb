"""Whether the interfaces of a run stick.

In: the window of a run. Out: slips of its interfaces, and whether all of them stick.
"""

import numpy as np

from .measures import slip_round_off


def list_slips(response) -> np.ndarray:
    """Return the slip (k, i) [m] of each interface."""
    extra = response.extra
    if "slides" in extra:
        return extra.get("slips", extra["slides"])
    return response.slip[:, None]


def is_all_stuck(window, max_stick_slip: float) -> bool:
    """Return whether no interface or strip slips by more than a given distance [m] in a window.

    The limit applies to half the range of the slip, and is at least its round-off.
    """
    slips = np.column_stack([window.slip, list_slips(window)])
    return bool(np.ptp(slips, axis=0).max() / 2 <= max(max_stick_slip, slip_round_off(window)))
