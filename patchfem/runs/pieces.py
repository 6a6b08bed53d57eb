"""Displacement and stress inside both pieces in all frames of a run, and where a material yields.

In: a `Result` with a solved patch. Out: `Pieces`, plain arrays on the meshes of both pieces and on
their interface.
"""

from typing import NamedTuple

import numpy as np

from ..elasticity import coating_traction, recovery
from ..elasticity.elasticity import Piece, compute_displacement, von_mises
from ..formatting import format_length
from .patch.strength import YIELDING_NEGLECTED, min_von_mises_ratio, yield_strength
from .results.result import patch_surface

# Height over that of the piece of the region at the held far face in which no yielding is looked
# for: the stress in its corners is unbounded under a rigid holder.
HELD_REGION_FRACTION = 0.2


class PieceFields(NamedTuple):
    """Mesh of one piece, and its fields in f frames.

    The interface is at y = 0; the lower piece has y < 0, the upper one y > 0.

    - points (n, 2): x and y of the nodes [m].
    - blocks: node numbers (c, 3) or (c, 4) of the cells, numbered block after block.
    - is_coating (t,): whether a cell belongs to the coating.
    - displacement (f, n, 2): [m].
    - stress (f, t, 4): xx, yy, zz, xy at the centre of each cell [Pa], positive in tension.
    - von_mises (f, t): [Pa].
    - stress_error (f, t): error of the stress in each cell over the energy norm of both pieces [1],
      estimated by the method of Zienkiewicz and Zhu.
    """

    points: np.ndarray
    blocks: tuple[np.ndarray, ...]
    is_coating: np.ndarray
    displacement: np.ndarray
    stress: np.ndarray
    von_mises: np.ndarray
    stress_error: np.ndarray


class Pieces(NamedTuple):
    """Both pieces and their interface in f frames.

    - time (f,): [s].
    - lower, upper: fields of the pieces.
    - x (k,): positions along the interface [m].
    - weight (k,): areas [m2]; weight times normal stress adds up to the load.
    - interface: fields by name, (f, k), (f, k, 2) or for strips (f, s, k).
    - width: width of the pieces [m].
    """

    time: np.ndarray
    lower: PieceFields
    upper: PieceFields
    x: np.ndarray
    weight: np.ndarray
    interface: dict[str, np.ndarray]
    width: float


class _LoadedPiece(NamedTuple):
    """A piece with the displacements u (1 + f, n, 2) [m] that its loads cause, along x and inward.

    The first displacements are those of the pressed state, the others add to them in each frame.
    """

    cells: recovery.Cells
    interface: np.ndarray
    u: np.ndarray


def compute_pieces(result) -> Pieces:
    """Compute displacement and stress of both pieces in the frames of a run.

    Parameters
    ----------
    result : Result
        A run with a solved patch.

    Returns
    -------
    Pieces
    """
    patch = result.patch
    fields = result.fields
    surface = patch_surface(patch, fields)
    load_pair = zip(("lower", "upper"), _nodal_forces(patch, fields))
    loaded = {side: _load_piece(patch.pair, side, *forces) for side, forces in load_pair}
    interface = {
        name: values
        for name, values in fields.items()
        if name != "time" and not name.startswith("holder_")
    }

    pieces = {}
    errors = {}
    for side, piece in loaded.items():
        # y points away from the interface in the lower piece too until here
        flip = np.array([1.0, -1.0 if side == "lower" else 1.0])
        motion = piece.u[:1] + piece.u[1:]
        stress = recovery.centre_stress(piece.cells, motion)
        errors[side] = _estimate_stress_error(piece.cells, motion, stress)
        mises = von_mises(stress)
        stress[..., 3] *= flip[1]
        moved = motion * flip
        if side == "upper":
            moved += _holder_motion(patch, fields, piece.cells.points)
        blocks = tuple(block[:, :: int(flip[1])] for block in piece.cells.blocks)
        points = piece.cells.points * flip
        pieces[side] = PieceFields(
            points, blocks, piece.cells.is_coating, moved, stress, mises, errors[side].error
        )
        # The shear stress acts along +x on the lower piece, as that of the interface.
        traction = coating_traction.compute_coating_traction(piece.cells, piece.u)
        bonds = coating_traction.interpolate_coating_traction(piece.cells, traction, surface.x)
        for name, rows in bonds.items():
            sign = -flip[1] if name == "shear_bond" else 1.0
            interface[f"{name}_{side}"] = sign * (rows[:1] + rows[1:])

    for side, other in (("lower", "upper"), ("upper", "lower")):
        relative_error = errors[side].relative_error(errors[other])[0]
        pieces[side] = pieces[side]._replace(stress_error=relative_error)
    interface["holder_slide"] = np.repeat(
        _holder_field(fields, "slide", 0.0), surface.x.size, axis=1
    )
    interface["displacement"] = _interpolate_displacement(
        pieces["lower"], loaded["lower"].interface, surface.x
    )
    width = result.plan.model.patch.pieces.width
    return Pieces(
        fields["time"],
        **pieces,
        x=surface.x,
        weight=surface.weight,
        interface=interface,
        width=width,
    )


def _nodal_forces(patch, fields: dict) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return shear and normal forces (1 + f, n) [N/m] on the nodes of the lower and upper piece.

    The first row is the pressed state, the others add to it in each frame. A frame of a worn patch
    has its own pressure.
    """
    pair = patch.pair
    length = patch.pieces.interface.weight / patch.pieces.interface.width
    pressed = patch.pressure.sigma_n
    frames = (len(fields["time"]), length.size)
    shear = np.concatenate(
        [np.zeros((1, length.size)), fields.get("shear_stress", np.zeros(frames))]
    )
    change = fields["normal_stress"] - pressed if "holder_closing" in fields else np.zeros(frames)
    normal = np.concatenate([pressed[None], change])
    return [
        (sign * pair.forces(shear * length)[side], pair.forces(normal * length)[side])
        for side, sign in ((0, 1.0), (1, -1.0))
    ]


def _load_piece(pair, side: str, shear: np.ndarray, normal: np.ndarray) -> _LoadedPiece:
    """Return a piece of a condensed pair with its displacements under nodal forces [N/m]."""
    is_lower = side == "lower"
    piece = pair.piece if is_lower else pair.upper
    grid = pair.grid if is_lower or pair.upper is pair.piece else pair.upper_grid
    cells = recovery.get_cells(piece)
    is_grid = isinstance(piece, Piece)  # its nodes are numbered column by column
    interface = np.arange(0, len(cells.points), grid.depth.size) if is_grid else grid.interface
    return _LoadedPiece(cells, interface, compute_displacement(piece, shear, normal))


def _estimate_stress_error(cells, motion, stress) -> recovery.StressError:
    """Return the estimated error of the stress (f, t, 4) [Pa] in the energy norm."""
    gauss_points = recovery.make_points(cells, "gauss")
    return recovery.estimate_error(recovery.fit_recovery(cells), motion, stress, gauss_points)


def _holder_motion(patch, fields: dict, points) -> np.ndarray:
    """Return the motion (f, n, 2) [m] of points (n, 2) [m] that move with the upper holder."""
    rotation = _holder_field(fields, "rotation", patch.pressure.rotation)
    closing = _holder_field(fields, "closing", patch.pressure.approach)
    slide = _holder_field(fields, "slide", 0.0)
    x, y = points.T
    return np.stack([slide - rotation * y, rotation * x - closing], axis=2)


def _holder_field(fields: dict, name: str, constant: float) -> np.ndarray:
    """Return a motion of the upper holder (f, 1), or the constant that it has in all frames."""
    return fields.get(f"holder_{name}", np.full(len(fields["time"]), constant))[:, None]


def _interpolate_displacement(piece: PieceFields, interface, x) -> np.ndarray:
    """Return the displacement (f, k, 2) [m] of the face of a piece at positions x (k,) [m]."""
    node_x = piece.points[interface, 0]
    face = piece.displacement[:, interface]
    by_axis = [[np.interp(x, node_x, row) for row in face[..., axis]] for axis in (0, 1)]
    return np.stack(by_axis, axis=2)


def add_yielding_notes(result, pieces: Pieces) -> None:
    """Add notes on materials that yield inside the pieces to the notes of a result.

    They replace notes on the same material at its face, which know only the pressure.
    """
    peak = result.measures.get("pressure_peak")
    has_peak = peak is not None and peak.value is not None
    min_peak = peak.value - (peak.error or 0.0) if has_peak else 0.0
    faces = result.extra.get("yielding_faces", {})
    yielding = faces | find_yielding(result.plan.model.patch, pieces, min_peak)
    notes = result.extra.setdefault("notes", [])
    notes[:] = [text for text in notes if text not in faces.values()]
    notes += [text for text in yielding.values() if text not in notes]


def find_yielding(patch_model, pieces: Pieces, min_peak: float = 0.0) -> dict:
    """Find the materials whose von Mises stress exceeds their yield strength in any frame.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Pieces
    min_peak : float
        Lower limit of the peak pressure [Pa]. A material of a face is left out if this pressure
        causes a larger stress there than the mesh shows.

    Returns
    -------
    dict
        Note by Strength.
    """
    highest = {}  # (stress [Pa], side, position [m]) by Strength and side
    for side in ("lower", "upper"):
        piece = getattr(pieces, side)
        model = getattr(patch_model.pieces, side)
        centres = np.concatenate([piece.points[block].mean(axis=1) for block in piece.blocks])
        free_height = (1 - HELD_REGION_FRACTION) * np.abs(piece.points[:, 1]).max()
        is_free = np.abs(centres[:, 1]) < free_height
        coating = model.coating.material if model.coating else None

        for is_coating, material in ((False, model.substrate), (True, coating)):
            strength = yield_strength(material)
            cells = np.flatnonzero((piece.is_coating == is_coating) & is_free)
            if strength is None or not cells.size:
                continue
            stress = piece.von_mises[:, cells].max(axis=0)
            limit = strength.pressure
            if is_coating or coating is None:  # the material is that of the face
                ratio = min_von_mises_ratio(material.poisson, patch_model.pieces.plane)
                limit = max(limit, ratio * min_peak)
            if stress.max() > limit:
                place = centres[cells[np.argmax(stress)]]
                highest.setdefault(strength, {})[side] = (float(stress.max()), side, place)
    return {
        strength: _describe_yielding(strength, list(sides.values()))
        for strength, sides in highest.items()
    }


def _describe_yielding(strength, places: list) -> str:
    """Return the note on a material that yields, with its largest stress and the position."""
    stress, side, (x, y) = max(places, key=lambda place: place[0])
    both = "; the other piece exceeds its yield strength too" * (len(places) > 1)
    return (
        f"the von Mises stress reaches {stress / 1e6:.4g} MPa in the {strength.material} of the "
        f"{side} piece, at x = {format_length(x)} and {format_length(abs(y))} from the interface; "
        f"{strength.words}{both}; {YIELDING_NEGLECTED}"
    )
