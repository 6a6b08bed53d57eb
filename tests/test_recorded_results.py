"""All results of small scenes and of commands, compared with reviewed results in `tests/recorded/`.

The recorded results are no truth: other tests compare values with closed forms and independent programs. These tests
show every change of what a user sees: values, errors, plans, warnings, tables, pages and files. After a deliberate
change run `python tests/support/recorded.py`, read the differences that it prints, and commit the new files.
"""

import pytest
from recorded import GROUPS, SCENES, compare_with_recorded, find_differences, run_recorded

# Of the numbered scenes every fifth is compared in a normal run, and no group of costly commands.
NUMBERED = [name for name in SCENES if name[0].isdigit()]
DEAR = {"costly", *NUMBERED} - {*NUMBERED[::5]}
PROSE = "The peak pressure of the patch is 2.33 MPa at contact.load."


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow) if name in DEAR else name
        for name in [*GROUPS, *SCENES]
    ],
)
def test_exact_results_equal_recorded_ones(name, tmp_path):
    """Values agree to 1e-6 and to a thousandth of their errors, prose in its numbers, units, keys and quoted words."""
    differences = compare_with_recorded(name, run_recorded(name, tmp_path.resolve()))
    assert not differences, "\n".join(differences[:20])


@pytest.mark.parametrize(
    "old, new, is_found",
    [
        ({"x": 1.0}, {"x": 1.0 + 1e-5}, True),
        ({"x": 1.0}, {"x": 1.0 + 1e-8}, False),
        ({"x.value": 1.0, "x.error": 0.1}, {"x.value": 1.00005, "x.error": 0.1}, False),
        ({"x.value": 1.0, "x.error": 0.1}, {"x.value": 1.0002, "x.error": 0.1}, True),
        ({"x": "peak 2.33 MPa"}, {"x": "peak 2.35 MPa"}, True),
        ({"x": "peak 2.33 MPa"}, {"x": "peak 2.33 kPa"}, True),
        (
            {"x": PROSE},
            {"x": "At contact.load the patch has its largest pressure, 2.33 MPa."},
            False,
        ),
        ({"x": PROSE}, {"x": PROSE.replace(".load", ".tilt")}, True),
        ({"x": [2, 0, 1.0, 2.0, 1.5, 0.1]}, {"x": [2, 0, 1.0, 2.0, 1.5, 0.101]}, True),
        ({"x": 1.0}, {}, True),
    ],
)
def test_exact_changes_beyond_the_tolerances_are_found(old, new, is_found):
    """Rounding differences pass; other changes of numbers, words, arrays and keys are found."""
    assert bool(find_differences(old, new)) == is_found
