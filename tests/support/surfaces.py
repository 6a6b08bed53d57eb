"""Surface files for the tests: variants of X3P, SDF, .npy, .mat, exports of Dektak."""

import hashlib
import io
import struct
import zipfile

import numpy as np
from scipy.io import savemat

SPACE = "http://www.opengps.eu/2008/ISO5436_2"
TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


def draw_scan(rows=4, count=6, seed=2) -> np.ndarray:
    """Return heights (rows, count) [m] with a deviation of 0.2 um."""
    return np.random.default_rng(seed).normal(0.0, 2e-7, (rows, count))


def make_zip(members: dict) -> bytes:
    """Return a zip file of {name: bytes}."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def format_axis(name: str, kind="I", data="D", increment=None, offset=None) -> str:
    """Return an axis of main.xml."""
    parts = {"AxisType": kind, "DataType": data, "Increment": increment, "Offset": offset}
    inside = "".join(f"<{key}>{value}</{key}>" for key, value in parts.items() if value is not None)
    return f"<{name}>{inside}</{name}>"


def make_main_xml(
    axes: str, record3: str, feature="SUR", revision="ISO5436 - 2000", prefix="p:"
) -> bytes:
    """Return main.xml with the given axes and third record."""
    space = f' xmlns:{prefix[:-1]}="{SPACE}"' if prefix else f' xmlns="{SPACE}"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<{prefix}ISO5436_2{space}><Record1>'
        f"<Revision>{revision}</Revision><FeatureType>{feature}</FeatureType><Axes>{axes}</Axes></Record1><Record2><Date>N/A</Date></Record2>"
        f"<Record3>{record3}</Record3><Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4>"
        f"</{prefix}ISO5436_2>"
    ).encode()


def format_matrix(count: int, rows: int, layers=1) -> str:
    """Return the dimensions of a matrix for the third record."""
    return f"<MatrixDimension><SizeX>{count}</SizeX><SizeY>{rows}</SizeY><SizeZ>{layers}</SizeZ></MatrixDimension>"


def format_link(data: bytes, valid: bytes | None = None, md5=None, name="bindata/data.bin") -> str:
    """Return the link to the binary data for the third record."""
    valid_points = (
        ""
        if valid is None
        else (
            f"<ValidPointsLink>bindata/valid.bin</ValidPointsLink><MD5ChecksumValidPoints>"
            f"{hashlib.md5(valid).hexdigest()}</MD5ChecksumValidPoints>"
        )
    )
    return (
        f"<DataLink><PointDataLink>{name}</PointDataLink><MD5ChecksumPointData>"
        f"{md5 or hashlib.md5(data).hexdigest().upper()}</MD5ChecksumPointData>{valid_points}</DataLink>"
    )


def make_x3p(
    xml: bytes, data: bytes | None = None, valid: bytes | None = None, folder="", checksum=None
) -> bytes:
    """Return an X3P file made of its parts."""
    members = {
        f"{folder}main.xml": xml,
        f"{folder}md5checksum.hex": f"{checksum or hashlib.md5(xml).hexdigest()} *main.xml\n".encode(),
    }
    if data is not None:
        members[f"{folder}bindata/data.bin"] = data
    if valid is not None:
        members[f"{folder}bindata/valid.bin"] = valid
    return make_zip(members)


def heights_to_x3p(z, data="D", increment=1.0, offset=0.0, **more) -> bytes:
    """Return heights (m, n) [m] as a binary X3P file, stored as (z - offset)/increment."""
    raw = (z - offset) / increment
    raw = (np.rint(np.nan_to_num(raw)) if data in "IL" else raw).astype(TYPES[data]).tobytes()
    valid = None
    if data in "IL" and np.isnan(z).any():
        valid = np.packbits(np.isfinite(z).ravel(), bitorder="little").tobytes()
    axes = (
        format_axis("CX", increment=0.5e-6)
        + format_axis("CY", increment=0.75e-6)
        + format_axis("CZ", "A", data, increment if increment != 1 else None, offset or None)
    )
    xml = make_main_xml(
        axes, format_matrix(z.shape[1], z.shape[0]) + format_link(raw, valid), **more
    )
    return make_x3p(xml, raw, valid)


def make_binary_sdf(z) -> bytes:
    """Return heights (m, n) [m] as a binary SDF file of 8-byte numbers in nanometres."""
    names = b"bISO-1.0", b"tests", b"010120260000", b"010120260000"
    scales = 0.5e-6, 0.75e-6, 1e-9, 0.0
    head = struct.pack("<8s10s12s12sHHddddBBB", *names, z.shape[1], z.shape[0], *scales, 0, 7, 0)
    return head + (z / 1e-9).astype("<f8").tobytes()


def make_npy(array) -> bytes:
    """Return an array as an .npy file."""
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def make_mat(packed=True, **arrays) -> bytes:
    """Return variables as a MATLAB file of version 5."""
    out = io.BytesIO()
    savemat(out, arrays, do_compression=packed)
    return out.getvalue()


def make_dektak(z, length=50.0, results=True) -> bytes:
    """Return heights (n,) [um] over a length [um] as an export of Dektak, with x printed to 0.1 um."""
    x = np.arange(z.size) * length / z.size
    analysis = (
        "\nAnalytical Results\nFunction,R.Cur Pos,R.Cur Width,M.Cur Pos,M.Cur Width,Result\n"
        "Ra,1.0 um,0.5 um,9.0 um,0.0 um,0.00525 um\nSkew,1.0 um,0.0 um,9.0 um,0.0 um,6.96\n"
    )
    head = (
        f"Scan Parameters\nScan Type,Standard Scan\nStylus,Radius: 2.5 µm\nLength,{length} um\nDuration,32 sec\n"
        f"{analysis if results else ''}\nScan Data\nLateral um,Raw Micrometer,\n"
    )
    return (head + "".join(f"{a:.1f},{b:.5f},,\n" for a, b in zip(x, z))).encode("latin-1")
