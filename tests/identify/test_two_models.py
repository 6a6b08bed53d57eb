"""Least squares of an expensive model with the help of a cheap model, compared with the expensive model alone."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.identify import Problem, TwoModels
from patchfem.identify.space import make_search_space

X = np.linspace(0.1, 3.0, 30)
# no values of the models fit the data exactly
DATA = np.array([np.exp(-X) + 0.3 * np.sin(3 * X), 0.5 * X])
BOX = make_search_space([0.1, 0.1], [5.0, 5.0])
PROBLEM = Problem(None, BOX.low, BOX.high, start=[4.0, 0.2])


def expensive_model(values) -> np.ndarray:
    """Return the values of the expensive model."""
    a, b = values
    return np.array([np.exp(-a * X) * (1 + 0.3 * b * X), b * X / (1 + a * X)])


def cheap_model(values) -> np.ndarray:
    """Return the values of the cheap model."""
    a, b = values
    return np.array([np.exp(-a * X), b * X])


def residuals(values) -> np.ndarray:
    """Return the residuals (n,) of model values."""
    return (values - DATA).ravel()


def test_exact_two_models_reach_expensive_minimum():
    """The search with both models reaches the minimum of the expensive model within 2e-4.

    A correction by ratios alone, without slopes, ends 1 % higher.
    """
    best_fit = Problem(lambda values: residuals(expensive_model(values)), BOX.low, BOX.high).solve(
        max_descents=4, interval_kind=""
    )
    found = TwoModels(cheap_model, expensive_model, residuals, PROBLEM).search(4)
    model, values = found.model, found.values
    assert np.square(residuals(expensive_model(values))).sum() == pytest.approx(
        best_fit.rms**2 * DATA.size, rel=2e-4
    )
    np.testing.assert_allclose(model(values), expensive_model(values), rtol=1e-12)
    values = best_fit.values
    for _ in range(8):
        ratio = expensive_model(values) / cheap_model(values)
        scaled = Problem(
            lambda v, ratio=ratio: residuals(ratio * cheap_model(v)), BOX.low, BOX.high, values
        )
        values = scaled.solve(1, "").values
    assert (
        np.square(residuals(expensive_model(values))).sum() > 1.01 * best_fit.rms**2 * DATA.size
    )


def test_refuses_failing_expensive_model():
    """An expensive model that fails everywhere raises its error."""

    def failing(values):
        raise PatchfemError("no motion")

    with pytest.raises(PatchfemError, match="no motion"):
        TwoModels(cheap_model, failing, residuals, PROBLEM).search(2)
