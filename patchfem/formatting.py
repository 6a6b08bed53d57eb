"""Numbers as people read them: the unit by its size, the digits by its numerical error.

The one place where a value and its error become text. A number ends at the second digit of its error; one that is
known to more than MOST digits, or to all of them, stands without an error; what is 0 within its floor is 0.
"""

import re
from itertools import pairwise
from math import ceil, floor, isfinite, log10

MAX_DIGITS = 7  # digits of a value in a text; what its error changes beyond them nobody reads
DIGITS_WITHOUT_ERROR = 6  # digits of a value whose error is not known
# of its floor, below which a number with a unit, and a ratio, is round-off however well known
ROUND_OFF = (
    1e-6,
    0.1,
)
KNOWN = 0.1  # share of a value, above which an error leaves one below its floor open
PLAIN = -4, 7  # powers of ten between which a number without a fitting unit needs none

UNIT_LADDERS = {  # from the smallest unit up: (name, what one SI unit is in it)
    "m": (("nm", 1e9), ("um", 1e6), ("mm", 1e3), ("m", 1.0)),
    "s": (("us", 1e6), ("ms", 1e3), ("s", 1.0)),
    "rad": (("urad", 1e6), ("mrad", 1e3), ("rad", 1.0)),
    "Pa": (("Pa", 1.0), ("kPa", 1e-3), ("MPa", 1e-6), ("GPa", 1e-9)),
    "N": (("uN", 1e6), ("mN", 1e3), ("N", 1.0), ("kN", 1e-3), ("MN", 1e-6)),
    "J": (("nJ", 1e9), ("uJ", 1e6), ("mJ", 1e3), ("J", 1.0), ("kJ", 1e-3)),
    "N m": (("uN m", 1e6), ("mN m", 1e3), ("N m", 1.0), ("kN m", 1e-3)),
    "N m-1": (("N/m", 1.0), ("N/mm", 1e-3), ("N/um", 1e-6)),
    "N m rad-1": (("N m/rad", 1.0), ("kN m/rad", 1e-3), ("MN m/rad", 1e-6)),
    "m2": (("um^2", 1e12), ("mm^2", 1e6), ("m^2", 1.0)),
    "m3": (("um^3", 1e18), ("mm^3", 1e9)),
    "Hz": (("Hz", 1.0), ("kHz", 1e-3)),
    "m s-2": (("g", 1 / 9.80665),),
    "W": (("uW", 1e6), ("mW", 1e3), ("W", 1.0), ("kW", 1e-3)),
}
# units as sentences write them
SENTENCE_UNITS = {unit: unit for unit in UNIT_LADDERS if "-" not in unit} | {"N/m": "N m-1"}
_UNITS = "|".join(sorted(SENTENCE_UNITS, key=len, reverse=True))
_POWER = re.compile(rf"(?<![\w./\"'-])(\d+\.?\d*e[-+]?\d+)(?![\w.])(?: ({_UNITS})(?![\w/^]))?")


def choose_unit(ladder: tuple, size: float) -> tuple:
    """Unit (name, scale) of a ladder of LADDERS: the smallest in which `size` [SI] stays below 1000, or in whose next
    one it would be less than a thousandth."""
    for (name, scale), (_, larger) in pairwise(ladder):
        if abs(size) * scale < 1000 or abs(size) * larger < 1e-3:
            return name, scale
    return ladder[-1]


def axis_unit(values, unit: str) -> tuple:
    """Unit (name, scale) of an axis that shows `values` [SI]: finite values times scale are in that unit.

    unit: a key of LADDERS.
    """
    import numpy as np  # sentences of `check` have no arrays

    values = np.asarray(values)
    return choose_unit(UNIT_LADDERS[unit], np.abs(values[np.isfinite(values)]).max(initial=0.0))


def needs_log_scale(values) -> bool:
    """Whether an axis of these values is better logarithmic: the smallest above 0 is under a thousandth of the
    largest, and none is negative."""
    import numpy as np

    values = np.asarray(values, float)
    above = values[np.isfinite(values) & (values > 0)]
    return bool(above.size and above.max() > 1e3 * above.min() and not np.any(values < 0))


def round_to_error(
    value: float | None, error: float | None = None, least: float = 0.0, ratio: bool = False
) -> tuple:
    """Value and error as texts that end at the same digit, the second of the error.

    least: the floor of the measure, below which a value that its error leaves open, and round-off whatever its error,
    is 0, with its error where that is the floor; ratio: it has no unit, so that its floor is the same in a large rig
    and a small one. A dash stands for no value. No error stands beside a value whose digits are all known, to one unit
    of the last, and beside one whose error is not known.
    """
    if value is None:
        return "-", ""
    if not isfinite(value):
        return f"{value:g}", ""
    if _is_zero(value, error, least, ratio):
        return "0", format_number(error, 2) if error is not None and 0 < least <= error else ""
    if error is None or not isfinite(error):
        return format_number(value, DIGITS_WITHOUT_ERROR), "" if error is None else f"{error:g}"
    if value == 0:
        return "0", format_number(error, 2) if error else ""
    size, second = floor(log10(abs(value))), _second(error)
    if second < size - MAX_DIGITS + 1:  # all that is shown is known
        last = max(size - MAX_DIGITS + 1, ceil(log10(error)) if error else -400)
        return format_number(round(value, -last), MAX_DIGITS), ""
    if not PLAIN[0] <= size < PLAIN[1] and not PLAIN[0] <= second + 1 < PLAIN[1]:
        power = max(size, second + 1)
        return tuple(
            f"{one}e{power}"
            for one in _ends(value / 10.0**power, error / 10.0**power, second - power)
        )
    return _ends(value, error, second)


def format_number(value: float, digits: int) -> str:
    """A number with so many digits and no zeros behind them; a power of ten only where it is very large or small."""
    if value == 0 or not isfinite(value):
        return "0" if value == 0 else f"{value:g}"
    short = float(f"{value:.{digits}g}")
    size = floor(log10(abs(short)))
    if not PLAIN[0] <= size < PLAIN[1]:
        number, power = f"{short:.{digits - 1}e}".split("e")
        return f"{float(number):g}e{int(power)}"
    text = f"{short:.{max(digits - 1 - size, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def display_unit(value: float, unit: str, error: float | None = None) -> tuple:
    """Unit (name, scale) in which a person reads a value [SI] with its error, by the larger of both; "" for none."""
    error = error if error is not None and isfinite(error) else 0.0
    size = max(abs(value), abs(error)) if isfinite(value) else 0.0
    return (
        choose_unit(UNIT_LADDERS[unit], size)
        if unit in UNIT_LADDERS
        else ("" if unit == "1" else unit, 1.0)
    )


def format_value(
    value: float | None, error: float | None = None, least: float = 0.0, unit: str = "1"
) -> str:
    """A value with its error and floor [SI] in the unit that people read, such as `14.808 ± 0.041 um`."""
    if value is None:
        return f"- {unit}".removesuffix(" 1")
    name, scale = display_unit(value, unit, error)
    return join_error(
        *round_to_error(
            value * scale, None if error is None else error * scale, least * scale, unit == "1"
        ),
        name,
    )


def join_error(value: str, error: str, unit: str) -> str:
    """A value and its error, as `rounded` writes them, as one text with a unit; a power of ten that both have stands
    once: `(0.5 ± 1.0)e-8`."""
    if not error:
        return f"{value} {unit}".strip()
    (first, power), (second, other) = (one.partition("e")[::2] for one in (value, error))
    both = f"({first} ± {second})e{power}" if power and power == other else f"{value} ± {error}"
    return f"{both} {unit}".strip()


def format_quantity(value: float, unit: str, digits: int, least: float = 0.0) -> str:
    """A value [SI] with so many digits in the unit that people read, 0 below its floor: `46.68 mJ`."""
    name, scale = display_unit(value, unit)
    return f"{format_number(value * scale, digits)} {name}".strip() if abs(value) > least else "0"


def rewrite_powers_of_ten(text: str) -> str:
    """A sentence whose powers of ten are written as people write them: 1.1e+02 % is 110 %, 3.02e-07 J is 302 nJ."""

    def one(found) -> str:
        digits, unit = len(re.sub(r"[eE].*|\D", "", found[1])), found[2]
        return (
            f"{format_number(float(found[1]), digits)}"
            if unit is None
            else format_quantity(float(found[1]), SENTENCE_UNITS[unit], digits)
        )

    return _POWER.sub(one, text)


def _is_zero(value: float, error: float | None, least: float, ratio: bool) -> bool:
    """Whether nothing of a value is told from 0: it and its error lie below its floor, and it is open or round-off."""
    if abs(value) > least or (error or 0.0) > least:
        return False
    return error is None or error > KNOWN * abs(value) or abs(value) <= ROUND_OFF[ratio] * least


def _second(error: float) -> int:
    """The power of ten of the second digit of an error, rounded to two; far below any other for none."""
    return int(f"{error:.1e}".split("e")[1]) - 1 if error else -400


def _ends(value: float, error: float, last: int) -> tuple:
    """Both as texts that end at the digit of the power of ten `last`, a zero without a sign."""
    texts = [f"{round(one, -last) + 0.0:.{max(-last, 0)}f}" for one in (value, error)]
    return texts[0] if float(texts[0]) else "0", texts[1]
