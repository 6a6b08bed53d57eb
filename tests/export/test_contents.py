"""Contents of a file as an xarray.Dataset."""

import errno

import numpy as np
import pytest
import xarray as xr

from patchfem.core import Missing
from patchfem.export import netcdf
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


def test_exact_a_large_file_is_made_on_the_disk_with_the_same_contents(tmp_path, monkeypatch):
    """And one that finds no room there leaves nothing."""
    rng = np.random.default_rng(3)
    held = netcdf.Contents({"loop_area": (("case",), rng.random(2000), {"units": "J"}),
                            "outcome": (("case",), np.array(["steady"] * 2000, object), {})},
                           {"case": ("case", np.arange(2000), {})}, {"title": "a"})
    netcdf.write(held, tmp_path / "small.nc")
    monkeypatch.setattr(netcdf, "LARGE", 100)
    netcdf.write(held, tmp_path / "large.nc")
    with xr.open_dataset(tmp_path / "small.nc") as small, xr.open_dataset(tmp_path / "large.nc") as large:
        assert small.identical(large)
    with pytest.raises(Missing), monkeypatch.context() as full:
        full.setattr("patchfem.disk.whole.Overflow.truncate", lambda *given: 0)
        full.setattr("patchfem.disk.whole.Overflow.write", _no_room)
        netcdf.write(held, tmp_path / "none.nc")
    assert {one.name for one in tmp_path.iterdir()} == {"small.nc", "large.nc"}


def _no_room(self, data) -> int:
    self.error = OSError(errno.ENOSPC, "No space left on device")
    return memoryview(data).nbytes
