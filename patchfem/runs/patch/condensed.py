"""Compliance of the two pieces of a patch, condensed to their common interface.

In: a `PatchModel` and the meshes of its pieces. Out: a `CondensedPair` with the meshes, the
pieces and their compliance. A mortar method joins pieces whose interface nodes do not match.
"""

from dataclasses import dataclass
from functools import partial
from time import process_time

import numpy as np

from ...core import Compliance, Interface, frozen_array
from ...elasticity import mortar
from ...elasticity.elasticity import Piece, compute_interface_compliance
from ...mesh import pieces as piece_meshes
from ...model.pieces import make_elastic_layers


@dataclass(frozen=True, eq=False, slots=True)
class CondensedPair:
    """Two elastic pieces condensed to their interface, independent of load and surface shape.

    - grid, piece: mesh and piece on the lower side.
    - upper_grid, upper: the same on the upper side; identical objects if the pieces are identical.
    - compliance: sum of the compliances of both pieces, for all contact pairs together.
    - closing (m, m): normal approach of the surfaces per shear force [m/N]; zero for alike
      pieces.
    - joint: Mortar of pieces with non-matching interface nodes, else None.
    - end_gap (m,): gap [m] due to the rounded ends of the pieces.
    - seconds: CPU seconds by name.
    """

    grid: "piece_meshes.Mesh"
    upper_grid: "piece_meshes.Mesh"
    piece: Piece
    upper: Piece
    compliance: Compliance
    closing: np.ndarray
    joint: "mortar.Mortar | None"
    end_gap: np.ndarray
    seconds: dict[str, float]

    @property
    def coupling(self) -> float:
        """Largest ratio of normal to tangential displacement under a shear force [1].

        It is 0 for identical pieces.
        """
        return float(np.abs(self.closing).max() / np.abs(self.compliance.tangential).max())

    @property
    def row(self) -> float:
        """Height [m] of the elements next to the interface, averaged over both pieces."""
        return float(self.grid.first_row_height + self.upper_grid.first_row_height) / 2

    @property
    def is_quadratic(self) -> bool:
        """Whether a piece has elements of second order, whose interface has nodes between the pressure nodes."""
        return any(mesh.interface.size > mesh.x.size for mesh in (self.grid, self.upper_grid))

    @property
    def round_off_error(self) -> float:
        """Relative round-off error of the compliance; 0 if it is negligible."""
        return max(self.piece.round_off_error, self.upper.round_off_error)

    @property
    def meshes(self) -> "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]":
        """Meshes of the lower and of the upper piece; the latter is None for identical pieces."""
        return self.grid, None if self.upper is self.piece else self.upper_grid

    def forget_factors(self) -> None:
        """Delete the factors of both pieces, which are computed again if displacements inside the pieces are needed."""
        for piece in (self.piece, self.upper):
            piece.computed.pop("factor", None)

    def forces(self, nodal) -> tuple[np.ndarray, np.ndarray]:
        """Distribute interface forces (..., m) to the nodes of the lower and of the upper piece."""
        if self.joint is None:
            return nodal, nodal
        return self.joint.distribute_forces(nodal)


def condense(patch_model, grid, upper_grid=None, *, keep_factors: bool = True) -> CondensedPair:
    """Assemble the two pieces of a `PatchModel` and condense them to their interface.

    Parameters
    ----------
    patch_model : PatchModel
        Patch whose materials, width and coatings the pieces have.
    grid, upper_grid : TensorGrid or PieceMesh
        Meshes from `make_piece_meshes`; the upper one is None if the pieces are identical.
    keep_factors : bool
        Whether the pieces keep the factors of their stiffness, which need far more memory than the compliance. Without
        them they are computed again if displacements inside the pieces are needed.

    Returns
    -------
    CondensedPair
    """
    # Both pieces share one compliance if they are identical.
    width = patch_model.pieces.width * patch_model.pieces.pairs
    start = process_time()
    piece = upper = Piece(grid, make_elastic_layers(patch_model, patch_model.pieces.lower))
    compute = partial(compute_interface_compliance, keep_factor=keep_factors)
    lower_compliance = upper_compliance = compute(piece)
    if upper_grid is not None:
        upper = Piece(upper_grid, make_elastic_layers(patch_model, patch_model.pieces.upper))
        upper_compliance = compute(upper)

    # Interfaces with different nodes are joined by the mortar method.
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
    # Equal and opposite shear forces raise the interface of one of two identical pieces as much as they
    # lower that of the other, so that the coupling nt cancels.
    else:
        compliances = (
            lower_compliance.nn + upper_compliance.nn,
            lower_compliance.tt + upper_compliance.tt,
            lower_compliance.nt - upper_compliance.nt,
        )

    # The compliances hold per unit width; pairs of equal pieces act in parallel.
    normal, tangential, closing = (frozen_array(part / width) for part in compliances)
    # Largest coupling of equal pieces, relative to their compliance, that is round-off of the
    # coordinates in a mesh file
    if np.abs(closing).max() <= 1e-7 * np.abs(tangential).max():
        closing = frozen_array(np.zeros(closing.shape))
    interface = Interface(frozen_array(x), frozen_array(tributary_lengths * width), width)

    # Rounded ends of the pieces open the gap.
    bodies = (grid, upper_grid or grid)
    end_gap = sum(np.interp(interface.x, body.x, body.interface_depths) for body in bodies)
    seconds = {"condense": process_time() - start}

    pieces = Compliance(interface, normal, tangential)
    return CondensedPair(
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


def _nodes_match(lower_x, upper_x) -> bool:
    """Return whether the interface nodes of the two pieces coincide."""
    return upper_x.size == lower_x.size and np.abs(upper_x - lower_x).max() <= 1e-9 * np.ptp(
        lower_x
    )
