"""Matrices that Nastran writes: OUTPUT4 files (.op4), in text or binary, and DMIG cards in punch files (.pch).

Layouts: MSC Nastran DMAP and Quick Reference guides, OUTPUT4 and DMIG. An OUTPUT4 matrix is a record (columns, rows,
form, type, name) and one per column (column, first row, words, numbers); first row 0 marks strings of rows that are not
zero, each with its length and row in one word, or in two where the count of rows is written negative.
"""

import re
import struct
from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..core import PatchfemError

MOST = 5 * 10**7  # numbers of a matrix
SIDE = 2 * 10**6  # rows of a matrix
SYMMETRIC = 6
_NUMBER = re.compile(r"([+-]?[\d.]+)(?:[ED]?([+-]?\d+))?\Z", re.IGNORECASE)


class Cards(NamedTuple):
    """One matrix of a file: a sparse array (n, n) and places (n, 2) of its rows, node and component, or None."""

    values: object
    places: np.ndarray | None = None


class _Entries:
    """Rows, columns and numbers of a matrix as they come."""

    def __init__(self, rows: int, columns: int):
        if not 0 <= rows <= SIDE or not 0 <= columns <= SIDE:
            raise ValueError(f"it announces {rows} rows and {columns} columns")
        self.shape, self.parts = (rows, columns), []

    def add(self, row: int, column: int, numbers) -> None:
        """Numbers (k,) from a row on, both counted from 1."""
        if row < 1 or row + len(numbers) - 1 > self.shape[0]:
            raise ValueError(f"row {row + len(numbers) - 1} of {self.shape[0]}")
        self.parts.append((row - 1, column - 1, numbers))

    def matrix(self):
        """The sparse array."""
        sizes = [len(numbers) for _, _, numbers in self.parts]
        rows = np.concatenate([np.arange(row, row + size) for (row, _, _), size in zip(self.parts, sizes)] or [[]])
        columns = np.repeat([column for _, column, _ in self.parts], sizes)
        numbers = np.concatenate([numbers for _, _, numbers in self.parts] or [[]])
        return sparse.coo_array((numbers.astype(float), (rows.astype(int), columns.astype(int))), self.shape).tocsr()


def output4(path) -> dict:
    """Name -> `Cards` of the matrices of an OUTPUT4 file; PatchfemError where it is damaged or complex."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        found = _binary(data) if 0 in data[:8] else _text(data.decode("ascii"))
    except (ValueError, IndexError, KeyError, struct.error, UnicodeDecodeError) as error:
        raise PatchfemError(f"{path}: not a readable OUTPUT4 file ({error})") from None
    if not found:
        raise PatchfemError(f"{path}: holds no matrix")
    return {name: Cards(entries.matrix()) for name, entries in found.items()}


def _kind(number: int) -> int:
    """Words of a number of a type of OUTPUT4."""
    if number in (3, 4):
        raise ValueError("a matrix is complex; write only its real part")
    return {1: 1, 2: 2}[number]


def _binary(data: bytes) -> dict:
    order = next(one for one in "<>" if struct.unpack_from(one + "i", data)[0] in (24, 48))
    wide = 8 if struct.unpack_from(order + "i", data)[0] == 48 else 4  # bytes of a word
    whole, at, found = f"{order}{'q' if wide == 8 else 'i'}", 0, {}
    entries = None
    while at < len(data):
        size = struct.unpack_from(order + "i", data, at)[0]
        record, at = data[at + 4:at + 4 + size], at + 8 + size
        if len(record) < size or size % wide:
            raise ValueError("it is cut off")
        if entries is None:
            columns, rows, _, kind = struct.unpack_from(whole[0] + 4 * whole[1], record)
            words, big = _kind(kind), rows < 0
            number = f"{order}f{8 if wide == 8 or words == 2 else 4}"
            words = 1 if wide == 8 else words
            entries = found.setdefault(record[4 * wide:].decode("ascii").strip(), _Entries(abs(rows), columns))
            continue
        column, row, count = struct.unpack_from(whole[0] + 3 * whole[1], record)
        if column > entries.shape[1]:
            entries = None
            continue
        body = record[3 * wide:(3 + count) * wide]
        if row:
            entries.add(row, column, np.frombuffer(body, number))
            continue
        place = 0
        while place < len(body):
            long, first = struct.unpack_from(whole[0] + 2 * whole[1], body, place) if big else \
                divmod(struct.unpack_from(whole, body, place)[0], 65536)
            place += (2 if big else 1) * wide
            entries.add(first, column, np.frombuffer(body[place:place + (long - 1) * wide], number))
            place += (long - 1) * wide
    return found


def _text(text: str) -> dict:
    lines, found, at = [line for line in text.split("\n") if line.strip()], {}, 0

    def numbers(at: int, width: int) -> tuple:
        out = []
        while at < len(lines) and "." in lines[at][:16]:
            line = lines[at].rstrip()
            out += [float(line[k:k + width].replace("D", "E")) for k in range(0, len(line), width)]
            at += 1
        return np.array(out), at

    while at < len(lines):
        columns, rows, _, kind = (int(lines[at][8 * k:8 * k + 8]) for k in range(4))
        _kind(kind)
        name, told = lines[at][32:40].strip(), re.search(r"[ED](\d+)\.", lines[at][40:])
        width, big = int(told[1]) if told else 16, rows < 0
        entries = found.setdefault(name, _Entries(abs(rows), columns))
        at += 1
        while True:
            column, row, _ = (int(lines[at][8 * k:8 * k + 8]) for k in range(3))
            at += 1
            if row or column > columns:
                values, at = numbers(at, width)
                if column > columns:
                    break
                entries.add(row, column, values)
                continue
            while at < len(lines) and len(told := lines[at].split()) == (2 if big else 1):
                first = int(told[1]) if big else int(told[0]) % 65536
                values, at = numbers(at + 1, width)
                entries.add(first, column, values)
    return found


def punched(path) -> dict:
    """Name -> `Cards` of the real DMIG matrices of a punch or bulk data file, rows by nodes and components in order.

    Component 0 is that of a scalar point. PatchfemError with the line of a card that cannot be read.
    """
    forms, entries = {}, {}
    for number, fields in _cards(path):
        try:
            name = fields[1].upper()
            if fields[2] == "0" and name not in forms:
                if int(fields[4]) > 2:
                    raise ValueError("it is complex; write only its real part")
                forms[name], entries[name] = int(fields[3]), []
                continue
            column = int(fields[2]), int(fields[3] or 0)
            for k in range(5, len(fields), 4):
                if fields[k]:
                    entries[name].append(((int(fields[k]), int(fields[k + 1] or 0)), column, real(fields[k + 2])))
        except (ValueError, IndexError, KeyError) as error:
            raise PatchfemError(f"{path}:{number}: not a readable DMIG card ({error})") from None
    if not forms:
        raise PatchfemError(f"{path}: holds no DMIG card; punch the matrices with EXTSEOUT(DMIGPCH) or a DMAP alter")
    return {name: _of_cards(entries[name], forms[name]) for name in forms}


def real(text: str) -> float:
    """A Nastran number: 1.5-3, 1.5D-3 and 1.5E-3 are one; ValueError for what is none."""
    found = _NUMBER.match(text)
    if found is None:
        raise ValueError(f"'{text}' is no number")
    return float(f"{found[1]}e{found[2] or 0}")


def _cards(path):
    """(line, fields) of each DMIG card with its continuations; fields[0] is its name."""
    card, first = [], 0
    with open(path, encoding="latin-1") as file:
        for number, line in enumerate(file, 1):
            line = line.split("$")[0].rstrip()
            starts = line[:4].upper() == "DMIG"
            if line and not starts and card and (line[0] in "+*, "):
                card += _fields(line, 4 if line[0] == "*" else 8)
                continue
            if card:
                yield first, card
            card, first = ["DMIG", *_fields(line, 4 if line[4:5] == "*" else 8)] if starts else [], number
    if card:
        yield first, card


def _fields(line: str, count: int) -> list:
    """The 4 wide or 8 narrow fields behind the first of a line, without blanks."""
    parts = line.split(",")[1:] if "," in line else \
        [line[8 + k * 64 // count:8 + (k + 1) * 64 // count] for k in range(count)]
    return [*(part.strip() for part in parts), *[""] * count][:count]


def _of_cards(entries: list, form: int) -> Cards:
    """A matrix of its entries ((node, component), (node, component), number)."""
    places = sorted({place for row, column, _ in entries for place in (row, column)})
    where = {place: k for k, place in enumerate(places)}
    rows, columns = ([where[one[k]] for one in entries] for k in (0, 1))
    values = sparse.coo_array(([one[2] for one in entries], (rows, columns)), (len(places), len(places))).tocsr()
    if form == SYMMETRIC:  # one of its triangles
        values = values + (values - sparse.diags_array(values.diagonal())).T
    return Cards(values.tocsr(), np.array(places, int).reshape(-1, 2))
