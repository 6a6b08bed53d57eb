"""One Coulomb mode by the loop of pieces: closed forms of decay, growth, sliding and steps, DOP853, printed numbers."""

from math import pi, sqrt

import numpy as np
import pytest
from event_run import simulate
from scipy.integrate import solve_ivp

from patchfem import closed_forms
from patchfem.closed_forms.dynamics import sliding_amplitude
from patchfem.core import BaseSine, ModalBasis, Segment, Start
from patchfem.response.measures import energy_balance
from patchfem.structure.drives import Piecewise, levels, release


def modes_of(omega=1.0, zeta=0.003, slide=1.0, base=1.0, output=1.0, mass=1.0):
    return ModalBasis(("m",), *(np.array([float(v)]) for v in (omega, zeta, slide, base, output)), mass)


def driven(friction, zeta=0.003, ratio=1.0, cycles=200, omega=1.0, start=None):
    """A run under a unit base acceleration at `ratio` times the natural frequency 1."""
    return simulate(modes_of(omega, zeta), BaseSine(1.0, ratio), friction, friction, cycles, start=start)


def swing(result, last=10):
    tail = result.amplitudes[-last:]
    return (tail[:, 1].max() - tail[:, 0].min()) / 2


@pytest.mark.parametrize("friction, zeta, cycles, peak", [
    (0.5, 0.003, 200, 59.1676969670915519), (0.5, 0.0, 200, 228.347458854389), (0.78, 0.0, 200, 4.712429928746),
    (0.78, 0.0, 400, 9.030960646705), (0.78, 0.0, 800, 17.668022082624)])
def test_exact_growing_motion(friction, zeta, cycles, peak):
    result = driven(friction, zeta, cycles=cycles)
    assert np.abs(result.amplitudes).max() == pytest.approx(peak, rel=1e-12)
    assert energy_balance(result.ledger) < 1e-12


@pytest.mark.parametrize("start, rest, time", [(11.5, -0.5, 6 * pi), (11.0, -1.0, 5 * pi),
                                               (11 + 1e-9, -0.999999999, 6 * pi), (0.9, 0.9, 0.0)])
def test_exact_free_decay(start, rest, time):
    begin = Start(np.array([start]), np.zeros(1))
    result = simulate(modes_of(zeta=0.0), release(2 * pi), 1.0, 1.0, 10, 10, start=begin)
    assert result.window.slide[-1] == pytest.approx(rest, abs=2e-14)
    assert np.ptp(result.window.slide[result.window.time > time + 1e-9]) == 0.0
    late = result.window.time
    np.testing.assert_allclose(result.window.slide, closed_forms.decay(late, start, 1.0, 1.0), atol=1e-13 * start)
    assert energy_balance(result.ledger) < 1e-13


def test_exact_levels_that_do_not_change_are_a_sine():
    one = driven(0.8, cycles=30)
    many = simulate(modes_of(), levels([1.0] * 6, 1.0, 5.0), 0.8, 0.8, 30)
    np.testing.assert_allclose(many.amplitudes, one.amplitudes, rtol=0, atol=1e-13)
    np.testing.assert_allclose(many.phasors, one.phasors, rtol=0, atol=1e-13)


def test_exact_step_of_the_base():
    """A constant acceleration below friction holds for ever; above it the mode swings to a/w^2 - f sgn and stops."""
    held = simulate(modes_of(zeta=0.0), Piecewise((Segment(0.0, 0.5),), 2 * pi), 0.6, 0.6, 5)
    assert not held.window.slide.any()
    moved = simulate(modes_of(zeta=0.0), Piecewise((Segment(0.0, 1.0),), 2 * pi), 0.6, 0.6, 5)
    assert moved.window.slide[-1] == pytest.approx(-2 * (1.0 - 0.6), abs=1e-14)


@pytest.mark.parametrize("z, v", [(3.0, 0.0), (-2.0, 1.5), (0.0, -4.0)])
def test_exact_start_against_dop853(z, v):
    def slope(t, y, way):
        return [y[1], -np.sin(0.7 * t) - y[0] - 0.1 * y[1] - 0.4 * way]

    def stops(t, y, way):
        return y[1] * way

    stops.terminal, stops.direction = True, -1
    way = np.sign(v) if v else -np.sign(z)
    done = solve_ivp(slope, (0, 30), [z, v], "DOP853", args=(way,), events=stops, rtol=1e-12, atol=1e-14)
    run = driven(0.4, 0.05, 0.7, 5, start=Start(np.array([z]), np.array([v])))
    rows = run.response.time > 0
    times = run.response.time[rows]
    t = float(done.t_events[0][0])
    assert np.abs(times - t).min() < 1e-10
    k = int(np.argmin(np.abs(times - t)))
    assert run.response.slide[rows][k] == pytest.approx(done.y_events[0][0][0], abs=1e-11)


@pytest.mark.parametrize("zeta", [0.05, 0.7])
def test_exact_slight_friction(zeta):
    """Friction 1e-9 of the drive is felt, and by the amount of the closed form."""
    alone = swing(driven(0.0, zeta, 0.9, 120))
    assert alone == pytest.approx(1 / abs(1 - 0.81 + 1.8j * zeta), rel=1e-13)
    found = swing(driven(1e-9, zeta, 0.9, 120))
    assert found == pytest.approx(sliding_amplitude(0.9, 1e-9, zeta), rel=1e-13)
    assert 0.5e-9 < 1 - found / alone < 2e-9


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.5])
def test_exact_rigid_block_that_slides(friction):
    """No spring: v' = a sin - f sgn(v), half stroke sqrt(1 - (pi f/2)^2) a/omega^2 while f < a/sqrt(1 + pi^2/4)."""
    result = driven(friction, 0.0, 1.3, 80, omega=0.0)
    low, high = result.amplitudes[-1]
    assert (high - low) / 2 * 1.3**2 == pytest.approx(sqrt(1 - (pi * friction / 2)**2), rel=1e-12)
