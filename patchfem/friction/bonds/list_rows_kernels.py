"""Named indices of the arrays of a list of strips of bonds (eq. 2.17).

A strip holds the bonds that formed on one straight increment, or on several increments that were merged. Some rows of
the array of strips depend on the form of the sum (`list_forms_kernels`): `MOMENT` names the rows of a strip that is
known by its moments; `POWER_ROW`, `REPORT_ROW` and `GROWING_ROW` name what the other forms keep beside the rows of
`STRIP`.

The age measure of a form is the quantity by which bonds age: the damage int dR/eps for reading="stretch", and the path
R [m] for reading="report". A scaled number contains the factor exp(age measure - reference), so that ageing multiplies the
sum over all strips by a single number. A relative pressure is relative to the pressure of the friction limit.
"""

from typing import NamedTuple


class StripRows(NamedTuple):
    """Rows of the array that stores the strips of a bond list.

    - start, end: relative displacement [m] at the start and at the end of the strip; of a spread strip, which
      represents several passes over the same range, the lower and the upper end of this range
    - age_measure, age_width: age measure at the end of the strip, and its change along the strip
    - weight: path/eps^p in the form FORM_POWER, else the path [m]; times the relative pressure
    - covered, path: path [m] that the strip covers, and the path at its end
    """

    start: int = 0
    end: int = 1
    age_measure: int = 2
    age_width: int = 3
    weight: int = 4
    covered: int = 7
    path: int = 8


class MomentRows(NamedTuple):
    """Rows of a strip in the form FORM_MOMENTS: centre [m], variance [m2] and scaled weight [m]."""

    centre: int = 0
    variance: int = 1
    weight: int = 5


class PowerRows(NamedTuple):
    """Rows of a strip in the form FORM_POWER: scaled weights at both Gauss points.

    A spread strip has its whole weight in the first row.
    """

    weight_1: int = 5
    weight_2: int = 6


class ReportRows(NamedTuple):
    """Row of a strip in the form FORM_REPORT: relative pressure at which its bonds formed."""

    pressure: int = 5


class GrowingRows(NamedTuple):
    """Additional rows of a strip of growing bonds, for friction.reading = "report".

    They hold the scaled starting lengths [m] of the bonds at both Gauss points; `FORM_REPORT_GROWING` is this form.
    """

    length_1: int = 5
    length_2: int = 6


class LawNumbers(NamedTuple):
    """Indices of the parameters of a law in the array of `list_numbers.law_numbers`.

    - order, form: exponent p, and the form of the sum
    - length, initial: bond length eps_0 [m], density m_0 of the initial bonds [1]
    - inverse_gamma: 1/Gamma(p + 1)
    - merge_width: largest width of a merged strip of age 0 [bond lengths]; 0 merges nothing
    - cutoff: increase of the age measure since formation beyond which strips are dropped
    - half_width: half the width [m] over which the initial bonds are distributed; 0 puts all at one displacement
    - nodes: first of 16 numbers: four Gauss-Jacobi points and weights for |u|^p, and four for |u|^(p + 1)
    """

    order: int = 0
    form: int = 1
    length: int = 2
    initial: int = 3
    inverse_gamma: int = 4
    merge_width: int = 5
    cutoff: int = 6
    half_width: int = 7
    nodes: int = 8


class PathRows(NamedTuple):
    """Indices of the path state of a bond list.

    - displacement, path: relative displacement and path [m] since the start
    - damage: int dR/eps, with the bond length of each step
    - growth: exponent J of the growth of bonds (eq. 2.10)
    - length: length [m] of mature bonds
    - reference: age measure to which the scaled numbers refer
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
    - n_spread: number of spread strips, which are the first ones of the list
    - n_after_merge: number of strips after the last merge
    - energy, force: stored energy [m] and force [1] of the bonds, per friction limit mu_s N
    - created, dissipated: energies [m] since the start, per friction limit
    - n_extra: number of strips in excess of one per step
    - n_unlike: number of merged strips whose ranges differ
    - max_strips: largest number of strips
    - owed: energy [m] that the next dissipation repays, see `dynamics.interfaces.list_kernels`
    - room_start, room_end: columns of the array that belong to this list
    - pressure: relative pressure under which bonds form
    - initial_pressure: relative pressure under which the initial bonds formed
    """

    head: int = 0
    end: int = 1
    n_spread: int = 2
    n_after_merge: int = 3
    energy: int = 4
    force: int = 5
    created: int = 6
    dissipated: int = 7
    n_extra: int = 8
    n_unlike: int = 9
    max_strips: int = 10
    owed: int = 11
    room_start: int = 12
    room_end: int = 13
    pressure: int = 14
    initial_pressure: int = 15


STRIP = StripRows()
MOMENT = MomentRows()
POWER_ROW = PowerRows()
REPORT_ROW = ReportRows()
GROWING_ROW = GrowingRows()
LAW = LawNumbers()
PATH = PathRows()
STATUS = ListStatus()
N_ROWS = 9  # number of rows of the array of strips
