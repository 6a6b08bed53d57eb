"""Values of swept keys as they were written, without the digits that only a computer wrote."""

import re

from ..formatting import format_number

NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*)?\Z")
LONG = 9  # letters of a number from which on a range made it, not a person
MOST = 6  # digits of such a number at most
OFF = 0.05  # of the distance to the nearest other value, by which a value in a sentence may be off


def label(name: str) -> str:
    """A name of the program as people read it."""
    return name.replace("_", " ")


def brief(text: str) -> str:
    """A value as written, its number with six digits at most: 3.16227766016838e-06 rad is 3.16228e-06 rad."""
    return _short(text, MOST)


def resolved(text: str, value: float, apart: float) -> str:
    """A value as written, with as few digits as tell it from its neighbours: 3.16227766016838 urad between 1 urad and
    10 urad is 3.2 urad.

    value: the same in SI; apart: distance to the nearest other value, in SI.
    """
    for digits in range(2, MOST):
        short = _short(text, digits)
        if short == text:
            break
        number, near = (float(NUMBER.match(one)[1]) for one in (text, short))
        if abs((near - number) * value) <= abs(OFF * apart * number):
            return short
    return brief(text)


def bare(text: str, beside: str) -> str:
    """A value without its unit where the one beside it has the same: 0.1 beside 0.2 mrad."""
    number, _, unit = text.partition(" ")
    return number if unit and unit == beside.partition(" ")[2] else text


def _short(text: str, digits: int) -> str:
    found = NUMBER.match(text)
    if found is None or len(found[1]) < LONG:
        return text
    return f"{format_number(float(found[1]), digits)} {found[2] or ''}".strip()
