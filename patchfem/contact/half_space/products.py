"""Compliance of the interface at thousands of even points, known by its products with forces alone.

u = H p + V e V^T f: H multiplies each wave cos(n pi x/L) of the pressure by its closed form (`strip_compliance`), two
cosine transforms a product; V e V^T is what the free ends of the pieces change (`end_effect`), a few smooth functions.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, idct

from ...core import NotConverged
from ..edges import End, parabola

SMOOTH = 1e-9  # of the largest of the functions that ends change: those below it are left out
SOLVED = 1e-10  # relative residual of equations on a part of the points
BEHIND = 0.189  # cells by which an edge lies behind where its share puts it; Hertz contact, 24 rows of points, to .001


@dataclass(frozen=True, eq=False, slots=True)
class Products:
    """The compliance of n even cells, their forces at their middles.

    x: (n,) middles [m]; area [m2] of a cell; waves: (n,) [m/Pa] of cos(j pi x/L), j = 0, 1, ...; modes: (n, r) [1],
    sizes: (r,) [m/N] of what the ends change.
    """

    x: np.ndarray
    area: float
    waves: np.ndarray
    modes: np.ndarray
    sizes: np.ndarray

    @property
    def node_compliance(self) -> float:
        """Mean compliance [m/N] of a point under its own force."""
        return float(self.waves.mean()) / self.area

    @property
    def eigenvalue_bound(self) -> float:
        """Bound of the largest eigenvalue [m/N]."""
        return float(self.waves.max()) / self.area + float(
            np.abs(self.sizes) @ (self.modes**2).sum(axis=0)
        )

    def product(self, force: np.ndarray) -> np.ndarray:
        """Displacement (n,) [m] of forces (n,) [N]."""
        return idct(self.waves * dct(force)) / self.area + self.modes @ (
            self.sizes * (force @ self.modes)
        )

    def on(self, active: np.ndarray, motion: np.ndarray, limit: int = 400) -> np.ndarray:
        """Forces (n,) [N] on the points `active` (n,) bool that move them by `motion` (n,) [m].

        Conjugate gradients, each wave of the residual by its own stiffness first. NotConverged after `limit` steps.
        """
        rest = np.where(active, motion, 0.0)
        force, along, size, wanted = (
            np.zeros(rest.size),
            np.zeros(rest.size),
            1.0,
            SOLVED * np.abs(rest).max(),
        )
        for _ in range(limit):
            if np.abs(rest).max() <= wanted:
                return force
            even = np.where(active, idct(dct(rest) / self.waves) * self.area, 0.0)
            last, size = size, float(rest @ even)
            along = even + (size / last if along.any() else 0.0) * along
            moved = np.where(active, self.product(along), 0.0)
            step = size / float(along @ moved)
            force, rest = force + step * along, rest - step * moved
        raise NotConverged(
            f"contact: the iteration did not converge; after {limit} steps the residual is "
            f"{np.abs(rest).max():.1e} m, more than the permitted {wanted:.1e} m"
        )


def smooth_modes(places, change, x) -> tuple:
    """(modes (n, r) [1], sizes (r,) [m2/N]) at x (n,) [m] of a symmetric `change` (k, k) [m2/N] between `places` (k,)
    [m], smooth between them."""
    from scipy.interpolate import CubicSpline

    cells = np.diff(places)
    weight = np.sqrt((np.append(cells, 0.0) + np.append(0.0, cells)) / 2)
    sizes, parts = np.linalg.eigh(weight[:, None] * change * weight)
    some = np.abs(sizes) > SMOOTH * np.abs(sizes).max(initial=0.0)
    return CubicSpline(places, parts[:, some] / weight[:, None])(x), sizes[some]


def ends_of(operator: Products, force, gap, rise) -> list:
    """Ends of the contact between the points, as a list of `contact.edges.End` by rising x.

    force: (n,) [N], gap: (n,) [m] left open; rise: (n,) [N/m] forces on the contact set per approach. A point leaves
    and the next one enters as `contact.edges` has it.
    """
    active, x = force > 0, operator.x
    fall = 1 - operator.product(rise)
    cell, out = x[1] - x[0], []
    for change in np.flatnonzero(active[1:] != active[:-1]):
        node, side = (int(change), 1) if active[change] else (int(change) + 1, -1)
        leave = force[node] / rise[node] if rise[node] > 0 else 0.0
        enter = gap[node + side] / fall[node + side] if fall[node + side] > 0 else 0.0
        share = leave / (leave + enter) if leave + enter > 0 else 0.5
        out.append(End(node, side, float(share), float(x[node] + side * cell * (share - BEHIND))))
    return out


def stiffness_of(operator: Products, active, motion, found: list) -> tuple:
    """(stiffness motion . C^-1 motion of a contact set with ends `found` between its points, its forces (n,)).

    Each end adds its part of the parabola through the set with one point less and one more. By how much a point is
    held by its neighbours is taken from the first end: it is the same at all but the ends of the shortest contacts.
    """
    force = operator.on(active, motion)
    total = float(force @ motion)
    if not found or active.sum() < 3:
        return total, force
    lack = motion - operator.product(force)
    first = max(found, key=lambda end: _long(active, end))
    unit = np.arange(motion.size) == first.node
    less = operator.on(active, unit.astype(float))[first.node]
    column = operator.product((np.arange(motion.size) == first.node + first.side).astype(float))
    more = column[first.node + first.side] - float(operator.on(active, column) @ column)
    for end in found:
        total += parabola(
            end.share - 0.5, lack[end.node + end.side] ** 2 / more, force[end.node] ** 2 / less
        )
    return total, force


def _long(active, end: End) -> int:
    """Points of the contact that ends at `end`, 64 at most."""
    stretch = (
        active[max(end.node - 63, 0) : end.node + 1][::-1]
        if end.side > 0
        else active[end.node : end.node + 64]
    )
    return int(np.argmin(np.append(stretch, False)))
