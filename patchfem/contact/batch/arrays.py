"""Records of the arrays from which compiled functions solve the contacts of many cases."""

from typing import NamedTuple

import numpy as np


class NestedStretches(NamedTuple):
    """Arrays for the solution of contacts in which consecutive nodes touch.

    A stretch is a run of consecutive nodes; the Cholesky factor is kept from its left end on.

    - c (m, m) [m/N]; x (m,) [m].
    - upper (m, m): upper Cholesky factor U of the nodes from the left end on.
    - unit (2, m): U^-T of the vectors 1 and x.
    - sums (m + 1, 3, m + 1): by first node and end of a stretch the sums of unit[0]^2, unit[0] unit[1] and
      unit[1]^2, which are dN/d(closing), -dN/d(theta) and -dM/d(theta).
    - workspace (m,).
    """

    c: np.ndarray
    x: np.ndarray
    upper: np.ndarray
    unit: np.ndarray
    sums: np.ndarray
    workspace: np.ndarray


class CaseSolutions(NamedTuple):
    """Contact solutions for q cases on m nodes.

    - first, stop (q,): the stretch in contact, from `first` on and before `stop`, which is 0 for none.
    - force (q, m) [N].
    - motion (q, 2): closing [m] and rotation theta [rad].
    - leaving (q, 2): for the left and the right end the force of the last node over its increase per
      approach [m]; 0 where the stretch ends with the interface.
    - gap_rate (q, 2): for both ends the decrease of the gap at the next node per approach.
    """

    first: np.ndarray
    stop: np.ndarray
    force: np.ndarray
    motion: np.ndarray
    leaving: np.ndarray
    gap_rate: np.ndarray


class Cases(NamedTuple):
    """Contact problems for q cases, and the arrays to which their solutions are written.

    - first_try (q,): left end that is tried first.
    - end_limit (q,): node before which the contact is expected to end.
    - gap (q, m) [m].
    - loads (q, 3): load [N], moment about x = 0 [N m] and stiffness of the holder [N m/rad].
    - solutions: zeros until a case is solved.
    """

    first_try: np.ndarray
    end_limit: np.ndarray
    gap: np.ndarray
    loads: np.ndarray
    solutions: CaseSolutions


def make_cases(first_try, end_limit, gap, loads) -> Cases:
    """Return q contact problems whose solutions are initialized with zeros.

    Parameters
    ----------
    first_try, end_limit : (q,) int ndarray
    gap : (q, m) ndarray
    loads : (q, 3) ndarray
        As in `Cases`.
    """
    n_cases = len(gap)
    solutions = CaseSolutions(
        first=np.zeros(n_cases, int),
        stop=np.zeros(n_cases, int),
        force=np.zeros(gap.shape),
        motion=np.zeros((n_cases, 2)),
        leaving=np.zeros((n_cases, 2)),
        gap_rate=np.ones((n_cases, 2)),
    )
    return Cases(first_try, end_limit, gap, loads, solutions)
