"""Grids and elastic layers of the two pieces of a patch: made, or read from a mesh file."""

from ..core import PatchfemError
from ..elasticity.elasticity import Layers
from ..mesh.tensor import TensorGrid, graded_grid
from .patch import OnePiece, PatchModel


def layers_of(patch: PatchModel, piece: OnePiece) -> Layers:
    """Elastic layers of one piece of a patch; a bare piece has its substrate as coating."""
    coat = piece.coating.material if piece.coating else piece.substrate
    return Layers((coat.young, coat.poisson), (piece.substrate.young, piece.substrate.poisson), patch.plane)


def grid_of(patch: PatchModel, piece: OnePiece) -> TensorGrid:
    """The tensor grid with an even interface that is made for a piece without a mesh file."""
    return graded_grid(patch.length, piece.height, patch.size, piece.thickness)


def bodies_of(patch: PatchModel) -> tuple:
    """Meshes of the two pieces: (lower, upper or None where it is alike).

    They are grids that are made, the tensor grids that are recognised in the named mesh file, or its two pieces of any
    triangles and quads.
    """
    if patch.mesh is None:
        return grid_of(patch, patch.lower), None if patch.alike else grid_of(patch, patch.upper)
    from ..mesh.files import read_bodies

    low, high = read_bodies(patch.mesh)
    for side, body in (("lower", low), ("upper", high or low)):
        _matches(patch, side, body)
    return low, low if high is None and not patch.alike else high


def _matches(patch: PatchModel, side: str, body) -> None:
    piece = getattr(patch, side)
    for key, mine, wanted in (("length", body.length, patch.length), ("height", body.height, piece.height),
                              ("coating.thickness", body.coating, piece.thickness)):
        if abs(mine - wanted) > 1e-6 * patch.length:  # printed digits of a mesh file
            raise PatchfemError(f"{wanted:.9g} m, the {side} piece of the mesh has {mine:.9g} m", f"contact.{key}")
