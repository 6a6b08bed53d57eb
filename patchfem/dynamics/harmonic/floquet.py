"""Floquet multipliers of a steady motion: what one cycle makes of a small disturbance.

The state is the motion of the modes and what the contacts remember. A law without memory gives a slope over the slide
and over its rate. A set of elastic-plastic elements remembers, for each turning point of the slide, where it was: the
disturbance of the slide there is kept as a state and hangs on the stiffness that sticks since then. The force is
continuous in time, so nothing jumps; a turning point may shift, but the slide is at rest there, so its shift does not
count. Every element that slips forgets, so the memory of t elements has t - R multipliers that are zero, which are left
out, and those of the R turning points, most of them zero too. An element that never slips within the cycle is a spring:
its own memory, an offset that no cycle changes (multiplier 1), is left out as well. Bonds remember one number per row.

Cells of constant coefficients, each by its matrix exponential: order 2 in the width of the cells for corners in time.
Neighbours with the same coefficients, as elements that stick or slip have for most of a cycle, are one wide cell.
"""

from dataclasses import dataclass

import numpy as np

from ...core import ModalBasis
from ..propagator import exponentials


@dataclass(frozen=True, eq=False, slots=True)
class TurningPoint:
    """Memory of a turning point: row, cell in which it lies and its place [0, 1] there, hold (N,) [N/m] per cell: the
    force per disturbance of the slide at that turning."""

    row: int
    cell: int
    share: float
    hold: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Fading:
    """Memory u of bonds or of a flow: u' = gain q' - loss u per cell (N,), per slide and per angle [1]; force limit u,
    limit [N] one number or per cell (N,)."""

    row: int
    gain: np.ndarray
    loss: np.ndarray
    limit: float | np.ndarray


def monodromy(
    modes: ModalBasis, rows, omega: float, slope, by_rate, marks=(), fading=()
) -> np.ndarray:
    """Map over one cycle of (z, dz/dtheta, memories), theta = omega t from 0.

    rows (i, n); slope, by_rate (i, N): means per cell of the local stiffness [N/m] and damping [N s/m] of every row.
    """
    n = modes.omega.size
    count = slope.shape[1]
    remembered = [
        np.broadcast_to(part, count) for one in fading for part in (one.gain, one.loss, one.limit)
    ]
    first = _runs([slope, by_rate, *(mark.hold for mark in marks), *remembered], marks)
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
    steps = exponentials(a * width[:, None, None])
    for k, mark in enumerate(marks, 2 * n):
        across = np.zeros(size)
        across[:n] = rows[mark.row]
        cell = np.searchsorted(first, mark.cell)
        steps[cell, k] = (1 - mark.share) * across + mark.share * (across @ steps[cell])
    return product(steps)


def _runs(coefficients: list, marks) -> np.ndarray:
    """First cells (r,) of the runs of neighbours whose coefficients, (..., N) each, are the same; a cell with a turning
    point is one of its own."""
    table = np.concatenate([one.reshape(-1, one.shape[-1]) for one in coefficients])
    new = np.append(True, (table[:, 1:] != table[:, :-1]).any(axis=0))
    for mark in marks:
        new[mark.cell : mark.cell + 2] = True
    return np.flatnonzero(new)


def product(steps) -> np.ndarray:
    """Product steps[N - 1] ... steps[1] steps[0] of matrices (N, s, s), by pairs."""
    while len(steps) > 1:
        rest = steps[-1:] if len(steps) % 2 else steps[:0]
        steps = np.concatenate([steps[1::2] @ steps[0 : len(steps) - len(rest) : 2], rest])
    return steps[0]
