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
    values = find_multipliers(find_monodromy(motion, modes))
    is_stable = bool(np.abs(values).max(initial=0.0) <= MAX_STABLE_MULTIPLIER)
    return replace(motion, multipliers=values, stable=is_stable)


def find_multipliers(monodromy) -> np.ndarray:
    """Return the eigenvalues (s,) of a monodromy matrix in order of decreasing magnitude."""
    values = np.linalg.eigvals(monodromy)
    return values[np.argsort(-np.abs(values))]


def find_monodromy(motion: SteadyMotion, modes, cells: int = 0) -> np.ndarray:
    """Return the derivative of the state (z, dz/dtheta, memories) after a cycle by that before, theta = omega t from 0.

    Parameters
    ----------
    motion : SteadyMotion
        Solution of the harmonic balance.
    modes : ModalBasis
        Modes of the structure without the contact.
    cells : int
        Number of cells of the cycle; 0 for MIN_CELLS, or for the samples of the motion if they are more.

    Returns
    -------
    (s, s) array
        s = 2 n + number of memories.
    """
    n = modes.omega.size
    group = motion.group
    omega = motion.omega
    slides = motion.sample(cells or max(MIN_CELLS, 2 ** (motion.samples - 1).bit_length()))
    widths = slides.widths

    # Coefficients of each cell: of the accelerations by the slides, their rates and memories.
    slope, damping = np.zeros((2, len(group.rows), widths.size))
    turns = []
    memories = []
    for i, forces in enumerate(group.evaluate(slides)):
        for force in forces:
            if force.states is not None:
                memories.append((i, *_find_fading(force.states, widths)))
                damping[i] += _average(force.states.slopes[1])
                continue
            weight = _weigh_ends(slides.q[i], force)
            slope[i] += _average(force.slope, weight)
            damping[i] += _average(force.by_velocity)
            if np.ndim(force.holds):
                held = _average(force.holds - force.holds.max(axis=1, keepdims=True), weight)
                moves = held.any(axis=1)
                turns += [(i, *turn) for turn in zip(slides.reversals[i][moves], held[moves])]

    # Successive cells of equal coefficients are one, but for those that begin with a reversal.
    coefficients = [
        slope,
        damping,
        *(turn[2] for turn in turns),
        *(part for memory in memories for part in memory[1:]),
    ]
    table = np.vstack(coefficients)
    is_first = np.append(True, (table[:, 1:] != table[:, :-1]).any(axis=0))
    is_first[[node for _, node, _ in turns]] = True
    first = np.flatnonzero(is_first)

    # Matrices of the rates of the state by theta.
    size = 2 * n + len(turns) + len(memories)
    to_rate = group.rows.T / (modes.mass * omega**2)
    rates = np.zeros((first.size, size, size))
    rates[:, :n, n : 2 * n] = np.eye(n)
    rates[:, n : 2 * n, :n] = -np.diag(modes.omega**2) / omega**2
    rates[:, n : 2 * n, :n] -= (to_rate * slope.T[first, None]) @ group.rows
    rates[:, n : 2 * n, n : 2 * n] = -modes.damping_matrix / omega
    rates[:, n : 2 * n, n : 2 * n] -= omega * (to_rate * damping.T[first, None]) @ group.rows
    for k, (i, _, held) in enumerate(turns, 2 * n):
        rates[:, n : 2 * n, k] = -np.outer(held[first], to_rate[:, i])
    for k, (i, gain, loss, stiffness) in enumerate(memories, 2 * n + len(turns)):
        rates[:, n : 2 * n, k] = -np.outer(stiffness[first], to_rate[:, i])
        rates[:, k, n : 2 * n] = np.outer(gain[first], group.rows[i])
        rates[:, k, k] = -loss[first]

    steps = _find_cell_steps(rates, np.add.reduceat(widths, first), n)

    # A reversal ends a cell; its memory is the slide there.
    for k, (i, node, _) in enumerate(turns, 2 * n):
        last = np.searchsorted(first, node) - 1
        steps[last, k] = group.rows[i] @ steps[last, :n]
    return _multiply(steps)


def _find_cell_steps(rates, widths, n: int) -> np.ndarray:
    """Return the transition matrices (c, s, s) of cells from the rates of the state by theta and the widths (c,) [rad].

    Velocities, the coordinates n to 2 n, are divided by a scale, which balances the entries of stiff modes and contacts.
    """
    scale = max(float(np.sqrt(np.abs(rates[:, n : 2 * n, :n]).max())), 1.0)
    sizes = np.ones(rates.shape[1])
    sizes[n : 2 * n] = scale
    balanced = rates * (sizes / sizes[:, None])
    return find_exponentials(balanced * widths[:, None, None]) * (sizes[:, None] / sizes)


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


def _multiply(steps) -> np.ndarray:
    """Return the product of matrices (k, s, s), the first one rightmost, by pairs."""
    while len(steps) > 1:
        unpaired = steps[-1:] if len(steps) % 2 else steps[:0]
        pairs = steps[: len(steps) - len(unpaired)]
        steps = np.concatenate([pairs[1::2] @ pairs[::2], unpaired])
    return steps[0]
