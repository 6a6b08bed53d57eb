"""Files as instruments write them: universal files by pyuff, and an elastic-plastic loop known in closed form."""

from __future__ import annotations

import numpy as np
import pyuff
from friction_loops import elastic_plastic_force

LOAD, MU, BOND = 115.0, 0.31, 2.3e-6
SCENE = f"""\
[normal]
load = "{LOAD} N"
[friction]
law = "elastic-plastic"
static = 0.5
bond_length = "5 um"
[slide]
kind = "sine"
amplitude = "10 um"
frequency = "100 Hz"
"""
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


def elastic_plastic_loop(count=80, cycles=2) -> tuple:
    """Return (time, displacement, force) of an elastic-plastic point along a sine of 10 um at 100 Hz.

    The forces are exact at every sample.
    """
    time = np.arange(count * cycles + 1) / count / 100
    slide = 10e-6 * np.sin(2 * np.pi * 100 * time)
    return time, slide, elastic_plastic_force(slide, MU * LOAD, BOND)
