"""Robust fit of a model of the second surface to the heights that did not wear.

The model gives the depth of the second surface below the first one as a function of a few
parameters, and its Jacobian. Least trimmed squares (Rousseeuw and Leroy, Robust Regression and
Outlier Detection, 1987) from elemental subsets of blocks gives starts; Tukey's biweight about the
floor of the start gives the efficient estimate (MM estimator; Yohai, Annals of Statistics 15
(1987) 642).
"""

from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np

# fraction of the heights that least trimmed squares fits; the unworn ones may be few
COVERAGE = 0.2
MIN_UNWORN = 0.08  # smallest fraction of unworn heights that can serve as a reference surface
BIWEIGHT = 4.685  # scales beyond which a height has no weight: 95 % efficient for normal noise
REACH = 2.5  # scales within which a height counts as unworn
MODE = 0.3  # fraction of a block that the shortest interval about its mode holds
MAX_SUBSETS = 1200  # elemental subsets of blocks that are tried
MAX_FLOORS = 3  # floors that are sought, each in the blocks that lie on none before it
# determinant of an elemental subset, below which its blocks lie too close together
MIN_DETERMINANT = 1e-3
N_TRIED = 1000  # heights that a start is judged by
SEED = 1985


class Floor(NamedTuple):
    """A floor that the model was fitted to.

    state: parameters (k,) of the model; scale [m]: standard deviation of the heights on the floor;
    unworn, grown: fraction of the heights on it, and clearly above it.
    """

    state: np.ndarray
    scale: float
    unworn: float
    grown: float


class Fit(NamedTuple):
    """State (k,) of a fit, and standard deviation [m] of the heights on its floor."""

    state: np.ndarray
    scale: float


def scale_about_zero(depth) -> float:
    """Estimate the standard deviation of noise about zero from the side that changed less [m]."""
    sides = depth[depth > 0], -depth[depth < 0]
    medians = [float(np.median(side)) for side in sides if side.size > 3]
    return 1.4826 * min(medians, default=0.0)


def solve_weighted(jacobian, depth, weight) -> np.ndarray:
    """Solve weighted least squares for the parameter step (k,) that reduces the depth (n,) to noise.

    Columns are scaled; a direction that the surface does not determine stays as it is.
    """
    size = np.sqrt((jacobian**2).mean(axis=0))
    size = np.where(size > 0, size, 1.0)
    scaled = jacobian / size
    weighted = scaled * weight[:, None]
    normal = weighted.T @ scaled
    return np.linalg.pinv(normal, rcond=1e-10, hermitian=True) @ (weighted.T @ -depth) / size


def trim(model, state, free, rounds: int = 12) -> np.ndarray:
    """Concentrate a start on the heights that fit best (C-steps of least trimmed squares)."""
    for _ in range(rounds):
        depth, jacobian = model.linearize(state)
        off = np.abs(depth)
        keep = off <= np.quantile(off, COVERAGE)
        step = solve_weighted(jacobian[keep][:, free], depth[keep], np.ones(keep.sum()))
        state = state.copy()
        state[list(free)] += model.limit(step, free)
    return state


def fit_biweight(model, state, free, worn=None, rounds: int = 60, max_scale: float = np.inf) -> Fit:
    """Fit by Tukey's biweight from a state.

    Heights (n,) bool that are known as worn have no weight. The scale [m] of the weights is that of the
    heights, at most `max_scale`.
    """
    for _ in range(rounds):
        depth, jacobian = model.linearize(state)
        kept = np.ones(depth.size, bool) if worn is None else ~worn
        scale = max(min(scale_about_zero(depth[kept]), max_scale), model.least)
        weight = np.clip(1 - (depth / (BIWEIGHT * scale)) ** 2, 0, None) ** 2 * kept
        if (weight > 0).sum() < 12:
            break
        step = model.limit(solve_weighted(jacobian[:, free], depth, weight), free)
        state = state.copy()
        state[list(free)] += step
        if (np.abs(step) <= 1e-4 * model.tolerances(scale)[list(free)]).all():
            break
    depth, _ = model.linearize(state)
    kept = np.ones(depth.size, bool) if worn is None else ~worn
    return Fit(state, max(scale_about_zero(depth[kept]), model.least))


def find_floors(model, state, free, form) -> list:
    """Find floors that heights of the second surface lie on.

    Each further floor is sought in the blocks that lie on none of those before it.

    Parameters
    ----------
    model : TraceModel or the like
    state : (k,) array
        State to start from.
    free : list
        Parameters of the fit.
    form : list
        Parameters whose columns are polynomials of the place.

    Returns
    -------
    list of Floor
    """
    floors = []
    depth, _ = model.linearize(state)
    left = model.blocks(depth.size)
    rigid = [k for k in free if k in form or k in model.shifts]
    for _ in range(MAX_FLOORS):
        if len(left) < len(form) + 1:
            break
        for start in _elemental(model, state, form, left):
            fit = fit_biweight(model, trim(model, start, rigid), free, rounds=20)
            floors.append(_describe(model, fit))
        left = [
            block for block in left if not any(_lies_on(model, floor, block) for floor in floors)
        ]
    return floors


def _describe(model, fit: Fit) -> Floor:
    """Describe the floor of a fit."""
    depth, _ = model.linearize(fit.state)
    unworn = float((np.abs(depth) <= REACH * fit.scale).mean())
    return Floor(fit.state, fit.scale, unworn, float((depth < -2 * REACH * fit.scale).mean()))


def _lies_on(model, floor: Floor, block) -> bool:
    """Whether the mode of a block lies on a floor."""
    depth, _ = model.linearize(floor.state)
    part = depth[block[block < depth.size]]
    return part.size < 3 or abs(mode_of(part)) <= REACH * floor.scale


def _elemental(model, state, form, blocks) -> list:
    """Parameter vectors of the best elemental subsets (exact fits to a few blocks) by trimmed squares."""
    depth, jacobian = model.linearize(state)
    centres = np.array([mode_of(depth[block]) for block in blocks])
    base = np.array([jacobian[block][:, form].mean(axis=0) for block in blocks])
    subsets = np.array(_subsets(len(blocks), len(form)))
    matrices = base[subsets]
    good = np.abs(np.linalg.det(matrices)) > MIN_DETERMINANT
    if not good.any():
        return []
    shapes = np.linalg.solve(matrices[good], centres[subsets[good]][..., None])[..., 0]
    places = np.concatenate(blocks)
    places = places[:: max(places.size // N_TRIED, 1)]
    off = np.abs(depth[places] - shapes @ jacobian[places][:, form].T)
    kept = max(int(COVERAGE * off.shape[1]), 4)
    cost = (np.partition(off, kept - 1, axis=1)[:, :kept] ** 2).mean(axis=1)
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


def _subsets(count: int, size: int) -> list:
    """Subsets of blocks: all of them, or a random draw where there are too many."""
    if comb(count, size) <= MAX_SUBSETS:
        return list(combinations(range(count), size))
    draw = np.random.default_rng(SEED)
    return [draw.choice(count, size, replace=False) for _ in range(MAX_SUBSETS // 2)]


def mode_of(values) -> float:
    """Return the mean of the shortest interval that holds 30 % of the values (shorth)."""
    values = np.sort(values)
    kept = max(int(MODE * values.size), 2)
    widths = values[kept - 1 :] - values[: values.size - kept + 1]
    first = int(np.argmin(widths))
    return float(values[first : first + kept].mean())
