"""Units in which people read a number, chosen by its size."""

import numpy as np

LADDERS = {  # from the smallest unit up: (name, what one SI unit is in it)
    "m": (("nm", 1e9), ("um", 1e6), ("mm", 1e3), ("m", 1.0)),
    "s": (("us", 1e6), ("ms", 1e3), ("s", 1.0)),
    "rad": (("urad", 1e6), ("mrad", 1e3), ("rad", 1.0)),
    "Pa": (("Pa", 1.0), ("kPa", 1e-3), ("MPa", 1e-6), ("GPa", 1e-9)),
    "N": (("uN", 1e6), ("mN", 1e3), ("N", 1.0), ("kN", 1e-3)),
    "J": (("nJ", 1e9), ("uJ", 1e6), ("mJ", 1e3), ("J", 1.0)),
    "N m": (("uN m", 1e6), ("mN m", 1e3), ("N m", 1.0)),
    "N m-1": (("N/m", 1.0), ("N/mm", 1e-3), ("N/um", 1e-6)),
    "m3": (("um^3", 1e18), ("mm^3", 1e9)),
}


def step_of(ladder: tuple, size: float) -> tuple:
    """Unit (name, scale) of a ladder of LADDERS: the smallest in which `size` [SI] stays below 1000."""
    for name, scale in ladder:
        if abs(size) * scale < 1000:
            return name, scale
    return ladder[-1]


def axis_unit(values, unit: str) -> tuple:
    """Unit (name, scale) of an axis that shows `values` [SI]: finite values times scale are in that unit.

    unit: a key of LADDERS.
    """
    values = np.asarray(values)
    return step_of(LADDERS[unit], np.abs(values[np.isfinite(values)]).max(initial=0.0))


def wide_scale(values) -> bool:
    """Whether an axis of these values is better logarithmic: the smallest above 0 is under a thousandth of the
    largest, and none is negative."""
    values = np.asarray(values, float)
    above = values[np.isfinite(values) & (values > 0)]
    return bool(above.size and above.max() > 1e3 * above.min() and not np.any(values < 0))
