"""MATLAB files: arrays and fields of structures, from files that MATLAB, SciPy or h5py wrote."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy
from matlab_files import add_matlab_value, matlab5_bytes, matlab73_bytes
from scipy import sparse
from scipy.io import savemat

from patchfem.core import PatchfemError
from patchfem.inputs import parse_requests, read_real_arrays, read_records, read_variables
from patchfem.structure import arrays

SCIPY_TEST_FILES = Path(scipy.__file__).parent / "io/matlab/tests/data"  # written by MATLAB itself
TIME = np.linspace(0, 0.1, 51)
FORCE = np.random.default_rng(2).normal(size=51)
RUN = {
    "load": {"F": FORCE[:, None], "all": np.column_stack([TIME, FORCE, -FORCE])},
    "t": TIME[None],
    "by": "bench 3",
}


ARRAYS = {
    "full": np.random.default_rng(1).normal(size=(4, 3)), "counts": np.arange(6, dtype="u1")[None],
    "small": np.array([[1.5, -2.5]], "f4"), "scattered": sparse.random(7, 5, 0.4, "csc", random_state=3),
    "none": np.zeros((0, 3)), "cube": np.arange(24.0).reshape(2, 3, 4), "waves": np.ones((1, 3)) * 1j,
    **{kind: np.arange(6).astype(kind)[None] for kind in ("i1", "i2", "u2", "i4", "u4", "i8", "u8")},
}  # fmt: skip


@pytest.mark.parametrize("packed", [False, True])
def test_exact_arrays(packed):
    """Arrays of numbers, of any type and form, are read with their values, and texts are left out."""
    texts = {"cells": np.array(["axial", "yaw", "é"], dtype=object), "letters": ["ab", "cde"]}
    variables = read_variables("a.mat", matlab5_bytes(ARRAYS | texts, packed))
    assert variables.keys() == ARRAYS.keys()
    for name, expected in ARRAYS.items():
        assert (
            abs(variables[name] - expected).sum() == 0 and variables[name].shape == expected.shape
        )
    assert "waves" not in read_real_arrays("a.mat", matlab5_bytes(ARRAYS, packed))


@pytest.mark.skipif(not SCIPY_TEST_FILES.is_dir(), reason="SciPy was installed without its tests")
def test_exact_files_written_by_matlab():
    """Arrays and structures of files that MATLAB wrote are read exactly."""
    read = lambda name: read_variables(name, (SCIPY_TEST_FILES / name).read_bytes())  # noqa: E731
    assert np.array_equal(
        read("testhdf5_7.4_GLNX86.mat")["testdouble"], np.arange(9)[None] * np.pi / 4
    )
    for version in ("6.1_SOL2", "6.5.1_GLNX86", "7.1_GLNX86", "7.4_GLNX86"):
        variables = read(f"teststruct_{version}.mat")
        assert np.allclose(variables["teststruct.doublefield"], [[2**0.5, np.e, np.pi]], rtol=1e-15)
        assert list(read(f"teststructnest_{version}.mat")) == ["teststructnest.one"]
        assert read(f"teststructarr_{version}.mat") == {}  # arrays of structures are not read


@pytest.mark.parametrize(
    "data",
    [
        matlab73_bytes({"run": RUN, "g": 9.81}),
        matlab5_bytes({"run": RUN, "g": 9.81}),
        matlab5_bytes({"run": RUN, "g": 9.81}, False),
    ],
    ids=["7.3", "7", "6"],
)
def test_exact_structure_fields_are_named_and_mapped(data, tmp_path):
    """Fields of structures have dotted names, which can be assigned to quantities."""
    variables = read_variables("a.mat", data)
    assert {name: variable.shape for name, variable in variables.items()} == {
        "run.load.F": (51, 1),
        "run.load.all": (51, 3),
        "run.t": (1, 51),
        "g": (1, 1),
    }
    assert np.array_equal(variables["run.load.all"], RUN["load"]["all"]) and variables["g"] == [
        [9.81]
    ]
    (tmp_path / "a.mat").write_bytes(data)
    for force in ("run.load.F", "run.load.all(:,2)"):
        records = read_records(
            tmp_path / "a.mat", parse_requests(["time=run.t [s]", f"force={force} [kN]"])
        ).values
        assert np.array_equal(records["time"], TIME) and np.array_equal(
            records["force"], 1e3 * FORCE
        )
    listed = r"no channel 'run.F'; the file has [^:]*'run.load.F', \d 'run.load.all\(:,1\)', "
    with pytest.raises(PatchfemError, match=listed):
        read_records(tmp_path / "a.mat", parse_requests(["time=run.t [s]", "force=run.F [N]"]))


def test_exact_matlab_73_structure_equals_version_7(tmp_path):
    """A structure from a file of version 7.3 with a sparse matrix, beside texts, equals that from version 7."""
    matrices_of_rig = {"M": np.diag([1.0, 2.0]), "C": np.zeros((2, 2)), "slide": [[1.0, 0.0]]}
    stiffness = np.array([[3e6, -1e6], [-1e6, 1e6]])

    def add_items(file):
        group = file.create_group("K")
        group.attrs.update(MATLAB_class=np.bytes_("double"), MATLAB_sparse=np.uint64(2))
        for name, values in (
            ("data", stiffness.T.ravel()),
            ("ir", np.array([0, 1, 0, 1], "u8")),
            ("jc", np.array([0, 2, 4], "u8")),
        ):
            group[name] = values
        add_matlab_value(file, "#refs#/a", "tip")
        cells = file.create_dataset("names", (1, 1), h5py.ref_dtype)
        cells[0, 0] = file["#refs#/a"].ref
        cells.attrs["MATLAB_class"] = np.bytes_("cell")

    (tmp_path / "new.mat").write_bytes(matlab73_bytes(matrices_of_rig, add_items))
    savemat(
        tmp_path / "old.mat",
        matrices_of_rig | {"K": stiffness, "names": np.array(["tip"], dtype=object)},
    )
    basis_73, basis_7 = (
        arrays.build_basis(arrays.read_arrays(tmp_path / f"{name}.mat")) for name in ("new", "old")
    )
    assert np.array_equal(basis_73.omega, basis_7.omega)
    assert np.array_equal(basis_73.slide, basis_7.slide)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"MATLAB 5.0 MAT-file" + bytes(200),
        b"MATLAB 7.3 MAT-file" + bytes(200),
        matlab5_bytes({"x": 1.0}, False)[:-4],
        matlab73_bytes({"x": 1.0})[:900],
    ],
)
def test_refuses_invalid_matlab_file(data):
    """Files that are empty, cut off or not MATLAB files are refused."""
    with pytest.raises(PatchfemError, match=r"^a\.mat: no readable MATLAB file"):
        read_variables("a.mat", data)
