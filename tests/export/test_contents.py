"""Contents of a file as an xarray.Dataset."""

import errno

import numpy as np
import pytest
import xarray as xr

from patchfem.core import Missing
from patchfem.export import netcdf


def test_exact_a_large_file_is_made_on_the_disk_with_the_same_contents(tmp_path, monkeypatch):
    """And one that finds no room there leaves nothing."""
    rng = np.random.default_rng(3)
    held = netcdf.Contents(
        {
            "loop_area": (("case",), rng.random(2000), {"units": "J"}),
            "outcome": (("case",), np.array(["steady"] * 2000, object), {}),
        },
        {"case": ("case", np.arange(2000), {})},
        {"title": "a"},
    )
    netcdf.write(held, tmp_path / "small.nc")
    monkeypatch.setattr(netcdf, "LARGE", 100)
    netcdf.write(held, tmp_path / "large.nc")
    with (
        xr.open_dataset(tmp_path / "small.nc") as small,
        xr.open_dataset(tmp_path / "large.nc") as large,
    ):
        assert small.identical(large)
    with pytest.raises(Missing), monkeypatch.context() as full:
        full.setattr("patchfem.disk.atomic_write.Overflow.truncate", lambda *given: 0)
        full.setattr("patchfem.disk.atomic_write.Overflow.write", _no_room)
        netcdf.write(held, tmp_path / "none.nc")
    assert {one.name for one in tmp_path.iterdir()} == {"small.nc", "large.nc"}


def _no_room(self, data) -> int:
    self.error = OSError(errno.ENOSPC, "No space left on device")
    return memoryview(data).nbytes
