"""Arrays of an answer as a netCDF4 file with CF attributes, written and read by h5netcdf without xarray.

The import of xarray takes longer than most runs, so only `to_dataset` imports it.
"""

import json
from collections.abc import Mapping
from pathlib import Path

import h5netcdf
import h5py
import numpy as np

from ..disk.atomic_write import open_lossy, write_atomically
from .answer import Answer, Variable, Variables

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
        h5py.File(opened, "w", track_order=True) as store,
        h5netcdf.File(store, "w") as file,
    ):
        file.attrs.update(attributes)
        for name, variable in data.items():
            _write_variable(file, name, variable)


def _write_variable(file: h5netcdf.File, name: str, variable: Variable) -> None:
    """Write one variable, and the dimensions that the file does not have yet."""
    values = np.asarray(variable.values)
    for dimension, size in zip(variable.dims, values.shape, strict=True):
        if dimension not in file.dimensions:
            file.dimensions[dimension] = size

    has_strings = values.dtype.kind in "UO"
    options = {"fillvalue": np.nan} if values.dtype.kind == "f" else {}
    # Arrays with fewer values are stored without compression
    if values.size >= 100:
        options |= {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    kind = h5py.string_dtype() if has_strings else values.dtype
    stored = file.create_variable(name, variable.dims, kind, **options)
    stored[...] = values.astype(object) if has_strings else values
    stored.attrs.update(make_variable_attributes(name, variable))


def read_netcdf(path: Path) -> tuple[Variables, Attributes]:
    """Read variables, in the order in which they were written, and attributes of a file of `write_arrays`.

    Dimensions without a coordinate have no variable. OSError if the file cannot be read or is not a netCDF4 file.
    """
    data = {}
    # h5py reads the many small variables of a sweep three times as fast as h5netcdf, which also leaves a traceback on the
    # screen where it cannot open a damaged file
    with h5py.File(path, "r", track_order=True) as file:
        for name, stored in file.items():
            if bytes(stored.attrs.get("NAME", b"")).startswith(b"This is a netCDF dimension"):
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
