"""Arrays of a MATLAB file of version 7.3, which is an HDF5 file.

MATLAB stores an array with its dimensions in reverse order, a text as the codes of its letters, a cell
array of strings as references to them, and a sparse matrix or a structure as a group. The attribute
MATLAB_class distinguishes them. Links to other files are not followed, and sizes are limited before
anything is unpacked.
"""

import io
from collections.abc import Callable
from contextlib import AbstractContextManager

import h5py
import numpy as np

from ..core import PatchfemError
from .damage import refuse_damage
from .matlab5 import (
    MAX_NESTING,
    MAX_NUMBERS,
    MAX_UNPACK_RATIO,
    MAX_VARIABLES,
    UNPACK_CHECK_BYTES,
    Array,
    make_sparse,
    make_sparse_array,
    make_texts,
)


def read_variables(path, data: bytes) -> dict:
    """Read the variables of a MATLAB file, as `matlab.read_variables` does."""
    arrays = {}
    with _refuse_damage(path):
        # The file stays open as long as an array refers to it.
        _collect_arrays(path, h5py.File(io.BytesIO(data), "r"), "", arrays, 0)
    return arrays


def _refuse_damage(path) -> AbstractContextManager:
    return refuse_damage(f"{path}: the MATLAB file of version 7.3 is damaged", "; save it anew")


def _collect_arrays(path, group, prefix: str, arrays: dict, depth: int) -> None:
    """Add the arrays of a group, and of the structures in it, to `arrays`."""
    for name in group:
        if not isinstance(name, str):
            raise ValueError("the name of a variable is no text")
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        if len(arrays) > MAX_VARIABLES:
            raise PatchfemError(f"{path}: more than {MAX_VARIABLES} variables; save fewer")
        item = group[name]
        array = None
        if isinstance(item, h5py.Dataset):
            array = _read_dataset(path, item)
        elif "MATLAB_sparse" in item.attrs:
            array = _read_sparse_array(path, item)
        elif _read_matlab_class(item) == "struct" and depth < MAX_NESTING:
            _collect_arrays(path, item, f"{prefix}{name}.", arrays, depth + 1)
        if array is not None:
            arrays[prefix + name] = array


def _read_matlab_class(item) -> str:
    name = item.attrs.get("MATLAB_class", b"")
    return name.decode("latin-1") if isinstance(name, bytes) else ""


def _make_array(path, kind: str, shape: tuple, reader: Callable) -> Array:
    """Make an array whose values are read when they are first requested."""

    def read_values():
        """Read the values; raise PatchfemError if they are damaged."""
        with _refuse_damage(path):
            return reader()

    return Array(kind, shape, read_values)


def _read_dataset(path, dataset) -> Array | None:
    """Return a real array, a string or a cell array of strings, or None for other content."""
    if dataset.shape is None:
        return None
    kind = _read_matlab_class(dataset)
    if "MATLAB_empty" in dataset.attrs:
        return _read_empty_array(path, dataset, kind)
    _check_size(path, dataset)
    if kind == "cell":
        return _read_cell_array(path, dataset)
    is_known = kind in ("", "char", "double", "single", "logical") or "int" in kind
    if dataset.dtype.kind not in "iufb" or not is_known:
        return None
    # MATLAB always writes at least two dimensions; other programs may write only one.
    shape = dataset.shape[::-1] if len(dataset.shape) > 1 else (dataset.size, 1)

    def read_values() -> np.ndarray:
        """Read the dataset with the dimensions in MATLAB's order."""
        return np.asarray(dataset[()]).T.reshape(shape)

    if kind == "char":
        return _make_array(
            path,
            "text",
            shape,
            lambda: make_texts(map(_decode_text, read_values().reshape(shape[0], -1))),
        )
    return _make_array(path, "number", shape, lambda: read_values().astype(float))


def _read_empty_array(path, dataset, kind: str) -> Array | None:
    """Return an array with no values, whose shape is stored in the dataset."""
    shape = tuple(int(size) for size in np.ravel(dataset[()])[:2])
    has_values = max(shape, default=1) > 0 and min(shape, default=1) > 0
    if kind in ("cell", "struct") or has_values:
        return None
    return _make_array(path, "text" if kind == "char" else "number", shape, lambda: np.zeros(shape))


def _read_cell_array(path, cells) -> Array | None:
    """Return the first row of each string in a cell array, or None if a cell is not a string."""
    if not isinstance(h5py.check_dtype(ref=cells.dtype), type):
        return None
    parts = [cells.file[reference] for reference in np.ravel(cells[()])[:MAX_VARIABLES]]
    for part in parts:
        if _read_matlab_class(part) != "char" or not isinstance(part, h5py.Dataset):
            return None
    for part in parts:
        _check_size(path, part)
    return _make_array(
        path, "text", cells.shape[::-1], lambda: make_texts(map(_read_first_row, parts))
    )


def _read_first_row(dataset) -> str:
    return "" if "MATLAB_empty" in dataset.attrs else _decode_text(np.ravel(dataset[()].T[0]))


def _decode_text(codes) -> str:
    return "".join(map(chr, codes))


def _read_sparse_array(path, group) -> Array | None:
    """Return a sparse matrix, stored as row indices `ir`, starts of the columns `jc` and `data`."""
    for part in group.values():
        if not isinstance(part, h5py.Dataset):
            raise ValueError("a part of a sparse variable is missing")
        _check_size(path, part)
    starts = group["jc"][()].astype(np.int64)
    shape = (int(np.ravel(group.attrs["MATLAB_sparse"])[0]), starts.size - 1)
    if shape[0] < 0 or max(shape) > MAX_NUMBERS:
        raise PatchfemError(
            f"{path}: a sparse variable of shape {shape}, more than {MAX_NUMBERS:.1e} numbers; save a part"
        )
    if "data" in group and group["data"].dtype.kind not in "iufb":
        return None

    def read_matrix():
        """Read the sparse matrix; raise PatchfemError if its data are damaged."""
        with _refuse_damage(path):
            rows = _read_optional_values(group, "ir").astype(np.int64)
            return make_sparse(rows, starts, _read_optional_values(group, "data"), shape)

    return make_sparse_array(path, shape, read_matrix)


def _read_optional_values(group, name: str) -> np.ndarray:
    """Return the values of a dataset in a group, or an empty array if MATLAB left the dataset out."""
    return group[name][()] if name in group else np.zeros(0)


def _check_size(path, dataset) -> None:
    """Raise PatchfemError if a dataset has too many numbers, or is far larger when decompressed."""
    max_bytes = max(UNPACK_CHECK_BYTES, MAX_UNPACK_RATIO * dataset.id.get_storage_size())
    if dataset.size > MAX_NUMBERS or dataset.nbytes > max_bytes:
        raise PatchfemError(
            f"{path}: a variable of shape {dataset.shape[::-1]} with {dataset.nbytes} bytes, more than "
            f"{MAX_NUMBERS:.1e} numbers or more than {MAX_UNPACK_RATIO} times its size in the file; save "
            "a part of it"
        )
