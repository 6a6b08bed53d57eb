"""Files of instruments: all variants of a format give the written heights, to the last bit if stored exactly."""

import gzip
import re
import sys
import types
import zipfile

import numpy as np
import pytest
import surfaces as write
from surfaces import assert_scan_equal, read_content

from patchfem.core import PatchfemError
from patchfem.surface import Profile

Z = write.draw_scan()
HOLES = np.where(np.arange(24).reshape(4, 6) % 5 == 2, np.nan, Z)
STEPS = (0.5e-6, 0.75e-6)
UM = ("um", "um")


TRACE = np.column_stack([np.arange(24) * 0.5, Z.ravel() * 1e6])
POINTS = np.array([(x * 0.5, y * 0.75, Z[y, x] * 1e6) for y in range(4) for x in range(6)])


def make_columns(header: str, separator=",", order="xyz", z=Z) -> bytes:
    """Return a text of three columns without the missing heights."""
    rows = ["".join(header)]
    for (x, y, _), height in zip(POINTS, z.ravel()):
        texts = {"x": f"{x:.2f}", "y": f"{y:.2f}", "z": repr(float(height * 1e6))}
        if np.isfinite(height):
            rows.append(separator.join(texts[name] for name in order))
    return "\n".join(rows).encode()


COLUMNS = dict(zip("XYZ", (POINTS[:, k].reshape(4, 6) for k in range(3))))
# Variants of a format: bytes, file name, given units, heights, and largest error of a height.
SCANS = {
    "npy": (write.make_npy(POINTS), "a.npy", UM, Z, 1e-20),
    "mat beside a row": (write.make_mat(points=POINTS, note=np.arange(9.0)[None]), "a.mat", UM, Z, 1e-20),
    "mat unpacked": (write.make_mat(False, points=POINTS, size=24.0), "a.mat", UM, Z, 1e-20),
    "mat with axes": (
        write.make_mat(x=np.arange(6) * 0.5, y=np.arange(4) * 0.75, z=Z * 1e6), "a.mat", UM, Z, 1e-20),
    "mat of three columns": (
        write.make_mat(x=POINTS[:, 0], y=POINTS[:, 1], gap=POINTS[:, 2]), "a.mat", UM, Z, 1e-20),
    "mat of three matrices": (write.make_mat(**COLUMNS, text="scan"), "a.mat", UM, Z, 1e-20),
    "text": (make_columns("x [um],y [um],z [um]"), "a.txt", None, Z, 1e-20),
    "text without a header": (make_columns("")[1:], "a.txt", UM, Z, 1e-20),
    "text with decimal commas": (
        make_columns("y (um);z (um);x (um)", ";", "yzx").replace(b".", b","), "a.txt", None, Z, 1e-20),
    "text with holes": (make_columns("x [um],y [um],z [um]", z=HOLES), "a.txt", None, HOLES, 1e-20),
}  # fmt: skip


@pytest.mark.parametrize("data, name, units, z, tolerance", SCANS.values(), ids=SCANS)
def test_exact_scan_in_each_format_agrees(tmp_path, data, name, units, z, tolerance):
    """A scan in each variant of the formats gives the written heights within its resolution."""
    assert_scan_equal(read_content(tmp_path, data, name, units), STEPS, z, 0.0, tolerance)


@pytest.mark.parametrize("kind, increment, tolerance", [("D", 1.0, 0.0), ("I", 2e-10, 1.01e-10)])
def test_exact_x3p_of_reader_library_agrees(tmp_path, kind, increment, tolerance):
    """An X3P file gives the heights, steps and missing points that were written, in metres."""
    pytest.importorskip("SurfaceTopography")
    for z in (Z, HOLES):
        found = read_content(tmp_path, write.heights_to_x3p(z, kind, increment), "a.x3p", UM)
        assert_scan_equal(found, STEPS, z, 0.0, tolerance)
        assert (
            "read as X3P" in found.notes[0] and "units that you gave are ignored" in found.notes[1]
        )


REFUSED = {  # bytes, file name, given units, and the expected message
    "no raster": (b"x [um],y [um],z [um]\n0,0,1\n1,1,1\n2,3,1\n3,2,1\n4,5,1\n9,8,1\n7,7,1\n", "a.txt", None,
                  "7 different x and 7 different y do"),
    "a place twice": (b"x [um],y [um],z [um]\n0,0,1\n1,0,1\n0,1,1\n1,1,1\n1,0,2\n", "a.txt", None,
                      ":6: a second height at x = 1 um, y = 0 um"),
    "two numbers": (b"x [um],y [um],z [um]\n0,0,1\n1,0,1\n0,1\n", "a.txt", None,
                    ":4: '0,1': 3 numbers are needed"),
    "an unknown column": (b"x [um],y [um],w [um]\n0,0,1\n", "a.txt", None,
                          "the columns .*'w .um.' are not x, y, z, which are needed"),
    "too steep": (b"x [um],y [um],z [mm]\n0,0,1\n1,0,1\n0,1,1\n1,1,9\n", "a.txt", None,
                  "heights span 8 mm over a length of 1 um; is the unit"),
    **{
        f"{what} of {name}": (data, name, units, sentence)
        for data, name in ((write.make_npy(TRACE), "a.npy"), (write.make_mat(points=POINTS), "a.mat"))
        for what, units, sentence in (
            ("no units", None, r'the unit of x is not given.*units=\("mm", "um"\)'),
            ("an unknown unit", ("um", "furlong"), "the units .'um', 'furlong'. are not those of x and of z.*m, km"))
    },
    "an unknown unit of a text": (b"x,z\n0,1\n5,2\n", "a.csv", ("um", "furlong"),
                                  "the units .'um', 'furlong'. are not those of x and of z.*m, km"),
    **{
        f"units {units!r}": (b"x [um],z [um]\n0,1\n5,2\n", "a.csv", units,
                           f"the units {re.escape(repr(units))} are not those of x and of z.*# Width: 1.2 mm")
        # Each letter of "mm" is a unit.
        for units in ("um", "mm", 5, ("mm",), ("mm", 1.0), ("0.8 um", "um"))
    },
    "npy with a pixel size": (write.make_npy(np.zeros((4, 6))), "a.npy", ("0.8 um", "um"),
                              "size of a matrix of heights, which is no unit, write `# Width: 1.2 mm`"),
    "npy of no columns": (write.make_npy(np.zeros((4, 6))), "a.npy", UM,
                          r"holds float64 \(4, 6\); one matrix of the columns x, z or x, y, z is needed"),
    "npy of complex numbers": (write.make_npy(TRACE.astype(complex)), "a.npy", UM,
                               "holds no array of real numbers; one matrix"),
    "npy cut off": (write.make_npy(TRACE)[:-8], "a.npy", UM,
                    "expected 384 bytes got 376"),
    "npy of a negative size": (write.make_npy(TRACE).replace(b"(24, 2)", b"(24,-2)"), "a.npy", UM,
                               "cut off or damaged; save or export it anew .negative"),
    "mat of two traces": (write.make_mat(a=TRACE, b=TRACE), "a.mat", UM,
                          r"holds a \(24, 2\), b \(24, 2\); one matrix"),
    "mat of other sizes": (write.make_mat(x=np.arange(6.0), y=np.arange(3.0), z=Z), "a.mat", UM,
                           r"of shapes .* do not fit"),
    "mat of version 7.3": (b"MATLAB 7.3 MAT-file, HDF5" + bytes(600), "a.mat", UM,
                           "no readable MATLAB file .*; save it anew"),
    "mat cut off": (write.make_mat(points=POINTS)[:-9], "a.mat", UM, "no readable MATLAB file .*; save it anew"),
    "dektak without its columns": (
        write.make_dektak(Z.ravel()).replace(b"Lateral", b"Time"), "a.csv", None,
        "the columns 'Time um', 'Raw Micrometer' are not x, z"),
    "dektak in volts": (
        write.make_dektak(Z.ravel()).replace(b"Raw Micrometer", b"Raw Volt"), "a.csv", None,
        ":13: the columns 'Lateral um', 'Raw Volt' are not x, z"),
}  # fmt: skip


@pytest.mark.parametrize("data, name, units, message", REFUSED.values(), ids=REFUSED)
def test_refuses_faulty_file(tmp_path, data, name, units, message):
    """A faulty file is refused with a message that states the fault."""
    with pytest.raises(PatchfemError, match=message):
        read_content(tmp_path, data, name, units)


@pytest.mark.parametrize(
    "table", [TRACE, TRACE.T, TRACE.astype("f4"), TRACE.astype(">f8"), np.asfortranarray(TRACE)]
)
def test_exact_npy_columns_give_trace(tmp_path, table):
    """The two columns of a .npy file give a trace, for all orders and types of its array."""
    found = read_content(tmp_path, write.make_npy(table), "scan.npy", UM)
    assert isinstance(found, Profile) and found.x == pytest.approx(TRACE[:, 0] * 1e-6)
    assert found.z == pytest.approx(Z.ravel(), rel=1e-6 if table.dtype == "f4" else 1e-14)


def test_exact_dektak_export_agrees(tmp_path):
    """A Dektak export gives the heights and the exact step of 50 um over 320 points, although it prints rounded x."""
    z = np.random.default_rng(1).normal(size=320)
    found = read_content(tmp_path, write.make_dektak(z), "scan.csv")
    assert found.x == pytest.approx(np.arange(320) * 0.15625e-6, rel=1e-14)
    assert found.z == pytest.approx(np.round(z, 5) * 1e-6, rel=1e-14)
    assert np.array_equal(
        read_content(tmp_path, write.make_dektak(z, results=False), "scan.csv").z, found.z
    )
    utf16_trace = read_content(
        tmp_path, write.make_dektak(z).decode("latin-1").encode("utf-16"), "scan.csv"
    )
    assert np.array_equal(utf16_trace.z, found.z)
    in_angstrom = write.make_dektak(z).replace(b"Raw Micrometer", b"Raw A")
    assert read_content(tmp_path, in_angstrom, "scan.csv").z == pytest.approx(
        found.z * 1e-4, rel=1e-14, abs=0
    )


class StandIn:
    """Reader of SurfaceTopography of a scan of three columns and two rows, 3 um x 2 um, with heights."""

    nb_grid_pts = (3, 2)
    physical_sizes = (3.0, 2.0)

    def __init__(self, unit) -> None:
        self.unit = unit
        self.default_channel = self

    def topography(self):
        """Return the scan, in the unit of the file."""
        return self

    def to_unit(self, unit):
        """Return the scan in metres."""
        assert unit == "m"
        self.physical_sizes = (3e-6, 2e-6)
        return self

    def heights(self):
        """Return the heights with x along the first axis."""
        return np.array([[7e-9, 1e-6], [0.0, 1e-6], [0.0, 2e-6]])


def use_library(monkeypatch, open_topography) -> None:
    """Replace SurfaceTopography by a library with a given function open_topography."""
    library = types.ModuleType("SurfaceTopography")
    library.__version__ = "1.2"
    files = types.ModuleType("SurfaceTopography.IO")
    files.open_topography = open_topography
    monkeypatch.setitem(sys.modules, "SurfaceTopography", library)
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", files)


@pytest.mark.parametrize("packed", [False, True])
def test_exact_scan_of_reader_library(tmp_path, monkeypatch, packed):
    """A scan of the reader library keeps its units or needs some; also from a packed file."""
    data = b"\x00\x01\x02" * 99
    name = "scan.opdx.gz" if packed else "scan.opdx"
    use_library(monkeypatch, lambda file: StandIn("um" if packed or file else ""))
    found = read_content(tmp_path, gzip.compress(data) if packed else data, name)
    assert found.z == pytest.approx(np.array([[7e-9, 0.0, 0.0], [1e-6, 1e-6, 2e-6]]), rel=1e-14)
    assert found.x == pytest.approx([0, 1e-6, 2e-6]) and found.y == pytest.approx([0, 1e-6])
    assert found.notes == (f"{tmp_path / name}: read as StandIn by SurfaceTopography 1.2",)
    use_library(monkeypatch, lambda file: StandIn(None))
    with pytest.raises(PatchfemError, match="the unit of x is not given"):
        read_content(tmp_path, data, "scan.opdx")
    assert read_content(tmp_path, data, "scan.opdx", ("mm", "m")).x[1] == 1e-3


class LargeStandIn(StandIn):
    """Reader of a scan of 2e8 heights, which it cannot deliver."""

    nb_grid_pts = (20000, 10000)
    topography = None


def test_refuses_scan_that_unpacks_to_gigabytes(tmp_path, monkeypatch):
    """A zip file that states 2 GiB, and a scan of 2e8 heights in a small file, are refused before they are read."""
    use_library(monkeypatch, lambda file: LargeStandIn("um"))
    with pytest.raises(
        PatchfemError, match=r"scan.opdx: 200000000 heights, more than 5e\+07; export a part"
    ):
        read_content(tmp_path, b"\x00\x01\x02" * 99, "scan.opdx")

    path = tmp_path / "a.x3p"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bindata/data.bin", bytes(2000))
    use_library(monkeypatch, None)
    data = path.read_bytes()
    # The size of the unpacked file stands in its entry in the directory at the end.
    start = data.index(b"PK\x01\x02")
    data = data[:start] + data[start:].replace(
        (2000).to_bytes(4, "little"), (2**31).to_bytes(4, "little")
    )
    with pytest.raises(PatchfemError, match=r"b.x3p: more than 1024 MiB after it is unpacked; exp"):
        read_content(tmp_path, data, "b.x3p")
