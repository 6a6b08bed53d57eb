"""Fraction of a bond's force (report, 2.15) that a pad of finite width carries.

A bond strip spreads its force over W(eta/rho)/rho = exp(-eta^2/(2 rho^2))/(sqrt(2 pi) rho) across the path. Of a pad of
width b only points on the pad carry it, so the resultant keeps E = (1/b) int_0^b int_0^b W((y - y1)/rho)/rho dy dy1.
With the distance t = |y - y1| the double integral is int_0^b 2 (b - t) W(t/rho)/rho dt, and both parts are elementary.
"""

from math import erf, expm1, pi, sqrt


def carried_fraction(width: float, spread: float) -> float:
    """Return the fraction of the friction force that acts on a pad of finite width.

    E = erf(x/sqrt 2) - sqrt(2/pi) (1 - exp(-x^2/2))/x [1] with x = b/rho, for a pad of width b [m] and a spread rho [m] of
    the bonds; the pressure is uniform across the path.
    """
    x = width / spread
    if x < 1e-8:
        return x / sqrt(2 * pi)  # the term with x^2 is below round-off here
    return erf(x / sqrt(2)) + sqrt(2 / pi) * expm1(-x * x / 2) / x
