"""Bounded least squares compared with linear algebra, closed-form profiles and known solutions."""

import numpy as np
import pytest
from scipy.stats import t as student

from patchfem.core import Missing, NotConverged, Outcome, PatchfemError
from patchfem.identify import Problem, descent, describe_fit
from patchfem.identify.descent import make_search_space

RNG = np.random.default_rng(7)
DESIGN = RNG.normal(size=(30, 3))
NOISY = DESIGN @ [1.0, 2.0, -0.5] + 0.1 * RNG.normal(size=30)
LINE = np.linspace(0, 1, 40)
BOUNDS = [("low", "high")] * 4  # words for the bounds of up to four parameters


def solve_linear(design, data):
    """Return (values, half-widths of 95 %, covariance, sum of squares) of a linear problem by the normal equations."""
    inverse = np.linalg.inv(design.T @ design)
    values = inverse @ design.T @ data
    sum_of_squares = float(((design @ values - data) ** 2).sum())
    dof = len(data) - design.shape[1]
    covariance = inverse * sum_of_squares / dof
    return (
        values,
        student.ppf(0.975, dof) * np.sqrt(np.diag(covariance)),
        covariance,
        sum_of_squares,
    )


def test_exact_linear_fit_has_closed_form_intervals():
    """Values, intervals, correlation and sensitivity of a linear fit agree with the normal equations.

    An error of the model widens the intervals by the shift of the values that the same change of the data causes, also
    those of an exact fit. A parameter whose interval then reaches both bounds is not determined.
    """
    values, half_width, covariance, sum_of_squares = solve_linear(DESIGN, NOISY)
    fit = Problem(lambda v: DESIGN @ v - NOISY, [-5, -5, -5], [5, 5, 5]).solve()
    assert fit.values == pytest.approx(values, abs=1e-9)
    assert fit.intervals.ends == pytest.approx(
        np.stack([values - half_width, values + half_width], axis=1), abs=1e-9
    )
    scale = np.sqrt(np.diag(covariance))
    assert fit.intervals.correlation == pytest.approx(covariance / np.outer(scale, scale), abs=1e-8)
    assert fit.rms == pytest.approx(np.sqrt(sum_of_squares / 30), rel=1e-12)
    assert fit.intervals.sensitivity == pytest.approx(
        10 * np.sqrt((DESIGN**2).mean(axis=0)), rel=1e-8
    )
    assert fit.intervals.methods == ("linear",) * 3
    change = DESIGN[:, 0] ** 2
    shift = np.abs(solve_linear(DESIGN, NOISY + change)[0] - values)
    ends = fit.widen([change], [(-5, 5)] * 3).intervals.ends
    assert np.ptp(ends, axis=1) / 2 == pytest.approx(half_width + shift, abs=1e-8)
    exact = Problem(lambda v: DESIGN @ (v - 1), [-5] * 3, [5] * 3, [1] * 3).solve()
    ends = exact.widen([change], [(-5, 5)] * 3).intervals.ends
    assert exact.rms == 0 and np.ptp(ends, axis=1) / 2 == pytest.approx(shift, abs=1e-8)
    wide = fit.widen([1e3 * change], [(-5, 5)] * 3)
    assert (
        np.isnan(wide.intervals.ends).all() and "both ends" in describe_fit(wide, "abc", BOUNDS)[0]
    )
    assert fit.at_bound == ("",) * 3
    assert fit.intervals.unknown.shape == (0, 3)
    assert (
        fit.outcome is Outcome.DONE and fit.n_best == 3 and describe_fit(fit, "abc", BOUNDS) == []
    )


def test_value_at_bound_has_profile_interval():
    """A value at its bound has the profile interval of the parabola of the sum of squares.

    An error of the model widens it by the shift of the minimum beyond the bound, so that it contains the interval of the
    changed data.
    """
    data = 1.0 - 0.1 * LINE + 0.1 * RNG.normal(size=40)
    design = np.stack([np.ones(40), LINE], axis=1)
    values, _, covariance, sum_of_squares = solve_linear(design, data)
    free = covariance[1, 1] / (sum_of_squares / 38)
    bounded_sum = sum_of_squares + (0.3 - values[1]) ** 2 / free
    upper_end = values[1] + np.sqrt(
        free * (bounded_sum * (1 + student.ppf(0.975, 38) ** 2 / 38) - sum_of_squares)
    )
    fit = Problem(lambda v: design @ v - data, [0, 0.3], [3, 5]).solve()
    assert fit.values[1] == 0.3
    assert fit.at_bound == ("", "low")
    assert fit.intervals.methods[1] == "profile"
    assert fit.values[0] == pytest.approx((data - 0.3 * LINE).mean(), abs=1e-7)
    assert fit.intervals.ends[1] == pytest.approx(
        [0.3, upper_end], rel=2e-3
    ) and fit.intervals.open_ends[1].tolist() == [True, False]
    assert describe_fit(fit, ["a", "b"], [("0", "3"), ("0.3 um", "5 um")]) == [
        "b is at its low bound 0.3 um: widen the range, or try another law"
    ]
    change = 0.02 * np.cos(3 * LINE)
    shift = np.abs(solve_linear(design, data + change)[0] - values)[1]
    widened = fit.widen([change], [(0, 3), (0.3, 5)]).intervals.ends[1]
    assert widened - fit.intervals.ends[1] == pytest.approx([0, shift], rel=1e-4)
    for sign in (-1, 1):
        changed = Problem(
            lambda v, s=sign: design @ v - data + s * change, [0, 0.3], [3, 5]
        ).solve()
        assert changed.intervals.ends[1, 1] <= widened[1]


def test_nonlinear_value_has_transformed_interval():
    """The profile interval of v with w = v^3 is the cube root of the interval of w."""
    data = 1.0 + 1.5 * RNG.normal(size=12)
    half = student.ppf(0.975, 11) * data.std(ddof=1) / np.sqrt(12)
    low = data.mean() - half
    high = data.mean() + half
    fit = Problem(lambda v: v[0] ** 3 - data, [-4], [4]).solve()
    assert fit.intervals.methods == ("profile",)
    assert fit.values[0] == pytest.approx(np.cbrt(data.mean()), rel=1e-6)
    assert fit.intervals.ends[0] == pytest.approx(np.cbrt([low, high]), rel=2e-3)


@pytest.mark.parametrize(
    "power, end", [(1, "only their product is known"), (1.003, "has no effect)")]
)
def test_exact_undetermined_product_is_reported(power, end):
    """Two values that are determined only by a product of powers, and a value without effect, are reported."""
    data = 2 * np.sin(3 * LINE) + LINE

    def residual(v):
        return v[0] * v[1] ** power * np.sin(3 * LINE) + v[2] * LINE - data + 0.0 * v[3]

    fit = Problem(residual, [0.1, 0.1, 0, 0], [10, 100, 5, 1]).solve()
    assert fit.values[0] * fit.values[1] ** power == pytest.approx(2, rel=1e-8)
    assert fit.values[2] == pytest.approx(1)
    assert np.isnan(fit.intervals.ends[[0, 1, 3]]).all() and fit.intervals.ends[2] == pytest.approx(
        [1, 1]
    )
    assert np.abs(fit.intervals.unknown) == pytest.approx(
        np.array([[1, 1 / power, 0, 0]]), abs=1e-6
    )
    assert fit.intervals.unknown[0, 0] * fit.intervals.unknown[0, 1] < 0
    product, flat = describe_fit(fit, "abcd", BOUNDS)
    assert "a and b cannot be determined separately" in product and product.endswith(end)
    assert flat == "d has no effect on the computed data, so its value is not determined"


def test_exact_undetermined_value_has_no_interval():
    """A value that the data do not restrict within its range has no interval and is reported."""
    data = RNG.normal(size=20)
    fit = Problem(lambda v: v[0] - data + 1e-3 * v[1], [-5, 0], [5, 1]).solve()
    second_fit = Problem(lambda v: v[0] - data + 1e-3 * v[1] * LINE[:20], [-5, 0], [5, 1]).solve()
    assert "cannot be determined separately" in describe_fit(fit, "ab", BOUNDS)[0]
    assert (
        np.isnan(second_fit.intervals.ends[1]).all() and second_fit.intervals.methods[1] == "none"
    )
    assert (
        "b is not determined: its interval of 95 % reaches both ends of its range; widen it, or set the value in the scene "
        "and do not fit it" in describe_fit(second_fit, "ab", BOUNDS)
    )


def test_exact_global_minimum_from_poor_start():
    """The global minimum of a residual with several minima is found from a poor start."""
    fit = Problem(
        lambda v: np.sin(v[0] * 9 * LINE) - np.sin(13.7 * 9 * LINE / 9), [0.31], [3], start=[0.35]
    ).solve()
    assert fit.values[0] == pytest.approx(13.7 / 9, rel=1e-8)


def test_exact_wide_positive_range_uses_logarithm():
    """A value with a wide positive range is searched in its logarithm, with the intervals of the logarithm."""
    fit = Problem(
        lambda v: np.log(v[0]) * np.ones(5) - np.log([2.9e-6, 3e-6, 3.1e-6, 3e-6, 3e-6]),
        [1e-9],
        [1.0],
    ).solve()
    spread = np.log([2.9e-6, 3e-6, 3.1e-6, 3e-6, 3e-6])
    half = student.ppf(0.975, 4) * spread.std(ddof=1) / np.sqrt(5)
    assert np.log(fit.values[0]) == pytest.approx(spread.mean(), abs=1e-9)
    assert np.log(fit.intervals.ends[0]) == pytest.approx(
        [spread.mean() - half, spread.mean() + half], abs=1e-6
    )
    assert make_search_space([1.0, 1.0, -1.0], [10.0, 11.0, 1e3]).is_log.tolist() == [
        False,
        True,
        False,
    ]


def test_always_failed_evaluations_are_counted():
    """Failed evaluations are counted and reported, and the fit converges nevertheless."""

    def residual(v):
        if v[0] > 2:
            raise PatchfemError("too long")
        return np.full(5, np.nan) if v[0] < 0.5 else v[0] - np.array([1.0, 1.1, 0.9, 1.0, 1.0])

    fit = Problem(residual, [0.0], [6.0], start=[5.0]).solve()
    assert fit.values[0] == pytest.approx(1, abs=1e-9) and fit.counts.failures >= 5
    assert fit.counts.reason in ("too long", "the residual is not finite")
    assert (
        f"{fit.counts.failures} of {fit.counts.evaluations} evaluations failed"
        in describe_fit(fit, "a", BOUNDS)[-1]
    )


def test_always_isolated_start_is_not_converged():
    """A start whose neighbourhood has no computable residual gives the outcome NOT_CONVERGED."""

    def residual(v):
        if v[0] > 0.0:
            raise PatchfemError("no value")
        return v[0] - np.array([1.0, 1.1])

    assert Problem(residual, [0.0], [1.0], start=[0.0]).solve().outcome is Outcome.NOT_CONVERGED


def test_refuses_unsolvable_fits():
    """Failing residuals, too few rows and invalid bounds raise an error with the reason."""
    with pytest.raises(
        NotConverged, match="failed at all 9 starting points of the search: nothing works"
    ):
        Problem(
            make_failing_residual(PatchfemError("nothing works")), [0.0], [1.0], start=[0.5]
        ).solve()
    with pytest.raises(Missing, match="no file"):
        Problem(make_failing_residual(Missing("no file")), [0.0], [1.0]).solve()
    with pytest.raises(KeyError):
        Problem(make_failing_residual(KeyError("a fault of ours")), [0.0], [1.0]).solve()
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


def make_failing_residual(error):
    """Return a residual function that raises an error."""

    def residual(v):
        raise error

    return residual


def test_exact_counts_contain_every_evaluation():
    """The counts of a search contain its last descent and its failures, and those of an earlier search if asked.

    Once the evaluations of the last descent, and those of the search by the quasi-static curve, were lost.
    """
    calls = []

    def residual(values):
        calls.append(values)
        if values[0] > 4:
            raise PatchfemError("too large")
        return DESIGN @ values - NOISY

    bounds = ([-5] * 3, [5] * 3)
    first = Problem(residual, *bounds).search(4)
    second = Problem(residual, *bounds, first).solve(1)
    assert second.counts.evaluations == len(calls)
    assert second.n_best == first.n_best == 4
    assert second.counts.failures == sum(values[0] > 4 for values in calls) > 0
    assert second.counts.reason == "too large"


def test_exact_descent_begins_at_bound_beside_failures():
    """A descent from a bound finds its minimum where the model fails a thousandth of the range inside."""

    def residual(values):
        return np.where(values > 5e-4, np.nan, values - 2e-4)

    model = descent.UnitCubeResidual(residual, make_search_space([0.0], [1.0]))
    found = descent.descend(model, [0.0])
    assert found.is_converged and found.u == pytest.approx([2e-4], abs=1e-9)


@pytest.mark.parametrize("seed", [4, 9])
def test_always_profile_with_several_minima_has_ends(seed):
    """A descent that ends in another minimum than before at the same value of a parameter does not end the search."""
    random = np.random.default_rng(seed)
    slopes, phases = 3 * random.normal(size=(6, 3)), random.uniform(0, 6, 6)
    data = 0.3 * random.normal(size=6)
    fit = Problem(lambda v: np.sin(slopes @ v + phases) - data, [-1] * 3, [1] * 3).solve()
    low, high = fit.intervals.ends.T
    assert "profile" in fit.intervals.methods
    assert not (fit.values < low).any() and not (fit.values > high).any()
