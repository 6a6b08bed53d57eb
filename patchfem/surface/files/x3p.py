"""X3P files (ISO 5436-2, ISO 25178-72): a zip file with main.xml and heights.

Heights are binary data or a list in the XML. Lengths are metres. x and y are incremental, or
absolute and then stored with each point; every value of an axis is raw * Increment + Offset.
Missing: NaN, an empty datum, or what the file of valid points leaves out, one bit each. Verified
before use: sizes by the header, checksums, the data type by the number of bytes (16-bit values are
signed).
"""

import hashlib
import posixpath
import re
from typing import NamedTuple
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser
from zipfile import ZipFile

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import METRES_NOTE
from .raster import make_scan_from_matrix, make_scan_from_points
from .raw import MAX_POINTS, MIB, RawFile, open_zip, read_member, shorten, shorten_reason

# Largest size of main.xml in bytes; heights stored there take 30 bytes each.
MAX_XML_BYTES = 16 * MIB
MAX_ELEMENTS = 500_000  # largest number of elements in main.xml; more take over 100 MB
TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_AXIS_NAMES = ("CX", "CY", "CZ")
_MD5 = re.compile(r"[0-9a-fA-F]{32}")


class Axis(NamedTuple):
    """Axis of an X3P file, with equal increments or with stored positions [m]."""

    is_absolute: bool
    data_type: str
    increment: float
    offset: float

    def scale(self, raw_values) -> np.ndarray:
        """Convert raw values of the axis to metres."""
        return raw_values * self.increment + self.offset


class Shape(NamedTuple):
    """Number of points of an X3P file along its axes or in its list."""

    rows: int
    columns: int
    is_list: bool

    @property
    def count(self) -> int:
        """Number of points."""
        return self.rows * self.columns


class Package(NamedTuple):
    """Open X3P file with the folder and the root element of its main.xml."""

    raw: RawFile
    archive: ZipFile
    folder: str
    root: Element

    def refuse(self, what: str) -> PatchfemError:
        """Return the exception that describes a fault of the file."""
        return PatchfemError(f"{self.raw.path}: {what}")

    def read_linked(self, link: str, checksum: str, max_bytes: int) -> bytes:
        """Read a binary file by its name in main.xml and verify its checksum.

        Parameters
        ----------
        link, checksum : str
            Elements of Record3/DataLink.
        max_bytes : int

        Returns
        -------
        bytes
        """
        node = self.root.find("Record3/DataLink")
        name = _text(node, link)
        if not name or name.startswith(("/", "\\")) or ".." in re.split(r"[/\\]", name):
            raise self.refuse(
                f"{link} '{shorten(name)}' names a place outside the file; export the surface anew"
            )
        data = read_member(
            self.raw, self.archive, posixpath.join(self.folder, name.removeprefix("./")), max_bytes
        )
        stated = _text(node, checksum)
        if _MD5.fullmatch(stated) and _compute_md5(data) != stated.lower():
            raise self.refuse(
                f"the checksum of {shorten(name)} is wrong: the heights were changed after the "
                "file was written; export the surface anew"
            )
        return data


def read_x3p(raw: RawFile) -> Profile | Areal:
    """Read the scan or trace of an X3P file.

    Raises PatchfemError that names what is wrong in it.
    """
    archive = open_zip(raw)
    names = [
        info.filename
        for info in archive.infolist()
        if posixpath.basename(info.filename) == "main.xml"
    ]
    if len(names) != 1:
        raise PatchfemError(
            f"{raw.path}: contains {len(names)} files main.xml, but exactly one is needed"
        )
    text = read_member(raw, archive, names[0], MAX_XML_BYTES)
    package = Package(raw, archive, posixpath.dirname(names[0]), _parse_xml(raw.path, text))
    axes = [_read_axis(package, name) for name in _AXIS_NAMES]
    shape = _read_shape(package)
    if not axes[2].is_absolute:
        raise package.refuse("the heights (CZ) are incremental; export the surface anew")
    notes = _verify_main(package, text)
    if package.root.find("Record3/DataLink") is not None:
        columns = _read_binary(package, axes, shape)
    else:
        columns = _read_list(package, axes, shape)
    stored = [axis for axis in axes if axis.is_absolute]
    columns = [axis.scale(values) for axis, values in zip(stored, columns)]
    if len(stored) == 1 and not shape.is_list:
        return _make_grid(package, columns[0], axes, shape, notes)
    return _make_raster(package, columns, axes, shape)


def _make_grid(
    package: Package, heights, axes: list, shape: Shape, notes: tuple
) -> Profile | Areal:
    """Arrange heights on incremental axes as a grid."""
    counts = (shape.columns, shape.rows)
    for name, axis, count in zip(_AXIS_NAMES, axes, counts):
        if count > 1 and not axis.increment > 0:
            raise package.refuse(
                f"Increment of {name} is {axis.increment:g}; a length > 0 m is needed"
            )
    x, y = (axis.scale(np.arange(count)) for axis, count in zip(axes, counts))
    return make_scan_from_matrix(
        package.raw.path, x, y, heights.reshape(shape.rows, shape.columns), METRES_NOTE, notes
    )


def _make_raster(package: Package, columns: list, axes: list, shape: Shape) -> Profile | Areal:
    """Arrange points with stored coordinates on a raster."""
    numbers = np.arange(shape.count)
    stored = iter(columns)
    places = []
    for axis, index in zip(axes[:2], (numbers % shape.columns, numbers // shape.columns)):
        places.append(next(stored) if axis.is_absolute else axis.scale(index))
    known = np.isfinite(places[0]) & np.isfinite(places[1])
    if known.sum() < 2:
        raise package.refuse(f"{known.sum()} points with coordinates; a trace needs at least two")
    points = [values[known] for values in (*places, columns[-1])]
    return make_scan_from_points(package.raw.path, points, None, (1.0, 1.0, 1.0), METRES_NOTE)


def _read_axis(package: Package, name: str) -> Axis:
    """Read the definition of an axis from an X3P file."""
    node = package.root.find(f"Record1/Axes/{name}")
    if node is None:
        if name != "CY":
            raise package.refuse(f"main.xml lacks Record1/Axes/{name}; export the surface anew")
        node = Element(name)
    kind = _text(node, "AxisType", "A" if name == "CZ" else "I")
    if kind not in ("I", "A"):
        raise package.refuse(f"AxisType of {name} is '{shorten(kind)}'; I or A is needed")
    data_type = _text(node, "DataType", "D")
    if data_type not in TYPES:
        raise package.refuse(
            f"DataType of {name} is '{shorten(data_type)}'; one of {', '.join(TYPES)} is needed"
        )
    increment = _read_number(package, node, "Increment", "1")
    offset = _read_number(package, node, "Offset", "0")
    if kind == "A" and increment == 0:
        raise package.refuse(f"Increment of {name} is 0; export the surface anew")
    return Axis(kind == "A", data_type, increment, offset)


def _read_number(package: Package, node: Element, name: str, default: str) -> float:
    text = _text(node, name, default)
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if "_" in text or not np.isfinite(value):
        raise package.refuse(f"{name} of {node.tag} is '{shorten(text)}'; a number is needed")
    return value


def _read_shape(package: Package) -> Shape:
    matrix = package.root.find("Record3/MatrixDimension")
    if matrix is None:
        record = package.root.find("Record3")
        return Shape(1, _read_size(package, record, "ListDimension", ""), is_list=True)
    columns = _read_size(package, matrix, "SizeX", "")
    rows = _read_size(package, matrix, "SizeY", "1")
    layers = _read_size(package, matrix, "SizeZ", "1")
    if layers != 1:
        raise package.refuse(
            f"SizeZ is {layers}; a surface must have one layer: export each layer to its own file"
        )
    if columns * rows > MAX_POINTS:
        raise package.refuse(
            f"{columns} x {rows} heights, more than {MAX_POINTS:.0e}; export a part of the scan"
        )
    return Shape(rows, columns, is_list=False)


def _read_size(package: Package, node: Element | None, name: str, default: str) -> int:
    text = "" if node is None else _text(node, name, default)
    if not re.fullmatch(r"[0-9]{1,18}", text) or not 1 <= int(text) <= MAX_POINTS:
        raise package.refuse(
            f"{name} is '{shorten(text)}'; a whole number from 1 to {MAX_POINTS:.0e} is needed"
        )
    return int(text)


def _read_binary(package: Package, axes: list, shape: Shape) -> list:
    """Read the raw values (k,) of each absolute axis from the binary file, point by point."""
    fields = [
        (name, TYPES[axis.data_type]) for name, axis in zip(_AXIS_NAMES, axes) if axis.is_absolute
    ]
    record = np.dtype(fields)
    size = shape.count * record.itemsize
    data = package.read_linked("PointDataLink", "MD5ChecksumPointData", size)
    if len(data) != size:
        raise package.refuse(
            f"{len(data)} bytes of heights, but {shape.count} heights of type {axes[2].data_type} "
            "are needed; export the surface anew"
        )
    points = np.frombuffer(data, record)
    columns = [points[name].astype(float) for name in record.names]
    for values in columns:
        values[np.isinf(values)] = np.nan
    if _text(package.root, "Record3/DataLink/ValidPointsLink"):
        size = (shape.count + 7) // 8
        valid = package.read_linked("ValidPointsLink", "MD5ChecksumValidPoints", shape.count + 8)
        if len(valid) < size:
            raise package.refuse(f"{len(valid)} bytes of valid points, but {size} bytes are needed")
        bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")
        columns[-1][bits[: shape.count] == 0] = np.nan
    return columns


def _read_list(package: Package, axes: list, shape: Shape) -> list:
    """Read the raw values (k,) of each absolute axis from main.xml; an empty datum becomes NaN."""
    datums = [
        (datum.text or "").strip() for datum in package.root.findall("Record3/DataList/Datum")
    ]
    if len(datums) != shape.count:
        raise package.refuse(
            f"{len(datums)} heights in main.xml, but {shape.count} are needed; export the surface "
            "anew"
        )
    width = sum(axis.is_absolute for axis in axes)
    table = np.full((shape.count, width), np.nan)
    for k, text in enumerate(datums):
        cells = [cell.strip() for cell in text.split(";")]
        cells = cells[-width:] if len(cells) == 3 else [cell for cell in cells if cell]
        try:
            if cells:
                table[k] = [float(cell) if cell else np.nan for cell in cells]
        except ValueError:
            raise package.refuse(
                f"datum {k + 1} is '{shorten(text)}'; {width} numbers are needed"
            ) from None
    table[np.isinf(table)] = np.nan
    return list(table.T)


def _verify_main(package: Package, text: bytes) -> tuple:
    """Return a note if the checksum file lists main.xml with another checksum."""
    name = posixpath.join(
        package.folder, _text(package.root, "Record4/ChecksumFile", "md5checksum.hex")
    )
    if name not in package.archive.namelist() or ".." in name:
        return ()
    words = read_member(package.raw, package.archive, name, MAX_XML_BYTES).decode("latin-1").split()
    if len(words) < 2 or posixpath.basename(words[1].lstrip("*")) != "main.xml":
        return ()
    if not _MD5.fullmatch(words[0]) or _compute_md5(text) == words[0].lower():
        return ()
    return (
        f"{package.raw.path}: main.xml does not match its checksum in {shorten(name)}: main.xml "
        "was changed after it was written",
    )


def _compute_md5(data: bytes) -> str:
    return hashlib.md5(data, usedforsecurity=False).hexdigest()


def _text(node: Element, path: str, default: str = "") -> str:
    """Return the text of an XML element at a path, or a default."""
    return (node.findtext(path) or "").strip() or default


class _SafeTree(TreeBuilder):
    """Builder of an XML tree whose size is limited and whose names have no namespace."""

    def __init__(self, path) -> None:
        super().__init__()
        self.path = path
        self.count = 0

    def doctype(self, *_) -> None:
        """Reject a document type, because its entities may fill the memory or name other files."""
        raise PatchfemError(
            f"{self.path}: main.xml declares entities or a document type, which no surface needs; "
            "export the surface anew"
        )

    def start(self, tag: str, _attributes: dict) -> Element:
        """Open an element of the XML tree."""
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise PatchfemError(f"{self.path}: main.xml has more than {MAX_ELEMENTS} elements")
        return super().start(tag.rpartition("}")[2], {})

    def end(self, tag: str) -> Element:
        """Close an element of the XML tree."""
        return super().end(tag.rpartition("}")[2])


def _parse_xml(path, data: bytes) -> Element:
    """Parse main.xml into elements whose names have no namespace."""
    parser = XMLParser(target=_SafeTree(path))
    try:
        parser.feed(data)
        return parser.close()
    except (ParseError, ValueError, UnicodeError, LookupError) as error:
        raise PatchfemError(
            f"{path}: main.xml is damaged ({shorten_reason(error)}); export the surface anew"
        ) from None
