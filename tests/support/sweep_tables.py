"""Tables of sweeps from given values, for tests of their analysis."""

import csv

import numpy as np

from patchfem.campaigns.sweeps.sweep_table import MeasureColumn, SweepTable, SweptKey


def make_table(keys, measures, *, errors=0.0, unit="1", tolerance=1e-3, **more) -> SweepTable:
    """Return the table of a grid of settled cases.

    Parameters
    ----------
    keys : dict
        Values (k,) of each key by its dotted name; the last key varies fastest.
    measures : dict
        Values by name, with the shape of the grid or (n,).
    errors : float or array
        Errors of all measures.
    unit : str
        Unit of all measures and keys.
    tolerance : float
    more
        Further fields of SweepTable.
    """
    values = [np.asarray(list(column)) for column in keys.values()]
    shape = more.pop("shape", tuple(map(len, values)))
    if len(shape) == len(values) and not more.get("is_random"):
        values = [grid.ravel() for grid in np.meshgrid(*values, indexing="ij")]
    count = int(np.prod(shape))
    columns = {
        name: MeasureColumn(
            unit,
            np.asarray(column, float).ravel(),
            np.broadcast_to(np.asarray(errors, np.float32), (count,)).copy(),
            np.zeros(count, np.float32),
        )
        for name, column in measures.items()
    }
    swept = tuple(SweptKey(name, unit, column) for name, column in zip(keys, values))
    outcome = more.pop("outcome", np.full(count, "steady", object))
    return SweepTable(swept, shape, outcome, tolerance, measures=columns, **more)


def make_random_table(points, measures, **more) -> SweepTable:
    """Return the table of random cases with the coordinates (n, keys) as values of k0, k1, ..."""
    keys = {f"k{axis}": column for axis, column in enumerate(points.T)}
    return make_table(keys, measures, shape=(len(points),), is_random=True, **more)


def read_rows(folder, name="sweep.csv") -> list[dict]:
    """Return the rows of a table in a results folder."""
    with open(folder / name, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def assert_same_files(folder, other, names=("sweep.csv", "sweep.nc")) -> None:
    """Assert that these files of two sweeps are identical byte for byte."""
    for name in names:
        assert (folder / name).read_bytes() == (other / name).read_bytes(), name
