"""Static condensation of a column-by-column numbered piece to its interface by a block-tridiagonal sweep.

With blocks D_j on the diagonal and E_j between columns j and j+1, the right and left Schur complements

    T_j = D_j - E_j T_{j+1}^-1 E_j^T,    S_j = D_j - E_{j-1}^T S_{j-1}^-1 E_{j-1}

give the diagonal blocks of the inverse, G_jj = (S_j + T_j - D_j)^-1, and the propagators P_j = -T_{j+1}^-1 E_j^T the
rest, G_{j+1,i} = P_j G_{j,i} for i <= j. Normal and tangential compliance come out together.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_matrix

from .threads import one_thread


def _blocks(matrix: csr_matrix, columns: int) -> tuple:
    size = matrix.shape[0] // columns
    block = matrix.tobsr(blocksize=(size, size))
    block.sort_indices()
    diagonal = np.empty((columns, size, size))
    upper = np.empty((columns - 1, size, size))
    for j in range(columns):
        for k in range(block.indptr[j], block.indptr[j + 1]):
            if block.indices[k] == j:
                diagonal[j] = block.data[k]
            elif block.indices[k] == j + 1:
                upper[j] = block.data[k]
    return diagonal, upper


def sweep(matrix: csr_matrix, columns: int) -> np.ndarray:
    """Interface block (2 nx, 2 nx) of the inverse of `matrix`, unknowns (x, inward) column by column.

    matrix: symmetric positive definite, (columns * size) square, its first two unknowns of a column at the interface.
    Cost about columns^2 * size^2 * 2 flop. LinAlgError when the matrix is not positive definite.
    """
    return _swept(*_blocks(matrix, columns))


def mirrored_sweep(matrix: csr_matrix, columns: int) -> np.ndarray:
    """Interface block of the inverse as `sweep` finds it, at half the cost, for a piece that is its own mirror image.

    Two kinds of motion do not mix: those that are even inward and odd along x, and those the other way round. Each is
    the motion of the right half. Where a column stands in the middle, its forbidden unknowns are held; else the left
    neighbour of the first column is its own image. A force on the right is half the sum of its even and its odd pair.
    """
    diagonal, upper = _blocks(matrix, columns)
    middle = columns // 2
    sign = np.tile([-1.0, 1.0], columns - middle)  # parity of (along x, inward) in even motion
    halves = [_half(diagonal[middle:], upper[middle:], None if columns % 2 else upper[middle - 1], held)
              for held in (0, 1)]
    same, across = halves[0] + halves[1], sign[:, None] * (halves[0] - halves[1])
    right = slice(2 * middle, None)
    out = np.empty((2 * columns, 2 * columns))
    out[right, right] = same
    flip = (np.arange(columns)[::-1, None] * 2 + [0, 1]).ravel()
    left = flip[right]
    out[np.ix_(left, np.arange(2 * columns)[right])] = across
    out[np.ix_(np.arange(2 * columns)[right], left)] = across.T
    out[np.ix_(left, left)] = sign[:, None] * same * sign
    return out


def _half(diagonal, upper, bridge, held: int) -> np.ndarray:
    """Half the compliance of the right half in one kind of motion: even (held 0: nothing moves along x in the middle)
    or odd.

    bridge: the block between the two middle columns, None where one column stands in the middle.
    """
    size = diagonal.shape[1]
    first, rest = diagonal[0].copy(), upper
    if bridge is not None:
        first += (1 - 2 * held) * np.tile([-1.0, 1.0], size // 2)[:, None] * bridge
        return _swept(np.concatenate([first[None], diagonal[1:]]), upper) / 2
    first /= 2
    gone = np.arange(held, size, 2)
    strength = np.abs(np.diag(first)).max()
    first[gone], first[:, gone] = 0.0, 0.0
    first[gone, gone] = strength
    if len(upper):
        rest = upper.copy()
        rest[0][gone] = 0.0
    half = _swept(np.concatenate([first[None], diagonal[1:]]), rest)
    half[held], half[:, held] = 0.0, 0.0
    return half / 2


def _swept(diagonal, upper) -> np.ndarray:
    columns, size = diagonal.shape[:2]
    with one_thread():
        right = np.empty_like(diagonal)
        propagate = np.empty_like(upper)
        right[-1] = diagonal[-1]
        for j in range(columns - 2, -1, -1):
            propagate[j] = -cho_solve(cho_factor(right[j + 1], lower=True), upper[j].T)
            right[j] = diagonal[j] + upper[j] @ propagate[j]
        out = np.empty((2 * columns, 2 * columns))
        state = np.empty((size, 2 * columns))
        left = diagonal[0]
        two = np.eye(size, 2)
        for j in range(columns):
            if j:
                left = diagonal[j] - upper[j - 1].T @ cho_solve(cho_factor(left, lower=True), upper[j - 1])
                state[:, :2 * j] = propagate[j - 1] @ state[:, :2 * j]
            here = cho_factor(left + right[j] - diagonal[j], lower=True)
            state[:, 2 * j:2 * j + 2] = cho_solve(here, two)
            out[2 * j:2 * j + 2, :2 * j + 2] = state[:2, :2 * j + 2]
            out[:2 * j, 2 * j:2 * j + 2] = out[2 * j:2 * j + 2, :2 * j].T
    return (out + out.T) / 2
