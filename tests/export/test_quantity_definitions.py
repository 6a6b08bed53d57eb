"""Every quantity that an answer may have is defined, also with a prefix or the number of an interface."""

import pytest

from patchfem.export.answer import Quantity
from patchfem.export.quantities import describe_quantity, find_definition, format_quantity
from patchfem.measures.rows import MOTION_TABLE
from patchfem.runs.results.patch_rows import PATCH_TABLE


@pytest.mark.parametrize("name", [*MOTION_TABLE, *PATCH_TABLE])
def test_always_quantities_of_a_sweep_are_defined(name):
    """Extremes of a measure have its unit and text; their places and the limits of a key are defined on their own."""
    own = find_definition(name)
    for side in ("largest", "smallest"):
        assert find_definition(f"{side}_{name}") == own
        place = find_definition(f"place_of_{side}_{name}")
        assert place is not None and place != own
        assert describe_quantity(f"place_of_{side}_{name}") != ""
    assert describe_quantity(f"limit_{name}") != ""


@pytest.mark.parametrize(
    "quantity, text",
    [
        (Quantity(4.86e-6, "m", None, 4.34e-6, 5.159e-3), "4.86 um (4.34 um to 5.16 mm)"),
        (Quantity(3e-15, "m2 N-1", None, 1e-16, 4e-15), "3e-15 m^2/N (1e-16 to 4e-15)"),
        (Quantity(2.1e-6, "m", None, 1.8e-6, 2.6e-6), "2.10 um (1.80 to 2.60)"),
    ],
)
def test_exact_value_of_a_wide_interval_keeps_its_digits(quantity, text):
    """A value whose interval spans orders of magnitude is not rounded to 0 in the unit of the upper end."""
    assert format_quantity("amplitude_of_largest_damping", quantity) == text
