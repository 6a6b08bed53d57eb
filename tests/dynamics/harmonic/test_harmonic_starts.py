"""Coexisting steady motions that lie close together."""

import numpy as np
import pytest
from harmonic_motions import find_coexisting_motions
from modal_bases import make_modal_basis

from patchfem.core import G_N, SineDrive
from patchfem.dynamics import LawGroup, Spring
from patchfem.dynamics.harmonic.laws import Jenkins


@pytest.mark.slow
def test_exact_all_three_motions_near_fold_are_found():
    """Near the end of the upper branch two stable motions and one unstable motion are found,
    although two of them differ by only 8 %."""
    w = 2 * np.pi * 143
    mass = 0.884
    limit = 0.3 * 26 * 4.4482216152605
    modes = make_modal_basis(w, 0.003, mass=mass)
    laws = [(0, Jenkins([limit / 1e-6], [1e-6])), (modes.output, Spring(0.0, 2e10))]
    for hertz in np.linspace(147.2, 147.6, 5):
        drive = SineDrive(6 * G_N, 2 * np.pi * hertz)
        points = find_coexisting_motions(modes, drive, LawGroup(modes, laws))
        assert [p.stable for p in points] == [True, False, True], hertz
