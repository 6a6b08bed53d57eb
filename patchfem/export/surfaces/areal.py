"""Heights as files for other programs: X3P (ISO 5436-2, ISO 25178-72) and text in columns."""

import hashlib
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from xml.sax.saxutils import escape
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from ... import __version__
from ...disk.atomic_write import write_bytes, write_text

# Largest number of heights that are written as text; larger files would
# take seconds to write and to read.
MAX_TEXT_ROWS = 1_000_000
_MAIN_XML = """<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<Record1><Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>
<CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{dx!r}</Increment><Offset>{x!r}</Offset></CX>
<CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{dy!r}</Increment><Offset>{y!r}</Offset></CY>
<CZ><AxisType>A</AxisType><DataType>D</DataType><Increment>1</Increment><Offset>0</Offset></CZ>
</Axes></Record1>
<Record2><Date>{date}</Date><Instrument><Manufacturer>patchfem</Manufacturer><Model>-</Model><Serial>-</Serial>\
<Version>{version}</Version></Instrument><CalibrationDate>{date}</CalibrationDate>
<ProbingSystem><Type>Software</Type><Identification>{text}</Identification></ProbingSystem>
<Comment>{text}</Comment></Record2>
<Record3><MatrixDimension><SizeX>{columns}</SizeX><SizeY>{rows}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink><MD5ChecksumPointData>{sum}</MD5ChecksumPointData></DataLink>
</Record3><Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></p:ISO5436_2>
"""


def write_x3p(path: Path, x, y, z, text: str) -> None:
    """Write the heights of an areal scan as an X3P file.

    Parameters
    ----------
    path : Path
    x, y : (n,), (m,) arrays [m]
        Evenly spaced positions.
    z : (m, n) array [m]
        NaN for missing heights.
    text : str
        Description of the heights, for the comment of the file.
    """
    data = np.ascontiguousarray(z, "<f8").tobytes()
    dx, dy = (float(np.ptp(axis) / max(axis.size - 1, 1)) or 1.0 for axis in (x, y))
    main = _MAIN_XML.format(
        dx=dx,
        dy=dy,
        x=float(x[0]),
        y=float(y[0]),
        version=__version__,
        text=escape(text),
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        columns=z.shape[1],
        rows=z.shape[0],
        sum=hashlib.md5(data).hexdigest(),
    ).encode()
    with ZipFile(content := BytesIO(), "w", ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("main.xml", main)
        archive.writestr("md5checksum.hex", f"{hashlib.md5(main).hexdigest()} *main.xml\n")
        archive.writestr("bindata/data.bin", data)
    write_bytes(path, content.getvalue())


def write_columns(path: Path, x, y, z) -> None:
    """Write the known heights of an areal scan as text in columns x, y, z [um].

    Nothing is written if there are more than MAX_TEXT_ROWS heights.

    Parameters
    ----------
    path : Path
    x, y : (n,), (m,) arrays [m]
    z : (m, n) array [m]
    """
    rows, columns = np.nonzero(np.isfinite(z))
    if rows.size <= MAX_TEXT_ROWS:
        _write_table(path, "xyz", (x[columns], y[rows], z[rows, columns]))


def write_profile(path: Path, x, z) -> None:
    """Write the known heights of a trace as text in columns x, z [um].

    Parameters
    ----------
    path : Path
    x, z : (n,) arrays [m]
    """
    known = np.isfinite(z)
    _write_table(path, "xz", (x[known], z[known]))


def _write_table(path: Path, names: str, columns: tuple) -> None:
    """Write columns of lengths [m] as a text file in micrometres."""
    table = np.column_stack(columns) * 1e6
    head = ",".join(f"{name} [um]" for name in names)
    row = ",".join(["%.10g"] * len(names))
    write_text(path, f"{head}\n" + f"{row}\n" * len(table) % tuple(table.ravel().tolist()))
