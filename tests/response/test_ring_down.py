"""Frequency and damping of a decay from turn to turn, against closed forms."""

import numpy as np
import pytest

from patchfem.response.ring_down import ring_down, turns


def viscous(zeta: float, omega: float, samples: int):
    t = np.linspace(0, 40 * 2 * np.pi / omega, samples)
    lam = complex(-zeta * omega, omega * np.sqrt(1 - zeta**2))
    y = np.exp(lam * t)
    return t, y.real, (lam * y).real


@pytest.mark.parametrize("zeta", [1e-4, 0.02, 0.3])
def test_exact_a_viscous_decay_has_its_ratio_and_frequency_at_every_amplitude(zeta):
    """The turns of a viscous decay follow each other by half a period, each smaller by the same factor."""
    omega, k = 700.0, np.arange(30)
    own = omega * np.sqrt(1 - zeta**2)
    places = (-1.0)**k * np.exp(-zeta * omega * np.pi * k / own)
    for every in (1, 3):
        found = ring_down(np.pi * k / own, places, every)
        assert found.damping == pytest.approx(zeta, rel=1e-9)
        assert found.frequency == pytest.approx(own / (2 * np.pi), rel=1e-12)
    assert found.whole == (zeta < 0.1)  # of the quickest the last turns are below round-off of the first


def test_order_turns_lie_between_samples_to_the_fourth():
    """The cubic of places and speeds at both ends misses the place of a turn by the fourth power of the step."""
    off = []
    for samples in (407, 1627):
        found = ring_down(*turns(*viscous(0.01, 300.0, samples)))
        off.append(np.abs(found.damping - 0.01).max())
    assert off[0] < 1e-4 and 50 < off[0] / off[1] < 500


def test_exact_rigid_friction_takes_the_same_from_every_swing():
    """A block loses 4 h of every half swing 2 A, h = F/k: ln(A/(A - 2 h)) is the decrement of half a cycle."""
    h, k = 0.01, np.arange(20)
    places = (-1.0)**k * (1 - 2 * h * k)
    found = ring_down(np.pi * k, places)
    swing = np.abs(np.diff(places)) / 2
    loss = np.log(swing[:-1] / swing[1:])
    assert found.damping == pytest.approx(loss / np.hypot(np.pi, loss), rel=1e-12)
    assert found.amplitude == pytest.approx(np.sqrt(swing[:-1] * swing[1:]), rel=1e-12)
    between = np.array([0.7, 0.9])
    exact = 2 * h / between / np.pi  # of a slow loss, to the second order of h/A
    assert np.abs(found.at(between)[1] - exact).max() < 2e-3
    assert (np.abs(found.at(between)[1] - exact) < found.bend(between)[1] + 1e-4).all()


def test_what_no_longer_falls_is_left_out():
    """Another motion goes on where the decay has ended; of rest nothing is read, nor of too few turns."""
    places = np.concatenate([(-0.5)**np.arange(8), (-1.0)**np.arange(6) * 0.3])
    found = ring_down(np.arange(14.0), places)
    assert found.damping.size == 6 and not found.whole
    assert np.isnan(found.at([2.0])[0]).all()
    rest = ring_down(np.arange(9.0), np.array([1.0, -0.5, 0.25, -0.1, 0.02, 0.02, 0.02, 0.02, 0.02]))
    assert rest.damping.size == 3 and np.isfinite(rest.damping).all()
    assert ring_down(np.arange(3.0), np.array([1.0, -0.5, 0.2])).at([0.1])[0].size == 1
    assert turns(np.arange(3.0), np.arange(3.0), np.ones(3))[0].size == 0
