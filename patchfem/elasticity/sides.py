"""Change of the compliance of a block by its free sides, by bricks of order 4.

A block between guides without friction responds to cosine waves in closed form (`contact.waves`). Free sides change its
compliance by a smooth function, which is computed on a quarter of the block, for loads that are even or odd along each
axis. The displacement is a product of splines of order 4 along x and y, which have continuous third derivatives because
the layers do not vary along the face, and of polynomials of order 4 in each sheet of bricks along z. The stiffness is a
sum of Kronecker products of matrices along the axes; it is condensed to the face from the far face up, sheet by sheet. The
lengths of the bricks decrease geometrically towards free sides and towards both faces, because the stress is singular at
the edges of the block.

The change is the difference of two results on the same bricks, in which their errors near a load cancel.
"""

import io
import zipfile
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from ..disk import user_cache
from .elasticity import Layers, lame_constants
from .lapack import dpotrf, dtrsm

ORDER = 4  # Order of the splines and polynomials
DEPTH_RATIO = 0.25  # Ratio of the thicknesses of neighbouring bricks towards both faces
CACHE_FOLDER_NAME = "patchfem-sides"
# Largest number of cached blocks; each needs up to 1 MB
MAX_CACHED_BLOCKS = 100


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
    """Return thickness and Lame constants of the layers of a piece, from its interface to its fixed far face.

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
    - pairs: Number of equal pairs of blocks that share the forces.
    """

    length: float
    width: float
    free_sides: str = "xy"
    pairs: int = 1


class Axis(NamedTuple):
    """Splines along an axis of a face, from one side to the other.

    - even, odd: n functions each, even and odd about the middle; the last one alone does not vanish at the sides. A
      displacement that does not vary has one even function and no odd ones.
    """

    even: BSpline
    odd: BSpline

    def integrate(self, cell_edges: np.ndarray) -> np.ndarray:
        """Return the integrals (c, n) [m] of all functions over c cells with increasing edges (c + 1,) [m], even first."""
        primitives = [spline.antiderivative()(cell_edges) for spline in self]
        return np.diff(np.concatenate(primitives, axis=1), axis=0)


class SideChange(NamedTuple):
    """Change of the compliance of a face by free sides, for loads of one parity along each axis.

    - x, y: Splines along both axes.
    - normal, shear (2, p, m, m): Change [m/N] for normal tractions and for shear tractions along x. The first index is 0
      for tractions even along x and 1 for odd ones, the second likewise along y; p is 1 for loads that do not vary along
      y, else 2. The m functions are ordered by x, then y, and the forces are those on a quarter of the face.
    """

    x: Axis
    y: Axis
    normal: np.ndarray
    shear: np.ndarray


def _make_axis(edges: np.ndarray) -> Axis:
    """Make the splines on bricks with edges (e + 1,) [m] from the middle to a side."""
    ends = np.repeat(edges[-1], ORDER)
    knots = np.concatenate([-ends, -edges[:0:-1], edges, ends])
    unit = np.eye(knots.size - ORDER - 1)
    half = len(unit) // 2
    upper = unit[:, half:]
    mirrored = unit[::-1, half:]
    return Axis(BSpline(knots, upper + mirrored, ORDER), BSpline(knots, upper - mirrored, ORDER))


def _make_uniform_axis(length: float) -> Axis:
    """Make the single function 1 on an axis of a length [m]."""
    knots = np.array([-0.5, -0.5, 0.5, 0.5]) * length
    return Axis(BSpline(knots, np.ones((2, 1)), 1), BSpline(knots, np.ones((2, 0)), 1))


def _grade_edges(length: float, n_bricks: int, ratio: float) -> np.ndarray:
    """Return edges (n + 1,) [m] from 0 to a length, between which each brick is shorter than the last one by a ratio."""
    return length * (1 - np.append(ratio ** np.arange(n_bricks), 0.0))


def _grade_depths(stack: LayerStack, n_bricks: int) -> np.ndarray:
    """Return the edges [m] of the bricks along the depth, whose thicknesses shrink towards the face and the far face.

    Every interface of two layers is an edge, and the other edges keep away from it.
    """
    height = sum(stack.thicknesses)
    interfaces = np.cumsum(stack.thicknesses)[:-1]
    below_face = height * DEPTH_RATIO ** np.arange(n_bricks, 0, -1)
    above_far_face = _grade_edges(height, n_bricks - 1, DEPTH_RATIO)[1:-1]
    depths = np.concatenate([below_face, above_far_face])
    for interface in interfaces:
        ratio = np.maximum(depths, interface) / np.minimum(depths, interface)
        # Edges of bricks that are closer to an interface would make thin bricks
        depths = depths[ratio >= 2.0]
    return np.concatenate([[0.0], np.sort(np.append(depths, interfaces)), [height]])


@lru_cache(maxsize=8)  # such as the changes of two pieces on three levels
def compute_side_change(stack: LayerStack, shape: BlockShape, level: int = 1) -> SideChange:
    """Compute the change of compliance by free sides, or read it from the user's cache.

    Parameters
    ----------
    stack : LayerStack
        Layers of the block on a rigid base.
    shape : BlockShape
        Face of the block and its free sides.
    level : int
        Refinement of the bricks. Between the middle and a free side lie 2 (level + 2) of them, or 8 (level + 1) in a plane
        problem. Their lengths decrease by a ratio that grows from 1/2 with the level, so that all of them become shorter.

    Returns
    -------
    SideChange
    """
    is_plane = shape.free_sides == "x"
    n_bricks = 2 * (level + 2)
    ratio = (level + 4) / (level + 8)
    if is_plane:
        n_bricks = 8 * (level + 1)
        ratio = (level + 1) / (level + 2)
    x = _make_axis(_grade_edges(shape.length / 2, n_bricks, ratio))
    if is_plane:
        y = _make_uniform_axis(shape.width)
    else:
        y = _make_axis(_grade_edges(shape.width / 2, n_bricks, ratio))
    depths = _grade_depths(stack, level + 3)

    # A plane problem takes less time than a file
    if is_plane:
        return SideChange(x, y, *_compute_changes(x, y, depths, stack))
    knots = [x.even.t.tolist(), y.even.t.tolist(), depths.tolist()]
    # Number in the names of cached files, which increases when the method changes
    key = repr((1, ORDER, knots, stack))
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


def _compute_changes(x: Axis, y: Axis, depths, stack: LayerStack):
    """Compute the changes (2, p, m, m) [m/N] of the normal and of the shear compliance (see SideChange)."""
    n_parities = 1 + bool(y.odd.c.size)
    n_functions = x.even.c.shape[1] * y.even.c.shape[1]
    normal = np.empty((2, n_parities, n_functions, n_functions))
    shear = np.empty_like(normal)
    for parity_x, parity_y in np.ndindex(2, n_parities):
        # One block with free sides serves normal loads and the shear loads of the other parity along x
        block = _Quarter((x, y), (parity_x, parity_y), depths, stack)
        free = block.condense(())
        # Displacements along an axis (0: x, 1: y, 2: inward) that guides hold on the sides across an axis
        guided = block.condense(((0, 0), (1, 1)))
        inward = block.find_rows(2)
        normal[parity_x, parity_y] = (free - guided)[inward, inward]
        guided = block.condense(((1, 0), (2, 0), (1, 1)))
        along = block.find_rows(0)
        shear[1 - parity_x, parity_y] = (free - guided)[along, along]
    return normal, shear


class _Quarter:
    """Quarter of a block, whose stiffness is condensed to its face.

    Parameters
    ----------
    axes : tuple of Axis
        Splines along x and y.
    parities : tuple of int
        Parity of the inward displacement along x and y: 0 for even, 1 for odd.
    depths : (l + 1,) ndarray
        Edges of the bricks along z [m].
    stack : LayerStack
        Layers of the block.
    """

    def __init__(self, axes, parities, depths, stack: LayerStack):
        self.depths = depths
        layer = np.searchsorted(np.cumsum(stack.thicknesses), (depths[1:] + depths[:-1]) / 2)
        self.moduli = [stack.moduli[k] for k in layer]

        # The displacement along an axis has the other parity along it than the inward one
        functions = []
        for axis, (splines, parity) in enumerate(zip(axes, parities, strict=True)):
            parts = [_evaluate(splines[(parity + (k == axis)) % 2]) for k in range(3)]
            functions.append(parts)
        self.shapes = [tuple(parts[k].values.shape[2] for parts in functions) for k in range(3)]
        self.starts = np.cumsum([0, *(n_x * n_y for n_x, n_y in self.shapes)])
        self.in_plane = self._assemble_in_plane(*functions)

    def find_rows(self, component: int) -> slice:
        """Return the rows of matrices over the face for displacements along an axis (2: inward)."""
        return slice(self.starts[component], self.starts[component + 1])

    def _assemble_in_plane(self, along_x, along_y) -> np.ndarray:
        """Return the in-plane factors of the stiffness, (2, 2, 2, f, f).

        They belong to the Lame constants lambda and mu, to a test function that is not or is differentiated along z, and to
        such a trial function. `along_x` and `along_y` hold the functions of the three displacements.
        """
        out = np.zeros((2, 2, 2, self.starts[-1], self.starts[-1]))
        # lambda div v div u + mu (grad v + grad v^T) : grad u, as (modulus, components of v and u, axes of their slopes)
        for a, b in np.ndindex(3, 3):
            terms = ((0, a, b, a, b), (1, a, b, b, a), (1, a, a, b, b))
            for modulus, test, trial, test_axis, trial_axis in terms:
                parts = []
                for axis, functions in enumerate((along_x, along_y)):
                    slopes = test_axis == axis, trial_axis == axis
                    parts.append(functions[test].integrate(functions[trial], *slopes))
                factors = out[modulus, int(test_axis == 2), int(trial_axis == 2)]
                factors[self.find_rows(test), self.find_rows(trial)] += np.kron(*parts)
        return out

    def condense(self, guides) -> np.ndarray:
        """Compute the compliance (f, f) [m/N] of the face; 0 for displacements that guides hold.

        Parameters
        ----------
        guides : sequence of tuple
            Pairs of a displacement and of the axis across the sides on which it vanishes.
        """
        free = []
        for component, (n_x, n_y) in enumerate(self.shapes):
            is_free = np.ones((n_x, n_y), bool)
            if (component, 0) in guides:
                is_free[-1] = False
            if (component, 1) in guides and n_y > 1:
                is_free[:, -1] = False
            free.append(is_free.ravel())
        free = np.flatnonzero(np.concatenate(free))
        in_plane = self.in_plane[..., free[:, None], free]

        # Sheets of bricks, from the far face up; the stiffness of those below acts on the foot of the next one
        below = None
        for sheet in reversed(range(len(self.moduli))):
            stiffness = self._assemble_sheet(in_plane, sheet)
            if below is None:
                stiffness = stiffness[: -free.size, : -free.size]
            else:
                stiffness[-free.size :, -free.size :] += below
            below = _condense_to_top(stiffness, free.size)
        compliance = np.linalg.inv(below)
        out = np.zeros(self.in_plane.shape[-2:])
        out[free[:, None], free] = (compliance + compliance.T) / 2
        return out

    def _assemble_sheet(self, in_plane: np.ndarray, sheet: int) -> np.ndarray:
        """Return the stiffness (5 f, 5 f) [N/m] of a sheet of bricks, ordered by depth and then by in-plane unknowns.

        `in_plane` (2, 2, 2, f, f) holds the factors of the unknowns that are not held.
        """
        ends = np.repeat(self.depths[sheet : sheet + 2], ORDER + 1)
        functions = _evaluate(BSpline(ends, np.eye(ORDER + 1), ORDER))
        factors = np.tensordot(self.moduli[sheet], in_plane, 1)
        slopes = np.ndindex(2, 2)
        return sum(np.kron(functions.integrate(functions, *pair), factors[pair]) for pair in slopes)


class _Functions(NamedTuple):
    """Functions at the points of an integration.

    - values (2, g, n): Values and slopes [1/m] of n functions at g points.
    - weights (g,): Weights of the points [m].
    """

    values: np.ndarray
    weights: np.ndarray

    def integrate(self, other: "_Functions", slope: int, other_slope: int) -> np.ndarray:
        """Integrate the products of the functions, or of their slopes, with other functions or their slopes.

        Parameters
        ----------
        other : _Functions
            n' functions at the same points.
        slope, other_slope : int
            Whether the slopes [1/m] of the functions and of the others are taken (1) or their values (0).

        Returns
        -------
        (n, n') ndarray
            Integrals [m] of values, divided by m for each slope.
        """
        weighted = self.values[int(slope)] * self.weights[:, None]
        return weighted.T @ other.values[int(other_slope)]


def _evaluate(spline: BSpline) -> _Functions:
    """Evaluate splines at Gauss points between those of their knots that are not negative.

    The points integrate products of two splines exactly.
    """
    edges = np.unique(np.maximum(spline.t, 0.0))
    points, weights = np.polynomial.legendre.leggauss(spline.k + 1)
    half = np.diff(edges)[:, None] / 2
    places = (edges[:-1, None] + half * (1 + points)).ravel()
    values = np.stack([spline(places), spline.derivative()(places)])
    return _Functions(values, (half * weights).ravel())


def _condense_to_top(stiffness: np.ndarray, n_top: int) -> np.ndarray:
    """Return the stiffness (n_top, n_top) [N/m] of the first unknowns of a sheet after elimination of the others."""
    factor, info = dpotrf(stiffness[n_top:, n_top:].T, lower=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("the stiffness of a block is not positive definite")
    half_solved = dtrsm(1.0, factor, stiffness[n_top:, :n_top], lower=1)
    return stiffness[:n_top, :n_top] - half_solved.T @ half_solved
