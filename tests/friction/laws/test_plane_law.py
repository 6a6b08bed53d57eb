"""The elastic-plastic element in a plane: its closed form along a straight slide against its rate equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from patchfem.friction.laws import plane_kernels as plane

K, MOST = 3e6, 2e-6


def by_rates(stretch, move) -> tuple:
    """(path-mean force (2,), stretch at the end (2,), energy dissipated) of a straight slide, by DOP853."""

    def rate(slips):
        def of(t, y):
            held = move - y[:2] * (y[:2] @ move) / (y[:2] @ y[:2]) if slips else move
            return np.concatenate([held, K * y[:2], [K * y[:2] @ (move - held)]])

        return of

    def edge(t, y):
        return (y[0] ** 2 + y[1] ** 2) / MOST**2 - 1

    edge.terminal = True
    edge.direction = 1
    how = {"rtol": 1e-12, "atol": 1e-18, "method": "DOP853"}
    y = np.array([*stretch, 0.0, 0.0, 0.0])
    begins = abs(edge(0, y)) < 1e-9 and stretch @ move > 0
    first = None if begins else solve_ivp(rate(False), (0, 1), y, events=edge, **how)
    y, t = (y, 0.0) if begins else (first.y[:, -1], first.t[-1])
    y = solve_ivp(rate(True), (t, 1), y, **how).y[:, -1] if t < 1 else y
    return y[2:4], y[:2], y[4]


@pytest.mark.parametrize("seed", range(30))
def test_exact_a_straight_slide_has_the_force_and_loss_of_the_rate_equations(seed):
    draw = np.random.default_rng(seed)
    (turn, way), far = draw.uniform(0, 2 * np.pi, 2), MOST * 10 ** draw.uniform(-1.5, 1)
    stretch = (
        MOST * (1.0 if seed % 3 == 0 else draw.uniform()) * np.array([np.cos(turn), np.sin(turn)])
    )
    move = far * np.array([np.cos(way), np.sin(way)])
    slide = plane.advance_straight((K, MOST), tuple(stretch), tuple(move))
    force = np.array([slide.mean_x, slide.mean_y])
    after = np.array([slide.stretch_x, slide.stretch_y])
    mean, end, lost = by_rates(stretch, move)
    np.testing.assert_allclose(force, mean, rtol=0, atol=1e-9 * K * MOST)
    np.testing.assert_allclose(after, end, rtol=0, atol=1e-9 * MOST)
    assert slide.dissipated == pytest.approx(lost, rel=1e-9, abs=1e-10 * K * MOST * far)
    gained = 0.5 * K * (np.square(after).sum() - stretch @ stretch)
    scale = K * MOST**2
    assert mean @ move == pytest.approx(gained + lost, rel=1e-8, abs=1e-9 * scale)
    assert force @ move == pytest.approx(gained + slide.dissipated, rel=1e-12, abs=1e-13 * scale)


@pytest.mark.parametrize("seed", range(40))
def test_always_a_step_finds_the_slide_that_its_give_and_its_law_agree_on(seed):
    draw = np.random.default_rng(seed)
    half = draw.normal(size=(2, 2)) * 10 ** draw.uniform(-2, 2)
    give = half @ half.T / K
    turn = draw.uniform(0, 2 * np.pi)
    free = MOST * draw.normal(size=2) * 10 ** draw.uniform(-1, 2)
    stretch = MOST * draw.choice([draw.uniform(), 1.0]) * np.array([np.cos(turn), np.sin(turn)])
    *slide, x, y, count = plane.solve_plane_step(
        tuple(free),
        (give[0, 0], give[0, 1], give[1, 1]),
        (K, MOST),
        tuple(stretch),
        (0.0, 0.0),
        1e-12 * K * MOST,
    )
    assert 0 < count < 40
    np.testing.assert_allclose(slide, free - give @ [x, y], rtol=0, atol=1e-13 * np.abs(free).max())
    mean = plane.advance_straight((K, MOST), tuple(stretch), tuple(slide))[:2]
    np.testing.assert_allclose([x, y], mean, rtol=0, atol=1e-8 * K * MOST)
