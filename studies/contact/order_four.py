"""Are Gauss-Lobatto elements of order 4 worth their trouble behind the condensed operator of a patch?

Yes. At an error of 1e-4 in approach, peak pressure and normal stiffness together they take 1/45 to 1/67 of the time of
bilinear elements, where these arrive at all, and 1/4 to 1/25 of the time of three nested bilinear grids extrapolated;
at 1e-5 no bilinear grid of 130 000 cells arrives, extrapolated or not. At 1e-3 they are 5 to 77 times cheaper than
bilinear and 3 to 17 times cheaper than extrapolated grids. Their weights are positive, so contact stays nodal.

The rig pieces (12.7 x 12.7 x 6.35 mm, 152.4 um of WC-Co on Ti-8Al-1Mo-1V, 26 lbf), tilted or crowned. This program is
independent of the package's patch: cells from 1D matrices, interiors condensed, nested dissection, SuperLU, the face
last, for both orders; one family of grids for both, the cheapest grading of a scan for each error. CPU seconds of one
thread for factor, condensing and contact (unknowns of one piece | nodes of its face), AMD EPYC 2.6 GHz, a busy machine:

    error            1e-3                        1e-4                        1e-5
    1e-5 rad   four  0.005 (   804 |  37)        0.046 (  4 740 |  89)       0.284 (21 978 | 189)
           bilinear  0.036 ( 6 348 |  69)        2.07  (191 590 | 391)       none: 6.0e-5 in 2.1 s
       extrapolated  0.064 (10 680 |  89)        0.193 ( 25 944 | 141)       none: 1.0e-5 in 2.3 s
    1e-4 rad   four  0.016 ( 1 632 |  57)        0.044 (  3 926 |  85)       0.327 (24 548 | 205)
           bilinear  0.085 (14 820 | 114)        2.94  (231 684 | 449)       none: 6.5e-5 in 2.9 s
       extrapolated  0.043 ( 7 128 |  81)        0.423 ( 50 344 | 217)       none: 1.3e-5 in 3.1 s
    1e-3 rad   four  0.007 ( 1 134 |  45)        0.039 (  3 744 |  81)       0.201 (16 470 | 173)
           bilinear  0.542 (73 084 | 242)        none: 4.4e-4 in 1.3 s       none
       extrapolated  0.118 (15 912 | 117)        0.631 ( 70 152 | 237)       none: 7.2e-5 in 0.6 s
    1 m        four  0.015 ( 1 722 |  69)        0.043 (  5 304 | 125)       0.740 (44 136 | 349)
           bilinear  0.349 (53 126 | 263)        none: 2.4e-4 in 2.4 s       none
       extrapolated  0.072 (12 000 | 125)        1.063 (108 920 | 389)       none: 2.0e-5 in 3.1 s

Of 0.04 s the factor takes 0.02 to 0.03, forming the compliance of the 85 to 125 face nodes 0.002 to 0.005, contact
0.001; the rest is assembly. Edges of contact are break points here, taken from the truths; finding them takes
further laps, not timed. At 1e-4 rad an edge off by 1e-3 of the contact length changed the stiffness by up to
2e-4, by 1e-2 up to 1e-3, whatever the order; approach and peak kept theirs to 1e-6 and 1e-5.

Run: python studies/contact/order_four.py ["1e-4 rad" ...]      (one case; --full: all four)
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

LENGTH = 12.7e-3  # [m] length and depth of the pieces
HEIGHT = 6.35e-3  # [m] height of each piece
COATING = 152.4e-6  # [m] thickness of the coating
LOAD = 26 * 4.4482216152605 / LENGTH  # [N/m] 26 lbf over 12.7 mm
# Young's modulus [Pa] and Poisson's ratio of sprayed WC-Co and of Ti-8Al-1Mo-1V
LAYERS = ((250e9, 0.24), (121e9, 0.32))


class Case(NamedTuple):
    """Gap [m] as a function of x [m], with converged results.

    The results are the contact interval [m], approach [m], peak pressure [Pa] and normal stiffness
    [Pa].
    """

    gap: Callable[[np.ndarray], np.ndarray]
    interval: tuple[float, float]
    truth: tuple[float, float, float]


LEVELS = (1e-3, 1e-4, 1e-5)
# largest number of elements of a bilinear mesh and of the finest of three nested meshes
MOST_CELLS = 130_000
# reference values by two meshes of order 5 and 4 graded to the edges; they agree within 5e-6 (peak) and 2e-6
CASES = {
    "1e-5 rad": Case(
        lambda x: 1e-5 * x, (-LENGTH / 2, 5.5332036e-3), (6.2530743e-8, 1.9217449e6, 1.437188893e11)
    ),
    "1e-4 rad": Case(
        lambda x: 1e-4 * x,
        (-LENGTH / 2, -3.56429530e-3),
        (-2.3513342e-7, 8.3177169e6, 4.212594086e10),
    ),
    "1e-3 rad": Case(
        lambda x: 1e-3 * x,
        (-LENGTH / 2, -6.04622577e-3),
        (-5.43491040e-6, 6.0844587e7, 1.337656892e10),
    ),
    "crown 1 m": Case(
        lambda x: x**2 / 2,
        (-3.7177189e-4, 3.7177189e-4),
        (2.8687086e-7, 1.46972585e7, 3.66814797e10),
    ),
}


class Grading(NamedTuple):
    """Rule for cell sizes near an edge of the contact.

    A cell at the distance d < R has the size c R (d/R)^exponent, at most c R/2, and c d farther
    away; d is at least `first` R.

    At corners, whose singularities are weaker, c is 1.5 times and `first` is 30 times as large.
    """

    c: float
    exponent: float = 1.0
    first: float = 1e-4


class Run(NamedTuple):
    """Results and cost of a run.

    Results are approach [m], peak pressure [Pa] and stiffness [Pa]; costs are the numbers of
    unknowns and face nodes, and the CPU seconds of the run and of its three steps.
    """

    values: np.ndarray
    unknowns: int
    face: int
    seconds: float
    factor: float
    condense: float
    contact: float


def lobatto(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss-Lobatto points and weights on [-1, 1].

    The points are the ends and the zeros of P'_order; w = 2/(p (p + 1) P_p^2).
    """
    legendre_p = legendre.Legendre.basis(order)
    points = np.concatenate([[-1.0], np.sort(legendre_p.deriv().roots().real), [1.0]])
    return points, 2 / (order * (order + 1) * legendre_p(points) ** 2)


def matrices_1d(order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return mass, stiffness and mixed (phi_i' phi_j) matrices of one cell [-1, 1], integrated exactly."""
    points, _ = lobatto(order)
    gauss, weight = legendre.leggauss(order + 1)
    coefficients = np.linalg.inv(legendre.legvander(points, order))
    value = legendre.legvander(gauss, order) @ coefficients
    slope = np.stack(
        [legendre.legval(gauss, legendre.legder(column)) for column in coefficients.T], axis=1
    )
    return (
        value.T @ (weight[:, None] * value),
        slope.T @ (weight[:, None] * slope),
        slope.T @ (weight[:, None] * value),
    )


def cell_stiffness(order: int, ratio: np.ndarray, young: float, poisson: float) -> np.ndarray:
    """Return the stiffness (cells, 2 m, 2 m) in plane strain of cells; u_x first, then u_y.

    Parameters
    ----------
    order : int
    ratio : (cells,) array
        Height / length.
    young : float
        [Pa]
    poisson : float
    """
    mass, stiff, mixed = matrices_1d(order)
    m = (order + 1) ** 2
    shear = young / (2 * (1 + poisson))
    lame = 2 * shear * poisson / (1 - 2 * poisson)

    def product(along_y: np.ndarray, along_x: np.ndarray) -> np.ndarray:
        return np.einsum("ab,cd->acbd", along_y, along_x).reshape(m, m)

    r = ratio[:, None, None]
    along_x = product(mass, stiff)
    along_y = product(stiff, mass)
    cross = product(mixed.T, mixed)
    cells = np.empty((len(ratio), 2 * m, 2 * m))
    cells[:, :m, :m] = (lame + 2 * shear) * r * along_x + shear / r * along_y
    cells[:, m:, m:] = shear * r * along_x + (lame + 2 * shear) / r * along_y
    cells[:, :m, m:] = lame * cross + shear * cross.T
    cells[:, m:, :m] = cells[0, :m, m:].T
    return cells


def condense_interior(cells: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Condense cells to the nodes on their edges; return the stiffness and the numbers of these nodes (of (order + 1)^2)."""
    row, column = np.divmod(np.arange((order + 1) ** 2), order + 1)
    inside = (row % order != 0) & (column % order != 0)
    keep = np.flatnonzero(~np.tile(inside, 2))
    drop = np.flatnonzero(np.tile(inside, 2))
    out = cells[:, keep[:, None], keep]
    if len(drop):
        mixed = cells[:, drop[:, None], keep]
        out = out - mixed.transpose(0, 2, 1) @ np.linalg.solve(cells[:, drop[:, None], drop], mixed)
    return out, np.flatnonzero(~inside)


def _dissection(
    x0: int, x1: int, y0: int, y1: int, order: int, into: list[tuple[int, int, int, int]]
) -> None:
    """Order the nodes strictly inside a box of cells by nested dissection.

    Separators follow the two halves that they separate.
    """
    if (x1 - x0 <= 1 and y1 - y0 <= 1) or x1 - x0 < 1 or y1 - y0 < 1:
        return
    if x1 - x0 >= y1 - y0:
        middle = (x0 + x1) // 2
        _dissection(x0, middle, y0, y1, order, into)
        _dissection(middle, x1, y0, y1, order, into)
        into.append((middle * order, middle * order + 1, y0 * order + 1, y1 * order))
    else:
        middle = (y0 + y1) // 2
        _dissection(x0, x1, y0, middle, order, into)
        _dissection(x0, x1, middle, y1, order, into)
        into.append((x0 * order + 1, x1 * order, middle * order, middle * order + 1))


def numbering(nx: int, ny: int, order: int) -> tuple[np.ndarray, int]:
    """Return the elimination index of every node, -1 for fixed or condensed nodes, and the number of indices.

    Nested dissection inside, then the free sides, the face y = 0 (row 0) last; the far row is held.

    Parameters
    ----------
    nx, ny : int
        Cells along and across.
    order : int
    """
    place = np.full((ny * order + 1, nx * order + 1), -1)
    boxes: list[tuple[int, int, int, int]] = []
    _dissection(0, nx, 0, ny, order, boxes)
    boxes += [
        (0, 1, 1, ny * order),
        (nx * order, nx * order + 1, 1, ny * order),
        (0, nx * order + 1, 0, 1),
    ]
    count = 0
    for x0, x1, y0, y1 in boxes:
        size = (y1 - y0) * (x1 - x0)
        place[y0:y1, x0:x1] = count + np.arange(size).reshape(y1 - y0, x1 - x0)
        count += size
    return place, count


def face_compliance(
    xs: np.ndarray, ys: np.ndarray, order: int
) -> tuple[np.ndarray, int, float, float]:
    """Return the normal compliance (n, n) [m2/N] of a face, the number of unknowns, and the CPU seconds of both steps.

    Parameters
    ----------
    xs, ys : array
        Break points [m].
    order : int
    """
    nx = len(xs) - 1
    ny = len(ys) - 1
    place, count = numbering(nx, ny, order)
    face = nx * order + 1
    entries = []
    rows = []
    columns = []
    for material, (young, poisson) in enumerate(LAYERS):
        layer = np.flatnonzero((0.5 * (ys[1:] + ys[:-1]) > COATING) == bool(material))
        iy, ix = (grid.ravel() for grid in np.meshgrid(layer, np.arange(nx), indexing="ij"))
        ratio = (ys[iy + 1] - ys[iy]) / (xs[ix + 1] - xs[ix])
        cells, local = condense_interior(cell_stiffness(order, ratio, young, poisson), order)
        node = place[
            iy[:, None] * order + local // (order + 1), ix[:, None] * order + local % (order + 1)
        ]
        # the tangential unknowns of the face precede the normal ones, so that the factor ends with the normal block
        dof_x = np.where(node >= count - face, node + count - face, 2 * node)
        dof_y = np.where(node >= count - face, node + count, 2 * node + 1)
        dof = np.where(np.tile(node, 2) < 0, -1, np.concatenate([dof_x, dof_y], axis=1))
        rows.append(np.broadcast_to(dof[:, :, None], cells.shape).ravel())
        columns.append(np.broadcast_to(dof[:, None, :], cells.shape).ravel())
        entries.append(cells.ravel())
    row = np.concatenate(rows)
    column = np.concatenate(columns)
    entry = np.concatenate(entries)
    free = (row >= 0) & (column >= 0)
    matrix = sparse.csc_array(
        (entry[free], (row[free], column[free])), shape=(2 * count, 2 * count)
    )
    started = time.process_time()
    factor = splu(
        matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    factored = time.process_time()
    assert np.array_equal(factor.perm_c[-face:], np.arange(2 * count - face, 2 * count))
    lower = factor.L[-face:, -face:].toarray()
    upper = factor.U[-face:, -face:].toarray()
    stiffness = lower @ upper
    held = cho_factor(0.5 * (stiffness + stiffness.T), lower=True)
    compliance = cho_solve(held, np.eye(face))
    return compliance, 2 * count, factored - started, time.process_time() - factored


def make_breaks(points: list[tuple[float, float, float]], grading: Grading) -> np.ndarray:
    """Return ascending break points [m] graded to singular points (position, R, factor of the first cell)."""
    places = np.array([point[0] for point in points])
    parts = []
    for a, b in pairwise(places):
        fine = (b - a) * np.concatenate([[0.0], np.geomspace(1e-9, 0.5, 4000)])
        x = np.concatenate([a + fine, (b - fine[-2::-1])])
        size = np.full(len(x), np.inf)
        for place, radius, times in points:
            d = np.maximum(abs(x - place) / radius, grading.first * times)
            wanted = radius * np.where(d < 1, np.minimum(d**grading.exponent, 0.5), d)
            size = np.minimum(size, grading.c * (1.5 if times > 1 else 1.0) * wanted)
        cells = np.concatenate(
            [[0.0], np.cumsum(np.diff(x) * 0.5 * (1 / size[1:] + 1 / size[:-1]))]
        )
        n = max(int(np.ceil(cells[-1])), 1)
        part = np.interp(np.arange(n + 1) / n * cells[-1], cells, x)
        part[0] = a
        part[-1] = b
        parts.append(part[:-1])
    return np.concatenate([*parts, places[-1:]])


def grids(case: Case, grading: Grading) -> tuple[np.ndarray, np.ndarray]:
    """Return break points along the face and in depth, graded to the edges of contact and to the corners."""
    left, right = case.interval
    radius = min(0.5 * (right - left), LENGTH / 4)
    corner = 30.0
    x = [(-LENGTH / 2, COATING, corner)] if left > -LENGTH / 2 else [(left, COATING, corner)]
    x += [(place, radius, 1.0) for place in (left, right) if abs(place) < LENGTH / 2]
    x += [(LENGTH / 2, COATING, corner)]
    y = [(0.0, radius, 1.0), (COATING, COATING, corner), (HEIGHT, HEIGHT, corner)]
    return make_breaks(x, grading), make_breaks(y, grading)


def halve_cells(breaks: np.ndarray) -> np.ndarray:
    """Return the break points of the nested finer grid, in which every cell is halved."""
    out = np.empty(2 * len(breaks) - 1)
    out[::2] = breaks
    out[1::2] = 0.5 * (breaks[1:] + breaks[:-1])
    return out


def face_nodes(xs: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of the face and their lumped Gauss-Lobatto weights [m]."""
    points, weights = lobatto(order)
    h = np.diff(xs)
    x = (0.5 * (xs[:-1] + xs[1:])[:, None] + 0.5 * h[:, None] * points)[:, :-1].ravel()
    weight = np.zeros(len(h) * order + 1)
    for k in range(order + 1):
        weight[k : k + len(h) * order : order][: len(h)] += 0.5 * h * weights[k]
    return np.append(x, xs[-1]), weight


def unilateral(compliance: np.ndarray, gap: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Return nodal forces [N/m], approach [m] and contact set under LOAD.

    Nodes in tension leave the set and overlapping nodes enter it until the set does not change.
    """
    active = np.ones(len(gap), bool)
    for _ in range(100):
        a = np.flatnonzero(active)
        held = cho_factor(compliance[np.ix_(a, a)], lower=True)
        by_gap, by_unit = cho_solve(held, np.stack([gap[a], np.ones(len(a))], axis=1)).T
        approach = (LOAD + by_gap.sum()) / by_unit.sum()
        force = np.zeros(len(gap))
        force[a] = approach * by_unit - by_gap
        opening = gap - approach + compliance @ force
        change = (active & (force < 0)) | (~active & (opening < -1e-12 * abs(gap).max()))
        if not change.any():
            return force, approach, by_unit
        active ^= change
    raise RuntimeError("the contact set does not settle")


def peak(xs: np.ndarray, order: int, pressure: np.ndarray) -> float:
    """Return the largest pressure [Pa].

    It is that of the polynomials of cells in full contact, or of straight lines for bilinear
    elements.
    """
    if order == 1:
        h = np.diff(xs)
        place = xs + (np.append(h, 0.0) - np.insert(h, 0, 0.0)) / 3
        ends = [pressure[i] + (pressure[i] - pressure[j]) * (xs[i] - place[i]) / (place[i] - place[j])
                for i, j in ((0, 1), (-1, -2)) if pressure[i] > 0]  # fmt: skip
        return max(pressure.max(), *ends, 0.0)
    points, _ = lobatto(order)
    fine = legendre.legvander(np.linspace(-1, 1, 41), order) @ np.linalg.inv(
        legendre.legvander(points, order)
    )
    cells = pressure[np.arange(len(xs) - 1)[:, None] * order + np.arange(order + 1)]
    full = (cells > 0).all(axis=1) & (cells.max(axis=1) > 0.9 * pressure.max())
    return max(pressure.max(), (cells[full] @ fine.T).max(initial=0.0))


def solve_pair(case: Case, xs: np.ndarray, ys: np.ndarray, order: int) -> Run:
    """Solve a pair of equal pieces for approach, peak pressure and normal stiffness.

    One piece is condensed, the other is its mirror image.

    Parameters
    ----------
    case : Case
    xs, ys : array
        Break points [m].
    order : int
    """
    clock = time.process_time()
    compliance, unknowns, factor, condense = face_compliance(xs, ys, order)
    x, weight = face_nodes(xs, order)
    contact = time.process_time()
    force, approach, by_unit = unilateral(2 * compliance, case.gap(x))
    ended = time.process_time()
    values = np.array([approach, peak(xs, order, force / weight), by_unit.sum()])
    return Run(values, unknowns, len(x), ended - clock, factor, condense, ended - contact)


def errors(case: Case, values: np.ndarray) -> np.ndarray:
    """Return relative errors of approach, peak and stiffness.

    That of the approach is relative to the larger of the approach and the largest gap inside the
    contact.
    """
    truth = np.array(case.truth)
    scale = abs(truth)
    scale[0] = max(scale[0], abs(case.gap(np.array(case.interval))).max())
    return abs(values - truth) / scale


def extrapolate(runs: list[Run]) -> Run:
    """Return the limit of three nested runs by Aitken's method, and the sum of their costs.

    Runs that do not converge monotonically are extrapolated with second order.
    """
    first = runs[1].values - runs[0].values
    second = runs[2].values - runs[1].values
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = first / second
    even = (ratio > 1.4) & (ratio < 16)
    values = runs[2].values + second / (np.where(even, ratio, 4.0) - 1)
    sums = [
        sum(getattr(run, name) for run in runs)
        for name in ("seconds", "factor", "condense", "contact")
    ]
    return Run(values, runs[2].unknowns, runs[2].face, *sums)


def _fastest_run(case: Case, xs: np.ndarray, ys: np.ndarray, order: int, times: int = 2) -> Run:
    """Return the fastest of several equal runs, because the processor is shared."""
    return min((solve_pair(case, xs, ys, order) for _ in range(times)), key=lambda run: run.seconds)


GRADINGS = {
    "order 4": [Grading(c, e, f) for c in (2.0, 1.4, 1.0, 0.7) for e, f in
                ((0.8, 1e-2), (0.8, 1e-3), (1.0, 1e-3), (1.0, 1e-4), (1.0, 1e-5))],
    "bilinear": [Grading(c, e, f) for c in (0.5, 0.25, 0.125, 0.088, 0.0625) for e, f in
                 ((0.8, 1e-4), (1.0, 1e-3), (1.0, 1e-4))],
    "extrapolated": [Grading(c, e, f) for c in (1.4, 1.0, 0.7, 0.5, 0.35) for e, f in
                     ((0.8, 1e-3), (0.8, 1e-4), (1.0, 1e-3), (1.0, 1e-4))],
}  # fmt: skip


def ladder(case: Case, method: str) -> list[tuple[float, Run]]:
    """Return for every grading of a method the run and the largest relative error of its three measures."""
    out = []
    for grading in GRADINGS[method]:
        xs, ys = grids(case, grading)
        if (len(xs) - 1) * (len(ys) - 1) * {"bilinear": 1, "extrapolated": 16, "order 4": 16}[
            method
        ] > MOST_CELLS:
            continue
        if method == "extrapolated":
            nested = [
                (xs, ys),
                (halve_cells(xs), halve_cells(ys)),
                (halve_cells(halve_cells(xs)), halve_cells(halve_cells(ys))),
            ]
            run = extrapolate([_fastest_run(case, x, y, 1) for x, y in nested])
        else:
            run = _fastest_run(case, xs, ys, *((4, 2) if method == "order 4" else (1, 1)))
        out.append((float(errors(case, run.values).max()), run))
    return out


def cheapest(found: list[tuple[float, Run]], level: float) -> tuple[float, Run] | None:
    """Return the run with the fewest seconds whose error is at most `level`; None if there is none."""
    return min(
        (pair for pair in found if pair[0] <= level), key=lambda pair: pair[1].seconds, default=None
    )


def main(names: tuple[str, ...] = ()) -> list[dict[str, object]]:
    """Print and return a row for each case, level and method.

    A row has unknowns, face nodes, CPU seconds with their shares, and error.
    """
    rows: list[dict[str, object]] = []
    for name in names or tuple(CASES):
        found = {method: ladder(CASES[name], method) for method in GRADINGS}
        for level in LEVELS:
            for method, pairs in found.items():
                pair = cheapest(pairs, level)
                row: dict[str, object] = {"case": name, "level": level, "method": method}
                if pair is None:
                    error, run = min(pairs, key=lambda pair: pair[0])
                    row["best"] = error
                    print(
                        f"{name:10s} {level:.0e} {method:12s} not reached: {error:.1e} in {run.seconds:.2f} s"
                    )
                else:
                    error, run = pair
                    row |= {"error": error, "unknowns": run.unknowns, "face": run.face, "seconds": run.seconds,
                            "factor": run.factor, "condense": run.condense, "contact": run.contact}  # fmt: skip
                    print(f"{name:10s} {level:.0e} {method:12s} {run.unknowns:7d} {run.face:4d} {run.seconds:7.3f} s "
                          f"({run.factor:.3f} {run.condense:.3f} {run.contact:.4f}) {error:.1e}")  # fmt: skip
                rows.append(row)
    return rows


if __name__ == "__main__":
    main(() if "--full" in sys.argv else tuple(sys.argv[1:]) or ("1e-5 rad",))
