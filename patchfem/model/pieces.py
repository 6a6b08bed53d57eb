"""Grids and elastic layers of the two pieces of a patch, generated or from a mesh file."""

from .. import closed_forms, elasticity
from ..core import PatchfemError
from ..elasticity.elasticity import Layers
from ..mesh import files
from ..mesh import pieces as piece_meshes
from ..mesh.grid import ROW_HEIGHT_GROWTH, TensorGrid, compute_row_scale, make_graded_grid
from ..scene.keys.quantities import UNIT_FACTORS
from .patch import PatchModel, PatchPiece, PatchPieces
from .source import name_key

# Largest difference of equal sizes, as a fraction of the interface length; mesh files
# contain coordinates of few digits.
EQUAL_SIZES_TOL = 1e-6


def make_elastic_layers(patch: PatchModel, piece: PatchPiece) -> Layers:
    """Return the elastic layers of a piece of a patch.

    The coating of a bare piece has the material of the substrate.
    """
    coating = piece.face_material
    substrate = piece.substrate
    return Layers(
        (coating.young, coating.poisson), (substrate.young, substrate.poisson), patch.pieces.plane
    )


def make_layer_stacks(
    patch: PatchModel,
) -> "tuple[elasticity.sides.LayerStack, elasticity.sides.LayerStack]":
    """Return the layers of the upper and of the lower piece of a patch, from the face to the far face."""
    stacks = []
    for piece in (patch.pieces.upper, patch.pieces.lower):
        layers = make_elastic_layers(patch, piece)
        stacks.append(elasticity.sides.make_stack(piece.height, piece.thickness, layers))
    return tuple(stacks)


def _make_flat_grid(patch: PatchModel, piece: PatchPiece):
    """Generate the grid of a piece of a patch with a flat interface."""
    grid = make_graded_grid(
        patch.pieces.length, piece.height, patch.uniform_element_size, piece.thickness
    )
    growth = 1 + ROW_HEIGHT_GROWTH * compute_row_scale(grid.x.size - 1)
    return extend_grid(patch, piece, grid, growth)


def extend_grid(patch: PatchModel, piece: PatchPiece, grid: TensorGrid, growth: float):
    """Extend a grid over the interface to the ends of its piece.

    Parameters
    ----------
    patch : PatchModel
        Patch of the piece.
    piece : PatchPiece
        Piece whose grid is extended.
    grid : TensorGrid
        Grid over the interface.
    growth : float
        Ratio of the lengths of successive columns beyond the interface.

    Returns
    -------
    TensorGrid
    """
    return grid.extend(piece.length, piece.end, growth) if patch.pieces.has_overhang else grid


def estimate_rounded_length(patch: PatchModel) -> float:
    """Return the length [m] of the contact on each rounded end of the pieces.

    It is that of a rounded punch on a half plane, as stiff as the coatings, under the nominal load without tilt; 0 if no
    piece is rounded or there is no load.
    """
    pieces = patch.pieces.both
    half_length = patch.pieces.length / 2
    radii = [piece.end.size for piece in pieces if piece.corner_kind(half_length) == "radius"]
    load = patch.nominal_load / (patch.pieces.width * patch.pieces.pairs)
    if not radii or not load > 0:
        return 0.0
    flat = patch.pieces.flat_half_length
    modulus = patch.pieces.surface_modulus
    radius = 1 / sum(1 / radius for radius in radii)
    half_width = closed_forms.contact.rounded_punch_half_width(load, flat, radius, modulus)
    return min(half_width, half_length) - flat


def make_piece_meshes(patch: PatchModel) -> "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]":
    """Return the meshes of both pieces, generated or read from the mesh file of the scene.

    Returns
    -------
    tuple
        Meshes (lower, upper): TensorGrids, of which the upper one is None if it is like the lower, or the
        PieceMeshes of the file.

    Raises
    ------
    PatchfemError
        If the file cannot be read or its pieces are not those of the scene.
    """
    pieces = patch.pieces
    if patch.mesh.file is None:
        lower = _make_flat_grid(patch, pieces.lower)
        return lower, None if pieces.are_alike else _make_flat_grid(patch, pieces.upper)

    with name_key("contact.mesh"):
        pair = files.read_pieces(*patch.mesh.file)
    check_mesh_size(pieces, pair.lower, pair.upper, patch.mesh.file.unit)
    return pair.lower, pair.upper


def check_mesh_size(pieces: PatchPieces, lower, upper, unit: float) -> None:
    """Raise PatchfemError unless both bodies of a mesh file have the sizes of the pieces of the scene.

    Parameters
    ----------
    pieces : PatchPieces
        Pieces of the scene.
    lower, upper : TensorGrid or PieceMesh
        Bodies of the file, in m.
    unit : float
        Length unit [m] that was used for the coordinates in the file.

    Raises
    ------
    PatchfemError
        With the key of the size that differs, or of the file if another unit gives this size; the message names it.
    """
    for side, piece, body in (("lower", pieces.lower, lower), ("upper", pieces.upper, upper)):
        for key, in_file, in_scene in (
            ("length", body.length, pieces.length),
            ("height", body.height, piece.height),
            ("coating.thickness", body.coating_thickness, piece.thickness),
        ):
            if abs(in_file - in_scene) <= EQUAL_SIZES_TOL * pieces.length:
                continue
            advice = ""
            for name, factor in UNIT_FACTORS["length"].items():
                if in_scene and abs(in_file / unit * factor / in_scene - 1) <= EQUAL_SIZES_TOL:
                    advice = f': set contact.mesh_unit = "{name}"'
            text = f"{in_scene:.9g} m in the scene, but {in_file:.9g} m in the {side} piece of the mesh"
            # The unit belongs to the file, not to the size in the scene
            if advice:
                raise PatchfemError(f"{key} {text}{advice}", "contact.mesh")
            raise PatchfemError(text, f"contact.{key}")
