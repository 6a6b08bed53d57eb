"""Arrays of the lists of bonds of contact points (see `strip_rows_kernels`)."""

from math import ceil, gamma

import numpy as np

from .parameters import Bonds, growth_numbers
from .strip_rows_kernels import (
    EXACT_JOIN,
    MAX_NEW_STRIPS,
    N_CELLS_PER_AGE,
    N_COEFFICIENTS,
    N_ROW_ENTRIES,
    BondLists,
    ListLaw,
    ListState,
    Strip,
)

# Path in bond lengths over which the error of a join grows e-fold for orders up to 1, and what each order above adds to it
JOIN_AGE = 3.0
JOIN_AGE_PER_ORDER = 2.0
# Error of a join of young strips relative to the load, per square of the merge width [bond lengths]. The force of a list
# has an error of this size at most (measured by test_merge_bounds).
JOIN_ERROR = 0.1
# Strips of a list beyond which joins with larger errors make room, per reciprocal merge width [bond lengths], and at most. A
# list of long strokes has fewer than 3 over its width; a block that sticks reverses in each step.
STRIPS_PER_WIDTH = 16.0
MAX_STRIPS = 1024
N_UNMERGED_STRIPS = 20_000  # all strips of lists that join without an error only
# Age from which bonds have no strength to round-off, for the order 0, and what each order adds
MAX_AGE = 60.0
MAX_AGE_PER_ORDER = 4.0
MIN_QUOTIENT_AGE = (
    0.5  # age from which the integral of the strength over its power of the age loses no digits
)


def cutoff_age(order: float, tail: float) -> float:
    """Return the age R/eps [1] beyond which bonds contribute a negligible fraction of the friction limit.

    It solves Q(p + 1, R/eps) = tail, with Q the regularised upper incomplete gamma function and p > -1.
    """
    from scipy.special import gammainccinv

    return float(gammainccinv(order + 1, tail))


def find_max_age(order: float) -> float:
    """Return the age [bond lengths] from which bonds of an order have no strength to round-off."""
    return MAX_AGE + MAX_AGE_PER_ORDER * order


def tabulate_decay(order: float, start: float) -> np.ndarray:
    """Return the table of `decay_kernels.find_decay` from an age [bond lengths] on.

    It has its first age, followed by the coefficients of the polynomials, each in place from -1 to 1 along its cell. They
    interpolate P(p + 1, x)/(x |x|^p), with P the regularised lower incomplete gamma function continued to x < 0, which is
    Kummer's function M(p + 1, p + 2, -x)/Gamma(p + 2).
    """
    from scipy.special import gammainc, hyp1f1

    n_cells = ceil((find_max_age(order) - start) * N_CELLS_PER_AGE)
    places = np.polynomial.chebyshev.chebpts1(N_COEFFICIENTS)
    x = start + (np.arange(n_cells)[:, None] + 0.5 * (places + 1)) / N_CELLS_PER_AGE
    values = hyp1f1(order + 1, order + 2, -np.minimum(x, MIN_QUOTIENT_AGE)) / gamma(order + 2)
    is_large = x > MIN_QUOTIENT_AGE
    values[is_large] = gammainc(order + 1, x[is_large]) / x[is_large] ** (order + 1)
    coefficients = np.linalg.solve(np.vander(places, increasing=True), values.T)
    return np.append(start, coefficients.T.ravel())


def make_lists(bonds: Bonds, reach: float, merge: float, loads) -> BondLists:
    """Return the lists of the initial bonds of points that have not moved.

    Parameters
    ----------
    bonds : Bonds
        Parameters of the bonds.
    reach : float
        Age in bond lengths beyond which bonds are dropped.
    merge : float
        Width in bond lengths within which young strips are joined: their force then has an error of JOIN_ERROR times its
        square, relative to the load; 0 joins what causes no error before a list is full.
    loads : (m,) array
        Normal loads of the points [N].
    """
    is_stretch = bonds.reading == "stretch"
    max_age = find_max_age(bonds.order)
    law = np.zeros(ListLaw.TABLE)
    law[ListLaw.ORDER] = bonds.order
    law[ListLaw.LENGTH] = bonds.length
    law[ListLaw.INVERSE_GAMMA] = 1 / gamma(bonds.order + 1)
    law[ListLaw.IS_STRETCH] = is_stretch
    law[ListLaw.CUTOFF] = min(reach, max_age) * (1.0 if is_stretch else bonds.length)
    law[ListLaw.JOIN_ERROR] = max(JOIN_ERROR * merge**2, EXACT_JOIN)
    law[ListLaw.JOIN_AGE] = JOIN_AGE + JOIN_AGE_PER_ORDER * max(bonds.order - 1, 0.0)
    table = tabulate_decay(bonds.order, -max_age if is_stretch else 0.0)
    law[ListLaw.N_CELLS] = table.size // N_COEFFICIENTS
    law = np.append(law, table)

    # The initial bonds are a strip that formed at once, without stretch.
    capacity = N_UNMERGED_STRIPS // loads.size + MAX_STRIPS
    if merge:
        capacity = min(ceil(STRIPS_PER_WIDTH / merge), MAX_STRIPS)
    strips = np.zeros((loads.size, capacity + MAX_NEW_STRIPS, N_ROW_ENTRIES))
    # Half the stretch [bond lengths] over which the initial bonds are distributed, so that their
    # force has no jump
    half = 1e-6 * bonds.length
    unit = bonds.length**bonds.order if is_stretch else 1.0
    # Age, strength and integral of bonds that have not moved
    decay = (0.0, float(bonds.order == 0), 0.0)
    for point, load in enumerate(loads):
        strip = Strip(-half, half, 0.0, 0.0, 0.0, bonds.initial * load / unit, 0.0, 0.0)
        strips[point, 0] = (*strip, *decay, *decay)
    states = np.zeros((loads.size, len(ListState)))
    states[:, ListState.COUNT] = float(bonds.initial > 0)
    states[:, ListState.LENGTH] = bonds.length
    states[:, ListState.LOAD] = loads
    rows = np.tile(law, (loads.size, 1)), np.tile(growth_numbers(bonds), (loads.size, 1))
    return BondLists(strips, states, *rows)


def join_lists(parts) -> BondLists:
    """Return the lists of several groups of points as those of one group, each with the room of the longest."""
    room = max(part.strips.shape[1] for part in parts)
    size = max(part.law.shape[1] for part in parts)
    strips = [np.pad(p.strips, ((0, 0), (0, room - p.strips.shape[1]), (0, 0))) for p in parts]
    laws = [np.pad(part.law, ((0, 0), (0, size - part.law.shape[1]))) for part in parts]
    return BondLists(
        np.concatenate(strips),
        np.concatenate([part.states for part in parts]),
        np.concatenate(laws),
        np.concatenate([part.growth for part in parts]),
    )


def make_no_lists(count: int) -> BondLists:
    """Return the empty lists of `count` points whose law needs none."""
    empty = np.zeros((count, 0))
    return BondLists(np.zeros((count, 0, 0)), np.zeros((count, len(ListState))), empty, empty)
