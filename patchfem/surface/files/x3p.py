"""X3P files (ISO 5436-2, ISO 25178-72): a zip file with main.xml and heights, in metres.

x and y are incremental, or absolute and then stored with each point; every value of an axis is raw *
Increment + Offset. Heights are binary data or a list in the XML. Missing: NaN, infinite, an empty
datum, or what the file of valid points leaves out, one bit each.
"""

import io
import posixpath
from dataclasses import dataclass
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np

from ...core import PatchfemError
from .content import MAX_BYTES, MIB, Content, refuse_damage
from .spellings import shorten
from .table import MAX_POINTS, Table

MAX_XML_BYTES = 16 * MIB  # largest size of main.xml; heights stored there take 30 bytes each
_TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_ANEW = "export the surface anew"


def read_x3p(content: Content, _units=None) -> Table:
    """Read the points or the matrix of an X3P file."""
    path = content.path
    with refuse_damage(path), ZipFile(io.BytesIO(content.data)) as archive:
        names = [name for name in archive.namelist() if posixpath.basename(name) == "main.xml"]
        if len(names) != 1:
            raise PatchfemError(
                f"{path}: contains {len(names)} files main.xml, but exactly one is needed"
            )
        folder = posixpath.dirname(names[0])
        # The parser itself limits the size of entities.
        root = ElementTree.fromstring(_read_member(path, archive, names[0], MAX_XML_BYTES))
        columns = _Surface(path, archive, folder, root).read_columns()
    units = dict.fromkeys(columns, "m")
    return Table(path, columns, units, str(path), are_units_fixed=True)


def _read_member(path, archive: ZipFile, name: str, max_bytes: int) -> bytes:
    """Read a member of a zip file up to a limit."""
    if name not in archive.namelist():
        raise PatchfemError(f"{path}: no {shorten(name)} inside it; {_ANEW}")
    with archive.open(name) as file:
        data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise PatchfemError(f"{path}: {shorten(name)} inside it has more than {max_bytes} bytes")
    return data


@dataclass(frozen=True, eq=False)
class _Surface:
    """Open X3P file with the folder and the root element of its main.xml."""

    path: object
    archive: ZipFile
    folder: str
    root: ElementTree.Element

    def find_text(self, place: str, default: str = "") -> str:
        """Return the text of an element of any namespace, or a default."""
        text = self.root.findtext("/".join(f"{{*}}{name}" for name in place.split("/")))
        return (text or "").strip() or default

    def read_number(self, place: str, default: str) -> float:
        """Read a finite number."""
        text = self.find_text(place, default)
        try:
            value = float(text.replace("_", "?"))
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            *_, axis, name = place.split("/")
            raise PatchfemError(
                f"{self.path}: {name} of {axis} is '{shorten(text)}'; a number is needed"
            )
        return value

    def read_size(self, place: str, default: str = "") -> int:
        """Read a number of points."""
        text = self.find_text(f"Record3/{place}", default)
        if not text.isdecimal() or not 1 <= float(text) <= MAX_POINTS:
            raise PatchfemError(
                f"{self.path}: {place.rpartition('/')[2]} is '{shorten(text)}'; a whole number from 1 to "
                f"{MAX_POINTS:.0e} is needed"
            )
        return int(text)

    def read_columns(self) -> dict[str, np.ndarray]:
        """Read axes, sizes and heights; returns the columns of points, or a matrix z with its axes."""
        stored = {}  # type of each coordinate that is stored with each point
        for axis in "XYZ":
            place = f"Record1/Axes/C{axis}"
            if axis != "Y" and self.root.find("{*}Record1/{*}Axes/{*}C" + axis) is None:
                raise PatchfemError(f"{self.path}: main.xml lacks {place}; {_ANEW}")
            kind = self.find_text(f"{place}/DataType", "D")
            if kind not in _TYPES:
                raise PatchfemError(
                    f"{self.path}: DataType of C{axis} is '{shorten(kind)}'; one of {', '.join(_TYPES)} is needed"
                )
            if self.find_text(f"{place}/AxisType", "A" if axis == "Z" else "I") == "A":
                stored[axis] = _TYPES[kind]
        if "Z" not in stored:
            raise PatchfemError(f"{self.path}: the heights (CZ) are incremental; {_ANEW}")

        rows = 1
        is_list = self.root.find("{*}Record3/{*}MatrixDimension") is None
        if is_list:
            count = self.read_size("ListDimension")
        else:
            count = self.read_size("MatrixDimension/SizeX")
            rows = self.read_size("MatrixDimension/SizeY", "1")
            if self.find_text("Record3/MatrixDimension/SizeZ", "1") != "1":
                raise PatchfemError(
                    f"{self.path}: SizeZ is not 1; a surface must have one layer: export each layer to its own file"
                )
        if rows * count > MAX_POINTS:
            raise PatchfemError(
                f"{self.path}: more than {MAX_POINTS:.0e} heights; export a part of the scan"
            )

        increments = {a: self.read_number(f"Record1/Axes/C{a}/Increment", "1") for a in "XYZ"}
        offsets = {a: self.read_number(f"Record1/Axes/C{a}/Offset", "0") for a in "XYZ"}
        index = np.arange(rows * count)
        raw = {"X": index % count, "Y": index // count}
        is_binary = self.root.find("{*}Record3/{*}DataLink") is not None
        raw |= (self._read_binary if is_binary else self._read_list)(stored, index.size)
        columns = {a.lower(): raw[a] * increments[a] + offsets[a] for a in "XYZ"}
        columns["z"][np.isinf(columns["z"])] = np.nan
        if is_list or len(stored) > 1:
            known = np.isfinite(columns["x"]) & np.isfinite(columns["y"])
            return {name: values[known] for name, values in columns.items()}
        matrix = {name: values.reshape(rows, count) for name, values in columns.items()}
        return {"x": matrix["x"][0], "y": matrix["y"][:, 0], "z": matrix["z"]}

    def _read_binary(self, stored: dict[str, str], count: int) -> dict[str, np.ndarray]:
        """Read the stored coordinates of all points from the binary file."""
        record = np.dtype(list(stored.items()))
        data = self._read_linked("PointDataLink")
        if len(data) != count * record.itemsize:
            raise PatchfemError(
                f"{self.path}: {len(data)} bytes of heights, but {count} heights of {record.itemsize} bytes are "
                f"needed; {_ANEW}"
            )
        points = np.frombuffer(data, record)
        raw = {axis: points[axis].astype(float) for axis in stored}
        if self.find_text("Record3/DataLink/ValidPointsLink"):
            valid = self._read_linked("ValidPointsLink")
            bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")
            if bits.size < count:
                raise PatchfemError(
                    f"{self.path}: {bits.size} valid points, but {count} are needed"
                )
            raw["Z"][bits[:count] == 0] = np.nan
        return raw

    def _read_list(self, stored: dict[str, str], count: int) -> dict[str, np.ndarray]:
        """Read the stored coordinates of all points from main.xml."""
        datums = [
            (node.text or "").strip()
            for node in self.root.findall("{*}Record3/{*}DataList/{*}Datum")
        ]
        if len(datums) != count:
            raise PatchfemError(
                f"{self.path}: {len(datums)} heights in main.xml, but {count} are needed; {_ANEW}"
            )
        table = np.full((count, len(stored)), np.nan)
        for k, text in enumerate(datums):
            # Incremental coordinates are left out or empty.
            cells = [cell.strip() for cell in text.split(";")][-len(stored) :]
            if any(cells):
                table[k] = [float(cell or "nan") for cell in cells]
        return dict(zip(stored, table.T))

    def _read_linked(self, link: str) -> bytes:
        """Read a binary file by its name in main.xml."""
        name = self.find_text(f"Record3/DataLink/{link}").removeprefix("./")
        place = posixpath.join(self.folder, name)
        return _read_member(self.path, self.archive, place, MAX_BYTES)
