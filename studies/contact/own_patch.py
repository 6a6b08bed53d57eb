"""Contact of two alike rectangular pieces, by a program that shares no code with patchfem.

Bilinear elements in plane strain (numpy), a banded Cholesky factorisation (scipy), and the conjugate gradients of
Polonsky and Keer (Wear 231, 206, 1999) on the condensed compliance. The far faces are bonded to rigid holders that do
not rotate, the interface has no friction.

rough_split.py compares models that all run on the patch of patchfem; a mistake in the patch would be common to them.
order_four.py shares no code with the package either, but it needs the edges of the contact as input, and a rough trace
has many edges that are not known in advance.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

GROWTH = 1.12  # ratio of the heights of neighbouring rows of elements
N_LOADS = 50  # unit loads that are solved at once
CHANGE_TOL = 1e-10  # forces that change by less than this fraction of the load have converged


class OwnContact(NamedTuple):
    """Pressure (m,) [Pa], fraction of the length in contact and stiffness [N/m per unit width] of a solution."""

    pressure: np.ndarray
    fraction: float
    stiffness: float


def _element_stiffness(dx: float, dy: float, young: float, poisson: float) -> np.ndarray:
    """Return the stiffness (8, 8) of a bilinear rectangle in plane strain, for unit width."""
    factor = young / ((1 + poisson) * (1 - 2 * poisson))
    law = factor * np.array(
        [[1 - poisson, poisson, 0], [poisson, 1 - poisson, 0], [0, 0, (1 - 2 * poisson) / 2]]
    )
    out = np.zeros((8, 8))
    point = 1 / np.sqrt(3)
    for s in (-point, point):
        for t in (-point, point):
            by_x = np.array([-(1 - t), 1 - t, 1 + t, -(1 + t)]) / 4 * 2 / dx
            by_y = np.array([-(1 - s), -(1 + s), 1 + s, 1 - s]) / 4 * 2 / dy
            strain = np.zeros((3, 8))
            strain[0, 0::2] = by_x
            strain[1, 1::2] = by_y
            strain[2, 0::2] = by_y
            strain[2, 1::2] = by_x
            out += strain.T @ law @ strain * dx * dy / 4
    return out


def compliance(length: float, height: float, columns: int, young: float, poisson: float):
    """Compute the normal compliance of the interface nodes of one piece, for unit width.

    Parameters
    ----------
    length, height : float
        Of the piece [m].
    columns : int
        Number of elements along the interface.
    young, poisson : float
        Young's modulus [Pa] and Poisson's ratio.

    Returns
    -------
    (m, m) ndarray
        [m2/N]
    """
    dx = length / columns
    rows = [dx]
    while sum(rows) < height:
        rows.append(rows[-1] * GROWTH)
    rows = np.array(rows) * height / sum(rows)
    depth = rows.size  # number of free nodes in a column; the last node is fixed to the holder
    band = 2 * depth + 4
    banded = np.zeros((band, 2 * depth * (columns + 1)))
    column = np.arange(columns)
    for row, dy in enumerate(rows):
        matrix = _element_stiffness(dx, dy, young, poisson)
        corners = [(0, row), (1, row), (1, row + 1), (0, row + 1)]
        places = []
        for side, level in corners:
            first = 2 * ((column + side) * depth + level)
            places += [(first, level < depth), (first + 1, level < depth)]
        for i, (first, is_free) in enumerate(places):
            for k, (second, is_other_free) in enumerate(places):
                if is_free and is_other_free and first[0] >= second[0]:
                    np.add.at(banded, (first - second, second), matrix[i, k])
    factor = cholesky_banded(banded, lower=True)
    normal = 2 * depth * np.arange(columns + 1) + 1
    out = np.zeros((columns + 1, columns + 1))
    for first in range(0, columns + 1, N_LOADS):
        loaded = np.arange(first, min(first + N_LOADS, columns + 1))
        loads = np.zeros((banded.shape[1], loaded.size))
        loads[normal[loaded], loaded - first] = 1.0
        out[:, loaded] = cho_solve_banded((factor, True), loads)[normal]
    return out


def press(
    matrix: np.ndarray, gap: np.ndarray, areas: np.ndarray, load: float, max_iterations: int = 20000
) -> OwnContact:
    """Press two alike pieces together.

    Parameters
    ----------
    matrix : (m, m) ndarray
        Compliance of each piece [m2/N].
    gap, areas : (m,) ndarray
        Gap [m] and length [m] of each node.
    load : float
        Load [N/m].
    max_iterations : int

    Returns
    -------
    OwnContact

    Raises
    ------
    ArithmeticError
        If the iteration does not converge.
    """
    both = 2 * matrix
    force = load * areas / areas.sum()
    direction = np.zeros(gap.size)
    last = 1.0
    is_reset = True
    for _ in range(max_iterations):
        opening = gap + both @ force
        touching = force > 0
        opening -= opening[touching].mean()
        norm = (opening[touching] ** 2).sum()
        direction = np.where(
            touching, opening + (0.0 if is_reset else norm / last) * direction, 0.0
        )
        last = norm
        moved = both @ direction
        moved -= moved[touching].mean()
        step = (opening @ direction) / (moved @ direction)
        new = np.maximum(force - step * direction, 0.0)
        overlapping = (new == 0) & (opening < 0)
        new[overlapping] -= step * opening[overlapping]
        is_reset = bool(overlapping.any())
        new *= load / new.sum()
        change = np.abs(new - force).sum() / load
        force = new
        if change < CHANGE_TOL:
            break
    else:
        raise ArithmeticError(
            f"after {max_iterations} iterations the forces still change by {change:.1e} of the load"
        )
    touching = force > 0
    stiffness = np.linalg.solve(both[np.ix_(touching, touching)], np.ones(touching.sum())).sum()
    return OwnContact(force / areas, float(areas[touching].sum() / areas.sum()), float(stiffness))
