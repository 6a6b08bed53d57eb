"""Texts of profile files for tests of the reader."""

import numpy as np

UM = 1e-6


def format_trace(x, z, header="x [um],z [um]", delimiter=",", digits=17) -> str:
    """Return a file of two columns whose numbers are already in the units of the header."""
    rows = (f"{a:.{digits}g}{delimiter}{b:.{digits}g}" for a, b in zip(x, z))
    return header + "\n" + "\n".join(rows) + "\n"


def draw_uneven_trace(count=50, seed=3) -> tuple:
    """Return unevenly spaced x and rough z, both in um."""
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.uniform(0.5, 2.0, count)) - 20.0, rng.normal(0.0, 1.5, count)
