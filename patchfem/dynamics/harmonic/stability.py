"""Stability of a steady motion: Floquet multipliers from the derivatives of the friction laws."""

from dataclasses import replace

import numpy as np

from ..periodic import find_multipliers, is_stable
from .floquet import FadingMemory, TurningPoint, find_monodromy
from .laws import FlowLaw, FlowNodes


def add_stability(periodic, modes, cells: int = 0):
    """Add Floquet multipliers and stability to a steady motion.

    Parameters
    ----------
    periodic : SteadyMotion
    modes : ModalBasis
    cells : int, optional
        Number of cells of the cycle; 0 for 1024, or for the samples of the motion if they are more.

    Returns
    -------
    SteadyMotion
    """
    multipliers = find_multipliers(find_motion_monodromy(periodic, modes, cells))
    return replace(periodic, multipliers=multipliers, stable=is_stable(multipliers))


def find_motion_monodromy(periodic, modes, cells: int = 0) -> np.ndarray:
    """Compute the monodromy matrix of a steady motion over one period of the drive signal.

    Parameters
    ----------
    periodic, modes, cells
        See `add_stability`; the slopes of the laws are constant in a cell.

    Returns
    -------
    ndarray
        (2n, 2n), or larger by the memories of the laws.
    """
    group = periodic.group
    n = cells or max(1024, 2 ** (periodic.samples - 1).bit_length())
    slope, by_rate = np.zeros((2, len(group.rows), n))
    reversals = []
    fading = []
    for i, (track, laws) in enumerate(
        zip(group.sample_slides(periodic.coefficients, periodic.omega, n), group.laws)
    ):
        for law in laws:
            if isinstance(law, FlowLaw):
                nodes = law.find_periodic_state(track)
                fading.append(_make_fading_memory(i, nodes))
                by_rate[i] += _average_cells(nodes.slopes[1, nodes.own], 0.5)
                continue
            sampled = law.sample(track)
            weights = _weigh_samples(track, sampled)
            slope[i] += _average_cells(sampled.slope, weights) if sampled.slope is not None else 0.0
            by_rate[i] += (
                _average_cells(sampled.by_rate, 0.5) if sampled.by_rate is not None else 0.0
            )
            if sampled.hold is not None:
                reversals += _make_turning_points(i, track, sampled.hold, weights, slope[i])
    return find_monodromy(modes, group.rows, periodic.omega, slope, by_rate, reversals, fading)


def _average_cells(values, weights) -> np.ndarray:
    """Return the weighted means (..., N) of sampled values in all cells.

    weights: weight of the value at the end of a cell.

    """
    return (1 - weights) * values + weights * np.roll(values, -1, axis=-1)


def _weigh_samples(track, sampled):
    """Return the weights (N,) that the later sample of each cell has in the cell's mean stiffness.

    The mean is the secant of the force over the cell, or follows the position of a reversal in
    it; the weight is 0.5 if the force does not depend on the slide alone.
    """
    if sampled.slope is None:
        return 0.5
    if sampled.by_rate is not None:
        if sampled.hold is None:
            return 0.5
        return _set_reversal_weights(track, np.full(track.samples, 0.5))
    after = np.roll(sampled.slope, -1)
    slide_increment = np.roll(track.q, -1) - track.q
    jump = after - sampled.slope
    is_resolved = (np.abs(slide_increment) > 1e-9 * np.ptp(track.q)) & (
        np.abs(jump) > 1e-9 * np.abs(sampled.slope).max()
    )
    secant = (np.roll(sampled.force, -1) - sampled.force) / np.where(
        is_resolved, slide_increment, 1.0
    )
    return _set_reversal_weights(
        track,
        np.where(
            is_resolved,
            np.clip((secant - sampled.slope) / np.where(is_resolved, jump, 1.0), 0.0, 1.0),
            0.5,
        ),
    )


def _set_reversal_weights(track, weights):
    """Set the weights in cells with a reversal, from the position of the reversal in the cell."""
    cells = track.turning_points.cells
    weights[cells] = 1 - _find_cell_positions(track)
    return weights


def _find_cell_positions(track) -> np.ndarray:
    """Return the relative position [0, 1] of each reversal within its cell."""
    return track.turning_points.angles * (track.samples / (2 * np.pi)) - track.turning_points.cells


def _make_turning_points(row: int, track, hold, weights, slope) -> list:
    """Return the reversals of the displacement that affect the sticking elements.

    The list has no reversal whose elements never slip. In the cell of a reversal its stiffness does not act yet:
    the displacement there departs from the reversal only by a term of second order in the cell length.
    """
    reversals = []
    for cell, position, stiffness in zip(
        track.turning_points.cells, _find_cell_positions(track), hold
    ):
        if stiffness.min() < stiffness.max():
            stiffness = stiffness - stiffness.max()
            mean = _average_cells(stiffness, weights)
            mean[cell] = position * stiffness[cell]
            slope[cell] += (1 - position) * stiffness[(cell + 1) % stiffness.size]
            reversals.append(TurningPoint(row, int(cell), float(position), mean))
    return reversals


def _make_fading_memory(row: int, nodes: FlowNodes) -> FadingMemory:
    decay, by_slide = nodes.find_cell_factors()
    loss = -np.log(np.maximum(decay, 1e-300))
    gain = by_slide * np.divide(loss, 1 - decay, out=np.ones_like(loss), where=loss > 1e-9)
    return FadingMemory(
        row,
        gain,
        loss * (decay.size / (2 * np.pi)),
        _average_cells(nodes.slopes[0, nodes.own], 0.5),
    )
