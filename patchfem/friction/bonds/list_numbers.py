"""Arrays of the lists of bonds of contact points (see `strip_rows_kernels`)."""

from math import ceil, gamma

import numpy as np

from .parameters import Bonds, growth_numbers
from .strip_rows_kernels import BondLists, ListLaw, ListState, Strip

MAX_DAMAGE = 745.0  # damage from which exp(-damage) underflows to zero
UNMERGED_WIDTH = 0.02  # largest width of a new strip where none are merged [bond lengths]
# Half the stretch [bond lengths] over which the initial bonds are distributed, so that their force has no jump
INITIAL_HALF_WIDTH = 1e-6
# Path in bond lengths over which strips grow e-fold for orders up to 1, and what each order above adds to it
AGE_PER_WIDTH = 3.0
AGE_PER_ORDER = 2.0
# Strips of a merged list: those of a long slide times its width, those of growing bonds, and those between reversals
STRIPS_PER_WIDTH = 6.0
N_OTHER_STRIPS = 192
N_GROWTH_STRIPS = 17  # new strips of a step by growth
N_UNMERGED_STRIPS = 20_000  # all strips of unmerged lists


def cutoff_age(order: float, tail: float) -> float:
    """Return the age R/eps [1] beyond which bonds contribute a negligible fraction of the friction limit.

    It solves Q(p + 1, R/eps) = tail, with Q the regularised upper incomplete gamma function and p > -1.
    """
    from scipy.special import gammainccinv

    return float(gammainccinv(order + 1, tail))


def make_lists(bonds: Bonds, reach: float, merge: float, loads) -> BondLists:
    """Return the lists of the initial bonds of points that have not moved.

    Parameters
    ----------
    bonds : Bonds
        Parameters of the bonds.
    reach : float
        Age in bond lengths beyond which bonds are dropped.
    merge : float
        Largest width of a joined strip of age 0 in bond lengths; 0 joins none before a list is full.
    loads : (m,) array
        Normal loads of the points [N].
    """
    width = merge or UNMERGED_WIDTH
    age_per_width = AGE_PER_WIDTH + AGE_PER_ORDER * max(bonds.order - 1, 0.0)
    n_new = ceil(age_per_width / width) + N_GROWTH_STRIPS
    capacity = ceil(2 * age_per_width / width) + N_OTHER_STRIPS
    if not merge:
        capacity = N_UNMERGED_STRIPS // loads.size + N_OTHER_STRIPS

    law = np.zeros(len(ListLaw))
    law[ListLaw.ORDER] = bonds.order
    law[ListLaw.LENGTH] = bonds.length
    law[ListLaw.INVERSE_GAMMA] = 1 / gamma(bonds.order + 1)
    law[ListLaw.IS_STRETCH] = bonds.reading == "stretch"
    law[ListLaw.CUTOFF] = min(reach, MAX_DAMAGE) * bonds.length
    law[ListLaw.WIDTH] = width
    law[ListLaw.AGE_PER_WIDTH] = age_per_width
    law[ListLaw.MERGES] = merge > 0
    law[ListLaw.MAX_NEW] = n_new

    # The initial bonds are a strip that formed at once, without stretch.
    strips = np.zeros((loads.size, Strip.SECOND + 2, capacity + n_new))
    weight = bonds.initial * law[ListLaw.INVERSE_GAMMA] * loads
    if bonds.reading == "stretch":
        weight = weight / bonds.length**bonds.order
    strips[:, Strip.HALF_WIDTH] = INITIAL_HALF_WIDTH * bonds.length
    strips[:, Strip.WEIGHT, 0] = weight
    if bonds.reading == "stretch":
        strips[:, Strip.STRENGTH, 0] = weight
    states = np.zeros((loads.size, len(ListState)))
    states[:, ListState.COUNT] = float(bonds.initial > 0)
    states[:, ListState.LENGTH] = bonds.length
    states[:, ListState.LOAD] = loads
    rows = np.tile(law, (loads.size, 1)), np.tile(growth_numbers(bonds), (loads.size, 1))
    return BondLists(strips, states, *rows)


def join_lists(parts) -> BondLists:
    """Return the lists of several groups of points as those of one group, each with the room of the longest."""
    room = max(part.strips.shape[2] for part in parts)
    wide = [
        np.pad(part.strips, ((0, 0), (0, 0), (0, room - part.strips.shape[2]))) for part in parts
    ]
    _, *rows = zip(*parts)
    return BondLists(np.concatenate(wide), *(np.concatenate(row) for row in rows))


def make_no_lists(count: int) -> BondLists:
    """Return the empty lists of `count` points whose law needs none."""
    empty = np.zeros((count, 0))
    return BondLists(np.zeros((count, 0, 0)), np.zeros((count, len(ListState))), empty, empty)
