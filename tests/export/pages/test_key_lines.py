"""Text of the values of swept keys, and the order of the cases along a key."""

import numpy as np

from patchfem.export.pages.key_lines import group_cases_along_key, is_varied, key_formatter


def make_tilt_key(values, texts) -> dict:
    """Return a swept tilt with its values and texts."""
    return {"name": "contact.tilt.angle", "values": np.asarray(values, float), "texts": texts}


def test_exact_digits_of_values_follow_their_spacing():
    """Values of a range have the digits that their spacing resolves; values written by a user stay unchanged."""
    wide = np.geomspace(2, 200, 5)
    close = np.linspace(1, 1.004, 5)
    user_values = np.array([1, 3.14159, 9.87654, 20, 30])
    for values, expected in (
        (wide, "20 urad"),
        (wide * 1e-3, "0.02 urad"),
        (close / 3, "0.334 urad"),
        (user_values, "9.87654 urad"),
    ):
        texts = [f"{value!r} urad" for value in values.tolist()]
        assert key_formatter(make_tilt_key(values * 1e-6, texts))(2) == expected


def test_exact_lines_of_cases_are_ordered_by_key():
    """The cases of a line are ordered by one key, and all other keys are constant along it."""
    tilt = make_tilt_key([3, 1, 2, 1, 3, 2], ["3", "1", "2", "1", "3", "2"])
    load = {"name": "normal.load", "texts": ["10 N"] * 3 + ["20 N"] * 3}
    assert [line.tolist() for line in group_cases_along_key(tilt, [load])] == [[1, 2, 0], [3, 5, 4]]
    assert is_varied(load) and not is_varied({"texts": ["10 N", "10 N"]})
