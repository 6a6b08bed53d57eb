"""Named indices of the arrays of a list of strips of bonds (eq. 2.17), and the forms of the sum.

A strip holds the bonds that formed on one straight increment, or on several increments in one direction that were joined.
Inside a strip a position is the fraction of its length from its end. Two values per strip hold at its Gauss points:

- `FORM_STRETCH`, reading="stretch": weights, that is path/eps^p with the scale exp(damage at formation - reference); so
  damage multiplies the sum over all strips by a single number
- `FORM_GROWING`, reading="report" with growing bonds: lengths of mature bonds [m] when these bonds formed, with the scale
  exp(growth J - reference); they say by how much the bonds are shorter than mature ones
- `FORM_REPORT`, reading="report" with a constant bond length: no values, the sum over a strip has a closed form

Force and energy of a strip hold for unit relative pressure, that is per friction limit.

Two columns are no strips: the first one of a list has the initial bonds, that after the last strip the bonds that form on
a trial increment.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

# Forms of the sum over bonds, as numbers of `LawNumbers.form`
FORM_STRETCH = 0.0
FORM_REPORT = 1.0
FORM_GROWING = 2.0

# Positions of the two Gauss points of a strip, as fractions of its length from its end
GAUSS_POINT_1 = 0.5 - sqrt(1 / 12)
GAUSS_POINT_2 = 0.5 + sqrt(1 / 12)
N_ROWS = 13  # number of rows of the array of strips
# Largest length of a strip of age 0, as it forms, in bond lengths. Two Gauss points sum exp(-R/eps) over it to 4e-9.
MAX_STRIP_LENGTH = 1 / 16
N_TABLE_STEPS = 128  # number of entries of the table of P(p + 1, x) per unit of x


class BondList(NamedTuple):
    """Arrays of a list. Other tuples with these fields serve as well.

    - bondlist: (N_ROWS, capacity) strips, see `StripRows`; the columns may be shared with the lists of other points
    - now: (6,) state of the path, see `PathRows`
    - status: (14,) see `ListStatus`
    - law: (8,) parameters, see `LawNumbers`
    - table: (k,) values of P(p + 1, x), see `list_math_kernels.bond_gammainc`
    - growth: (5,) parameters of eq. 2.10, see `point_rows_kernels.GrowthNumbers`
    """

    bondlist: np.ndarray
    now: np.ndarray
    status: np.ndarray
    law: np.ndarray
    table: np.ndarray
    growth: np.ndarray


class BondLists(NamedTuple):
    """Arrays of the lists of m points; the fields are those of `BondList`, with a row per point where named in the plural.

    - bondlist: (N_ROWS, m capacity) strips of all lists, one after the other
    - nows, statuses: (m, 6), (m, 14)
    - law, table, growth: those of all points
    """

    bondlist: np.ndarray
    nows: np.ndarray
    statuses: np.ndarray
    law: np.ndarray
    table: np.ndarray
    growth: np.ndarray


class StripRows(NamedTuple):
    """Rows of the array that stores the strips of a bond list.

    - start, end: relative displacement [m] at the start and at the end of the strip
    - path, damage: path R [m] and damage int dR/eps [1] at its end
    - covered: path [m] along the strip
    - value_1, value_2: values at both Gauss points
    - force, energy: force [1] and stored energy [m] in the state of the last sum
    - present_force, present_energy: the same in the present state
    - mean: contribution [1] to the path-mean force of an increment
    - pressure: relative pressure under which its bonds formed
    """

    start: int = 0
    end: int = 1
    path: int = 2
    damage: int = 3
    covered: int = 4
    value_1: int = 5
    value_2: int = 6
    force: int = 7
    energy: int = 8
    present_force: int = 9
    present_energy: int = 10
    mean: int = 11
    pressure: int = 12


class LawNumbers(NamedTuple):
    """Indices of the parameters of a law in the array of `list_numbers.law_numbers`.

    - order, form: exponent p, and the form of the sum
    - length, initial: bond length eps_0 [m], density m_0 of the initial bonds [1]
    - inverse_gamma: 1/Gamma(p + 1)
    - merge_width: largest width of a joined strip of age 0 [bond lengths]; 0 joins nothing
    - cutoff: damage, or path [m] for reading="report", since formation beyond which strips are dropped
    - half_width: half the width [m] over which the initial bonds are distributed; 0 puts all at one displacement
    """

    order: int = 0
    form: int = 1
    length: int = 2
    initial: int = 3
    inverse_gamma: int = 4
    merge_width: int = 5
    cutoff: int = 6
    half_width: int = 7


class PathRows(NamedTuple):
    """Indices of the path state of a bond list.

    - displacement, path: relative displacement and path [m] since the start
    - damage: int dR/eps, with the bond length of each step
    - growth: exponent J of the growth of bonds (eq. 2.10)
    - length: length [m] of mature bonds
    - reference: damage, or growth in the form FORM_GROWING, to which the values of the strips refer
    """

    displacement: int = 0
    path: int = 1
    damage: int = 2
    growth: int = 3
    length: int = 4
    reference: int = 5


class ListStatus(NamedTuple):
    """Indices of the status numbers of a bond list.

    - head, end: first strip, and last strip + 1
    - n_after_merge: number of strips after the last merge
    - energy, force: stored energy [m] and force [1] of the bonds, per friction limit mu_s N
    - created, dissipated: energies [m] since the start, per friction limit
    - n_extra: number of strips in excess of one per step
    - max_strips: largest number of strips
    - owed: energy [m] that the next dissipation repays, see `points.lists_kernels`
    - first_column, end_column: columns of the array that belong to this list; the first one has the initial bonds
    - pressure: relative pressure under which bonds form; of several points the largest
    - initial_pressure: relative pressure under which the initial bonds formed
    """

    head: int = 0
    end: int = 1
    n_after_merge: int = 2
    energy: int = 3
    force: int = 4
    created: int = 5
    dissipated: int = 6
    n_extra: int = 7
    max_strips: int = 8
    owed: int = 9
    first_column: int = 10
    end_column: int = 11
    pressure: int = 12
    initial_pressure: int = 13


STRIP = StripRows()
LAW = LawNumbers()
PATH = PathRows()
STATUS = ListStatus()
