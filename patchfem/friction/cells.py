"""Joining of neighbouring slider cells into fewer ones with the same stiffness and friction limit.

In: stiffness and yield displacement of parallel spring-slider elements. Out: those of fewer elements, for the error of a
sum over cells.
"""

import numpy as np

# Coarser sums for the error estimate: number of neighbouring cells that are joined, and index of the first one.
CELL_MERGES = tuple((4, first_cell) for first_cell in range(4))


def join_cells(
    count: int, first: int, stiffness, yield_displacement
) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness [N/m] and yield displacement [m] of joined elements.

    Parameters
    ----------
    count : int
        Elements that become one, neighbours by yield displacement.
    first : int
        First element that is joined with those after it; those before it become one too. The last one of an odd number
        stays.
    stiffness, yield_displacement : (t,) array
        Of the elements, in increasing order of the yield displacement.

    Returns
    -------
    stiffness, yield_displacement : ndarray
        Of the joined elements [N/m], [m], in increasing order of the yield displacement.
    """
    n_last = stiffness.size % 2
    begins = np.r_[0, np.arange(first, stiffness.size - n_last, count)]
    begins = np.unique(np.r_[begins, [stiffness.size - 1] * n_last]).astype(int)
    total = np.add.reduceat(stiffness, begins)
    # The mean lies between those of the joined elements, so that the order stays.
    return total, np.add.reduceat(stiffness * yield_displacement, begins) / total
