"""Robust fit of a second surface to those heights of the first one that did not wear.

A model (`model.TraceModel`, `scans.model.ScanModel`) gives the depth of the second surface below the
first one, and its Jacobian, as a function of a few parameters. Least trimmed squares from elemental
subsets of blocks (Rousseeuw and Leroy, Robust Regression and Outlier Detection, 1987) give the starts.
Tukey's biweight gives the efficient estimate (MM estimator; Yohai, Annals of Statistics 15 (1987) 642).
A floor is a surface of the model that many heights of the second surface lie on.
"""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np

from ..profile import robust_deviation
from .model import MIN_HEIGHTS

# Fraction of the heights that least trimmed squares fits; it is small because
# only few heights may be unworn.
TRIMMED_FRACTION = 0.2
MIN_UNWORN = 0.08  # smallest fraction of unworn heights that can serve as a reference surface
# Distance from the floor, in scales, from which on Tukey's biweight is zero; its
# efficiency for normal noise is 95 %.
BIWEIGHT = 4.685
MAX_UNWORN = 2.5  # largest distance of an unworn height from the floor, in scales
MAX_NOISE = 4.0  # largest height of noise in standard deviations; noise is clipped to it
MAX_OUTLIER = 8.0  # height in standard deviations that noise never reaches
# Fraction of the heights of a block in the shortest interval that gives its mode.
SHORTH_FRACTION = 0.3
MAX_SUBSETS = 1200  # largest number of subsets of blocks that are tried, which limits the time
# Largest number of floors; each is sought in the blocks that lie on none of the previous floors.
MAX_FLOORS = 3
# Smallest determinant of the equations of a subset of blocks; below it, the blocks lie too
# close together to define a floor.
MIN_DETERMINANT = 1e-3
N_RANKING_HEIGHTS = 1000  # number of heights whose trimmed squares rank the subsets
SEED = 1985  # seed of the random subsets and of the random traces


class Floor(NamedTuple):
    """Candidate for the unworn reference surface: a fitted model on which many measured heights lie.

    - state: parameters of the model, (k,).
    - scale: standard deviation [m] of the heights on the floor.
    - unworn, grown: fractions of the heights on the floor, and more than five scales above it.
    """

    state: np.ndarray
    scale: float
    unworn: float
    grown: float


class Fit(NamedTuple):
    """Fitted parameters (k,), and standard deviation [m] of the heights about the reference surface."""

    state: np.ndarray
    scale: float


def estimate_scale(depth) -> float:
    """Estimate the standard deviation [m] of noise from the depths of one sign, that with less scatter."""
    sides = depth[depth > 0], -depth[depth < 0]
    return min((robust_deviation(side) for side in sides if side.size > 3), default=0.0)


def solve_weighted(jacobian, depth, weight) -> np.ndarray:
    """Solve weighted least squares for the Gauss-Newton step (k,) of the parameters.

    A combination of parameters that the surface does not determine is not changed.
    """
    size = np.sqrt((jacobian**2).mean(axis=0))
    size = np.where(size > 0, size, 1.0)
    scaled = jacobian / size
    weighted = scaled * weight[:, None]
    normal = weighted.T @ scaled
    return np.linalg.pinv(normal, rcond=1e-10, hermitian=True) @ (weighted.T @ -depth) / size


def concentrate(model, state, free, rounds: int = 12) -> np.ndarray:
    """Improve a starting point by C-steps of least trimmed squares."""
    for _ in range(rounds):
        depth, jacobian = model.linearize(state)
        if depth.size < MIN_HEIGHTS:
            break
        distance = np.abs(depth)
        keep = distance <= np.quantile(distance, TRIMMED_FRACTION)
        step = solve_weighted(jacobian[keep][:, free], depth[keep], np.ones(keep.sum()))
        state = state.copy()
        state[list(free)] += model.limit_step(step, free)
    return state


def fit_biweight(model, state, free, worn=None, rounds: int = 60, max_scale: float = np.inf) -> Fit:
    """Fit the chosen parameters by Tukey's biweight.

    Parameters
    ----------
    model : TraceModel or ScanModel
    state : (k,) array
        Start.
    free : list
        Parameters that are fitted.
    worn : (n,) bool array, optional
        Heights without weight.
    rounds : int
        Largest number of iterations.
    max_scale : float
        Largest scale [m] of the weights, which is otherwise that of the heights.
    """
    for _ in range(rounds):
        depth, jacobian = model.linearize(state)
        kept = np.ones(depth.size, bool) if worn is None else ~worn
        scale = max(min(estimate_scale(depth[kept]), max_scale), model.min_scale)
        weight = np.clip(1 - (depth / (BIWEIGHT * scale)) ** 2, 0, None) ** 2 * kept
        if (weight > 0).sum() < MIN_HEIGHTS:
            break
        step = model.limit_step(solve_weighted(jacobian[:, free], depth, weight), free)
        state = state.copy()
        state[list(free)] += step
        if (np.abs(step) <= 1e-4 * model.tolerances(scale)[list(free)]).all():
            break
    depth, _ = model.linearize(state)
    kept = np.ones(depth.size, bool) if worn is None else ~worn
    return Fit(state, max(estimate_scale(depth[kept]), model.min_scale))


def find_floors(model, state, free, form) -> list:
    """Find the candidate reference surfaces on which heights of the second surface lie.

    Each further floor is sought in the blocks that lie on none of those before it.

    Parameters
    ----------
    model : TraceModel or ScanModel
    state : (k,) array
        Start.
    free : list
        Parameters that are fitted.
    form : list
        Parameters of the datum, which is a polynomial of the place.

    Returns
    -------
    list of Floor
    """
    floors = []
    depth, _ = model.linearize(state)
    remaining_blocks = [block for block in model.blocks(depth.size) if _has_mode(block)]
    rigid = [k for k in free if k in form or k in model.shifts]
    for _ in range(MAX_FLOORS):
        if len(remaining_blocks) < len(form) + 1:
            break
        for start in _find_starts(model, state, form, remaining_blocks):
            trimmed = concentrate(model, start, rigid)
            if model.linearize(trimmed)[0].size < MIN_HEIGHTS:
                continue
            fit = fit_biweight(model, trimmed, free, rounds=20)
            floors.append(_make_floor(model, fit))
            remaining_blocks = _drop_blocks(model, floors[-1], remaining_blocks)
    return floors


def _make_floor(model, fit: Fit) -> Floor:
    """Make the `Floor` of a fit."""
    depth, _ = model.linearize(fit.state)
    unworn = float((np.abs(depth) <= MAX_UNWORN * fit.scale).mean())
    return Floor(fit.state, fit.scale, unworn, float((depth < -2 * MAX_UNWORN * fit.scale).mean()))


def _drop_blocks(model, floor: Floor, blocks: list) -> list:
    """Drop blocks whose mode lies on a reference surface, and those with too few heights for a mode."""
    depth, _ = model.linearize(floor.state)
    kept = []
    for block in blocks:
        part = depth[block[block < depth.size]]
        if _has_mode(part) and abs(estimate_mode(part)) > MAX_UNWORN * floor.scale:
            kept.append(block)
    return kept


def _find_starts(model, state, form, blocks) -> list:
    """Find the parameters (k,) of the two best subsets of blocks, each fitted exactly."""
    depth, jacobian = model.linearize(state)
    centres = np.array([estimate_mode(depth[block]) for block in blocks])
    base = np.array([jacobian[block][:, form].mean(axis=0) for block in blocks])
    subsets = np.array(_choose_subsets(len(blocks), len(form)))
    matrices = base[subsets]
    is_regular = np.abs(np.linalg.det(matrices)) > MIN_DETERMINANT
    if not is_regular.any():
        return []
    shapes = np.linalg.solve(matrices[is_regular], centres[subsets[is_regular]][..., None])[..., 0]
    places = np.concatenate(blocks)
    places = places[:: max(places.size // N_RANKING_HEIGHTS, 1)]
    distance = np.abs(depth[places] - shapes @ jacobian[places][:, form].T)
    kept = max(int(TRIMMED_FRACTION * distance.shape[1]), 4)
    cost = (np.partition(distance, kept - 1, axis=1)[:, :kept] ** 2).mean(axis=1)
    order = np.argsort(cost)
    lines = shapes @ base.T
    near = 10 * np.sqrt(cost[order[0]])
    far = [k for k in order if np.abs(lines[k] - lines[order[0]]).max() > near]
    out = []
    for k in (order[0], *far[:1]):
        start = state.copy()
        start[list(form)] -= shapes[k]
        out.append(start)
    return out


def _choose_subsets(count: int, size: int) -> list:
    """Choose subsets of blocks: all of them, or a random sample if there are too many."""
    if comb(count, size) <= MAX_SUBSETS:
        return list(combinations(range(count), size))
    draw = np.random.default_rng(SEED)
    return [draw.choice(count, size, replace=False) for _ in range(MAX_SUBSETS // 2)]


def _has_mode(values) -> bool:
    """Return whether values are enough for a mode: the shortest interval that holds two of three."""
    return values.size >= 3


def estimate_mode(values) -> float:
    """Estimate the mode by the mean of the shortest interval with 30 % of the values (shorth)."""
    values = np.sort(values)
    kept = max(int(SHORTH_FRACTION * values.size), 2)
    widths = values[kept - 1 :] - values[: values.size - kept + 1]
    first = int(np.argmin(widths))
    return float(values[first : first + kept].mean())
