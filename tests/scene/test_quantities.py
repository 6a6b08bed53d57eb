"""The table of units: exact values, exact round trips, and refusals with an example of a valid quantity."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.scene import UNIT_FACTORS, parse_quantity
from patchfem.scene.keys.quantities import EXAMPLE_QUANTITIES, format_si


@pytest.mark.parametrize(
    "text, kind, value",
    [
        ("12.7 mm", "length", 0.0127),
        ("1 µm", "length", 1e-6),
        ("1 μm", "length", 1e-6),
        (".5 mm", "length", 5e-4),
        ("  3   nm ", "length", 3e-9),
        ("1 lbf", "force", 4.4482216152605),
        ("5 g", "acceleration", 49.03325),
        ("5 g", "mass", 0.005),
        ("180 deg", "angle", math.pi),
        ("1 µrad", "angle", 1e-6),
        *(
            (f"1e-5 {unit}", "wear coefficient", 1e-14)
            for unit in ("mm^3/Nm", "mm3/Nm", "mm^3/N/m", "mm³/Nm")
        ),
        ("1 1/MPa", "wear coefficient", 1e-6),
        ("0.05 N·m", "moment", 0.05),
    ],
)
def test_exact_quantity_values(text, kind, value):
    """Quantities with units are converted to exact SI values."""
    assert parse_quantity(text, kind) == value


def test_exact_imperial_units_agree_with_definitions():
    """Imperial units agree exactly with their definitions by pound, inch and standard gravity."""
    pound = Fraction("0.45359237")
    inch = Fraction("0.0254")
    gravity = Fraction("9.80665")
    assert parse_quantity("1 lbf", "force") == float(pound * gravity)
    assert parse_quantity("1 lbf/in", "stiffness") == float(pound * gravity / inch)
    assert parse_quantity("1 lbf in", "moment") == float(pound * gravity * inch)
    assert parse_quantity("1 lbf ft", "moment") == float(pound * gravity * inch * 12)
    assert parse_quantity("1 psi", "pressure") == float(pound * gravity / inch**2)
    assert parse_quantity("1 ksi", "pressure") == float(1000 * pound * gravity / inch**2)
    assert parse_quantity("1 Msi", "pressure") == float(10**6 * pound * gravity / inch**2)
    assert parse_quantity("1 lb/in^3", "density") == float(pound / inch**3)


@pytest.mark.parametrize("unit", UNIT_FACTORS["length"])
def test_exact_conversion_rounds_once(unit):
    """The conversion of 300 random numbers rounds once, as exact fractions show."""
    for number in np.random.default_rng(7).lognormal(0, 20, 300).tolist():
        exact = Fraction(repr(number)) * Fraction(repr(UNIT_FACTORS["length"][unit]))
        assert parse_quantity(f"{number!r} {unit}", "length") == float(exact)


@pytest.mark.parametrize("kind", UNIT_FACTORS)
def test_exact_every_kind_has_its_si_unit_first_and_a_valid_example(kind):
    """Every kind of quantity has its SI unit first and a valid example."""
    assert next(iter(UNIT_FACTORS[kind].values())) == 1.0
    assert parse_quantity(EXAMPLE_QUANTITIES[kind], kind) > 0.0


# digits, signs, units and characters that resemble them; all of Unicode takes seconds to prepare
CHARACTERS = "0123456789+-.,eE_ ±%/*^²³·µμ°kmunNsgHzPaJrdlbfi٣½\x00\n\ud7ff"


@given(
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from([k for k in UNIT_FACTORS if k != "temperature"]),
)
def test_always_si_text_round_trip_is_exact(value, kind):
    """A value written in SI units is read back as the same floating-point number."""
    assert parse_quantity(format_si(value, kind), kind) == value


@given(st.text(CHARACTERS, max_size=40), st.sampled_from(list(UNIT_FACTORS)))
def test_always_parser_returns_finite_or_raises_value_error(text, kind):
    """Any text gives a finite number or a ValueError with a message."""
    try:
        assert math.isfinite(parse_quantity(text, kind))
    except ValueError as error:
        assert str(error)


@pytest.mark.parametrize(
    "text, kind, says",
    [
        (
            5,
            "force",
            "a bare number without a unit; a force with its unit is needed, such as '26 lbf'",
        ),
        (True, "force", "not a quantity"),
        ("26 lb", "force", "did you mean 'lbf'"),
        ("0,5 mm", "length", "has a comma: use a point as the decimal separator"),
        ("12 mm ± 0.1", "length", "has a tolerance"),
        ("1e-5 mm³/N·m", "wear coefficient", "'mm³/N·m' is ambiguous"),
        (
            "3 Ra",
            "length",
            "unknown unit 'Ra' for a length; use one of m, km, cm, mm, um, nm, in, ft, mil",
        ),
        (
            "6 mil",
            "force",
            "'mil' is a unit of length, but a force is needed; use one of N, kN, lbf, kgf",
        ),
        ("4 g", "length", "'g' is a unit of mass or acceleration, but a length is needed"),
        ("nan mm", "length", "not a finite number"),
        ("1e999 m", "length", "too large"),
        ("1e-999 m", "length", "too small"),
        ("12mm", "length", "write '12 mm'"),
        ("12 13 mm", "length", "unknown unit '13 mm'"),
        ("1_000 mm", "length", "does not consist of one number and one unit"),
        ("٣ mm", "length", "does not consist of one number and one unit"),
        ("1" * 5000 + " mm", "length", "does not consist of one number and one unit"),
        ("20 degC", "temperature", "temperatures must be absolute"),
        ("20 °C", "temperature", "'293.15 K'"),
        ("-1 K", "temperature", "below 0 K"),
    ],
)
def test_refuses_ambiguous_or_wrong_units(text, kind, says):
    """Missing, ambiguous or wrong units are refused with an example of a valid quantity."""
    with pytest.raises(ValueError) as caught:
        parse_quantity(text, kind)
    assert says in str(caught.value)
    assert EXAMPLE_QUANTITIES[kind] in str(caught.value)
    assert len(str(caught.value)) < 400
