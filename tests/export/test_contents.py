"""Contents of a file as an xarray.Dataset."""

import numpy as np
import xarray as xr

from patchfem.export.netcdf import Contents


def test_exact_variables_are_those_that_xarray_makes_of_the_same():
    rng, mixed = np.random.default_rng(1), np.array([["a", "b"], ["c", None]], object)
    variables = {
        "number": (("row", "column"), rng.normal(size=(2, 2)), {"units": "m"}), "count": ("row", [1, 2]),
        "flag": ("row", np.array([True, False]), {}), "byte": ("row", np.array([0, 1], np.int8), {"meaning": "x"}),
        "text": (("row", "column"), np.array([["a", "bc"], ["", "d"]], object), {"long_name": "outcome"}),
        "name": ("column", ["a", "long"]), "scalar": ((), 3.5), "mixed": (("row", "column"), mixed, {}),
        "complex": ("row", np.array([1j, 2.0]))}
    coordinates = {"row": ("row", [0.5, 1.5], {"units": "s"}), "column": ("column", ["left", "right"])}
    found = Contents(variables, coordinates, {"title": "t"}).to_xarray()
    wanted = xr.Dataset(variables, coordinates, {"title": "t"})
    xr.testing.assert_identical(found, wanted)
    assert all(found[name].dtype == wanted[name].dtype for name in wanted.variables)
    assert type(found.indexes["column"]) is type(wanted.indexes["column"])
