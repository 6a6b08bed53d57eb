"""Closed forms of small problems of Archard's wear under steady slip.

Lengths [m], loads per metre of width [N/m]. `coefficient` kappa [m2/N]: worn volume of both bodies
per load and sliding distance; `path` [m]: sliding distance.
"""

import numpy as np

from patchfem.closed_forms.contact import require_positive


def worn_crown_half_width(coefficient, line_load, path, radius):
    """Return the half-width [m] of a crown worn far beyond its elastic contact, (3/2 R kappa P s)^(1/3).

    Uniform pressure flattens a parabola of height x^2/(2 radius): 2 a^3/(3 R) = kappa P s per
    width. The elastic contact is neglected, so the value is approached from below.
    """
    require_positive(radius=radius)
    return np.cbrt(1.5 * radius * coefficient * line_load * path)


def worn_pad_fraction(coefficient, line_load, path, angle, length, stiffness):
    """Return the fraction of a tilted rigid pad in contact after wear, on a foundation k [Pa/m] at fixed angle.

    c = sqrt(2 P (1/k + kappa s)/angle) while it is shorter than `length`, then 1: the worn depth
    adds to the compliance of every point.
    """
    require_positive(angle=angle, length=length, stiffness=stiffness)
    return np.minimum(
        np.sqrt(2 * line_load * (1 / stiffness + coefficient * path) / angle) / length, 1.0
    )


def uniform_wear_pressure(line_load, path, weight):
    """Return the pressure (m,) [Pa] of a worn-in pad whose points have different sliding distances (m,) [m].

    It is proportional to 1/path. weight (m,) [m]: length of each node. All points wear at the same
    rate, so pressure times path is uniform.
    """
    path = np.asarray(path, float)
    require_positive(path=path)
    return line_load / path / np.sum(weight / path)
