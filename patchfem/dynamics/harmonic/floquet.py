"""Monodromy matrix of a steady motion, which describes how small perturbations grow over a cycle.

The state is the motion of the modes and the memory of the contacts. A law without memory gives a
slope over the slide and over its rate. Elastic-plastic elements remember, for each reversal,
the slide at which it occurred: its perturbation is a state, and the stiffness that sticks since then
acts on it. The force is continuous, so nothing jumps; a reversal may shift in time, but the slide is
at rest there, so the shift has no effect to first order. Elements that slip lose their memory, so t elements have t - R
multipliers that are zero and are left out. An element that never slips within the cycle is a
spring; its offset, which no cycle changes (multiplier 1), is left out too. Bonds remember one
number per row.

Every cell of constant coefficients is a matrix exponential: order 2 in the width of the cells for
corners in time. Neighbours with equal coefficients become one wide cell.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from ...core import ModalBasis


@dataclass(frozen=True, eq=False, slots=True)
class TurningPoint:
    """Perturbed relative displacement at a reversal, which affects the force of sticking elements.

    - row, cell, share: interface row, cell of the cycle, and position [0, 1] in this cell
    - hold: (N,) force in each cell per perturbation of the slide at the reversal [N/m]
    """

    row: int
    cell: int
    share: float
    hold: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class FadingMemory:
    """Fading memory u of a friction law with u' = gain q' - loss u, whose force is limit * u.

    - row
    - gain, loss: (N,) coefficients in each cell, per slide and per angle [1]
    - limit: friction limit [N], a number or (N,) for the cells
    """

    row: int
    gain: np.ndarray
    loss: np.ndarray
    limit: float | np.ndarray


def find_monodromy(
    modes: ModalBasis, rows, omega: float, slope, by_rate, reversals=(), fading=()
) -> np.ndarray:
    """Compute the monodromy matrix of modes and contact memories over one cycle.

    The state is (z, dz/dtheta, memories) with theta = omega t from 0.

    Parameters
    ----------
    modes : ModalBasis
    rows : ndarray
        (i, n) rows of the interfaces.
    omega : float
    slope, by_rate : ndarray
        (i, N) mean local stiffness [N/m] and damping [N s/m] in each cell.
    reversals, fading : sequence, optional
        Records TurningPoint and FadingMemory.

    Returns
    -------
    ndarray
    """
    n = modes.omega.size
    count = slope.shape[1]
    memory_coefficients = []
    for memory in fading:
        coefficients = (memory.gain, memory.loss, memory.limit)
        memory_coefficients += [np.broadcast_to(part, count) for part in coefficients]
    first = _find_equal_cells(
        [slope, by_rate, *(reversal.hold for reversal in reversals), *memory_coefficients],
        reversals,
    )
    width = np.diff(first, append=count) * (2 * np.pi / count)
    cells = first.size
    slope = slope[:, first]
    by_rate = by_rate[:, first]
    size = 2 * n + len(reversals) + len(fading)
    a = np.zeros((cells, size, size))
    force_to_rate = rows.T / (modes.mass * omega**2)
    a[:, :n, n : 2 * n] = np.eye(n)
    a[:, n : 2 * n, :n] = -np.diag(modes.omega**2) / omega**2 - np.einsum(
        "ai,in,ib->nab", force_to_rate, slope, rows
    )
    a[:, n : 2 * n, n : 2 * n] = -modes.damping_matrix / omega - omega * np.einsum(
        "ai,in,ib->nab", force_to_rate, by_rate, rows
    )
    for k, reversal in enumerate(reversals):
        a[:, n : 2 * n, 2 * n + k] = -reversal.hold[first][:, None] * force_to_rate[:, reversal.row]
    for k, memory in enumerate(fading, 2 * n + len(reversals)):
        a[:, n : 2 * n, k] = -np.multiply.outer(
            np.broadcast_to(memory.limit, count)[first], force_to_rate[:, memory.row]
        )
        a[:, k, n : 2 * n] = memory.gain[first][:, None] * rows[memory.row]
        a[:, k, k] = -memory.loss[first]
    steps = expm(a * width[:, None, None])
    for k, reversal in enumerate(reversals, 2 * n):
        across = np.zeros(size)
        across[:n] = rows[reversal.row]
        cell = np.searchsorted(first, reversal.cell)
        steps[cell, k] = (1 - reversal.share) * across + reversal.share * (across @ steps[cell])
    return multiply_pairwise(steps)


def _find_equal_cells(coefficients: list, reversals) -> np.ndarray:
    """Return the first cell of each run of adjacent cells whose coefficients (..., N) are equal.

    A cell with a reversal is a run of its own.
    """
    table = np.concatenate(
        [coefficient.reshape(-1, coefficient.shape[-1]) for coefficient in coefficients]
    )
    is_first = np.append(True, (table[:, 1:] != table[:, :-1]).any(axis=0))
    for reversal in reversals:
        is_first[reversal.cell : reversal.cell + 2] = True
    return np.flatnonzero(is_first)


def multiply_pairwise(steps) -> np.ndarray:
    """Multiply matrices (N, s, s) in order, with the first one rightmost, by pairs."""
    while len(steps) > 1:
        unpaired = steps[-1:] if len(steps) % 2 else steps[:0]
        steps = np.concatenate([steps[1::2] @ steps[0 : len(steps) - len(unpaired) : 2], unpaired])
    return steps[0]
