"""Claims about meshes that planted faults showed to be unchecked."""

from dataclasses import replace

import numpy as np
import pytest
from any_mesh_cases import GRID, of_grid

from patchfem.mesh.recognise import measure_fixed_length


@pytest.mark.parametrize(("turn", "right_half"), [(28.0, 1e-3), (32.0, 0.0)])
def test_exact_a_far_face_ends_where_its_border_turns_by_thirty_degrees(turn, right_half):
    """The left half of a far face is inclined and fixed; the right half is free, and part of it or another face."""
    piece = of_grid(GRID, 0.5, 3)
    is_fixed = (piece.points[:, 1] == 1e-3) & (piece.points[:, 0] <= 0)
    slope = np.tan(np.radians(turn))
    points = piece.points.copy()
    points[:, 1] *= 1 + slope * np.maximum(-points[:, 0], 0) / 1e-3
    inclined = replace(piece, points=points, far=np.flatnonzero(is_fixed))
    fixed = 1e-3 * np.hypot(1, slope)
    assert measure_fixed_length(inclined) == pytest.approx((fixed, fixed + right_half), rel=1e-12)
