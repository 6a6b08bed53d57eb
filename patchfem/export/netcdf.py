"""Arrays of an answer as a netCDF4 file with CF attributes, written and read by h5py without xarray.

The import of xarray takes longer than most runs, so only `to_dataset` imports it. h5py writes and reads the many small
variables of a sweep four times as fast as h5netcdf. In a netCDF4 file a dimension is a dimension scale of HDF5: the
variable of its name, or a dataset without values.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from ..disk.atomic_write import open_lossy, write_atomically
from .answer import Answer, Variable, Variables

# Name of the dimension scale of a dimension without a coordinate, which its length follows (netCDF4 file format)
NO_COORDINATE = "This is a netCDF dimension but not a netCDF variable."
# attributes of a file or of a variable by name
Attributes = dict[str, str | float | list[str] | np.ndarray]


def make_attributes(answer: Answer) -> Attributes:
    """Return the attributes of the file: program, scene and result, without host and path."""
    origin = answer.origin
    attributes = {
        "Conventions": "CF-1.11",
        "title": answer.title,
        "source": f"patchfem {origin.get('patchfem', '')}".strip(),
        "verdict": " ".join(answer.verdict),
        "versions": json.dumps(origin.get("versions", {})),
    }
    if "outcome" in answer.details:
        attributes["outcome"] = answer.details["outcome"]
    if "resolved" in origin:
        attributes["scene"] = origin["resolved"]
    if not answer.is_run:  # those of a run are in summary.json
        numbers = {key: one for key, one in answer.details.items() if isinstance(one, str | float)}
        attributes |= numbers | {"notes": list(answer.remarks.notes)}
    measures = {name: quantity.as_json() for name, quantity in answer.quantities.items()}
    attributes["measures"] = json.dumps(measures, ensure_ascii=False)
    return attributes


def make_variable_attributes(name: str, variable: Variable) -> Attributes:
    """Return the attributes of a variable: name in words, description, unit, and the names of codes."""
    attributes = {}
    if variable.text:
        # xarray labels axes with `long_name`, for which a sentence is too long
        attributes = {"long_name": name.replace("_", " "), "description": variable.text}
    if variable.meanings:
        codes = np.arange(len(variable.meanings), dtype=variable.values.dtype)
        meanings = " ".join(name.replace(" ", "_") for name in variable.meanings)
        return attributes | {"flag_values": codes, "flag_meanings": meanings}
    return attributes | ({"units": variable.unit} if variable.unit else {})


def write_netcdf(answer: Answer, path: Path) -> None:
    """Write the arrays of an answer as a netCDF4 file."""
    write_arrays(answer.data, make_attributes(answer), path)


def write_arrays(data: Variables, attributes: Attributes, path: Path) -> None:
    """Write variables as a netCDF4 file, which replaces an older one when it is complete.

    HDF5 writes through `open_lossy`, because it would crash on a full disk; the error is raised when the file is closed.

    Parameters
    ----------
    data : dict of str to Variable
        Arrays of the file.
    attributes : dict
        Attributes of the file.
    path : Path
        File to write.
    """
    with (
        write_atomically(path) as partial,
        open_lossy(partial) as opened,
        h5py.File(opened, "w", track_order=True) as file,
    ):
        versions = f"version=2,hdf5={h5py.version.hdf5_version},h5py={h5py.__version__}"
        file.attrs["_NCProperties"] = np.bytes_(versions)
        file.attrs.update(attributes)
        for name, variable in data.items():
            _write_variable(file, name, variable)
        _attach_dimensions(file, data)


def _write_variable(file: h5py.File, name: str, variable: Variable) -> None:
    """Write one variable without its dimensions."""
    values = np.asarray(variable.values)
    has_strings = values.dtype.kind in "UO"
    options = {"fillvalue": np.nan} if values.dtype.kind == "f" else {}
    # Arrays with fewer values are stored without compression
    if values.size >= 100:
        options |= {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    kind = h5py.string_dtype() if has_strings else values.dtype
    content = values.astype(object) if has_strings else values
    stored = file.create_dataset(name, values.shape, kind, content, track_order=True, **options)
    if "fillvalue" in options:
        stored.attrs["_FillValue"] = np.full(1, np.nan, values.dtype)
    stored.attrs.update(make_variable_attributes(name, variable))


def _attach_dimensions(file: h5py.File, data: Variables) -> None:
    """Make the dimensions of the variables of a file, and attach each variable to its dimensions."""
    scales = {}
    for variable in data.values():
        for dimension, size in zip(variable.dims, np.shape(variable.values), strict=True):
            if dimension in scales:
                continue
            if dimension in data:
                scale = file[dimension]
                scale.make_scale(dimension)
            else:
                scale = file.create_dataset(dimension, (size,), ">f4")
                scale.make_scale(f"{NO_COORDINATE}{size:10d}")
            scale.attrs["_Netcdf4Dimid"] = np.int32(len(scales))
            scales[dimension] = scale

    for name, variable in data.items():
        if name not in scales:
            axes = file[name].dims
            for axis, dimension in enumerate(variable.dims):
                axes[axis].attach_scale(scales[dimension])


def read_netcdf(path: Path) -> tuple[Variables, Attributes]:
    """Read variables, in the order in which they were written, and attributes of a file of `write_arrays`.

    Dimensions without a coordinate have no variable. OSError if the file cannot be read or is not a netCDF4 file.
    """
    data = {}
    with h5py.File(path, "r", track_order=True) as file:
        for name, stored in file.items():
            if bytes(stored.attrs.get("NAME", b"")).startswith(NO_COORDINATE.encode()):
                continue
            dims = (name,) if stored.is_scale else tuple(axis[0].name[1:] for axis in stored.dims)
            is_text = stored.dtype.kind == "O"
            values = np.asarray(stored.asstr()[...], str) if is_text else stored[...]
            data[name] = make_variable(dims, values, stored.attrs)
        return data, dict(file.attrs)


def make_variable(dims: tuple[str, ...], values: np.ndarray, attributes: Mapping) -> Variable:
    """Return a variable of a netCDF file from its array and its attributes; the inverse of `make_variable_attributes`.

    Parameters
    ----------
    dims : tuple of str
        Names of the dimensions of the array.
    values : ndarray
        Array as stored, in SI units.
    attributes : mapping
        Attributes of the array as stored; `units`, `description` and `flag_meanings` are read, as far as they exist. In
        files of earlier versions `long_name` is the description.
    """
    unit, text, meanings = (
        str(attributes.get(key, "")) for key in ("units", "description", "flag_meanings")
    )
    text = text or str(attributes.get("long_name", ""))
    names = tuple(name.replace("_", " ") for name in meanings.split())
    return Variable(dims, values, unit, text, names)


def to_dataset(answer: Answer):
    """Return the arrays of an answer as an xarray.Dataset; a variable named like its dimension is a coordinate."""
    import xarray as xr

    variables = {}
    for name, variable in answer.data.items():
        variables[name] = (variable.dims, variable.values, make_variable_attributes(name, variable))
    return xr.Dataset(variables, attrs=make_attributes(answer))


def from_dataset(dataset, kind: str) -> Answer:
    """Return an answer of the given kind, such as "run" or "sweep", with the arrays of an xarray.Dataset.

    An object without variables, such as None, gives an answer without arrays.
    """
    variables = getattr(dataset, "variables", {})
    data = {
        str(name): make_variable(tuple(map(str, one.dims)), np.asarray(one.values), one.attrs)
        for name, one in variables.items()
    }
    return Answer(kind, "", (), data=data)
