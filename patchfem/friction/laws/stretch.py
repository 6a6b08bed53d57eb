"""Elements for points with the bond law of `bonds.point_kernels` (eq. 2.17, reading="stretch", p = 1)."""

import numpy as np

from ..bonds.parameters import Bonds, growth_numbers
from ..protocol import Element


def points_element(law: Bonds, load: float) -> Element:
    """Return the Element that combines points under a load [N] which all have the same relative displacement."""
    head = [0.0, law.static * load / law.length, law.length]
    return Element(
        kernels="friction.laws.stretch_kernels",
        numbers=np.concatenate([head, growth_numbers(law)]),
        memory=np.array([law.length, law.initial, 0.0, 0.0, 0.0]),
        limit=law.static * load,
        length=law.length,
        form="points",
    )
