"""A rough layer that wears: cut heights against integrals over a sampled distribution, limits, and implicit stages."""

import numpy as np
import pytest
from scipy.optimize import brentq

from patchfem.core import NotConverged
from patchfem.wear import depth as wear_depth
from patchfem.wear import make_rough_layer, make_rough_press

HARDNESS = 4e9
UM = 1e-6


def draw_heights(kind: str, count=3001) -> np.ndarray:
    """Return random heights [m] with a rms value near 1 um."""
    random = np.random.default_rng(7)
    heights = {
        "gaussian": random.normal(size=count),
        "peaks": random.exponential(size=count),
        "plateaus": np.minimum(random.normal(size=count), 0.4),
    }
    return UM * heights[kind]


def cut_heights(heights, flat_part: float, depth: float) -> tuple[float, float]:
    """Return the level [m] of the flat tops, and that which a mean depth [m] leaves, by the mean over all heights."""
    ranked = np.sort(heights)
    flat = ranked[-max(int(np.ceil(flat_part * ranked.size)), 1)]
    flattened = np.minimum(heights, flat)

    def excess(level: float) -> float:
        return np.maximum(flattened - level, 0).mean() - depth

    low = heights.min() - depth - UM
    return flat, brentq(excess, low, flat, xtol=1e-20, rtol=1e-15)


@pytest.mark.parametrize("kind", ["gaussian", "peaks", "plateaus"])
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_exact_cut_heights_lose_the_worn_depth(kind, share):
    """The heights above the worn level have the mean that was worn off; the part that touches is that of these heights."""
    heights = draw_heights(kind)
    layer = make_rough_layer(heights, HARDNESS, 0.02 * HARDNESS, share)
    for depth in (0.0, 1e-9, 3e-8, 4e-7, 2e-6, 3e-5):
        flat, level = cut_heights(heights, 0.02, share * depth) if depth else (0.0, 0.0)
        lost = float(layer.measure_lost_height(depth))
        assert lost == pytest.approx(flat - level, rel=1e-9, abs=1e-18)
        opening = lost + (1 - share) * depth
        assert float(layer.measure_opening(depth)) == pytest.approx(opening, rel=1e-12)
        if depth:
            part = np.mean(heights > level + 1e-16)
            assert float(layer.measure_touching_part(depth)) == pytest.approx(part, abs=1e-12)


def test_exact_smooth_face_wears_by_the_old_law():
    """A face of equal heights, and one whose tops the load presses flat as a whole, open by the worn depth."""
    depths = np.array([0, 1e-9, 1e-6])
    for heights, pressure in ((np.zeros(50), 1.0), (draw_heights("gaussian"), HARDNESS)):
        layer = make_rough_layer(heights, HARDNESS, pressure, 0.5)
        assert layer.measure_opening(depths) == pytest.approx(depths, rel=1e-14, abs=1e-30)
        assert layer.measure_touching_part(depths) == pytest.approx(1)


def test_exact_face_whose_heights_are_all_cut_goes_on_by_the_mean_depth():
    """Below the lowest height the tops lose the worn depth, plus the distance from their level to the mean height."""
    heights = draw_heights("peaks")
    layer = make_rough_layer(heights, HARDNESS, 1e-9 * HARDNESS, 1.0)
    depths = np.array([10, 20, 80]) * UM
    ahead = heights.max() - heights.mean()
    assert layer.measure_lost_height(depths) == pytest.approx(depths + ahead, rel=1e-12)
    assert layer.measure_slope(depths) == pytest.approx(1)


def test_always_tops_carry_at_most_the_hardness():
    """Under any pressure the tops touch on so much of the face that they carry at most the hardness, or on all of it."""
    layer = make_rough_layer(draw_heights("gaussian"), HARDNESS, 0.01 * HARDNESS, 0.5)
    pressures = HARDNESS * np.geomspace(1e-5, 1, 40)
    for depth in (0.0, 1e-8, 1e-6, 1e-4):
        part = layer.measure_touching_part(np.full(40, depth), pressures)
        assert (pressures / part <= HARDNESS * (1 + 1e-12)).all()
        assert part.max() <= 1


@pytest.fixture
def springs():
    """Return forces [N] of 12 springs under a rigid plate of 40 N with a tilted gap, as `wear.depth.Press`."""
    stiffness = 5e6
    gap = np.linspace(0, 3 * UM, 12)

    def press(worn, softening) -> np.ndarray:
        each = 1 / (1 / stiffness + softening)

        def excess(approach: float) -> float:
            return (each * np.maximum(approach - gap - worn, 0)).sum() - 40

        approach = brentq(excess, -1e-3, 1e-3, xtol=1e-18, rtol=1e-15)
        return each * np.maximum(approach - gap - worn, 0)

    return press


def test_jumps_of_rough_layer_keep_the_volume_and_follow_small_explicit_steps(springs):
    """The worn volume is rate times load to round-off, and the depths are those of 20 000 explicit steps."""
    heights = draw_heights("gaussian")
    layer = make_rough_layer(heights, HARDNESS, 0.03 * HARDNESS, 0.5)
    rate = np.full(12, 2e-11)
    cycles = 5000.0

    # Explicit steps lower the tops by the rate of the depth over the part that touches.
    n_steps = 20_000
    explicit = np.zeros(12)
    for _ in range(n_steps):
        force = springs(layer.measure_opening(explicit), np.zeros(12))
        explicit += rate * force * cycles / n_steps

    press = make_rough_press(springs, layer)
    depth = np.zeros(12)
    n_jumps = 400
    for _ in range(n_jumps):
        depth, _ = wear_depth.solve_jump(press, depth, rate, cycles / n_jumps)
    assert depth.sum() == pytest.approx(2e-11 * 40 * cycles, rel=1e-13)
    assert depth == pytest.approx(explicit, rel=2e-3, abs=1e-3 * explicit.max())
    coarse, _ = wear_depth.solve_jump(press, np.zeros(12), rate, cycles)
    assert coarse.sum() == pytest.approx(2e-11 * 40 * cycles, rel=1e-13)


def test_refuses_stage_without_solution():
    """Forces that follow no contact have no depth at the end of a stage, and an exception says so."""
    layer = make_rough_layer(draw_heights("gaussian"), HARDNESS, 0.03 * HARDNESS, 0.5)
    signs = iter(np.tile([1.0, 2.0], 500))
    press = make_rough_press(lambda worn, softening: np.full(3, next(signs)), layer)
    with pytest.raises(NotConverged, match=r"contact\.asperities\.hardness"):
        press(np.zeros(3), np.full(3, 1e-8))
