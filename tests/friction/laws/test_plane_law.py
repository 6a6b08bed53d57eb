"""The elastic-plastic element in a plane: the closed form of a straight displacement against its rate equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from patchfem.friction.laws import plane_kernels as plane

STIFFNESS, MAX_STRETCH = 3e6, 2e-6


def integrate_rate_equations(stretch, displacement) -> tuple:
    """Return the mean force (2,), the end stretch (2,) and the dissipated energy of a straight displacement, by DOP853."""

    def make_rate(slips):
        def derivative(t, y):
            stretch_rate = (
                displacement - y[:2] * (y[:2] @ displacement) / (y[:2] @ y[:2])
                if slips
                else displacement
            )
            return np.concatenate(
                [
                    stretch_rate,
                    STIFFNESS * y[:2],
                    [STIFFNESS * y[:2] @ (displacement - stretch_rate)],
                ]
            )

        return derivative

    def yield_function(t, y):
        return (y[0] ** 2 + y[1] ** 2) / MAX_STRETCH**2 - 1

    yield_function.terminal = True
    yield_function.direction = 1
    options = {"rtol": 1e-12, "atol": 1e-18, "method": "DOP853"}
    y = np.array([*stretch, 0.0, 0.0, 0.0])
    slips_at_start = abs(yield_function(0, y)) < 1e-9 and stretch @ displacement > 0
    elastic_part = (
        None
        if slips_at_start
        else solve_ivp(make_rate(False), (0, 1), y, events=yield_function, **options)
    )
    y, t = (y, 0.0) if slips_at_start else (elastic_part.y[:, -1], elastic_part.t[-1])
    y = solve_ivp(make_rate(True), (t, 1), y, **options).y[:, -1] if t < 1 else y
    return y[2:4], y[:2], y[4]


@pytest.mark.parametrize("seed", range(10))
def test_exact_straight_displacement_agrees_with_rate_equations(seed):
    """Force, stretch and dissipation of a straight displacement agree with the integrated rate equations."""
    rng = np.random.default_rng(seed)
    (stretch_angle, direction), distance = (
        rng.uniform(0, 2 * np.pi, 2),
        MAX_STRETCH * 10 ** rng.uniform(-1.5, 1),
    )
    stretch = (
        MAX_STRETCH
        * (1.0 if seed % 3 == 0 else rng.uniform())
        * np.array([np.cos(stretch_angle), np.sin(stretch_angle)])
    )
    displacement = distance * np.array([np.cos(direction), np.sin(direction)])
    result = plane.advance_straight((STIFFNESS, MAX_STRETCH), tuple(stretch), tuple(displacement))
    force = np.array([result.mean_x, result.mean_y])
    after = np.array([result.stretch_x, result.stretch_y])
    mean, end, dissipated = integrate_rate_equations(stretch, displacement)
    np.testing.assert_allclose(force, mean, rtol=0, atol=1e-9 * STIFFNESS * MAX_STRETCH)
    np.testing.assert_allclose(after, end, rtol=0, atol=1e-9 * MAX_STRETCH)
    assert result.dissipated == pytest.approx(
        dissipated, rel=1e-9, abs=1e-10 * STIFFNESS * MAX_STRETCH * distance
    )
    stored = 0.5 * STIFFNESS * (np.square(after).sum() - stretch @ stretch)
    scale = STIFFNESS * MAX_STRETCH**2
    assert mean @ displacement == pytest.approx(stored + dissipated, rel=1e-8, abs=1e-9 * scale)
    assert force @ displacement == pytest.approx(
        stored + result.dissipated, rel=1e-12, abs=1e-13 * scale
    )


@pytest.mark.parametrize("seed", range(12))
def test_always_plane_step_satisfies_law_and_compliance(seed):
    """The solution of a plane step satisfies the compliance of the structure and the friction law."""
    rng = np.random.default_rng(seed)
    factor = rng.normal(size=(2, 2)) * 10 ** rng.uniform(-2, 2)
    compliance = factor @ factor.T / STIFFNESS
    angle = rng.uniform(0, 2 * np.pi)
    free = MAX_STRETCH * rng.normal(size=2) * 10 ** rng.uniform(-1, 2)
    stretch = (
        MAX_STRETCH * rng.choice([rng.uniform(), 1.0]) * np.array([np.cos(angle), np.sin(angle)])
    )
    *slide, x, y, count = plane.solve_plane_step(
        tuple(free),
        (compliance[0, 0], compliance[0, 1], compliance[1, 1]),
        (STIFFNESS, MAX_STRETCH),
        tuple(stretch),
        (0.0, 0.0),
        1e-12 * STIFFNESS * MAX_STRETCH,
    )
    assert 0 < count < 40
    np.testing.assert_allclose(
        slide, free - compliance @ [x, y], rtol=0, atol=1e-13 * np.abs(free).max()
    )
    mean = plane.advance_straight((STIFFNESS, MAX_STRETCH), tuple(stretch), tuple(slide))[:2]
    np.testing.assert_allclose([x, y], mean, rtol=0, atol=1e-8 * STIFFNESS * MAX_STRETCH)
