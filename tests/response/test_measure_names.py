"""Units, floors and errors of the measures of further interfaces, and of a steady tail that has come to rest."""

import numpy as np
import pytest

from patchfem.response.errors import SURE, step_error, with_errors
from patchfem.response.rows import TABLE, floor_of, of_first, row_of
from patchfem.response.settling import steady_amplitude


@pytest.mark.parametrize("name", sorted(TABLE))
def test_exact_a_number_behind_a_name_changes_no_row(name):
    for full in (name, f"{name}_2", f"{name}_17"):
        assert of_first(full) == name and row_of(full) is TABLE[name]
        assert floor_of(full, 1e-9) == floor_of(name, 1e-9)


def test_exact_further_interfaces_have_errors_by_the_same_rule():
    fine, half, quarter = ({"stick_fraction_2": v, "slip_amplitude_2": 2 * v} for v in (0.5, 0.502, 0.51))
    found = with_errors(fine, step_error(fine, half, quarter, 400))
    assert found["stick_fraction_2"].error == pytest.approx(SURE * 0.002 / 3)
    assert found["slip_amplitude_2"].error == pytest.approx(SURE * 0.004 / 3) and found["slip_amplitude_2"].unit == "m"


def test_exact_a_motion_that_stands_still_has_its_own_amplitude():
    """No change at all between the last windows: nothing is divided by it."""
    with np.errstate(all="raise"):
        assert steady_amplitude(np.ones(6), np.ones(6, complex))[0] in (None, 1.0)
        assert steady_amplitude(np.zeros(6), np.zeros(6, complex)) == (None, None)
        late = np.array([0.0, 0, 1, 1, 1, 1, 1])
        assert steady_amplitude(late, late + 0j)[0] in (None, 1.0)
