"""Drift of a datum: what is taken out of the depth, and whether the drawn errors of a gap are large enough."""

import numpy as np
import pytest

from patchfem.surface.compare.drift import model_drift

COUNT = 2400
PLACE = (np.arange(COUNT) + 0.5) / COUNT
MIDDLE = abs(PLACE - 0.5) < 0.15
END = PLACE > 0.75


def errors_of_gap(gap, walk: float, seeds: range) -> np.ndarray:
    """Return the errors of the mean over a gap, in standard deviations of the drawn errors."""
    errors = []
    for seed in seeds:
        random = np.random.default_rng(seed)
        depth = random.standard_normal(COUNT) + walk * np.cumsum(
            random.standard_normal(COUNT)
        ) / np.sqrt(COUNT)
        model = model_drift(depth, ~gap, 1, 200, random)
        noise = random.standard_normal((200, COUNT))
        drawn = model.remove(noise + model.parts.interpolate(model.draws))
        errors.append(model.remove(depth)[gap].mean() / drawn[:, gap].mean(axis=1).std())
    return np.array(errors)


@pytest.mark.share(1, 2)
@pytest.mark.parametrize(
    ("gap", "walk", "least"),
    [
        pytest.param(MIDDLE, 0.0, 35, id="between"),
        pytest.param(END, 0.0, 35, id="beyond"),
        pytest.param(MIDDLE, 3.0, 35, id="between, with a random walk"),
        pytest.param(END, 3.0, 32, id="beyond, with a random walk"),  # 53 of 60 other walks hold
    ],
)
def test_95_of_100_errors_of_a_gap_lie_within_two_deviations(gap, walk, least):
    errors = errors_of_gap(gap, walk, range(40))
    assert (
        np.abs(errors) <= 1.96
    ).sum() >= least  # fewer than 35 are seen in 1 of 100 tests if 95 % hold
    assert np.abs(errors).mean() > 0.2  # errors that are stated ten times too large are useless


@pytest.mark.parametrize("degree", [1, 2])
def test_datum_is_taken_out_with_the_drift(degree):
    random = np.random.default_rng(1)
    model = model_drift(random.standard_normal(COUNT), ~MIDDLE, degree, 10, random)
    datum = 5.0 - 3.0 * PLACE + (4.0 * PLACE**2 if degree == 2 else 0.0)
    inner = slice(30, -30)  # beyond the middles of the outermost parts the drift stays as it is
    assert np.abs(model.remove(datum)[inner]).max() < 2e-3


def test_too_few_parts_show_no_drift():
    unworn = np.zeros(60, bool)
    unworn[:4] = True
    assert model_drift(np.ones(60), unworn, 1, 10, np.random.default_rng(1)) is None
