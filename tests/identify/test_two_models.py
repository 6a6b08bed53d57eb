"""Least squares of a dear model by a cheap one, against the descent by the dear one alone."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.identify import Problem, TwoModels
from patchfem.identify.space import make_space

X = np.linspace(0.1, 3.0, 30)
# no values of the models below leave nothing over
DATA = np.array([np.exp(-X) + 0.3 * np.sin(3 * X), 0.5 * X])
BOX = make_space([0.1, 0.1], [5.0, 5.0])


def dear(values) -> np.ndarray:
    a, b = values
    return np.array([np.exp(-a * X) * (1 + 0.3 * b * X), b * X / (1 + a * X)])


def cheap(values) -> np.ndarray:
    a, b = values
    return np.array([np.exp(-a * X), b * X])


def off(one) -> np.ndarray:
    return (one - DATA).ravel()


def test_exact_the_least_squares_are_those_of_the_expensive_model():
    """With much left over; the share alone, without slopes, ends 1 % above."""
    best = Problem(lambda values: off(dear(values)), BOX.low, BOX.high).solve(
        max_descents=4, interval_kind=""
    )
    models = TwoModels(cheap, dear, off, BOX)
    model, values = models.search([4.0, 0.2], 4)
    assert np.square(off(dear(values))).sum() == pytest.approx(best.rms**2 * DATA.size, rel=2e-4)
    np.testing.assert_allclose(model(values), dear(values), rtol=1e-12)
    u = BOX.unit(best.values)
    for _ in range(8):
        u = models._descend(models.correct_cheap_model(u, dear(BOX.values(u))), u)
    assert np.square(off(dear(BOX.values(u)))).sum() > 1.01 * best.rms**2 * DATA.size


def test_refuses_an_expensive_model_that_fails_everywhere():
    def failing(values):
        raise PatchfemError("no motion")

    with pytest.raises(PatchfemError, match="no motion"):
        TwoModels(cheap, failing, off, BOX).search([1.0, 1.0], 2)
