"""Closed-form compliance of a coated layer on a rigid base, for waves along its face.

A layer between two guides without friction responds to a pressure cos(k x) by a wave of the same length, if k times its
length is a multiple of pi. The stress function of a layer is (a + b k z) e^(-k z) cos(k x), with another pair that grows
with the depth z, and

    2 mu u_z = k (a + b (1 - 2 nu) + b k z) e^(-k z) cos(k x),
    2 mu u_x = k (a - 2 b (1 - nu) + b k z) e^(-k z) sin(k x).
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...elasticity.elasticity import Layers, Piece, lame_constants

# Largest product of wavenumber and thickness for which a wave reaches the other side of a layer;
# its relative amplitude exp(-40) there is below round-off
MAX_WAVE_DEPTH = 40.0


class WaveCompliance(NamedTuple):
    """Displacement of the face per traction [m/Pa] at n wave numbers.

    - normal (n,): displacement inwards under a pressure.
    - shear (n,): displacement along x under a shear traction.
    """

    normal: np.ndarray
    shear: np.ndarray


def layer_compliance(k, height: float, thickness: float, layers: Layers) -> WaveCompliance:
    """Return the compliance of a coated layer on a rigid base as a function of wavenumber.

    Parameters
    ----------
    k : (n,) ndarray
        Wave numbers [1/m] >= 0; for k = 0 a pressure moves nothing along x, nor a shear inward.
    height : float
        Height of the layer with its coating [m].
    thickness : float
        Thickness of the coating [m].
    layers : Layers
        Materials of coating and substrate.
    """
    k = np.asarray(k, float)
    stack = [(thickness, layers.coating)] if thickness else []
    stack.append((height - thickness, layers.substrate))
    depths = [depth for depth, _ in stack]
    moduli = [lame_constants(*material, layers.plane) for _, material in stack]

    # A uniform traction (k = 0) strains each layer by itself, confined along x
    uniform = [(depth / (lam + 2 * mu), depth / mu) for depth, (lam, mu) in zip(depths, moduli)]
    normal = np.full(k.size, sum(part for part, _ in uniform))
    shear = np.full(k.size, sum(part for _, part in uniform))

    # A short wave sees a half-space of the first layer: (1 - nu)/(mu k)
    lam, mu = moduli[0]
    is_short = k * depths[0] > MAX_WAVE_DEPTH
    normal[is_short] = shear[is_short] = (lam + 2 * mu) / (2 * mu * (lam + mu)) / k[is_short]
    is_long = (k > 0) & ~is_short
    normal[is_long], shear[is_long] = _solve_waves(k[is_long], depths, moduli)
    return WaveCompliance(normal, shear)


def _solve_waves(k, depths: list[float], moduli: list[tuple[float, float]]) -> WaveCompliance:
    """Compute the compliance for wavenumbers k (n,) [1/m] whose waves reach all layers.

    Parameters
    ----------
    k : (n,) array
        Wavenumbers [1/m].
    depths : list of float
        Thickness [m] of each layer from the face down.
    moduli : list of tuple
        Lamé constants [Pa] of each layer.

    Returns
    -------
    WaveCompliance
        Displacement of the face per traction [m/Pa] at each wavenumber.
    """
    n_unknowns = 4 * len(depths)
    scale = moduli[0][1]
    matrix = np.zeros((k.size, n_unknowns, n_unknowns))
    face = _layer_states(k, 0.0, depths[0], moduli[0], scale)

    # The tractions on the face are prescribed.
    matrix[:, 0:2, :4] = face[:, 2:4]
    for n, (depth, layer_moduli) in enumerate(zip(depths, moduli)):
        first_row = 2 + 4 * n
        first_column = 4 * n
        columns = slice(first_column, first_column + 4)
        foot = _layer_states(k, depth, depth, layer_moduli, scale)
        if n == len(depths) - 1:
            # The base of the last layer does not move.
            matrix[:, first_row : first_row + 2, columns] = foot[:, :2]
            break
        # Displacements and tractions are continuous across the interface of two layers.
        rows = slice(first_row, first_row + 4)
        matrix[:, rows, columns] = foot
        lower_states = _layer_states(k, 0.0, depths[n + 1], moduli[n + 1], scale)
        matrix[:, rows, first_column + 4 : first_column + 8] = -lower_states

    right_sides = np.zeros((k.size, n_unknowns, 2))
    # The loads on the face are a normal stress of -1 for a unit pressure and a shear stress of -1
    # for a unit shear traction.
    right_sides[:, 0, 0] = -1.0
    right_sides[:, 1, 1] = -1.0

    coefficients = np.linalg.solve(matrix, right_sides)[:, :4]
    displacement = (face[:, :2] @ coefficients) / (scale * k)[:, None, None]
    return WaveCompliance(displacement[:, 1, 0], displacement[:, 0, 1])


def _layer_states(
    k, z: float, depth: float, moduli: tuple[float, float], scale: float
) -> np.ndarray:
    """Return displacements and tractions (n, 4, 4) of the four wave solutions at depth z [m].

    A state is k scale u_x, k scale u_z, tension and shear.

    Parameters
    ----------
    k : (n,) ndarray
        Wave numbers [rad/m].
    z, depth : float
        Depth in the layer, and thickness of the layer [m].
    moduli : tuple of float
        Lame's constants lambda and mu [Pa] of the layer.
    scale : float
        Pressure [Pa] by which the displacements are made comparable to the tractions.

    Returns
    -------
    (n, 4, 4) ndarray
        Component of the state in rows, wave solution in columns.
    """
    lam, mu = moduli
    nu = lam / (2 * (lam + mu))
    softness = scale / (2 * mu)
    states = np.empty((k.size, 4, 4))
    # The first two solutions decay downwards, the others upwards. The first of each pair is the gradient of the harmonic
    # function exp(-k z) cos(k x), the second one contains the factor k z.
    for first, sign, distance in ((0, 1.0, z), (2, -1.0, depth - z)):
        kz = k * distance
        ones = np.ones(k.size)
        along = np.stack([ones, kz - 2 * (1 - nu)]) * softness
        inward = np.stack([ones, kz + 1 - 2 * nu]) * softness * sign
        tension = -np.stack([ones, kz])
        shear = np.stack([-ones, 1 - kz]) * sign
        decayed = np.stack([along, inward, tension, shear]) * np.exp(-kz)
        states[:, :, first : first + 2] = decayed.transpose(2, 0, 1)
    return states


def end_compliance(piece: Piece) -> WaveCompliance:
    """Return the difference (m, m) [m2/N] between the compliances with free ends and with guided ends.

    Guides without friction hold both ends of the piece: along x for the normal compliance, inward for the shear
    compliance. Then the piece responds to waves by the closed form.
    """
    free = piece.factor.compliance
    parts = []
    for guided, moved in ((0, 1), (1, 0)):
        held = replace(piece, guided=guided, computed={}).factor.compliance
        parts.append((free - held)[moved::2, moved::2])
    return WaveCompliance(*parts)
