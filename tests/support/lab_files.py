"""Universal files as instruments write them, by pyuff."""

from __future__ import annotations

import numpy as np
import pyuff

SI = {
    "type": 164,
    "units_code": 1,
    "units_description": "SI",
    "temp_mode": 1,
    "length": 1.0,
    "force": 1.0,
    "temp": 1.0,
    "temp_offset": 273.15,
}
INCH = SI | {
    "units_code": 7,
    "units_description": "inch lbf",
    "length": 1 / 0.0254,
    "force": 1 / 4.4482216152605,
}


def make_record(time, values, kind, **more) -> dict:
    """Return a binary universal dataset of a time response at node 1, +x, with uneven spacing."""
    return {
        "type": 58,
        "binary": 1,
        "func_type": 1,
        "rsp_node": 1,
        "rsp_dir": 1,
        "ref_node": 0,
        "ref_dir": 0,
        "abscissa_spacing": 0,
        "abscissa_spec_data_type": 17,
        "ordinate_spec_data_type": kind,
        "orddenom_spec_data_type": 0,
        "x": np.array(time),
        "data": np.array(values),
        **more,
    }


def write_universal(path, sets):
    """Write datasets to a universal file with pyuff.

    Mode "overwrite" of pyuff loses a binary first dataset, so the file is deleted and written in
    mode "add".
    """
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets(sets, "add")
    return path
