"""Compiled mean of the contact forces along a straight increment of the holder's motion.

`sets` is a `set_arrays.SetArrays`, `slot` the slot of a stored set; motions are d [m] and t [rad].
"""

from typing import NamedTuple

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_NO_REFCOUNT
from ..kernel_cache.jit import njit
from .press_kernels import (
    FASTMATH_MINIMUM_SEARCH_FLAGS,
    ContactBounds,
    check_contact_conditions,
    compute_energy,
    find_set,
)
from .set_arrays import EnergyTerm, PathMean

# Distance beyond a border at which the next set is determined, as a fraction of the increment; it
# is larger than rounding errors
BORDER_CROSSING_FRACTION = 1e-10


class HolderMotion(NamedTuple):
    """Heave -d [m] and rotation t [rad] of the holder, or an increment of both."""

    heave: float
    rotation: float


@njit(error_model="numpy", fastmath=FASTMATH_MINIMUM_SEARCH_FLAGS, **NJIT_NO_REFCOUNT)
def find_first_violation(sets, slot, motion, change, bounds):
    """Return the fraction of an increment after which a node first violates its condition.

    The force of a node in contact and the gap of another one are linear in the heave -d and the rotation t. The
    coefficients of 1, d and t are stored with the set.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the contact set.
    motion, change : HolderMotion
        Heave and rotation at which the increment begins, and the increment.
    bounds : press_kernels.ContactBounds
        Force and gap below which a node violates its condition.

    Returns
    -------
    float
        inf if no node violates its condition.
    """
    constant = sets.stored.unknowns[slot, 0]
    by_d = sets.stored.unknowns[slot, 1]
    by_t = sets.stored.unknowns[slot, 2]
    in_contact = sets.stored.in_contact[slot]
    fraction = np.inf
    for i in range(in_contact.size):
        rate = -by_d[i] * change.heave + by_t[i] * change.rotation
        value = constant[i] - by_d[i] * motion.heave + by_t[i] * motion.rotation
        margin = value - (bounds.min_force if in_contact[i] else bounds.min_gap)
        if rate < 0:
            fraction = min(fraction, max(margin, 0.0) / -rate)
    return fraction


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_border(sets, slot, start, motion, change):
    """Find the fraction of an increment at which a contact set ceases to be valid.

    `check_contact_conditions` tells whether all forces in contact and all gaps elsewhere are >= 0 at a displacement d
    = -heave, and returns the bounds for their rounding errors.

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the contact set.
    start : float
        Fraction of the increment from which the set holds.
    motion, change : HolderMotion
        Heave and rotation at which the increment begins, and the increment.

    Returns
    -------
    float
        Fraction of the increment, 1 if the set holds up to its end.
    """
    end_d = -(motion.heave + change.heave)
    end_t = motion.rotation + change.rotation
    holds, end_bounds = check_contact_conditions(sets, slot, end_d, end_t)
    if holds:
        return 1.0

    # The rounding errors along the increment are bounded by those at both of its ends
    start_motion = HolderMotion(
        motion.heave + start * change.heave, motion.rotation + start * change.rotation
    )
    _, start_bounds = check_contact_conditions(
        sets, slot, -start_motion.heave, start_motion.rotation
    )
    bounds = ContactBounds(
        min(end_bounds.min_force, start_bounds.min_force),
        min(end_bounds.min_gap, start_bounds.min_gap),
    )
    fraction = find_first_violation(sets, slot, start_motion, change, bounds)
    return min(start + max(fraction, 0.0), 1.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def path_mean(sets, slot, heave, rotation, heave_change, rotation_change, out):
    """Average the derivatives of the contact energy along an increment of displacement.

    The mean times the increment is the difference of the energies (a discrete gradient), and the mean
    is itself the gradient of a convex function.

    The increment crosses several contact sets. On each, the energy is a quadratic function of the displacement, whose
    coefficients are stored (`EnergyTerm`), so that the increment is divided where the set changes (`find_border`), and
    `find_set` returns the slot of the set beyond. `compute_energy` returns the energy [J] and its slopes by heave [N]
    and rotation [N m].

    Parameters
    ----------
    sets : set_arrays.SetArrays
        Preloaded interface with its stored contact sets.
    slot : int
        Slot of the set at the beginning.
    heave, rotation, heave_change, rotation_change : float
        Heave [m] and rotation [rad] at the beginning, and their increments.
    out : (9,) ndarray
        Written, in the order of `PathMean`.

    Returns
    -------
    int
        Slot of the set at the end, -1 if none is found.
    """
    motion = HolderMotion(heave, rotation)
    change = HolderMotion(heave_change, rotation_change)
    out[:] = 0.0
    start = 0.0
    border_step = BORDER_CROSSING_FRACTION

    # The number of sets is limited, because rounding errors may make a path return to the same
    # sets.
    for _ in range(20 * sets.x.size + 100):
        end = find_border(sets, slot, start, motion, change)
        at_start = compute_energy(
            sets, slot, heave + start * heave_change, rotation + start * rotation_change
        )
        at_end = compute_energy(
            sets, slot, heave + end * heave_change, rotation + end * rotation_change
        )

        # The slopes are linear on a set, so the trapezoidal rule is exact. Their derivatives by the increment are the
        # second derivatives of the energy, times the integral of the fraction; d is minus the heave.
        coefficients = sets.stored.energy[slot]
        half_length = 0.5 * (end - start)
        first_moment = 0.5 * (end * end - start * start)
        heave_slopes = at_start.heave_slope + at_end.heave_slope
        rotation_slopes = at_start.rotation_slope + at_end.rotation_slope
        out[PathMean.HEAVE] += half_length * heave_slopes
        out[PathMean.ROTATION] += half_length * rotation_slopes
        out[PathMean.HEAVE_BY_HEAVE] += first_moment * coefficients[EnergyTerm.BY_DD]
        out[PathMean.HEAVE_BY_ROTATION] -= first_moment * coefficients[EnergyTerm.BY_DT]
        out[PathMean.ROTATION_BY_ROTATION] += first_moment * coefficients[EnergyTerm.BY_TT]
        start = end
        if start >= 1.0:
            out[PathMean.END_ENERGY] = at_end.value
            out[PathMean.END_HEAVE] = at_end.heave_slope
            out[PathMean.END_ROTATION] = at_end.rotation_slope
            out[PathMean.ROTATION_BY_HEAVE] = out[PathMean.HEAVE_BY_ROTATION]
            return slot

        # The set beyond the border. It may be stored in the slot of the set before the border.
        set_hash = sets.stored.hashes[slot]
        beyond = min(start + border_step, 1.0)
        d = -(heave + beyond * heave_change)
        next_slot = find_set(sets, slot, d, rotation + beyond * rotation_change)
        if next_slot < 0:
            return next_slot

        # If the search beyond the border returns the same set, it is repeated farther beyond it.
        if sets.stored.hashes[next_slot] == set_hash:
            border_step *= 10
            start = beyond
        else:
            border_step = BORDER_CROSSING_FRACTION
        slot = next_slot
    return -1
