"""result.nc: histories and interface frames as one netCDF4 file with CF attributes and provenance."""

import hashlib
import json
from pathlib import Path

import numpy as np
import xarray as xr

LONG = {
    "relative_displacement": ("m", "displacement of the block relative to the base at its output"),
    "relative_velocity": ("m s-1", "velocity of the block relative to the base at its output"),
    "absolute_acceleration": ("m s-2", "acceleration at the output, base motion included"),
    "base_acceleration": ("m s-2", "acceleration of the base"),
    "friction_force": ("N", "resultant friction force, positive against positive slip"),
    "lateral_displacement": ("m", "displacement of the upper piece across the sliding direction"),
    "lateral_force": ("N", "resultant friction force across the sliding direction, positive against positive slip"),
    "yaw_moment": ("N m", "moment about +z of the friction on the upper piece, sum of y f_x - x f_y"),
    "normal_load": ("N", "normal load on the interface"),
    "friction_work": ("J", "work done against friction since the start"),
    "energy_stored": ("J", "elastic energy of the interface"),
    "energy_dissipated": ("J", "energy dissipated by friction since the start"),
    "energy_created": ("J", "energy that a law without passivity has created since the start"),
    "modal_coordinate": ("m", "modal coordinate"),
    "normal_stress": ("Pa", "normal stress at the nodes, compression positive"),
    "strip_normal_stress": ("Pa", "normal stress at the nodes of every strip, compression positive"),
    "gap": ("m", "remaining gap"),
    "shear_stress": ("Pa", "frictional shear stress, positive against positive slip"),
    "slip": ("m", "irreversible local slip"),
    "weight": ("m2", "nodal area of all pairs"),
}


def dataset(histories: dict, modal, fields: dict, x, weight, strips: tuple | None = None,
            levels: dict | None = None) -> xr.Dataset:
    """Dataset of a run.

    histories: name -> (k,) with "time"; modal: (names, (k, n)) or None; fields: name -> (f, m) with "time", or {};
    x, weight: (m,) or None; strips: (offsets (s,) [m], pressure (s, m) [Pa]) of a patch in strips; levels: name ->
    (unit, (l,)) of a run in levels.
    """
    data, coords = {}, {}
    if histories:
        coords["time"] = ("time", histories["time"], {"units": "s", "standard_name": "time"})
        for name, values in histories.items():
            if name != "time":
                data[name] = ("time", values, _attributes(name))
    if modal is not None:
        coords["mode"] = ("mode", list(modal[0]), {"long_name": "mode"})
        data["modal_coordinate"] = (("time", "mode"), modal[1], _attributes("modal_coordinate"))
    if x is not None:
        coords["x"] = ("x", np.asarray(x), {"units": "m", "long_name": "place along the sliding direction"})
        data["weight"] = ("x", np.asarray(weight), _attributes("weight"))
        coords["frame_time"] = ("frame", fields["time"], {"units": "s", "long_name": "time of the frame"})
        for name, values in fields.items():
            if name == "status":
                flags = {"long_name": "contact status", "flag_meanings": "open stick slip",
                         "flag_values": np.array([0, 1, 2], np.int8)}
                data[name] = (("frame", "x"), values, flags)
            elif np.ndim(values) == 2:
                data[name] = (("frame", "x"), values, _attributes(name))
    if strips is not None:
        coords["strip_offset"] = ("strip", strips[0], {"units": "m", "long_name": "place of the strip over the width"})
        data["strip_normal_stress"] = (("strip", "x"), strips[1], _attributes("strip_normal_stress"))
    for name, (unit, values) in (levels or {}).items():
        text = {"level_drive": "acceleration of the base", "level_stuck": "whether the interface held"}
        data[name] = ("level", values, {"units": unit, "long_name": text.get(name, name.replace("_", " "))})
    return xr.Dataset(data, coords)


def _attributes(name: str) -> dict:
    unit, text = LONG[name]
    return {"units": unit, "long_name": text}


def write(data: xr.Dataset, path: Path, summary: dict, scene_text: str, versions: dict) -> None:
    """Write through a temporary file beside `path`; provenance holds no host name and no path."""
    data = data.assign_attrs({
        "Conventions": "CF-1.11", "title": summary["title"], "source": f"patchfem {summary['patchfem']}",
        "outcome": summary["outcome"], "scene": scene_text,
        "scene_sha256": hashlib.sha256(scene_text.encode()).hexdigest(),
        "summary": json.dumps({k: summary[k] for k in ("kind", "measures", "warnings")}, ensure_ascii=False),
        "versions": json.dumps(versions)})
    encoding = {name: {"zlib": True, "complevel": 1} for name in data.data_vars if data[name].ndim}
    partial = Path(path).with_name(Path(path).name + ".partial")
    data.to_netcdf(partial, engine="h5netcdf", encoding=encoding)
    partial.replace(path)
