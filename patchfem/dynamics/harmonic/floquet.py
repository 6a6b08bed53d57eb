"""Floquet multipliers of a steady motion: growth of small disturbances over a cycle.

The state is the motion of the modes and what the contacts remember. A law without memory gives a
slope over the slide and over its rate. Elastic-plastic elements remember, for each turning point,
where the slide was: the disturbance there is a state, and the stiffness that sticks since then
acts on it. The force is continuous, so nothing jumps; a turning point may shift, but the slide is
at rest there, so its shift does not count. Elements that slip forget, so t elements have t - R
multipliers that are zero and are left out. An element that never slips within the cycle is a
spring; its offset, which no cycle changes (multiplier 1), is left out too. Bonds remember one
number per row.

Every cell of constant coefficients is a matrix exponential: order 2 in the width of the cells for
corners in time. Neighbours with equal coefficients become one wide cell.
"""

from dataclasses import dataclass

import numpy as np

from ...core import ModalBasis
from ..propagator import matrix_exponentials


@dataclass(frozen=True, eq=False, slots=True)
class TurningPoint:
    """Memory of a turning point.

    - row, cell, share: its row, its cell and its place [0, 1] there
    - hold: (N,) force per disturbance of the slide at the turn [N/m], per cell
    """

    row: int
    cell: int
    share: float
    hold: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class FadingMemory:
    """Memory u of bonds or of a flow: u' = gain q' - loss u, with the force limit u.

    - row
    - gain, loss: (N,) per slide and per angle [1], per cell
    - limit: [N], one number or per cell (N,)
    """

    row: int
    gain: np.ndarray
    loss: np.ndarray
    limit: float | np.ndarray


def find_monodromy(
    modes: ModalBasis, rows, omega: float, slope, by_rate, marks=(), fading=()
) -> np.ndarray:
    """Return the map over one cycle of (z, dz/dtheta, memories), theta = omega t from 0.

    Parameters
    ----------
    modes : ModalBasis
    rows : ndarray
        (i, n) rows of the interfaces.
    omega : float
    slope, by_rate : ndarray
        (i, N) means per cell of the local stiffness [N/m] and damping [N s/m].
    marks, fading : sequence, optional
        TurningPoints and FadingMemories.

    Returns
    -------
    ndarray
    """
    n = modes.omega.size
    count = slope.shape[1]
    remembered = [
        np.broadcast_to(part, count) for one in fading for part in (one.gain, one.loss, one.limit)
    ]
    first = _find_equal_cells([slope, by_rate, *(mark.hold for mark in marks), *remembered], marks)
    width = np.diff(first, append=count) * (2 * np.pi / count)
    cells = first.size
    slope = slope[:, first]
    by_rate = by_rate[:, first]
    size = 2 * n + len(marks) + len(fading)
    a = np.zeros((cells, size, size))
    grip = rows.T / (modes.mass * omega**2)
    a[:, :n, n : 2 * n] = np.eye(n)
    a[:, n : 2 * n, :n] = -np.diag(modes.omega**2) / omega**2 - np.einsum(
        "ai,in,ib->nab", grip, slope, rows
    )
    a[:, n : 2 * n, n : 2 * n] = -modes.damping_matrix / omega - omega * np.einsum(
        "ai,in,ib->nab", grip, by_rate, rows
    )
    for k, mark in enumerate(marks):
        a[:, n : 2 * n, 2 * n + k] = -mark.hold[first][:, None] * grip[:, mark.row]
    for k, one in enumerate(fading, 2 * n + len(marks)):
        a[:, n : 2 * n, k] = -np.multiply.outer(
            np.broadcast_to(one.limit, count)[first], grip[:, one.row]
        )
        a[:, k, n : 2 * n] = one.gain[first][:, None] * rows[one.row]
        a[:, k, k] = -one.loss[first]
    steps = matrix_exponentials(a * width[:, None, None])
    for k, mark in enumerate(marks, 2 * n):
        across = np.zeros(size)
        across[:n] = rows[mark.row]
        cell = np.searchsorted(first, mark.cell)
        steps[cell, k] = (1 - mark.share) * across + mark.share * (across @ steps[cell])
    return multiply_pairwise(steps)


def _find_equal_cells(coefficients: list, marks) -> np.ndarray:
    """Return the first cells (r,) of runs of neighbours with equal coefficients (..., N).

    A cell with a turning point is a run of its own.
    """
    table = np.concatenate(
        [coefficient.reshape(-1, coefficient.shape[-1]) for coefficient in coefficients]
    )
    new = np.append(True, (table[:, 1:] != table[:, :-1]).any(axis=0))
    for mark in marks:
        new[mark.cell : mark.cell + 2] = True
    return np.flatnonzero(new)


def multiply_pairwise(steps) -> np.ndarray:
    """Return steps[N - 1] ... steps[1] steps[0] of matrices (N, s, s), by pairs."""
    while len(steps) > 1:
        rest = steps[-1:] if len(steps) % 2 else steps[:0]
        steps = np.concatenate([steps[1::2] @ steps[0 : len(steps) - len(rest) : 2], rest])
    return steps[0]
