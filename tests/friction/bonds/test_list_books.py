"""Work of the compiled bond list along a path: its steps agree with the trapezoidal rule applied to the force."""

import numpy as np
import pytest
from friction_paths import make_points, upper_pressure
from march_paths import follow_path

from patchfem.friction import BondGrowth, Bonds

ENGINES = {"direct": (0.0, 0.0), "truncated": (1e-6, 0.0), "merged": (1e-6, 0.02)}  # tail, merge
CASES = [
    ("stretch", 0.0, "direct"),
    ("stretch", 0.3, "merged"),
    ("stretch", 3.3, "truncated"),
    ("report", 0.0, "truncated"),
    ("report", 1.0, "direct"),
    ("report", -0.5, "merged"),
]


@pytest.mark.parametrize("reading, order, engine", CASES)
def test_order_of_list_work_quadrature_is_two(reading, order, engine):
    """The trapezoidal work of the force converges to the work of the step means with order two (1.3 for order -0.5)."""
    law = Bonds(1.0, 1.0, order, reading, 0.6, BondGrowth(0.3, 0.4, 1e-2), 0.0)
    contact = make_points(law, upper_pressure([1.0]), *ENGINES[engine])
    errors = []
    for steps in (100, 400):
        path = 1.7 * np.sin(2 * np.pi * np.arange(2 * steps + 1) / steps)
        forces, _, _, _ = follow_path(contact, path, 2 * np.pi / steps)
        work = forces[:-1, 1] * np.diff(path)
        errors.append(abs(np.trapezoid(forces[:, 0], path) - work.sum()) / np.abs(work).sum())
    assert errors[1] < 2e-4 and (
        errors[1] < 1e-7 or np.log(errors[0] / errors[1]) / np.log(4) > (1.3 if order < 0 else 1.6)
    )
