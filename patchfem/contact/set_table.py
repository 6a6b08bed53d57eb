"""Table of contact sets that many cases share.

On a set A of nodes in contact the nodal forces f_A and the openings w of the other nodes are linear in the closing of the
nodes. The closing of a case is a combination of q columns: 1 for the approach, x for the rotation, and the gap shapes. So
the forces and openings per unit of each column are computed once per set, with one Cholesky factor, and every case on this
set is a combination of them:

    C_AA f_A = u_A,    w = C f - u    for each column u.

A node with b degrees of freedom (the normal and the shear force of a node between unlike pieces) enters the set with all
of them.

Letters of array shapes: m nodes, b degrees of freedom per node, q columns, s sets, n cases, e ends of a set.
"""

from typing import NamedTuple

import numpy as np

from ..elasticity.lapack import dpotrf, dpotrs

N_FIRST_SLOTS = 8  # number of sets for which a table has memory at first; it is doubled when needed


class SetEnds(NamedTuple):
    """Ends of n contact sets inside the interface, by increasing x; sets with fewer than e ends have sides of 0.

    - node (n, e): last node in contact.
    - side (n, e): 1 where the contact ends towards +x, -1 towards -x, 0 where there is no end.
    """

    node: np.ndarray
    side: np.ndarray

    @property
    def exists(self) -> np.ndarray:
        """Whether there is an end (n, e)."""
        return self.side != 0


def find_set_ends(active: np.ndarray) -> SetEnds:
    """Return the ends of contact sets (n, m) of bool."""
    changes = active[:, 1:] != active[:, :-1]
    counts = changes.sum(axis=1)
    node = np.zeros((len(active), int(counts.max(initial=0))), int)
    side = np.zeros_like(node)
    row, cell = np.nonzero(changes)
    number = np.arange(row.size) - np.repeat(np.cumsum(counts) - counts, counts)
    ends_to_the_right = active[row, cell]
    node[row, number] = cell + ~ends_to_the_right
    side[row, number] = np.where(ends_to_the_right, 1, -1)
    return SetEnds(node, side)


class SetSolution(NamedTuple):
    """Forces and openings of one contact set per unit of each column, and what its stiffness gains or loses at its ends.

    - force (q, b m): forces [N per unit] of the nodes in contact, 0 elsewhere.
    - opening (q, b m): openings [m per unit] of the other nodes; in contact the rounding errors.
    - gain, loss (e, q): increase of the stiffness by the node beyond each end, and decrease without the last node before
      it.
    """

    force: np.ndarray
    opening: np.ndarray
    gain: np.ndarray
    loss: np.ndarray


def solve_set(compliance, active, columns, *, with_ends: bool = True) -> SetSolution:
    """Solve for the forces on one contact set that cause each column of displacements.

    A node more at an end adds r S^-1 r to the stiffness of a column, with its opening r and the Schur complement S of its
    compliance; the loss of the last node takes f (B^-1) f, with its force f and the block B of the inverse compliance.
    Neither counts for fewer than three nodes.

    Parameters
    ----------
    compliance : (b m, b m) ndarray
        Compliance [m/N], positive definite; all nodes of the first degree of freedom come first.
    active : (m,) bool ndarray
        Nodes in contact.
    columns : (q, b m) ndarray
        Displacements.
    with_ends : bool
        Whether to compute gain and loss at the ends; without them e is 0.

    Returns
    -------
    SetSolution

    Raises
    ------
    LinAlgError
        If the compliance is not positive definite on the set.
    """
    n_nodes = active.size
    n_dofs = len(compliance) // n_nodes
    n_columns = len(columns)
    force = np.zeros(columns.shape)
    nodes = np.flatnonzero(active)
    if not nodes.size:
        return SetSolution(force, -columns, np.zeros((0, n_columns)), np.zeros((0, n_columns)))
    ends = SetEnds(np.zeros((1, 0), int), np.zeros((1, 0), int))
    if with_ends:
        ends = find_set_ends(active[None])
    n_ends = ends.node.shape[1]

    # Degrees of freedom (e, b) beyond and before each end, and those of the set
    shifts = n_nodes * np.arange(n_dofs)
    index = (nodes + shifts[:, None]).ravel()
    outer = (ends.node[0] + ends.side[0])[:, None] + shifts
    inner = np.searchsorted(nodes, ends.node[0])[:, None] + nodes.size * np.arange(n_dofs)

    # A slice copies a block of neighbouring nodes faster than indices do
    is_interval = n_dofs == 1 and nodes[-1] - nodes[0] == nodes.size - 1
    rows = slice(nodes[0], nodes[-1] + 1) if is_interval else index
    block = compliance[rows, rows].copy() if is_interval else compliance[index[:, None], index]
    factor, info = dpotrf(block.T, lower=1, overwrite_a=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("not positive definite")

    # Right sides: the columns, the compliance beyond each end, and a unit displacement before it
    n_end_dofs = n_ends * n_dofs
    right = np.zeros((index.size, n_columns + 2 * n_end_dofs), order="F")
    right[:, :n_columns] = columns[:, rows].T
    right[:, n_columns : n_columns + n_end_dofs] = compliance[outer.ravel()][:, rows].T
    right[inner.ravel(), n_columns + n_end_dofs + np.arange(n_end_dofs)] = 1.0
    solved = dpotrs(factor, right, lower=1)[0]

    # One step of iterative refinement leaves openings of round-off in contact
    set_force = solved[:, :n_columns].T
    remainder = set_force @ compliance[rows] - columns
    set_force = set_force - dpotrs(factor, remainder[:, rows].T, lower=1)[0].T
    opening = set_force @ compliance[rows] - columns
    force[:, rows] = set_force
    # The stiffness of larger sets depends on where their ends lie in their cells
    if nodes.size < 3:
        return SetSolution(
            force, opening, np.zeros((n_ends, n_columns)), np.zeros((n_ends, n_columns))
        )

    # Blocks (e, b, b) of the Schur complement beyond, and of the inverse before each end
    beyond = solved[:, n_columns : n_columns + n_end_dofs].reshape(index.size, n_ends, n_dofs)
    coupled = np.einsum("eak,keb->eab", compliance[outer][:, :, rows], beyond)
    schur = compliance[outer[:, :, None], outer[:, None, :]] - coupled
    inverse = solved[inner, n_columns + n_end_dofs :].reshape(n_ends, n_dofs, n_ends, n_dofs)
    own = np.arange(n_ends)
    inverse = inverse[own, :, own]
    return SetSolution(
        force,
        opening,
        gain=_quadratic_form(schur, opening[:, outer]),
        loss=_quadratic_form(inverse, force[:, outer - ends.side[0][:, None]]),
    )


def _quadratic_form(matrices, vectors) -> np.ndarray:
    """Return v M^-1 v (e, q) for matrices (e, b, b) and vectors (q, e, b)."""
    # For a single degree of freedom this takes a tenth of the time of numpy.linalg.solve
    if matrices.shape[1] == 1:
        return (vectors[..., 0] ** 2 / matrices[:, 0, 0]).T
    by_end = np.moveaxis(vectors, 0, -1)
    return (by_end * np.linalg.solve(matrices, by_end)).sum(axis=1)


class SetTable:
    """Contact sets of one compliance, found by their nodes; a set is solved when it is asked for first.

    Parameters
    ----------
    compliance : (b m, b m) ndarray
        Compliance [m/N].
    columns : (q, b m) ndarray
        Columns of which the closings of all cases are combinations.
    n_nodes : int
        Number of nodes m.
    has_ends : bool
        Whether the sets have gains and losses of stiffness at their ends.

    Attributes
    ----------
    active (s, m) : bool ndarray
        Nodes of each set.
    unknown (s, q, b m) : ndarray
        Force [N] of a node in contact, opening [m] of another one, per unit of each column.
    work (s, min(2, q), q) : ndarray
        Work of the forces of each column in the first two columns: with the columns 1 and x, their load and moment.
    round_off (s, q) : ndarray
        Largest opening [m] that is left in contact, per unit of each column.
    """

    def __init__(self, compliance, columns, n_nodes: int, *, has_ends: bool = True):
        self.compliance = compliance
        self.columns = columns
        self.n_nodes = n_nodes
        self.has_ends = has_ends
        self.forget()

    def forget(self) -> None:
        """Discard all sets."""
        n_columns, size = self.columns.shape
        self.n_sets = 0
        self.active = np.zeros((N_FIRST_SLOTS, self.n_nodes), bool)
        self.unknown = np.zeros((N_FIRST_SLOTS, n_columns, size))
        self.work = np.zeros((N_FIRST_SLOTS, min(2, n_columns), n_columns))
        self.round_off = np.zeros((N_FIRST_SLOTS, n_columns))
        self._end_changes: list[tuple[np.ndarray, np.ndarray]] = []
        self._slots: dict[bytes, int] = {}

    def find_slots(self, active: np.ndarray) -> np.ndarray:
        """Return the numbers (n,) of contact sets (n, m) of bool; -1 where the compliance is not positive definite."""
        slots = np.empty(len(active), int)
        for row, key in enumerate(map(bytes, np.packbits(active, axis=1))):
            slot = self._slots.get(key)
            if slot is None:
                slot = self._slots[key] = self._add(active[row])
            slots[row] = slot
        return slots

    def _add(self, active: np.ndarray) -> int:
        """Solve a set (m,) for all columns and store it; return its number."""
        try:
            solution = solve_set(self.compliance, active, self.columns, with_ends=self.has_ends)
        except np.linalg.LinAlgError:
            return -1
        slot = self.n_sets
        if slot == len(self.active):
            for name in ("active", "unknown", "work", "round_off"):
                values = getattr(self, name)
                setattr(self, name, np.concatenate([values, np.zeros_like(values)]))
        is_active = np.tile(active, solution.force.shape[1] // active.size)
        self.active[slot] = active
        self.unknown[slot] = np.where(is_active, solution.force, solution.opening)
        self.work[slot] = self.columns[:2] @ solution.force.T
        self.round_off[slot] = np.abs(solution.opening[:, is_active]).max(axis=1, initial=0.0)
        self._end_changes.append((solution.gain, solution.loss))
        self.n_sets += 1
        return slot

    def combine(self, slots, closing) -> np.ndarray:
        """Return force or opening (n, b m) of each node for sets (n,) and coefficients (n, q) of the columns."""
        return np.einsum("nq,nqm->nm", closing, self.unknown[slots])

    def end_changes(self, slots, column: int, n_ends: int) -> tuple[np.ndarray, np.ndarray]:
        """Return gain and loss (n, e) of the stiffness of a column at the ends of sets (n,), 0 beyond their last end.

        Parameters
        ----------
        slots : (n,) ndarray
            Numbers of the sets.
        column : int
            Number of the column.
        n_ends : int
            Number of ends e, at least that of each set.
        """
        changes = np.zeros((2, len(slots), n_ends))
        for row, slot in enumerate(slots):
            for change, part in zip(changes, self._end_changes[slot]):
                change[row, : len(part)] = part[:, column]
        return changes[0], changes[1]
