"""Elements of a MATLAB file of version 5 to 7, which are looked at before SciPy reads them.

An element is the number of its type, the number of its bytes, and these bytes. A variable is an element with further
elements inside: its flags, dimensions, name and numbers, or the variables of a cell or a structure.
"""

import zlib
from collections.abc import Iterator
from typing import NamedTuple

from .packed import MAX_UNPACKED_BYTES

UNPACKED_PIECE_BYTES = 2**12  # bytes that are unpacked at once, to at most 1000 times as many
# Version and order of the bytes in the header of a file.
VERSION_5_MARKS = {b"\x00\x01IM": "little", b"\x01\x00MI": "big"}
COMPRESSED_TYPE = 15  # type number of a compressed variable
VARIABLE_TYPE = 14  # type number of a variable
# Type numbers of integers, floats and characters.
NUMBER_TYPES = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18)
SPARSE_CLASS = 5  # class of a sparse matrix
COMPLEX_FLAG = 1 << 11  # bit of the flags of complex numbers


class Element(NamedTuple):
    """Element of a file: number of its type, and where its content starts and ends."""

    kind: int
    start: int
    stop: int


def count_unpacked_bytes(data: bytes) -> int:
    """Return the unpacked size [bytes] of the compressed variables of a file, whose content is `data`.

    The count ends once it exceeds the limit. Raises zlib.error for damaged variables.
    """
    total = 0
    for variable in _list_variables(data):
        unpacker = zlib.decompressobj()
        stop = min(variable.stop, len(data))
        for start in range(variable.start, stop, UNPACKED_PIECE_BYTES):
            if variable.kind == COMPRESSED_TYPE and total <= MAX_UNPACKED_BYTES:
                total += len(
                    unpacker.decompress(data[start : min(start + UNPACKED_PIECE_BYTES, stop)])
                )
    return total


def check_elements(data: bytes) -> None:
    """Raise ValueError if an element inside a variable of a file has a wrong type or length.

    SciPy 1.17 ends the process there. `data` is the content of the file. Nothing is checked in another version. Raises
    zlib.error for compressed variables that are damaged or cut off.
    """
    order = VERSION_5_MARKS.get(data[124:128])
    for variable in _list_variables(data):
        content = data
        if variable.kind == COMPRESSED_TYPE:
            # Only one variable is unpacked at a time, because all together may be large.
            content = zlib.decompress(memoryview(data)[variable.start : variable.stop])
            variable = next(_list_elements(content, order, 0, len(content)), None)
        if variable is not None and variable.kind == VARIABLE_TYPE:
            if variable.stop > len(content):
                raise ValueError("a variable is cut off")
            _check_variable(content, order, variable)


def _check_variable(data: bytes, order: str, outer: Element) -> None:
    """Raise ValueError if an element inside a variable, `outer`, or inside its variables is wrong.

    `order` is that of the bytes, "little" or "big".
    """
    variables = [outer]
    while variables:
        variable = variables.pop()
        parts = list(_list_elements(data, order, variable.start, variable.stop))
        if not parts:
            continue  # an empty cell
        flags = int.from_bytes(data[parts[0].start : parts[0].start + 4], order)
        array_class = flags & 0xFF

        # Numbers follow flags, dimensions and name. A sparse matrix has two arrays of places before them.
        count = 4 + 2 * (array_class == SPARSE_CLASS) + bool(flags & COMPLEX_FLAG)
        allowed = NUMBER_TYPES
        # Cells, structures, objects, functions and opaque objects contain variables
        if array_class in (1, 2, 3, 16, 17):
            count = len(parts)
            allowed = (*NUMBER_TYPES, VARIABLE_TYPE)
        if len(parts) < count:
            raise ValueError("a variable is incomplete")
        for part in parts[:count]:
            if part.kind not in allowed:
                raise ValueError(f"an element has the unknown type {part.kind}")
            if part.stop > variable.stop:
                raise ValueError("an element is longer than its variable")
        variables += [part for part in parts[:count] if part.kind == VARIABLE_TYPE]


def _list_variables(data: bytes) -> Iterator[Element]:
    """Iterate over the variables of a file with a content, or over nothing for another version."""
    # The header has 128 bytes
    order = VERSION_5_MARKS.get(data[124:128])
    return _list_elements(data, order, 128 if order else len(data), len(data), unit=1)


def _list_elements(
    data: bytes, order: str, place: int, stop: int, unit: int = 8
) -> Iterator[Element]:
    """Iterate over the data elements between two byte offsets of a file; `order` is its byte order, "little" or "big".

    Inside a variable they begin at multiples of eight bytes, the `unit`.
    """
    while place + 8 <= min(stop, len(data)):
        kind = int.from_bytes(data[place : place + 4], order)
        # Up to four bytes stand in the place of their number, which is in the upper half of the type.
        small_count = kind >> 16
        if small_count:
            yield Element(kind & 0xFFFF, place + 4, place + 4 + small_count)
            place += 8
            continue
        count = int.from_bytes(data[place + 4 : place + 8], order)
        yield Element(kind, place + 8, place + 8 + count)
        place += 8 + -(-count // unit) * unit
