"""Robust fit of the place and the datum of a second surface to the heights that did not wear."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ...core import max_abs
from .depth_map import UNWORN_LIMIT_DEVIATIONS
from .model import Model
from .statistics import (
    MIN_DIVISOR,
    UNWORN_VARIANCE_RATIO,
    estimate_one_sided_scale,
    solve_biweight_step,
)

MIN_UNWORN_HEIGHTS = 50  # smallest number of heights that are not worn


@dataclass(frozen=True, eq=False)
class Fit:
    """Depths of a second surface, placed on the first one.

    - state (k,): parameters of the model.
    - free (j,): indices of the parameters that were fitted.
    - depth (n,): [m].
    - noise (n,): standard deviation of an unworn depth [m].
    - unworn, worn, grown (n,): masks of the heights.
    - jacobian (n, j): derivative of the depth by each fitted parameter.
    """

    state: np.ndarray
    free: list[int]
    depth: np.ndarray
    noise: np.ndarray
    unworn: np.ndarray
    worn: np.ndarray
    grown: np.ndarray
    jacobian: np.ndarray

    @property
    def n_changed(self) -> int:
        """Number of worn and grown heights."""
        return int((self.worn | self.grown).sum())

    @property
    def errors(self) -> np.ndarray:
        """Standard deviations (j,) of the fitted parameters that the noise of the unworn heights gives."""
        weighted = self.jacobian[self.unworn] / self.noise[self.unworn, None]
        scale = np.sqrt((weighted**2).mean(axis=0)) + MIN_DIVISOR
        weighted = weighted / scale
        return np.sqrt(np.diag(np.linalg.pinv(weighted.T @ weighted, rcond=1e-10))) / scale


def fit_unworn(model: Model, state, free: list[int], digit: float) -> Fit:
    """Fit parameters to the unworn heights; fits alternate with the choice of the heights that count as worn.

    Parameters
    ----------
    model : Model
        Common points of both surfaces.
    state : (k,) array
        Parameters of the model at the start.
    free : list of int
        Indices of the fitted parameters.
    digit : float
        Standard deviation [m] due to the printed digits of the heights; the noise is at least this.

    Returns
    -------
    Fit
    """
    fit = None
    worn = np.zeros(int(model.known.sum()), bool)
    # Number of alternations between the fit and the choice of the worn heights
    for _ in range(6):
        # Number of biweight steps in a cycle
        for _ in range(15):
            depth = model.compute_depth(state)
            sigma = max(estimate_one_sided_scale(depth[~worn]), digit)
            jacobian = model.compute_jacobian(state)[:, free]
            change = solve_biweight_step(depth, jacobian, sigma, worn)
            state = state.copy()
            state[free] += change
            # Change of the depths, in standard deviations, below which the steps have converged.
            if max_abs(jacobian @ change) < 1e-3 * sigma:
                break
        fit = evaluate(model, state, free, digit, worn)
        if (fit.worn == worn).all() or (~fit.worn).sum() < MIN_UNWORN_HEIGHTS:
            break
        worn = fit.worn
    return fit


def evaluate(model: Model, state, free: list[int], digit: float, worn=None) -> Fit:
    """Return the depths at a state, their noise, and the changed heights.

    Parameters
    ----------
    model : Model
        Common points of both surfaces.
    state : (k,) array
        Place, datum and gain, in the order of `Model`.
    free : list of int
        Indices of the fitted parameters.
    digit : float
        Smallest standard deviation of a depth [m].
    worn : (n,) bool array, optional
        Heights that are known to be worn before.

    Returns
    -------
    Fit
    """
    depth = model.compute_depth(state)
    worn = np.zeros(depth.size, bool) if worn is None else worn
    sigma = max(estimate_one_sided_scale(depth[~worn]), digit)
    jacobian = model.compute_jacobian(state)
    noise = estimate_noise(depth, model.compute_noise_terms(state, jacobian), sigma, worn)
    worn = model.find_worn(depth, noise)
    unworn = (np.abs(depth) < UNWORN_LIMIT_DEVIATIONS * noise) & ~worn
    grown = model.find_changed(-depth, noise) & ~worn
    return Fit(state, free, depth, noise, unworn, worn, grown, jacobian[:, free])


def estimate_noise(depth, terms, sigma: float, worn) -> np.ndarray:
    """Estimate the standard deviation (n,) of unworn depths, whose variance is a sum of given terms.

    The factors of the terms are those of non-negative least squares. A height on a slope has an error of its position,
    one at a kink an error of interpolation.

    Parameters
    ----------
    depth : (n,) array [m]
        Depths below the datum.
    terms : (n, j) array
        Terms of the variance, the first one constant.
    sigma : float
        Scale of all depths [m].
    worn : (n,) bool array
        Depths that do not count.

    Returns
    -------
    (n,) array
        Standard deviation of each depth [m], also of worn ones.
    """
    noise = np.full(depth.size, sigma)
    for _ in range(4):
        use = ~worn & (np.abs(depth) < UNWORN_LIMIT_DEVIATIONS * noise)
        if use.sum() < MIN_UNWORN_HEIGHTS:
            break
        weight = 1 / noise[use] ** 2
        scale = terms[use].max(axis=0) + MIN_DIVISOR
        variance = depth[use] ** 2 / UNWORN_VARIANCE_RATIO
        factors = (
            solve_non_negative(terms[use] / scale * weight[:, None], variance * weight) / scale
        )
        # Smallest noise of a height relative to the scale of all of them; a fit of the noise to the
        # slopes may go below.
        noise = np.sqrt(np.maximum(terms @ factors, (0.3 * sigma) ** 2))
    return noise


def solve_non_negative(columns, values) -> np.ndarray:
    """Solve a linear least-squares problem with non-negative factors, for few columns.

    The solution is that of least squares for some subset of the columns, so all subsets are tried. The function of SciPy
    would import the whole of scipy.optimize, which takes longer than the comparison of two traces.

    Parameters
    ----------
    columns : (n, k) array
        Functions that are combined, with k of at most about 5.
    values : (n,) array
        Values that the combination fits.

    Returns
    -------
    (k,) array
        Factors, at least 0.
    """
    normal = columns.T @ columns
    right = columns.T @ values
    best = np.zeros(len(right))
    lowest = 0.0
    for size in range(1, len(right) + 1):
        for subset in combinations(range(len(right)), size):
            chosen = list(subset)
            part = np.linalg.lstsq(normal[np.ix_(chosen, chosen)], right[chosen], rcond=None)[0]
            # Change of half the sum of squared residuals from that of zero factors
            change = -0.5 * float(right[chosen] @ part)
            if (part >= 0).all() and change < lowest:
                lowest = change
                best = np.zeros(len(right))
                best[chosen] = part
    return best
