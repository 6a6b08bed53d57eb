"""Initial conditions: physical and modal values are the same motion."""

import numpy as np
import pytest

from patchfem.core import ModalBasis, PatchfemError
from patchfem.structure import masses, starts
from patchfem.structure.bonded import add_spring


def modes(omega, output):
    n = len(omega)
    omega = np.array(omega, float)
    output = np.array(output, float)
    return ModalBasis(tuple("abc"[:n]), omega, np.zeros(n), np.ones(n), output, output, 2.0)


def test_exact_masses_start_where_they_are_put():
    found = masses.build_basis([1.0, 3.0], [((1, 0), 4.0), ((1, 2), 1.0)], [], [(2, 0)], 1)
    start = starts.start_from_values(found, [1e-3, -2e-3], [0.5, 0.25])
    np.testing.assert_allclose(found.shapes @ start.z, [1e-3, -2e-3], rtol=1e-14)
    np.testing.assert_allclose(found.shapes @ start.v, [0.5, 0.25], rtol=1e-14)
    # 3.2
    np.testing.assert_allclose(
        start.z, found.shapes.T @ np.diag([1.0, 3.0]) @ [1e-3, -2e-3], rtol=1e-13
    )
    half = starts.start_from_values(found, None, [0.5, 0.25])
    assert not half.z.any() and not starts.start_at_rest(found).v.any()


def test_exact_modes_start_with_their_own_values_bonded_or_not():
    plain = modes([2.0, 5.0], [1.0, -0.5])
    assert starts.start_from_values(plain, [1.0, 2.0]).z.tolist() == [1.0, 2.0]
    folded = add_spring(plain, 7.0)
    np.testing.assert_allclose(
        folded.shapes @ starts.start_from_values(folded, [1.0, 2.0]).z, [1.0, 2.0], rtol=1e-14
    )


def test_exact_release_is_the_static_shape():
    """K z proportional to the output row, and the output where it was put; a rigid mode carries all of it."""
    plain = modes([2.0, 5.0], [1.0, -0.5])
    start = starts.start_from_output_displacement(plain, 3e-3)
    assert plain.output @ start.z == pytest.approx(3e-3, rel=1e-15) and not start.v.any()
    force = plain.omega**2 * start.z
    np.testing.assert_allclose(force / force[0], plain.output / plain.output[0], rtol=1e-14)
    assert starts.start_from_output_displacement(modes([2.0], [0.8]), 1e-3).z[0] == pytest.approx(
        1e-3 / 0.8
    )
    rigid = starts.start_from_output_displacement(modes([0.0, 5.0], [0.5, 1.0]), 1e-3)
    np.testing.assert_allclose(rigid.z, [2e-3, 0.0], rtol=1e-15)


def test_exact_base_step_leaves_masses_in_space():
    found = masses.build_basis([1.0, 3.0], [((1, 0), 4.0), ((1, 2), 1.0)], [], [(2, 0)], 1)
    np.testing.assert_allclose(
        found.shapes @ starts.start_from_base_step(found, 2e-3).z, -2e-3, rtol=1e-13
    )


def test_refuses_starts_that_fit_no_mode():
    with pytest.raises(PatchfemError, match="1 values are given for 2 modes or masses"):
        starts.start_from_values(modes([2.0, 5.0], [1.0, 0.0]), [1.0])
    with pytest.raises(PatchfemError, match="no mode moves the output"):
        starts.start_from_output_displacement(modes([2.0], [0.0]), 1.0)
