"""X3P files (ISO 5436-2, ISO 25178-72): a zip file with main.xml and a matrix of heights in a binary file, in metres.

The axes x and y are incremental, and every value is raw * Increment + Offset. A height is missing if it is not finite,
or if the file of valid points, one bit each, leaves it out.
"""

import io
import posixpath
from xml.etree import ElementTree
from zipfile import ZipFile

import numpy as np

from ...core import PatchfemError
from .content import MAX_BYTES, MIB, Content, refuse_damage
from .spellings import shorten
from .table import MAX_POINTS, Table

MAX_XML_BYTES = 16 * MIB  # largest size of main.xml
_TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_ANEW = "export the surface anew, as a matrix with incremental axes"


def read_x3p(content: Content, _units=None) -> Table:
    """Read the matrix of an X3P file."""
    path = content.path
    with refuse_damage(path), ZipFile(io.BytesIO(content.data)) as archive:
        names = [name for name in archive.namelist() if posixpath.basename(name) == "main.xml"]
        if len(names) != 1:
            raise PatchfemError(
                f"{path}: contains {len(names)} files main.xml, but exactly one is needed"
            )
        # The parser itself limits the size of entities.
        root = ElementTree.fromstring(_read_member(archive, names[0], MAX_XML_BYTES))
        places = {}
        for link in ("PointDataLink", "ValidPointsLink"):
            name = _find_text(root, f"Record3/DataLink/{link}").removeprefix("./")
            places[link] = posixpath.join(posixpath.dirname(names[0]), name) if name else ""
        columns = _read_matrix(path, archive, root, places)
    return Table(path, columns, dict.fromkeys(columns, "m"), str(path), are_units_fixed=True)


def _read_member(archive: ZipFile, name: str, max_bytes: int) -> bytes:
    """Read a member of a zip file up to a limit."""
    with archive.open(name) as file:
        data = file.read(max_bytes + 1)
    if len(data) > max_bytes:
        raise ValueError(f"{shorten(name)} has more than {max_bytes} bytes")
    return data


def _find_text(root, place: str, default: str = "") -> str:
    """Return the text of an element of any namespace, or a default."""
    text = root.findtext("/".join(f"{{*}}{name}" for name in place.split("/")))
    return (text or "").strip() or default


def _read_matrix(path, archive: ZipFile, root, places: dict[str, str]) -> dict[str, np.ndarray]:
    """Return x (n,), y (m,) and the heights z (m, n) [m]; places: names of the binary files."""
    types = [_find_text(root, f"Record1/Axes/C{axis}/AxisType", "I") for axis in "XYZ"]
    if types != ["I", "I", "A"] or not places["PointDataLink"]:
        raise PatchfemError(
            f"{path}: the heights stand in main.xml or have places of their own; {_ANEW}"
        )
    sizes = {}
    for axis, default in (("X", ""), ("Y", "1"), ("Z", "1")):
        text = _find_text(root, f"Record3/MatrixDimension/Size{axis}", default)
        if not text.isdecimal() or not 1 <= float(text) <= MAX_POINTS:
            raise ValueError(f"Size{axis} is '{shorten(text)}'; a whole number is needed; {_ANEW}")
        sizes[axis] = int(text)
    if sizes["Z"] != 1 or sizes["X"] * sizes["Y"] > MAX_POINTS:
        raise ValueError(f"a single layer of at most {MAX_POINTS:.0e} heights is needed")
    scales = {}
    for axis in "XYZ":
        numbers = [
            float(_find_text(root, f"Record1/Axes/C{axis}/{name}", default))
            for name, default in (("Increment", "1"), ("Offset", "0"))
        ]
        if not np.isfinite(numbers).all():
            raise ValueError(f"the numbers of axis {axis} are not finite")
        scales[axis] = numbers
    kind = _find_text(root, "Record1/Axes/CZ/DataType", "D")
    raw = np.frombuffer(_read_member(archive, places["PointDataLink"], MAX_BYTES), _TYPES[kind])
    if raw.size != sizes["X"] * sizes["Y"]:
        raise ValueError(f"{raw.size} heights, but {sizes['X'] * sizes['Y']} are needed")
    z = raw * scales["Z"][0] + scales["Z"][1]
    z[~np.isfinite(z)] = np.nan
    if places["ValidPointsLink"]:
        valid = _read_member(archive, places["ValidPointsLink"], MAX_BYTES)
        bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")
        z[bits[: z.size] == 0] = np.nan
    x, y = (scales[axis][1] + scales[axis][0] * np.arange(sizes[axis]) for axis in "XY")
    return {"x": x, "y": y, "z": z.reshape(y.size, x.size)}
