"""Two pieces of a patch condensed to the compliance of their common interface.

In: a `PatchModel` and the meshes of its pieces. Out: a `Pair` with meshes, assembled pieces and
compliance; large ones are cached on disk. Pieces whose interface nodes do not match are joined
by a mortar method.
"""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from ...core import Compliance, Interface, frozen_array
from ...elasticity import cache, mortar, substructure
from ...elasticity.elasticity import (
    InterfaceCompliance,
    Layers,
    Piece,
    interface_compliance,
    make_piece,
)
from ...mesh.tensor import TensorGrid
from ...model.pieces import make_elastic_layers
from . import store

# Smallest number of interface nodes for which the condensed operator is cached on disk.
MIN_CACHED_NODES = 150


@dataclass(frozen=True, eq=False, slots=True)
class Pair:
    """Two elastic pieces condensed to their interface, independent of load and surface shape.

    - grid, piece: mesh and assembled piece of the lower side: TensorGrid with Piece, or PieceMesh
      with Substructure.
    - upper_grid, upper: the same of the upper side; identical objects if the pieces are alike.
    - compliance: sum over both pieces, for all pairs together.
    - closing (m, m): normal closing per shear force on the interface [m/N]; zero for alike pieces.
    - joint: Mortar of pieces whose interface nodes do not match, else None.
    - rise (m,): gap [m] due to rounded ends of the interface.
    - seconds: CPU seconds by name.
    """

    grid: object
    upper_grid: object
    piece: object
    upper: object
    compliance: Compliance
    closing: np.ndarray
    joint: object
    rise: np.ndarray
    seconds: dict

    @property
    def coupling(self) -> float:
        """Return the largest ratio of normal to tangential displacement under a shear force.

        The ratio [1] is 0 for mirrored pieces.
        """
        return float(np.abs(self.closing).max() / np.abs(self.compliance.tangential).max())

    @property
    def row(self) -> float:
        """Mean height [m] of the elements next to the interface, averaged over both pieces."""
        return float(self.grid.first_row_height + self.upper_grid.first_row_height) / 2

    @property
    def round_off_error(self) -> float:
        """Relative round-off error of the compliance [1]; 0 if it is negligible."""
        return max(self.piece.round_off_error, self.upper.round_off_error)

    def forces(self, nodal) -> tuple:
        """Return the interface forces (..., m) as nodal forces of the lower and of the upper piece."""
        if self.joint is None:
            return nodal, nodal
        return self.joint.distribute_forces(nodal)


def finite_elements(body, layers: Layers):
    """Return the assembled piece of a tensor grid (Piece) or of any other mesh (Substructure)."""
    if isinstance(body, TensorGrid):
        return make_piece(body.x, body.depth, body.coating_rows, layers)
    return substructure.Substructure(body, layers)


def load_compliance(body, piece, fresh: bool) -> InterfaceCompliance:
    """Return the interface compliance of a piece, read from the disk cache if possible.

    It has the normal, tangential and coupling parts nn, tt and nt.

    Parameters
    ----------
    body : TensorGrid or PieceMesh
    piece : Piece or Substructure
    fresh : bool
        Whether to ignore the cache.
    """
    is_grid = isinstance(body, TensorGrid)
    if (body.x.size if is_grid else len(body.points) ** 0.5) < MIN_CACHED_NODES:
        return interface_compliance(piece)
    if is_grid:
        key = cache.grid_key(body.x, body.depth, body.coating_rows, piece.layers)
    else:
        key = cache.mesh_key(body, piece.layers)
    shapes = dict.fromkeys(InterfaceCompliance._fields, 2 * (body.x.size,))
    cached_arrays = None if fresh else cache.load_arrays(key, shapes)
    if cached_arrays is not None:
        return InterfaceCompliance(**cached_arrays)
    compliance = interface_compliance(piece)
    if not piece.round_off_error:
        cache.store_arrays(key, compliance._asdict())
    return compliance


def condense(patch_model, grid, upper_grid=None, fresh: bool = False) -> Pair:
    """Assemble the two pieces of a `PatchModel` and condense them to their interface.

    Parameters
    ----------
    patch_model : PatchModel
    grid, upper_grid : TensorGrid or PieceMesh
        Meshes from `make_piece_meshes`; the upper one is None if the pieces are alike.
    fresh : bool
        Whether to ignore operators kept on disk.

    Returns
    -------
    Pair
    """
    width = patch_model.pieces.width * patch_model.pieces.pairs
    start = perf_counter()
    piece = finite_elements(grid, make_elastic_layers(patch_model, patch_model.pieces.lower))
    upper = piece
    if upper_grid is not None:
        upper = finite_elements(
            upper_grid, make_elastic_layers(patch_model, patch_model.pieces.upper)
        )
    lower_compliance = load_compliance(grid, piece, fresh)
    upper_compliance = (
        lower_compliance if upper is piece else load_compliance(upper_grid, upper, fresh)
    )
    joint = None
    x = grid.x
    tributary_lengths = grid.tributary_lengths()
    if upper_grid is not None and not _nodes_match(x, upper_grid.x):
        joint = mortar.join_pieces(
            mortar.PieceInterface(x, lower_compliance),
            mortar.PieceInterface(upper_grid.x, upper_compliance),
        )
        x = joint.x
        tributary_lengths = joint.tributary_lengths
        compliances = joint.compliance
    # Equal shear forces raise the interface of the upper piece as much as they lower that of an
    # equal lower piece, so that the coupling nt cancels.
    else:
        compliances = (
            lower_compliance.nn + upper_compliance.nn,
            lower_compliance.tt + upper_compliance.tt,
            lower_compliance.nt - upper_compliance.nt,
        )
    normal, tangential, closing = (frozen_array(part / width) for part in compliances)
    interface = Interface(frozen_array(x), frozen_array(tributary_lengths * width), width)
    end_gap = sum(_rounded_end_gap(body, interface.x) for body in (grid, upper_grid or grid))
    seconds = {"condense": perf_counter() - start}
    pieces = Compliance(interface, normal, tangential)
    return Pair(
        grid,
        upper_grid or grid,
        piece,
        upper,
        pieces,
        closing,
        joint,
        frozen_array(end_gap),
        seconds,
    )


def shared_pairs(patch_model) -> tuple:
    """Return the condensed pieces (Pair) of a model on every level of its shared meshes."""
    return tuple(
        shared_pair(patch_model, level) for level in range(len(patch_model.mesh.shared.levels))
    )


def shared_pair(patch_model, level: int) -> Pair:
    """Return the condensed pieces (Pair) of a model on one level of its shared meshes."""
    bodies = patch_model.mesh.shared.levels[level]
    return store.get_or_compute(
        _condensed_pair_key(patch_model, patch_model.mesh.shared.name, level),
        lambda: delete_factors(condense(patch_model, *bodies)),
    )


def cache_pairs(patch_model, meshes, pairs) -> None:
    """Store the condensed pieces of new shared meshes in the cache, level by level.

    Parameters
    ----------
    patch_model : PatchModel
        One of the patches that share the meshes.
    meshes : SharedMeshes
    pairs : sequence of Pair
        Condensed pieces, fine to coarse.
    """
    for level, pair in enumerate(pairs):
        store.store_result(
            _condensed_pair_key(patch_model, meshes.name, level), delete_factors(pair)
        )


def _condensed_pair_key(patch_model, name: str, level: int) -> tuple:
    """Return the cache key of the condensed pieces on one level of a shared mesh."""
    return (
        "pair",
        name,
        level,
        patch_model.pieces.lower,
        patch_model.pieces.upper,
        patch_model.pieces.plane,
        patch_model.pieces.width * patch_model.pieces.pairs,
    )


def delete_factors(pair: Pair) -> Pair:
    """Delete the factorized matrices of the pieces in a Pair to free memory; return the Pair.

    The factors need far more memory than the compliance, and are recomputed for fields.
    """
    for piece in (pair.piece, pair.upper):
        if isinstance(piece, Piece) and not piece.round_off_error:
            piece.computed.clear()
    return pair


def pair_on_same_meshes(patch_model, pair: Pair) -> Pair:
    """Return the pieces of a `PatchModel`, condensed on the meshes of a given Pair.

    Shared pieces are reused if the meshes are shared.
    """
    for k, level in enumerate(
        () if patch_model.mesh.shared is None else patch_model.mesh.shared.levels
    ):
        if np.array_equal(level[0].x, pair.grid.x) and (level[1] is None) == (
            pair.upper is pair.piece
        ):
            return shared_pair(patch_model, k)
    return condense(patch_model, pair.grid, None if pair.upper is pair.piece else pair.upper_grid)


def _rounded_end_gap(body, x) -> np.ndarray:
    """Return the gap (m,) [m] at positions x (m,) [m] due to the rounded ends of a body."""
    depths = getattr(body, "interface_depths", None)
    return np.zeros(x.size) if depths is None else np.interp(x, body.x, depths)


def _nodes_match(lower_x, upper_x) -> bool:
    """Return whether the interface nodes of the two pieces coincide."""
    return upper_x.size == lower_x.size and np.abs(upper_x - lower_x).max() <= 1e-9 * np.ptp(
        lower_x
    )
