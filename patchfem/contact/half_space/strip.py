"""Compliance of a coated layer on a rigid base for waves along its face, which needs no mesh.

A layer between two lines across it on which it slides without friction answers a wave of the pressure cos(k x) by a
wave of the same length, where k times its length is a multiple of pi: the stress function of a layer is (a + b k z)
e^(-k z) cos(k x), with another pair that grows with the depth z, and 2 mu u_z = k (a + b (1 - 2 nu) + b k z) e^(-k z)
cos(k x), 2 mu u_x = k (a - 2 b (1 - nu) + b k z) e^(-k z) sin(k x).
"""

from dataclasses import replace

import numpy as np

from ...elasticity.elasticity import Layers, Piece, lame

DEEP = 40.0  # wave numbers times the thickness from which a wave does not feel the other side of a layer


def strip_compliance(k, height: float, thickness: float, layers: Layers) -> tuple:
    """Motion (n,) of the face per traction of each wave [m/Pa]: inward per pressure, and along x per shear.

    k: (n,) wave numbers [1/m], >= 0; height [m] of the layer, its coating of `thickness` [m] included, held at its
    foot; layers: its Layers. For k = 0 nothing moves along x under a pressure, nor inward under a shear.
    """
    k = np.asarray(k, float)
    stack = [(thickness, layers.coating)] if thickness else []
    stack.append((height - thickness, layers.substrate))
    depths, moduli = (
        [depth for depth, _ in stack],
        [lame(*stuff, layers.plane) for _, stuff in stack],
    )
    normal = np.full(
        k.size, sum(depth / (lam + 2 * mu) for depth, (lam, mu) in zip(depths, moduli))
    )
    shear = np.full(k.size, sum(depth / mu for depth, (_, mu) in zip(depths, moduli)))
    lam, mu = moduli[0]
    deep = k * depths[0] > DEEP
    normal[deep] = shear[deep] = (lam + 2 * mu) / (2 * mu * (lam + mu)) / k[deep]
    felt = (k > 0) & ~deep
    normal[felt], shear[felt] = _waves(k[felt], depths, moduli)
    return normal, shear


def _waves(k, depths: list, moduli: list) -> tuple:
    """Both compliances (n,) [m/Pa] of waves k (n,) > 0 [1/m] that feel all layers."""
    count, first = 4 * len(depths), moduli[0][1]
    matrix = np.zeros((k.size, count, count))
    top = _states(k, 0.0, depths[0], *moduli[0], first)
    matrix[:, 0, :4], matrix[:, 1, :4] = top[:, 2], top[:, 3]
    for n, (depth, stuff) in enumerate(zip(depths, moduli)):
        rows, own = slice(2 + 4 * n, 6 + 4 * n), slice(4 * n, 4 * n + 4)
        foot = _states(k, depth, depth, *stuff, first)
        if n == len(depths) - 1:
            matrix[:, 2 + 4 * n : 4 + 4 * n, own] = foot[:, :2]
        else:
            matrix[:, rows, own] = foot
            matrix[:, rows, 4 * n + 4 : 4 * n + 8] = -_states(
                k, 0.0, depths[n + 1], *moduli[n + 1], first
            )
    right = np.zeros((k.size, count, 2))
    right[:, 0, 0] = right[
        :, 1, 1
    ] = -1.0  # tension and shear of the face under a unit of pressure and of traction
    found = np.linalg.solve(matrix, right)[:, :4]
    moved = (top[:, :2] @ found) / (first * k)[:, None, None]
    return moved[:, 1, 0], moved[:, 0, 1]


def _states(k, z: float, depth: float, lam: float, mu: float, scale: float) -> np.ndarray:
    """(n, 4, 4) of a layer at the depth z [m]: k scale u_x, k scale u_z, tension and shear of its four solutions."""
    nu, out = lam / (2 * (lam + mu)), np.empty((k.size, 4, 4))
    for way, sign, far in (
        (0, 1.0, z),
        (2, -1.0, depth - z),
    ):  # those that fade downwards, and upwards
        q, fade, soft = k * far, np.exp(-k * far), scale / (2 * mu)
        zero = 0 * q
        along = np.stack([1 + zero, q - 2 * (1 - nu)]) * soft
        inward = np.stack([1 + zero, q + 1 - 2 * nu]) * soft * sign
        tension, shear = -np.stack([1 + zero, q]), np.stack([-1 + zero, 1 - q]) * sign
        out[:, :, way : way + 2] = (np.stack([along, inward, tension, shear]) * fade).transpose(
            2, 0, 1
        )
    return out


def end_effect(piece: Piece) -> tuple:
    """(nn, tt): compliance (nx, nx) [m2/N] of a piece less that of the same piece between lines without friction.

    The second moves nothing across the lines at its ends under a pressure, and nothing along them under a shear, so
    that `strip_compliance` is its closed form. What cells leave out near a force is the same in both and goes, which
    leaves a function as smooth as the way to the end is long.
    """
    free, out = piece.factor.compliance(), []
    for held in (0, 1):
        led = replace(piece, stencil=_led(piece.stencil, held), made={}).factor.compliance()
        out.append((free - led)[1 - held :: 2, 1 - held :: 2])
    return tuple(out)


def _led(stencil, held: int) -> np.ndarray:
    """The stencil of a grid whose first and last column do not move along x (held 0) or inward (held 1)."""
    out = stencil.copy()
    for column, inner, side in ((0, 1, 0), (-1, -2, 2)):
        own = stencil[column, :, 1, 1, held, held]
        out[column, :, :, :, held] = 0.0
        out[column, :, 1, :, :, held] = 0.0
        out[inner, :, side, :, :, held] = 0.0
        out[column, :, 1, 1, held, held] = own
    return out
