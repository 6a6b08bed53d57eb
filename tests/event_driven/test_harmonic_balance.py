"""The balance of odd harmonics agrees with closed forms and with periodic motions.

Seed 71_000_200 is used nowhere else.
"""

import numpy as np
import pytest

from patchfem.core import ModalBasis
from patchfem.event_driven.cases import Load
from patchfem.event_driven.harmonic_balance import HARMONICS, HarmonicBalance
from patchfem.event_driven.laws import masing


def make_modes(slides) -> ModalBasis:
    """Return two modes of 1 and 3.2 rad/s with a damping ratio of 2 %, and interfaces of given rows (i, 2)."""
    slides = np.array(slides, float)
    return ModalBasis(
        ("1", "2"), np.array([1.0, 3.2]), np.full(2, 0.02), slides[0], np.array([1.0, 0.5]),
        np.array([1.0, -1.0]), 1.0, faces=slides,
    )  # fmt: skip


def solve(modes, laws, acceleration: float, omega):
    """Return the balanced motions of a rig under constant loads of 1 N."""
    joints = [(law, Load(1.0)) for law in laws]
    return HarmonicBalance(modes, joints, acceleration, modes.output).find_curve(omega)


def test_exact_sticking_interfaces_are_springs():
    """Interfaces that stick are springs, also if they are more than the modes, and no harmonic but the first is excited."""
    rows = np.array([[1.0, 0.5], [0.3, 1.0], [1.0, -1.0]])
    stiffness = np.array([0.4, 1.0, 0.2])
    modes = make_modes(rows)
    laws = [masing.from_elements([k], [1e3]) for k in stiffness]
    omega = np.linspace(0.5, 4.0, 31)
    found = solve(modes, laws, 0.01, omega)
    springs = np.diag(modes.omega**2) + rows.T @ np.diag(stiffness) @ rows
    damping = modes.damping_matrix
    for k, w in enumerate(omega):
        motion = np.linalg.solve(springs - w**2 * np.eye(2) + 1j * w * damping, -0.01 * modes.base)
        np.testing.assert_allclose(found.modes[k, :, 0], motion, atol=1e-12 * abs(motion).max())
    np.testing.assert_allclose(found.modes[:, :, 1:], 0, atol=1e-12 * abs(found.modes).max())


def test_slipping_element_has_loop_of_its_slide():
    """The friction force has the harmonics of a fine time integration of the element over the balanced slide."""
    modes = make_modes([[1.0, 0.5]])
    law = masing.from_elements([2.0], [0.05])
    omega = np.linspace(0.7, 1.4, 15)
    found = solve(modes, [law], 0.1, omega)
    assert np.isfinite(found.heights).all()

    phase = np.linspace(0, 6 * np.pi, 6000, endpoint=False)
    last = phase >= 4 * np.pi
    is_slipping = abs(found.slides[:, 0, 0]) > 0.06
    assert is_slipping.sum() > 5
    for k, w in zip(np.flatnonzero(is_slipping), omega[is_slipping]):
        slide = np.sum(
            found.slides[k, 0][:, None] * np.exp(1j * np.outer(HARMONICS, phase)), 0
        ).imag
        stretch = np.empty(phase.size)
        stretch[0] = 0.0
        for j, step in enumerate(np.diff(slide)):
            stretch[j + 1] = min(max(stretch[j] + step, -0.05), 0.05)
        force = 2.0 * stretch[last]
        harmonics = [2j * np.mean(force * np.exp(-1j * h * phase[last])) for h in HARMONICS]
        # Motion under these forces and the drive
        matrix = np.diag(modes.omega**2) - w**2 * np.eye(2) + 1j * w * modes.damping_matrix
        right_side = -0.1 * modes.base - modes.interfaces[0] * harmonics[0]
        motion = np.linalg.solve(matrix, right_side)
        assert motion == pytest.approx(found.modes[k, :, 0], abs=0.01 * abs(motion).max())


def test_samples_of_smooth_law_agree_with_curve_of_first_loading():
    """At an amplitude of the drive at which Segalman's law sticks in part, the height is that of elements in its place."""
    modes = make_modes([[1.0, 0.5]])
    omega = np.linspace(0.8, 1.8, 9)
    smooth = masing.LawNumbers(
        "masing", (-0.5, 0.5, 1.0, 2.0, 1, 0.0, 2.0, 0.0, 1.0), length=0.5, stiffness=0.9
    )
    points = 2.0 * np.linspace(0, 1, 201) ** 2
    forces = masing.load_first(np.array(smooth.numbers), points)
    slopes = np.diff(forces) / np.diff(points)
    elements = masing.from_elements(-np.diff(np.append(slopes, 0.0)), points[1:])
    first, second = (solve(modes, [law], 0.3, omega).heights for law in (smooth, elements))
    np.testing.assert_allclose(first, second, rtol=0.02)
