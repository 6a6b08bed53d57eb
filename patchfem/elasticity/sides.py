"""Change of the compliance of a block by its free sides, by bricks of order 4.

A block between guides without friction responds to cosine waves in closed form (`contact.waves`). Free sides change its
compliance by a smooth function, which is computed on a quarter of the block, for loads that are even or odd along each
axis. The stiffness of the quarter is a sum of Kronecker products of matrices along x, y and z; it is condensed to the face
from the far face up, one sheet of bricks at a time. The lengths of the elements decrease geometrically towards free sides
and towards both faces, so the error falls exponentially with their number.

The change is the difference of two finite-element results on the same elements, in which their errors near a load cancel.
"""

import io
import zipfile
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ..disk import user_cache
from .elasticity import Layers, lame_constants
from .lapack import dpotrf, dtrsm

ORDER = 4  # Polynomial order of the bricks
DEPTH_RATIO = 0.25  # Ratio of the thicknesses of neighbouring bricks towards both faces
# Smallest ratio of the depths of two element edges near an interface of layers; closer edges would make thin bricks
MIN_EDGE_DEPTH_RATIO = 2.0
CACHE_FOLDER_NAME = "patchfem-sides"
# Number in the names of cached files, which increases when the method changes
CACHE_VERSION = 1
# Largest number of cached blocks; each needs about 2 MB
MAX_CACHED_BLOCKS = 100
# Number of changes kept in memory, such as those of two pieces on three levels
MAX_CHANGES_IN_MEMORY = 8


class LayerStack(NamedTuple):
    """Elastic layers of a piece from the face down.

    - thicknesses (n,): Thickness of each layer [m].
    - moduli (n, 2): Lame's constants lambda and mu [Pa] of each layer.
    - base: Lame's constants [Pa] of a half-space below the layers; None for a rigid base.
    """

    thicknesses: tuple[float, ...]
    moduli: tuple[tuple[float, float], ...]
    base: tuple[float, float] | None = None


def make_stack(height: float, thickness: float, layers: Layers) -> LayerStack:
    """Return the layers of a coated piece whose far face is held.

    Parameters
    ----------
    height : float
        Height of the piece with its coating [m].
    thickness : float
        Thickness of the coating [m]; 0 for none.
    layers : Layers
        Elastic constants of coating and substrate.
    """
    parts = [(thickness, layers.coating)] if thickness else []
    parts.append((height - thickness, layers.substrate))
    moduli = tuple(lame_constants(*material, layers.plane) for _, material in parts)
    return LayerStack(tuple(depth for depth, _ in parts), moduli)


class BlockShape(NamedTuple):
    """Face of a block and the sides that are free.

    - length, width: Lengths of the face along x and y [m].
    - free_sides: "xy" for four free sides; "x" for free sides at both ends of x, guides along y and loads that do not vary
      along y (a plane problem).
    """

    length: float
    width: float
    free_sides: str = "xy"


class SideChange(NamedTuple):
    """Change of the compliance of a face by free sides, in polynomials on elements of a quarter of the face.

    - x, y: Elements along both axes, from the middle of the face to its sides.
    - normal, shear (2, p, m, m): Change [m/N] for normal tractions and for shear tractions along x. The first index is 0
      for tractions even along x and 1 for odd ones, the second likewise along y; p is 1 for loads that do not vary along
      y, else 2. The m nodes of the quarter are ordered by x, then y, and forces are those on the quarter.
    """

    x: "Elements"
    y: "Elements"
    normal: np.ndarray
    shear: np.ndarray


class Elements(NamedTuple):
    """Elements of one order on an axis from 0 to half a length, and the matrices of their n shape functions N.

    - edges (e + 1,): Edges of the elements [m].
    - order: Polynomial order; 0 for a single function that is 1 everywhere.
    - mass, mixed, stiffness (n, n): Integrals of N_i N_j [m], N_i' N_j [1] and N_i' N_j' [1/m].
    """

    edges: np.ndarray
    order: int
    mass: np.ndarray
    mixed: np.ndarray
    stiffness: np.ndarray

    @property
    def n_nodes(self) -> int:
        """Number of shape functions."""
        return len(self.mass)

    @property
    def bricks(self) -> np.ndarray:
        """Number of the element inside which each node (n,) lies; -1 on the edges between elements."""
        if not self.order:
            return np.zeros(1, int)
        nodes = np.arange(self.n_nodes)
        return np.where(nodes % self.order, nodes // self.order, -1)

    def integrate(self, cell_edges: np.ndarray, *, is_even: bool) -> np.ndarray:
        """Return the integrals (c, n) [m] of the shape functions over c cells.

        Parameters
        ----------
        cell_edges : (c + 1,) ndarray
            Increasing edges of the cells [m], on both sides of 0.
        is_even : bool
            Whether the functions continue as even ones on the other side of 0, else as odd ones.
        """
        distance = np.abs(cell_edges)
        pieces = self._make_smooth_functions(is_even=is_even)
        primitive = np.zeros((distance.size, self.n_nodes))
        for start, stop, piece in zip(self.edges[:-1], self.edges[1:], pieces, strict=True):
            local = np.clip((distance - start) / (stop - start) * 2 - 1, -1, 1)
            nodes = np.flatnonzero(piece.any(axis=0))
            integrals = legendre.legval(local, legendre.legint(piece[:, nodes], lbnd=-1)).T
            primitive[:, nodes] += (stop - start) / 2 * integrals
        # The primitive of an even function is odd
        return np.diff(primitive * np.sign(cell_edges)[:, None] if is_even else primitive, axis=0)

    def _make_smooth_functions(self, *, is_even: bool) -> list[np.ndarray]:
        """Return the Legendre coefficients (order + 3, n) on each element of the shape functions with continuous slopes.

        A kink of the displacement between two elements would cause a peak of the pressure there. Each function gets the
        mean of its two slopes at an edge, that of the shorter element with the larger weight, by a polynomial that vanishes
        at the nodes.
        """
        coefficients = _make_shape_functions(self.order)
        if not self.order:
            return [coefficients]
        lengths = np.diff(self.edges)
        reference_slopes = legendre.legval([-1.0, 1.0], legendre.legder(coefficients)).T

        # Slopes (2, n) [1/m] of the functions at both ends of each element, and their means at the edges
        slopes = np.zeros((lengths.size, 2, self.n_nodes))
        values = np.zeros((lengths.size, self.order + 3, self.n_nodes))
        for element, length in enumerate(lengths):
            nodes = slice(element * self.order, (element + 1) * self.order + 1)
            slopes[element, :, nodes] = reference_slopes * 2 / length
            values[element, : self.order + 1, nodes] = coefficients
        means = np.concatenate([slopes[:, 0], slopes[-1:, 1]])
        weight = (lengths[1:] / (lengths[1:] + lengths[:-1]))[:, None]
        means[1:-1] = weight * slopes[:-1, 1] + (1 - weight) * slopes[1:, 0]
        if is_even:
            means[0] = 0.0

        # (1 - s) w/2 and (1 + s) w/2, where w vanishes at all nodes and has the slopes w'(-1) and w'(1)
        bubble = legendre.legmul([1 / 3, 0, -1 / 3], legendre.legder([*self.order * [0], 1]))
        bubble_slopes = legendre.legval([-1.0, 1.0], legendre.legder(bubble))
        for element, length in enumerate(lengths):
            changes = (means[element : element + 2] - slopes[element]) * length / 2
            for end, side in enumerate((-1.0, 1.0)):
                shape = legendre.legmul([0.5, 0.5 * side], bubble) / bubble_slopes[end]
                values[element] += shape[:, None] * changes[end]
        return list(values)


def _make_shape_functions(order: int) -> np.ndarray:
    """Return the Legendre coefficients (order + 1, order + 1) of the shape functions of an element, in columns.

    Each is 1 at one of the Gauss-Lobatto points of (-1, 1) and 0 at the others.
    """
    if not order:
        return np.ones((1, 1))
    inner_nodes = legendre.Legendre.basis(order).deriv().roots()
    nodes = np.concatenate([[-1.0], inner_nodes, [1.0]])
    return np.linalg.inv(legendre.legvander(nodes, order))


def _make_elements(edges, order: int = ORDER) -> Elements:
    """Make the elements between given edges (e + 1,) [m]."""
    edges = np.asarray(edges, float)
    coefficients = _make_shape_functions(order)
    points, weights = legendre.leggauss(order + 1)
    values = legendre.legval(points, coefficients)
    slopes = legendre.legval(points, legendre.legder(coefficients))
    mass = (values * weights) @ values.T
    mixed = (slopes * weights) @ values.T
    stiffness = (slopes * weights) @ slopes.T

    n_nodes = (edges.size - 1) * order + 1
    matrices = np.zeros((3, n_nodes, n_nodes))
    for element, half in enumerate(np.diff(edges) / 2):
        nodes = slice(element * order, (element + 1) * order + 1)
        matrices[0, nodes, nodes] += half * mass
        matrices[1, nodes, nodes] += mixed
        matrices[2, nodes, nodes] += stiffness / half
    return Elements(edges, order, *matrices)


def _grade_edges(length: float, n_elements: int, ratio: float) -> np.ndarray:
    """Return edges (n + 1,) [m] from 0 to a length, between which each element is shorter than the last one by a ratio."""
    remainders = ratio ** np.arange(n_elements)
    return length * (1 - np.append(remainders, 0.0))


def _grade_depths(stack: LayerStack, n_elements: int) -> np.ndarray:
    """Return the edges [m] of the elements along the depth, which shrink towards the face and towards the far face.

    Every interface of two layers is an edge, and the other edges keep away from it.
    """
    height = sum(stack.thicknesses)
    interfaces = np.cumsum(stack.thicknesses)[:-1]
    below_face = height * DEPTH_RATIO ** np.arange(n_elements, 0, -1)
    above_far_face = _grade_edges(height, n_elements - 1, DEPTH_RATIO)[1:-1]
    depths = np.concatenate([below_face, above_far_face])
    for interface in interfaces:
        ratio = np.maximum(depths, interface) / np.minimum(depths, interface)
        depths = depths[ratio >= MIN_EDGE_DEPTH_RATIO]
    return np.concatenate([[0.0], np.sort(np.append(depths, interfaces)), [height]])


def compute_side_change(stack: LayerStack, shape: BlockShape, level: int = 1) -> SideChange:
    """Compute the change of compliance by free sides, or read it from the user's cache.

    Parameters
    ----------
    stack : LayerStack
        Layers of the block on a rigid base.
    shape : BlockShape
        Face of the block and its free sides.
    level : int
        Refinement of the elements. Between the middle and a free side lie level + 2 of them, or 4 (level + 1) in a plane
        problem, whose lengths decrease by a ratio that grows from 1/4 with the level, so that all become shorter.

    Returns
    -------
    SideChange
    """
    return _get_side_change(stack, shape, level)


@lru_cache(maxsize=MAX_CHANGES_IN_MEMORY)
def _get_side_change(stack: LayerStack, shape: BlockShape, level: int) -> SideChange:
    """Return the result of `compute_side_change`, once per process."""
    is_plane = shape.free_sides == "x"
    n_elements = 4 * (level + 1) if is_plane else level + 2
    ratio = (level + 1) / (level + 4)
    x = _make_elements(_grade_edges(shape.length / 2, n_elements, ratio))
    y_edges = [0.0, shape.width / 2]
    if not is_plane:
        y_edges = _grade_edges(shape.width / 2, n_elements, ratio)
    y = _make_elements(y_edges, 0 if is_plane else ORDER)
    depths = _grade_depths(stack, level + 2)

    # A plane problem takes less time than a file
    if is_plane:
        return SideChange(x, y, *_compute_changes(x, y, depths, stack))
    key = repr((CACHE_VERSION, ORDER, x.edges.tolist(), y.edges.tolist(), depths.tolist(), stack))
    folder = user_cache.find_cache_base() / CACHE_FOLDER_NAME
    path = folder / f"{sha256(key.encode()).hexdigest()}.npz"
    is_trusted = not user_cache.prepare_folder(folder)
    with suppress(OSError, ValueError, KeyError, zipfile.BadZipFile):
        if is_trusted:
            with np.load(path, allow_pickle=False) as file:
                return SideChange(x, y, file["normal"], file["shear"])
    normal, shear = _compute_changes(x, y, depths, stack)
    if is_trusted:
        content = io.BytesIO()
        np.savez(content, normal=normal, shear=shear)
        _remove_oldest_files(folder)
        user_cache.write_cache_file(path, content.getvalue())
    return SideChange(x, y, normal, shear)


def _remove_oldest_files(folder) -> None:
    """Remove the oldest files of a folder, so that fewer than MAX_CACHED_BLOCKS remain."""
    with suppress(OSError):
        paths = sorted(folder.glob("*.npz"), key=lambda path: path.stat().st_mtime)
        for path in paths[: len(paths) + 1 - MAX_CACHED_BLOCKS]:
            path.unlink(missing_ok=True)


def _compute_changes(x: Elements, y: Elements, depths, stack: LayerStack):
    """Compute the changes (2, p, m, m) [m/N] of the normal and of the shear compliance (see SideChange)."""
    quarter = _Quarter(x, y, depths, stack)
    n_parities = 2 if y.order else 1
    n_nodes = x.n_nodes * y.n_nodes
    normal = np.empty((2, n_parities, n_nodes, n_nodes))
    shear = np.empty_like(normal)
    for mirror_x in range(2):
        for mirror_y in range(n_parities):
            # One block with free sides serves normal loads and the shear loads of the other parity along x
            held = quarter.hold_mirror_planes(mirror_x, mirror_y)
            free = quarter.condense(held)
            between_guides = quarter.condense(held | quarter.hold_sides([0], [1]))
            normal[mirror_x, mirror_y] = (free - between_guides)[2, :, 2]
            between_guides = quarter.condense(held | quarter.hold_sides([1, 2], [1]))
            shear[1 - mirror_x, mirror_y] = (free - between_guides)[0, :, 0]
    return normal, shear


class _Quarter:
    """Quarter of a block, whose stiffness is condensed to its face.

    Parameters
    ----------
    x, y : Elements
        Elements from the middle of the face to its sides.
    depths : (l + 1,) ndarray
        Edges of the elements along z [m].
    stack : LayerStack
        Layers of the block.
    """

    def __init__(self, x: Elements, y: Elements, depths, stack: LayerStack):
        self.x = x
        self.y = y
        self.depths = depths
        layer = np.searchsorted(np.cumsum(stack.thicknesses), (depths[1:] + depths[:-1]) / 2)
        self.moduli = [stack.moduli[k] for k in layer]
        self.reference = _make_elements([-1.0, 1.0])
        self.in_plane = self._assemble_in_plane()

    def hold_mirror_planes(self, mirror_x: int, mirror_y: int) -> np.ndarray:
        """Return which displacements (3, n_x, n_y) vanish on the planes x = 0 and y = 0.

        A load that is even (0) about a plane holds the displacement across it, and one that is odd (1) those along it.
        """
        held = np.zeros((3, self.x.n_nodes, self.y.n_nodes), bool)
        held[[1, 2] if mirror_x else [0], 0] = True
        if not self.y.order:
            held[1] = True
        else:
            held[[0, 2] if mirror_y else [1], :, 0] = True
        return held

    def hold_sides(self, components_x: list[int], components_y: list[int]) -> np.ndarray:
        """Return which displacements (3, n_x, n_y) guides hold: components on the sides across x and across y."""
        held = np.zeros((3, self.x.n_nodes, self.y.n_nodes), bool)
        held[components_x, -1] = True
        if self.y.order:
            held[components_y, :, -1] = True
        return held

    def _assemble_in_plane(self) -> dict:
        """Return the in-plane factors of the stiffness, (2, 3 m, 3 m) for lambda = 1 and for mu = 1.

        Those named "mass", "mixed" and "stiffness" multiply the integrals of N_i N_j, N_i' N_j and N_i' N_j' along z,
        where i is the test function.
        """
        x, y = self.x, self.y
        n_nodes = x.n_nodes * y.n_nodes
        slopes_x = np.kron(x.stiffness, y.mass)
        slopes_y = np.kron(x.mass, y.stiffness)
        values = np.kron(x.mass, y.mass)
        test_slope_x = np.kron(x.mixed, y.mass)
        test_slope_y = np.kron(x.mass, y.mixed)
        test_x_trial_y = np.kron(x.mixed, y.mixed.T)

        # The energy is lambda (div u)^2 / 2 + mu e : e
        shape = (2, 3, n_nodes, 3, n_nodes)
        mass = np.zeros(shape)
        mass[0, 0, :, 0] = slopes_x
        mass[0, 1, :, 1] = slopes_y
        mass[0, 0, :, 1] = test_x_trial_y
        mass[0, 1, :, 0] = test_x_trial_y.T
        mass[1, 0, :, 0] = 2 * slopes_x + slopes_y
        mass[1, 1, :, 1] = 2 * slopes_y + slopes_x
        mass[1, 2, :, 2] = slopes_x + slopes_y
        mass[1, 0, :, 1] = test_x_trial_y.T
        mass[1, 1, :, 0] = test_x_trial_y
        mixed = np.zeros(shape)
        mixed[0, 2, :, 0] = test_slope_x.T
        mixed[0, 2, :, 1] = test_slope_y.T
        mixed[1, 0, :, 2] = test_slope_x.T
        mixed[1, 1, :, 2] = test_slope_y.T
        stiffness = np.zeros(shape)
        stiffness[0, 2, :, 2] = values
        stiffness[1, 0, :, 0] = values
        stiffness[1, 1, :, 1] = values
        stiffness[1, 2, :, 2] = 2 * values
        named = {"mass": mass, "mixed": mixed, "stiffness": stiffness}
        return {name: part.reshape(2, 3 * n_nodes, 3 * n_nodes) for name, part in named.items()}

    def condense(self, held: np.ndarray) -> np.ndarray:
        """Compute the compliance (3, m, 3, m) [m/N] of the face; 0 for held displacements.

        Parameters
        ----------
        held : (3, n_x, n_y) bool ndarray
            Displacements that vanish at all depths; those of the far face vanish as well.
        """
        free = np.flatnonzero(~held.ravel())
        column = np.where(
            (self.x.bricks[:, None] >= 0) & (self.y.bricks >= 0),
            self.x.bricks[:, None] * self.y.n_nodes + self.y.bricks,
            -1,
        )
        column = np.broadcast_to(column, held.shape).ravel()[free]
        in_plane = {name: part[:, free[:, None], free] for name, part in self.in_plane.items()}

        # Sheets of bricks, from the far face up; the stiffness of those below acts on the foot of the next one
        below = None
        for sheet in reversed(range(len(self.moduli))):
            stiffness = self._assemble_sheet(in_plane, sheet)
            if below is None:
                stiffness = stiffness[: -free.size, : -free.size]
            else:
                stiffness[-free.size :, -free.size :] += below
            below = _condense_sheet(stiffness, column)

        compliance = np.linalg.inv(below)
        out = np.zeros((held.size, held.size))
        out[free[:, None], free] = (compliance + compliance.T) / 2
        return out.reshape(3, held.size // 3, 3, held.size // 3)

    def _assemble_sheet(self, in_plane: dict, sheet: int) -> np.ndarray:
        """Return the stiffness (5 f, 5 f) [N/m] of a sheet of bricks, ordered by depth and then by in-plane unknowns.

        `in_plane` holds the factors (2, f, f) of the unknowns that are not held.
        """
        half = (self.depths[sheet + 1] - self.depths[sheet]) / 2
        weighted = {
            name: np.tensordot(self.moduli[sheet], part, 1) for name, part in in_plane.items()
        }
        reference = self.reference
        out = np.kron(half * reference.mass, weighted["mass"])
        out += np.kron(reference.stiffness / half, weighted["stiffness"])
        mixed = np.kron(reference.mixed, weighted["mixed"])
        out += mixed
        out += mixed.T
        return out


def _condense_sheet(stiffness: np.ndarray, column: np.ndarray) -> np.ndarray:
    """Eliminate all unknowns of a sheet of bricks but those of its top.

    The unknowns inside each brick are eliminated first: they couple with those of the same brick alone.

    Parameters
    ----------
    stiffness : (l f, l f) ndarray
        Stiffness [N/m] at l depths, from the top down, which is changed.
    column : (f,) int ndarray
        Column of bricks inside which an unknown of one depth lies; -1 between columns.

    Returns
    -------
    (f, f) ndarray
        Stiffness [N/m] of the top.
    """
    n_top = column.size
    depth = np.arange(len(stiffness)) // n_top
    is_inside = (depth > 0) & (depth < ORDER)
    brick = np.where(is_inside, np.tile(column, len(stiffness) // n_top), -1)
    for number in np.unique(column[column >= 0]):
        inside = np.flatnonzero(brick == number)
        is_coupled = stiffness[inside].any(axis=0)
        is_coupled[inside] = False
        coupled = np.flatnonzero(is_coupled)
        coupling = stiffness[inside[:, None], coupled]
        solved = np.linalg.solve(stiffness[inside[:, None], inside], coupling)
        stiffness[coupled[:, None], coupled] -= coupling.T @ solved

    others = np.flatnonzero(brick < 0)[n_top:]
    factor, info = dpotrf(stiffness[others[:, None], others].T, lower=1, overwrite_a=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("the stiffness of a block is not positive definite")
    half_solved = dtrsm(1.0, factor, stiffness[others, :n_top], lower=1)
    return stiffness[:n_top, :n_top] - half_solved.T @ half_solved
