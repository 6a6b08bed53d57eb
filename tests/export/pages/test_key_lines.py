"""Text of the values of swept keys."""

import numpy as np

from patchfem.export.pages.key_lines import key_formatter


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
