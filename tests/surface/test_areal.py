"""Areal scans: levelling against a plane that is known and against a dense least-squares solve, rows and columns."""

import numpy as np
import pytest

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import level_plane
from patchfem.surface.areal import Areal


def scan(z, notes=("one",)) -> Areal:
    rows, columns = z.shape
    return Areal(
        frozen_array(1e-3 + 5e-6 * np.arange(columns)),
        frozen_array(-2e-3 + 7e-6 * np.arange(rows)),
        frozen_array(z),
        "scan.txt",
        notes,
    )


def bumps(shape, missing=0.0, seed=5) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z = rng.normal(0.0, 1e-6, shape)
    return np.where(rng.random(shape) < missing, np.nan, z)


def test_exact_the_plane_of_a_dense_least_squares_solve():
    one = scan(bumps((13, 21), 0.4))
    rows, columns = np.nonzero(~one.missing)
    base = np.column_stack([np.ones(rows.size), one.x[columns] * 1e3, one.y[rows] * 1e3])
    plane = base @ np.linalg.lstsq(base, one.z[rows, columns], rcond=None)[0]
    assert level_plane(one).z[rows, columns] == pytest.approx(
        one.z[rows, columns] - plane, abs=1e-18
    )


def test_exact_rows_and_columns_are_traces():
    one = scan(bumps((4, 6), 0.2))
    row = one.row(2)
    column = one.column(-1)
    assert np.array_equal(row.x, one.x) and np.array_equal(row.z, one.z[2], equal_nan=True)
    assert np.array_equal(column.x, one.y) and np.array_equal(column.z, one.z[:, 5], equal_nan=True)
    assert (row.source, column.source) == ("scan.txt, row 2", "scan.txt, column -1")
    assert row.notes == ("one",)


def test_refuses_rows_that_are_not_there_and_heights_in_one_line():
    one = scan(bumps((4, 6)))
    for take, which in ((one.row, 4), (one.row, -5), (one.column, 6)):
        with pytest.raises(
            PatchfemError,
            match=r"scan\.txt: no (row|column) -?\d; the scan has [46] of them, counted",
        ):
            take(which)
    line = np.full((4, 6), np.nan)
    line[range(4), range(4)] = 1e-6
    line[0, 0] = 2e-6
    line[1, 1] = 1e-6
    for heights in (line, np.full((4, 6), np.nan)):
        with pytest.raises(
            PatchfemError, match="all lie on one straight line; a plane needs three points"
        ):
            level_plane(scan(heights))
