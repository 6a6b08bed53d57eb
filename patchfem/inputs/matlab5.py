"""Arrays of a MATLAB file of version 5 to 7.

They are numbers, sparse matrices, strings and fields of single structures.

Other content is ignored. Layout: "MAT-File Format", The MathWorks. A file is a list of elements; an
element is a tag (data type, number of bytes) and its data, padded to eight bytes. A variable is an element
whose data are elements: flags, shape, name, then the values.

The size of a variable is read from its header and limited before it is unpacked, and every count is
compared with the bytes that are there. SciPy 1.17 trusts the counts: of the first 182 damaged files of
tests/inputs/test_matlab.py that are not packed, 11 end its process (signal 11), which cannot be refused.
"""

import struct
import zlib
from collections.abc import Callable, Iterator
from enum import IntEnum
from functools import partial
from math import prod
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..core import PatchfemError
from .damage import refuse_damage

MAX_NUMBERS = 15 * 10**7  # largest number of values in one variable
MAX_VARIABLES = 1000
MAX_NESTING = 8  # largest depth of nested structures
# Largest ratio of unpacked to packed size of a variable above UNPACK_CHECK_BYTES.
MAX_UNPACK_RATIO = 200
UNPACK_CHECK_BYTES = 2**20
HEADER_BYTES = 1024  # number of bytes of a packed variable that contain its shape and its name
COMPLEX_FLAG = 0x0800
FILE_HEADER_DAMAGE = (
    "the header of the MATLAB file is damaged or of version 4; save it anew with save(name, '-v7')"
)
DAMAGE_REMEDY = "; save it anew"
VARIABLE_DAMAGE = "a variable of the MATLAB file is damaged"


class DataType(IntEnum):
    """Data types of the elements of a MATLAB file of version 5."""

    INT8 = 1
    UINT8 = 2
    INT16 = 3
    UINT16 = 4
    INT32 = 5
    UINT32 = 6
    SINGLE = 7
    DOUBLE = 9
    INT64 = 12
    UINT64 = 13
    MATRIX = 14
    COMPRESSED = 15
    UTF8 = 16
    UTF16 = 17


class ArrayClass(IntEnum):
    """Classes of the variables of a MATLAB file of version 5."""

    CELL = 1
    STRUCT = 2
    CHAR = 4
    SPARSE = 5
    DOUBLE = 6
    UINT64 = 15


_NUMERIC_CLASSES = range(ArrayClass.DOUBLE, ArrayClass.UINT64 + 1)
_READABLE_CLASSES = (
    ArrayClass.CELL,
    ArrayClass.STRUCT,
    ArrayClass.CHAR,
    ArrayClass.SPARSE,
    *_NUMERIC_CLASSES,
)
_ENCODINGS = {
    DataType.UINT8: "latin-1",
    DataType.UTF8: "utf-8",
    DataType.UTF16: "utf-16",
    DataType.UINT16: "utf-16",
}


class Array(NamedTuple):
    """Value of a MATLAB variable, whose numbers are read only when they are needed.

    kind: "number", "sparse" or "text"; values(): full array of floats, or strings (k,); sparse(): sparse
    array of a sparse variable, None for others.
    """

    kind: str
    shape: tuple
    values: Callable
    sparse: Callable | None = None


class _Element(NamedTuple):
    """Data element of a MATLAB file, with the offset of the next element."""

    kind: int
    data: bytes
    end: int


class _Variable(NamedTuple):
    """Variable of a MATLAB file whose values have not been read yet.

    body: its bytes in the file; is_packed: whether they are compressed; kind: its class, with COMPLEX_FLAG
    if its numbers are complex; start: position of the values; size: bytes of the unpacked variable.
    """

    body: bytes | memoryview
    is_packed: bool
    kind: int
    shape: tuple
    name: str
    start: int
    size: int


def read_variables(path, data: bytes) -> dict:
    """Read the variables of a MATLAB file, as `matlab.read_variables` does."""
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise PatchfemError(f"{path}: {FILE_HEADER_DAMAGE}")
    file = _MatFile(path, order)
    arrays = {}
    offset = 128
    while offset + 8 <= len(data):
        kind, size = struct.unpack_from(order + "II", data, offset)
        if offset + 8 + size > len(data) or len(arrays) > MAX_VARIABLES:
            raise PatchfemError(f"{path}: the MATLAB file is cut off or damaged; save it anew")
        body = memoryview(data)[offset + 8 : offset + 8 + size]
        offset += 8 + size
        if kind == DataType.COMPRESSED:
            arrays |= file.list_arrays(file.unpack_header(body))
            continue
        offset += -size % 8
        if kind == DataType.MATRIX:
            arrays |= file.list_arrays(file.read_header(body))
    return arrays


class _MatFile(NamedTuple):
    """MATLAB file of version 5, with the byte order of its numbers."""

    path: str
    order: str

    def unpack_header(self, body) -> _Variable | None:
        """Read the header of a compressed variable."""
        with refuse_damage(f"{self.path}: {VARIABLE_DAMAGE}", DAMAGE_REMEDY):
            head = zlib.decompressobj().decompress(body, HEADER_BYTES)
            kind, size = struct.unpack_from(self.order + "II", head)
            if kind != DataType.MATRIX:
                return None
            variable = self.parse_header(head[8:])._replace(body=body, is_packed=True, size=size)
            return self.check_header(variable)

    def read_header(self, body) -> _Variable | None:
        """Read the header of a variable that is not compressed."""
        with refuse_damage(f"{self.path}: {VARIABLE_DAMAGE}", DAMAGE_REMEDY):
            return self.check_header(self.parse_header(body))

    def parse_header(self, body) -> _Variable:
        """Parse the header of a variable: its flags, its shape and its name."""
        _, flags, offset = self.read_element(body, 0)
        _, dimensions, offset = self.read_element(body, offset)
        _, name, offset = self.read_element(body, offset)
        (flag,) = struct.unpack_from(self.order + "I", flags)
        shape = struct.unpack(f"{self.order}{len(dimensions) // 4}i", dimensions)
        kind = flag & (0xFF | COMPLEX_FLAG)
        return _Variable(body, False, kind, shape, name.decode("latin-1"), offset, len(body))

    def check_header(self, variable: _Variable) -> _Variable | None:
        """Check the shape and size of a variable, or return None if its class cannot be read.

        Real, sparse, character, cell and structure arrays can be read. A variable that is too large raises
        PatchfemError.
        """
        kind = variable.kind
        shape = variable.shape
        if kind not in _READABLE_CLASSES:
            return None
        count = prod(shape)
        n_numbers = max(shape, default=0) if kind == ArrayClass.SPARSE else count
        if not shape or min(shape) < 0 or n_numbers > MAX_NUMBERS:
            raise PatchfemError(
                f"{self.path}: a variable of shape {shape}, more than {MAX_NUMBERS:.1e} numbers; save a "
                "part of it"
            )
        if kind in _NUMERIC_CLASSES and variable.size > 8 * count + variable.start + 16:
            raise ValueError(f"{variable.size} bytes for {count} numbers")
        return variable

    def list_arrays(self, variable: _Variable | None, depth: int = 0) -> dict:
        """List the arrays of a variable by name: itself, or the fields of a structure."""
        if variable is None:
            return {}
        if variable.kind != ArrayClass.STRUCT:
            return {variable.name: self.make_array(variable)}
        if max(variable.shape) > 1 or min(variable.shape) < 1 or depth >= MAX_NESTING:
            return {}
        arrays = {}
        with refuse_damage(f"{self.path}: a structure is damaged", DAMAGE_REMEDY):
            for name, body in self.list_fields(self.unpack(variable), variable.start):
                field = self.check_header(self.parse_header(body))
                if field is not None and len(arrays) < MAX_VARIABLES:
                    field = field._replace(name=f"{variable.name}.{name}")
                    arrays |= self.list_arrays(field, depth + 1)
        return arrays

    def list_fields(self, data, offset: int) -> Iterator[tuple]:
        """Yield the name and the contents of each field of a MATLAB structure.

        The structure begins with the number of bytes of each field name, then all names, then the contents.
        """
        _, length, offset = self.read_element(data, offset)
        _, names, offset = self.read_element(data, offset)
        (width,) = struct.unpack(self.order + "i", length)
        if not 0 < width <= 64 or len(names) % width:
            raise ValueError("the list of its field names has a wrong length")
        for first in range(0, len(names), width):
            kind, body, offset = self.read_element(data, offset)
            if kind != DataType.MATRIX:
                raise ValueError("one of its fields is not an array")
            if body:
                name = names[first : first + width].split(b"\0")[0]
                yield name.decode("latin-1"), memoryview(body)

    def make_array(self, variable: _Variable) -> Array:
        """Make an array whose values are unpacked when they are first requested."""
        name = variable.name[:40] if variable.name.isprintable() else "?"

        def read(convert: Callable):
            """Decompress the variable and convert its data; raise PatchfemError if they are damaged."""
            with refuse_damage(f"{self.path}: variable {name} is damaged", DAMAGE_REMEDY):
                return convert(self.unpack(variable), variable)

        if variable.kind == ArrayClass.SPARSE:
            return make_sparse_array(self.path, variable.shape, partial(read, self.read_sparse))
        if variable.kind in _NUMERIC_CLASSES:
            return Array("number", variable.shape, partial(read, self.read_numbers))
        return Array("text", variable.shape, partial(read, self.read_texts))

    def unpack(self, variable: _Variable) -> bytes:
        """Return the uncompressed bytes of a variable, whose length must be the declared one."""
        body = variable.body
        if not variable.is_packed:
            return body
        if variable.size > max(UNPACK_CHECK_BYTES, MAX_UNPACK_RATIO * len(body)):
            raise PatchfemError(
                f"{self.path}: a variable unpacks to more than {MAX_UNPACK_RATIO} times its packed size; "
                "save it with save(name, '-v6')"
            )
        stream = zlib.decompressobj()
        data = stream.decompress(body, 8 + variable.size + 1)[8:]
        if not stream.eof:  # zlib compares the checksum at the end of the stream
            raise ValueError("the data are longer or shorter than the header announces")
        return data

    def read_numbers(self, data, variable: _Variable) -> np.ndarray:
        """Return a full array of floats."""
        kind, values, _ = self.read_element(data, variable.start)
        return self.to_numbers(kind, values).reshape(variable.shape, order="F").astype(float)

    def read_sparse(self, data, variable: _Variable) -> sparse.csc_array:
        """Return a sparse matrix, stored as row indices, starts of the columns and values."""
        parts = []
        offset = variable.start
        for _ in range(3):
            kind, values, offset = self.read_element(data, offset)
            parts.append(self.to_numbers(kind, values))
        return make_sparse(*parts, variable.shape)

    def to_numbers(self, kind: int, data: bytes) -> np.ndarray:
        """Interpret the data of an element as numbers."""
        if kind > DataType.UINT64:
            raise ValueError(f"data of type {kind} are no numbers")
        dtype = np.dtype(DataType(kind).name.lower())
        return np.frombuffer(data, dtype.newbyteorder(self.order))

    def read_texts(self, data, variable: _Variable) -> np.ndarray:
        """Return the rows of a character array, or the first row of each string in a cell array."""
        if variable.kind == ArrayClass.CHAR:
            kind, stored, _ = self.read_element(data, variable.start)
            encoding = _ENCODINGS[kind]
            if encoding == "utf-16":
                encoding += "-le" if self.order == "<" else "-be"
            letters = np.array(list(stored.decode(encoding)), dtype=object)
            letters = letters.reshape(variable.shape, order="F").reshape(variable.shape[0], -1)
            return make_texts("".join(row) for row in letters)
        texts = []
        offset = variable.start
        while len(texts) < max(variable.shape, default=0):
            kind, stored, offset = self.read_element(data, offset)
            cell = self.parse_header(stored)
            if kind != DataType.MATRIX or cell.kind != ArrayClass.CHAR:
                raise ValueError("a cell does not contain text")
            texts.append(self.read_texts(stored, cell)[0])
        return make_texts(texts)

    def read_element(self, data, offset: int) -> _Element:
        """Read the element at an offset [bytes]."""
        kind, size = struct.unpack_from(self.order + "II", data, offset)
        start = offset + 8
        end = start + size + -size % 8
        is_small = kind >> 16 > 0  # data of up to four bytes are stored inside the tag
        if is_small:
            size = kind >> 16
            kind &= 0xFFFF
            start = offset + 4
            end = offset + 8
        if size > len(data) - start or (is_small and size > 4):
            raise ValueError("an element ends too early")
        return _Element(kind, bytes(data[start : start + size]), end)


def make_sparse(rows, starts, values, shape: tuple) -> sparse.csc_array:
    """Make a sparse matrix.

    Parameters
    ----------
    rows : (k,) array_like
        Row indices.
    starts : (m + 1,) array_like
        Starts of the columns in `rows` and `values`.
    values : (k,) array_like
    shape : tuple
        (n, m).

    Returns
    -------
    scipy.sparse.csc_array

    Raises
    ------
    ValueError
        If the arrays do not fit together.
    """
    if (
        starts.size != shape[1] + 1
        or starts[0] != 0
        or (np.diff(starts) < 0).any()
        or starts[-1] > min(rows.size, values.size)
    ):
        raise ValueError("the column pointers of the sparse matrix do not fit its size")
    rows = rows[: starts[-1]]
    values = values[: starts[-1]].astype(float)
    if rows.size and not 0 <= rows.min() <= rows.max() < shape[0]:
        raise ValueError("a row number lies outside the sparse matrix")
    return sparse.csc_array((values, rows.astype(np.int64), starts.astype(np.int64)), shape=shape)


def make_sparse_array(path, shape: tuple, reader: Callable) -> Array:
    """Make the array of a sparse variable.

    Parameters
    ----------
    path : Path
        File, for error messages.
    shape : tuple
    reader : callable
        Function that reads the sparse matrix.

    Returns
    -------
    Array
        Its full values are refused if there are too many of them.
    """

    def read_full() -> np.ndarray:
        """Read the matrix as a full array."""
        if prod(shape) > MAX_NUMBERS:
            raise PatchfemError(
                f"{path}: a sparse variable of shape {shape}, more than {MAX_NUMBERS:.1e} numbers in "
                "full; save a part of it"
            )
        return reader().toarray()

    return Array("sparse", shape, read_full, reader)


def make_texts(texts) -> np.ndarray:
    """Make an array of strings; blanks at their ends are removed."""
    texts = [text.rstrip() for text in texts]
    array = np.empty(len(texts), dtype=object)
    array[:] = texts
    return array
