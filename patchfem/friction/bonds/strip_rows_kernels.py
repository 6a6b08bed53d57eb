"""Records and arrays of a list of bonds (eq. 2.17)."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

# The table of `decay_kernels` has this number of polynomials per unit of age, with 9 coefficients each; both lose nothing
# but round-off.
N_CELLS_PER_AGE = 4
N_COEFFICIENTS = 9
MAX_NEW_STRIPS = 8  # strips that a step adds to a list at most
EXACT_JOIN = 1e-13  # error of a join, relative to the load, that is round-off


class Strip(NamedTuple):
    """Bonds that formed on a piece of the path; stretch and age are linear from the first ones, the youngest, to the last.

    - stretch_1, stretch_2: stretch of the first and of the last bonds [m]
    - age_1, age_2: path since these bonds formed [m], or their damage [1] for reading = "stretch"
    - range: largest difference of the ages of two bonds; 0 for the initial bonds, which formed at once
    - weight: force of the strip over mu_s at unit strength and unit stretch [N], or [N m^-p] for reading = "stretch"
    - short_1, short_2: by how much the bonds at two Gauss points of the strip, the younger one first, are shorter than
      mature bonds [m]; 0 for reading = "stretch"
    """

    stretch_1: float
    stretch_2: float
    age_1: float
    age_2: float
    range: float
    weight: float
    short_1: float
    short_2: float


N_STRIP_ENTRIES = len(Strip._fields)
# A row of a list has these entries, then age, strength and integral (`decay_kernels.Decay`) of its first and of its last
# bonds before the next increment, for bonds that act with the signs of their stretches.
N_ROW_ENTRIES = N_STRIP_ENTRIES + 6


class ListState(IntEnum):
    """Entries of the state of a list.

    - COUNT, LARGEST_COUNT: number of strips, and the largest one so far
    - LENGTH: length of mature bonds [m]
    - LOAD: load under which bonds form [N]
    - FORCE, ENERGY: friction force [N] and stored energy [J], both over mu_s
    - CREATED, DISSIPATED: energies since the start [J]
    - JOIN_ERROR: largest error of a join that made room in the full list, relative to the load
    """

    COUNT = 0
    LARGEST_COUNT = 1
    LENGTH = 2
    LOAD = 3
    FORCE = 4
    ENERGY = 5
    CREATED = 6
    DISSIPATED = 7
    JOIN_ERROR = 8


class ListLaw(IntEnum):
    """Entries of the parameters of a law.

    - ORDER, LENGTH, INVERSE_GAMMA: exponent p, bond length eps_0 [m] and 1/Gamma(p + 1)
    - IS_STRETCH: 1 for reading = "stretch", 0 for "report"
    - CUTOFF: age beyond which bonds are dropped, in the unit of `Strip.age_1`
    - JOIN_ERROR: error up to which strips of age 0 are joined, relative to the load
    - JOIN_AGE: path in bond lengths over which this error grows e-fold, because older bonds carry less
    - N_CELLS, TABLE: number of polynomials of the table of `decay_kernels.find_decay`, and its first age, which the
      coefficients follow
    """

    ORDER = 0
    LENGTH = 1
    INVERSE_GAMMA = 2
    IS_STRETCH = 3
    CUTOFF = 4
    JOIN_ERROR = 5
    JOIN_AGE = 6
    N_CELLS = 7
    TABLE = 8


class BondLists(NamedTuple):
    """Lists of the bonds of m points.

    - strips: (m, capacity, 14) entries of `Strip`, and of the decay of its ends (`N_ROW_ENTRIES`)
    - states: (m, 9) entries of `ListState`
    - law: (m, k) entries of `ListLaw`, followed by the table
    - growth: (m, 5) parameters of eq. 2.10, see `point_rows_kernels.GrowthNumbers`
    """

    strips: np.ndarray
    states: np.ndarray
    law: np.ndarray
    growth: np.ndarray


class BondList(NamedTuple):
    """List of the bonds of a point; the fields are those of `BondLists`.

    - strips: (capacity, 14)
    - state: (9,)
    - law: (k,)
    - growth: (5,)
    """

    strips: np.ndarray
    state: np.ndarray
    law: np.ndarray
    growth: np.ndarray
