"""Structures from .npz and .mat files: the same basis as from the arrays, and messages for missing data."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.structure import arrays, masses

M, K, C = (
    np.diag([2.0, 1.0]),
    np.array([[4.0, -1.0], [-1.0, 1.0]]),
    np.array([[0.4, -0.3], [-0.3, 0.3]]),
)
FULL = {"M": M, "K": K, "C": C, "slide": np.array([0.0, 1.0])}


def test_exact_interfaces_of_file_equal_interfaces_of_masses():
    """Interfaces between coordinates of a file equal those of the same masses, springs and dampers."""
    data = {key: FULL[key] for key in "MKC"} | {"output": np.array([1.0, 0.0])}
    basis = arrays.build_basis(data, [(2, 1), (1, 0)])
    expected = masses.build_basis(
        [2.0, 1.0],
        [((1, 0), 3.0), ((1, 2), 1.0)],
        [((1, 0), 0.1), ((1, 2), 0.3)],
        [(2, 1), (1, 0)],
        1,
    )
    np.testing.assert_allclose(basis.interfaces, expected.interfaces, rtol=1e-12)
    np.testing.assert_allclose(basis.damping, expected.damping, rtol=1e-12)
    np.testing.assert_allclose(basis.output, expected.output, rtol=1e-12)


def test_exact_force_vector_defines_modal_forces():
    """The modal forces are those of the force vector, of the output, or of the driven mass."""
    forced = arrays.build_basis(FULL | {"force": np.array([1.0, 0.0])}, is_forced=True)
    np.testing.assert_allclose(forced.base, -forced.shapes[0], rtol=1e-14)
    np.testing.assert_allclose(
        arrays.build_basis(FULL, is_forced=True).base, -forced.shapes[1], rtol=1e-14
    )
    np.testing.assert_allclose(
        arrays.build_basis(FULL, is_forced=True, driven_mass=1).base, -forced.shapes[0], rtol=1e-14
    )


@pytest.mark.parametrize("change, message", [
    ({"K": None}, "lacks the matrix K; the file contains M, C"), ({"slide": None}, "lacks output"),
    ({"slide": np.ones(3)}, "slide has shape (3,), but there are 2 coordinates or modes; shape (2,) or (k, 2) is needed"),
    ({"slide": np.zeros((0, 2))}, "lacks output"),
    ({"K": np.ones((2, 3))}, "K must be square"), ({"K": np.zeros((0, 0))}, "K must be square with at least one row"),
    ({"C": -C}, "C adds energy"), ({"output": np.array([np.nan, 0])}, "output contains values that are not finite"),
    ({"slide": np.array(["a", "b"])}, "slide contains no numbers; real numbers are needed"),
    ({"slide": np.array([1e200, 1.0])}, "slide contains values outside the computable range"),
])  # fmt: skip
def test_refuses_incomplete_or_invalid_matrices(change, message):
    """Missing, misshapen or unphysical matrices of a file are refused with the name of the array."""
    data = {key: value for key, value in (FULL | change).items() if value is not None}
    with pytest.raises(PatchfemError) as caught:
        arrays.build_basis(data)
    assert message in str(caught.value)


@pytest.mark.parametrize("name, content", [
    ("a.npz", b"nothing of the kind"), ("a.mat", b"MATLAB"),
])  # fmt: skip
def test_refuses_unreadable_array_files(tmp_path, name, content):
    """A file that is empty or not in the format of its name is refused."""
    (tmp_path / name).write_bytes(content)
    with pytest.raises(PatchfemError, match=r"cannot be read|no readable MATLAB file"):
        arrays.read_arrays(tmp_path / name)
