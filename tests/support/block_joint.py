"""Independent model of a bolted joint of two equal blocks: spectral elements, active set, partial slip event by event.

Both blocks are equal, so one block is computed and its compliances count twice, and shear does not change the pressure.
The mesh is a product of breaks along x and of breaks in depth, graded to the edge of contact, to the ends of the face, to
the bottom of the coating and to the clamped corners. Forces act on the nodes of the face. The stiffness of the sticking
joint converges to 1e-6 with elements of order 4, because every singular point is a vertex of the mesh.
"""

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.polynomial import Legendre, legendre
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse.linalg import splu

ORDER = 4  # of the elements
GRADING = 0.3  # ratio of the sizes of neighbouring elements at a singular point
GROWTH = 2.0  # largest ratio of the sizes of neighbouring elements elsewhere


class Block(NamedTuple):
    """Two equal blocks and their contact.

    - length, width, height [m]; load [N]
    - young [Pa], poisson: substrate
    - friction: Coulomb's coefficient
    - shape, size: "crown" and its radius [m], or "tilt" and its angle [rad]
    - coating: thickness [m], Young's modulus [Pa] and Poisson's ratio, or None
    """

    length: float
    width: float
    height: float
    load: float
    young: float
    poisson: float
    friction: float
    shape: str
    size: float
    coating: tuple[float, float, float] | None


class Fineness(NamedTuple):
    """Elements between the middle, or the pressed end, and the edge of contact; levels of refinement at the edge."""

    n_core: int
    n_levels: int
    edge_accuracy: float  # largest change of the edge of contact between the last two meshes / position of the edge


ROUGH = Fineness(12, 3, 2e-3)
COARSE = Fineness(32, 6, 2e-4)
FINE = Fineness(56, 8, 5e-5)


class Joint(NamedTuple):
    """Joint in monotone sliding from rest, for its whole width.

    - stiffness [N/m]: of the sticking joint
    - slide (m,) [m], force (m,) [N], slip (m,) [m]: at the events at which a node begins to slip, up to gross slip; the
      slip is the mean of the nodes, weighted by their normal forces
    """

    stiffness: float
    slide: np.ndarray
    force: np.ndarray
    slip: np.ndarray


def _make_element() -> tuple[np.ndarray, ...]:
    """Return the nodes on [-1, 1] and the matrices of mass, stiffness and of derivative times value."""
    inner = Legendre.basis(ORDER).deriv().roots()
    nodes = np.concatenate([[-1.0], np.sort(inner.real), [1.0]])
    points, weights = legendre.leggauss(ORDER + 2)
    to_modes = np.linalg.inv(legendre.legvander(nodes, ORDER))
    values = legendre.legvander(points, ORDER) @ to_modes
    slopes = np.stack([Legendre.basis(k).deriv()(points) for k in range(ORDER + 1)], 1) @ to_modes
    weighted = weights[:, None] * values
    mass, stiffness = values.T @ weighted, slopes.T @ (weights[:, None] * slopes)
    return nodes, mass, stiffness, slopes.T @ weighted


NODES, MASS, STIFFNESS, MIXED = _make_element()


def _assemble(breaks: np.ndarray, factors: np.ndarray) -> list[sp.csr_matrix]:
    """Return the matrices of mass, stiffness and derivative times value (n, n), with a factor for each element."""
    sizes = np.diff(breaks)
    nodes = np.arange(sizes.size)[:, None] * ORDER + np.arange(ORDER + 1)
    rows = np.repeat(nodes, ORDER + 1, 1).ravel()
    columns = np.tile(nodes, (1, ORDER + 1)).ravel()
    n = sizes.size * ORDER + 1
    scales = (factors * sizes / 2, factors * 2 / sizes, factors)
    return [
        sp.csr_matrix(((scale[:, None] * matrix.ravel()).ravel(), (rows, columns)), (n, n))
        for scale, matrix in zip(scales, (MASS, STIFFNESS, MIXED))
    ]


def _place_nodes(breaks: np.ndarray) -> np.ndarray:
    """Return the positions of the nodes of all elements."""
    inner = breaks[:-1, None] + (NODES[:-1] + 1) / 2 * np.diff(breaks)[:, None]
    return np.append(inner.ravel(), breaks[-1])


def _grade(length: float, first: float, n_levels: int, largest: float) -> np.ndarray:
    """Return breaks on [0, length]: an element `first` long, divided `n_levels` times towards 0, then growing ones."""
    breaks = [0.0] + [first * GRADING**k for k in range(n_levels, -1, -1)]
    size = first
    while breaks[-1] < length:
        size = min(size * GROWTH, largest)
        breaks.append(breaks[-1] + size)
    inside = [place for place in breaks if place < length * (1 - 1e-12)]
    if len(inside) > 2 and length - inside[-1] < 0.35 * (inside[-1] - inside[-2]):
        inside.pop()
    return np.array([*inside, length])


def _grade_both(length: float, start: tuple, end: tuple, largest: float) -> np.ndarray:
    """Return breaks on [0, length] that are graded to both ends, each with a first size [m] and a number of levels."""
    halves = [_grade(length / 2, size, n_levels, largest) for size, n_levels in (start, end)]
    return np.unique(np.concatenate([halves[0], length - halves[1][::-1]]))


class _Face:
    """Face of a clamped block per metre of width; a crowned block is the half at x > 0."""

    def __init__(self, block: Block, x_breaks: np.ndarray, depth_breaks: np.ndarray):
        self.x = _place_nodes(x_breaks)
        self.half = block.shape == "crown"
        self.n_depth = (depth_breaks.size - 1) * ORDER  # without the clamped nodes
        heights = block.height - depth_breaks[::-1]
        middle = (heights[1:] + heights[:-1]) / 2
        young, poisson = np.full((2, middle.size), [[block.young], [block.poisson]])
        if block.coating:
            thickness, *constants = block.coating
            coated = middle > block.height - thickness
            young[coated], poisson[coated] = constants

        # Products of matrices along x and in depth; the constants depend on the depth alone
        lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        shear = young / (2 * (1 + poisson))
        mass, stiffness, mixed = _assemble(x_breaks, np.ones(x_breaks.size - 1))
        by_lame, by_shear = (
            [matrix[1:, 1:] for matrix in _assemble(heights, factor)] for factor in (lame, shear)
        )
        by_modulus = [one + 2 * two for one, two in zip(by_lame, by_shear)]
        along = sp.kron(stiffness, by_modulus[0]) + sp.kron(mass, by_shear[1])
        normal = sp.kron(mass, by_modulus[1]) + sp.kron(stiffness, by_shear[0])
        coupling = sp.kron(mixed, by_lame[2].T) + sp.kron(mixed.T, by_shear[2])
        matrix = sp.bmat([[along, coupling], [coupling.T, normal]]).tocsr()
        by_node = np.arange(matrix.shape[0]).reshape(2, -1).T.ravel()
        self.matrix = matrix[by_node][:, by_node].tocsc()

    def compute_compliance(self, direction: int, nodes: np.ndarray) -> np.ndarray:
        """Return the compliance of both blocks (n, n) [m2/N] along x (direction 0) or along the normal (1)."""
        free = np.ones(self.matrix.shape[0], bool)
        if self.half:  # Normal forces are even in x, and so are displacements along x under shear
            free[2 * np.arange(self.n_depth) + 1 - direction] = False
        kept = np.flatnonzero(free)
        solver = splu(
            self.matrix[kept][:, kept], "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True}
        )
        places = np.searchsorted(kept, 2 * ((nodes + 1) * self.n_depth - 1) + direction)
        compliance = np.empty((places.size, places.size))
        for start in range(0, places.size, 64):  # limits the memory of the right-hand sides
            columns = places[start : start + 64]
            loads = np.zeros((kept.size, columns.size))
            loads[columns, np.arange(columns.size)] = 1
            compliance[:, start : start + 64] = solver.solve(loads)[places]
        return compliance + compliance.T


def solve_contact(compliance: np.ndarray, gap: np.ndarray, load: float) -> np.ndarray:
    """Return the normal forces f >= 0 (n,) with sum `load` and C f + gap >= approach, equal where f > 0."""
    active = gap <= np.quantile(gap, 0.5)
    for _ in range(200):
        kept = np.flatnonzero(active)
        factor = cho_factor(compliance[np.ix_(kept, kept)])
        per_approach, of_gap = cho_solve(factor, np.stack([np.ones(kept.size), gap[kept]], 1)).T
        approach = (load + of_gap.sum()) / per_approach.sum()
        forces = np.zeros(gap.size)
        forces[kept] = approach * per_approach - of_gap
        opening = compliance @ forces + gap - approach
        following = np.where(active, forces > 0, opening < 0)
        if (following == active).all():
            return forces
        active = following
    raise RuntimeError("the active set does not settle")


def slide_from_rest(compliance: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Return slide, force and weighted slip (3, m) of a monotone slide; nodes slip at the forces `limits` (n,)."""
    sticks = np.ones(limits.size, bool)
    slide, rows = 0.0, [(0.0, 0.0, 0.0)]
    while sticks.any():
        kept = np.flatnonzero(sticks)
        factor = cho_factor(compliance[np.ix_(kept, kept)])
        of_slipping = compliance[np.ix_(kept, np.flatnonzero(~sticks))] @ limits[~sticks]
        per_slide, relief = cho_solve(factor, np.stack([np.ones(kept.size), of_slipping], 1)).T

        # The next node slips where its force reaches the limit first
        starts = np.full(kept.size, np.inf)
        np.divide(limits[kept] + relief, per_slide, out=starts, where=per_slide > 0)
        first = np.argmin(starts)
        if starts[first] < slide * (1 - 1e-9):
            raise RuntimeError("a node would have slipped earlier")
        slide = max(starts[first], slide)
        forces = limits.copy()
        forces[kept] = np.minimum(per_slide * slide - relief, limits[kept])
        slip = slide - compliance @ forces
        rows.append((slide, forces.sum(), limits @ slip / limits.sum()))
        sticks[kept[first]] = False
    return np.array(rows).T


def _estimate_edge(block: Block) -> float:
    """Return the edge of contact [m] of a cylinder on a half-plane, or of a tilted elastic layer."""
    line_load = block.load / block.width
    nu = block.poisson
    if block.shape == "crown":
        modulus = block.young / (2 * (1 - nu**2))
        return min(np.sqrt(4 * line_load * block.size / (np.pi * modulus)), 0.48 * block.length)
    modulus = block.young * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    return min(np.sqrt(4 * block.height * line_load / (modulus * block.size)), 0.95 * block.length)


def _make_face(block: Block, edge: float, n_core: int, n_levels: int) -> _Face:
    """Return the face on a mesh graded to the edge of contact, `edge` [m] from the middle or the pressed end."""
    core = np.linspace(0, edge, n_core + 1)
    size = core[1]
    at_edge = edge - size * GRADING ** np.arange(1, n_levels + 1)
    at_end = [] if block.shape == "crown" else size * GRADING ** np.array([2, 1])
    open_length = (block.length / 2 if block.shape == "crown" else block.length) - edge
    largest = min(block.length / 8, block.height / 3)
    fine = (size * GRADING, n_levels - 1)
    end = min(size, open_length / 6, block.height / 6)
    outside = edge + _grade_both(open_length, fine, (end, 3), largest)
    x_breaks = np.concatenate([core[:1], at_end, core[1:-1], at_edge, outside])

    bottom, largest = (block.height / 8, 4), block.height / 5
    if not block.coating:
        return _Face(block, x_breaks, _grade_both(block.height, fine, bottom, largest))
    thickness = block.coating[0]
    first = (min(fine[0], thickness / 4), fine[1])
    layer = _grade_both(thickness, first, (thickness / 4, 2), thickness / 2)
    below = _grade_both(block.height - thickness, (thickness / 4, 2), bottom, largest)
    return _Face(block, x_breaks, np.concatenate([layer[:-1], thickness + below]))


def solve_joint(block: Block, fineness: Fineness) -> Joint:
    """Return the joint, on a mesh whose vertex lies at the computed edge of contact."""
    edge, change = _estimate_edge(block), np.inf
    share = 0.5 if block.shape == "crown" else 1.0
    for n_levels in range(2, 12):
        found = change < fineness.edge_accuracy * edge
        n_levels = fineness.n_levels if found else min(n_levels, fineness.n_levels)
        face = _make_face(block, edge, fineness.n_core if n_levels > 3 else 12, n_levels)
        nodes = np.flatnonzero(face.x <= edge * (1.02 if found else 1.4))
        x = face.x[nodes]
        gap = x**2 / (2 * block.size) if block.shape == "crown" else block.size * x
        forces = solve_contact(
            face.compute_compliance(1, nodes), gap, share * block.load / block.width
        )
        pressed = np.flatnonzero(forces > 0)
        if found:
            break
        outer = x[pressed[-1] : pressed[-1] + 2].mean()
        edge, change = outer, abs(outer - edge)

    assert found and pressed.size == pressed[-1] + 1, "the contact has one edge"
    compliance = face.compute_compliance(0, nodes[pressed])
    slide, force, slip = slide_from_rest(compliance, block.friction * forces[pressed])
    scale = block.width / share
    stiffness = np.linalg.solve(compliance, np.ones(pressed.size)).sum()
    return Joint(stiffness * scale, slide, force * scale, slip)
