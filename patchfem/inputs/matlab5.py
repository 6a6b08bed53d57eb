"""Arrays of a MATLAB file of version 5 to 7: numbers, sparse numbers, texts and the fields of single structures;
nothing else of it is looked at.

Sizes are read from the header of each variable and limited before it is unpacked, and every count is compared with the
bytes that are there. SciPy 1.17 trusts them: of the first 182 damaged files of tests/inputs/test_matlab.py that are not
packed, 11 end its process (signal 11), which no wrapper can refuse. Layout: "MAT-File Format", The MathWorks; every
element is a tag (kind, bytes) and its data, padded to eight bytes.
"""

import struct
import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..core import PatchfemError

MAX_NUMBERS = 15 * 10**7  # numbers of one variable
DAMAGED = (
    "the header of the MATLAB file is damaged or of version 4; save it anew with save(name, '-v7')"
)
MAX_UNPACK_RATIO, UNPACK_CHECK_BYTES = (
    200,
    2**20,
)  # unpacked to packed size of what unpacks to more than UNPACK_CHECK_BYTES
MAX_VARIABLES = 1000  # variables
MAX_DEPTH = 8  # structures in one another
_STORED = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    9: "f8",
    12: "i8",
    13: "u8",
}
_TEXTS = {2: "latin-1", 16: "utf-8", 17: "utf-16", 4: "utf-16"}
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _CHAR, _SPARSE, _NUMERIC = 1, 2, 4, 5, range(6, 16)  # classes of arrays
_COMPLEX = 0x0800
_HEAD = 1024  # bytes that hold the shape and the name of an array
_BROKEN = (
    zlib.error,
    struct.error,
    ValueError,
    KeyError,
    IndexError,
    OverflowError,
    TypeError,
    MemoryError,
)


class Array(NamedTuple):
    """One variable: "number", "sparse" or "text"; its shape; a call that gives its values, full and as floats; of a
    sparse one another that gives a scipy.sparse array."""

    kind: str
    shape: tuple
    values: Callable
    sparse: Callable | None = None


class _Known(NamedTuple):
    """What the head of a variable tells: class, shape, name, place of its data, bytes of all of it."""

    kind: int
    shape: tuple
    name: str
    at: int
    total: int


def variables(path, data: bytes) -> dict:
    """Name -> `Array` of the real arrays and texts of a MATLAB file; a field of a structure is named STRUCTURE.FIELD.

    PatchfemError where the file is damaged or too large.
    """
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise PatchfemError(f"{path}: {DAMAGED}")
    found, at = {}, 128
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, at)
        if at + 8 + size > len(data) or len(found) > MAX_VARIABLES:
            raise PatchfemError(f"{path}: the MATLAB file is cut off or damaged; save it anew")
        body = memoryview(data)[at + 8 : at + 8 + size]
        try:
            known = (
                _head(path, body, kind == _COMPRESSED, order)
                if kind in (_MATRIX, _COMPRESSED)
                else None
            )
        except _BROKEN as error:
            raise PatchfemError(
                f"{path}: a variable of the MATLAB file is damaged ({_short(error)}); save it anew"
            ) from None
        if known is not None:
            found.update(_arrays(path, body, kind == _COMPRESSED, order, known))
        at += 8 + size + (0 if kind == _COMPRESSED else -size % 8)
    return found


def _head(path, body, packed: bool, order: str) -> _Known | None:
    """Head of a variable, None for what is no real array and no text."""
    head, total = bytes(body[:_HEAD]), len(body)
    if packed:
        head = zlib.decompressobj().decompress(body, _HEAD)
        kind, total = struct.unpack_from(order + "II", head)
        if kind != _MATRIX:
            return None
        head = head[8:]
    flag, shape, name, at = _described(head, order)
    kind = flag & 0xFF
    if kind not in (_CELL, _STRUCT, _CHAR, _SPARSE, *_NUMERIC) or flag & _COMPLEX:
        return None
    count = 1
    for one in shape:
        count *= one
    if not shape or min(shape) < 0 or (max(shape) if kind == _SPARSE else count) > MAX_NUMBERS:
        raise PatchfemError(
            f"{path}: a variable of shape {shape}, more than {MAX_NUMBERS:.1e} numbers; save a part of it"
        )
    if kind in _NUMERIC and total > 8 * count + at + 16:
        raise ValueError(f"{total} bytes for {count} numbers")
    return _Known(kind, shape, name.decode("latin-1"), at, total)


def _described(data, order: str) -> tuple:
    """(flags, shape, name, where the data begin) of a matrix element."""
    _, flags, at = _element(data, 0, order)
    _, dims, at = _element(data, at, order)
    _, name, at = _element(data, at, order)
    return (
        struct.unpack_from(order + "I", flags)[0],
        struct.unpack(f"{order}{len(dims) // 4}i", dims),
        name,
        at,
    )


def _arrays(path, body, packed: bool, order: str, known: _Known, deep: int = 0) -> dict:
    """Name -> `Array` of a variable, of every field of a structure; a structure of several elements gives none."""
    if known.kind != _STRUCT:
        return {known.name: _array(path, body, packed, order, known)}
    if max(known.shape) > 1 or min(known.shape) < 1 or deep >= MAX_DEPTH:
        return {}
    try:
        data = _unpacked(path, body, known.total) if packed else body
        found = {}
        for name, one in _fields(data, known.at, order):
            inner = _head(path, one, False, order)
            if inner is not None and len(found) < MAX_VARIABLES:
                found |= _arrays(
                    path, one, False, order, inner._replace(name=f"{known.name}.{name}"), deep + 1
                )
        return found
    except _BROKEN as error:
        raise PatchfemError(
            f"{path}: a structure is damaged ({_short(error)}); save it anew"
        ) from None


def _fields(data, at: int, order: str):
    """(Name, matrix element) of the fields of a structure: the letters of a name, all names, then the matrices."""
    _, size, at = _element(data, at, order)
    _, names, at = _element(data, at, order)
    wide = struct.unpack(order + "i", size)[0]
    if not 0 < wide <= 64 or len(names) % wide:
        raise ValueError("the list of its field names has a wrong length")
    for first in range(0, len(names), wide):
        kind, body, at = _element(data, at, order)
        if kind != _MATRIX:
            raise ValueError("one of its fields is not an array")
        if body:
            yield names[first : first + wide].split(b"\0")[0].decode("latin-1"), memoryview(body)


def _array(path, body, packed: bool, order: str, known: _Known) -> Array:
    def stored():
        try:
            data = _unpacked(path, body, known.total) if packed else body
            if known.kind in _NUMERIC:
                return _numbers(data, known.at, known.shape, order)
            return (
                _sparse(data, known, order) if known.kind == _SPARSE else _texts(data, known, order)
            )
        except _BROKEN as error:
            name = known.name[:40] if known.name.isprintable() else "?"
            raise PatchfemError(
                f"{path}: variable {name} is damaged ({_short(error)}); save it anew"
            ) from None

    kind = "number" if known.kind in _NUMERIC else "sparse" if known.kind == _SPARSE else "text"
    if kind == "sparse":
        return Array(kind, known.shape, lambda: in_full(path, stored()), stored)
    return Array(kind, known.shape, stored)


def _unpacked(path, body, total: int) -> bytes:
    if total > max(UNPACK_CHECK_BYTES, MAX_UNPACK_RATIO * len(body)):
        raise PatchfemError(
            f"{path}: a variable unpacks to more than {MAX_UNPACK_RATIO} times its packed size; save it with "
            "save(name, '-v6')"
        )
    unpack = zlib.decompressobj()
    data = unpack.decompress(body, 8 + total + 1)[8:]
    if not unpack.eof:  # there its checksum has been compared
        raise ValueError("the data are longer or shorter than the header announces")
    return data


def _numbers(data, at: int, shape: tuple, order: str) -> np.ndarray:
    kind, stored, _ = _element(data, at, order)
    return np.frombuffer(stored, order + _STORED[kind]).reshape(shape, order="F").astype(float)


def _sparse(data, known: _Known, order: str):
    """A sparse matrix: row numbers, starts of the columns, values."""
    parts, at = [], known.at
    for _ in range(3):
        kind, stored, at = _element(data, at, order)
        parts.append(np.frombuffer(stored, order + _STORED[kind]))
    return sparse_of(*parts, known.shape)


def sparse_of(rows, starts, values, shape: tuple):
    """The scipy.sparse array (n, m) of row numbers (k,), starts of the columns (m + 1,), values (k,); ValueError where
    they do not fit together."""
    count, wide = shape[1], np.diff(starts)
    if (
        starts.size != count + 1
        or starts[0] != 0
        or (wide < 0).any()
        or starts[-1] > min(rows.size, values.size)
    ):
        raise ValueError("the column pointers of the sparse matrix do not fit its size")
    rows, values = rows[: starts[-1]], values[: starts[-1]]
    if rows.size and not 0 <= rows.min() <= rows.max() < shape[0]:
        raise ValueError("a row number lies outside the sparse matrix")
    return sparse.csc_array(
        (values.astype(float), rows.astype(np.int64), np.asarray(starts, np.int64)), shape=shape
    )


def in_full(path, matrix) -> np.ndarray:
    """A sparse matrix as a full array; PatchfemError for one of too many numbers."""
    if matrix.shape[0] * matrix.shape[1] > MAX_NUMBERS:
        raise PatchfemError(
            f"{path}: a sparse variable of shape {matrix.shape}, more than {MAX_NUMBERS:.1e} numbers in "
            "full; save a part of it"
        )
    return matrix.toarray()


def _texts(data, known: _Known, order: str) -> np.ndarray:
    """The rows of a matrix of letters, or the first row of each text of a cell array, without blanks at their ends."""
    if known.kind == _CHAR:
        kind, stored, _ = _element(data, known.at, order)
        coding = _TEXTS[kind] + (
            {"<": "-le", ">": "-be"}[order] if _TEXTS[kind] == "utf-16" else ""
        )
        letters = np.array(list(stored.decode(coding)), dtype=object).reshape(
            known.shape, order="F"
        )
        found = ["".join(row).rstrip() for row in letters.reshape(known.shape[0], -1)]
    else:
        found, at = [], known.at
        while len(found) < max(known.shape, default=0):
            kind, stored, at = _element(data, at, order)
            flag, shape, name, inner = _described(stored, order)
            if kind != _MATRIX or flag & 0xFF != _CHAR:
                raise ValueError("a cell does not contain text")
            one = _Known(_CHAR, shape, name.decode("latin-1"), inner, len(stored))
            found.append(_texts(stored, one, order)[0])
    out = np.empty(len(found), dtype=object)
    out[:] = found
    return out


def _element(data, at: int, order: str) -> tuple:
    """(kind, data, where the next one begins) of the element at a place."""
    kind, size = struct.unpack_from(order + "II", data, at)
    if kind >> 16:  # four bytes or fewer, inside the tag
        kind, size, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
    else:
        start, after = at + 8, at + 8 + size + -size % 8
    if size > len(data) - start or (start == at + 4 and size > 4):
        raise ValueError("an element ends too early")
    return kind, bytes(data[start : start + size]), after


def _short(error) -> str:
    text = " ".join(str(error).split())
    return text[:120] if text.isprintable() else type(error).__name__
