"""Laws along flanks over one cycle of a periodic slide: by the loops of the march, slopes by differences."""

import numpy as np
import pytest

from patchfem.core import ModalBasis
from patchfem.dynamics.grooves.climbing import ClimbingModel
from patchfem.dynamics.grooves.periodic import ElasticFlank, PacedFlank
from patchfem.dynamics.harmonic.forces import Group
from patchfem.dynamics.harmonic.laws import Track
from patchfem.dynamics.march.hub import follow_path
from patchfem.dynamics.march.varying_load import plastic
from patchfem.friction.grooves import Grooves

ONE, LOAD, OMEGA = np.ones(1), 115.0, 900.0
BASIS = ModalBasis(("axial",), ONE, 0 * ONE, ONE, ONE, ONE, 1.2)
X = np.array([[2e-6, 12e-6, 0, 1e-6 - 1e-6j]])


def laws(phase):
    grooves = Grooves(80e-6, 7.5e-6, phase)
    return PacedFlank(grooves, LOAD, 0.4, 5e-3), ElasticFlank(ClimbingModel(grooves, LOAD, plastic(0.4, 1e-6)))


@pytest.mark.parametrize("phase", [0.0, 0.4])
@pytest.mark.parametrize(("number", "tolerance"), [(0, 1e-6), (1, 0.03)])
def test_always_slopes_are_those_of_differences(phase, number, tolerance):
    """Exact of a law of the speed; of springs within what the change of the normal force in a stick does to them."""
    group, d = Group(BASIS, [(0, laws(phase)[number])], 4096), 1e-10
    fold = group(X, OMEGA)
    slope, size = fold.slope[0], X.shape[1]
    for k in range(2 * size - 1):
        change = np.zeros_like(X)
        change[0, k if k < size else k - size + 1] = d if k < size else 1j * d
        true = (group(X + change, OMEGA).force[0] - group(X - change, OMEGA).force[0]) / (2 * d)
        np.testing.assert_allclose(slope[:, k], true, rtol=0, atol=tolerance * np.abs(slope).max())


def test_exact_a_force_of_the_speed_at_every_instant():
    law, track = laws(0.4)[0], Track(X[0], OMEGA, 256)
    angle = np.arctan(law.grooves.slope(track.q))
    own = np.arctan(0.4 * np.tanh(OMEGA * track.rate / np.cos(angle) / 5e-3))
    np.testing.assert_allclose(law.sample(track).force, LOAD * np.tan(angle + own), rtol=1e-12)


def test_order_springs_along_the_flank_are_those_of_the_march():
    """The mean force of every step of the march, after two cycles, is that of its ends, but for the few steps in which
    a stick ends; what is left falls with the step."""
    law, gaps = laws(0.4)[1], []
    for count in (1024, 2048):
        track = Track(X[0], OMEGA, count)
        found = law.sample(track).force
        path = np.concatenate([np.linspace(0, track.q[0], 200), np.tile(track.q, 3)[1:], track.q[:1]])
        forces, energies, contact = np.zeros((path.size, 3)), np.zeros((path.size, 2)), law.model.build()[0]
        assert follow_path(path, 1e-3, law.model.kind, contact, None, 1e-9, energies, forces) == 0
        mean = forces[-count - 1:-1, 1]
        gaps.append(np.sort(np.abs(mean - (found + np.roll(found, -1)) / 2))[count // 20:-count // 20].max())
    assert gaps[1] < 0.6 * gaps[0] < 2e-5 * LOAD


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
