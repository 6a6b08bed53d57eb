"""MATLAB files of version 7.3, and structures of every version: the arrays that MATLAB and SciPy wrote, by field."""

import io
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy
from scipy.io import savemat

from patchfem.core import PatchfemError
from patchfem.inputs import parse_requests, read_records, read_variables
from patchfem.inputs.matlab5 import MAX_UNPACK_RATIO
from patchfem.structure import arrays

SHIPPED = Path(scipy.__file__).parent / "io/matlab/tests/data"  # written by MATLAB itself
TIME = np.linspace(0, 0.1, 51)
FORCE = np.random.default_rng(2).normal(size=51)
RUN = {
    "load": {"F": FORCE[:, None], "all": np.column_stack([TIME, FORCE, -FORCE])},
    "t": TIME[None],
    "by": "bench 3",
}


def put(group, name: str, value) -> None:
    """A value as MATLAB 7.3 keeps it."""
    if isinstance(value, dict):
        inner = group.create_group(name)
        inner.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, one in value.items():
            put(inner, key, one)
        return
    kind, value = (
        ("char", np.array([list(map(ord, value))], "u2"))
        if isinstance(value, str)
        else ("double", np.asarray(value))
    )
    one = group.create_dataset(name, data=value.T)
    one.attrs["MATLAB_class"] = np.bytes_(kind)


def written(values: dict, more=None) -> bytes:
    """A file of version 7.3: HDF5 behind a block of 512 bytes with MATLAB's line."""
    out = io.BytesIO()
    with h5py.File(out, "w", userblock_size=512) as file:
        for name, value in values.items():
            put(file, name, value)
        if more is not None:
            more(file)
    return b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM" + out.getvalue()[128:]


def by_scipy(values: dict, packed: bool = True) -> bytes:
    out = io.BytesIO()
    savemat(out, values, do_compression=packed)
    return out.getvalue()


@pytest.mark.skipif(not SHIPPED.is_dir(), reason="SciPy was installed without its tests")
def test_exact_files_of_matlab_itself():
    read = lambda name: read_variables(name, (SHIPPED / name).read_bytes())  # noqa: E731
    assert np.array_equal(
        read("testhdf5_7.4_GLNX86.mat")["testdouble"].values(), np.arange(9)[None] * np.pi / 4
    )
    for version in ("6.1_SOL2", "6.5.1_GLNX86", "7.1_GLNX86", "7.4_GLNX86"):
        found = read(f"teststruct_{version}.mat")
        assert np.allclose(
            found["teststruct.doublefield"].values(), [[2**0.5, np.e, np.pi]], rtol=1e-15
        )
        assert found["teststruct.stringfield"].values().tolist() == ["Rats live on no evil star."]
        assert list(read(f"teststructnest_{version}.mat")) == [
            "teststructnest.one",
            "teststructnest.two.three",
        ]
        assert read(f"teststructarr_{version}.mat") == {}  # of several elements


@pytest.mark.parametrize(
    "data",
    [
        written({"run": RUN, "g": 9.81}),
        by_scipy({"run": RUN, "g": 9.81}),
        by_scipy({"run": RUN, "g": 9.81}, False),
    ],
    ids=["7.3", "7", "6"],
)
def test_exact_fields_of_structures_are_named_and_mapped(data, tmp_path):
    found = read_variables("a.mat", data)
    assert {name: (one.kind, one.shape) for name, one in found.items()} == {
        "run.load.F": ("number", (51, 1)),
        "run.load.all": ("number", (51, 3)),
        "run.t": ("number", (1, 51)),
        "run.by": ("text", (1, 7)),
        "g": ("number", (1, 1)),
    }
    assert np.array_equal(found["run.load.all"].values(), RUN["load"]["all"]) and found[
        "g"
    ].values() == [[9.81]]
    assert found["run.by"].values().tolist() == ["bench 3"]
    (tmp_path / "a.mat").write_bytes(data)
    for force in ("run.load.F", "run.load.all(:,2)"):
        records = read_records(
            tmp_path / "a.mat", parse_requests(["time=run.t [s]", f"force={force} [kN]"])
        ).values
        assert np.array_equal(records["time"], TIME) and np.array_equal(
            records["force"], 1e3 * FORCE
        )
    with pytest.raises(
        PatchfemError, match=r"no variable 'run.F'; the file contains .*run\.load\.F 51x1"
    ):
        read_records(tmp_path / "a.mat", parse_requests(["time=run.t [s]", "force=run.F [N]"]))


def test_exact_a_rig_of_version_73_is_that_of_version_7(tmp_path):
    """Cells of texts and a sparse matrix among its arrays."""
    rig = {"M": np.diag([1.0, 2.0]), "C": np.zeros((2, 2)), "slide": [[1.0, 0.0]]}
    stiff = np.array([[3e6, -1e6], [-1e6, 1e6]])
    names = ("tip", "base é")

    def more(file):
        group = file.create_group("K")
        group.attrs.update(MATLAB_class=np.bytes_("double"), MATLAB_sparse=np.uint64(2))
        for name, values in (
            ("data", stiff.T.ravel()),
            ("ir", np.array([0, 1, 0, 1], "u8")),
            ("jc", np.array([0, 2, 4], "u8")),
        ):
            group[name] = values
        put(file, "#refs#/a", names[0])
        put(file, "#refs#/b", names[1])
        cells = file.create_dataset("names", (2, 1), h5py.ref_dtype)
        cells[0, 0] = file["#refs#/a"].ref
        cells[1, 0] = file["#refs#/b"].ref
        cells.attrs["MATLAB_class"] = np.bytes_("cell")

    (tmp_path / "new.mat").write_bytes(written(rig, more))
    savemat(tmp_path / "old.mat", rig | {"K": stiff, "names": np.array(names, dtype=object)})
    new, old = (
        arrays.build_basis(arrays.read_arrays(tmp_path / f"{name}.mat")) for name in ("new", "old")
    )
    assert new.names == old.names
    assert np.array_equal(new.omega, old.omega)
    assert np.array_equal(new.slide, old.slide)


def test_refuses_what_unpacks_too_large_and_follows_no_links(tmp_path):
    (tmp_path / "secret.h5").write_bytes(written({"x": 1.0}))

    def more(file):
        file["out"] = h5py.ExternalLink(str(tmp_path / "secret.h5"), "/x")
        file["ring"] = file["/"]
        file["void"] = h5py.Empty("f8")
        file.create_dataset("none", data=np.array([0, 3], "u8")).attrs.update(
            MATLAB_class=np.bytes_("double"), MATLAB_empty=np.uint8(1)
        )
        file.create_dataset("waves", data=np.ones(3) * 1j).attrs["MATLAB_class"] = np.bytes_(
            "double"
        )

    found = read_variables("a.mat", written({"x": 2.0}, more))
    assert {name: one.shape for name, one in found.items()} == {"x": (1, 1), "none": (0, 3)}
    bomb = written(
        {}, lambda file: file.create_dataset("z", compression="gzip", data=np.zeros((1500, 1500)))
    )
    with pytest.raises(
        PatchfemError,
        match=f"a variable of shape .* or more than {MAX_UNPACK_RATIO} times its size",
    ):
        read_variables("a.mat", bomb)
    for data in (written({"x": 1.0})[:900], b"MATLAB 7.3 MAT-file" + bytes(200)):
        with pytest.raises(
            PatchfemError, match=r"^a\.mat: the MATLAB file of version 7\.3 is damaged"
        ):
            read_variables("a.mat", data)
