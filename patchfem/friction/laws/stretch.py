"""Elements for points with the bond law `bonds.recursion` (eq. 2.17, reading="stretch", p = 1)."""

import numpy as np

from ..bonds.parameters import Bonds
from ..protocol import Element

N_HEADER_NUMBERS = 9  # number of entries of an element that precede those of its points
CONSTANT_LENGTH_FLAG = -1.0  # value in place of a_s that marks a constant bond length


def growth_numbers(law: Bonds) -> np.ndarray:
    """Return the parameters (6,) or (6, c) of bond growth and breakaway as an array for compiled code.

    They are a_s [m s-2], or -1 for a constant bond length, l_k [m], v_h [m/s], eps_0 [m], eps_k [m] and the fraction of
    the bond length that stretches without damage.
    """
    growth = (CONSTANT_LENGTH_FLAG, 1.0, 1.0, law.length, law.length, law.breakaway)
    if law.has_growth:
        rates = law.rest_growth, law.slip_growth, law.rest_speed
        growth = (*rates, law.length, law.ratio * law.length, law.breakaway)
    return np.array(np.broadcast_arrays(*growth))


def points_element(law: Bonds, area, sigma, pattern=None) -> Element:
    """Return the Element that combines points which all have the same relative displacement.

    Parameters
    ----------
    law : Bonds
    area, sigma : (m,) array
        Areas [m2] and pressures [Pa] of the points.
    pattern : ((p,) array, (p,) array), optional
        Positions [m] of the nodes of the lower piece and pressures [Pa] there, if the pressure stays on the lower
        piece. The points then belong to the upper piece and are at the nodes at first.

    Returns
    -------
    Element
    """
    area = np.asarray(area, float)
    sigma = np.asarray(sigma, float)
    weight = law.static * area / law.length
    limit = law.static * float(area @ sigma)
    if pattern is None:
        head = [0.0, weight @ sigma, law.length]
        return Element(
            kernels="friction.laws.stretch_kernels",
            numbers=np.concatenate([head, growth_numbers(law), sigma]),
            memory=np.array([law.length, law.initial, 0.0, 0.0, 0.0, 0.0]),
            limit=limit,
            length=law.length,
            is_bounded=False,
            form="points",
        )
    x, sigma_on_lower = (np.asarray(part, float) for part in pattern)
    head = [0.0, area.size, law.length]
    workspace = np.zeros(area.size)
    points = [weight, sigma, [x.size], x, workspace, x, sigma_on_lower]
    return Element(
        kernels="friction.laws.stretch_lower_kernels",
        numbers=np.concatenate([head, growth_numbers(law), *points]),
        memory=np.concatenate([[law.length], law.initial * sigma, np.zeros(4 * area.size)]),
        limit=limit,
        length=law.length,
        is_bounded=False,
        form="places",
    )


def unpack_bonds(element: Element, memory) -> np.ndarray:
    """Return the bond state that is stored in the memory of an element.

    Parameters
    ----------
    element : Element
    memory : (l,) array

    Returns
    -------
    (5, m) array
        m [Pa], z [Pa m], s2 [Pa m2], local displacement [m] and play [1] of every point.
    """
    bonds = np.asarray(memory)[1:].reshape(5, -1)
    if element.form == "places":
        return bonds
    sigma = element.numbers[N_HEADER_NUMBERS:]
    return bonds * np.stack([sigma, sigma, sigma, np.ones_like(sigma), np.ones_like(sigma)])
