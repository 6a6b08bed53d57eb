"""Block-diagonal compliance of strips that lie side by side; a patch is one strip.

All strips share one compliance matrix, to which each strip may add a diagonal of its own (worn nodes do). Vectors over
the nodes of all strips are flat, strip after strip.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..elasticity.lapack import dpotrf, dpotrs


def factorise(matrix: np.ndarray) -> np.ndarray:
    """Compute the lower Cholesky factor of a symmetric matrix, which is overwritten.

    LinAlgError unless the matrix is positive definite.
    """
    lower_factor, info = dpotrf(matrix.T, lower=1, overwrite_a=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("not positive definite")
    return lower_factor


@dataclass(frozen=True, eq=False, slots=True)
class StripCompliance:
    """Compliance of s strips with m nodes each; the matrix of a strip is symmetric positive definite.

    - common (m, m): Compliance [m/N] that all strips share.
    - added (s, m): What each strip adds to the diagonal [m/N].
    """

    common: np.ndarray
    added: np.ndarray | None = None

    @property
    def node_compliance(self) -> float:
        """Mean displacement of a node per force on it [m/N]."""
        mean_added = 0.0 if self.added is None else self.added.mean()
        return float(self.common.diagonal().mean() + mean_added)

    def product(self, force: np.ndarray) -> np.ndarray:
        """Return the displacements C f (n,) [m] under forces f (n,) [N]."""
        strips = force.reshape(-1, len(self.common))
        is_loaded = strips.any(axis=0) if len(strips) > 1 else force
        loaded_nodes = is_loaded.nonzero()[0]
        if not loaded_nodes.size:
            return np.zeros(force.size)
        span = slice(loaded_nodes[0], loaded_nodes[-1] + 1)
        displacement = strips[:, span] @ self.common[span]
        if self.added is not None:
            displacement += self.added * strips
        return displacement.ravel()

    def block(self, strip: int, nodes: np.ndarray) -> np.ndarray:
        """Return a copy of the compliance (k, k) [m/N] between given nodes of one strip."""
        if nodes[-1] - nodes[0] == nodes.size - 1:
            span = slice(nodes[0], nodes[-1] + 1)
            block = self.common[span, span].copy()
        else:
            block = self.common[nodes[:, None], nodes]
        if self.added is not None:
            block[np.diag_indices_from(block)] += self.added[strip, nodes]
        return block

    def solver(self, active: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Factorize the compliance of the active nodes; return a function that solves with it.

        Parameters
        ----------
        active : (n,) bool ndarray
            Nodes whose rows and columns of the compliance are kept; k of them are set.

        Returns
        -------
        callable
            Function (k, c) -> (k, c) that solves for c right-hand sides.

        Raises
        ------
        LinAlgError
            If a block is not positive definite.
        """
        blocks = []
        # Strips with the same active nodes and the same added terms share a factor.
        factors: dict[tuple[bytes, bytes], np.ndarray] = {}
        start = 0
        for strip, is_active in enumerate(active.reshape(-1, len(self.common))):
            nodes = is_active.nonzero()[0]
            if not nodes.size:
                continue
            key = (is_active.tobytes(), b"" if self.added is None else self.added[strip].tobytes())
            if key not in factors:
                factors[key] = factorise(self.block(strip, nodes))
            blocks.append((slice(start, start + nodes.size), factors[key]))
            start += nodes.size

        def solve(right_sides: np.ndarray) -> np.ndarray:
            """Solve with the factors of every strip for right-hand sides (a,) or (a, r) of the active nodes."""
            parts = [dpotrs(factor, right_sides[rows], lower=1)[0] for rows, factor in blocks]
            return parts[0] if len(parts) == 1 else np.concatenate(parts)

        return solve

    def add_to_diagonal(self, diagonal: np.ndarray) -> "StripCompliance":
        """Return the compliance after addition of diagonal terms (m,) [m/N] in every strip."""
        return StripCompliance(self.common + np.diag(diagonal), self.added)
