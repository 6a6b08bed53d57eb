"""Advice on a further test, compared with the covariance of a linear fit with this test."""

import re

import numpy as np
import pytest

from patchfem.identify import Problem, advise_test

NAMES = ("offset", "slope")


def fit_line(places, values):
    """Return the fit of a straight line to values at places."""
    design = np.stack([np.ones(places.size), places], axis=1)
    return design, Problem(lambda v: design @ v - values, [-9, -9], [9, 9]).solve()


def test_exact_gain_of_repeated_rows_of_a_line():
    """The gain of each repeated row is that of the covariance with this row, and the best row is named."""
    rng = np.random.default_rng(4)
    places = np.array([0.0, 0.5, 1.0, 1.5, 4.0])
    design, fit = fit_line(places, 2 + 0.1 * places + 0.1 * rng.normal(size=5))
    effects = fit.intervals.effects
    information = np.einsum("ij,ik->ijk", effects, effects)
    words = [f"at {place:g} m" for place in places]
    sentence = advise_test(fit, NAMES, information, words)

    # the slope has the wider interval relative to its value
    before = np.linalg.inv(design.T @ design)[1, 1]
    gains = []
    for row in design:
        after = np.linalg.inv(design.T @ design + np.outer(row, row))[1, 1]
        gains.append(1 - np.sqrt(after / before))
    best = int(np.argmax(gains))
    assert re.fullmatch(
        rf"a further measurement at {places[best]:g} m would narrow the interval of slope most, by about "
        rf"{100 * gains[best]:.0f} %",
        sentence,
    )


@pytest.mark.parametrize("count", [0, 1])
def test_no_advice_without_tests_or_with_a_small_gain(count):
    """No test is advised if there is none, or if its gain is small."""
    _, fit = fit_line(np.linspace(0, 1, 9), np.linspace(1, 2, 9) + 1e-3 * np.arange(9) % 2)
    assert advise_test(fit, NAMES, 1e-3 * np.ones((count, 2, 2)), ["here"] * count) == ""
