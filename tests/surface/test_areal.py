"""Areal scans: levelling compared with a dense least-squares fit."""

import numpy as np
import pytest

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile, make_report
from patchfem.surface.areal import Areal, level


def make_scan(z, notes=("one",)) -> Areal:
    """Return a scan of heights with steps of 5 and 7 um."""
    rows, columns = z.shape
    return Areal(
        frozen_array(1e-3 + 5e-6 * np.arange(columns)),
        frozen_array(-2e-3 + 7e-6 * np.arange(rows)),
        frozen_array(z),
        "scan.txt",
        notes,
    )


def random_heights(shape, missing=0.0) -> np.ndarray:
    """Return random heights, a fraction of them missing."""
    rng = np.random.default_rng(5)
    z = rng.normal(0.0, 1e-6, shape)
    return np.where(rng.random(shape) < missing, np.nan, z)


def test_exact_levelling_agrees_with_least_squares():
    """The plane that levelling removes from a scan with holes agrees with a dense least-squares fit."""
    surface = make_scan(random_heights((13, 21), 0.4))
    rows, columns = np.nonzero(~surface.missing)
    basis = np.column_stack([np.ones(rows.size), surface.x[columns] * 1e3, surface.y[rows] * 1e3])
    plane = basis @ np.linalg.lstsq(basis, surface.z[rows, columns], rcond=None)[0]
    assert level(surface).z[rows, columns] == pytest.approx(
        surface.z[rows, columns] - plane, abs=1e-18
    )


def test_refuses_collinear_heights():
    """A scan of collinear heights is refused, and a trace of one height."""
    line = np.full((4, 6), np.nan)
    line[range(4), range(4)] = 1e-6
    line[0, 0] = 2e-6
    line[1, 1] = 1e-6
    for heights in (line, np.full((4, 6), np.nan)):
        with pytest.raises(
            PatchfemError, match="heights; a plane needs three that do not lie on one straight"
        ):
            level(make_scan(heights))
    with pytest.raises(PatchfemError, match="trace: 1 heights; a line needs two"):
        level(Profile(np.arange(3.0), np.array([np.nan, 1.0, np.nan]), "trace"))


def test_refuses_window_of_a_single_column():
    """A window of a scan that contains a single sample along x is refused."""
    scan = make_scan(np.ones((4, 6)))
    with pytest.raises(PatchfemError, match="the window contains a single sample along x; take"):
        make_report(scan, window=(scan.x[1], scan.x[1] + 2e-6, scan.y[0], scan.y[-1]))
