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
from ...inputs.damage import refuse_damage
from .content import DAMAGED, MAX_BYTES, Content
from .instruments import read_instrument
from .table import Table

_TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


def read_x3p(content: Content) -> Table:
    """Read the matrix of an X3P file; another zip file is that of an instrument.

    A matrix of a single row is a trace. Numbers that do not fit together count as damage.
    """
    path = content.path
    with refuse_damage(f"{path}: {DAMAGED}"), ZipFile(io.BytesIO(content.data)) as archive:
        names = [name for name in archive.namelist() if posixpath.basename(name) == "main.xml"]
        if not names:
            return read_instrument(content)
        folder = posixpath.dirname(names[0])
        # The parser itself limits the size of entities.
        root = ElementTree.fromstring(_read_member(archive, names[0]))
        types = [_find_text(root, f"Record1/Axes/C{axis}/AxisType", "I") for axis in "XYZ"]
        data = _find_text(root, "Record3/DataLink/PointDataLink")
        if types != ["I", "I", "A"] or not data:
            raise PatchfemError(
                f"{path}: the heights stand in main.xml or have places of their own; export the surface anew, as a "
                "matrix with incremental axes"
            )

        sizes = []
        scales = []
        for axis in "XYZ":
            sizes.append(int(_find_text(root, f"Record3/MatrixDimension/Size{axis}", "1")))
            increment = _find_text(root, f"Record1/Axes/C{axis}/Increment", "1")
            offset = _find_text(root, f"Record1/Axes/C{axis}/Offset", "0")
            scales.append((float(increment), float(offset)))
        kind = _TYPES[_find_text(root, "Record1/Axes/CZ/DataType", "D")]
        raw = np.frombuffer(_read_member(archive, posixpath.join(folder, data)), kind)
        z = raw.reshape(sizes[1::-1]) * scales[2][0] + scales[2][1]
        valid = _find_text(root, "Record3/DataLink/ValidPointsLink")
        if valid:
            packed = np.frombuffer(_read_member(archive, posixpath.join(folder, valid)), np.uint8)
            bits = np.unpackbits(packed, count=z.size, bitorder="little").reshape(z.shape)
            z[bits == 0] = np.nan

    z[~np.isfinite(z)] = np.nan
    x, y = (scale[1] + scale[0] * np.arange(count) for scale, count in zip(scales, sizes[:2]))
    columns = {"x": x, "z": z[0]} if y.size == 1 else {"x": x, "y": y, "z": z}
    return Table(path, columns, dict.fromkeys(columns, "m"), str(path), are_units_fixed=True)


def _read_member(archive: ZipFile, name: str) -> bytes:
    """Read a member of a zip file up to the limit of a file."""
    with archive.open(posixpath.normpath(name)) as file:
        data = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise ValueError(f"a member has more than {MAX_BYTES} bytes")
    return data


def _find_text(root, place: str, default: str = "") -> str:
    """Return the text of an element of any namespace, or a default."""
    text = root.findtext("/".join(f"{{*}}{name}" for name in place.split("/")))
    return (text or "").strip() or default
