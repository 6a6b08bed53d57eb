"""Real arrays of a MATLAB file of version 5 to 7: what is stored uncompressed or through zlib, nothing else of it.

Sizes are read from the header of each variable and limited before it is unpacked. Layout: "MAT-File Format",
The MathWorks; every element is a tag (kind, bytes) and its data, padded to eight bytes.
"""

import struct
import zlib
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from .raw import BROKEN, POINTS, RATIO, SMALL, Raw, reason, shown

_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_MATRIX, _COMPRESSED = 14, 15
_NUMERIC = range(6, 16)  # classes of arrays: double, single, eight integers
_COMPLEX = 0x0800
_HEAD = 1024  # bytes that hold the shape and the name of an array
_MOST = 1000  # variables


class Array(NamedTuple):
    """One variable: its shape, and a call that gives its values."""

    shape: tuple
    values: Callable

    def __call__(self) -> np.ndarray:
        return self.values()


def variables(raw: Raw) -> dict:
    """Name -> `Array` of every real numeric array of a MATLAB file; PatchfemError where the file is damaged."""
    path, data = raw.path, raw.data
    if data.startswith(b"MATLAB 7.3"):
        raise PatchfemError(f"{path}: a MATLAB file of version 7.3; save it with save(name, '-v7')")
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise PatchfemError(f"{path}: the header of the MATLAB file is damaged; save it anew")
    found, at = {}, 128
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, at)
        if at + 8 + size > len(data) or len(found) > _MOST:
            raise PatchfemError(f"{path}: the MATLAB file is cut off or damaged; save it anew")
        body = memoryview(data)[at + 8:at + 8 + size]
        try:
            one = _variable(raw, body, kind == _COMPRESSED, order) if kind in (_MATRIX, _COMPRESSED) else None
        except (*BROKEN, UnicodeDecodeError, MemoryError, TypeError) as error:
            raise PatchfemError(f"{path}: a variable of the MATLAB file is damaged ({reason(error)}); save it anew"
                                ) from None
        if one is not None:
            found[one[0]] = one[1]
        at += 8 + size + (0 if kind == _COMPRESSED else -size % 8)
    return found


def _variable(raw: Raw, body, packed: bool, order: str) -> tuple | None:
    """(name, `Array`) of an element, None for what is no real numeric array."""
    head, total = bytes(body[:_HEAD]), len(body)
    if packed:
        head = zlib.decompressobj().decompress(body, _HEAD)
        kind, total = struct.unpack_from(order + "II", head)
        if kind != _MATRIX:
            return None
        head = head[8:]
    _, flags, at = _element(head, 0, order)
    flag = struct.unpack_from(order + "I", flags)[0]
    if flag & 0xFF not in _NUMERIC or flag & _COMPLEX:
        return None
    _, dims, at = _element(head, at, order)
    shape = tuple(struct.unpack(f"{order}{len(dims) // 4}i", dims[:len(dims) // 4 * 4]))
    _, name, at = _element(head, at, order)
    count = 1
    for one in shape:
        count *= one
    if not shape or min(shape) < 0 or count > POINTS * 3:
        raise PatchfemError(f"{raw.path}: a variable of shape {shape}, more than {POINTS:.0e} points; save a part of "
                            "it")
    most = 8 * count + at + 16
    if total > most:
        raise ValueError(f"{total} bytes for {count} numbers")

    def values() -> np.ndarray:
        try:
            return _values(raw, body, packed, (order, shape, at, total))
        except (*BROKEN, MemoryError, TypeError) as error:
            raise PatchfemError(f"{raw.path}: variable {shown(name.decode('latin-1'))} is damaged ({reason(error)}); "
                                "save it anew") from None

    return name.decode("latin-1"), Array(shape, values)


def _values(raw: Raw, body, packed: bool, known: tuple) -> np.ndarray:
    order, shape, at, total = known
    if packed:
        if total > max(SMALL, RATIO * len(body)):
            raise PatchfemError(f"{raw.path}: a variable unpacks to more than {RATIO} times its packed size; save it "
                                "with save(name, '-v6')")
        unpack = zlib.decompressobj()
        body = unpack.decompress(body, 8 + total + 1)[8:]
        if not unpack.eof:  # there its checksum has been compared
            raise ValueError("it ends too early or too late")
    kind, stored, _ = _element(body, at, order)
    out = np.frombuffer(stored, order + _STORED[kind]).reshape(shape, order="F")
    return out.astype(float)


def _element(data, at: int, order: str) -> tuple:
    """(kind, data, where the next one begins) of the element at a place."""
    kind, size = struct.unpack_from(order + "II", data, at)
    if kind >> 16:  # four bytes or fewer, inside the tag
        kind, size, start, after = kind & 0xFFFF, kind >> 16, at + 4, at + 8
    else:
        start, after = at + 8, at + 8 + size + -size % 8
    if size > len(data) - start or (start == at + 4 and size > 4):
        raise ValueError("an element ends too early")
    return kind, bytes(data[start:start + size]), after
