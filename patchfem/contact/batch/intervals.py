"""Contacts on a single run of consecutive nodes: simultaneous solution of many cases with one compliance.

Flat, tilted and crowned pieces touch on a single stretch under any load, wherever the load line is. The pass goes over
the left ends of the stretches. Cases that begin at the same node share its Cholesky factor (`interval_kernels`) and are
solved together by BLAS. `unilateral.solve` is the twin for single cases.
"""

from typing import NamedTuple

import numpy as np

from ... import compiled
from ...elasticity.lapack import dtrsm
from ..active_set import OPENING_NOISE
from ..edges import edge_offset, parabola_change
from ..strip_compliance import factorise
from ..unilateral import RESIDUAL_TOL
from .arrays import Cases, NestedStretches, make_cases

kernels = compiled.load("contact.batch.interval_kernels")
# Largest number of left ends that are tried from a known bracket before all others are tried
MAX_LEFT_ENDS = 12
# Smallest number of nodes for which the contacts are first located on a coarser interface
MIN_COARSE_NODES = 40
COARSENING_FACTOR = 4  # ratio of the numbers of nodes of the original and the coarser interface
# Number of cases that are solved together; their forces fit into the processor cache
BATCH_SIZE = 256
# Smallest number of nodes in contact for which a stiffness is interpolated between contact sets
MIN_PARABOLA_NODES = 3


class ContactBatch(NamedTuple):
    """Contact solutions for q cases: nodes in contact, forces, gaps and holder motions.

    - first, stop (q,): the nodes in contact, from `first` on and before `stop`.
    - force (q, m) [N]; opening (q, m) [m]; closing (q,) [m]; theta (q,) [rad].
    - fractions (q, 2): fraction of the cell beyond the left and the right end that the edge has passed, as
      in `edges.ContactEdge`.
    - residual (q,): largest relative residual; infinite if the contact is not a single stretch.
    """

    first: np.ndarray
    stop: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    closing: np.ndarray
    theta: np.ndarray
    fractions: np.ndarray
    residual: np.ndarray

    @property
    def n_nodes(self) -> np.ndarray:
        """Number of nodes in contact (q,)."""
        return self.stop - self.first


class _LeftEndSolutions(NamedTuple):
    """Solutions of n cases in which the first node in contact is the same.

    - lower (k, k): lower Cholesky factor of the compliance of the k nodes from `left_end` on.
    - force (n, k); stop (n,): ends of the contacts; motion (n, 2): closing [m] and theta [rad].
    """

    left_end: int
    lower: np.ndarray
    force: np.ndarray
    stop: np.ndarray
    motion: np.ndarray


class Intervals:
    """Interface on which the nodes in contact are always consecutive.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance [m/N].
    x : (m,) ndarray
        Positions [m].
    """

    def __init__(self, c: np.ndarray, x: np.ndarray):
        self.c = np.ascontiguousarray(c)
        self.x = np.ascontiguousarray(x)
        # These are the sums of `arrays.NestedStretches`; they are filled for the left ends that
        # were visited.
        self.sums = np.zeros((x.size + 1, 3, x.size + 1))

    def press(self, gap, load, moment=None, spring=0.0, brackets=None) -> ContactBatch:
        """Solve the contact problems for q cases.

        Parameters
        ----------
        gap : (q, m) ndarray
            Gaps [m].
        load : (q,) ndarray
            Loads [N].
        moment : (q,) ndarray, optional
            Moments about x = 0 [N m] of pieces that are free to rotate; without them the rotation is
            prescribed and contained in the gap.
        spring : float or (q,) ndarray
            Stiffness of the holder against the rotation [N m/rad].
        brackets : tuple of (q,) ndarray, optional
            First node and end of stretches that are expected to contain the contacts.

        Returns
        -------
        ContactBatch
            `residual` shows whether a contact is a single stretch.
        """
        is_free = moment is not None
        columns = np.broadcast_arrays(load, moment if is_free else 0.0, spring)
        return self._press(gap, np.stack(columns, axis=1).astype(float), brackets, is_free=is_free)

    def _press(self, gap, loads: np.ndarray, brackets, *, is_free: bool) -> ContactBatch:
        n_cases, m = gap.shape
        gap = np.ascontiguousarray(gap)
        all_nodes = ((0,), (m,))
        if brackets is None:
            brackets = all_nodes
            if m > MIN_COARSE_NODES:
                brackets = self._bracket_on_coarse_grid(gap, loads, is_free=is_free)
        first, stop = np.clip(brackets, [[0], [1]], [[m - 1], [m]])
        first_try = np.broadcast_to(first, n_cases).astype(int)
        is_known = first_try.any()
        cases = make_cases(first_try, np.broadcast_to(stop, n_cases).astype(int), gap, loads)
        n_tries = MAX_LEFT_ENDS if is_known else m
        self._solve_all(cases, int(first_try.min()) - 1, 0, n_tries, is_free=is_free)
        displacement = cases.solutions.force @ self.c
        opening = self._opening(gap, displacement, cases.solutions.motion)
        nodes = np.arange(m)
        in_contact = (nodes >= cases.solutions.first[:, None]) & (
            nodes < cases.solutions.stop[:, None]
        )
        residual = self._residual(cases, displacement, opening, is_free=is_free)
        contacts = ContactBatch(
            first=cases.solutions.first,
            stop=cases.solutions.stop,
            force=cases.solutions.force,
            opening=np.where(in_contact, 0.0, np.maximum(opening, 0.0)),
            closing=cases.solutions.motion[:, 0],
            theta=cases.solutions.motion[:, 1],
            fractions=self._edge_fractions(cases, opening),
            residual=np.where(cases.solutions.stop > 0, residual, np.inf),
        )
        failed_cases = np.flatnonzero(~(contacts.residual <= RESIDUAL_TOL))
        if is_known and failed_cases.size:
            new_contacts = self._press(
                gap[failed_cases], loads[failed_cases], all_nodes, is_free=is_free
            )
            for values, new_values in zip(contacts, new_contacts):
                values[failed_cases] = new_values
        return contacts

    def _bracket_on_coarse_grid(self, gap, loads, *, is_free: bool) -> tuple:
        """Find brackets of the contact in q cases by solving them on a coarser grid.

        The brackets follow from the contacts on a coarse interface.
        """
        coarse = Intervals(
            self.c[::COARSENING_FACTOR, ::COARSENING_FACTOR], self.x[::COARSENING_FACTOR]
        )
        contacts = coarse._press(gap[:, ::COARSENING_FACTOR], loads, None, is_free=is_free)
        has_end = contacts.stop > 0
        first = np.where(has_end, COARSENING_FACTOR * (contacts.first - 1), 0)
        stop = np.where(has_end, COARSENING_FACTOR * contacts.stop + 2, self.x.size)
        return first, stop

    def fill_sums(self, first: np.ndarray) -> None:
        """Compute the sums for contacts whose first node is one of the given nodes (q,) or next to one."""
        no_nodes = np.zeros(0, int)
        cases = make_cases(no_nodes, no_nodes, np.zeros((0, self.x.size)), np.zeros((0, 3)))
        self._solve_all(cases, int(first.min()) - 1, int(first.max()) + 1, 1, is_free=False)

    def _solve_all(self, cases: Cases, low: int, high: int, n_tries: int, *, is_free: bool) -> None:
        """Solve all cases and precompute the sums that later calls reuse.

        These are the left ends from `low` to `high` and those beside every stretch.

        n_tries: number of left ends that are tried for a case.
        """
        m = self.x.size
        a = max(low, 0)
        upper = np.zeros((m, m))
        upper[a:, a:] = factorise(self.c[a:, a:].copy()).T
        stretches = NestedStretches(
            self.c, self.x, upper, np.zeros((2, m)), self.sums, workspace=np.zeros(m)
        )
        kernels.move_left_end(stretches, a, a, 1)
        # For each case this is the left end to try next, or m once the case is solved.
        next_try = np.minimum(cases.first_try, m)
        while (left_end := int(next_try.min(initial=m))) < m:
            if left_end > a:
                kernels.move_left_end(stretches, a, left_end, 0)
            a = left_end
            case_indices = np.flatnonzero(next_try == a)
            case_indices = case_indices[np.argsort(cases.end_limit[case_indices], kind="stable")]
            for start in range(0, case_indices.size, BATCH_SIZE):
                indices = case_indices[start : start + BATCH_SIZE]
                next_try[indices] = self._try_left_end(
                    stretches, cases, indices, a, is_free=is_free
                )
            if (cases.solutions.stop[case_indices] > 0).any():
                high = max(high, a + 1)
            next_try[next_try >= cases.first_try + n_tries] = m
        if min(high, m - 1) > a:
            kernels.move_left_end(stretches, a, min(high, m - 1), 0)

    def _try_left_end(
        self, stretches, cases: Cases, indices, a: int, *, is_free: bool
    ) -> np.ndarray:
        """Try to solve cases with a given first node in contact; return the node to try next for each."""
        m = self.x.size
        limits = np.minimum(cases.end_limit[indices], m)
        nodes = slice(a, max(int(limits.max()), a + 1))
        lower = np.asfortranarray(stretches.upper[nodes, nodes].T)
        y = _substitute(lower, cases.gap[indices, nodes])
        stop = np.zeros(indices.size, int)
        motion = np.zeros((indices.size, 2))
        kernels.solve_ends(
            stretches, a, y, limits, cases.loads[indices], stop, motion, int(is_free)
        )
        force = _substitute(lower, y, is_backward=True)
        is_solved = (stop > 0) & (force[:, 0] > 0)
        # A case without a contact end before its limit is solved again with the limit at the last
        # node.
        is_cut = (stop == 0) & (limits < m)
        cases.end_limit[indices[is_cut]] = m
        if is_solved.any():
            group = _LeftEndSolutions(
                a, lower, force[is_solved], stop[is_solved], motion=motion[is_solved]
            )
            self._store_solutions(stretches, cases, indices[is_solved], group, is_free=is_free)
        return np.where(is_solved, m, np.where(is_cut, a, a + 1))

    def _store_solutions(
        self, stretches, cases: Cases, indices, group: _LeftEndSolutions, *, is_free: bool
    ) -> None:
        """Apply one step of iterative refinement to the solutions of some cases, and store them."""
        a = group.left_end
        stop = group.stop
        nodes = slice(a, a + group.force.shape[1])
        x = self.x[nodes]
        in_contact = np.arange(nodes.start, nodes.stop) < stop[:, None]
        imbalance = cases.loads[indices].copy()
        imbalance[:, 0] -= group.force.sum(axis=1)
        imbalance[:, 1] += imbalance[:, 2] * group.motion[:, 1] - group.force @ x
        displacement = group.force @ self.c[nodes, nodes]
        opening = self._opening(cases.gap[indices, nodes], displacement, group.motion, x)
        y = _substitute(group.lower, in_contact * opening)
        motion_change = np.zeros_like(group.motion)
        kernels.solve_ends(stretches, a, y, stop, imbalance, stop, motion_change, int(is_free))
        force = group.force + _substitute(group.lower, y, is_backward=True)
        cases.solutions.force[indices, nodes] = force
        cases.solutions.motion[indices] = group.motion + motion_change
        cases.solutions.first[indices] = a
        cases.solutions.stop[indices] = stop
        unit = stretches.unit[0]
        pivots = stretches.upper.diagonal()
        inside = np.flatnonzero(stop < self.x.size)
        end = stop[inside]
        last_force = force[inside, end - 1 - a]
        cases.solutions.leaving[indices[inside], 1] = last_force * pivots[end - 1] / unit[end - 1]
        cases.solutions.gap_rate[indices[inside], 1] = pivots[end] * unit[end]
        if a > 0:
            force_rate = _substitute(group.lower, in_contact * unit[nodes], is_backward=True)
            cases.solutions.leaving[indices, 0] = force[:, 0] / force_rate[:, 0]
            cases.solutions.gap_rate[indices, 0] = 1 - force_rate @ self.c[nodes, a - 1]

    def edge_positions(self, contacts: ContactBatch, softness, row_height: float) -> np.ndarray:
        """Return the positions (2, q) [m] of both contact edges, which may lie between nodes.

        An end of the interface that is in contact is an edge.

        Parameters
        ----------
        contacts : ContactBatch
        softness : (m,) ndarray
            Compliance [m/N] of the asperity layer alone; 0 without asperities.
        row_height : float
            Height [m] of the first row of cells.
        """
        x = self.x
        m = x.size
        elastic_fraction = 1 - softness / self.c.diagonal()
        positions = []
        ends = ((contacts.first, -1), (contacts.stop - 1, 1))
        for (node, side), fraction in zip(ends, contacts.fractions.T):
            outer, inner = np.clip([node + side, node - side], 0, m - 1)
            is_border = outer == node
            outer_cell = np.abs(x[node] - x[np.where(is_border, inner, outer)])
            inner_cell = np.abs(x[node] - x[np.where(inner == node, outer, inner)])
            offset = elastic_fraction[node] * edge_offset(
                inner_cell, outer_cell, fraction, row_height
            )
            inner_position = x[node] + fraction * (x[outer] - x[node]) - side * offset
            positions.append(np.where(is_border, x[node], inner_position))
        return np.clip(positions, x[0], x[-1])

    def stiffness(self, contacts: ContactBatch, *, is_rotation: bool = False) -> np.ndarray:
        """Return the contact stiffnesses (q,) for edges that lie between the nodes.

        The edges of the contacts lie between nodes. The stiffnesses are those of a translation [N/m], or of a rotation
        about x = 0 [N m/rad].
        """
        sums = self.sums[:, 2 if is_rotation else 0]
        m = self.x.size
        first = contacts.first
        stop = contacts.stop
        set_stiffness = sums[first, stop]
        is_long = contacts.n_nodes >= MIN_PARABOLA_NODES
        left_change = parabola_change(
            contacts.fractions[:, 0] - 0.5,
            sums[np.maximum(first - 1, 0), stop] - set_stiffness,
            set_stiffness - sums[np.minimum(first + 1, m), stop],
        )
        right_change = parabola_change(
            contacts.fractions[:, 1] - 0.5,
            sums[first, np.minimum(stop + 1, m)] - set_stiffness,
            set_stiffness - sums[first, np.maximum(stop - 1, 0)],
        )
        stiffness = set_stiffness + np.where((first > 0) & is_long, left_change, 0.0)
        return stiffness + np.where((stop < m) & is_long, right_change, 0.0)

    def _opening(self, gap, displacement, motion, x=None) -> np.ndarray:
        """Return the gaps under load (q, m) [m] at given positions or at all nodes."""
        x = self.x if x is None else x
        return gap + motion[:, 1:] * x - motion[:, :1] + displacement

    def _edge_fractions(self, cases: Cases, opening) -> np.ndarray:
        """Return `ContactBatch.fractions`; a fraction is 1/2 where the solution does not determine it."""
        m = self.x.size
        neighbour = np.stack([cases.solutions.first - 1, cases.solutions.stop], axis=1)
        has_neighbour = (neighbour >= 0) & (neighbour < m)
        rows = np.arange(len(neighbour))[:, None]
        gaps = np.where(has_neighbour, opening[rows, np.clip(neighbour, 0, m - 1)], 0.0)
        entering = gaps / cases.solutions.gap_rate
        leaving = cases.solutions.leaving
        is_valid = (leaving >= 0) & (entering >= 0) & (leaving + entering > 0)
        fractions = np.full(leaving.shape, 0.5)
        return np.divide(leaving, leaving + entering, out=fractions, where=is_valid)

    def _residual(self, cases: Cases, displacement, opening, *, is_free: bool) -> np.ndarray:
        """Return the largest relative residual (q,) of the contact conditions.

        An overlap within OPENING_NOISE of its terms counts as 0.
        """
        load, moment, spring = cases.loads.T
        closing, theta = cases.solutions.motion.T
        force = cases.solutions.force
        scale = np.abs(cases.gap) + np.abs(theta[:, None] * self.x)
        scale = scale + np.abs(closing)[:, None] + np.abs(displacement)
        relative_opening = opening / np.where(scale > 0, scale, 1.0)
        overlap = np.maximum(-relative_opening - OPENING_NOISE, 0.0)
        residuals = [
            np.abs(force.sum(axis=1) - load) / load,
            np.maximum(-force.min(axis=1), 0.0) / load,
            np.where(force != 0, 0.0, overlap).max(axis=1),
            np.abs(force * relative_opening).sum(axis=1) / load,
        ]
        if is_free:
            imbalance = np.abs(force @ self.x - moment - spring * theta)
            residuals.append(imbalance / (load * np.ptp(self.x) + np.abs(spring * theta)))
        largest = np.max(residuals, axis=0)
        return np.where(np.isfinite(largest), largest, np.inf)


def _substitute(lower: np.ndarray, rows: np.ndarray, *, is_backward: bool = False) -> np.ndarray:
    """Solve triangular systems for each of the rows (n, k) by substitution."""
    right_sides = np.ascontiguousarray(rows).T
    return dtrsm(1.0, lower, right_sides, lower=1, trans_a=int(is_backward), overwrite_b=1).T
