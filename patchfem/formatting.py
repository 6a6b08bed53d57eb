"""Formatting of numbers with readable units and with digits that match their errors.

All values with errors are formatted by this module. The last digit of a value is the second significant digit of its
error. A value whose first MAX_SIGNIFICANT_DIGITS digits are exact is displayed without an error, and a value below its
floor as 0.
"""

import math
import re
from math import isfinite, log10

DisplayUnit = tuple[str, float]  # name of a unit, and number of these in one SI unit
MAX_SIGNIFICANT_DIGITS = 7  # largest number of significant digits of a value
ZERO_ERROR_POWER = -400  # power of ten of a vanishing error, smaller than that of any float

UNIT_LADDERS = {  # display units (name, number of these in one SI unit) for each SI unit, in ascending order
    "m": (("nm", 1e9), ("um", 1e6), ("mm", 1e3), ("m", 1.0)),
    "s": (("us", 1e6), ("ms", 1e3), ("s", 1.0)),
    "rad": (("urad", 1e6), ("mrad", 1e3), ("rad", 1.0)),
    "Pa": (("Pa", 1.0), ("kPa", 1e-3), ("MPa", 1e-6), ("GPa", 1e-9)),
    "N": (("uN", 1e6), ("mN", 1e3), ("N", 1.0), ("kN", 1e-3), ("MN", 1e-6)),
    "J": (("nJ", 1e9), ("uJ", 1e6), ("mJ", 1e3), ("J", 1.0), ("kJ", 1e-3)),
    "N m": (("uN m", 1e6), ("mN m", 1e3), ("N m", 1.0), ("kN m", 1e-3)),
    "m N-1": (("um/N", 1e6),),
    "N m-1": (("N/m", 1.0), ("N/mm", 1e-3), ("N/um", 1e-6)),
    "N m rad-1": (("N m/rad", 1.0), ("kN m/rad", 1e-3), ("MN m/rad", 1e-6)),
    "m2": (("um^2", 1e12), ("mm^2", 1e6), ("m^2", 1.0)),
    "m3": (("um^3", 1e18), ("mm^3", 1e9), ("m^3", 1.0)),
    "Hz": (("Hz", 1.0), ("kHz", 1e-3)),
    "m s-2": (("g", 1 / 9.80665),),
    "W": (("uW", 1e6), ("mW", 1e3), ("W", 1.0), ("kW", 1e-3)),
}
# keys of UNIT_LADDERS by the name of the unit in a sentence
SENTENCE_UNITS = {unit: unit for unit in UNIT_LADDERS if "-" not in unit} | {"N/m": "N m-1"}
# Pattern of the units that sentences contain
_UNIT_PATTERN = "|".join(sorted(SENTENCE_UNITS, key=len, reverse=True))
# Pattern of a number with an exponent, and its unit
_POWER_PATTERN = re.compile(
    rf"(?<![\w./\"'-])(\d+\.?\d*e[-+]?\d+)(?![\w.])(?: ({_UNIT_PATTERN})(?![\w/^]))?"
)


def choose_unit(ladder: tuple[DisplayUnit, ...], size: float) -> DisplayUnit:
    """Choose the unit in which a number has few digits before and after the decimal point.

    Parameters
    ----------
    ladder : tuple
        Names and scales of units, an element of UNIT_LADDERS.
    size : float
        Magnitude of the number [SI].

    Returns
    -------
    DisplayUnit
        The unit in which the number is between 1 and 1000, or else the one in which it is the fewest powers of ten away
        from that; the smaller one of two.
    """
    if not size:
        return ladder[0]
    powers = [log10(abs(size)) + log10(scale) for _, scale in ladder]
    # A number that is rounded to 1000 belongs to the next unit.
    distances = [max(-power, power - 3 + 10.0**-MAX_SIGNIFICANT_DIGITS, 0.0) for power in powers]
    return ladder[distances.index(min(distances))]


def choose_axis_unit(values, unit: str) -> DisplayUnit:
    """Return the unit (name, scale) of an axis with given values [SI].

    `unit` is the SI unit of the values, a key of UNIT_LADDERS.
    """
    import numpy as np  # imported here because the verb `check` must not load numpy

    values = np.asarray(values)
    return choose_unit(UNIT_LADDERS[unit], np.abs(values[np.isfinite(values)]).max(initial=0.0))


def needs_log_scale(values) -> bool:
    """Return whether an axis with given values should be logarithmic.

    This is the case if no value is negative and the positive values span more than three decades.
    """
    import numpy as np

    values = np.asarray(values, float)
    positive = values[np.isfinite(values) & (values > 0)]
    return bool(positive.size and positive.max() > 1e3 * positive.min() and not np.any(values < 0))


def round_to_error(
    value: float | None,
    error: float | None = None,
    floor: float = 0.0,
    max_digits: int = MAX_SIGNIFICANT_DIGITS,
) -> tuple[str, str]:
    """Format a value and its error so that both end at the second digit of the error.

    Parameters
    ----------
    value : float or None
        Value to format; None is formatted as a dash.
    error : float or None
        Numerical error (half-width); None if it is unknown.
    floor : float
        Absolute floor of the measure; a smaller value is displayed as 0.
    max_digits : int
        Largest number of significant digits of the value.

    Returns
    -------
    tuple of str
        Value and error. The error is "" if it is unknown, or less than one unit of the last displayed digit.
    """
    if value is None:
        return "-", ""
    if not isfinite(value):
        return f"{value:g}", ""
    if abs(value) <= floor:
        return "0", format_number(error, 2) if error is not None and 0 < floor <= error else ""
    if error is None or not isfinite(error):
        # Number of significant digits of a value without a known error
        return format_number(value, 6), "" if error is None else f"{error:g}"
    if value == 0:
        return "0", format_number(error, 2) if error else ""

    # The last displayed digit is the second significant one of the error, unless the value would have too many digits
    value_power = math.floor(log10(abs(value)))
    last_power = _find_second_digit_power(error)
    if last_power < value_power - max_digits + 1:  # all displayed digits are exact
        first_exact_power = max(
            value_power - max_digits + 1,
            math.ceil(log10(error)) if error else ZERO_ERROR_POWER,
        )
        return format_number(round(value, -first_exact_power), max_digits), ""
    if _is_written_without_exponent(value_power) or _is_written_without_exponent(last_power + 1):
        return _format_to_digit(value, error, last_power)

    # One power of ten for both
    power = max(value_power, last_power + 1)
    mantissas = _format_to_digit(value / 10.0**power, error / 10.0**power, last_power - power)
    return tuple(f"{text}e{power}" for text in mantissas)


def format_number(value: float, digits: int) -> str:
    """Format a value with a number of significant digits, without trailing zeros."""
    if value == 0 or not isfinite(value):
        return "0" if value == 0 else f"{value:g}"
    rounded_value = float(f"{value:.{digits}g}")
    value_power = math.floor(log10(abs(rounded_value)))
    if not _is_written_without_exponent(value_power):
        mantissa, power = f"{rounded_value:.{digits - 1}e}".split("e")
        return f"{float(mantissa):g}e{int(power)}"
    text = f"{rounded_value:.{max(digits - 1 - value_power, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def choose_display_unit(value: float, unit: str, error: float | None = None) -> DisplayUnit:
    """Return the unit (name, scale) for the display of a value [SI] with its error.

    The name is "" for a value without a unit.
    """
    if unit not in UNIT_LADDERS:
        return ("" if unit == "1" else unit), 1.0
    if not isfinite(value):
        return choose_unit(UNIT_LADDERS[unit], 0.0)
    known_error = abs(error) if error is not None and isfinite(error) else 0.0
    return choose_unit(UNIT_LADDERS[unit], max(abs(value), known_error))


def format_value(
    value: float | None, error: float | None = None, floor: float = 0.0, unit: str = "1"
) -> str:
    """Format a value with its error in a readable unit, such as `14.808 ± 0.041 um`.

    Parameters
    ----------
    value : float or None
        Value [SI]; None is formatted as a dash.
    error : float or None
        Numerical error (half-width) [SI]; None if it is unknown.
    floor : float
        Absolute floor of the measure [SI]; a smaller value is displayed as 0.
    unit : str
        SI unit; "1" for none.

    Returns
    -------
    str
    """
    if value is None:
        return f"- {unit}".removesuffix(" 1")
    name, scale = choose_display_unit(value, unit, error)
    scaled_error = None if error is None else error * scale
    texts = round_to_error(value * scale, scaled_error, floor * scale)
    return format_with_error(*texts, name)


def format_with_error(value: str, error: str, unit: str) -> str:
    """Combine the strings of a value, its error and a unit, such as `(0.5 ± 1.0)e-8`.

    The strings come from `round_to_error`. A common power of ten is written only once.
    """
    if not error:
        return f"{value} {unit}".strip()
    mantissa, _, power = value.partition("e")
    error_mantissa, _, error_power = error.partition("e")
    text = f"{value} ± {error}"
    if power and power == error_power:
        text = f"({mantissa} ± {error_mantissa})e{power}"
    return f"{text} {unit}".strip()


def format_quantity(value: float, unit: str, digits: int, floor: float = 0.0) -> str:
    """Format a value without an error in a readable unit, such as `46.68 mJ`.

    Parameters
    ----------
    value : float
        Value [SI].
    unit : str
        SI unit.
    digits : int
        Number of significant digits.
    floor : float
        Largest magnitude of a value that is displayed as 0.

    Returns
    -------
    str
    """
    if not abs(value) > floor:
        return "0"
    name, scale = choose_display_unit(value, unit)
    return f"{format_number(value * scale, digits)} {name}".strip()


def format_length(length: float, digits: int = 4) -> str:
    """Format a length [m] with significant digits for a message, such as "200 um" or "12.7 mm"."""
    for unit, size in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
        if abs(length) >= size * (1 - 1e-9):
            return f"{format_number(length / size, digits)} {unit}"
    return f"{format_number(length / 1e-9, digits)} nm" if length else "0 um"


def rewrite_powers_of_ten(text: str) -> str:
    """Rewrite the numbers of a text with readable units, such as 302 nJ for 3.02e-07 J, and 6.35 mm for 0.00635 m."""

    def rewrite(match) -> str:
        """Return the readable form of a matched number with its unit."""
        number, unit = match.groups()
        digits = len(re.sub(r"[eE].*|\D", "", number))
        if unit is None:
            return format_number(float(number), digits)
        return format_quantity(float(number), SENTENCE_UNITS[unit], digits)

    text = _POWER_PATTERN.sub(rewrite, text)
    # Lengths below a metre without an exponent
    return re.sub(
        r"(?<![\w./\"'-])(-?0\.\d+) m(?![\w/^])",
        lambda match: format_length(float(match[1]), 9),
        text,
    )


def _is_written_without_exponent(power: int) -> bool:
    """Return whether a number with this power of ten is written without an exponent."""
    return -4 <= power < 7


def _find_second_digit_power(error: float) -> int:
    """Return the power of ten of the second significant digit of an error."""
    return int(f"{error:.1e}".split("e")[1]) - 1 if error else ZERO_ERROR_POWER


def _format_to_digit(value: float, error: float, last_power: int) -> tuple[str, str]:
    """Format a value and its error to a common last digit.

    `last_power` is the power of ten of the last digit. A value that is rounded to 0 has no sign.
    """
    n_decimals = max(-last_power, 0)
    formatted = [f"{round(number, -last_power) + 0.0:.{n_decimals}f}" for number in (value, error)]
    return formatted[0] if float(formatted[0]) else "0", formatted[1]
