"""Plane linear elasticity in scikit-fem: the bilinear form and the elements on reference cells."""

import numpy as np
from skfem import Basis, BilinearForm, ElementQuad1, ElementTriP1, ElementVector, MeshQuad
from skfem.quadrature import get_quadrature


@BilinearForm
def plane_elasticity(u, v, w):
    """Weak form of plane elasticity, sigma(u) : eps(v).

    Parameters
    ----------
    u, v : DiscreteField
        Displacement and test function.
    w : FormExtraParams
        Its fields lam and mu are the Lame constants [Pa] of the plane problem at the quadrature
        points.

    Returns
    -------
    ndarray
        Integrand at the quadrature points [Pa].
    """
    (ux_x, ux_y), (uy_x, uy_y) = u.grad
    (vx_x, vx_y), (vy_x, vy_y) = v.grad
    volumetric = w.lam * (ux_x + uy_y) * (vx_x + vy_y)
    deviatoric = 2 * ux_x * vx_x + 2 * uy_y * vy_y + (ux_y + uy_x) * (vx_y + vy_x)
    return volumetric + w.mu * deviatoric


def evaluate_reference_cells() -> dict[str, np.ndarray]:
    """Evaluate shape functions and their derivatives on reference cells."""
    arrays = {"rectangle_terms": rectangle_terms()}
    for name, element in (("triangle", ElementTriP1()), ("quadrilateral", ElementQuad1())):
        gauss_points, weights = get_quadrature(element.refdom, 2)
        centre = element.doflocs.mean(axis=0)[:, None]
        rules = (("gauss", gauss_points, weights), ("centre", centre, weights.sum(keepdims=True)))
        for kind, points, weight in rules:
            values = [element.lbasis(points, corner) for corner in range(len(element.doflocs))]
            arrays[f"{name}_{kind}_shape"] = np.stack([shape for shape, _ in values], axis=-1)
            gradients = np.stack([gradient for _, gradient in values], axis=-1)
            arrays[f"{name}_{kind}_gradient"] = gradients.swapaxes(0, 1)
            arrays[f"{name}_{kind}_weight"] = weight
    return arrays


def rectangle_terms() -> np.ndarray:
    """Return the matrices from which the stiffness of every bilinear rectangle follows.

    The stiffness of a rectangle per unit width depends on its height / width r and on its Lame
    constants only, and is K = r A + B + C / r with A, B and C linear in the Lame constants,
    because a derivative along x is divided by the width and one along y by the height. scikit-fem
    evaluates K for three rectangles, which determine the three matrices. Their entries are
    multiples of 1/12, because they integrate products of two derivatives of bilinear functions
    over a square. They are rounded to these multiples: a very thin and stiff coating amplifies
    the round-off of the quadrature.

    Returns
    -------
    (2, 3, 4, 4, 2, 2) ndarray
        A, B and C for the Lame constants (1, 0) and (0, 1); then the corner of the force, the
        corner of the displacement, and their directions (along x, along y).
    """
    ratios = np.array([0.5, 1.0, 2.0])
    sizes = np.stack([np.ones(3), ratios], axis=1)
    points = ElementQuad1.doflocs * sizes[:, None] + [[[0, 0]], [[2, 0]], [[4, 0]]]
    mesh = MeshQuad(points.reshape(-1, 2).T.copy(), np.arange(12).reshape(3, 4).T.copy())
    basis = Basis(mesh, ElementVector(ElementQuad1()), intorder=2)
    powers = np.stack([ratios, np.ones(3), 1 / ratios], axis=1)
    terms = []
    for lam, mu in ((1.0, 0.0), (0.0, 1.0)):
        fields = {"lam": np.full_like(basis.dx, lam), "mu": np.full_like(basis.dx, mu)}
        cells = plane_elasticity.coo_data(basis, **fields).tolocal()
        matrices = np.linalg.solve(powers, cells.reshape(3, 64))
        terms.append(matrices.reshape(3, 4, 2, 4, 2).transpose(0, 1, 3, 2, 4))
    return np.round(12 * np.array(terms)) / 12
