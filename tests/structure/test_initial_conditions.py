"""Initial conditions: physical and modal values give the same motion."""

import numpy as np
import pytest

from patchfem.core import ModalBasis, PatchfemError
from patchfem.structure import masses, starts
from patchfem.structure.bonded import add_spring


def make_basis(omega, output):
    """Return an undamped basis with given frequencies and output row."""
    n = len(omega)
    omega = np.array(omega, float)
    output = np.array(output, float)
    return ModalBasis(tuple("abc"[:n]), omega, np.zeros(n), np.ones(n), output, output, 2.0)


def test_exact_masses_start_at_given_values():
    """The modal start gives the prescribed displacements and velocities of the masses."""
    basis = masses.build_basis([1.0, 3.0], [((1, 0), 4.0), ((1, 2), 1.0)], [], [(2, 0)], 1)
    start = starts.start_from_values(basis, [1e-3, -2e-3], [0.5, 0.25])
    np.testing.assert_allclose(basis.shapes @ start.z, [1e-3, -2e-3], rtol=1e-14)
    np.testing.assert_allclose(basis.shapes @ start.v, [0.5, 0.25], rtol=1e-14)
    # equation 3.2 of the report
    np.testing.assert_allclose(
        start.z, basis.shapes.T @ np.diag([1.0, 3.0]) @ [1e-3, -2e-3], rtol=1e-13
    )
    without_displacement = starts.start_from_values(basis, None, [0.5, 0.25])
    assert not without_displacement.z.any() and not starts.start_at_rest(basis).v.any()


def test_exact_modes_start_at_given_values_with_bonded_spring():
    """The modal values of a start are those given, with or without a bonded spring."""
    basis = make_basis([2.0, 5.0], [1.0, -0.5])
    assert starts.start_from_values(basis, [1.0, 2.0]).z.tolist() == [1.0, 2.0]
    bonded = add_spring(basis, 7.0)
    np.testing.assert_allclose(
        bonded.shapes @ starts.start_from_values(bonded, [1.0, 2.0]).z, [1.0, 2.0], rtol=1e-14
    )


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


def test_exact_base_step_leaves_masses_at_rest():
    """After a step of the base the masses stay in space, so they start at -X relative to the base."""
    basis = masses.build_basis([1.0, 3.0], [((1, 0), 4.0), ((1, 2), 1.0)], [], [(2, 0)], 1)
    np.testing.assert_allclose(
        basis.shapes @ starts.start_from_base_step(basis, 2e-3).z, -2e-3, rtol=1e-13
    )


def test_refuses_start_inconsistent_with_modes():
    """A start with the wrong number of values, or for an output that no mode moves, is refused."""
    with pytest.raises(PatchfemError, match="1 values are given for 2 modes or masses"):
        starts.start_from_values(make_basis([2.0, 5.0], [1.0, 0.0]), [1.0])
    with pytest.raises(PatchfemError, match="no mode moves the output"):
        starts.start_from_output_displacement(make_basis([2.0], [0.0]), 1.0)
