"""Least squares within bounds against linear algebra, closed profiles and known truths."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import t as student

from patchfem.core import Missing, NotConverged, Outcome, PatchfemError
from patchfem.identify import Problem, describe_fit
from patchfem.identify.space import make_space

RNG = np.random.default_rng(7)
DESIGN = RNG.normal(size=(30, 3))
NOISY = DESIGN @ [1.0, 2.0, -0.5] + 0.1 * RNG.normal(size=30)
LINE = np.linspace(0, 1, 40)


def linear(design, data):
    """(values, half-widths of 95 %, covariance, sum of squares) of a linear problem by the normal equations."""
    inverse = np.linalg.inv(design.T @ design)
    values = inverse @ design.T @ data
    rest = float(((design @ values - data) ** 2).sum())
    dof = len(data) - design.shape[1]
    covariance = inverse * rest / dof
    return values, student.ppf(0.975, dof) * np.sqrt(np.diag(covariance)), covariance, rest


def test_exact_a_linear_problem_has_the_closed_form_intervals():
    values, half, covariance, rest = linear(DESIGN, NOISY)
    found = Problem(lambda v: DESIGN @ v - NOISY, [-5, -5, -5], [5, 5, 5]).solve()
    assert found.values == pytest.approx(values, abs=1e-9)
    assert found.intervals.ends == pytest.approx(
        np.stack([values - half, values + half], axis=1), abs=1e-9
    )
    scale = np.sqrt(np.diag(covariance))
    assert found.intervals.correlation == pytest.approx(
        covariance / np.outer(scale, scale), abs=1e-8
    )
    assert found.rms == pytest.approx(np.sqrt(rest / 30), rel=1e-12)
    assert found.intervals.sensitivity == pytest.approx(
        10 * np.sqrt((DESIGN**2).mean(axis=0)), rel=1e-8
    )
    assert found.intervals.methods == ("linear",) * 3
    assert found.at_bound == ("",) * 3
    assert found.intervals.unknown.shape == (0, 3)
    assert found.outcome is Outcome.DONE and found.agreed == 3 and describe_fit(found, "abc") == []


@given(st.integers(0, 10_000), st.floats(-3, 3), st.integers(-8, 8))
def test_always_scaling_rows_and_values_changes_nothing(seed, shift, power):
    rng = np.random.default_rng(seed)
    scale = 10.0**power
    design = rng.normal(size=(12, 2))
    data = rng.normal(size=12)
    values, half, *_ = linear(design, data)
    # bounds on both sides of zero, so that no value is searched in logarithms
    low = -np.abs(values) - (20 + shift) * half
    high = np.abs(values) + (20 - shift) * half
    found = Problem(
        lambda v: scale * (design @ (v / scale) - data), scale * low, scale * high
    ).solve()
    assert found.values / scale == pytest.approx(values, abs=1e-6 * half.max())
    assert np.ptp(found.intervals.ends, axis=1) / scale == pytest.approx(2 * half, rel=1e-4)


def test_exact_a_value_pressed_on_its_bound_has_the_profile_of_the_plane():
    """Slope -0.1 by the data, low bound 0.3: the sum of squares is a parabola in the slope, so its profile is known."""
    data = 1.0 - 0.1 * LINE + 0.1 * RNG.normal(size=40)
    design = np.stack([np.ones(40), LINE], axis=1)
    values, _, covariance, rest = linear(design, data)
    free = covariance[1, 1] / (rest / 38)
    pressed = rest + (0.3 - values[1]) ** 2 / free
    end = values[1] + np.sqrt(free * (pressed * (1 + student.ppf(0.975, 38) ** 2 / 38) - rest))
    found = Problem(lambda v: design @ v - data, [0, 0.3], [3, 5]).solve()
    assert found.values[1] == 0.3
    assert found.at_bound == ("", "low")
    assert found.intervals.methods[1] == "profile"
    assert found.values[0] == pytest.approx((data - 0.3 * LINE).mean(), abs=1e-7)
    assert found.intervals.ends[1] == pytest.approx(
        [0.3, end], rel=2e-3
    ) and found.intervals.open_ends[1].tolist() == [True, False]
    assert describe_fit(found, ["a", "b"]) == [
        "b is at its low bound 0.3: widen the range, or try another law"
    ]


def test_exact_the_profile_of_a_bent_value_is_that_of_what_it_stands_for():
    """A constant w = v^3 has the ends mean -+ t s/sqrt(k), so v has their cube roots, which no straight line gives."""
    data = 1.0 + 1.5 * RNG.normal(size=12)
    half = student.ppf(0.975, 11) * data.std(ddof=1) / np.sqrt(12)
    low = data.mean() - half
    high = data.mean() + half
    found = Problem(lambda v: v[0] ** 3 - data, [-4], [4]).solve()
    assert found.intervals.methods == ("profile",)
    assert found.values[0] == pytest.approx(np.cbrt(data.mean()), rel=1e-6)
    assert found.intervals.ends[0] == pytest.approx(np.cbrt([low, high]), rel=2e-3)


def test_exact_two_values_known_by_their_product_are_named():
    truth = 2 * np.sin(3 * LINE) + LINE

    def residual(v):
        return v[0] * v[1] * np.sin(3 * LINE) + v[2] * LINE - truth + 0.0 * v[3]

    found = Problem(residual, [0.1, 0.1, 0, 0], [10, 100, 5, 1]).solve()
    assert found.values[0] * found.values[1] == pytest.approx(2, rel=1e-8) and found.values[
        2
    ] == pytest.approx(1)
    assert np.isnan(found.intervals.ends[[0, 1, 3]]).all() and found.intervals.ends[
        2
    ] == pytest.approx([1, 1])
    assert np.abs(found.intervals.unknown) == pytest.approx(np.array([[1, 1, 0, 0]]), abs=1e-6)
    assert found.intervals.unknown[0, 0] * found.intervals.unknown[0, 1] == pytest.approx(
        -1, abs=1e-6
    )
    product, flat = describe_fit(found, "abcd")
    assert "a and b cannot be determined separately" in product and product.endswith(
        "only their product is known"
    )
    assert flat == "d has no effect on the computed data, so its value is not determined"


def test_exact_a_ratio_is_named_and_the_rest_keeps_its_interval():
    noise = 0.01 * RNG.normal(size=40)
    found = Problem(
        lambda v: v[0] / v[1] * LINE + v[2] - 2 * LINE - 1 - noise, [1, 1, -3], [9, 9, 3]
    ).solve()
    alone = Problem(lambda v: v[0] * LINE + v[1] - 2 * LINE - 1 - noise, [1, -3], [9, 3]).solve()
    assert found.intervals.ends[2] == pytest.approx(alone.intervals.ends[1], rel=2e-2)
    assert "only their ratio is known" in describe_fit(found, "abc")[0]


def test_exact_a_value_that_the_rows_do_not_rule_out_anywhere_has_no_interval():
    data = RNG.normal(size=20)
    found = Problem(lambda v: v[0] - data + 1e-3 * v[1], [-5, 0], [5, 1]).solve()
    alone = Problem(lambda v: v[0] - data + 1e-3 * v[1] * LINE[:20], [-5, 0], [5, 1]).solve()
    assert "cannot be determined separately" in describe_fit(found, "ab")[0]
    assert np.isnan(alone.intervals.ends[1]).all() and alone.intervals.methods[1] == "none"
    assert (
        "b is not determined: its interval of 95 % reaches both ends of its range"
        in describe_fit(alone, "ab")
    )


def test_exact_the_best_of_several_valleys_is_found_from_a_bad_start():
    found = Problem(
        lambda v: np.sin(v[0] * 9 * LINE) - np.sin(13.7 * 9 * LINE / 9), [0.31], [3], start=[0.35]
    ).solve()
    assert found.values[0] == pytest.approx(13.7 / 9, rel=1e-8)


def test_exact_a_wide_positive_range_is_searched_in_logarithms():
    found = Problem(
        lambda v: np.log(v[0]) * np.ones(5) - np.log([2.9e-6, 3e-6, 3.1e-6, 3e-6, 3e-6]),
        [1e-9],
        [1.0],
    ).solve()
    spread = np.log([2.9e-6, 3e-6, 3.1e-6, 3e-6, 3e-6])
    half = student.ppf(0.975, 4) * spread.std(ddof=1) / np.sqrt(5)
    assert np.log(found.values[0]) == pytest.approx(spread.mean(), abs=1e-9)
    assert np.log(found.intervals.ends[0]) == pytest.approx(
        [spread.mean() - half, spread.mean() + half], abs=1e-6
    )
    assert make_space([1.0, 1.0, -1.0], [10.0, 11.0, 1e3]).log.tolist() == [False, True, False]


def test_always_failures_are_counted_and_passed_over():
    def residual(v):
        if v[0] > 2:
            raise PatchfemError("too long")
        return np.full(5, np.nan) if v[0] < 0.5 else v[0] - np.array([1.0, 1.1, 0.9, 1.0, 1.0])

    found = Problem(residual, [0.0], [6.0], start=[5.0]).solve()
    assert found.values[0] == pytest.approx(1, abs=1e-9) and found.counts.failures >= 5
    assert found.counts.reason in ("too long", "the residual is not finite")
    assert (
        f"{found.counts.failures} of {found.counts.evaluations} evaluations failed"
        in describe_fit(found, "a")[-1]
    )


def test_always_a_start_without_neighbours_that_have_values_is_not_converged():
    def residual(v):
        if v[0] > 0.0:
            raise PatchfemError("no value")
        return v[0] - np.array([1.0, 1.1])

    assert Problem(residual, [0.0], [1.0], start=[0.0]).solve().outcome is Outcome.NOT_CONVERGED


def test_refuses_what_cannot_be_fitted():
    with pytest.raises(
        NotConverged, match="failed at all 9 starting points of the search: nothing works"
    ):
        Problem(raising(PatchfemError("nothing works")), [0.0], [1.0], start=[0.5]).solve()
    with pytest.raises(Missing, match="no file"):
        Problem(raising(Missing("no file")), [0.0], [1.0]).solve()
    with pytest.raises(KeyError):
        Problem(raising(KeyError("a fault of ours")), [0.0], [1.0]).solve()
    with pytest.raises(ValueError, match="2 rows of data cannot determine 3 values"):
        Problem(lambda v: v[:2], [0, 0, 0], [1, 1, 1]).solve()
    for low, high in (
        ([1.0], [1.0]),
        ([2.0], [1.0]),
        ([0.0], [np.inf]),
        ([], []),
        ([0.0, 1.0], [1.0]),
        ([np.nan], [1.0]),
    ):
        with pytest.raises(ValueError):
            Problem(lambda v: v, low, high).solve()


def raising(error):
    def residual(v):
        raise error

    return residual


@pytest.mark.slow
def test_exact_intervals_of_a_decay_cover_its_truth_in_19_of_20():
    """2000 intervals of amplitude and rate; the binomial share of 0.95 has a deviation of 0.005."""
    inside = 0
    for seed in range(1000):
        data = np.exp(-3 * LINE) + 0.15 * np.random.default_rng(seed).normal(size=40)
        found = Problem(
            lambda v, data=data: v[0] * np.exp(-v[1] * LINE) - data, [0.01, 0.01], [30, 50]
        ).solve()
        inside += sum(a <= x <= b for (a, b), x in zip(found.intervals.ends, (1.0, 3.0)))
    assert 0.935 < inside / 2000 < 0.965
