"""Initial conditions: a release starts from the static shape, and unsuitable values are refused."""

import numpy as np
import pytest

from patchfem.core import ModalBasis, PatchfemError
from patchfem.structure import starts


def make_basis(omega, output):
    """Return an undamped basis with given frequencies and output row."""
    n = len(omega)
    omega = np.array(omega, float)
    output = np.array(output, float)
    return ModalBasis(tuple("abc"[:n]), omega, np.zeros(n), np.ones(n), output, output, 2.0)


def test_exact_release_starts_from_static_shape():
    """A release starts from the static shape with the prescribed output; a rigid mode takes all of the displacement."""
    basis = make_basis([2.0, 5.0], [1.0, -0.5])
    start = starts.start_from_output_displacement(basis, 3e-3)
    assert basis.output @ start.z == pytest.approx(3e-3, rel=1e-15) and not start.v.any()
    force = basis.omega**2 * start.z
    np.testing.assert_allclose(force / force[0], basis.output / basis.output[0], rtol=1e-14)
    assert starts.start_from_output_displacement(make_basis([2.0], [0.8]), 1e-3).z[
        0
    ] == pytest.approx(1e-3 / 0.8)
    rigid = starts.start_from_output_displacement(make_basis([0.0, 5.0], [0.5, 1.0]), 1e-3)
    np.testing.assert_allclose(rigid.z, [2e-3, 0.0], rtol=1e-15)


def test_refuses_start_inconsistent_with_modes():
    """A start with the wrong number of values, or for an output that no mode moves, is refused."""
    with pytest.raises(PatchfemError, match="1 values are given for 2 modes or masses"):
        starts.start_from_values(make_basis([2.0, 5.0], [1.0, 0.0]), [1.0])
    with pytest.raises(PatchfemError, match="no mode moves the output"):
        starts.start_from_output_displacement(make_basis([2.0], [0.0]), 1.0)
