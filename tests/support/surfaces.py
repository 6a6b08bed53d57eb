"""Surface files for the tests: X3P, .npy, .mat, exports of Dektak; how they are read and compared."""

import io
import zipfile

import numpy as np
import pytest
from matlab_files import matlab5_bytes

from patchfem.surface import read_surface
from patchfem.surface.areal import Areal

SPACE = "http://www.opengps.eu/2008/ISO5436_2"
TYPES = {"I": "<i2", "D": "<f8"}


def read_content(folder, content, name="scan.txt", units=None, encoding="utf-8"):
    """Write bytes or a text to a file and return the surface that it contains."""
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode(encoding))
    return read_surface(path, units)


def assert_scan_equal(found, steps, z, rel=1e-14, tolerance=0.0) -> None:
    """Assert that a surface is a scan with the given steps and heights, within a relative and an absolute tolerance."""
    assert isinstance(found, Areal) and found.z.shape == z.shape and not found.z.flags.writeable
    assert found.z == pytest.approx(z, rel=rel, abs=tolerance, nan_ok=True)
    for axis, step in ((found.x, steps[0]), (found.y, steps[1])):
        assert axis == pytest.approx(np.arange(axis.size) * step, rel=1e-15, abs=1e-22)


def draw_scan() -> np.ndarray:
    """Return heights (4, 6) [m] with a deviation of 0.2 um."""
    return np.random.default_rng(2).normal(0.0, 2e-7, (4, 6))


def heights_to_x3p(z, kind="D", increment=1.0) -> bytes:
    """Return heights (m, n) [m] as an X3P file with steps of 0.5 and 0.75 um, stored as z/increment; NaN: missing."""
    raw = (np.rint(np.nan_to_num(z / increment)) if kind == "I" else z / increment).astype(
        TYPES[kind]
    )
    steps = {"CX": 0.5e-6, "CY": 0.75e-6, "CZ": increment}
    axes = "".join(
        f"<{name}><AxisType>{'A' if name == 'CZ' else 'I'}</AxisType><DataType>{kind}</DataType>"
        f"<Increment>{step}</Increment><Offset>0</Offset></{name}>"
        for name, step in steps.items()
    )
    instrument = "".join(
        f"<{tag}>made</{tag}>" for tag in ("Manufacturer", "Model", "Serial", "Version")
    )
    xml = (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<p:ISO5436_2 xmlns:p="{SPACE}"><Record1>'
        f"<Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>{axes}</Axes></Record1>"
        f"<Record2><Date>2026-01-05T10:00:00Z</Date><Instrument>{instrument}</Instrument></Record2><Record3>"
        f"<MatrixDimension><SizeX>{z.shape[1]}</SizeX><SizeY>{z.shape[0]}</SizeY><SizeZ>1</SizeZ></MatrixDimension>"
        "<DataLink><PointDataLink>bindata/data.bin</PointDataLink>"
        "<ValidPointsLink>bindata/valid.bin</ValidPointsLink></DataLink></Record3></p:ISO5436_2>"
    )
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("main.xml", xml)
        archive.writestr("bindata/data.bin", raw.tobytes())
        valid = np.packbits(np.isfinite(z).ravel(), bitorder="little")
        archive.writestr("bindata/valid.bin", valid.tobytes())
    return out.getvalue()


def make_npy(array) -> bytes:
    """Return an array as an .npy file."""
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def make_mat(packed=True, **arrays) -> bytes:
    """Return variables as a MATLAB file of version 5."""
    return matlab5_bytes(arrays, packed)


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
