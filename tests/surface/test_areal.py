"""Areal scans: levelling compared with a dense least-squares fit, rows and columns."""

import numpy as np
import pytest

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface.areal import Areal, level_plane


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


def random_heights(shape, missing=0.0, seed=5) -> np.ndarray:
    """Return random heights, a fraction of them missing."""
    rng = np.random.default_rng(seed)
    z = rng.normal(0.0, 1e-6, shape)
    return np.where(rng.random(shape) < missing, np.nan, z)


def test_exact_levelling_agrees_with_least_squares():
    """The plane that levelling removes from a scan with holes agrees with a dense least-squares fit."""
    surface = make_scan(random_heights((13, 21), 0.4))
    rows, columns = np.nonzero(~surface.missing)
    basis = np.column_stack([np.ones(rows.size), surface.x[columns] * 1e3, surface.y[rows] * 1e3])
    plane = basis @ np.linalg.lstsq(basis, surface.z[rows, columns], rcond=None)[0]
    assert level_plane(surface).z[rows, columns] == pytest.approx(
        surface.z[rows, columns] - plane, abs=1e-18
    )


def test_exact_rows_and_columns_of_scan_are_traces():
    """Rows and columns of a scan are traces with its heights, source and notes."""
    surface = make_scan(random_heights((4, 6), 0.2))
    row = surface.row(2)
    column = surface.column(-1)
    assert np.array_equal(row.x, surface.x) and np.array_equal(row.z, surface.z[2], equal_nan=True)
    assert np.array_equal(column.x, surface.y) and np.array_equal(
        column.z, surface.z[:, 5], equal_nan=True
    )
    assert (row.source, column.source) == ("scan.txt, row 2", "scan.txt, column -1")
    assert row.notes == ("one",)


def test_refuses_absent_rows_and_collinear_heights():
    """A row or column that the scan does not have, and a scan of collinear heights, are refused."""
    surface = make_scan(random_heights((4, 6)))
    for select, index in ((surface.row, 4), (surface.row, -5), (surface.column, 6)):
        with pytest.raises(
            PatchfemError,
            match=r"scan\.txt: no (row|column) -?\d; the scan has [46] of them, counted",
        ):
            select(index)
    line = np.full((4, 6), np.nan)
    line[range(4), range(4)] = 1e-6
    line[0, 0] = 2e-6
    line[1, 1] = 1e-6
    for heights in (line, np.full((4, 6), np.nan)):
        with pytest.raises(
            PatchfemError, match="all lie on one straight line; a plane needs three points"
        ):
            level_plane(make_scan(heights))
