"""Matrices from Nastran: OUTPUT4 files (.op4) and DMIG cards (.pch, .bdf, .dat).

Layouts: MSC Nastran DMAP and Quick Reference guides, OUTPUT4 and DMIG. An OUTPUT4 matrix is a header
(columns, rows, form, type, name) and a record for each column (column, first row, words, numbers). First
row 0 means that strings follow, which are runs of consecutive rows. A string begins with its length and
its first row, in one word, or in two if the header gives the number of rows as a negative number.
"""

import re
import struct
from contextlib import AbstractContextManager
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..core import PatchfemError
from .damage import refuse_damage

MAX_NUMBERS = 5 * 10**7  # largest number of values in a matrix
MAX_ROWS = 2 * 10**6  # largest number of rows in a matrix
ROW_FACTOR = 2**16  # factor in the header word of a string, which is length * ROW_FACTOR + row
SYMMETRIC_FORM = 6  # form of a DMIG matrix of which one triangle is stored
WIDE_FIELD_CHARACTERS = 16  # width of a wide field of a DMIG card in characters
_NUMBER_PATTERN = re.compile(r"([+-]?[\d.]+)(?:[ED]?([+-]?\d+))?\Z", re.IGNORECASE)


class StringMatrix:
    """Matrix of an OUTPUT4 file, stored as strings: runs of consecutive rows in one column.

    Parameters
    ----------
    path : Path
        File, for error messages.
    shape : tuple
        Rows, which may be negative, and columns.
    number : numpy.dtype
        Format of a number: a float, or a text of some width.

    A reader appends to two lists: to `places` the column and the row at which a string begins, from 1,
    and to `strings` its numbers as bytes.
    """

    def __init__(self, path, shape: tuple, number: np.dtype):
        rows = abs(shape[0])
        columns = shape[1]
        if rows > MAX_ROWS or not 0 <= columns <= MAX_ROWS:
            raise ValueError(f"the header announces {rows} rows and {columns} columns")
        self.path = path
        self.shape = (rows, columns)
        self.number = number
        self.places = []
        self.strings = []

    def assemble(self) -> sparse.csr_array:
        """Return the matrix; raise PatchfemError if its rows do not fit or its numbers cannot be read."""
        with _refuse_output4(self.path):
            numbers = np.frombuffer(b"".join(self.strings), self.number).astype(float)
            sizes = np.array([len(string) for string in self.strings], int) // self.number.itemsize
            column, row = np.array(self.places, int).reshape(-1, 2).T
            last = row + sizes - 1
            is_outside = (row < 1) | (last > self.shape[0])
            if is_outside.any():
                raise ValueError(
                    f"the matrix uses row {last[is_outside][0]}, but the matrix has {self.shape[0]} rows"
                )
            rows = np.arange(numbers.size) + np.repeat(last - np.cumsum(sizes), sizes)
            columns = np.repeat(column - 1, sizes)
            return sparse.coo_array((numbers, (rows, columns)), self.shape).tocsr()


def read_output4(path) -> dict[str, StringMatrix]:
    """Read the matrices of an OUTPUT4 file; raise PatchfemError if it is damaged or complex."""
    with open(path, "rb") as file:
        data = file.read()
    is_binary = 0 in data[:8]
    with _refuse_output4(path):
        matrices = _read_binary(path, data) if is_binary else _read_text(path, data)
    if not matrices:
        raise PatchfemError(f"{path}: contains no matrix")
    return matrices


def _refuse_output4(path) -> AbstractContextManager:
    return refuse_damage(f"{path}: not a readable OUTPUT4 file")


def _count_words_per_number(number_type: int) -> int:
    """Return the words per number for a number type: 1 single, 2 double precision, 3 and 4 complex."""
    if number_type in (3, 4):
        raise ValueError("a matrix is complex; write only the real part")
    return {1: 1, 2: 2}[number_type]


def _read_binary(path, data: bytes) -> dict[str, StringMatrix]:
    """Read Fortran records: size, content, size.

    The first record shows the byte order and the size of a word.
    """
    order = "<" if struct.unpack_from("<i", data)[0] in (24, 48) else ">"
    (size,) = struct.unpack_from(order + "i", data)
    if size not in (24, 48):
        raise ValueError("it does not begin with the header of a matrix")
    word = size // 6
    integer = "q" if word == 8 else "i"
    record_header = struct.Struct(f"{order}3{integer}")
    matrices = {}
    matrix = None
    offset = 0
    while offset < len(data):
        (size,) = struct.unpack_from(order + "i", data, offset)
        record = data[offset + 4 : offset + 4 + size]
        offset += 8 + size
        if size < 0 or len(record) < size or size % word:
            raise ValueError("it is cut off")
        if matrix is None:
            columns, rows, _, number_type = struct.unpack_from(f"{order}4{integer}", record)
            is_double = _count_words_per_number(number_type) == 2 or word == 8
            number = np.dtype(f"{order}f{8 if is_double else 4}")
            name = record[4 * word :].decode("ascii").strip()
            matrix = matrices.setdefault(name, StringMatrix(path, (rows, columns), number))
            has_long_headers = rows < 0
            string_header = struct.Struct(f"{order}{2 if has_long_headers else 1}{integer}")
            places = matrix.places
            strings = matrix.strings
            continue
        column, row, count = record_header.unpack_from(record)
        if column > matrix.shape[1]:
            matrix = None
            continue
        start = 3 * word
        end = start + count * word
        if row:
            places.append((column, row))
            strings.append(record[start:end])
            continue
        end = min(end, size)
        while start < end:
            if has_long_headers:
                length, first_row = string_header.unpack_from(record, start)
            else:
                length, first_row = divmod(string_header.unpack_from(record, start)[0], ROW_FACTOR)
            start += string_header.size
            stop = start + (length - 1) * word
            if stop < start:
                raise ValueError("a string of the matrix has no rows")
            places.append((column, first_row))
            strings.append(record[start:stop])
            start = stop
    return matrices


def _read_text(path, data: bytes) -> dict[str, StringMatrix]:
    lines = [line.rstrip() for line in data.split(b"\n") if line.strip()]
    matrices = {}
    index = 0
    while index < len(lines):
        columns, rows, _, number_type = _parse_integers(lines[index], 4)
        _count_words_per_number(number_type)
        name = lines[index][32:40].decode("ascii").strip()
        number_format = re.search(rb"[ED](\d+)\.", lines[index][40:])
        number = np.dtype(("S", int(number_format[1]) if number_format else WIDE_FIELD_CHARACTERS))
        matrix = matrices.setdefault(name, StringMatrix(path, (rows, columns), number))
        header_words = 2 if rows < 0 else 1
        index += 1
        while True:
            column, row, _ = _parse_integers(lines[index], 3)
            index += 1
            if column > columns:
                index = _find_numbers_end(lines, index)
                break
            if row:
                end = _find_numbers_end(lines, index)
                matrix.places.append((column, row))
                matrix.strings.append(_join_numbers(lines[index:end]))
                index = end
                continue
            while index < len(lines) and len(header := lines[index].split()) == header_words:
                first_row = int(header[1]) if header_words == 2 else int(header[0]) % ROW_FACTOR
                end = _find_numbers_end(lines, index + 1)
                matrix.places.append((column, first_row))
                matrix.strings.append(_join_numbers(lines[index + 1 : end]))
                index = end
    return matrices


def _join_numbers(parts: list[bytes]) -> bytes:
    """Join strings of numbers, with the exponent letter D replaced by E."""
    return b"".join(parts).upper().replace(b"D", b"E")


def _parse_integers(line: bytes, count: int) -> list[int]:
    """Read the first integers of a line, in fields of eight characters."""
    return [int(line[8 * k : 8 * k + 8]) for k in range(count)]


def _find_numbers_end(lines: list, index: int) -> int:
    """Return the index of the first line after a block of numbers, which have decimal points."""
    while index < len(lines) and b"." in lines[index][:16]:
        index += 1
    return index


class DmigColumn(NamedTuple):
    """Column of a DMIG matrix: line of its card, node, component, and number of its first entry."""

    line: int
    node: int
    component: int
    first_entry: int


class DmigMatrix:
    """DMIG matrix of a Nastran file, whose entries consist of node, component and number."""

    def __init__(self, path, form: int):
        self.path = path
        self.form = form
        self.columns = []
        self.entries = []

    def add(self, node: str, component: str, number: str) -> None:
        """Add an entry to the last column of the matrix.

        Parameters
        ----------
        node, component : str
            Row of the entry; the component of a scalar point may be empty.
        number : str
        """
        self.entries.append(
            f"{node:>{WIDE_FIELD_CHARACTERS}}{component or '0':>{WIDE_FIELD_CHARACTERS}}{number:>{WIDE_FIELD_CHARACTERS}}"
        )

    def assemble(self) -> tuple[sparse.csr_array, np.ndarray]:
        """Return the matrix (n, n), and node and component (n, 2) of its rows.

        Raises PatchfemError with the line of the first card that cannot be read.
        """
        first_entries = [column.first_entry for column in self.columns]
        sizes = np.diff([*first_entries, len(self.entries)])
        try:
            text = _join_numbers(["".join(self.entries).encode("ascii")])
            fields = np.frombuffer(text, f"S{WIDE_FIELD_CHARACTERS}").reshape(-1, 3)
            rows = fields[:, :2].astype(int)
            numbers = fields[:, 2].astype(float)
        except ValueError:  # a blank component, or 1.5-3 for 1.5E-3
            rows, numbers = self._parse_entries(sizes)
        columns = np.array([column[1:3] for column in self.columns], int).reshape(-1, 2)
        places, index = rank_dofs(np.vstack([rows, np.repeat(columns, sizes, axis=0)]))
        values = sparse.coo_array((numbers, index.reshape(2, -1)), 2 * (len(places),)).tocsr()
        return (
            complete_symmetric_matrix(values) if self.form == SYMMETRIC_FORM else values
        ), places

    def _parse_entries(self, sizes: np.ndarray) -> tuple:
        """Parse the entries one by one, to accept all spellings of numbers."""
        rows = []
        numbers = []
        lines = np.repeat([column.line for column in self.columns], sizes)
        for line, entry in zip(lines, self.entries):
            with refuse_damage(f"{self.path}:{line}: not a readable DMIG card"):
                component = entry[WIDE_FIELD_CHARACTERS : 2 * WIDE_FIELD_CHARACTERS].strip() or "0"
                rows.append((int(entry[:WIDE_FIELD_CHARACTERS]), int(component)))
                numbers.append(parse_real(entry[2 * WIDE_FIELD_CHARACTERS :].strip()))
        return np.array(rows, int).reshape(-1, 2), np.array(numbers)


def complete_symmetric_matrix(triangle: sparse.csr_array) -> sparse.csr_array:
    """Return the symmetric matrix of which one triangle is given."""
    return (triangle + (triangle - sparse.diags_array(triangle.diagonal())).T).tocsr()


def rank_dofs(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sorted distinct degrees of freedom (n, 2), and the index (k,) of each input row in them.

    A degree of freedom is a row of node and direction.
    """
    if not places.size:
        return places, np.zeros(0, int)
    if places.min() < 0 or places.max() >= 2**31:
        raise ValueError(
            f"{places.min()} to {places.max()} are not possible numbers of nodes and directions"
        )
    base = int(places[:, 1].max()) + 1
    keys, index = np.unique(places[:, 0] * base + places[:, 1], return_inverse=True)
    return np.stack(np.divmod(keys, base), axis=1), index


def read_dmig(path) -> dict[str, DmigMatrix]:
    """Read the real DMIG matrices of a punch or bulk data file.

    Component 0 is that of a scalar point.

    Raises PatchfemError with the line of a card that cannot be read.
    """
    matrices = {}
    matrix = None
    with open(path, encoding="latin-1") as file:
        for number, line in enumerate(file, 1):
            is_wide = matrix is not None and line[0] == "*" and len(line) > 56
            if is_wide and "," not in line and "$" not in line:
                matrix.entries.append(line[8:56])
                continue
            line = line.split("$")[0].rstrip()
            if not line:
                continue
            is_card = line[:4].upper() == "DMIG"
            if not is_card and line[0] not in "+*, ":
                matrix = None
                continue
            try:
                fields = _split_card(line, is_wide=line[4:5] == "*" if is_card else line[0] == "*")
                if is_card:
                    matrix = _start_card(path, matrices, number, fields)
                    fields = fields[4:]
                for k in range(0, len(fields) if matrix is not None else 0, 4):
                    if fields[k]:
                        matrix.add(*fields[k : k + 3])
            except (ValueError, IndexError, KeyError) as error:
                raise PatchfemError(
                    f"{path}:{number}: not a readable DMIG card ({error})"
                ) from None
    if not matrices:
        raise PatchfemError(
            f"{path}: contains no DMIG card; punch the matrices with EXTSEOUT(DMIGPCH) or a DMAP alter"
        )
    return matrices


def _start_card(path, matrices: dict, line: int, fields: list) -> DmigMatrix | None:
    """Start a matrix from its header card, or one of its columns; return the matrix of the column."""
    name = fields[0].upper()
    if fields[1] == "0" and name not in matrices:
        if int(fields[3]) > 2:
            raise ValueError("the matrix is complex; write only the real part")
        matrices[name] = DmigMatrix(path, int(fields[2]))
        return None
    matrix = matrices[name]
    column = DmigColumn(line, int(fields[1]), int(fields[2] or 0), len(matrix.entries))
    matrix.columns.append(column)
    return matrix


def parse_real(text: str) -> float:
    """Parse a Nastran number, as in 1.5-3, 1.5D-3 and 1.5E-3; raise ValueError for other text."""
    match = _NUMBER_PATTERN.match(text)
    if match is None:
        raise ValueError(f"'{text}' is not a number")
    return float(f"{match[1]}e{match[2] or 0}")


def _split_card(line: str, *, is_wide: bool) -> list[str]:
    """Split a Nastran card into its fields, and leave out the first field."""
    count = 4 if is_wide else 8
    width = 64 // count
    fields = line.split(",")[1:]
    if "," not in line:
        fields = [line[8 + k * width : 8 + (k + 1) * width] for k in range(count)]
    padding = [""] * count
    return [*(field.strip() for field in fields), *padding][:count]
