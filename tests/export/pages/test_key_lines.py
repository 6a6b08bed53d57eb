"""Values of swept keys as people read them, and the order of the cases along a key."""

import numpy as np

from patchfem.export.pages.key_lines import group_cases_along_key, is_varied, key_formatter


def key(values, texts) -> dict:
    return {"name": "contact.tilt.angle", "values": np.asarray(values, float), "texts": texts}


def test_exact_values_have_the_digits_that_their_spacing_resolves():
    """A range wrote them; what a person wrote stays as it is."""
    wide = np.geomspace(2, 200, 5)
    close = np.linspace(1, 1.004, 5)
    as_written = np.array([1, 3.14159, 9.87654, 20, 30])
    for values, third in (
        (wide, "20 urad"),
        (wide * 1e-3, "0.02 urad"),
        (close / 3, "0.334 urad"),
        (as_written, "9.87654 urad"),
    ):
        texts = [f"{value!r} urad" for value in values.tolist()]
        assert key_formatter(key(values * 1e-6, texts))(2) == third


def test_exact_lines_are_ordered_by_the_key_and_hold_the_others_fixed():
    tilt = key([3, 1, 2, 1, 3, 2], ["3", "1", "2", "1", "3", "2"])
    load = {"name": "normal.load", "texts": ["10 N"] * 3 + ["20 N"] * 3}
    assert [line.tolist() for line in group_cases_along_key(tilt, [load])] == [[1, 2, 0], [3, 5, 4]]
    assert is_varied(load) and not is_varied({"texts": ["10 N", "10 N"]})
