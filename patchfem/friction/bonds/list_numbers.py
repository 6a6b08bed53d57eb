"""Arrays of a compiled bond list: law, path state, status and table (see `list_rows_kernels`)."""

from math import ceil, gamma

import numpy as np

from .list_forms_kernels import (
    FORM_MOMENTS,
    FORM_POWER,
    FORM_REPORT,
    FORM_REPORT_GROWING,
    N_TABLE_STEPS,
)
from .list_rows_kernels import LAW, STATUS, ListStatus
from .parameters import Bonds

MAX_DAMAGE = 745.0  # damage from which exp(-damage) underflows to zero
MAX_STRIPS_PER_LENGTH = 4  # largest number of strips of an increment per bond length
N_JACOBI_POINTS = 4  # number of Gauss-Jacobi points in the form FORM_POWER
# Number of entries of a law array, including the Gauss-Jacobi points and weights of two powers
N_LAW_NUMBERS = 24
N_WORK_STRIPS = 64  # number of strips of workspace in addition to those of an increment
UNMERGED_CAPACITY = 20_000  # initial capacity, in strips, of a list whose strips are not merged


def sum_form(law: Bonds) -> float:
    """Return the code of the formula by which a law is summed over bonds (see `list_rows_kernels`)."""
    if law.reading == "stretch":
        return FORM_MOMENTS if law.order == 1 else FORM_POWER
    return FORM_REPORT_GROWING if law.has_growth else FORM_REPORT


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
    reach : float
        Cut-off in bond lengths of path; for reading="stretch" in units of damage.
    merge : float
        Largest width of a merged strip of age 0 in bond lengths; 0 merges nothing.
    half_width : float
        Half the width in bond lengths over which the initial bonds are distributed. With 0 their force jumps at
        displacement 0, and no step of a rig can end in the jump.

    Returns
    -------
    (24,) array
    """
    form = sum_form(law)
    numbers = np.zeros(N_LAW_NUMBERS)
    numbers[LAW.order] = law.order
    numbers[LAW.form] = form
    numbers[LAW.length] = law.length
    numbers[LAW.initial] = law.initial
    numbers[LAW.inverse_gamma] = 1 / gamma(law.order + 1)
    numbers[LAW.merge_width] = merge
    numbers[LAW.cutoff] = min(reach, MAX_DAMAGE) * (law.length if form >= FORM_REPORT else 1.0)
    numbers[LAW.half_width] = half_width * law.length
    if form == FORM_POWER:
        rules = _jacobi_rule(law.order), _jacobi_rule(law.order + 1)
        numbers[LAW.nodes :] = np.concatenate(rules)
    return numbers


def _jacobi_rule(power: float) -> np.ndarray:
    """Return Gauss-Jacobi points in (0, 1) for the weight t^power, followed by their weights."""
    from scipy.special import roots_jacobi

    x, weights = roots_jacobi(N_JACOBI_POINTS, 0.0, power)
    return np.concatenate([(1 + x) / 2, weights / 2 ** (power + 1)])


def make_status(capacity: int, count: int | None = None) -> np.ndarray:
    """Return the status array of an empty list that can hold `capacity` strips.

    Parameters
    ----------
    capacity : int
    count : int, optional
        Number of lists that follow each other in an array.

    Returns
    -------
    (16,) array, or (count, 16) array
    """
    status = np.zeros((count or 1, len(ListStatus._fields)))
    start = capacity * np.arange(count or 1)
    for position in (STATUS.room_start, STATUS.head, STATUS.end):
        status[:, position] = start
    status[:, STATUS.room_end] = start + capacity
    status[:, STATUS.pressure] = 1.0
    status[:, STATUS.initial_pressure] = 1.0
    return status if count else status[0]


def make_path_state(law: Bonds) -> np.ndarray:
    """Return the initial path state (6,) of a bond list, before any motion."""
    return np.array([0.0, 0.0, 0.0, 0.0, law.length, 0.0])


def gamma_table(law: Bonds) -> np.ndarray:
    """Tabulate P(p + 1, x) (k,) at multiples x of 1/32 for `list_math_kernels.interpolate_gammainc`.

    The table is empty if P has a closed form. It ends at x = 60 + 4 p, where P is 1 to the last digit.
    """
    if sum_form(law) != FORM_REPORT or law.order in (0, 1, 2):
        return np.zeros(0)
    from scipy.special import gammainc

    n_nodes = N_TABLE_STEPS * ceil(60 + 4 * law.order)
    return gammainc(law.order + 1, np.arange(n_nodes) / N_TABLE_STEPS)


def list_capacity(law: Bonds, reach: float, merge: float) -> int:
    """Return the number of strips for which memory is allocated in a bond list.

    Parameters
    ----------
    law : Bonds
    reach, merge : float
        As in `law_numbers`.

    Returns
    -------
    int
    """
    step = MAX_STRIPS_PER_LENGTH * ceil(min(reach, MAX_DAMAGE)) + N_WORK_STRIPS
    if merge > 0:
        return 4 * step + ceil(16 / merge)
    return 4 * step + UNMERGED_CAPACITY
