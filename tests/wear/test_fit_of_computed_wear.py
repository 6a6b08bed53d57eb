"""Fit of a computed worn depth to a measured one: known coefficient, place and direction, errors and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.wear import MeasuredDepth, WearHistory, fit_wear

HALF = 1.5e-3  # half of the patch [m]
COEFFICIENT = 1e-14  # of the run [m2/N]
CENTRE = 2.2005e-3  # middle of the patch in the trace [m]; its ends lie between two samples
NOISE = 5e-9  # of a measured depth [m]


def grow_depth(work: float, x) -> np.ndarray:
    """Return a wedge-shaped depth (m,) [m] whose width grows with the wear."""
    reach = -HALF + 2 * HALF * work**0.4
    return 3e-6 * work * np.where(x < reach, (reach - x) / (reach + HALF + 1e-9), 0.0)


def make_history() -> WearHistory:
    """Return the depths of a run in ten frames."""
    x = np.linspace(-HALF, HALF, 1201)
    work = np.linspace(0, 1, 11)
    depth = np.array([grow_depth(each, x) for each in work])
    return WearHistory(x, work, depth, COEFFICIENT, 1e-3, "out/wear", "upper")


def measure_depth(ratio: float, side: int = 1, seed: int = 0) -> MeasuredDepth:
    """Return the depth for a ratio of the coefficient, laid into a trace, with noise."""
    x = np.arange(0, 5e-3, 1e-6)
    place = side * (x - CENTRE)
    depth = np.where(np.abs(place) <= HALF, grow_depth(ratio, place), 0.0)
    depth += NOISE * np.random.default_rng(seed).normal(size=x.size)
    return MeasuredDepth(x, depth, np.full(x.size, NOISE), 1.0, 1e-9, None)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("ratio", [0.35, 0.8])
def test_exact_coefficient_place_and_direction(ratio, side):
    """Coefficient and place are found within 1 % and 5 um, inside their intervals, for both directions."""
    found = fit_wear(measure_depth(ratio, side), make_history())
    for quantity, truth, error in (
        (found.coefficient, ratio * COEFFICIENT, 0.01 * ratio * COEFFICIENT),
        (found.centre, CENTRE, 5e-6),
    ):
        assert quantity.value == pytest.approx(truth, abs=error)
        assert quantity.low <= truth <= quantity.high
    assert found.is_mirrored == (side < 0) and not found.is_extrapolated
    assert found.coefficient.high - found.coefficient.low < 0.1 * found.coefficient.value
    # the width grows, so the last depth in proportion gives another coefficient
    assert abs(found.proportional / found.coefficient.value - 1) > 0.04
    assert found.difference_rms < 2e-8


def test_exact_symmetric_depth_has_no_direction():
    """A symmetric depth fits both ways; the noise of a bin rises with the root of the correlation length."""
    history, ways = make_history(), [measure_depth(0.7, side) for side in (1, -1)]
    history = replace(history, depth=history.depth + history.depth[:, ::-1])
    measured = ways[0]._replace(depth=ways[0].depth + ways[1].depth)
    found, correlated = (
        fit_wear(measured._replace(correlation=length), history) for length in (1.0, 25.0)
    )
    assert found.is_mirrored is None and found.centre.low < CENTRE < found.centre.high
    assert correlated.depths.noise == pytest.approx(5 * found.depths.noise, rel=1e-9, abs=0)


def test_common_error_of_depths_widens_the_interval():
    """A standard deviation that all depths have in common moves the coefficient as depths that are larger by it do."""
    measured = measure_depth(0.7)._replace(datum_error=0.0)
    plain, moved, wide = (
        fit_wear(each, make_history()).coefficient
        for each in (
            measured,
            measured._replace(depth=measured.depth + 2e-8),
            measured._replace(datum_error=2e-8),
        )
    )
    added = np.sqrt((wide.high - wide.low) ** 2 - (plain.high - plain.low) ** 2) / 2
    assert added / abs(moved.value - plain.value) == pytest.approx(1.96, rel=0.05)


def test_gain_error_widens_the_interval():
    """A standard deviation of the gain moves the coefficient as depths that are larger by this factor do."""
    measured = measure_depth(0.7)._replace(datum_error=0.0)
    plain, moved, wide = (
        fit_wear(each, make_history()).coefficient
        for each in (
            measured,
            measured._replace(depth=1.01 * measured.depth),
            measured._replace(gain_error=0.01),
        )
    )
    added = np.sqrt((wide.high - wide.low) ** 2 - (plain.high - plain.low) ** 2) / 2
    assert added / abs(moved.value - plain.value) == pytest.approx(1.96, rel=0.05)


def test_always_interval_covers_true_coefficient():
    """With wear that scatters along the trace by 8 %, the interval covers the truth in at least 27 of 30 traces."""
    covers = 0
    for seed in range(30):
        measured = measure_depth(0.7, seed=seed)
        waves = np.random.default_rng(seed).normal(size=50)
        waves = np.interp(measured.x, np.linspace(0, 5e-3, 50), waves)
        found = fit_wear(
            measured._replace(depth=measured.depth * (1 + 0.08 * waves)), make_history()
        )
        covers += found.coefficient.low <= 0.7 * COEFFICIENT <= found.coefficient.high
    assert covers >= 27


@pytest.mark.parametrize(
    "measured, says",
    [
        (
            measure_depth(0.5)._replace(width=6e-3),
            "6 mm wide, and the computed wear of out/wear 2.16 mm",
        ),
        (measure_depth(0.5)._replace(width=0.2e-3), "this run is not that of the measured contact"),
        (measure_depth(3.0), "needs 3.* times the wear coefficient"),
        (measure_depth(0.5)._replace(depth=2e3 * measure_depth(0.5).depth), "check the units of z"),
    ],
)
def test_refuses_depths_of_another_contact(measured, says):
    """A track of another width and a depth far from that of the run are refused with what to do."""
    with pytest.raises(PatchfemError, match=says):
        fit_wear(measured, make_history())


def test_refuses_traces_that_are_too_short():
    """Traces that show less than a quarter of the patch are refused."""
    measured = measure_depth(0.5)
    part = measured.x < 0.5e-3
    short = measured._replace(
        x=measured.x[part], depth=measured.depth[part], noise=measured.noise[part]
    )
    with pytest.raises(PatchfemError, match="must lie within the traces"):
        fit_wear(short, make_history())
