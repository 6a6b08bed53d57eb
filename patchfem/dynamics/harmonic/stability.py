"""Stability of a steady motion: Floquet multipliers from the derivatives of its laws."""

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
    found = find_multipliers(find_motion_monodromy(periodic, modes, cells))
    return replace(periodic, multipliers=found, stable=is_stable(found))


def find_motion_monodromy(periodic, modes, cells: int = 0) -> np.ndarray:
    """Return the monodromy matrix of a steady motion over one period of the drive.

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
    marks = []
    fading = []
    for i, (track, laws) in enumerate(
        zip(group.tracks(periodic.coefficients, periodic.omega, n), group.laws)
    ):
        for law in laws:
            if isinstance(law, FlowLaw):
                one = law.find_periodic_state(track)
                fading.append(_make_fading(i, one))
                by_rate[i] += _average_cells(one.slopes[1, one.own], 0.5)
                continue
            found = law.sample(track)
            share = _weigh_samples(track, found)
            slope[i] += _average_cells(found.slope, share) if found.slope is not None else 0.0
            by_rate[i] += _average_cells(found.by_rate, 0.5) if found.by_rate is not None else 0.0
            if found.hold is not None:
                marks += _make_turning_points(i, track, found.hold, share, slope[i])
    return find_monodromy(modes, group.rows, periodic.omega, slope, by_rate, marks, fading)


def _average_cells(values, share) -> np.ndarray:
    """Return the weighted mean of sampled values in each cell, (..., N).

    share: weight of the value at the end of a cell.

    """
    return (1 - share) * values + share * np.roll(values, -1, axis=-1)


def _weigh_samples(track, found):
    """Return the weights (N,) of the later sample in the mean stiffness of each cell.

    The mean is the secant of the force over the cell, or follows the position of a reversal in
    it; the weight is 0.5 where the force does not depend on the slide alone.
    """
    if found.slope is None:
        return 0.5
    if found.by_rate is not None:
        return 0.5 if found.hold is None else _set_turning_cells(track, np.full(track.samples, 0.5))
    after = np.roll(found.slope, -1)
    rise = np.roll(track.q, -1) - track.q
    jump = after - found.slope
    firm = (np.abs(rise) > 1e-9 * np.ptp(track.q)) & (
        np.abs(jump) > 1e-9 * np.abs(found.slope).max()
    )
    secant = (np.roll(found.force, -1) - found.force) / np.where(firm, rise, 1.0)
    return _set_turning_cells(
        track,
        np.where(firm, np.clip((secant - found.slope) / np.where(firm, jump, 1.0), 0.0, 1.0), 0.5),
    )


def _set_turning_cells(track, share):
    """Set the weights of the cells with a reversal from its position in the cell."""
    cells = track.turning_points.cells
    share[cells] = 1 - _place_in_cell(track)
    return share


def _place_in_cell(track) -> np.ndarray:
    """Return the relative position [0, 1] of every reversal in its cell."""
    return track.turning_points.angles * (track.samples / (2 * np.pi)) - track.turning_points.cells


def _make_turning_points(row: int, track, hold, share, slope) -> list:
    """Return the reversals of a slide that the sticking elements remember.

    The list has no reversal whose elements never slip. In the cell of a reversal its stiffness does not act yet:
    the slide has not left it by more than the
    square of the cell.
    """
    out = []
    for cell, x, line in zip(track.turning_points.cells, _place_in_cell(track), hold):
        if line.min() < line.max():
            line = line - line.max()
            mean = _average_cells(line, share)
            mean[cell] = x * line[cell]
            slope[cell] += (1 - x) * line[(cell + 1) % line.size]
            out.append(TurningPoint(row, int(cell), float(x), mean))
    return out


def _make_fading(row: int, one: FlowNodes) -> FadingMemory:
    kept, by_slide = one.find_cell_factors()
    loss = -np.log(np.maximum(kept, 1e-300))
    gain = by_slide * np.divide(loss, 1 - kept, out=np.ones_like(loss), where=loss > 1e-9)
    return FadingMemory(
        row, gain, loss * (kept.size / (2 * np.pi)), _average_cells(one.slopes[0, one.own], 0.5)
    )
