"""Elements for points with the bond law of `bonds.point_kernels` (eq. 2.17, reading="stretch", p = 1)."""

import numpy as np

from ..bonds.parameters import Bonds, growth_numbers
from ..protocol import Element

N_HEADER_NUMBERS = 8  # number of entries of an element that precede those of its points


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
            memory=np.array([law.length, law.initial, 0.0, 0.0, 0.0]),
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
        memory=np.concatenate([[law.length], law.initial * sigma, np.zeros(3 * area.size)]),
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
    (4, m) array
        m [Pa], z [Pa m], s2 [Pa m2] and local displacement [m] of every point.
    """
    bonds = np.asarray(memory)[1:].reshape(4, -1)
    if element.form == "places":
        return bonds
    sigma = element.numbers[N_HEADER_NUMBERS:]
    return bonds * np.stack([sigma, sigma, sigma, np.ones_like(sigma)])
