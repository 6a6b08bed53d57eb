"""Breakaway: bonds that stretch by a fraction of their length without damage."""

import friction_forms
import numpy as np
import pytest
from friction_paths import march_path, random_walk, slides, triangle_path, upper_pressure

from patchfem.friction import Bonds, FirstOrderBonds, Quadrature

UNIT_PRESSURE = upper_pressure([1.0])
GROWTH = {"ratio": 0.5, "rest_growth": 0.4, "slip_growth": 0.3, "rest_speed": 0.01}


def breakaway_bonds(fraction, order=1.0, **parameters):
    """Return a bond law with unit friction limit and length whose breakaway fraction is given."""
    return Bonds(1.0, 1.0, order, breakaway=fraction, **parameters)


@pytest.mark.share(6, 13)
@pytest.mark.parametrize("fraction", [0.0, 0.2, 0.7, 0.999])
@pytest.mark.parametrize("amplitude", [0.1, 0.9, 1.5, 8.0])
def test_exact_breakaway_loop_agrees_with_closed_form(fraction, amplitude):
    """Loop area and reversal force agree with the closed form; the area vanishes if the bonds stay elastic."""
    path = triangle_path(amplitude, 80, 7)
    run = march_path(FirstOrderBonds(breakaway_bonds(fraction)), path, UNIT_PRESSURE)
    work = run.mean[-14:, 0] @ np.diff(path)[-14:]
    area, end = friction_forms.stretch_loop(amplitude, 1.0, 1.0, fraction)
    if amplitude > fraction:  # below it the loop is a line about the mean of the first stroke
        assert (work, -run.traction[-1, 0]) == pytest.approx((area, end), abs=1e-11)
    else:
        assert work == pytest.approx(0.0, abs=1e-14)


@pytest.mark.share(0, 3)
@pytest.mark.parametrize("growth", [{}, GROWTH])
@pytest.mark.parametrize("fraction", [0.1, 0.6])
def test_exact_breakaway_recursion_equals_sum_over_bonds(fraction, growth):
    """The recursion with breakaway has the forces and energies of the sum over all bonds within 1e-11."""
    law = breakaway_bonds(fraction, initial=0.7, **growth)
    path = random_walk(5, 150, 0.5)
    a, b = (
        march_path(engine, path, upper_pressure([1.0, 0.3]))
        for engine in (FirstOrderBonds(law), Quadrature(law, 0.0))
    )
    for name in ("mean", "traction", "stored", "dissipated"):
        assert getattr(a, name) == pytest.approx(getattr(b, name), abs=1e-11), name


@pytest.mark.parametrize(
    "fraction, low, high",
    [
        (0.0, 0.4, 0.6),
        (0.1, 0.4, 0.6),
        (0.3, 0.2, 0.8),
        (0.5, -0.2, 0.7),
        (0.3, -0.5, 0.5),
    ],
)
def test_exact_drift_per_cycle_under_force_dither(fraction, low, high):
    """The drift per cycle of a force that alternates about a mean agrees with the closed form from the second cycle.

    It vanishes if the alternating part stays within the elastic range.
    """
    ends = slides(FirstOrderBonds(breakaway_bonds(fraction)), (high, low), (1.0, 1.0), 8)
    expected = friction_forms.dither_drift(low, high, fraction)
    assert np.diff(ends) == pytest.approx(expected, abs=1e-9)
    assert (expected == 0) == (high - low <= 2 * fraction + 1e-15 or low == -high)


def min_dissipation_on_random_paths(seed, points, count):
    """Return the smallest dissipation, relative to energy and work, of points on random paths."""
    rng = np.random.default_rng(seed)
    growth = (
        {
            "ratio": rng.uniform(0.1, 1),
            "rest_growth": 10 ** rng.uniform(-2, 1),
            "slip_growth": 10 ** rng.uniform(-2, 1),
            "rest_speed": 0.01,
        }
        if rng.random() < 0.7
        else {}
    )
    law = FirstOrderBonds(
        Bonds(
            0.4,
            1.0,
            initial=rng.uniform(0, 1),
            breakaway=rng.choice([0, rng.uniform(0, 1)]),
            **growth,
        )
    )
    sigma = rng.uniform(0, 2, points)
    state = law.initial_state(sigma)
    worst = 0.0
    for _ in range(count):
        after = rng.uniform(0, 2, points) * (rng.random(points) < 0.9)
        press = law.press(state, sigma, after)
        falls = after < sigma
        assert (np.abs(press.mean) <= 0.4 * after * (1 + 1e-12))[falls].all()
        assert (press.mean == law.traction(state))[~falls & (sigma > 0)].all()
        dq = float(rng.normal() * 10 ** rng.uniform(-4, 2))
        ahead = rng.uniform(0, 2, points) if rng.random() < 0.5 else after
        step = law.step(press.state, dq, after, ahead, 10 ** rng.uniform(-3, 2))
        size = np.abs(step.mean * dq) + law.stored_energy(state) + 1e-12
        worst = min(worst, (press.dissipated / size).min(), (step.dissipated / size).min())
        gain = (
            step.mean * dq
            - (law.stored_energy(step.state) - law.stored_energy(press.state))
            - step.dissipated
        )
        assert np.abs(gain / size).max() <= 1e-11
        state = step.state
        sigma = ahead
    return worst


def test_always_breakaway_with_varying_load_is_passive():
    """Bonds with breakaway under a varying load never create energy on random paths of 160 points."""
    assert min(min_dissipation_on_random_paths(seed, 20, 40) for seed in range(8)) >= -1e-12
