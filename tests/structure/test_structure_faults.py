"""Claims about reduced structures that planted faults showed to be unchecked."""

import numpy as np
import pytest
from scipy import sparse

from patchfem.core import PatchfemError
from patchfem.structure import reduced


def test_refuses_attachment_modes_of_a_boundary_that_moves_as_one():
    """A spring 1e10 times as stiff as the others joins the boundary coordinates: their shapes are equal."""
    spring = np.full(12, 1e6)
    spring[-1] *= 1e10
    stiffness = (
        np.diag(spring + np.append(spring[1:], 0))
        - np.diag(spring[1:], 1)
        - np.diag(spring[1:], -1)
    )
    mass = sparse.csr_array(0.01 * np.eye(12))
    found = reduced.reduce_matrices(
        sparse.csr_array(stiffness), mass, None, np.array([10, 11]), 2, "free-interface"
    )
    with pytest.raises(PatchfemError, match="use method = 'craig-bampton'") as refusal:
        reduced.build_basis(found, 2)
    assert refusal.value.key == "structure.reduced.modes"
