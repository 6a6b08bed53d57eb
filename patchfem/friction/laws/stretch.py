"""Points of eq. 2.17 in the stretch reading with p = 1 as the loops take them; the law itself is `bonds.recursion`."""

import numpy as np

from ..bonds.parameters import Bonds
from ..protocol import Element


def growth_numbers(law: Bonds) -> np.ndarray:
    """The six numbers of the growth of bonds that compiled code takes: (a_s, l_k, v_h, eps_0, eps_k) of eq. 2.10 and
    breakaway.

    a_s [m s-2], l_k [m], v_h [m/s], eps_0 and eps_k [m]; a_s = -1 says that the bond length is constant.
    """
    if not law.grows:
        return np.array([-1.0, 1.0, 1.0, law.length, law.length, law.breakaway])
    return np.array(
        [
            law.rest_growth,
            law.slip_growth,
            law.rest_speed,
            law.length,
            law.ratio * law.length,
            law.breakaway,
        ]
    )


def points_element(law: Bonds, area, sigma, pattern=None) -> Element:
    """Points that slide alike, on nodal areas (m,) [m2] under sigma (m,) [Pa].

    pattern: (x, sigma on x) when the pressure stays on the lower piece; `area` and `sigma` then belong to the points of
    the upper one, which stand at x at first.
    """
    area, sigma = np.asarray(area, float), np.asarray(sigma, float)
    weight, limit = law.static * area / law.length, law.static * float(area @ sigma)
    if pattern is None:
        numbers = np.concatenate([[0.0, weight @ sigma, law.length], growth_numbers(law), sigma])
        memory = np.array([law.length, law.initial, 0.0, 0.0, 0.0, 0.0])
        grown = (law.length, 1.0, law.length, law.length**2)
        rates = None if law.grows and law.breakaway else grown if law.grows else ()
        return Element(
            "friction.laws.stretch_kernels",
            numbers,
            memory,
            limit,
            law.length,
            False,
            "points",
            rates,
        )
    x, on_lower = (np.asarray(part, float) for part in pattern)
    numbers = np.concatenate(
        [
            [0.0, area.size, law.length],
            growth_numbers(law),
            weight,
            sigma,
            [x.size],
            x,
            np.zeros(area.size),
            x,
            on_lower,
        ]
    )
    memory = np.concatenate([[law.length], law.initial * sigma, np.zeros(4 * area.size)])
    return Element(
        "friction.laws.stretch_lower_kernels", numbers, memory, limit, law.length, False, "places"
    )


def bonds_of(element: Element, memory) -> np.ndarray:
    """Bonds (5, m) in the memory of a `points_element`: m [Pa], z [Pa m], s2 [Pa m2], local slide [m] and play [1] per
    point."""
    bonds = np.asarray(memory)[1:].reshape(5, -1)
    if element.form == "places":
        return bonds
    sigma = element.numbers[9:]
    return bonds * np.stack([sigma, sigma, sigma, np.ones_like(sigma), np.ones_like(sigma)])
