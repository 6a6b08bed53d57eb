"""Every quantity that an answer may have is defined, also with a prefix or the number of an interface."""

import pytest

from patchfem.export.quantities import describe_quantity, find_definition
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
