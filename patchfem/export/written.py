"""Values of swept keys as text, with no more digits than a reader needs."""

import re

from ..formatting import format_number

NUMBER_PATTERN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*)?\Z")
MIN_LONG_NUMBER = 9  # smallest number of characters of a number that counts as computed, not typed
MAX_DIGITS = 6  # largest number of significant digits of a shortened number
# Largest error of a shortened number, relative to the distance to the nearest other value.
MAX_ERROR_FRACTION = 0.05


def measure_label(name: str) -> str:
    """Return the name of a measure or outcome as words."""
    return name.replace("_", " ")


def shorten_number(text: str) -> str:
    """Return a value as it is written in the scene, with at most six digits.

    For example, 3.16227766016838e-06 rad becomes 3.16228e-06 rad.
    """
    return _round_long_number(text, MAX_DIGITS)


def shorten_to_spacing(text: str, value: float, spacing: float) -> str:
    """Return a value as written, shortened to the digits that distinguish it from its neighbours.

    For example, 3.16227766016838 urad between 1 urad and 10 urad becomes 3.2 urad.

    Parameters
    ----------
    text : str
        The value as written.
    value : float
        The value in SI.
    spacing : float
        Distance to the nearest other value [SI].
    """
    for digits in range(2, MAX_DIGITS):
        shortened = _round_long_number(text, digits)
        if shortened == text:
            break
        number, rounded_number = (
            float(NUMBER_PATTERN.match(written)[1]) for written in (text, shortened)
        )
        if abs((rounded_number - number) * value) <= abs(MAX_ERROR_FRACTION * spacing * number):
            return shortened
    return shorten_number(text)


def drop_repeated_unit(text: str, next_text: str) -> str:
    """Remove the unit of a value if the next value has the same unit: 0.1 before 0.2 mrad."""
    number, _, unit = text.partition(" ")
    return number if unit and unit == next_text.partition(" ")[2] else text


def _round_long_number(text: str, digits: int) -> str:
    """Round a number that is written with many digits."""
    match = NUMBER_PATTERN.match(text)
    if match is None or len(match[1]) < MIN_LONG_NUMBER:
        return text
    return f"{format_number(float(match[1]), digits)} {match[2] or ''}".strip()
