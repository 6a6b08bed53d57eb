"""Floquet multipliers of a steady motion: the factors by which a cycle multiplies small perturbations.

The state is the motion of the modes and the memory of the contacts. A law without memory has a slope by the slide and by
its rate. Elastic-plastic elements remember the slides at the reversals: the perturbation of each is a state, on which
the stiffness that sticks since then acts. The force is continuous, so nothing jumps; a reversal may shift in time, but
the slide is at rest there, so the shift has no effect to first order. Elements that slip lose their memory; an element
that never slips is a spring, whose offset (multiplier 1) is left out. A law with one state has one state per row.

In each cell between two nodes of the cycle the coefficients are constant and the motion is a matrix exponential: order 2
in the width of the cells. Successive cells of equal coefficients become one.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..exponentials import find_exponentials
from .laws import FlowStates, LawForce
from .motion import SteadyMotion

MIN_CELLS = 1024  # smallest number of cells of a cycle
MAX_STABLE_MULTIPLIER = (
    1 + 1e-5
)  # largest magnitude of a multiplier of a stable motion, with round-off
# Smallest change of the slide in a cell, relative to its range, and of the stiffness, relative to the largest, from which
# the mean stiffness is a secant.
MIN_CELL_CHANGE = 1e-9
ROUND_OFF_DIGITS = 6  # digits of the weight in the mean stiffness of a cell
MIN_FADING = 1e-9  # smallest decay in a cell that is told from none


def add_stability(motion: SteadyMotion, modes) -> SteadyMotion:
    """Return a steady motion with its Floquet multipliers, in decreasing magnitude, and its stability.

    Parameters
    ----------
    motion : SteadyMotion
        Solution of the harmonic balance.
    modes : ModalBasis
        Modes of the structure without the contact.
    """
    values = np.linalg.eigvals(find_monodromy(motion, modes))
    values = values[np.argsort(-np.abs(values))]
    is_stable = bool(np.abs(values).max(initial=0.0) <= MAX_STABLE_MULTIPLIER)
    return replace(motion, multipliers=values, stable=is_stable)


class _Memory(NamedTuple):
    """State of a law in the cells of a cycle.

    - row: number of the interface row
    - gain, loss (c,): the state obeys u' = gain q' - loss u [1], [1/rad]
    - stiffness (c,): force per state [N/m]
    - node: node at which the state becomes the slide; -1 for a state that changes in all cells
    """

    row: int
    gain: np.ndarray
    loss: np.ndarray
    stiffness: np.ndarray
    node: int = -1


class _Cells(NamedTuple):
    """Coefficients of the linear equations of a perturbation, constant in each of c cells of a cycle.

    - first (c,): nodes at which the cells begin
    - widths (c,): widths of the cells [rad]
    - slope, damping (r, c): derivatives of the forces on the interface rows by slide [N/m] and velocity [N s/m]
    - memories: states of the laws
    """

    first: np.ndarray
    widths: np.ndarray
    slope: np.ndarray
    damping: np.ndarray
    memories: list[_Memory]


def find_monodromy(motion: SteadyMotion, modes) -> np.ndarray:
    """Return the derivative of the state (z, dz/dtheta, memories) after a cycle by that before, theta = omega t from 0.

    Parameters
    ----------
    motion : SteadyMotion
        Solution of the harmonic balance. As many cells as its samples, and at least MIN_CELLS, make up the cycle.
    modes : ModalBasis
        Modes of the structure without the contact.

    Returns
    -------
    (s, s) array
        s = 2 n + number of memories.
    """
    n = modes.omega.size
    rows = motion.group.rows
    omega = motion.omega
    first, widths, slope, damping, memories = _make_cells(motion)

    # Matrices of the linear equations of a perturbation (z, dz/dtheta, u), with theta = omega t, the modal coordinates z,
    # the memories u, the slides q = R z and a force stiffness u of each memory:
    #   d2z/dtheta2 = -(omega_j/omega)^2 z - C/omega dz/dtheta - R^T (slope q + omega damping dq/dtheta + force)/(m omega^2)
    #   du/dtheta = gain dq/dtheta - loss u
    size = 2 * n + len(memories)
    to_rate = rows.T / (modes.mass * omega**2)
    rates = np.zeros((widths.size, size, size))
    rates[:, :n, n : 2 * n] = np.eye(n)
    rates[:, n : 2 * n, :n] = -np.diag(modes.omega**2) / omega**2
    rates[:, n : 2 * n, :n] -= (to_rate * slope.T[:, None]) @ rows
    rates[:, n : 2 * n, n : 2 * n] = -modes.damping_matrix / omega
    rates[:, n : 2 * n, n : 2 * n] -= omega * (to_rate * damping.T[:, None]) @ rows
    for k, memory in enumerate(memories, 2 * n):
        rates[:, n : 2 * n, k] = -np.outer(memory.stiffness, to_rate[:, memory.row])
        rates[:, k, n : 2 * n] = np.outer(memory.gain, rows[memory.row])
        rates[:, k, k] = -memory.loss

    # Transition matrices of the cells. Velocities divided by a scale balance the entries of stiff modes and contacts.
    scale = max(float(np.sqrt(np.abs(rates[:, n : 2 * n, :n]).max())), 1.0)
    sizes = np.ones(size)
    sizes[n : 2 * n] = scale
    balanced = rates * (sizes / sizes[:, None])
    steps = find_exponentials(balanced * widths[:, None, None]) * (sizes[:, None] / sizes)

    # A reversal ends a cell; its memory is the slide there.
    for k, memory in enumerate(memories, 2 * n):
        if memory.node >= 0:
            last = np.searchsorted(first, memory.node) - 1
            steps[last, k] = rows[memory.row] @ steps[last, :n]

    # Product of the matrices by pairs, the first one rightmost.
    while len(steps) > 1:
        unpaired = steps[-1:] if len(steps) % 2 else steps[:0]
        pairs = steps[: len(steps) - len(unpaired)]
        steps = np.concatenate([pairs[1::2] @ pairs[::2], unpaired])
    return steps[0]


def _make_cells(motion: SteadyMotion) -> _Cells:
    """Return the cells of a cycle, of which successive ones of equal coefficients are one."""
    slides = motion.sample(max(MIN_CELLS, 2 ** (motion.samples - 1).bit_length()))
    widths = slides.widths
    n_rows = len(motion.group.rows)

    # Coefficients of each cell: of the accelerations by the slides and their rates, and those of the memories.
    slope, damping = np.zeros((2, n_rows, widths.size))
    memories = []
    for i, forces in enumerate(motion.group.evaluate(slides)):
        for force in forces:
            if force.states is not None:
                damping[i] += _average(force.states.slopes[1])
                if force.states.slopes[0].any():
                    memories.append(_Memory(i, *_find_fading(force.states, widths)))
                continue
            weight = _weigh_ends(slides.q[i], force)
            slope[i] += _average(force.slope, weight)
            if np.ndim(force.holds):
                held = _average(force.holds - force.holds.max(axis=1, keepdims=True), weight)
                still = np.zeros(widths.size)
                for node, stiffness in zip(slides.reversals[i], held):
                    if stiffness.any():
                        memories.append(_Memory(i, still, still, stiffness, node))

    # Elements that stick or slip have few different coefficients, but up to 65536 nodes where they stick for a short time.
    # Successive equal cells become one, and a cell begins at each reversal.
    table = np.vstack([slope, damping, *[np.stack(memory[1:4]) for memory in memories]])
    begins = np.append(True, (table[:, 1:] != table[:, :-1]).any(axis=0))
    begins[[memory.node for memory in memories if memory.node >= 0]] = True
    first = np.flatnonzero(begins)
    widths = np.add.reduceat(widths, first)
    table = table[:, first]
    slope, damping = table[: 2 * n_rows].reshape(2, n_rows, -1)
    parts = table[2 * n_rows :].reshape(-1, 3, first.size)
    memories = [_Memory(memory.row, *part, memory.node) for memory, part in zip(memories, parts)]
    return _Cells(first, widths, slope, damping, memories)


def _average(values, weight=0.5):
    """Return the means (..., M) of values at the nodes in the cells after them; weight: that of the end of the cell."""
    if not np.ndim(values):
        return values
    return (1 - weight) * values + weight * np.roll(values, -1, axis=-1)


def _weigh_ends(q, force: LawForce):
    """Return the weights (M,) of the ends of the cells at which the mean stiffness of a law is the secant of its force.

    They are 0.5 where the stiffness changes little, or depends on the velocity.
    """
    if not np.ndim(force.slope):
        return 0.5
    jump = np.roll(force.slope, -1) - force.slope
    change = np.roll(q, -1) - q
    is_clear = np.abs(change) > MIN_CELL_CHANGE * np.ptp(q)
    is_clear &= np.abs(jump) > MIN_CELL_CHANGE * np.abs(force.slope).max()
    secant = np.divide(
        np.roll(force.force, -1) - force.force, change, where=is_clear, out=np.zeros(q.size)
    )
    weight = np.divide(secant - force.slope, jump, where=is_clear, out=np.full(q.size, 0.5))
    return np.round(np.clip(weight, 0.0, 1.0), ROUND_OFF_DIGITS)


def _find_fading(states: FlowStates, widths) -> np.ndarray:
    """Return gain and loss of a stretch u' = gain q' - loss u, and the stiffness [N/m] of each cell, (3, M)."""
    decay, by_slide, _ = states.steps
    left = -np.log(np.maximum(decay, 1e-300))
    gain = by_slide * np.divide(left, 1 - decay, out=np.ones_like(left), where=left > MIN_FADING)
    return np.array([gain, left / np.maximum(widths, 1e-300), _average(states.slopes[0])])
