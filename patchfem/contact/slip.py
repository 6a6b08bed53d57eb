"""Partial slip of the patch under one rigid slide q of the holders: the pieces' shear compliance made cheap.

Point i feels the local slide q - sum_j C_ij f_j. Two reductions, both of the contact set only:

* Points that yield at a fixed force D_i (Coulomb, elastic-plastic at constant load and tilt) are together exactly a
  set of parallel Jenkins elements, because the inverse of C has off-diagonals <= 0 and row sums > 0, so slip zones
  only grow within a stroke (Masing). A node with a negative row sum (free corner of bilinear cells) would carry the
  wrong sign; it is left out, its small yield force goes to its neighbour, and the result says so.
* Points with a memory law share the modes of D^1/2 C D^1/2, D = mu sigma_n weight: a few carry the resultant.
"""

from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError, frozen_array


@dataclass(frozen=True, eq=False, slots=True)
class JenkinsSet:
    """Parallel elements: stiffness (t,) [N/m], yield slide (t,) [m]; sum stiffness*yield_slide = friction limit.

    points: (a,) nodes of the contact set, limit: (a,) their yield forces [N]; share (a, t) [N/m]: the force of a point
    is share @ stretch for any history. dropped: nodes left out; dropped_share: their part of the friction limit.
    """

    stiffness: np.ndarray
    yield_slide: np.ndarray
    points: np.ndarray
    limit: np.ndarray
    share: np.ndarray
    dropped: int
    dropped_share: float


@dataclass(frozen=True, eq=False, slots=True)
class ShearModes:
    """points: (a,) indices of the contact set; shape: (a, r) slide of a point per unit mode coordinate;
    stiffness: (r,) [N/m] of the coordinates; backbone_error: worst error of the resultant against all modes [1]."""

    points: np.ndarray
    shape: np.ndarray
    stiffness: np.ndarray
    backbone_error: float


def contact_tangential(tangential, limit) -> tuple:
    """(indices, C, D) of the contact set: nodes whose yield force `limit` (m,) [N] is positive, corner nodes with a
    negative row sum of C^-1 left out and their limit given to the nearest kept node; last item their share."""
    index = np.flatnonzero(limit > 0)
    force = limit.copy()
    dropped = []
    while index.size > 1:
        rows = np.linalg.solve(tangential[np.ix_(index, index)], np.ones(index.size))
        bad = np.flatnonzero(rows <= 0)
        if bad.size == 0:
            break
        for i in index[bad]:
            dropped.append(i)
        keep = np.setdiff1d(index, index[bad])
        if keep.size == 0:
            raise PatchfemError("contact.shear: the tangential compliance has no node with a positive row sum")
        for i in index[bad]:
            force[keep[np.argmin(np.abs(keep - i))]] += force[i]
            force[i] = 0.0
        index = keep
    share = float(limit[dropped].sum() / limit.sum()) if dropped else 0.0
    return index, tangential[np.ix_(index, index)], force[index], len(dropped), share


def jenkins_set(tangential: np.ndarray, limit: np.ndarray, local_length: float = 0.0) -> JenkinsSet:
    """Exact parallel elements of points that yield at `limit` (m,) [N] behind the compliance (m, m) [m/N].

    `local_length` [m]: bond length of the elastic-plastic law (3.12), local stiffness limit/length in series; 0 for
    Coulomb points. PatchfemError when no point carries load.
    """
    limit = np.asarray(limit, float)
    if not (limit > 0).any():
        raise PatchfemError("contact.shear: no point carries friction")
    points, c, force, dropped, share = contact_tangential(tangential, limit)
    c = c + np.diag(local_length / force)
    inverse = np.linalg.inv(c)
    stick = np.ones(force.size, bool)
    carried = np.zeros(force.size)
    slide, rates, at = 0.0, [], []
    while stick.any():
        rate = inverse.sum(axis=1)
        index = np.flatnonzero(stick)
        wait = (force[index] - carried[index]) / rate
        first = wait.min()
        slide += max(first, 0.0)
        carried[index] += rate * max(first, 0.0)
        going = wait <= first * (1 + 1e-12)
        rates.append(np.zeros(force.size))
        rates[-1][index] = rate
        at.append(slide)
        for local in np.flatnonzero(going)[::-1]:
            column = inverse[:, local]
            rest = np.delete(np.arange(inverse.shape[0]), local)
            inverse = inverse[np.ix_(rest, rest)] - np.outer(column[rest], column[rest]) / column[local]
        carried[index[going]] = force[index[going]]
        stick[index[going]] = False
    drop = -np.diff(np.array([*rates, np.zeros(force.size)]), axis=0).T
    return JenkinsSet(frozen_array(drop.sum(axis=0)), frozen_array(at), frozen_array(points, np.int64),
                      frozen_array(force), frozen_array(drop), dropped, share)


def shear_modes(tangential: np.ndarray, limit: np.ndarray, bond_length: float, count: int,
                weakening: float = 1.0) -> ShearModes:
    """The `count` most compliant modes of D^1/2 C D^1/2 for points whose bonds have the stiffness limit/bond_length.

    tangential (m, m) [m/N], limit D (m,) [N], bond_length [m]; weakening = static over kinetic friction.
    PatchfemError where a weakening contact could jump by itself: lambda_max(k C)(eps_0/eps_k - 1) >= 1.
    """
    index = np.flatnonzero(limit > 0)
    root = np.sqrt(limit[index])
    values, vectors = np.linalg.eigh(root[:, None] * tangential[np.ix_(index, index)] * root)
    values, vectors = values[::-1], vectors[:, ::-1]
    jump = values[0] / bond_length * (weakening - 1)
    if jump >= 1:
        raise PatchfemError(f"contact.shear with friction.kinetic below static: the patch could jump by itself "
                            f"({jump:.3g} >= 1); raise friction.bond_length or friction.kinetic")
    count = min(count, index.size)
    shape = vectors / root[:, None]
    full = _backbone(limit[index], shape, values, bond_length)
    few = _backbone(limit[index], shape[:, :count], values[:count], bond_length)
    error = float(np.abs(full - few).max() / limit.sum())
    return ShearModes(frozen_array(index, np.int64), frozen_array(shape[:, :count]),
                      frozen_array(1 / values[:count]), error)


def _backbone(limit, shape, values, length, steps: int = 24) -> np.ndarray:
    """Resultant [N] on a virgin slide to 6 bond lengths for the saturating law D (1 - exp(-xi/length)), by Newton."""
    b = np.zeros(values.size)
    out = []
    for slide in np.linspace(0, 6 * length, steps + 1)[1:]:
        for _ in range(60):
            xi = slide - shape @ b
            traction = -np.expm1(-xi / length)
            slope = np.exp(-xi / length) / length
            missing = b / values - shape.T @ (limit * traction)
            tangent = np.diag(1 / values) + shape.T @ ((limit * slope)[:, None] * shape)
            step = np.linalg.solve(tangent, missing)
            b = b - step
            if np.abs(step).max() <= 1e-13 * (np.abs(b).max() + 1e-300):
                break
        out.append(limit @ -np.expm1(-(slide - shape @ b) / length))
    return np.array(out)


def tangential_stiffness(tangential: np.ndarray, active: np.ndarray) -> float:
    """dT/d(slide) [N/m] with every node of the contact set sticking; active (m,) bool."""
    index = np.flatnonzero(active)
    return float(np.linalg.solve(tangential[np.ix_(index, index)], np.ones(index.size)).sum())


def normal_stiffness(normal: np.ndarray, active: np.ndarray) -> float:
    """dN/d(approach) [N/m] at fixed rotation and fixed contact set."""
    return tangential_stiffness(normal, active)
