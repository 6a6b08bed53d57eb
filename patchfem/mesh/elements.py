"""Shape functions of plane elements of first and second order, and their rules of integration.

The shape functions of an element are the combinations of its monomials that are 1 at one node and 0 at the others. Nodes
are ordered as in meshio: corners, middles of the edges from corner to corner, centre.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np


class ShapeFunctions(NamedTuple):
    """Shape functions of an element with k nodes at g points.

    - values (g, k): their values.
    - gradients (g, 2, k): their derivatives along the local coordinates.
    """

    values: np.ndarray
    gradients: np.ndarray


class Element(NamedTuple):
    """Reference element with k nodes.

    - ``n_corners``: 3 or 4
    - ``nodes``: (k, 2) local coordinates of the nodes
    - ``powers``: (k, 2) exponents of the monomials
    - ``gauss``, ``weights``: (g, 2) points and (g,) weights of the integration of the stiffness
    """

    n_corners: int
    nodes: np.ndarray
    powers: np.ndarray
    gauss: np.ndarray
    weights: np.ndarray

    @property
    def is_quadratic(self) -> bool:
        """Whether the element has nodes between its corners."""
        return len(self.nodes) > self.n_corners

    @property
    def centre(self) -> np.ndarray:
        """Local coordinates (1, 2) of the centre of the element."""
        return self.nodes[: self.n_corners].mean(axis=0, keepdims=True)

    def evaluate(self, points) -> ShapeFunctions:
        """Return the shape functions at points (g, 2) in local coordinates."""
        to_nodes = np.linalg.inv(self._monomials(self.nodes, 0, 0))
        slopes = [
            self._monomials(points, 1, 0) @ to_nodes,
            self._monomials(points, 0, 1) @ to_nodes,
        ]
        return ShapeFunctions(self._monomials(points, 0, 0) @ to_nodes, np.stack(slopes, axis=1))

    def _monomials(self, points, x_derivative: int, y_derivative: int) -> np.ndarray:
        """Return the monomials (g, k) at points (g, 2), or their derivatives.

        They are differentiated once along x or y if `x_derivative` or `y_derivative` is 1, and not if it is 0.
        """
        out = np.ones((len(points), len(self.powers)))
        for axis, order in enumerate((x_derivative, y_derivative)):
            power = self.powers[:, axis]
            factor = power if order else 1
            out *= factor * points[:, [axis]] ** np.maximum(power - order, 0)
        return out


def _make_element(corners, exponents, quadrature, has_centre: bool = False) -> Element:
    """Return an element from its corners (c, 2) in local coordinates.

    With more monomials than corners it has mid-edge nodes. `exponents` (k, 2) are those of the monomials along both
    coordinates, `quadrature` the points and weights of the integration, and an element with `has_centre` has one more
    node at the origin.
    """
    nodes = np.array(corners, float)
    if len(exponents) > len(corners):
        middles = (nodes + np.roll(nodes, -1, axis=0)) / 2
        nodes = np.concatenate([nodes, middles])
    if has_centre:
        nodes = np.concatenate([nodes, np.zeros((1, 2))])
    points, weights = quadrature
    return Element(len(corners), nodes, np.array(exponents), np.array(points), np.array(weights))


def _square_rule(count: int) -> tuple[list, list]:
    """Return the points and weights of the product Gauss rule with count x count points."""
    points, weights = np.polynomial.legendre.leggauss(count)
    pairs = [(a, b) for a in range(count) for b in range(count)]
    return [(points[a], points[b]) for a, b in pairs], [weights[a] * weights[b] for a, b in pairs]


_TRIANGLE_CORNERS = [(0, 0), (1, 0), (0, 1)]
_SQUARE_CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
# Exact for polynomials of degree two
_TRIANGLE_QUADRATURE = ([(1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)], [1 / 6, 1 / 6, 1 / 6])
_LINEAR_EXPONENTS = [(0, 0), (1, 0), (0, 1)]
_QUADRATIC_EXPONENTS = [*_LINEAR_EXPONENTS, (2, 0), (1, 1), (0, 2)]
_SERENDIPITY_EXPONENTS = [*_QUADRATIC_EXPONENTS, (2, 1), (1, 2)]

# Elements by their names in meshio
ELEMENTS = {
    "triangle": _make_element(_TRIANGLE_CORNERS, _LINEAR_EXPONENTS, _TRIANGLE_QUADRATURE),
    "quad": _make_element(_SQUARE_CORNERS, [*_LINEAR_EXPONENTS, (1, 1)], _square_rule(2)),
    "triangle6": _make_element(_TRIANGLE_CORNERS, _QUADRATIC_EXPONENTS, _TRIANGLE_QUADRATURE),
    "quad8": _make_element(_SQUARE_CORNERS, _SERENDIPITY_EXPONENTS, _square_rule(3)),
    "quad9": _make_element(
        _SQUARE_CORNERS, [*_SERENDIPITY_EXPONENTS, (2, 2)], _square_rule(3), has_centre=True
    ),
}


def number_cells(
    blocks: dict[str, np.ndarray],
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield the element, the nodes (t, k) and the numbers (t,) of the cells of each element of a mesh.

    `blocks` are the nodes by the name of their element, by whose order the cells are numbered.
    """
    n_cells = 0
    for kind, nodes in blocks.items():
        yield kind, nodes, np.arange(n_cells, n_cells + len(nodes))
        n_cells += len(nodes)
