"""Forms of the sum over a list of strips of bonds (eq. 2.17), and their quadrature rules.

The law determines the form (`list_numbers.sum_form`).
"""

from math import sqrt

FORM_MOMENTS = 0.0  # form for reading="stretch" with p = 1: three moments of the strips, exact
FORM_POWER = 1.0  # form for reading="stretch" with any order p: two Gauss points per strip
# Form for reading="report" with a constant bond length: differences of P(p + 1, R/eps), exact
FORM_REPORT = 2.0
# Form for reading="report" with growing bonds: two Gauss points per strip
FORM_REPORT_GROWING = 3.0

# Positions of the two Gauss points of a strip, as fractions of its length from its end
GAUSS_POINT_1 = 0.5 - sqrt(1 / 12)
GAUSS_POINT_2 = 0.5 + sqrt(1 / 12)
N_TABLE_STEPS = 32  # number of entries of the table of P(p + 1, x) per unit of x
MAX_STRIP_LENGTH = 0.25  # largest length of a strip in bond lengths

GAUSS_RULE_5 = (  # five Gauss points in (-1, 1), each with its weight
    (-0.906179845938664, 0.23692688505618908),
    (-0.5384693101056831, 0.47862867049936647),
    (0.0, 0.5688888888888889),
    (0.5384693101056831, 0.47862867049936647),
    (0.906179845938664, 0.23692688505618908),
)
