"""The report's numerical methods: exact maps, orders of convergence, and its problems."""

from functools import cache

import numpy as np
import problems
import pytest
from report_methods import (
    coulomb,
    elastic_plastic,
    solve_duhamel,
    solve_euler,
    solve_newmark,
)
from scipy.linalg import expm

from patchfem.core import DriveSegment, SineDrive
from patchfem.structure.drives import PiecewiseDrive

DRIVE = SineDrive(1.3, 0.9)
NO_FRICTION = 1e-300
MODES = problems.basis([0.0, 1.3, 3.1], [0.0, 0.02, 0.01], [0.7, -0.4, 0.3], [0.4, -0.8, 0.3])


def free_motion(modes, drive: SineDrive, time: float) -> np.ndarray:
    """Return z and v without friction from rest under a sine, by a matrix exponential."""
    n = modes.omega.size
    system = np.zeros((2 * n + 2, 2 * n + 2))
    system[:n, n : 2 * n] = np.eye(n)
    system[n : 2 * n, :n] = -np.diag(modes.omega**2)
    system[n : 2 * n, n : 2 * n] = -modes.damping_matrix
    system[n : 2 * n, -2] = -modes.base * drive.acceleration
    system[-2, -1] = drive.omega
    system[-1, -2] = -drive.omega
    return (expm(system * time) @ np.append(np.zeros(2 * n + 1), 1.0))[: 2 * n]


@pytest.mark.parametrize(
    "solve, steps, order",
    [
        (solve_duhamel, (400, 800), 2),
        (solve_newmark, (400, 800), 2),
        (solve_euler, (3200, 6400), 1),
    ],
)
def test_order_of_time_integrators_without_friction(solve, steps, order):
    """Without friction each method converges with its order to a matrix exponential."""
    law = (NO_FRICTION, 1.0) if solve is solve_euler else (coulomb(NO_FRICTION),)
    errors = []
    for n in steps:
        motion = solve(MODES, DRIVE, *law, (1.5 * DRIVE.period, n))
        state = np.concatenate([motion.z[-1], motion.v[-1]])
        errors.append(np.abs(state - free_motion(MODES, DRIVE, motion.time[-1])).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)
    assert errors[0] < {1: 0.1, 2: 1e-3}[order]


# ---- the report's problems

DISPLACEMENT = {"criterion": "displacement", "tolerance": 1e-2, "relaxation": 0.1}
VELOCITY = {"criterion": "velocity", "tolerance": 1e-6}
LAWS = {
    "sgn v": coulomb(3.0),
    "static branch": coulomb(3.0, 0.01),
    "elastic": elastic_plastic(3.0, 0.01),
    "as printed": elastic_plastic(3.0, 0.03, as_printed=True),
}


@cache
def solve_two_masses(law: str, h: float, **how):
    """Return the motion of Figure 16 (m = k = P0 = 1, omega = 1.14) with steps of h."""
    drive = PiecewiseDrive((DriveSegment(0.0, 0.0, 1.0, 1.14),), 1000 * h, False)
    return solve_duhamel(problems.TWO, drive, LAWS[law], (40.0, 1000), **how)


@pytest.mark.parametrize(
    "law, h, how, early, moves, force, at_20",
    [
        ("sgn v", 0.05, DISPLACEMENT, 0.115, 5.5, 2.56, None),  # Figs 17, 18
        ("sgn v", 0.02, VELOCITY, 0.0, 8.6, 3.0, None),  # Figs 19, 20
        ("static branch", 0.02, VELOCITY | {"tolerance": 1e-8}, 0.0, 8.6, 3.0, -0.30479),
        ("elastic", 0.01, VELOCITY, 0.0095, None, None, -0.302),  # Figs 21, 22
        ("as printed", 0.01, VELOCITY, 0.03, None, None, -91.0),
    ],
)
def test_early_motion_of_two_masses_by_duhamel(law, h, how, early, moves, force, at_20):
    """The displacement before slip, and the time and force of the first slip, are the expected ones."""
    motion = solve_two_masses(law, h, **how)
    x = motion.z @ problems.TWO.slide
    assert np.abs(x[motion.time < 8]).max() == pytest.approx(
        early, rel=0.05, abs=0.03 * (early == 0)
    )
    if moves is not None:
        first = int(np.argmax(np.abs(x) > 0.05))
        assert motion.time[first] == pytest.approx(moves, abs=0.06)
        assert abs(motion.force[first]) == pytest.approx(force, abs=0.02)
    if at_20 is not None:
        assert np.interp(20, motion.time, x) == pytest.approx(at_20, rel=6e-3, abs=6e-3)
