"""Steady motions by harmonic balance: response curves, regimes and difficult cases."""

import numpy as np
import pytest
from harmonic_cases import make_bond_law, make_sdof

from patchfem.core import NotConverged, SineDrive
from patchfem.dynamics import (
    Spring,
    find_regime,
    find_steady_motion,
    refine_steady_motion,
    trace_over_frequency,
)
from patchfem.dynamics.harmonic.laws import Jenkins

DRIVE = SineDrive(1.0, 1.0)


def test_always_curve_agrees_with_single_points():
    """The amplitudes of a response curve agree within 3e-4, and the change by refinement, with points that are computed
    without a start value."""
    modes = make_sdof(0.01)
    law = Jenkins([4.0, 1.0], [0.05, 0.5])
    branch = trace_over_frequency(modes, SineDrive(1.0, 1.0), law, (0.2, 0.4), tolerance=1e-4)
    assert branch.ended == "end" and not branch.folds
    for p in branch.points[::10]:
        drive = SineDrive(1.0, p.omega)
        size = find_steady_motion(modes, drive, law, tolerance=1e-4).amplitude([1.0])
        change = abs(refine_steady_motion(p, modes, drive).amplitude([1.0]) - p.amplitude([1.0]))
        assert abs(p.amplitude([1.0]) - size) < 3e-4 * size + change


def test_exact_regimes_of_slide_amplitudes():
    """Slides of three amplitudes through elements that yield at 0.1 and 0.5 have the regimes stuck,
    partial slip and slides."""
    modes = make_sdof(0.0)
    law = Jenkins([1.0, 1.0], [0.1, 0.5])
    for amplitude, expected in ((0.05, "stuck"), (0.3, "partial slip"), (0.6, "slides")):
        # far below resonance with a stiff spring the slide amplitude is level/stiffness
        drive = SineDrive(amplitude * 1e4, 1.0)
        assert find_regime(find_steady_motion(modes, drive, [Spring(1e4), law])) == expected
    spring = find_steady_motion(modes, DRIVE, Spring(3.0), harmonics=1)
    assert find_regime(spring) == "no friction"
    for level, bonds, expected in (
        (1e-4, make_bond_law(1.0, 1.0), "stuck"),
        (1.0, make_bond_law(0.1, 0.1), "slides"),
    ):
        motion = find_steady_motion(modes, SineDrive(level, 0.5), bonds, harmonics=7)
        assert find_regime(motion) == expected


@pytest.mark.parametrize("limit, bounded", [(0.9, True), (0.7, False)])
def test_exact_undamped_resonance_is_bounded_above_friction_threshold(limit, bounded):
    """An undamped mode at resonance has a bounded motion if the friction limit exceeds pi/4 of the
    drive. Below this threshold there is no periodic motion, and the message names the reason."""
    modes = make_sdof(0.0)
    law = Jenkins([20.0], [limit / 20.0])
    if not bounded:
        with pytest.raises(
            NotConverged, match="undamped mode that is driven at its natural frequency"
        ):
            find_steady_motion(modes, DRIVE, law)
        return
    p = find_steady_motion(modes, DRIVE, law, tolerance=1e-4)
    assert np.abs(p.forces[0, 1] - 1j) < 1e-6  # friction balances the first harmonic of the drive


def test_refuses_tolerance_beyond_maximum_harmonics():
    """For a nearly rigid element 255 harmonics do not reach a tolerance of 1e-12, and the message
    states the remaining error."""
    with pytest.raises(NotConverged, match="the motion still has an error"):
        find_steady_motion(
            make_sdof(0.05),
            SineDrive(1.0, 0.7),
            [Spring(0.1), Jenkins([1.0], [0.1])],
            tolerance=1e-12,
        )
