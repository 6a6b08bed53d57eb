"""Contents of a file as an xarray.Dataset."""

import numpy as np
import pytest
import xarray as xr
from limits import limited

from patchfem.core import Missing
from patchfem.export import netcdf


def test_exact_a_large_file_is_made_on_the_disk_with_the_same_contents(tmp_path):
    """And one that finds no room there leaves nothing."""
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
    with limited(5000), pytest.raises(Missing):
        netcdf.write_netcdf(data, tmp_path / "none.nc")
    assert [path.name for path in tmp_path.iterdir()] == ["large.nc"]
