"""Arrays of a compiled bond list: law, path state, status and table (see `list_rows_kernels`)."""

from math import ceil, gamma

import numpy as np

from .list_rows_kernels import (
    FORM_GROWING,
    FORM_REPORT,
    FORM_STRETCH,
    LAW,
    N_TABLE_STEPS,
    STATUS,
    LawNumbers,
    ListStatus,
)
from .parameters import Bonds

MAX_DAMAGE = 745.0  # damage from which exp(-damage) underflows to zero
# Number of strips per bond length of the cut-off for which there is memory
MAX_STRIPS_PER_LENGTH = 4
N_WORK_STRIPS = 64  # number of strips of workspace in addition to those of an increment
UNMERGED_CAPACITY = 20_000  # initial capacity, in strips, of a list whose strips are not merged


def sum_form(law: Bonds) -> float:
    """Return the code of the formula by which a law is summed over bonds (see `list_rows_kernels`)."""
    if law.reading == "stretch":
        return FORM_STRETCH
    return FORM_GROWING if law.has_growth else FORM_REPORT


def cutoff_age(order: float, tail: float) -> float:
    """Return the age R/eps [1] beyond which bonds contribute a negligible fraction of the friction limit.

    It solves Q(p + 1, R/eps) = tail, with Q the regularised upper incomplete gamma function and p > -1.
    """
    from scipy.special import gammainccinv

    return float(gammainccinv(order + 1, tail))


def law_numbers(law: Bonds, reach: float, merge: float, half_width: float = 0.0) -> np.ndarray:
    """Return the parameters of a bond law as an array for compiled code.

    Parameters
    ----------
    law : Bonds
        Parameters of the bonds.
    reach : float
        Cut-off in bond lengths of path; for reading="stretch" in units of damage.
    merge : float
        Largest width of a joined strip of age 0 in bond lengths; 0 joins nothing.
    half_width : float
        Half the width in bond lengths over which the initial bonds are distributed. With 0 their force jumps at
        displacement 0, and no step of a rig can end in the jump.

    Returns
    -------
    (8,) array
        In the order of `LAW`, in SI units.
    """
    numbers = np.zeros(len(LawNumbers._fields))
    numbers[LAW.order] = law.order
    numbers[LAW.form] = sum_form(law)
    numbers[LAW.length] = law.length
    numbers[LAW.initial] = law.initial
    numbers[LAW.inverse_gamma] = 1 / gamma(law.order + 1)
    numbers[LAW.merge_width] = merge
    age_unit = 1.0 if law.reading == "stretch" else law.length
    numbers[LAW.cutoff] = min(reach, MAX_DAMAGE) * age_unit
    numbers[LAW.half_width] = half_width * law.length
    return numbers


def make_status(capacity: int, count: int | None = None) -> np.ndarray:
    """Return the status array of an empty list that can hold `capacity` strips.

    Parameters
    ----------
    capacity : int
        Number of columns of each list.
    count : int, optional
        Number of lists that follow each other in an array.

    Returns
    -------
    (14,) array, or (count, 14) array
        In the order of `STATUS`, with the relative pressure 1.
    """
    status = np.zeros((count or 1, len(ListStatus._fields)))
    start = capacity * np.arange(count or 1)
    status[:, STATUS.first_column] = start
    status[:, STATUS.head] = status[:, STATUS.end] = start + 1
    status[:, STATUS.end_column] = start + capacity
    status[:, STATUS.pressure] = 1.0
    status[:, STATUS.initial_pressure] = 1.0
    return status if count else status[0]


def make_path_state(law: Bonds) -> np.ndarray:
    """Return the initial path state (6,) of a bond list, before any motion."""
    return np.array([0.0, 0.0, 0.0, 0.0, law.length, 0.0])


def gamma_table(law: Bonds) -> np.ndarray:
    """Tabulate P(p + 1, x) (k,) at multiples x of 1/N_TABLE_STEPS for `list_math_kernels.bond_gammainc`.

    The table is empty if P has a closed form. It ends at x = 60 + 4 p, where P is 1 to the last digit.
    """
    if law.order in (0, 1, 2):
        return np.zeros(0)
    from scipy.special import gammainc

    n_nodes = N_TABLE_STEPS * ceil(60 + 4 * law.order)
    return gammainc(law.order + 1, np.arange(n_nodes) / N_TABLE_STEPS)


def estimate_list_capacity(reach: float, merge: float) -> int:
    """Return the number of strips for which memory is allocated in a bond list.

    Parameters
    ----------
    reach : float
        Cut-off in bond lengths of path; for reading="stretch" in units of damage.
    merge : float
        Largest width of a joined strip of age 0 in bond lengths; 0 joins nothing.

    Returns
    -------
    int
        Number of strips; a run that needs more enlarges its lists (`enlarge_lists`).
    """
    step = MAX_STRIPS_PER_LENGTH * ceil(min(reach, MAX_DAMAGE)) + N_WORK_STRIPS
    if merge > 0:
        return 4 * step + ceil(16 / merge)
    return 4 * step + UNMERGED_CAPACITY


def enlarge_lists(bondlist, statuses, capacity: int) -> np.ndarray:
    """Return a larger array of strips for lists that follow each other.

    Parameters
    ----------
    bondlist : (r, k) array
        Strips of all lists.
    statuses : (m, 14) array
        Status of each list, changed in place.
    capacity : int
        Number of columns of each list, two more than its strips.

    Returns
    -------
    (r, m capacity) array
        Strips of all lists, each from its new first column on.
    """
    enlarged = np.zeros((len(bondlist), capacity * len(statuses)))
    for j, status in enumerate(statuses):
        first, head, end = status[[STATUS.first_column, STATUS.head, STATUS.end]].astype(int)
        start = j * capacity
        enlarged[:, start] = bondlist[:, first]
        enlarged[:, start + 1 : start + 1 + end - head] = bondlist[:, head:end]
        status[STATUS.first_column] = start
        status[STATUS.head] = start + 1
        status[STATUS.end] = start + 1 + end - head
        status[STATUS.end_column] = start + capacity
    return enlarged
