"""Both whole bodies of a contact in space axes (x, y up), assembled on their own, for tests of the condensed pair."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from partial_slip import Operators, operators_of
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, MeshQuad
from skfem.helpers import ddot, sym_grad, trace

from patchfem.core import Compliance, Interface
from patchfem.elasticity.elasticity import Layers, assemble, interface_compliance
from patchfem.mesh.tensor import TensorGrid


@BilinearForm
def energy(u, v, w):
    return w.lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * w.mu * ddot(sym_grad(u), sym_grad(v))


@dataclass(frozen=True)
class Body:
    """One body in plane strain; faces and the far side as unknowns along x and y."""

    points: np.ndarray
    matrix: object
    face: np.ndarray
    far: np.ndarray

    def move(self, fx, fy, ux, uy) -> tuple:
        """Displacement (along x, along y) of the face under its forces per width and a displaced far side."""
        u, load = np.zeros(self.matrix.shape[0]), np.zeros(self.matrix.shape[0])
        load[self.face[0]], load[self.face[1]] = fx, fy
        u[self.far[0]], u[self.far[1]] = ux, uy
        free = np.setdiff1d(np.arange(u.size), self.far)
        u[free] = splu(self.matrix[free][:, free].tocsc()).solve((load - self.matrix @ u)[free])
        return u[self.face[0]], u[self.face[1]]


def body(grid: TensorGrid, layers: Layers, up: bool) -> Body:
    """The piece of `grid` above (up) or below y = 0."""
    y = grid.depth if up else -grid.depth[::-1]
    mesh = MeshQuad.init_tensor(grid.x, y)
    deep = np.abs(mesh.p[:, mesh.t].mean(axis=1)[1])
    coat = deep < (grid.depth[grid.coating_rows] if grid.coating_rows else 0.0)
    young, poisson = (np.where(coat, layers.coating[k], layers.substrate[k]) for k in (0, 1))
    basis = Basis(mesh, ElementVector(ElementQuad1()), intorder=3)
    wide = np.ones((1, basis.X.shape[-1]))
    lam = (young * poisson / (1 + poisson) / (1 - 2 * poisson))[:, None] * wide
    matrix = energy.assemble(basis, lam=lam, mu=(young / (2 + 2 * poisson))[:, None] * wide).tocsr()

    def along(level):
        nodes = np.flatnonzero(np.abs(mesh.p[1] - level) < 1e-12)
        return basis.nodal_dofs[:, nodes[np.argsort(mesh.p[0, nodes])]]

    return Body(mesh.p, matrix, along(0.0), along(y[-1] if up else y[0]))


@dataclass(frozen=True)
class TwoBodies:
    """lower and upper body with width; `relative` gives the opening (m,) and slip (m,) of the interface."""

    lower: Body
    upper: Body
    x: np.ndarray
    height: float
    width: float

    def relative(self, normal, shear, approach, rotation, slide) -> tuple:
        f, t = normal / self.width, shear / self.width
        low = self.lower.move(t, -f, 0.0, 0.0)
        # the holder turns about the middle of the interface
        high = self.upper.move(-t, f, slide - rotation * self.height, -approach + rotation * self.x)
        return high[1] - low[1], high[0] - low[0]


def unlike_pair(low: TensorGrid, low_layers: Layers, high: TensorGrid, high_layers: Layers, width: float) -> tuple:
    """(Operators, TwoBodies) of two pieces on the same columns."""
    a, b = (interface_compliance(assemble(g.x, g.depth, g.coating_rows, layers))
            for g, layers in ((low, low_layers), (high, high_layers)))
    pair = Compliance(Interface(low.x, low.tributary() * width, width), (a[0] + b[0]) / width, (a[1] + b[1]) / width)
    whole = TwoBodies(body(low, low_layers, False), body(high, high_layers, True), low.x, float(high.depth[-1]), width)
    found: Operators = operators_of(pair, (a[2] - b[2]) / width)
    return found, whole
