"""Laws along flanks over one cycle of a periodic slide: by the loops of the march, slopes by differences."""

import numpy as np
import pytest
from scipy.linalg import expm

from patchfem.core import ModalBasis
from patchfem.dynamics.grooves.climbing import ClimbingModel
from patchfem.dynamics.grooves.periodic import ElasticFlank, PacedFlank
from patchfem.dynamics.harmonic.floquet import monodromy
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Track, analysis, synthesis
from patchfem.dynamics.march.instances import follow_path
from patchfem.dynamics.march.varying_load import plastic
from patchfem.friction.grooves import Grooves

ONE, LOAD, OMEGA = np.ones(1), 115.0, 900.0
BASIS = ModalBasis(("axial",), ONE, 0 * ONE, ONE, ONE, ONE, 1.2)
X = np.array([[2e-6, 12e-6, 0, 1e-6 - 1e-6j]])


def laws(phase, lifted=0.0):
    grooves = Grooves(80e-6, 7.5e-6, phase, lifted)
    return PacedFlank(grooves, LOAD, 0.4, 5e-3), ElasticFlank(ClimbingModel(grooves, LOAD, plastic(0.4, 1e-6)))


@pytest.mark.parametrize(("phase", "lifted"), [(0.0, 0.0), (0.4, 0.0), (0.4, 0.5)])
@pytest.mark.parametrize("number", [0, 1])
def test_exact_slopes_are_those_of_differences(phase, lifted, number):
    """Over the harmonics of the slide and over the frequency."""
    group, d = Group(BASIS, [(0, laws(phase, lifted)[number])], 1024), 1e-12
    fold = group(X, OMEGA)
    slope, size = fold.slope[0], X.shape[1]
    if number == 0 or lifted:
        true = (group(X, OMEGA + 1e-4).force[0] - group(X, OMEGA - 1e-4).force[0]) / 2e-4
        np.testing.assert_allclose(fold.rate[0], true, rtol=0, atol=1e-6 * np.abs(true).max())
    for k in range(2 * size - 1):
        change = np.zeros_like(X)
        change[0, k if k < size else k - size + 1] = d if k < size else 1j * d
        true = (group(X + change, OMEGA).force[0] - group(X - change, OMEGA).force[0]) / (2 * d)
        np.testing.assert_allclose(slope[:, k], true, rtol=0, atol=1e-7 * np.abs(slope).max())


def test_exact_a_force_of_the_speed_at_every_instant():
    law, track = laws(0.4)[0], Track(X[0], OMEGA, 256)
    angle = np.arctan(law.grooves.slope(track.q))
    own = np.arctan(0.4 * np.tanh(OMEGA * track.rate / np.cos(angle) / 5e-3))
    np.testing.assert_allclose(law.sample(track).force, LOAD * np.tan(angle + own), rtol=1e-12)


def test_exact_the_vertical_force_is_that_of_a_mass_that_follows_the_flank():
    """V - N = m z'', z'' by the harmonics of the height along the cycle."""
    for law in laws(0.4, 0.5):
        track = Track(X[0], OMEGA, 512)
        found = law.sample(track)
        height = synthesis(analysis(laws(0.4)[0].grooves.height(track.q), 255) * -(np.arange(256) * OMEGA)**2, 512)
        np.testing.assert_allclose(found.load, LOAD + 0.5 * height, rtol=1e-9)


def test_exact_multipliers_beside_a_constant_mass_that_rises():
    """A mode of mass m on a spring and a damper of the interface, with m' more: that of m + m' by its own matrix."""
    mass, more, stiff, damping = 1.2, 0.7, 3e6, 90.0
    own = ModalBasis(("axial",), 800 * ONE, 0 * ONE, ONE, ONE, ONE, mass)
    rows, cells = np.ones((1, 1)), np.ones((1, 16))
    found = monodromy(own, rows, OMEGA, stiff * cells, damping * cells, (), (), more * cells)
    whole = mass + more
    matrix = np.array([[0, 1], [-(mass * 800**2 + stiff) / whole / OMEGA**2, -damping / whole / OMEGA]])
    np.testing.assert_allclose(found, expm(2 * np.pi * matrix), rtol=1e-9)


def test_order_springs_along_the_flank_are_those_of_the_march():
    """The mean force of every step of the march, after two cycles, is that of its ends, but for the few steps in which
    a stick ends; what is left falls with the square of the step."""
    law, gaps = laws(0.4)[1], []
    for count in (2048, 4096):
        track = Track(X[0], OMEGA, count)
        found = law.sample(track).force
        path = np.concatenate([np.linspace(0, track.q[0], 200), np.tile(track.q, 3)[1:], track.q[:1]])
        forces, energies, contact = np.zeros((path.size, 3)), np.zeros((path.size, 2)), law.model.build()
        assert follow_path(path, 1e-3, law.model.kind, contact, 1e-9, energies, forces) == 0
        mean = forces[-count - 1:-1, 1]
        gaps.append(np.sort(np.abs(mean - (found + np.roll(found, -1)) / 2))[count // 20:-count // 20].max())
    assert gaps[1] < 0.3 * gaps[0] and gaps[1] < 4e-6 * LOAD


def test_always_what_sticks_all_the_cycle_is_a_spring():
    """A tiny slide about a place of the flank, from rest at 0: the slope there, in phase."""
    law = laws(0.4)[1]
    track = Track(np.array([0.0, 1e-9, 0.0]), OMEGA, 512)
    force = law.sample(track).force
    stiff = law.sample(track).slope
    assert np.ptp(force) == pytest.approx(2e-9 * stiff.mean(), rel=1e-2)


@pytest.mark.parametrize("number", [0, 1])
def test_exact_the_stiffness_at_rest_is_that_of_a_tiny_slide_about_the_bottom(number):
    law, track = laws(0.0)[number], Track(np.array([0.0, 1e-10, 0.0]), OMEGA, 64)
    assert law.total == pytest.approx(law.sample(track).slope.mean(), rel=1e-6)


def test_always_a_cycle_samples_every_flank_that_it_passes():
    """Twenty samples or more over a groove, where a slide of 100 um is fastest."""
    fastest = 100e-6 * 2 * np.pi  # per cycle
    assert all(fastest / law.sharpness(100e-6) < 80e-6 / 20 for law in laws(0.0))
