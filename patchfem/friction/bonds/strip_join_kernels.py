"""Compiled list of strips of bonds (eq. 2.17): old strips are dropped and neighbours joined."""

from math import copysign, sqrt

from ...compiled.flags_kernels import NJIT_KERNEL
from ...compiled.jit import njit
from .list_math_kernels import fast_exp
from .strip_rows_kernels import ListLaw, ListState, Strip
from .strip_sum_kernels import GAUSS

# Largest error of the line of missing lengths of a joined strip, relative to the length of its bonds and to its width
MAX_MISFIT = 0.03
MAX_DAMAGE_CHANGE = 0.03  # largest relative difference of the damages per path of joined strips
# Largest length of a strip relative to the path since its last bonds formed, for an order below 0: young bonds are strong
MAX_YOUNG_WIDTH = 0.25


@njit(**NJIT_KERNEL)
def join_strips(strips, state, law, width, is_full):
    """Drop strips beyond the cut-off, and join neighbours whose joint path is below a width for their age.

    The largest path is width eps_0 exp(R/(3 eps_0)) at the path R since the bonds formed.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point, changed in place.
    state : (9,) array
        Rows of `ListState`, changed in place.
    law : (9,) array
        Rows of `ListLaw`.
    width : float
        Largest joint path at the age 0 [bond lengths].
    is_full : bool
        Whether neighbours of any direction and growth are joined, because the list has no room.
    """
    last = -1
    length = law[ListLaw.LENGTH]
    is_stretch = law[ListLaw.IS_STRETCH] > 0
    max_misfit = 0.0 if is_full else MAX_MISFIT * law[ListLaw.WIDTH]
    for k in range(int(state[ListState.COUNT])):
        age = strips[Strip.AGE, k] - strips[Strip.HALF_AGE, k]
        if age > law[ListLaw.CUTOFF]:
            continue
        if last >= 0 and strips[Strip.HALF_AGE, last] > 0:
            joint = 2 * (strips[Strip.HALF_AGE, last] + strips[Strip.HALF_AGE, k])
            largest = width * length * fast_exp(age / (law[ListLaw.AGE_PER_WIDTH] * length))
            if law[ListLaw.ORDER] < 0 and max_misfit > 0:
                largest = min(largest, MAX_YOUNG_WIDTH * age)
            if joint <= largest and join(strips, state, last, k, max_misfit, is_stretch):
                continue
        last += 1
        for row in range(Strip.STRENGTH):
            strips[row, last] = strips[row, k]
    state[ListState.COUNT] = last + 1


@njit(**NJIT_KERNEL)
def join(strips, state, older, younger, max_misfit, is_stretch):
    """Add a strip to an older one if both formed in one direction and the bonds grew alike; return whether it did.

    The mean and the variance of the stretches stay, and mean and first moment of the missing lengths along the path.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point, changed in place.
    state : (9,) array
        Rows of `ListState`.
    older, younger : int
        Columns of the strips.
    max_misfit : float
        Largest error of the line of missing lengths, relative to the length of the bonds; 0 joins any strips.
    is_stretch : bool
        Whether these lengths are damages per path, for reading = "stretch".
    """
    width_0 = strips[Strip.HALF_WIDTH, older]
    width_1 = strips[Strip.HALF_WIDTH, younger]
    half_0 = strips[Strip.HALF_AGE, older]
    half_1 = strips[Strip.HALF_AGE, younger]
    half = half_0 + half_1
    along = half_1 / half

    # Line of the missing lengths
    mean_0 = 0.5 * (strips[Strip.SHORT_1, older] + strips[Strip.SHORT_2, older])
    mean_1 = 0.5 * (strips[Strip.SHORT_1, younger] + strips[Strip.SHORT_2, younger])
    rise_0 = 0.5 * (strips[Strip.SHORT_2, older] - strips[Strip.SHORT_1, older])
    rise_1 = 0.5 * (strips[Strip.SHORT_2, younger] - strips[Strip.SHORT_1, younger])
    mean = (1 - along) * mean_0 + along * mean_1
    rise = (1 - along) ** 2 * rise_0 + along**2 * rise_1
    rise += (mean_0 - mean_1) * along * (1 - along) * 3 * GAUSS
    misfit = abs(mean - (1 - along) * rise / GAUSS - mean_1)
    is_alike = misfit <= max_misfit * abs(state[ListState.LENGTH] - mean_1)
    if is_stretch:
        is_alike = abs(mean_0 - mean_1) <= MAX_DAMAGE_CHANGE * mean_1
    if max_misfit > 0 and (width_0 * width_1 <= 0 or not is_alike):
        return False

    # A uniform distribution has the variance h^2/3.
    distance = strips[Strip.STRETCH, younger] - strips[Strip.STRETCH, older]
    variance = (1 - along) * width_0 * width_0 + along * width_1 * width_1
    variance += 3 * along * (1 - along) * distance * distance
    strips[Strip.STRETCH, older] += along * distance
    strips[Strip.HALF_WIDTH, older] = copysign(sqrt(variance), width_0)
    strips[Strip.AGE, older] = strips[Strip.AGE, younger] - half_1 + half
    strips[Strip.HALF_AGE, older] = half
    strips[Strip.WEIGHT, older] += strips[Strip.WEIGHT, younger]
    strips[Strip.SHORT_1, older] = max(mean - rise, 0.0)
    strips[Strip.SHORT_2, older] = max(mean + rise, 0.0)
    return True
