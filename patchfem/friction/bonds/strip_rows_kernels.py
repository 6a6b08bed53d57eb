"""Named rows of the arrays of a list of bonds (eq. 2.17)."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np


class Strip(IntEnum):
    """Rows of the strips of a point. A strip has the bonds that formed on a piece of the path, from old to young.

    - STRETCH, HALF_WIDTH: middle of the stretches of its bonds and half their range [m]; the half width is negative if the
      bonds formed in a slide to -x
    - AGE, HALF_AGE: path since the bonds in its middle formed, and half the path on which all formed [m]; the initial
      bonds have the half age 0
    - WEIGHT: force of the strip over mu_s at unit strength and unit stretch [N], or [N m^-p] for reading = "stretch"
    - SHORT_1, SHORT_2: by how much the bonds at two Gauss points of the strip, the younger one first, are shorter than
      mature bonds [m]; for reading = "stretch" their damage per path as they formed [1/m]
    - STRENGTH: weight times the present strength of the bonds; the next row has the relative change of the strength from
      the middle of the stretches to the largest one
    - MIDDLE, FIRST, SECOND: the same at later instants of a trial step
    """

    STRETCH = 0
    HALF_WIDTH = 1
    AGE = 2
    HALF_AGE = 3
    WEIGHT = 4
    SHORT_1 = 5
    SHORT_2 = 6
    STRENGTH = 7
    MIDDLE = 9
    FIRST = 11
    SECOND = 13


class ListState(IntEnum):
    """Entries of the state of a list.

    - COUNT, LARGEST_COUNT: number of strips, and the largest one so far
    - LENGTH: length of mature bonds [m]
    - LOAD: load under which bonds form [N]
    - FORCE, ENERGY: friction force [N] and stored energy [J], both over mu_s
    - CREATED, DISSIPATED: energies since the start [J]
    - WIDTH: largest width of a joined strip of age 0 [bond lengths]; it grows if the list is full
    """

    COUNT = 0
    LARGEST_COUNT = 1
    LENGTH = 2
    LOAD = 3
    FORCE = 4
    ENERGY = 5
    CREATED = 6
    DISSIPATED = 7
    WIDTH = 8


class ListLaw(IntEnum):
    """Entries of the parameters of a law.

    - ORDER, LENGTH, INVERSE_GAMMA: exponent p, bond length eps_0 [m] and 1/Gamma(p + 1)
    - IS_STRETCH: 1 for reading = "stretch", 0 for "report"
    - CUTOFF: age [m] beyond which bonds are dropped
    - WIDTH: largest width of a new strip, and of a joined one of age 0 [bond lengths]
    - AGE_PER_WIDTH: path in bond lengths over which this width grows e-fold, because older bonds carry less
    - MERGES: 1 if strips are joined
    - MAX_NEW: largest number of strips that form in a step
    """

    ORDER = 0
    LENGTH = 1
    INVERSE_GAMMA = 2
    IS_STRETCH = 3
    CUTOFF = 4
    WIDTH = 5
    AGE_PER_WIDTH = 6
    MERGES = 7
    MAX_NEW = 8


class BondLists(NamedTuple):
    """Lists of the bonds of m points.

    - strips: (m, 15, capacity) rows of `Strip`; the columns after the last strip are workspace
    - states: (m, 9) rows of `ListState`
    - law: (m, 9) rows of `ListLaw`
    - growth: (m, 5) parameters of eq. 2.10, see `point_rows_kernels.GrowthNumbers`
    """

    strips: np.ndarray
    states: np.ndarray
    law: np.ndarray
    growth: np.ndarray


class BondList(NamedTuple):
    """List of the bonds of a point; the fields are those of `BondLists`.

    - strips: (15, capacity)
    - state: (9,)
    - law: (9,)
    - growth: (5,)
    """

    strips: np.ndarray
    state: np.ndarray
    law: np.ndarray
    growth: np.ndarray
