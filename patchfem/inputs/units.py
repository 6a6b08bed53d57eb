"""Units of the quantities in files of measurements, and their factors to SI: those of a scene.

Every table maps a quantity to its units, and each unit to its factor; the unit "" stands for a column
without a unit.
"""

import re
from collections.abc import Mapping

from ..exceptions import PatchfemError
from ..scene.keys import quantities
from ..scene.keys.quantities import UNIT_FACTORS
from .damage import shorten

# Factors of the units of a ratio, such as a damping ratio
RATIO_UNITS = {"": 1.0, "1": 1.0, "%": 0.01}
# Factors to SI by unit, for each quantity of a channel. A reader ignores those that it does not need.
CHANNEL_UNITS = {
    "time": UNIT_FACTORS["time"],
    "displacement": UNIT_FACTORS["length"],
    "velocity": UNIT_FACTORS["velocity"],
    "acceleration": UNIT_FACTORS["acceleration"],
    "base_acceleration": UNIT_FACTORS["acceleration"],
    "force": UNIT_FACTORS["force"],
    "friction_ratio": RATIO_UNITS,
}
# The SI unit is the first one of each table that is not "".
SI_UNITS = {name: next(filter(None, units)) for name, units in CHANNEL_UNITS.items()}
# Spellings of "per second squared" and of "per second" at the end of a unit.
_RATE_PATTERNS = {
    "/s^2": re.compile(r" ?/ ?s(?:ec)?(?:\^|\*\*)?2$| s\^?-2$"),
    "/s": re.compile(r" ?/ ?s(?:ec)?$| s\^?-1$"),
}


def normalize_unit(text: str) -> str:
    """Spell the text of a unit as the tables do: "m/s2" and "m s-2" become "m/s^2", "µm" becomes "um"."""
    text = quantities.normalize_unit(text)
    text = {"sec": "s", "seconds": "s", "newton": "N", "newtons": "N"}.get(text.lower(), text)
    for ending, pattern in _RATE_PATTERNS.items():
        text = pattern.sub(ending, text)
    return text


def find_unit_factor(
    quantity: str, unit: str, location: str, units: Mapping[str, float] | None = None
) -> float:
    """Return the factor that converts a quantity from a unit to SI.

    Parameters
    ----------
    quantity : str
        Name for the error message; without `units`, key of `CHANNEL_UNITS`.
    unit : str
        Unit in any spelling that `normalize_unit` knows.
    location : str
        Beginning of the error message.
    units : Mapping, optional
        Factors to SI by unit; default: those of the quantity in `CHANNEL_UNITS`.

    Returns
    -------
    float

    Raises
    ------
    PatchfemError
        If the quantity does not have this unit.
    """
    units = units or CHANNEL_UNITS[quantity]
    name = normalize_unit(unit)
    if name not in units:
        raise PatchfemError(
            f"{location}{quantity} [{shorten(unit)}]: unknown unit; use one of {', '.join(filter(None, units))}"
        )
    return units[name]
