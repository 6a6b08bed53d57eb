"""Grids and elastic layers of the two pieces of a patch: made, or read from a mesh file."""

from ..closed_forms import contact
from ..core import PatchfemError
from ..elasticity.elasticity import Layers
from ..mesh import files, shaped
from ..mesh.tensor import GROWTH, TensorGrid, graded_grid
from .patch import OnePiece, PatchModel


def layers_of(patch: PatchModel, piece: OnePiece) -> Layers:
    """Elastic layers of one piece of a patch; a bare piece has its substrate as coating."""
    coat = piece.coating.material if piece.coating else piece.substrate
    return Layers(
        (coat.young, coat.poisson), (piece.substrate.young, piece.substrate.poisson), patch.plane
    )


def grid_of(patch: PatchModel, piece: OnePiece):
    """The grid with an even interface that is made for a piece without a mesh file."""
    return outlined(
        patch, piece, graded_grid(patch.length, piece.height, patch.size, piece.thickness)
    )


def outlined(patch: PatchModel, piece: OnePiece, grid: TensorGrid, growth: float = GROWTH):
    """The grid of a piece over the interface, continued to the ends of the piece: a ShapedGrid.

    growth: of the columns beyond the interface. The grid is returned as it is where neither piece reaches beyond.
    """
    if not patch.outlined:
        return grid

    return shaped.shaped_grid(grid, piece.length, piece.end, growth)


def rounded_edges(patch: PatchModel) -> tuple:
    """Places [m] where the flat and where the contact ends at rounded ends, either side, and the distance [m] between
    the two; ((), None) where the ends are not rounded.

    It is that of a rounded punch on a half plane under the nominal load without tilt (closed_forms.contact), the faces
    as stiff as their coatings.
    """
    rounded = [
        piece.end.size
        for piece in (patch.lower, patch.upper)
        if piece.corner(patch.length / 2) == "radius"
    ]
    load = patch.nominal_load / (patch.width * patch.pairs)
    if not rounded or not load > 0:
        return (), None
    flat = min(piece.length / 2 - piece.end.size for piece in (patch.lower, patch.upper))
    faces = [
        piece.coating.material if piece.coating else piece.substrate
        for piece in (patch.lower, patch.upper)
    ]
    modulus = 1 / sum((1 - face.poisson**2) / face.young for face in faces)
    half = contact.rounded_punch_half_width(
        load, flat, 1 / sum(1 / radius for radius in rounded), modulus
    )
    half = min(half, patch.length / 2)
    return (-half, -flat, flat, half), half - flat


def bodies_of(patch: PatchModel) -> tuple:
    """Meshes of the two pieces: (lower, upper or None where it is alike).

    They are grids that are made (both a ShapedGrid where a piece reaches beyond the interface), the tensor grids that
    are recognised in the named mesh file, or its two pieces of any triangles and quads.
    """
    if patch.mesh is None:
        return grid_of(patch, patch.lower), None if patch.alike else grid_of(patch, patch.upper)

    try:
        low, high = files.read_bodies(patch.mesh)
    except PatchfemError as error:
        error.key = error.key or "contact.mesh"
        raise
    for side, body in (("lower", low), ("upper", high or low)):
        _matches(patch, side, body)
    return low, low if high is None and not patch.alike else high


def _matches(patch: PatchModel, side: str, body) -> None:
    piece = getattr(patch, side)
    for key, mine, wanted in (
        ("length", body.length, patch.length),
        ("height", body.height, piece.height),
        ("coating.thickness", body.coating, piece.thickness),
    ):
        if abs(mine - wanted) > 1e-6 * patch.length:  # printed digits of a mesh file
            raise PatchfemError(
                f"{wanted:.9g} m in the scene, but {mine:.9g} m in the {side} piece of the mesh",
                f"contact.{key}",
            )
