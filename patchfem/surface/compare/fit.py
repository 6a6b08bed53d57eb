"""Robust fit of the place and the datum of a second surface to the heights that did not wear.

The same steps serve traces and scans: a model gives depths, their derivatives and the tests that
find changed heights.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .statistics import (
    TINY,
    TRUNCATED_VARIANCE,
    UNWORN_LIMIT,
    estimate_one_sided_scale,
    solve_biweight_step,
)

MAX_CYCLES = 6  # number of alternations between the fit and the choice of the worn heights
MAX_STEPS = 15  # number of biweight steps in a cycle
STEP_TOL = (
    1e-3  # change of the depths, in standard deviations, below which the steps have converged
)
MIN_UNWORN = 50  # smallest number of heights that are not worn
# Smallest noise of a height relative to the scale of all of them; a fit of the noise to the slopes may go below.
MIN_NOISE_FRACTION = 0.3


class Model(Protocol):
    """Depths (n,) of the second surface below the first one, as a function of a state (k,)."""

    def compute_depth(self, state) -> np.ndarray:
        """Return the depth (n,) [m]."""

    def compute_jacobian(self, state) -> np.ndarray:
        """Return the derivative (n, k) of the depth by the state."""

    def compute_noise_terms(self, jacobian) -> np.ndarray:
        """Return the terms (n, j) whose combination with positive factors is the variance of a depth."""

    def find_changed(self, depth, noise) -> np.ndarray:
        """Return the heights (n,) bool that noise does not explain, of one sign."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Depths of a second surface, placed on the first one.

    - state: parameters of the model, of which the first `n_free` were fitted.
    - depth, noise: (n,) [m], the noise as standard deviation of an unworn depth.
    - unworn, worn, grown: masks (n,).
    - jacobian: derivative (n, n_free) of the depth by each fitted parameter.
    """

    state: np.ndarray
    depth: np.ndarray
    noise: np.ndarray
    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    jacobian: np.ndarray


def fit_unworn(model: Model, state, free, digit: float) -> Fit:
    """Fit the free parameters to the unworn heights, alternating with the choice of the worn ones.

    Parameters
    ----------
    model : Model
    state : (k,) array
        Start.
    free : slice
        Fitted parameters.
    digit : float
        Standard deviation [m] due to the printed digits of the heights; the noise is at least this.
    """
    worn = np.zeros(model.compute_depth(state).size, bool)
    for _ in range(MAX_CYCLES):
        for _ in range(MAX_STEPS):
            depth = model.compute_depth(state)
            sigma = max(estimate_one_sided_scale(depth[~worn]), digit)
            jacobian = model.compute_jacobian(state)[:, free]
            change = solve_biweight_step(depth, jacobian, sigma, worn)
            state = state.copy()
            state[free] += change
            if np.abs(jacobian @ change).max() < STEP_TOL * sigma:
                break
        depth = model.compute_depth(state)
        sigma = max(estimate_one_sided_scale(depth[~worn]), digit)
        jacobian = model.compute_jacobian(state)
        noise = estimate_noise(depth, model.compute_noise_terms(jacobian), sigma, worn)
        earlier = worn
        worn = model.find_changed(depth, noise)
        if (earlier == worn).all() or (~worn).sum() < MIN_UNWORN:
            break
    unworn = (np.abs(depth) < UNWORN_LIMIT * noise) & ~worn
    grown = model.find_changed(-depth, noise) & ~worn
    return Fit(state, depth, noise, unworn, worn, grown, jacobian[:, free])


def estimate_noise(depth, terms, sigma: float, worn) -> np.ndarray:
    """Estimate the standard deviation (n,) of unworn depths as positive factors times some terms.

    A height on a slope has an error of its position, one at a kink an error of interpolation.

    Parameters
    ----------
    depth : (n,) array [m]
    terms : (n, j) array
        Terms of the variance, the first one constant.
    sigma : float
        Scale of all depths [m].
    worn : (n,) bool array
        Depths that do not count.
    """
    from scipy.optimize import nnls

    noise = np.full(depth.size, sigma)
    for _ in range(4):
        use = ~worn & (np.abs(depth) < UNWORN_LIMIT * noise)
        if use.sum() < MIN_UNWORN:
            break
        weight = 1 / noise[use] ** 2
        scale = terms[use].max(axis=0) + TINY
        variance = depth[use] ** 2 / TRUNCATED_VARIANCE
        factors = nnls(terms[use] / scale * weight[:, None], variance * weight)[0] / scale
        noise = np.sqrt(np.maximum(terms @ factors, (MIN_NOISE_FRACTION * sigma) ** 2))
    return noise
