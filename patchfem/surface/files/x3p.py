"""X3P files (ISO 5436-2, ISO 25178-72): a zip file with main.xml and heights, in metres.

x and y are incremental, or absolute and then stored with each point; every value of an axis is raw *
Increment + Offset. Heights are binary data or a list in the XML. Missing: NaN, infinite, an empty
datum, or what the file of valid points leaves out, one bit each.
"""

import hashlib
import posixpath
import re
from dataclasses import dataclass
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser
from zipfile import ZipFile

import numpy as np

from ...core import PatchfemError
from ..areal import Areal
from ..profile import Profile
from ..samples import METRES_NOTE
from .raster import make_scan_from_matrix, make_scan_from_points
from .raw import MAX_POINTS, MIB, RawFile, open_zip, read_member, shorten, shorten_reason

MAX_XML_BYTES = 16 * MIB  # largest size of main.xml; heights stored there take 30 bytes each
MAX_ELEMENTS = 500_000  # largest number of elements in main.xml; more take over 100 MB
TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_MD5 = re.compile(r"[0-9a-fA-F]{32}")


def read_x3p(raw: RawFile) -> Profile | Areal:
    """Read the scan or trace of an X3P file; a PatchfemError names what is wrong in it."""
    archive = open_zip(raw)
    names = [name for name in archive.namelist() if posixpath.basename(name) == "main.xml"]
    if len(names) != 1:
        raise PatchfemError(
            f"{raw.path}: contains {len(names)} files main.xml, but exactly one is needed"
        )
    text = read_member(raw, archive, names[0], MAX_XML_BYTES)
    package = _Package(raw, archive, posixpath.dirname(names[0]), _parse_xml(raw.path, text))
    return package.read_surface(package.verify_main(text))


@dataclass(frozen=True, eq=False)
class _Package:
    """Open X3P file with the folder and the root element of its main.xml."""

    raw: RawFile
    archive: ZipFile
    folder: str
    root: Element

    def refuse(self, what: str) -> PatchfemError:
        """Return the exception that describes a fault of the file."""
        return PatchfemError(f"{self.raw.path}: {what}")

    def find_text(self, place: str, default: str = "") -> str:
        """Return the text of an element, or a default."""
        return (self.root.findtext(place) or "").strip() or default

    def read_number(self, place: str, default: str) -> float:
        """Read a finite number."""
        text = self.find_text(place, default)
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        if "_" in text or not np.isfinite(value):
            *_, axis, name = place.split("/")
            raise self.refuse(f"{name} of {axis} is '{shorten(text)}'; a number is needed")
        return value

    def read_size(self, place: str, default: str = "") -> int:
        """Read the number of points along an axis or in a list."""
        text = self.find_text(place, default)
        if not re.fullmatch(r"[0-9]{1,18}", text) or not 1 <= int(text) <= MAX_POINTS:
            raise self.refuse(
                f"{place.rpartition('/')[2]} is '{shorten(text)}'; a whole number from 1 to "
                f"{MAX_POINTS:.0e} is needed"
            )
        return int(text)

    def read_surface(self, notes: tuple[str, ...]) -> Profile | Areal:
        """Read axes, sizes and heights, and arrange them as a trace or a scan."""
        kinds = {}
        for axis in "XYZ":
            place = f"Record1/Axes/C{axis}"
            if self.root.find(place) is None and axis != "Y":
                raise self.refuse(f"main.xml lacks {place}; export the surface anew")
            kinds[axis] = self.find_text(f"{place}/AxisType", "A" if axis == "Z" else "I")
            kind = self.find_text(f"{place}/DataType", "D")
            if kind not in TYPES:
                raise self.refuse(
                    f"DataType of C{axis} is '{shorten(kind)}'; one of {', '.join(TYPES)} is needed"
                )
        increments = {a: self.read_number(f"Record1/Axes/C{a}/Increment", "1") for a in "XYZ"}
        offsets = {a: self.read_number(f"Record1/Axes/C{a}/Offset", "0") for a in "XYZ"}

        is_list = self.root.find("Record3/MatrixDimension") is None
        rows = 1
        if is_list:
            columns = self.read_size("Record3/ListDimension")
        else:
            columns = self.read_size("Record3/MatrixDimension/SizeX")
            rows = self.read_size("Record3/MatrixDimension/SizeY", "1")
            layers = self.read_size("Record3/MatrixDimension/SizeZ", "1")
            if layers != 1:
                raise self.refuse(
                    f"SizeZ is {layers}; a surface must have one layer: export each layer to its own file"
                )
        count = rows * columns
        if count > MAX_POINTS:
            raise self.refuse(
                f"{count} heights, more than {MAX_POINTS:.0e}; export a part of the scan"
            )
        if kinds["Z"] != "A":
            raise self.refuse("the heights (CZ) are incremental; export the surface anew")

        stored = [axis for axis in "XYZ" if kinds[axis] == "A"]
        read = (
            self._read_binary if self.root.find("Record3/DataLink") is not None else self._read_list
        )
        table = read(stored, count)
        numbers = np.arange(count)
        values = {"X": numbers % columns, "Y": numbers // columns} | dict(zip(stored, table.T))
        points = {axis: values[axis] * increments[axis] + offsets[axis] for axis in "XYZ"}
        if stored != ["Z"] or is_list:
            known = np.isfinite(points["X"]) & np.isfinite(points["Y"])
            if known.sum() < 2:
                raise self.refuse(
                    f"{known.sum()} points with coordinates; a trace needs at least two"
                )
            found = [points[axis][known] for axis in "XYZ"]
            return make_scan_from_points(self.raw.path, found, None, (1.0, 1.0, 1.0), METRES_NOTE)
        for axis, size in (("X", columns), ("Y", rows)):
            if size > 1 and not increments[axis] > 0:
                raise self.refuse(
                    f"Increment of C{axis} is {increments[axis]:g}; a length > 0 m is needed"
                )
        z = points["Z"].reshape(rows, columns)
        x, y = points["X"][:columns], points["Y"][::columns]
        return make_scan_from_matrix(self.raw.path, x, y, z, METRES_NOTE, notes)

    def _read_binary(self, stored: list[str], count: int) -> np.ndarray:
        """Read the raw values (count, axes) of the stored axes from the binary file."""
        types = [self.find_text(f"Record1/Axes/C{axis}/DataType", "D") for axis in stored]
        record = np.dtype([(axis, TYPES[kind]) for axis, kind in zip(stored, types)])
        size = count * record.itemsize
        data = self._read_linked("PointDataLink", "MD5ChecksumPointData", size)
        if len(data) != size:
            raise self.refuse(
                f"{len(data)} bytes of heights, but {count} heights of type {types[-1]} are needed; export "
                "the surface anew"
            )
        points = np.frombuffer(data, record)
        table = np.column_stack([points[axis].astype(float) for axis in stored])
        if self.find_text("Record3/DataLink/ValidPointsLink"):
            valid = self._read_linked("ValidPointsLink", "MD5ChecksumValidPoints", count + 8)
            bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")
            if bits.size < count:
                raise self.refuse(f"{bits.size} valid points, but {count} are needed")
            table[bits[:count] == 0, -1] = np.nan
        table[np.isinf(table)] = np.nan
        return table

    def _read_list(self, stored: list[str], count: int) -> np.ndarray:
        """Read the raw values (count, axes) of the stored axes from main.xml."""
        datums = [(node.text or "").strip() for node in self.root.findall("Record3/DataList/Datum")]
        if len(datums) != count:
            raise self.refuse(
                f"{len(datums)} heights in main.xml, but {count} are needed; export the surface anew"
            )
        table = np.full((count, len(stored)), np.nan)
        for k, text in enumerate(datums):
            cells = [cell.strip() for cell in text.split(";")]
            cells = cells[-len(stored) :] if len(cells) == 3 else [cell for cell in cells if cell]
            try:
                if cells:
                    table[k] = [float(cell or "nan") for cell in cells]
            except ValueError:
                raise self.refuse(
                    f"datum {k + 1} is '{shorten(text)}'; {len(stored)} numbers are needed"
                ) from None
        table[np.isinf(table)] = np.nan
        return table

    def _read_linked(self, link: str, checksum: str, max_bytes: int) -> bytes:
        """Read a binary file by its name in main.xml, and verify its checksum."""
        name = self.find_text(f"Record3/DataLink/{link}")
        if not name or name.startswith(("/", "\\")) or ".." in re.split(r"[/\\]", name):
            raise self.refuse(
                f"{link} '{shorten(name)}' names a place outside the file; export the surface anew"
            )
        place = posixpath.join(self.folder, name.removeprefix("./"))
        data = read_member(self.raw, self.archive, place, max_bytes)
        stated = self.find_text(f"Record3/DataLink/{checksum}")
        if _MD5.fullmatch(stated) and _compute_md5(data) != stated.lower():
            raise self.refuse(
                f"the checksum of {shorten(name)} is wrong: the heights were changed after the file was "
                "written; export the surface anew"
            )
        return data

    def verify_main(self, text: bytes) -> tuple[str, ...]:
        """Return a note if the checksum file lists main.xml with another checksum."""
        name = posixpath.join(
            self.folder, self.find_text("Record4/ChecksumFile", "md5checksum.hex")
        )
        if name not in self.archive.namelist():
            return ()
        words = read_member(self.raw, self.archive, name, MAX_XML_BYTES).decode("latin-1").split()
        is_other = len(words) < 2 or posixpath.basename(words[1].lstrip("*")) != "main.xml"
        if is_other or not _MD5.fullmatch(words[0]) or _compute_md5(text) == words[0].lower():
            return ()
        return (
            f"{self.raw.path}: main.xml does not match its checksum in {shorten(name)}: main.xml "
            "was changed after it was written",
        )


def _compute_md5(data: bytes) -> str:
    return hashlib.md5(data, usedforsecurity=False).hexdigest()


class _SafeTree(TreeBuilder):
    """Builder of an XML tree of limited size, without namespaces, document types and entities."""

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

    def start(self, tag: str, _attributes: dict[str, str]) -> Element:
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
