"""Printed numbers: a value read back from its text lies within the printed error."""

import re

import numpy as np
import pytest

from patchfem.export.quantities import DISPLAY_UNIT_LADDERS
from patchfem.formatting import (
    MAX_SIGNIFICANT_DIGITS,
    UNIT_LADDERS,
    choose_unit,
    format_value,
    rewrite_powers_of_ten,
)

SCALE = {name: 1 / scale for ladder in UNIT_LADDERS.values() for name, scale in ladder}
UGLY = re.compile(r"± 0(?![.\d])|(?<![\d.])-0(?![.\d])|\de[-+]?0|nan|inf|\d\.\d{11}")


def random_values() -> list:
    """Return 300 random (value, error, unit): sizes over twelve decades, errors from round-off to many times the value."""
    rng = np.random.default_rng(7)
    units = [*UNIT_LADDERS, "1"]
    out = []
    for _ in range(300):
        unit = units[rng.integers(len(units))]
        low, high = (
            (1.0, 1.0)
            if unit == "1"
            else (SCALE[UNIT_LADDERS[unit][0][0]], SCALE[UNIT_LADDERS[unit][-1][0]])
        )
        value = rng.choice([-1, 1]) * 10 ** rng.uniform(np.log10(low) - 2, np.log10(high) + 2)
        out.append((value, abs(value) * 10 ** rng.uniform(-16, 4), unit))
    return out


def parse_printed(text: str) -> tuple:
    """Return value, error (0 if absent) and unit of the last digit of a printed number, in SI units."""
    value, bar, unit = re.fullmatch(r"(\S+)(?: ± (\S+))?(?: (.+))?", text).groups()
    scale = SCALE[unit] if unit else 1.0
    mantissa, _, power = value.partition("e")
    last = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
    return float(value) * scale, float(bar or 0) * scale, last * scale


def test_always_printed_value_lies_within_printed_error():
    """The printed value of 300 random numbers lies within the printed error of the true one.

    An error that is not printed is less than the last digit.
    """
    bars = 0
    for value, bar, unit in random_values():
        text = format_value(value, bar, 0.0, unit)
        assert not UGLY.search(text), text
        printed, printed_bar, last_digit = parse_printed(text)
        if printed_bar:
            bars += 1
            assert abs(printed - value) <= printed_bar and abs(printed_bar - bar) <= 0.0501 * bar, (
                text,
                value,
                bar,
            )
        else:
            assert bar <= 1.5e-5 * abs(value), (text, value, bar)
            digits = len(re.sub(r"e.*|\D", "", text.split(" ")[0]).lstrip("0"))
            assert digits <= MAX_SIGNIFICANT_DIGITS and abs(printed - value) <= max(
                0.501 * last_digit, 1e-13 * abs(value)
            ), (text, value, bar)
            assert bar <= last_digit or digits < MAX_SIGNIFICANT_DIGITS, (text, value, bar)
        assert unit == "1" or "e" not in text.split(" ")[0], text
    assert bars > 100


@pytest.mark.parametrize("unit", DISPLAY_UNIT_LADDERS)
def test_exact_number_is_between_1_and_1000_wherever_a_unit_of_the_ladder_exists(unit):
    """Over a ladder the number has one to three digits before the point, or the fewest digits that a unit allows."""
    ladder = DISPLAY_UNIT_LADDERS[unit]
    scales = [scale for _, scale in ladder]
    for size in np.geomspace(1e-3 / scales[0], 1e6 / scales[-1], 1999):
        _, scale = choose_unit(ladder, size)
        number = size * scale
        others = [size * other for other in scales]
        if any(1 <= other < 999.9999 for other in others):
            assert 1 - 1e-6 <= number < 1000
        # Without such a unit, the number is the nearest to 1 from below or to 1000 from above.
        assert (
            max(1 / number, number / 1000)
            < 1.000001 * min(max(1 / other, other / 1000) for other in others)
            or 1 <= number < 1000
        )


@pytest.mark.parametrize(
    "volume, text",
    [
        (6.9392e-12, "0.0069392 mm^3"),  # a scar of a fretting test
        (3.2e-17, "32 um^3"),
        (4e-16, "400 um^3"),
        (2.5e-8, "25 mm^3"),
    ],
)
def test_exact_volume_is_written_with_few_digits(volume, text):
    """Volumes between units stand in the nearer one."""
    assert format_value(volume, None, 0.0, "m3") == text


@pytest.mark.parametrize(
    "value, error, least, unit, text",
    [
        (1.48083e-5, 4.4e-8, 0.0, "m", "14.808 ± 0.044 um"),
        (2000.0, 2e-6, 0.0, "N", "2 kN"),
        (1e-4, 1e-13, 0.0, "rad", "100 urad"),  # a load and a tilt as given
        (-5e-15, 8.3e-4, 1e-10, "N m", "0 ± 830 uN m"),
        (-4e-21, 2e-14, 1e-11, "m", "0 nm"),
        (6e-11, 2.2e-10, 1e-11, "m", "0.06 ± 0.22 nm"),  # open, but larger than the floor
        (3.2e-11, 1e-20, 1e-10, "J", "0 nJ"),
        (2.833e-16, 8.7e-18, 1e-10, "m", "0 nm"),
        (5.4e-8, 5e-17, 1e-6, "1", "0"),
        (5e-4, 2e-3, 1e-3, "1", "0 ± 0.002"),
        (2.34e-5, 1e-6, 0.0, "1", "(2.34 ± 0.10)e-5"),
        (5.3907e8, 1.7e6, 0.0, "N m-1", "539.1 ± 1.7 N/um"),
        (1.0, 0.0996, 0.0, "1", "1.00 ± 0.10"),
        (3.0, None, 0.0, "N", "3 N"),
        (None, None, 0.0, "N", "- N"),
    ],
)
def test_exact_value_with_error_is_formatted(value, error, least, unit, text):
    """A value with its error is printed with a suitable unit prefix and number of digits."""
    assert format_value(value, error, least, unit) == text


@pytest.mark.parametrize(
    "text, tidy",
    [
        ("carries 1.1e+02 % of it", "carries 110 % of it"),
        ("created 3.02e-07 J per cycle", "created 302 nJ per cycle"),
        ("accuracy.tolerance = 1e-05 refines it", "accuracy.tolerance = 1e-5 refines it"),
        ("at 5e-06 m/s", "at 5e-6 m/s"),
        ("K of 4.25e+06 N/m, 2e-05 N m", "K of 4.25 N/um, 20 uN m"),
        ("run_1e-05.csv: 3e5", "run_1e-05.csv: 300000"),
        ('set it to "1e-05 m"', 'set it to "1e-05 m"'),
        ("out/1e-05 and .1e-05", "out/1e-05 and .1e-05"),
        ("|offset| < length/2 = 0.00635 m is needed", "|offset| < length/2 = 6.35 mm is needed"),
        ("x = -0.00123456 m, 0.05 N m", "x = -1.23456 mm, 0.05 N m"),
        ('"0.01 m", 0.5 m/s, 0.001 m^2', '"0.01 m", 0.5 m/s, 0.001 m^2'),
    ],
)
def test_exact_powers_of_ten_become_unit_prefixes(text, tidy):
    """Powers of ten in a sentence are replaced by unit prefixes."""
    assert rewrite_powers_of_ten(text) == tidy
