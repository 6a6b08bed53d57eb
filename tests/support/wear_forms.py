"""Exact answers to small problems of Archard's wear under a steady slip.

Lengths [m], loads per metre of width [N/m]. `coefficient` kappa [m2/N]: volume worn off both pieces together per load
and slip path; `path` [m]: slip path so far.
"""

import numpy as np

from patchfem.closed_forms.contact import require_positive


def worn_volume(coefficient, load, path):
    """Volume [m3] worn off both pieces, kappa N s, with the load N [N] (Archard, J. Appl. Phys. 24 (1953) 981)."""
    return coefficient * load * path


def worn_crown_half_width(coefficient, line_load, path, radius):
    """Half width [m] of a crown worn far beyond its elastic contact, (3/2 R kappa P s)^(1/3).

    Even pressure wears a parabola of height x^2/(2 radius) flat: 2 a^3/(3 R) = kappa P s per width. The elastic
    contact is not counted, so the value is approached from below.
    """
    require_positive(radius=radius)
    return np.cbrt(1.5 * radius * coefficient * line_load * path)


def worn_pad_fraction(coefficient, line_load, path, angle, length, stiffness):
    """Share of a tilted rigid pad in contact after wear, on a foundation of `stiffness` k [Pa/m] at a held angle.

    c = sqrt(2 P (1/k + kappa s)/angle) as long as it is shorter than `length`, then 1: the worn depth adds to the
    compliance of every point.
    """
    require_positive(angle=angle, length=length, stiffness=stiffness)
    return np.minimum(
        np.sqrt(2 * line_load * (1 / stiffness + coefficient * path) / angle) / length, 1.0
    )


def even_wear_pressure(line_load, path, weight):
    """Pressure (m,) [Pa] of a fully worn-in pad whose points slide different paths (m,) [m]: proportional to 1/path.

    weight (m,) [m]: length of each node. Every point wears alike, so pressure times path is the same everywhere.
    """
    path = np.asarray(path, float)
    require_positive(path=path)
    return line_load / path / np.sum(weight / path)
