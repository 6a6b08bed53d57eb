"""Static contact of many cases of one pair of pieces, pressed by rigid holders.

Case i closes the nodes by u = delta + q x - g_i, with the approach delta, the rotation q and the gap g_i, which is a
combination of the gap shapes of a `SetTable`. Its contact set is found by the primal-dual active-set method (Hintermüller,
Ito, Kunisch 2003) for all cases at once: in a round, nodes under tension leave and nodes that overlap enter the set of each
case. On a set, the balance of load and moment is a system of two equations for delta and q:

    [F_11 F_1x    ] [delta]   [N + F_1 a]
    [F_1x F_xx + K] [q    ] = [M + F_x a],

with the resultants F of the forces per unit of each column, the amplitudes a of the shapes, and the stiffness K of the
holder. The method may cycle; a case that has no set after 40 rounds is solved alone (`unilateral.solve`).
"""

from typing import NamedTuple

import numpy as np

from .set_table import SetTable

# Smallest load [N] or overlap [m] for which the products in the check of a solution do not underflow
MIN_COMPUTABLE_LOAD = 1e-200
# Rounding error of an opening, relative to the sum of the magnitudes of its terms
OPENING_ROUND_OFF = 1e-13
# Largest relative residual of a solved case; that of a wrong set is 1e-9 or more
MAX_RESIDUAL = 1e-12


class Holders(NamedTuple):
    """Loads and prescribed motions of n rigid holders, or numbers of a single one.

    - load (n,): normal load [N]; NaN where the approach is prescribed.
    - approach (n,): prescribed approach [m]; NaN under a load.
    - moment (n,): moment about x = 0 [N m] of a free rotation; NaN where the rotation is prescribed.
    - spring (n,): stiffness [N m/rad] of the holder against the rotation.
    """

    load: np.ndarray | float
    approach: np.ndarray | float = np.nan
    moment: np.ndarray | float = np.nan
    spring: np.ndarray | float = 0.0

    def take(self, rows) -> "Holders":
        """Return selected holders; `rows` are indices or a mask (n,)."""
        return Holders(*(column[rows] for column in self))

    @property
    def can_rotate(self) -> np.ndarray:
        """Whether the rotation is free (n,)."""
        return ~np.isnan(self.moment)

    def are_computable(self, smallest_gap: np.ndarray) -> np.ndarray:
        """Return whether numbers represent the loads and overlaps (n,); `smallest_gap` (n,) [m] is that without load."""
        is_prescribed = np.isnan(self.load)
        size = np.where(is_prescribed, self.approach - smallest_gap, self.load)
        is_open = (size == 0) | (is_prescribed & (size < 0))
        return is_open | ((size >= MIN_COMPUTABLE_LOAD) & (size <= 1 / MIN_COMPUTABLE_LOAD))


class PressedSets(NamedTuple):
    """Contact of n cases as sets of a `SetTable`.

    - slot (n,): number of the contact set; -1 of a case that is not solved.
    - closing (n, q): coefficients of the columns: approach [m], rotation -theta [rad], minus the amplitudes of the shapes.
    - residual (n,): largest relative residual of the openings in contact and of the balances.
    """

    slot: np.ndarray
    closing: np.ndarray
    residual: np.ndarray

    @property
    def is_solved(self) -> np.ndarray:
        """Whether the contact conditions hold to round-off (n,)."""
        return (self.slot >= 0) & (self.residual <= MAX_RESIDUAL)


def press_on_table(table: SetTable, holders: Holders, amplitudes, start) -> PressedSets:
    """Find the contact set and the motion of the holder of each case.

    Temporary arrays have the shape (n, q, m).

    Parameters
    ----------
    table : SetTable
        Contact sets; its first two columns are 1 and x, the other p are the gap shapes.
    holders : Holders
        n holders.
    amplitudes : (n, p) ndarray
        Factors of the gap shapes.
    start : (n, m) bool ndarray
        First contact sets; an empty one is replaced by a guess.

    Returns
    -------
    PressedSets
    """
    # Pieces that touch without load have the approach of their smallest gap
    is_touching = holders.load == 0
    if is_touching.any():
        touching = (amplitudes @ table.columns[2:]).min(axis=1)
        approach = np.where(is_touching, touching, holders.approach)
        load = np.where(is_touching, np.nan, holders.load)
        moment = np.where(is_touching, np.nan, holders.moment)
        holders = holders._replace(load=load, approach=approach, moment=moment)

    n_cases = len(amplitudes)
    slot = np.full(n_cases, -1)
    closing = np.zeros((n_cases, len(table.columns)))
    closing[:, 2:] = -amplitudes
    active = start.copy()

    todo = np.arange(n_cases)
    # After 40 rounds a case counts as cycling; 3 to 20 are usual
    for _ in range(40):
        _complete_sets(table, holders.take(todo), amplitudes, active, todo)
        found = table.find_slots(active[todo])
        is_regular = found >= 0
        todo = todo[is_regular]
        found = found[is_regular]
        closing[todo] = _balance(table, holders.take(todo), found, closing[todo])
        wrong = _find_wrong_nodes(table, found, closing[todo])
        active[todo] ^= wrong
        is_done = ~wrong.any(axis=1)
        slot[todo[is_done]] = found[is_done]
        todo = todo[~is_done]
        if not todo.size:
            break

    residual = np.full(n_cases, np.inf)
    solved = np.flatnonzero(slot >= 0)
    closing[solved], residual[solved] = _refine_balance(
        table, holders.take(solved), slot[solved], closing[solved]
    )
    return PressedSets(slot, closing, residual)


def _complete_sets(table: SetTable, holders: Holders, amplitudes, active, rows) -> None:
    """Add nodes to the contact sets of some cases until they can carry the load, in place.

    An empty set under a load gets the nodes whose gap is below the closing of soft pieces, the geometric mean of the
    deflections under a point load and under a uniform load, or all nodes under a free rotation. Where a set does not reach
    to both sides of the load line of a free rotation, the node of the smallest gap on each side is added.

    `active` (n, m) are the sets of all cases, and `rows` the numbers of the cases of `holders`.
    """
    is_empty = ~active[rows].any(axis=1)
    is_free = holders.can_rotate & (holders.spring == 0)
    if not (is_empty.any() or is_free.any()):
        return
    x = table.columns[1]
    compliance = table.compliance
    gap = amplitudes[rows] @ table.columns[2:]

    unit_depth = np.sqrt(np.abs(compliance.diagonal().mean() * compliance.mean()))
    limit = gap.min(axis=1) + unit_depth * holders.load
    limit = np.where(np.isnan(holders.load), holders.approach, limit)
    is_guess = (gap <= limit[:, None]) | holders.can_rotate[:, None]
    is_guess &= ~np.isnan(holders.load)[:, None] | (gap < limit[:, None])
    active[rows[is_empty]] = is_guess[is_empty]

    # A load line between the outermost nodes in contact determines the rotation
    for k in np.flatnonzero(is_free):
        own = active[rows[k]]
        load_line = holders.moment[k] / holders.load[k]
        position = x[own]
        if position.size > 1 and position[0] <= load_line <= position[-1]:
            continue
        for is_side in (x <= load_line, x > load_line):
            own[np.argmin(np.where(is_side, gap[k], np.inf))] = True


def _balance(table: SetTable, holders: Holders, slots, closing) -> np.ndarray:
    """Return coefficients (n, q) of the columns whose forces on given sets balance load and moment.

    Parameters
    ----------
    table : SetTable
        Contact sets.
    holders : Holders
        Loads of the cases.
    slots : (n,) ndarray
        Contact sets.
    closing : (n, q) ndarray
        Coefficients, of which the first two are replaced.
    """
    resultants = table.work[slots]
    shapes = np.einsum("nq,nrq->nr", closing[:, 2:], resultants[:, :, 2:])
    missing = np.stack([holders.load, holders.moment], axis=1) - shapes
    out = closing.copy()
    out[:, :2] = _solve_motion(resultants, holders, missing)
    out[:, 0] = np.where(np.isnan(holders.load), holders.approach, out[:, 0])
    return out


def _solve_motion(resultants, holders: Holders, missing) -> np.ndarray:
    """Return approach and rotation (n, 2) whose forces are the missing load and moment (n, 2).

    A prescribed rotation does not change, and neither does a prescribed approach, whose change is NaN. `resultants`
    (n, 2, q) are load and moment per unit of each column.
    """
    by_approach = resultants[:, 0, 0]
    by_rotation = resultants[:, 1, 1] + holders.spring
    mixed = resultants[:, 0, 1]
    load, moment = missing.T
    with np.errstate(divide="ignore", invalid="ignore"):
        approach = load / by_approach
        rotation = np.zeros_like(approach)
        is_free = holders.can_rotate
        if is_free.any():
            determinant = by_approach * by_rotation - mixed**2
            free_approach = (by_rotation * load - mixed * moment) / determinant
            free_rotation = (by_approach * moment - mixed * load) / determinant
            approach = np.where(is_free, free_approach, approach)
            rotation = np.where(is_free, free_rotation, rotation)
    return np.stack([approach, rotation], axis=1)


def _find_wrong_nodes(table: SetTable, slots, closing) -> np.ndarray:
    """Return the nodes (n, m) in contact under tension and the open nodes that overlap by more than round-off."""
    scale = np.abs(closing) @ np.abs(table.columns)
    limit = np.where(table.active[slots], 0.0, -OPENING_ROUND_OFF * scale)
    return ~(table.combine(slots, closing) >= limit)


def _refine_balance(
    table: SetTable, holders: Holders, slots, closing
) -> tuple[np.ndarray, np.ndarray]:
    """Correct the motion by what the summed forces do not balance; return coefficients (n, q) and residuals (n,).

    The residual is the larger one of the imbalance of load and moment, relative to the load and the load times the length,
    and of the rounding errors of the openings in contact, relative to the smallest sum of magnitudes of their terms.

    Parameters
    ----------
    table : SetTable
        Contact sets.
    holders : Holders
        Loads of the cases.
    slots : (n,) ndarray
        Contact sets.
    closing : (n, q) ndarray
        Coefficients of the columns.
    """
    active = table.active[slots]
    x = table.columns[1]

    def find_force(coefficients) -> np.ndarray:
        """Return the nodal forces (n, m) [N]."""
        return np.where(active, table.combine(slots, coefficients), 0.0)

    def find_missing(force, rotation) -> np.ndarray:
        """Return load and moment (n, 2) that forces (n, m) [N] and springs at a rotation (n,) [rad] do not balance."""
        with np.errstate(invalid="ignore"):  # of an infinite load
            load = holders.load - force.sum(axis=1)
            moment = holders.moment - force @ x - holders.spring * rotation
        return np.stack([load, moment], axis=1)

    missing = find_missing(find_force(closing), closing[:, 1])
    change = _solve_motion(table.work[slots], holders, missing)
    closing = closing.copy()
    closing[:, :2] += np.where(np.isnan(change), 0.0, change)

    # Residuals of what is prescribed
    force = find_force(closing)
    missing = np.abs(find_missing(force, closing[:, 1]))
    moment_scale = holders.load * np.ptp(x) + np.abs(holders.spring * closing[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        balance = np.fmax(missing[:, 0] / holders.load, missing[:, 1] / moment_scale)
        terms = np.abs(closing) @ np.abs(table.columns)
        smallest = np.where(active, terms, np.inf).min(axis=1)
        opening = (np.abs(closing) * table.round_off[slots]).sum(axis=1) / smallest
    residual = np.fmax(np.fmax(balance, opening), 0.0)

    # A single node in contact does not determine a free rotation; others may carry round-off
    is_determined = np.isfinite(closing).all(axis=1)
    is_free = holders.can_rotate & (holders.spring == 0)
    n_loaded = np.count_nonzero(force > MAX_RESIDUAL * holders.load[:, None], axis=1)
    is_determined &= ~is_free | (n_loaded > 1)
    return closing, np.where(is_determined, residual, np.inf)
