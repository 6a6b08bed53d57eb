"""Arrays of a MATLAB file of version 7.3, which is an HDF5 file: numbers, texts and the fields of single structures.

MATLAB keeps an array with its dimensions in reverse order, a text as numbers of its letters, a cell array of texts as
references to them, a sparse matrix and a structure as a group; the attribute MATLAB_class tells which. Links to other
files are not followed, and sizes are limited before anything is unpacked.
"""

import io

import h5py
import numpy as np

from ..core import PatchfemError
from .matlab5 import (
    MAX_DEPTH,
    MAX_NUMBERS,
    MAX_UNPACK_RATIO,
    MAX_VARIABLES,
    UNPACK_CHECK_BYTES,
    Array,
    in_full,
    sparse_of,
)

_BROKEN = (
    OSError,
    KeyError,
    ValueError,
    RuntimeError,
    TypeError,
    IndexError,
    AttributeError,
    MemoryError,
    OverflowError,
)


def variables(path, data: bytes) -> dict:
    """Name -> `Array` as `matlab5.variables` gives them; a field of a structure is named STRUCTURE.FIELD.

    PatchfemError where the file is damaged or too large.
    """
    found = {}
    try:
        # it stays open for values that are asked for later, and ends with them
        _walk(path, h5py.File(io.BytesIO(data), "r"), "", found, 0)
    except _BROKEN as error:
        raise _damaged(path, error) from None
    return found


def _damaged(path, error) -> PatchfemError:
    why = " ".join(str(error).split())[:120]
    return PatchfemError(f"{path}: the MATLAB file of version 7.3 is damaged ({why}); save it anew")


def _array(path, kind: str, shape: tuple, read) -> Array:
    """An `Array` whose values are read, limited before, when they are asked for."""

    def values():
        try:
            return read()
        except _BROKEN as error:
            raise _damaged(path, error) from None

    return Array(kind, shape, values)


def _walk(path, group, before: str, found: dict, deep: int) -> None:
    for name in group:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        if len(found) > MAX_VARIABLES:
            raise PatchfemError(f"{path}: more than {MAX_VARIABLES} variables; save fewer")
        one, kind = group[name], _class(group[name])
        if isinstance(one, h5py.Dataset):
            array = _dataset(path, one, kind)
        elif "MATLAB_sparse" in one.attrs:
            array = _sparse(path, one)
        else:
            array = None
            if kind == "struct" and deep < MAX_DEPTH:
                _walk(path, one, f"{before}{name}.", found, deep + 1)
        if array is not None:
            found[before + name] = array


def _class(one) -> str:
    kind = one.attrs.get("MATLAB_class", b"")
    return kind.decode("latin-1") if isinstance(kind, bytes) else ""


def _dataset(path, one, kind: str) -> Array | None:
    """An array of real numbers, a text or a cell array of texts; None for anything else."""
    if one.shape is None:
        return None
    if "MATLAB_empty" in one.attrs:
        shape = tuple(int(side) for side in np.ravel(one[()])[:2])
        return (
            None
            if kind in ("cell", "struct") or max(shape, default=1) > 0 < min(shape, default=1)
            else _array(
                path, "text" if kind == "char" else "number", shape, lambda: np.zeros(shape)
            )
        )
    _limited(path, one)
    if kind == "cell":
        return _texts(path, one)
    plain = kind in ("", "char", "double", "single", "logical") or "int" in kind
    if one.dtype.kind not in "iufb" or not plain:
        return None
    # MATLAB has two dimensions at least, another program may not
    shape = one.shape[::-1] if len(one.shape) > 1 else (one.size, 1)
    read = lambda: np.asarray(one[()]).T.reshape(shape)  # noqa: E731
    if kind == "char":
        return _array(
            path,
            "text",
            shape,
            lambda: _text("".join(map(chr, row)).rstrip() for row in read().reshape(shape[0], -1)),
        )
    return _array(path, "number", shape, lambda: read().astype(float))


def _texts(path, cells) -> Array | None:
    if not isinstance(h5py.check_dtype(ref=cells.dtype), type):
        return None
    parts = [cells.file[reference] for reference in np.ravel(cells[()])[:MAX_VARIABLES]]
    if not all(_class(one) == "char" and isinstance(one, h5py.Dataset) for one in parts):
        return None
    for one in parts:
        _limited(path, one)
    return _array(
        path,
        "text",
        cells.shape[::-1],
        lambda: _text(
            ""
            if "MATLAB_empty" in one.attrs
            else "".join(map(chr, np.ravel(one[()].T[0]))).rstrip()
            for one in parts
        ),
    )


def _text(rows) -> np.ndarray:
    rows = list(rows)
    out = np.empty(len(rows), dtype=object)
    out[:] = rows
    return out


def _sparse(path, group) -> Array | None:
    """A sparse matrix: rows of the numbers, starts of the columns, numbers."""
    for one in group.values():
        _limited(path, one)
    starts = group["jc"][()].astype(np.int64)
    shape = int(np.ravel(group.attrs["MATLAB_sparse"])[0]), starts.size - 1
    if shape[0] < 0 or max(shape) > MAX_NUMBERS:
        raise PatchfemError(
            f"{path}: a sparse variable of shape {shape}, more than {MAX_NUMBERS:.1e} numbers; save a part"
        )
    if "data" in group and group["data"].dtype.kind not in "iufb":
        return None

    def stored():
        rows, values = (
            group[name][()] if name in group else np.zeros(0) for name in ("ir", "data")
        )
        return sparse_of(rows.astype(np.int64), starts, values, shape)

    array = _array(path, "sparse", shape, stored)
    return array._replace(values=lambda: in_full(path, array.values()), sparse=array.values)


def _limited(path, one) -> None:
    """PatchfemError for a dataset of too many numbers, or of far more bytes than it takes in the file."""
    if one.size > MAX_NUMBERS or one.nbytes > max(
        UNPACK_CHECK_BYTES, MAX_UNPACK_RATIO * one.id.get_storage_size()
    ):
        raise PatchfemError(
            f"{path}: a variable of shape {one.shape[::-1]} with {one.nbytes} bytes, more than "
            f"{MAX_NUMBERS:.1e} numbers or more than {MAX_UNPACK_RATIO} times its size in the file; save a part of it"
        )
