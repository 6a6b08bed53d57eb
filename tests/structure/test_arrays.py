"""Rigs from .npz and .mat files: the same basis as from the arrays, every lack named."""

import io
import zipfile

import numpy as np
import pytest
from numpy.lib import format as npy
from scipy.io import savemat
from scipy.sparse import csc_matrix

from patchfem.core import PatchfemError
from patchfem.structure import arrays, masses, matrices

M, K, C = (
    np.diag([2.0, 1.0]),
    np.array([[4.0, -1.0], [-1.0, 1.0]]),
    np.array([[0.4, -0.3], [-0.3, 0.3]]),
)
FULL = {"M": M, "K": K, "C": C, "slide": np.array([0.0, 1.0])}
MODAL = {
    "frequency": np.array([143.0, 990.0]),
    "damping": np.array([0.003, 0.01]),
    "slide": np.array([1.0, 0.2]),
    "base": np.array([0.9, 0.1]),
    "moving_mass": 0.884,
}


@pytest.mark.parametrize("ending", ["npz", "mat"])
def test_exact_file_is_its_arrays(tmp_path, ending):
    path = tmp_path / f"rig.{ending}"
    data = FULL | {"normal": np.array([0.1, 0.0]), "unused": np.ones(3)}
    if ending == "npz":
        np.savez(path, **data)
    else:
        savemat(path, data | {"K": csc_matrix(K)})
    found = arrays.build_basis(arrays.read_arrays(path))
    want = matrices.build_basis(M, K, C, faces=[0, 1], normal=[0.1, 0])
    for key in ("omega", "zeta", "damping", "slide", "base", "output", "normal", "shapes"):
        np.testing.assert_array_equal(getattr(found, key), getattr(want, key))
    assert found.names == ("1", "2") and found.faces is None


def test_exact_one_coordinate_from_matlab(tmp_path):
    """MATLAB has no vectors and no numbers, only matrices."""
    names = np.array(["block"], dtype=object)
    savemat(tmp_path / "rig.mat", {"M": 2.0, "K": 8.0, "C": 0.4, "slide": 1.0, "names": names})
    found = arrays.build_basis(arrays.read_arrays(tmp_path / "rig.mat"))
    assert found.names == ("block",) and (found.omega[0], found.zeta[0]) == pytest.approx(
        (2.0, 0.05)
    )


def test_exact_interfaces_between_coordinates_are_those_of_masses():
    data = {key: FULL[key] for key in "MKC"} | {"output": np.array([1.0, 0.0])}
    found = arrays.build_basis(data, [(2, 1), (1, 0)])
    want = masses.build_basis(
        [2.0, 1.0],
        [((1, 0), 3.0), ((1, 2), 1.0)],
        [((1, 0), 0.1), ((1, 2), 0.3)],
        [(2, 1), (1, 0)],
        1,
    )
    np.testing.assert_allclose(found.interfaces, want.interfaces, rtol=1e-12)
    np.testing.assert_allclose(found.damping, want.damping, rtol=1e-12)
    np.testing.assert_allclose(found.output, want.output, rtol=1e-12)


def test_exact_force_of_a_file():
    forced = arrays.build_basis(FULL | {"force": np.array([1.0, 0.0])}, is_forced=True)
    np.testing.assert_allclose(forced.base, -forced.shapes[0], rtol=1e-14)
    np.testing.assert_allclose(
        arrays.build_basis(FULL, is_forced=True).base, -forced.shapes[1], rtol=1e-14
    )
    np.testing.assert_allclose(
        arrays.build_basis(FULL, is_forced=True, driven_mass=1).base, -forced.shapes[0], rtol=1e-14
    )


def test_exact_modal_file(tmp_path):
    np.savez(tmp_path / "rig.npz", **MODAL, pitch=np.array([0.0, 3.0]), yaw=np.zeros(2))
    found = arrays.build_basis(arrays.read_arrays(tmp_path / "rig.npz"))
    np.testing.assert_array_equal(found.omega, 2 * np.pi * MODAL["frequency"])
    for key in ("slide", "base"):
        np.testing.assert_array_equal(getattr(found, key), MODAL[key])
    assert (
        found.mass == 0.884
        and found.pitch[1] == 3.0
        and found.yaw is None
        and found.damping is None
    )
    np.testing.assert_array_equal(found.output, found.slide)
    np.testing.assert_array_equal(arrays.build_basis(MODAL, is_forced=True).base, -found.slide)
    coupled = arrays.build_basis(
        MODAL | {"damping": np.array([[1.0, 0.2], [0.2, 3.0]]), "slide": np.eye(2)}, mass=2.0
    )
    assert (
        coupled.mass == 2.0 and coupled.damping[0, 1] == 0.2 and coupled.interfaces.shape == (2, 2)
    )
    np.testing.assert_allclose(2 * coupled.zeta * coupled.omega, [1.0, 3.0])


@pytest.mark.parametrize("change, says", [
    ({"K": None}, "lacks the matrix K; the file contains M, C"), ({"M": None, "K": None}, "lacks M and K, or omega"),
    ({"slide": None}, "lacks output"), ({"slide": np.ones(3)}, "slide has shape (3,), but M has 2"),
    ({"slide": np.array(["a", "b"])}, "slide does not contain real numbers"),
    ({"base": np.ones(5)}, "base has shape (5,)"),
    ({"K": np.ones((2, 3))}, "K must be square"), ({"K": np.ones(4)}, "K must be square, not of shape (4,)"),
    ({"names": np.array(["a", "a"])}, "names must be 2 different texts"), ({"C": -C}, "C adds energy"),
])  # fmt: skip
def test_refuses_matrices_that_lack_something(change, says):
    data = {key: value for key, value in (FULL | change).items() if value is not None}
    with pytest.raises(PatchfemError) as caught:
        arrays.build_basis(data)
    assert str(caught.value).startswith("structure.file: ") and says in str(caught.value)


@pytest.mark.parametrize("change, says", [
    ({"damping": None}, "lacks damping of the modes; the file contains"), ({"base": None}, "lacks base of the"),
    ({"moving_mass": None}, "lacks moving_mass > 0"), ({"slide": np.ones(3)}, "slide has shape (3,), but there are 2"),
    ({"frequency": np.array([-1.0, 2.0])}, "frequencies must be >= 0"), ({"base": np.ones(2)}, "the sum of `base`^2"),
    ({"damping": np.array([-0.1, 0.1])}, "damping must be >= 0"), ({"output": np.array([np.nan, 0])}, "not finite"),
    ({"damping": -np.eye(2)}, "damping matrix adds energy"), ({"damping": np.full(2, 0.1j)}, "damping is complex"),
    ({"slide": np.array(["a", "b"])}, "does not contain real numbers"),
])  # fmt: skip
def test_refuses_modes_that_lack_something(change, says):
    data = {key: value for key, value in (MODAL | change).items() if value is not None}
    with pytest.raises(PatchfemError) as caught:
        arrays.build_basis(data)
    assert str(caught.value).startswith("structure.file: ") and says in str(caught.value)


def test_refuses_interfaces_that_are_not_there():
    bare = {key: FULL[key] for key in "MK"} | {"output": np.ones(2)}
    for data, pairs, pushed, says in (
        (bare, [(3, 0)], None, "there is no coordinate 3: M has 2"),
        (FULL, [(1, 0)], None, "contains `slide`, but"),
        (FULL, [], 9, "no coordinate 9"),
        (MODAL, [(1, 0)], None, "no numbered masses"),
    ):
        with pytest.raises(PatchfemError) as caught:
            arrays.build_basis(data, pairs, pushed, is_forced=pushed is not None)
        assert says in str(caught.value)


@pytest.mark.parametrize("name, content", [
    ("a.npz", b"nothing of the kind"), ("a.mat", b"MATLAB"), ("a.npz", b""), ("a.mat", b""),
])  # fmt: skip
def test_refuses_files_that_are_none(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(PatchfemError, match="cannot be read"):
        arrays.read_arrays(tmp_path / name)


def test_refuses_objects(tmp_path):
    np.savez(tmp_path / "a.npz", M=np.array([{}], dtype=object))
    with pytest.raises(PatchfemError, match="not objects"):
        arrays.read_arrays(tmp_path / "a.npz")


def test_refuses_numbers_of_many_bytes_by_the_header_alone(tmp_path):
    """|S1024 took a kilobyte for each of two thousand squared numbers before its kind was looked at; nothing stands
    behind this header, so that who reads on finds its end."""
    head = io.BytesIO()
    npy.write_array_header_1_0(
        head, {"descr": "|S1024", "fortran_order": False, "shape": (2000, 2000)}
    )
    for key, said in (
        ("M", "contains values of 1024 bytes"),
        ("names", "contains 4000000 names; 2000 is the limit"),
    ):
        with zipfile.ZipFile(tmp_path / "a.npz", "w") as file:
            file.writestr(f"{key}.npy", head.getvalue())
        with pytest.raises(PatchfemError, match=said):
            arrays.read_arrays(tmp_path / "a.npz")


def test_refuses_a_list_of_members_that_is_too_long(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as file:
        for number in range(40):
            file.writestr(f"{number}" * 30_000, b"")
    with pytest.raises(PatchfemError, match=r"the list of members takes \d+ bytes"):
        arrays.read_arrays(tmp_path / "a.npz")
