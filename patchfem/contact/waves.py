"""Closed-form compliance of a stack of elastic layers for waves along its face.

A wave along its traction is a plane problem, and one across it an antiplane problem. The closed forms of a plane layer
therefore serve both axes of a face with k = |(kx, ky)|. The stress function of a plane layer is
(a + b k z) e^(-k z) cos(k x), with another pair that grows with the depth z, and

    2 mu u_z = k (a + b (1 - 2 nu) + b k z) e^(-k z) cos(k x),
    2 mu u_x = k (a - 2 b (1 - nu) + b k z) e^(-k z) sin(k x).

The compliance is carried from the base to the face, layer by layer: the wave that returns from the foot of a layer
follows from the compliance of what lies below.
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
    k = np.asarray(k, float)
    out = np.empty((3, *k.shape))

    # A uniform traction (k = 0) strains each layer by itself, confined along the face
    is_uniform = k == 0
    layers = list(zip(stack.thicknesses, stack.moduli, strict=True))
    out[0, is_uniform] = sum(depth / (lam + 2 * mu) for depth, (lam, mu) in layers)
    out[1:, is_uniform] = sum(depth / mu for depth, (_, mu) in layers)

    # The compliance times k [1/Pa] of the half-space, then of each layer on what lies below
    waves = k[~is_uniform]
    plane = np.zeros((2, 2, waves.size))
    across = np.zeros(waves.size)
    if stack.base is not None:
        plane, across = _compute_half_space_compliance(waves, stack.base)
    for depth, moduli in reversed(layers):
        plane, across = _add_layer(waves * depth, moduli, plane, across)
    out[0, ~is_uniform] = -plane[1, 0] / waves
    out[1, ~is_uniform] = -plane[0, 1] / waves
    out[2, ~is_uniform] = across / waves
    return WaveCompliance(*out)


class _ScaledCompliance(NamedTuple):
    """Compliance times wave number [1/Pa] at n wave numbers.

    - plane (2, 2, n): Displacements along the face and inward (rows) per tension and shear (columns).
    - across (n,): Displacement across the wave vector per traction.
    """

    plane: np.ndarray
    across: np.ndarray


def _compute_half_space_compliance(k, moduli: tuple[float, float]) -> _ScaledCompliance:
    """Return the compliance of a half-space at wave numbers k (n,) [1/m]."""
    displacement, traction = _evaluate_waves(np.zeros(k.size), moduli, 1.0)
    return _ScaledCompliance(
        _multiply(displacement, _invert(traction)), np.full(k.size, 1 / moduli[1])
    )


def _add_layer(kd, moduli: tuple[float, float], plane, across) -> _ScaledCompliance:
    """Return the compliance of a layer on a base.

    Parameters
    ----------
    kd : (n,) ndarray
        Wave numbers times the thickness of the layer [1].
    moduli : tuple of float
        Lame's constants lambda and mu [Pa] of the layer.
    plane, across : (2, 2, n) and (n,) ndarray
        Compliance of the base times wave number [1/Pa].
    """
    # Waves that decay downwards, at the face and at the foot; a wave that decays upwards starts at the foot
    # Largest product of wave number and thickness for which a wave reaches the other side of a
    # layer; its relative amplitude exp(-40) there is below round-off
    depth = np.minimum(kd, 40.0)
    none = np.zeros(kd.size)
    down_u, down_t = _evaluate_waves(none, moduli, 1.0)
    foot_u, foot_t = _evaluate_waves(depth, moduli, 1.0)
    up_u, up_t = _evaluate_waves(depth, moduli, -1.0)
    start_u, start_t = _evaluate_waves(none, moduli, -1.0)

    # At the foot, displacement = compliance of the base times traction gives the returning waves
    mismatch = foot_u - _multiply(plane, foot_t)
    response = start_u - _multiply(plane, start_t)
    returned = -_multiply(_invert(response), mismatch)
    displacement = down_u + _multiply(up_u, returned)
    traction = down_t + _multiply(up_t, returned)

    mu = moduli[1]
    tanh = np.tanh(kd)
    return _ScaledCompliance(
        _multiply(displacement, _invert(traction)),
        (tanh / mu + across) / (1 + mu * across * tanh),
    )


def _evaluate_waves(kz, moduli: tuple[float, float], sign: float):
    """Return displacements and tractions (2, 2, n) of two waves that decay along the distance kz (n,) [1].

    The first wave is the gradient of the harmonic function exp(-k z) cos(k x), the second one contains the factor k z.
    Displacements, along the face and inward, are multiplied by k; tractions are tension and shear. `sign` is 1 for waves
    that decay downwards and -1 for waves that decay upwards.
    """
    lam, mu = moduli
    nu = lam / (2 * (lam + mu))
    ones = np.ones(kz.size)
    decay = np.exp(-kz)
    displacement = np.array([[ones, kz - 2 * (1 - nu)], [sign * ones, sign * (kz + 1 - 2 * nu)]])
    traction = np.array([[-ones, -kz], [-sign * ones, sign * (1 - kz)]])
    return displacement * decay / (2 * mu), traction * decay


def _multiply(left, right) -> np.ndarray:
    """Return the products (2, 2, n) of n pairs of 2 x 2 matrices."""
    return np.einsum("ijn,jkn->ikn", left, right)


def _invert(matrix) -> np.ndarray:
    """Return the inverses (2, 2, n) of n 2 x 2 matrices."""
    (a, b), (c, d) = matrix
    return np.array([[d, -b], [-c, a]]) / (a * d - b * c)
