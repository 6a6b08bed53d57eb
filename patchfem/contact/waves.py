"""Closed-form compliance of a stack of elastic layers for waves along its face.

A wave whose vector is that of the traction is a plane-strain problem, and one across it an antiplane problem. The closed
forms of a plane layer therefore serve both axes of a face with k = |(kx, ky)|.
"""

from typing import NamedTuple

import numpy as np

from ..elasticity.sides import LayerStack


class WaveCompliance(NamedTuple):
    """Displacement of the face per traction [m/Pa] at wave numbers of any shape.

    - normal: Displacement inwards under a pressure.
    - along: Displacement along a shear traction whose wave vector has its direction.
    - across: Displacement along a shear traction whose wave vector is normal to it.
    """

    normal: np.ndarray
    along: np.ndarray
    across: np.ndarray


def compute_wave_compliance(k, stack: LayerStack) -> WaveCompliance:
    """Compute the compliance of a stack of layers as a function of the wave number.

    Parameters
    ----------
    k : (...) ndarray
        Wave numbers [1/m] >= 0; 0 only on a rigid base.
    stack : LayerStack
        Layers from the face down, and what they rest on.

    Returns
    -------
    WaveCompliance
        Arrays of the shape of `k`.
    """
    raise NotImplementedError
