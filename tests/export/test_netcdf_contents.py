"""Contents of a netCDF file, compared with an xarray.Dataset."""

import numpy as np
import pytest
import xarray as xr
from limits import limit_file_size

from patchfem.core import Missing
from patchfem.export import netcdf


def test_exact_large_file_has_same_contents(tmp_path):
    """A file that is too large for memory is written on disk with the same contents.

    Without disk space no file remains.
    """
    count = netcdf.MAX_VALUES_IN_MEMORY + 1
    outcomes = np.array(["steady", "stuck"], object)
    data = netcdf.Contents(
        {
            "frames": (("sample",), (np.arange(count) % 7).astype(np.int8), {"units": "1"}),
            "outcome": (("case",), outcomes, {}),
        },
        {"case": ("case", np.arange(2), {})},
        {"title": "a"},
    )
    netcdf.write_netcdf(data, tmp_path / "large.nc")
    with xr.open_dataset(tmp_path / "large.nc") as large:
        assert large.identical(data.to_xarray())
    with limit_file_size(5000), pytest.raises(Missing):
        netcdf.write_netcdf(data, tmp_path / "none.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["large.nc"]
