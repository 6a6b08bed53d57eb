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


class _Strings:
    """Numbers of a matrix as a file has them, in strings down its columns: (column, first row, numbers) from 1."""

    def __init__(self, path, rows: int, columns: int, told):
        if not 0 <= rows <= SIDE or not 0 <= columns <= SIDE:
            raise ValueError(f"the header announces {rows} rows and {columns} columns")
        self.path, self.shape, self.told, self.places, self.parts = (
            path,
            (rows, columns),
            told,
            [],
            [],
        )

    def cards(self) -> Cards:
        """The matrix; PatchfemError where its rows do not fit or its numbers cannot be read."""
        try:
            numbers, sizes = self.told(self.parts)
            column, row = np.array(self.places, int).reshape(-1, 2).T
            out = (row < 1) | (row + sizes - 1 > self.shape[0])
            if out.any():
                raise ValueError(
                    f"the matrix uses row {(row + sizes - 1)[out][0]}, but the matrix has "
                    f"{self.shape[0]} rows"
                )
            rows = np.arange(numbers.size) + np.repeat(row - 1 - np.cumsum(sizes) + sizes, sizes)
            return Cards(
                sparse.coo_array(
                    (numbers, (rows, np.repeat(column - 1, sizes))), self.shape
                ).tocsr()
            )
        except ValueError as error:
            raise _unreadable(self.path, error) from None


def output4(path) -> dict:
    """Name -> `_Strings` of the matrices of an OUTPUT4 file; PatchfemError where it is damaged or complex."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        found = _binary(path, data) if 0 in data[:8] else _text(path, data.decode("ascii"))
    except (ValueError, IndexError, KeyError, struct.error, UnicodeDecodeError) as error:
        raise _unreadable(path, error) from None
    if not found:
        raise PatchfemError(f"{path}: contains no matrix")
    return found


def _unreadable(path, error) -> PatchfemError:
    return PatchfemError(f"{path}: not a readable OUTPUT4 file ({error})")


def _kind(number: int) -> int:
    """Words of a number of a type of OUTPUT4."""
    if number in (3, 4):
        raise ValueError("a matrix is complex; write only the real part")
    return {1: 1, 2: 2}[number]


def _binary(path, data: bytes) -> dict:
    order = next(one for one in "<>" if struct.unpack_from(one + "i", data)[0] in (24, 48))
    wide = 8 if struct.unpack_from(order + "i", data)[0] == 48 else 4  # bytes of a word
    whole, at, found = f"{order}{'q' if wide == 8 else 'i'}", 0, {}
    one, head = struct.Struct(whole), struct.Struct(whole[0] + 3 * whole[1])
    entries = None
    while at < len(data):
        size = struct.unpack_from(order + "i", data, at)[0]
        record, at = data[at + 4 : at + 4 + size], at + 8 + size
        if size < 0 or len(record) < size or size % wide:
            raise ValueError("it is cut off")
        if entries is None:
            columns, rows, _, kind = struct.unpack_from(whole[0] + 4 * whole[1], record)
            words, big = _kind(kind), rows < 0
            number = f"{order}f{8 if wide == 8 or words == 2 else 4}"
            entries = found.setdefault(
                record[4 * wide :].decode("ascii").strip(),
                _Strings(
                    path,
                    abs(rows),
                    columns,
                    lambda parts, number=number: (
                        np.frombuffer(b"".join(parts), number).astype(float),
                        np.array([len(part) for part in parts], int) // int(number[-1]),
                    ),
                ),
            )
            continue
        column, row, count = head.unpack_from(record)
        if column > entries.shape[1]:
            entries = None
            continue
        place, end = 3 * wide, (3 + count) * wide
        if row:
            entries.places.append((column, row))
            entries.parts.append(record[place:end])
            continue
        end = min(end, size)
        while place < end:
            long, first = (
                head.unpack_from(record, place - wide)[1:]
                if big
                else divmod(one.unpack_from(record, place)[0], 65536)
            )
            begin = place + (2 if big else 1) * wide
            place = begin + (long - 1) * wide
            if place < begin:
                raise ValueError("a string of the matrix has no rows")
            entries.places.append((column, first))
            entries.parts.append(record[begin:place])
    return found


def _text(path, text: str) -> dict:
    lines, found, at = [line.rstrip() for line in text.split("\n") if line.strip()], {}, 0

    def behind(at: int) -> int:
        """Where the lines of numbers end."""
        while at < len(lines) and "." in lines[at][:16]:
            at += 1
        return at

    while at < len(lines):
        columns, rows, _, kind = (int(lines[at][8 * k : 8 * k + 8]) for k in range(4))
        _kind(kind)
        name, told = lines[at][32:40].strip(), re.search(r"[ED](\d+)\.", lines[at][40:])
        width, big = int(told[1]) if told else 16, rows < 0
        entries = found.setdefault(
            name,
            _Strings(
                path,
                abs(rows),
                columns,
                lambda parts, width=width: (
                    _fixed("".join(parts), width),
                    np.array([len(part) for part in parts], int) // width,
                ),
            ),
        )
        at += 1
        while True:
            column, row, _ = (int(lines[at][8 * k : 8 * k + 8]) for k in range(3))
            at += 1
            if column > columns:
                at = behind(at)
                break
            while row or (at < len(lines) and len(told := lines[at].split()) == (2 if big else 1)):
                first = row or (int(told[1]) if big else int(told[0]) % 65536)
                begin, at = at + (not row), behind(at + (not row))
                entries.places.append((column, first))
                entries.parts.append("".join(lines[begin:at]))
                if row:
                    break
    return found


def _fixed(text: str, width: int) -> np.ndarray:
    """Numbers in columns of a width; ValueError where one is none."""
    if len(text) % width:
        raise ValueError(f"the numbers of the matrix are not {width} characters wide")
    return np.frombuffer(text.upper().replace("D", "E").encode("ascii"), f"S{width}").astype(float)


class _Deck:
    """DMIG entries of one matrix as a file has them: columns (line, node, component, entries) and of each entry 32
    letters of node and component and 16 of a number."""

    def __init__(self, path, form: int):
        self.path, self.form, self.columns, self.places, self.numbers = path, form, [], [], []

    def add(self, node: str, component: str, number: str) -> None:
        """An entry of the last column."""
        self.columns[-1][3] += 1
        self.places.append(f"{node:>16}{component or '0':>16}")
        self.numbers.append(f"{number:>16}")

    def cards(self) -> Cards:
        """The matrix; PatchfemError with the first line of a card that cannot be read."""
        sizes = np.array([count for *_, count in self.columns], int)
        try:
            rows = (
                np.frombuffer("".join(self.places).encode("ascii"), "S16")
                .astype(int)
                .reshape(-1, 2)
            )
            numbers = _fixed("".join(self.numbers), 16)
        except ValueError:  # a blank component, or 1.5-3 for 1.5E-3
            rows, numbers = self._one_by_one(
                np.repeat([number for number, *_ in self.columns], sizes)
            )
        own = np.array([place for _, *place, _ in self.columns], int).reshape(-1, 2)
        places, where = ranked(np.vstack([rows, np.repeat(own, sizes, axis=0)]))
        values = sparse.coo_array(
            (numbers, where.reshape(2, -1)), (len(places), len(places))
        ).tocsr()
        if self.form == SYMMETRIC:  # one of its triangles
            values = values + (values - sparse.diags_array(values.diagonal())).T
        return Cards(values.tocsr(), places)

    def _one_by_one(self, lines) -> tuple:
        rows, numbers = [], []
        for line, place, number in zip(lines, self.places, self.numbers):
            try:
                rows.append((int(place[:16]), int(place[16:].strip() or 0)))
                numbers.append(real(number.strip()))
            except ValueError as error:
                raise PatchfemError(
                    f"{self.path}:{line}: not a readable DMIG card ({error})"
                ) from None
        return np.array(rows, int).reshape(-1, 2), np.array(numbers)


def ranked(places) -> tuple:
    """(different places (n, 2) of whole numbers >= 0 in order, which of them each place (k, 2) is)."""
    if not places.size:
        return places, np.zeros(0, int)
    if places.min() < 0 or places.max() >= 2**31:
        raise ValueError(
            f"{places.min()} to {places.max()} are not possible numbers of nodes and directions"
        )
    wide = int(places[:, 1].max()) + 1
    found, where = np.unique(places[:, 0] * wide + places[:, 1], return_inverse=True)
    return np.stack(np.divmod(found, wide), axis=1), where


def punched(path) -> dict:
    """Name -> `_Deck` of the real DMIG matrices of a punch or bulk data file, rows by nodes and components in order.

    Component 0 is that of a scalar point. PatchfemError with the line of a card that cannot be read.
    """
    found, deck = {}, None
    with open(path, encoding="latin-1") as file:
        for number, line in enumerate(file, 1):
            if (
                deck is not None
                and line[0] == "*"
                and len(line) > 56
                and "," not in line
                and "$" not in line
            ):
                deck.columns[-1][3] += 1
                deck.places.append(line[8:40])
                deck.numbers.append(line[40:56])
                continue
            line = line.split("$")[0].rstrip()
            starts = line[:4].upper() == "DMIG"
            if not line or not (starts or line[0] in "+*, "):
                deck = deck if not line else None
                continue
            try:
                if starts:
                    deck, fields = _begun(
                        path, found, number, _fields(line, 4 if line[4:5] == "*" else 8)
                    )
                else:
                    fields = _fields(line, 4 if line[0] == "*" else 8)
                for k in range(0, len(fields) if deck is not None else 0, 4):
                    if fields[k]:
                        deck.add(*fields[k : k + 3])
            except (ValueError, IndexError, KeyError) as error:
                raise PatchfemError(
                    f"{path}:{number}: not a readable DMIG card ({error})"
                ) from None
    if not found:
        raise PatchfemError(
            f"{path}: contains no DMIG card; punch the matrices with EXTSEOUT(DMIGPCH) or a DMAP alter"
        )
    return found


def _begun(path, found: dict, line: int, fields: list) -> tuple:
    """(deck of the column that a card begins, None of a header; its further fields)."""
    name = fields[0].upper()
    if fields[1] == "0" and name not in found:
        if int(fields[3]) > 2:
            raise ValueError("the matrix is complex; write only the real part")
        found[name] = _Deck(path, int(fields[2]))
        return None, []
    found[name].columns.append([line, int(fields[1]), int(fields[2] or 0), 0])
    return found[name], fields[4:]


def real(text: str) -> float:
    """A Nastran number: 1.5-3, 1.5D-3 and 1.5E-3 are one; ValueError for what is none."""
    found = _NUMBER.match(text)
    if found is None:
        raise ValueError(f"'{text}' is not a number")
    return float(f"{found[1]}e{found[2] or 0}")


def _fields(line: str, count: int) -> list:
    """The 4 wide or 8 narrow fields behind the first of a line, without blanks."""
    parts = (
        line.split(",")[1:]
        if "," in line
        else [line[8 + k * 64 // count : 8 + (k + 1) * 64 // count] for k in range(count)]
    )
    return [*(part.strip() for part in parts), *[""] * count][:count]
