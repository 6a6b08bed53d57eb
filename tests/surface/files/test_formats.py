"""Files of instruments: every variant that a format allows gives the heights that were written, bit for bit."""

import gzip
import os
from importlib.util import find_spec

import numpy as np
import pytest
import surfaces as write
from scipy.io import savemat

from patchfem.core import Missing, PatchfemError
from patchfem.surface.areal import Areal
from patchfem.surface.files import instruments
from patchfem.surface.files.read import read_profile, read_surface
from patchfem.surface.profile import Profile

Z = write.scan()
HOLES = np.where(np.arange(24).reshape(4, 6) % 5 == 2, np.nan, Z)
STEPS = (0.5e-6, 0.75e-6)


def read(tmp_path, data: bytes, name="scan.x3p", units=None):
    (tmp_path / name).write_bytes(data)
    return read_surface(tmp_path / name, units)


def same(found, z, near=0.0, steps=STEPS) -> None:
    assert isinstance(found, Areal) and found.z.shape == z.shape
    assert found.z == pytest.approx(z, abs=near, rel=0, nan_ok=True)
    assert found.x == pytest.approx(np.arange(z.shape[1]) * steps[0], rel=1e-15, abs=1e-22)
    assert found.y == pytest.approx(np.arange(z.shape[0]) * steps[1], rel=1e-15, abs=1e-22)
    assert not found.z.flags.writeable


@pytest.mark.parametrize(
    "kind, increment, near",
    [("D", 1.0, 0), ("F", 1.0, 1e-12), ("I", 2e-10, 1.01e-10), ("L", 1e-14, 0.51e-14)],
)
@pytest.mark.parametrize("z", [Z, HOLES])
def test_exact_x3p_of_every_data_type(tmp_path, kind, increment, near, z):
    """Sixteen bits are signed: half of these heights are below zero. Missing: NaN, or what valid.bin leaves out."""
    same(read(tmp_path, write.x3p_of(z, kind, increment)), z, near)


@pytest.mark.parametrize("kind, near", [("D", 0), ("F", 1e-12)])
@pytest.mark.parametrize("sign", [-1, 1])
def test_exact_x3p_whose_missing_heights_are_infinite(tmp_path, kind, near, sign):
    data = write.x3p_of(np.where(np.isnan(HOLES), sign * np.inf, HOLES), kind)
    same(read(tmp_path, data), HOLES, near)


def test_exact_x3p_with_an_offset_of_its_axes(tmp_path):
    data = write.x3p_of(Z, "I", 2e-10, 3e-6)
    same(read(tmp_path, data), Z, 1.01e-10)


@pytest.mark.parametrize(
    "more", [{"prefix": ""}, {"revision": "ISO5436 – 2000"}, {"feature": "SUR"}]
)
def test_exact_x3p_of_other_writers(tmp_path, more):
    same(read(tmp_path, write.x3p_of(Z, **more)), Z)


def test_exact_x3p_in_a_folder_and_in_gzip(tmp_path):
    raw = Z.tobytes()
    xml = write.main_xml(
        write.axis("CX", increment=STEPS[0])
        + write.axis("CY", increment=STEPS[1])
        + write.axis("CZ", "A"),
        write.matrix(6, 4) + write.link(raw),
    )
    data = write.x3p(xml, raw, folder="sample/")
    same(read(tmp_path, data), Z)
    same(read(tmp_path, gzip.compress(data), "scan.x3p.gz"), Z)


@pytest.mark.parametrize("z", [Z, HOLES])
def test_exact_x3p_with_heights_in_the_xml(tmp_path, z):
    datums = "".join(
        "<Datum/>" if np.isnan(v) else f"<Datum>{float(v)!r}</Datum>" for v in z.ravel()
    )
    axes = (
        write.axis("CX", increment=STEPS[0])
        + write.axis("CY", increment=STEPS[1])
        + write.axis("CZ", "A")
    )
    xml = write.main_xml(axes, write.matrix(6, 4) + f"<DataList>{datums}</DataList>")
    same(read(tmp_path, write.x3p(xml)), z)


def test_exact_x3p_with_absolute_places(tmp_path):
    """x and y stored with each point, as a matrix and as a list of points in any order."""
    points = np.array([(x * STEPS[0], y * STEPS[1], Z[y, x]) for y in range(4) for x in range(6)])
    axes = "".join(write.axis(name, "A") for name in ("CX", "CY", "CZ"))
    for rows, record in (
        (points, write.matrix(6, 4)),
        (np.random.default_rng(0).permutation(points), "<ListDimension>24</ListDimension>"),
    ):
        raw = rows.tobytes()
        found = read(
            tmp_path, write.x3p(write.main_xml(axes, record + write.link(raw), "PCL"), raw)
        )
        same(found, Z)
        listed = "".join(f"<Datum>{a!r};{b!r};{c!r}</Datum>" for a, b, c in rows.tolist())
        same(
            read(
                tmp_path, write.x3p(write.main_xml(axes, record + f"<DataList>{listed}</DataList>"))
            ),
            Z,
        )


def test_exact_x3p_of_a_profile(tmp_path):
    z = Z.ravel()[None]
    xml = write.main_xml(
        write.axis("CX", increment=STEPS[0]) + write.axis("CZ", "A"),
        write.matrix(24, 1) + write.link(z.tobytes()),
        "PRF",
    )
    found = read(tmp_path, write.x3p(xml, z.tobytes()))
    assert isinstance(found, Profile) and found.x == pytest.approx(
        np.arange(24) * STEPS[0], abs=1e-20
    )
    assert np.array_equal(found.z, z[0])


def test_always_a_changed_description_is_told(tmp_path):
    data = write.x3p_of(Z)
    raw = Z.tobytes()
    xml = write.main_xml(
        write.axis("CX", increment=STEPS[0])
        + write.axis("CY", increment=STEPS[1])
        + write.axis("CZ", "A"),
        write.matrix(6, 4) + write.link(raw),
    )
    assert read(tmp_path, data).notes == ()
    found = read(tmp_path, write.x3p(xml, raw, checksum="0" * 32))
    assert found.notes == (
        f"{tmp_path / 'scan.x3p'}: main.xml does not match its checksum in md5checksum.hex: "
        "main.xml was changed after it was written",
    )


X3P_FAULTS = {
    "wrong checksum": (lambda: write.x3p(write.main_xml(write.axis("CX", increment=1e-6) + write.axis(
        "CY", increment=1e-6) + write.axis("CZ", "A"), write.matrix(6, 4) + write.link(Z.tobytes())),
        HOLES.tobytes()), "the checksum of bindata/data.bin is wrong: the heights were changed"),
    "two layers": (lambda: write.x3p(write.main_xml(write.axis("CX") + write.axis("CY") + write.axis("CZ", "A"),
                                                    write.matrix(6, 2, 2) + write.link(Z.tobytes())), Z.tobytes()),
                   "SizeZ is 2; a surface must have one layer"),
    "too few bytes": (lambda: write.x3p(write.main_xml(write.axis("CX") + write.axis("CY") + write.axis("CZ", "A"),
                                                       write.matrix(7, 4) + write.link(Z.tobytes())), Z.tobytes()),
                      "192 bytes of heights, but 28 heights of type D are needed"),
    "sixteen bits called 64": (lambda: write.x3p(write.main_xml(
        write.axis("CX") + write.axis("CY") + write.axis("CZ", "A", "D"),
        write.matrix(6, 4) + write.link(bytes(48))), bytes(48)), "48 bytes of heights, but 24 heights of type D are "
                                                                 "needed"),
    "an unknown type": (lambda: write.x3p(write.main_xml(write.axis("CX") + write.axis("CY") + write.axis(
        "CZ", "A", "Q"), write.matrix(6, 4))), "DataType of CZ is 'Q'; one of I, L, F, D is needed"),
    "sizes of a bomb": (lambda: write.x3p(write.main_xml(write.axis("CX") + write.axis("CY") + write.axis("CZ", "A"),
                                                         write.matrix(2 * 10**9, 1))),
                        r"SizeX is '2000000000'; a whole number from 1 to 5e\+07 is needed"),
    "heights that climb": (lambda: write.x3p(write.main_xml(write.axis("CX") + write.axis("CY") + write.axis("CZ", "I"),
                                                            write.matrix(6, 4) + "<DataList/>")),
                           r"the heights \(CZ\) are incremental; export the surface anew"),
    "no axes": (lambda: write.x3p(write.main_xml("", write.matrix(6, 4))), "main.xml lacks Record1/Axes/CX"),
    "no heights": (lambda: write.x3p(write.main_xml(write.axis("CX") + write.axis("CY") + write.axis("CZ", "A"),
                                                    write.matrix(6, 4) + write.link(b"", name="other.bin"))),
                   "no other.bin inside it"),
    "broken xml": (lambda: write.x3p(b"<a><b></a>"), "main.xml is damaged"),
    "a number that is none": (lambda: write.x3p(write.main_xml(write.axis("CX", increment="1_0") + write.axis("CY")
                                                               + write.axis("CZ", "A"), write.matrix(6, 4))),
                              "Increment of CX is '1_0'; a number is needed"),
}  # fmt: skip


@pytest.mark.parametrize("made, said", X3P_FAULTS.values(), ids=X3P_FAULTS)
def test_refuses_a_faulty_x3p_by_name(tmp_path, made, said):
    with pytest.raises(PatchfemError, match=said):
        read(tmp_path, made())


@pytest.mark.parametrize("data", [write.sdf_binary(Z), write.sdf_ascii(Z)], ids=["binary", "text"])
@pytest.mark.skipif(
    find_spec("SurfaceTopography") is None, reason="the extra `profiles` is not installed"
)
def test_exact_sdf_is_read_by_the_extra_profiles(tmp_path, data):
    assert read(tmp_path, data, "scan.sdf").z == pytest.approx(Z, rel=1e-9)


def test_always_steep_heights_in_a_file_that_says_metres_are_told(tmp_path):
    """The samples of the standard hold heights of a metre."""
    found = read(tmp_path, write.x3p_of(Z * 1e6), "a.x3p")
    assert found.z == pytest.approx(Z * 1e6, rel=1e-14)
    assert found.notes[0].startswith(f"{tmp_path / 'a.x3p'}: heights span ")
    assert found.notes[0].endswith(
        "over a length of 2.5 um: in the file, heights and length are in metres"
    )


TRACE = np.column_stack([np.arange(24) * 0.5, Z.ravel() * 1e6])
POINTS = np.array([(x * 0.5, y * 0.75, Z[y, x] * 1e6) for y in range(4) for x in range(6)])


@pytest.mark.parametrize(
    "table", [TRACE, TRACE.T, TRACE.astype("f4"), TRACE.astype(">f8"), np.asfortranarray(TRACE)]
)
def test_exact_npy_columns_are_a_trace(tmp_path, table):
    found = read(tmp_path, write.npy(table), "scan.npy", ("um", "um"))
    assert isinstance(found, Profile) and found.x == pytest.approx(TRACE[:, 0] * 1e-6)
    assert found.z == pytest.approx(Z.ravel(), rel=1e-6 if table.dtype == "f4" else 1e-14)


@pytest.mark.parametrize(
    "data, name",
    [
        (lambda: write.npy(POINTS), "scan.npy"),
        (lambda: write.npy(POINTS[::-1]), "scan.npy"),
        (lambda: write.mat(points=POINTS, note=np.arange(9.0)[None]), "scan.mat"),
        (lambda: write.mat(False, points=POINTS, size=24.0), "scan.mat"),
        (lambda: write.mat(x=np.arange(6) * 0.5, y=np.arange(4) * 0.75, z=Z * 1e6), "scan.mat"),
        (lambda: write.mat(x=POINTS[:, 0], y=POINTS[:, 1], gap=POINTS[:, 2]), "scan.mat"),
        (
            lambda: write.mat(
                **dict(zip("XYZ", (POINTS[:, k].reshape(4, 6) for k in range(3)))), text="scan"
            ),
            "scan.mat",
        ),
    ],
)
def test_exact_arrays_of_a_raster_are_a_scan(tmp_path, data, name):
    same(read(tmp_path, data(), name, ("um", "um")), Z, 1e-20)


def test_exact_text_of_three_columns_is_a_scan(tmp_path):
    rows = [f"{x:.2f},{y:.2f},{float(z)!r}" for x, y, z in POINTS]
    for header, units in (
        ("x [um],y [um],z [um]\n", None),
        ("# x_um,y_um,z_um\n", None),
        ("", ("um", "um")),
        ("x,y,z\n", ("um", "um")),
    ):
        same(read(tmp_path, (header + "\n".join(rows)).encode(), "scan.txt", units), Z, 1e-20)
    turned = "y (um);z (um);x (um)\n" + "\n".join(
        f"{y:.2f};{float(z)!r};{x:.2f}".replace(".", ",") for x, y, z in POINTS
    )
    same(read(tmp_path, turned.encode(), "scan.txt"), Z, 1e-20)
    lost = "x [um],y [um],z [um]\n" + "\n".join(
        row for k, row in enumerate(rows) if np.isfinite(HOLES.ravel()[k])
    )
    same(read(tmp_path, lost.encode(), "scan.txt"), HOLES, 1e-20)


@pytest.mark.parametrize(
    "content, said",
    [
        (
            "x [um],y [um],z [um]\n0,0,1\n1,1,1\n2,3,1\n3,2,1\n4,5,1\n9,8,1\n7,7,1\n",
            "7 different x and 7 different y do",
        ),
        (
            "x [um],y [um],z [um]\n0,0,1\n1,0,1\n0,1,1\n1,1,1\n1,0,2\n",
            ":6: a second height at x = 1 um, y = 0 um",
        ),
        ("x [um],y [um],z [um]\n0,0,1\n1,0,1\n0,1\n", ":4: '0,1': three numbers are needed"),
        (
            "x [um],y [um],w [um]\n0,0,1\n",
            "column 'w' is not known; the columns x, y and z are needed",
        ),
        (
            "x [um],y [um],z [mm]\n0,0,1\n1,0,1\n0,1,1\n1,1,9\n",
            "heights span 8 mm over a length of 1 um; is the unit",
        ),
    ],
)
def test_refuses_points_that_are_no_scan(tmp_path, content, said):
    with pytest.raises(PatchfemError, match=said):
        read(tmp_path, content.encode(), "scan.txt")


def test_refuses_units_that_are_absent_or_unknown(tmp_path):
    for data, name in ((write.npy(TRACE), "a.npy"), (write.mat(points=POINTS), "a.mat")):
        with pytest.raises(
            PatchfemError, match=r'names no units.*units=\("mm", "um"\)\), or write it as text'
        ):
            read(tmp_path, data, name)
        with pytest.raises(PatchfemError, match="unknown unit 'furlong'; use one of m, km"):
            read(tmp_path, data, name, ("um", "furlong"))
    with pytest.raises(PatchfemError, match="unknown unit 'furlong'; use one of m, km"):
        read(tmp_path, b"x,z\n0,1\n5,2\n", "a.csv", ("um", "furlong"))
    with pytest.raises(
        PatchfemError, match=r'give two units, of x and of z, such as \("mm", "um"\), not'
    ):
        read(tmp_path, b"x [um],z [um]\n0,1\n5,2\n", "a.csv", "um")


@pytest.mark.parametrize(
    "data, name, said",
    [
        (
            lambda: write.npy(np.zeros((4, 6))),
            "a.npy",
            r"an array of shape \(4, 6\); columns x, z or x, y, z are needed",
        ),
        (lambda: write.npy(TRACE.astype(complex)), "a.npy", "contains '<c16'; save plain numbers"),
        (
            lambda: write.npy(TRACE)[:-8],
            "a.npy",
            "376 bytes of data are not the 48 numbers of type float64",
        ),
        (
            lambda: write.npy(TRACE).replace(b"(24, 2)", b"(24,-2)"),
            "a.npy",
            "header of the .npy file is damaged",
        ),
        (
            lambda: write.mat(a=TRACE, b=TRACE),
            "a.mat",
            r"holds a \(24, 2\), b \(24, 2\); variables x, z or x, y",
        ),
        (
            lambda: write.mat(x=np.arange(6.0), y=np.arange(3.0), z=Z),
            "a.mat",
            r"of shapes .* do not fit",
        ),
        (
            lambda: b"MATLAB 7.3 MAT-file, HDF5" + bytes(600),
            "a.mat",
            "version 7.3 is damaged .*; save it anew",
        ),
        (lambda: write.mat(points=POINTS)[:-9], "a.mat", "cut off or damaged; save it anew"),
    ],
)
def test_refuses_arrays_that_are_no_surface(tmp_path, data, name, said):
    with pytest.raises(PatchfemError, match=said):
        read(tmp_path, data(), name, ("um", "um"))


def test_exact_a_dektak_export(tmp_path):
    """The step is 50 um over 320 points, 0.15625 um, where the file prints 0.2, 0.3, 0.5."""
    z = np.random.default_rng(1).normal(size=320)
    found = read(tmp_path, write.dektak(z), "scan.csv")
    assert found.x == pytest.approx(np.arange(320) * 0.15625e-6, rel=1e-14)
    assert found.z == pytest.approx(np.round(z, 5) * 1e-6, rel=1e-14)
    assert np.array_equal(read(tmp_path, write.dektak(z, results=False), "scan.csv").z, found.z)
    again = read(tmp_path, write.dektak(z).decode("latin-1").encode("utf-16"), "scan.csv")
    assert np.array_equal(again.z, found.z)


def test_always_a_dektak_export_that_was_cut_keeps_its_printed_places(tmp_path):
    z = np.random.default_rng(1).normal(size=320)
    found = read(tmp_path, b"\n".join(write.dektak(z).split(b"\n")[:200]), "scan.csv")
    assert "the length of 50 um in the header does not fit" in found.notes[0]
    assert found.x == pytest.approx(np.arange(found.x.size) * 0.15625e-6, abs=0.06e-6)
    with pytest.raises(PatchfemError, match="without the columns `Lateral um,Raw Micrometer`"):
        read(tmp_path, write.dektak(z).replace(b"Lateral", b"Time"), "scan.csv")
    with pytest.raises(
        PatchfemError, match=r":13: unknown unit 'Volt'; export the scan in Micrometer or Angstrom"
    ):
        read(tmp_path, write.dektak(z).replace(b"Raw Micrometer", b"Raw Volt"), "scan.csv")


def test_exact_one_trace_of_any_format_and_no_scan(tmp_path):
    (tmp_path / "a.x3p").write_bytes(write.x3p_of(Z))
    with pytest.raises(
        PatchfemError, match="scan of 4 x 6 heights, but a single trace is needed; write one row of"
    ):
        read_profile(tmp_path / "a.x3p")
    (tmp_path / "a.zip").write_bytes(write.zipped({"one/a.csv": b"x [um],z [nm]\n0,1\n1,2\n2,4\n"}))
    assert read_profile(tmp_path / "a.zip").z == pytest.approx([1e-9, 2e-9, 4e-9], rel=1e-15)


@pytest.mark.skipif(
    "PATCHFEM_TOPOGRAPHY_PYTHON" not in os.environ,
    reason="PATCHFEM_TOPOGRAPHY_PYTHON names no interpreter that has SurfaceTopography",
)
def test_exact_other_instruments_through_surface_topography(tmp_path, use_interpreter):
    """A NetCDF file, in the process of another interpreter."""
    from scipy.io import netcdf_file

    use_interpreter(os.environ["PATCHFEM_TOPOGRAPHY_PYTHON"])
    with netcdf_file(tmp_path / "scan.nc", "w") as file:
        for name, values, size in (("x", np.arange(6) * 0.5, 3.0), ("y", np.arange(4) * 0.75, 3.0)):
            file.createDimension(name, values.size)
            axis = file.createVariable(name, "f8", (name,))
            axis[:] = values
            axis.length = size
            axis.unit = "um"
        heights = file.createVariable("heights", "f8", ("x", "y"))
        heights[:] = Z.T * 1e6
        heights.unit = "um"
    found = read_surface(tmp_path / "scan.nc")
    same(found, Z, 1e-18)
    assert "read as NC by SurfaceTopography 1." in found.notes[0]
    assert (
        read_surface(tmp_path / "scan.nc", ("mm", "mm"))
        .notes[1]
        .endswith("the units that you gave are ignored")
    )
    (tmp_path / "scan.opdx").write_bytes(b"\x00\x01junk" * 50)
    with pytest.raises(PatchfemError, match="SurfaceTopography cannot read this file"):
        read_surface(tmp_path / "scan.opdx")


def test_refuses_instruments_without_the_library_with_the_remedy(tmp_path, use_interpreter):
    """An interpreter that has no packages at all stands for one without SurfaceTopography."""
    (tmp_path / "python").write_text("#!/bin/sh\nexit 3\n")
    (tmp_path / "python").chmod(0o755)
    use_interpreter(tmp_path / "python")
    with pytest.raises(
        Missing, match=r"pip install 'patchfem\[profiles\]', or export the surface as text"
    ):
        read(tmp_path, b"\x00\x01\x02" * 99, "scan.opdx")


@pytest.mark.parametrize(
    "answer, said",
    [
        (
            {"error": "CorruptFile: bad"},
            r"cannot read this file \(CorruptFile: bad\); export the surface",
        ),
        ({}, "found no heights in this file; export the surface as text or X3P"),
        (
            {"about": "{}", "z": []},
            "found no heights in this file; export the surface as text or X3P",
        ),
        (None, "failed to read this file; export"),
    ],
)
def test_refuses_what_the_other_process_could_not_read(tmp_path, use_interpreter, answer, said):
    (tmp_path / "answer").write_bytes(b"")
    if answer is not None:
        with open(tmp_path / "answer", "wb") as file:
            np.savez(file, **answer)
    (tmp_path / "python").write_text(f"#!/bin/sh\ncat {tmp_path}/answer\n")
    (tmp_path / "python").chmod(0o755)
    use_interpreter(tmp_path / "python")
    with pytest.raises(PatchfemError, match=said):
        read(tmp_path, b"\x00\x01\x02" * 99, "scan.opdx")


STAND_IN = """
import os, time
class Reader:
    nb_grid_pts, physical_sizes, unit = (3, 2), (3.0, 2.0), "um"
    default_channel = property(lambda self: self)
    def topography(self):
        return self
    def to_unit(self, unit):
        return self
    def heights(self):
        return [[7e-9, 1.0], [0.0, 1.0], [0.0, 2.0]]
def open_topography(path):
    name = os.path.basename(path)
    while name.startswith("works"):
        pass
    if name.startswith("sleeps"):
        time.sleep(60)
    if name.startswith("ends"):
        os._exit(9)
    if name.startswith("fails"):
        raise ValueError("bad")
    if name.startswith("fills"):
        bytearray(10**11)
    return Reader()
"""


@pytest.mark.slow
def test_always_a_fault_of_the_library_ends_with_its_process(tmp_path, monkeypatch):
    """A stand-in for SurfaceTopography: what works on and on, sleeps, ends, fails or takes all memory is refused by
    name, and the next file is read."""
    (tmp_path / "SurfaceTopography").mkdir()
    (tmp_path / "SurfaceTopography" / "__init__.py").write_text("__version__ = '1.2'")
    (tmp_path / "SurfaceTopography" / "IO.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    data = b"\x00\x01\x02" * 99
    for name, said in (
        ("fails.opdx", r"cannot read this file \(ValueError: bad\)"),
        ("fills.opdx", r"cannot read this file \(MemoryError"),
        ("ends.opdx", "failed to read this file; export the surface as text or X3P"),
        ("works.opdx", r"did not finish reading this file in 60 s of CPU time; export"),
    ):
        with pytest.raises(PatchfemError, match=said):
            read(tmp_path, data, name)
    found = read(tmp_path, data, "good.opdx")
    assert (
        found.z == pytest.approx(np.array([[7e-9, 0.0, 0.0], [1.0, 1.0, 2.0]]))
        and found.x[1] == 1.0
    )
    assert "read as  by SurfaceTopography 1.2" in found.notes[0]
    monkeypatch.setattr(instruments, "MAX_SECONDS", 0.5)
    with pytest.raises(
        PatchfemError,
        match=r"did not finish reading this file in 0\.5 s; export the surface as text",
    ):
        read(tmp_path, data, "sleeps.opdx")


def test_exact_mat_files_of_scipy_give_what_scipy_wrote(tmp_path):
    """Every numeric class, small and large, beside text, cells and complex numbers, which are passed over."""
    for kind in ("f8", "f4", "i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"):
        table = np.column_stack([np.arange(20), np.arange(20) % 3]).astype(kind)
        savemat(
            tmp_path / "a.mat",
            {
                "table": table,
                "text": "abc",
                "cells": np.array([1, "a"], object),
                "waves": np.ones((9, 2)) * 1j,
                "pair": {"x": 1.0},
            },
            do_compression=kind != "f8",
        )
        found = read_surface(tmp_path / "a.mat", ("um", "um"))
        assert found.x == pytest.approx(np.arange(20) * 1e-6) and found.z == pytest.approx(
            np.arange(20) % 3 * 1e-6
        )
