"""X3P of ISO 5436-2 (ISO 25178-72): a zip file with main.xml and heights as binary data or as a list in the XML.

Lengths are metres. x and y are incremental, or absolute and then stored with each point; every value of an axis is
raw * Increment + Offset. Missing: NaN, an empty datum, or what the file of valid points leaves out, one bit each.
Verified before use: sizes by the header, checksums, the data type by the number of bytes (16-bit values are signed).
"""

import hashlib
import posixpath
import re
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import METRES
from .raster import areal, raster
from .raw import POINTS, Raw, member, opened, reason, shown

XML = 16 * 2**20  # bytes of main.xml
DEEPEST, MOST = 50, 500_000  # elements of it inside one another, and in all
TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_AXES = ("CX", "CY", "CZ")
_MD5 = re.compile(r"[0-9a-fA-F]{32}")


def x3p(raw: Raw) -> Profile | Areal:
    """The scan or trace of an X3P file; PatchfemError names what is wrong in it, a wrong checksum included."""
    path, archive = raw.path, opened(raw)
    main = [one.filename for one in archive.infolist() if posixpath.basename(one.filename) == "main.xml"]
    if len(main) != 1:
        raise PatchfemError(f"{path}: contains {len(main)} files main.xml, but exactly one is needed")
    text = member(raw, archive, main[0], XML)
    root = _parsed(path, text)
    axes = [_axis(path, root, name) for name in _AXES]
    shape, listed = _shape(path, root)
    link = root.find("Record3/DataLink")
    folder = posixpath.dirname(main[0])
    notes = _main_checksum(raw, archive, root, folder, text)
    if link is not None:
        columns = _linked(raw, archive, (link, folder), axes, shape)
    else:
        columns = _listed(path, root, axes, shape)
    columns = [values * axis[2] + axis[3] for values, axis in zip(columns, [one for one in axes if one[0] == "A"])]
    if axes[2][0] != "A":
        raise PatchfemError(f"{path}: the heights (CZ) are incremental; export the surface anew")
    return _surface(path, columns, axes, shape, listed, notes)


def _surface(path, columns: list, axes: list, shape: tuple, listed: bool, notes: tuple) -> Profile | Areal:
    """Heights on incremental axes as a grid; points with places of their own as a raster."""
    rows, count = shape
    kinds = [axis[0] for axis in axes[:2]]
    if kinds == ["I", "I"] and not listed:
        places = [np.arange(n) * axis[2] + axis[3] for n, axis in zip((count, rows), axes)]
        for name, axis, n in zip(_AXES, axes, (count, rows)):
            if n > 1 and not axis[2] > 0:
                raise PatchfemError(f"{path}: Increment of {name} is {axis[2]:g}; a length > 0 m is needed")
        return areal(path, *places, columns[-1].reshape(rows, count), METRES, notes)
    number = np.arange(rows * count)
    places, own = [], iter(columns)
    for axis, index in zip(axes[:2], (number % count, number // count)):
        places.append(next(own) if axis[0] == "A" else index * axis[2] + axis[3])
    there = np.isfinite(places[0]) & np.isfinite(places[1])
    if there.sum() < 2:
        raise PatchfemError(f"{path}: {there.sum()} points with coordinates; a trace needs at least two")
    return raster(path, [one[there] for one in (*places, columns[-1])], None, (1.0, 1.0, 1.0), METRES)


def _axis(path, root: Element, name: str) -> tuple:
    """(type "I" or "A", data type, increment [m], offset [m]) of an axis; CY of a profile may be absent."""
    node = root.find(f"Record1/Axes/{name}")
    if node is None and name != "CY":
        raise PatchfemError(f"{path}: main.xml lacks Record1/Axes/{name}; export the surface anew")
    kind = "I" if node is None else _text(node, "AxisType", "I" if name != "CZ" else "A")
    if kind not in ("I", "A"):
        raise PatchfemError(f"{path}: AxisType of {name} is '{shown(kind)}'; I or A is needed")
    data = "D" if node is None else _text(node, "DataType", "D")
    if data not in TYPES:
        raise PatchfemError(f"{path}: DataType of {name} is '{shown(data)}'; one of {', '.join(TYPES)} is needed")
    numbers = [_number(path, f"{key} of {name}", "" if node is None else _text(node, key), default)
               for key, default in (("Increment", 1.0), ("Offset", 0.0))]
    if kind == "A" and not abs(numbers[0]) > 0:
        raise PatchfemError(f"{path}: Increment of {name} is 0; export the surface anew")
    return kind, data, *numbers


def _number(path, name: str, text: str, default: float) -> float:
    try:
        value = float(text) if text else default
    except ValueError:
        value = np.nan
    if "_" in text or not np.isfinite(value):
        raise PatchfemError(f"{path}: {name} is '{shown(text)}'; a number is needed")
    return value


def _shape(path, root: Element) -> tuple:
    """((rows, points of a row), whether the points are a list without a matrix)."""
    matrix = root.find("Record3/MatrixDimension")
    names = ("SizeX", "SizeY", "SizeZ") if matrix is not None else ("ListDimension",)
    where = matrix if matrix is not None else root.find("Record3")
    sizes = []
    for name in names:
        text = _text(where, name, "1" if name != "SizeX" else "") if where is not None else ""
        if not re.fullmatch(r"[0-9]{1,18}", text) or not 1 <= int(text) <= POINTS:
            raise PatchfemError(f"{path}: {name} is '{shown(text)}'; a whole number from 1 to {POINTS:.0e} is needed")
        sizes.append(int(text))
    if len(sizes) == 1:
        return (1, sizes[0]), True
    if sizes[2] != 1:
        raise PatchfemError(f"{path}: SizeZ is {sizes[2]}; a surface must have one layer: export each layer to its own "
                            "file")
    if sizes[0] * sizes[1] > POINTS:
        raise PatchfemError(f"{path}: {sizes[0]} x {sizes[1]} heights, more than {POINTS:.0e}; export a part of the "
                            "scan")
    return (sizes[1], sizes[0]), False


def _linked(raw: Raw, archive, link: tuple, axes: list, shape: tuple) -> list:
    """Raw values of each absolute axis from the binary file, points one after the other."""
    node, folder = link
    count, path = shape[0] * shape[1], raw.path
    record = np.dtype([(name, TYPES[axis[1]]) for name, axis in zip(_AXES, axes) if axis[0] == "A"])
    data = _file(raw, archive, node, folder, ("PointDataLink", "MD5ChecksumPointData", count * record.itemsize))
    if len(data) != count * record.itemsize:
        raise PatchfemError(f"{path}: {len(data)} bytes of heights, but {count} heights of type {axes[2][1]} are "
                            "needed; export the surface anew")
    points = np.frombuffer(data, record)
    columns = [points[name].astype(float) for name in record.names]
    for values in columns:
        values[np.isinf(values)] = np.nan
    if _text(node, "ValidPointsLink"):
        valid = _file(raw, archive, node, folder, ("ValidPointsLink", "MD5ChecksumValidPoints", count + 8))
        if len(valid) < (count + 7) // 8:
            raise PatchfemError(f"{path}: {len(valid)} bytes of valid points, but {(count + 7) // 8} bytes are needed")
        bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")[:count]
        columns[-1][bits == 0] = np.nan
    return columns


def _file(raw: Raw, archive, node: Element, folder: str, asked: tuple) -> bytes:
    """A binary file that main.xml names, by its name inside the zip file alone, with its checksum verified."""
    link, checksum, most = asked
    name = _text(node, link)
    if not name or name.startswith(("/", "\\")) or ".." in re.split(r"[/\\]", name):
        raise PatchfemError(f"{raw.path}: {link} '{shown(name)}' names a place outside the file; export the surface "
                            "anew")
    data = member(raw, archive, posixpath.join(folder, name.removeprefix("./")), most)
    wanted = _text(node, checksum)
    if _MD5.fullmatch(wanted) and hashlib.md5(data, usedforsecurity=False).hexdigest() != wanted.lower():
        raise PatchfemError(f"{raw.path}: the checksum of {shown(name)} is wrong: the heights were changed after the "
                            "file was written; export the surface anew")
    return data


def _main_checksum(raw: Raw, archive, root: Element, folder: str, text: bytes) -> tuple:
    """A note where the checksum file speaks of main.xml and disagrees."""
    name = posixpath.join(folder, _text(root, "Record4/ChecksumFile", "md5checksum.hex"))
    if name not in archive.namelist() or ".." in name:
        return ()
    said = member(raw, archive, name, 4096).decode("latin-1").split()
    if len(said) < 2 or posixpath.basename(said[1].lstrip("*")) != "main.xml" or not _MD5.fullmatch(said[0]):
        return ()
    if hashlib.md5(text, usedforsecurity=False).hexdigest() == said[0].lower():
        return ()
    return (f"{raw.path}: main.xml does not match its checksum in {shown(name)}: main.xml was changed after it was "
            "written",)


def _listed(path, root: Element, axes: list, shape: tuple) -> list:
    """Raw values of each absolute axis from the list in main.xml; an empty datum is missing."""
    listed = root.find("Record3/DataList")
    datums = [] if listed is None else [(one.text or "").strip() for one in listed.findall("Datum")]
    count, wide = shape[0] * shape[1], sum(axis[0] == "A" for axis in axes)
    if len(datums) != count:
        raise PatchfemError(f"{path}: {len(datums)} heights in main.xml, but {count} are needed; export the surface "
                            "anew")
    table = np.full((count, wide), np.nan)
    for k, text in enumerate(datums):
        cells = [cell.strip() for cell in text.split(";")]
        cells = cells[-wide:] if len(cells) == 3 else [cell for cell in cells if cell]
        if cells:
            try:
                table[k] = [float(cell) if cell else np.nan for cell in cells]
            except ValueError:
                raise PatchfemError(f"{path}: datum {k + 1} is '{shown(text)}'; {wide} numbers are needed") from None
    table[np.isinf(table)] = np.nan
    return list(table.T)


def _text(node: Element, path: str, default: str = "") -> str:
    """The text at a path of names without blanks around it; the default where there is none."""
    return (node.findtext(path) or "").strip() or default


def _parsed(path, data: bytes) -> Element:
    """The root of main.xml, names without namespaces; no document type, no entities, no deep nesting, no other file."""
    parser, tree, count, deep = expat.ParserCreate(), TreeBuilder(), 0, 0

    def refuse(*_):
        raise PatchfemError(f"{path}: main.xml declares entities or a document type, which no surface needs; export "
                            "the surface anew")

    def start(name, _):
        nonlocal count, deep
        count, deep = count + 1, deep + 1
        if deep > DEEPEST or count > MOST:
            raise PatchfemError(f"{path}: main.xml is nested deeper than {DEEPEST} or has more than {MOST} elements")
        tree.start(name.rpartition(":")[2], {})

    def end(name):
        nonlocal deep
        deep -= 1
        tree.end(name.rpartition(":")[2])

    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = parser.ExternalEntityRefHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, tree.data
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError, UnicodeError, LookupError) as error:
        raise PatchfemError(f"{path}: main.xml is damaged ({reason(error)}); export the surface anew") from None
    return tree.close()
