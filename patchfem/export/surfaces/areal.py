"""Heights as files that other programs read: X3P of ISO 5436-2 (ISO 25178-72), and text in columns."""

import hashlib
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from xml.sax.saxutils import escape
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np

from ... import __version__
from ...disk.whole import write_bytes, write_text

ROWS = 1_000_000  # heights of a text at most: more take seconds to write and to read
MAIN = """<?xml version="1.0" encoding="UTF-8"?>
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


def write_x3p(path: Path, x, y, z, text: str) -> Path:
    """Write heights z (m, n) [m] at the even places x (n,) and y (m,) [m] as X3P; NaN where one is missing.

    text: what the heights are, as its comment.
    """
    data = np.ascontiguousarray(z, "<f8").tobytes()
    steps = [float(np.ptp(axis) / max(axis.size - 1, 1)) or 1.0 for axis in (x, y)]
    main = MAIN.format(dx=steps[0], dy=steps[1], x=float(x[0]), y=float(y[0]), version=__version__, text=escape(text),
                       date=datetime.now(UTC).isoformat(timespec="seconds"), columns=z.shape[1], rows=z.shape[0],
                       sum=hashlib.md5(data).hexdigest()).encode()
    with ZipFile(made := BytesIO(), "w", ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("main.xml", main)
        archive.writestr("md5checksum.hex", f"{hashlib.md5(main).hexdigest()} *main.xml\n")
        archive.writestr("bindata/data.bin", data)
    write_bytes(path, made.getvalue())
    return path


def write_columns(path: Path, x, y, z) -> Path | None:
    """Write the heights that are there as columns x, y, z [um], None where they are more than a text is good for."""
    rows, columns = np.nonzero(np.isfinite(z))
    if rows.size > ROWS:
        return None
    return _columns(path, "xyz", (x[columns], y[rows], z[rows, columns]))


def write_profile(path: Path, x, z) -> Path:
    """Write the heights z (n,) [m] of a trace that are there, over x (n,) [m], as columns x, z [um]."""
    there = np.isfinite(z)
    return _columns(path, "xz", (x[there], z[there]))


def _columns(path: Path, names: str, columns: tuple) -> Path:
    table = np.column_stack(columns) * 1e6
    head, row = ",".join(f"{name} [um]" for name in names), ",".join(["%.10g"] * len(names))
    write_text(path, f"{head}\n" + f"{row}\n" * len(table) % tuple(table.ravel().tolist()))
    return path
