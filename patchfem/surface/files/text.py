"""Text files whose header names the units.

The header `x [um],z [um]` is that of a trace, `x [um],y [um],z [um]` that of a raster.
The columns stand in any order; `x (um)`, `x_um`, `x/um` and `x in um` mean the same, and names and
units may stand in a line each. Columns are separated by commas, semicolons, tabs, bars or blanks.
The decimal sign is a point, or a comma if columns are separated by something else or cells are
quoted. Lines that start with #, % or // are comments, and the header itself may be one. A height
that is empty, `nan`, `bad` or `***` is missing. The encoding is UTF-8, UTF-16 with its mark, or
else Latin-1.
"""

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import GIVEN_UNITS_NOTE, make_trace
from .head import HEADER_EXAMPLE, ColumnNames, Fact, parse_column, read_head
from .matrix import is_matrix, read_scan
from .raster import make_scan_from_points
from .raw import RawFile, shorten
from .rows import read_columns
from .units import GIVE_UNITS, UNIT_LIST, parse_length_unit, parse_pixel_size

_QUOTED_NUMBER = re.compile(r'"\s*([+-]?[0-9]*),([0-9]+(?:[eE][+-]?[0-9]+)?)\s*"')
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


class Places(NamedTuple):
    """Indices of the columns to read from a text file, with notes on how they were found."""

    columns: dict
    notes: tuple = ()


class Factors(NamedTuple):
    """Factors that convert the columns of a text file to metres, with notes."""

    values: tuple
    notes: tuple


def read_text(raw: RawFile, units: tuple | None = None) -> Profile | Areal:
    """Read the trace or areal scan in a text file of two or three columns or a matrix.

    units: units of x (and y) and of z, which complete what the file states and overrule it with a
    note. Samples at one x become their mean, and x that are even but for their printed digits are
    made even, both with a note. A million samples take 0.3 s. Raises PatchfemError that names the
    line.
    """
    path = raw.path
    text = decode_text(raw)
    is_pixel = units is not None and parse_pixel_size(units[0]) is not None
    for unit in (units or ())[is_pixel:]:
        if parse_length_unit(unit) is None:
            raise PatchfemError(f"{path}: unknown unit '{shorten(unit)}'; use one of {UNIT_LIST}")
    head = read_head(path, text)
    facts = {} if head.names else head.facts(path)
    named = head.column_names()
    body = text[head.start :]
    if not head.names and is_matrix(len(head.row), named.names, facts):
        return read_scan(path, head, facts, units, body)
    if is_pixel:
        raise PatchfemError(
            f"{path}: '{shorten(units[0])}' is a pixel size, which is needed only for a matrix of "
            "heights, but this file has columns; give the units of the columns"
        )
    width = len(named.names or head.row)
    if width < 2:
        raise PatchfemError(
            f"{path}:{head.number + 1}: only one column, '{shorten(head.row[0])}', but x and z are "
            f"needed; {HEADER_EXAMPLE}"
        )
    line = f"{path}:{named.number or head.number + 1}"
    if not (named.names or units or named.units or "lateral" in facts):
        example = HEADER_EXAMPLE if width == 2 else HEADER_EXAMPLE.replace(",", ",y [um],")
        raise PatchfemError(
            f"{line}: there is no header, and units are never guessed; {example} above the first "
            f"sample, or {GIVE_UNITS}"
        )
    names = named.names or list("xz" if width == 2 else "xyz")
    places = _find_places(line, names, has_units=units is not None)
    values, lines = read_columns(path, body, head, places.columns, width)
    columns = dict(places.columns)
    notes = places.notes
    if "valid" in columns:
        values["z"] = np.where(values.pop("valid") == 0, np.nan, values["z"])
        del columns["valid"]
    roles = {parse_column(name).role for name in named.names}
    if "y" in columns and not roles >= {"x", "y"} and _is_sample_count(values):
        columns = {"x": columns["y"], "z": columns["z"]}
        values = {"x": values["y"], "z": values["z"]}
        notes += (
            f"{path}: the first column numbers the samples; x and z are taken from the other "
            "columns",
        )
    factors = _find_factors(line, columns, named, facts, units)
    stated = GIVEN_UNITS_NOTE if units else ""
    if "y" in columns:
        surface = make_scan_from_points(
            path, [values[name] for name in "xyz"], lines, factors.values, stated
        )
    else:
        surface = make_trace(path, values["x"], values["z"], lines, factors.values, stated)
    return replace(surface, notes=(*notes, *factors.notes, *surface.notes))


def decode_text(raw: RawFile) -> str:
    """Decode a text file, with \\n at the ends of lines and without quotes."""
    path = raw.path
    data = raw.data
    if not data.strip(b"\xef\xbb\xbf \t\r\n"):
        raise PatchfemError(
            f"{path}: the profile is empty; export it again as text with two columns and {HEADER_EXAMPLE}"
        )
    text = (
        data.decode(_find_encoding(raw), errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    )
    return _QUOTED_NUMBER.sub(r"\1.\2", text).replace('"', "") if '"' in text else text


def _find_encoding(raw: RawFile) -> str:
    if raw.data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if raw.kind != "text" or _CONTROL.search(raw.data):
        raise PatchfemError(
            f"{raw.path}: not a text file; export the profile as text with two columns and "
            f"{HEADER_EXAMPLE}"
        )
    try:
        raw.data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _find_places(line: str, names: list, *, has_units: bool) -> Places:
    """Find the columns to read by name, or by order if units are given and names are unknown."""
    roles = {k: parse_column(name).role for k, name in enumerate(names)}
    valid = {role: k for k, role in roles.items() if role == "valid"}
    data = {k: role for k, role in roles.items() if role not in ("valid", "index")}
    if not 1 < len(data) < 4:
        listed = (
            f"{len(names)} columns" if len(data) == len(names) else ", ".join(map(shorten, names))
        )
        raise PatchfemError(
            f"{line}: {listed}, but x and z, or x, y and z, are needed; keep one trace of two "
            f"columns and {HEADER_EXAMPLE}"
        )
    known = ("x", "z") if len(data) == 2 else ("x", "y", "z")
    notes = ()
    if sorted(data.values()) == ["x", "y"]:
        # Columns x and y are a trace whose heights are named y.
        data = {k: role.replace("y", "z") for k, role in data.items()}
    strange = next((names[k] for k, role in data.items() if role not in known), None)
    if strange is not None and not has_units:
        required = "x and z" if len(data) == 2 else "x, y and z"
        raise PatchfemError(
            f"{line}: column '{shorten(strange.partition('[')[0].strip())}' is not known; the "
            f"columns {required} are needed; {HEADER_EXAMPLE}"
        )
    if strange is not None:
        listed = ", ".join(f"'{shorten(names[k])}'" for k in data)
        data = dict(zip(data, known))
        notes = (f"{line}: columns {listed} are taken as {', '.join(known)} in this order",)
    places = {role: k for k, role in data.items()}
    if len(places) < len(data):
        twice = next(role for role in known if list(data.values()).count(role) > 1)
        raise PatchfemError(f"{line}: two columns are named {twice}; {HEADER_EXAMPLE}")
    return Places({role: places[role] for role in known} | valid, notes)


def _find_factors(
    line: str, columns: dict, named: ColumnNames, facts: dict, given: tuple | None
) -> Factors:
    """Find the factors that convert the columns to metres; a unit of the user overrules the file, with a note."""
    factors = []
    notes = ()
    for role, k in columns.items():
        stated = parse_column(named.names[k]).unit if named.names else None
        if stated is None and named.units:
            stated = named.units[k]
        if stated is None:
            fact = "value" if role == "z" else "lateral"
            stated = facts.get(fact, Fact(word=None)).word
        unit = given[role == "z"] if given else stated
        if unit is None:
            name = named.names[k] if named.names else role
            raise PatchfemError(
                f"{line}: column '{shorten(name)}' has no unit, and units are never guessed; "
                f"{HEADER_EXAMPLE}, or {GIVE_UNITS}"
            )
        factor = parse_length_unit(unit)
        if factor is None:
            raise PatchfemError(
                f"{line}: unknown unit '{shorten(unit)}' of {role}; use one of {UNIT_LIST}"
            )
        if stated is not None and parse_length_unit(stated) != factor:
            notes += (
                f"{line}: the header gives {role} in {shorten(stated)}, but {unit} is used, as "
                "given by --units",
            )
        factors.append(factor)
    return Factors(tuple(factors), notes)


def _is_sample_count(values: dict) -> bool:
    """Return whether the first column of a file only numbers the samples."""
    x = values["x"]
    steps = np.diff(values["y"])
    is_count = x.size > 2 and x[0] in (0, 1) and (np.diff(x) == 1).all()
    return bool(is_count and ((steps > 0).all() or (steps < 0).all()))
