"""Displacement and stress inside both pieces in all frames of a run, and where a material yields.

In: a `Result` with a solved patch. Out: `PieceFrames`, plain arrays on the meshes of both pieces and on
their interface.
"""

from hashlib import sha256
from typing import NamedTuple

import numpy as np

from ..core import max_abs
from ..elasticity import coating_traction, recovery
from ..elasticity.elasticity import compute_displacement, von_mises
from ..formatting import format_length
from .patch.condensed import CondensedPair, condense
from .patch.grids import is_too_expensive
from .patch.press import Patch
from .patch.strength import YIELDING_NEGLECTED, Strength, min_von_mises_ratio, yield_strength
from .results.patch_rows import Arrays
from .results.result import patch_surface


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


class PieceFrames(NamedTuple):
    """Both pieces and their interface in f frames.

    - time (f,): [s].
    - lower, upper: fields of the pieces.
    - x (k,): positions along the interface [m].
    - weight (k,): areas [m2]; weight times normal stress adds up to the load.
    - interface: fields by name, (f, k) or (f, k, 2).
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
    """A piece with the displacement and stress that its loads cause, with y towards its inside.

    - sign: -1 for the lower piece, whose y is then reversed, and 1 for the upper piece.
    - cells: its cells.
    - interface: node numbers of its face in order of x.
    - u (1 + d, n, 2): displacement [m] in the pressed state, and what each of d load cases adds to it.
    - stress (d, t, 4): stress at the centres of the cells in each load case [Pa].
    - error: estimated error of this stress.
    - case (f,): number of the load case of each frame.
    """

    sign: float
    cells: recovery.Cells
    interface: np.ndarray
    u: np.ndarray
    stress: np.ndarray
    error: recovery.StressError
    case: np.ndarray

    def add_up_frames(self, u: np.ndarray) -> np.ndarray:
        """Return (f, ...) in each frame from the pressed state and what each load case adds to it, u (1 + d, ...)."""
        return (u[:1] + u[1:])[self.case]


def select_pair_for_stress(patch: Patch) -> CondensedPair:
    """Return condensed pieces on whose mesh the stress inside the pieces is computed.

    They are those of the patch, unless the motion needed a finer mesh than the static measures may have. Such a mesh is
    coarsened: it is fine because of the contact edges, and all its nodes in all frames would need gigabytes.
    """
    meshes = patch.pair.meshes
    if not (patch.model.mesh.is_automatic and is_too_expensive(patch.model, meshes)):
        return patch.pair
    while is_too_expensive(patch.model, meshes):
        meshes = [mesh and mesh.coarsen() for mesh in meshes]
    return condense(patch.model, *meshes)


def compute_pieces(result, pair=None) -> PieceFrames:
    """Compute displacement and stress of both pieces in the frames of a run.

    Parameters
    ----------
    result : Result
        A run with a solved patch.
    pair : CondensedPair, optional
        Pieces on whose mesh they are computed; by default `select_pair_for_stress`.

    Returns
    -------
    PieceFrames
    """
    patch = result.patch
    fields = result.fields
    pair = pair or select_pair_for_stress(patch)
    # While the whole contact slips in one direction, the stress is the same in all frames; it is computed once.
    tractions = [fields[name] for name in ("shear_stress", "normal_stress") if name in fields]
    case = number_distinct_frames(*tractions)
    first = np.unique(case, return_index=True)[1]
    cases = {name: values[first] for name, values in fields.items()}
    low_forces, high_forces = _nodal_forces(patch, cases, pair)
    recover = _Recoverer(pair.piece)
    low = recover.load(-1.0, *low_forces, case)
    if pair.upper is not pair.piece:
        recover = _Recoverer(pair.upper)
    high = recover.load(1.0, *high_forces, case)
    held = _holder_motion(patch, fields, high.cells.points)
    lower = _make_piece(low, high.error, 0.0)
    upper = _make_piece(high, low.error, held)

    # The fields of the interface are those of the run, its motion is that of the lower piece, and
    # below a coating act other stresses than on its face.
    surface = patch_surface(patch, fields)
    names = [name for name in fields if name != "time" and not name.startswith("holder_")]
    interface = {name: fields[name] for name in names}
    interface |= _bond_stress(low, "lower", surface.x) | _bond_stress(high, "upper", surface.x)
    interface["displacement"] = _interpolate_displacement(lower, low.interface, surface.x)
    slide = _holder_field(fields, "slide", 0.0)
    interface["holder_slide"] = np.repeat(slide, surface.x.size, axis=1)
    width = result.plan.model.patch.pieces.width
    return PieceFrames(fields["time"], lower, upper, surface.x, surface.weight, interface, width)


def number_distinct_frames(*fields: np.ndarray) -> np.ndarray:
    """Return a number (f,) for each frame of fields (f, ...), the same for frames in which all fields are equal.

    The numbers are counted from 0 in the order of the frames.
    """
    numbers = {}
    number_by_frame = []
    for frame in zip(*fields):
        digest = b"".join(sha256(values.tobytes()).digest() for values in frame)
        number_by_frame.append(numbers.setdefault(digest, len(numbers)))
    return np.array(number_by_frame)


def _nodal_forces(patch, fields: Arrays, pair) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return shear and normal forces (1 + f, n) [N/m] on the nodes of the lower and upper piece of a CondensedPair.

    The first row is the pressed state, the others add to it in each frame. A frame of a worn patch
    has its own pressure.
    """
    length = patch.pieces.interface.weight / patch.pieces.interface.width
    pressed = patch.pressure.sigma_n
    none = np.zeros((len(fields["time"]), length.size))
    shear = np.concatenate([none[:1], fields.get("shear_stress", none)])
    change = fields["normal_stress"] - pressed if "holder_closing" in fields else none
    normal = np.concatenate([pressed[None], change])
    shear = shear * length
    normal = normal * length
    if pair is not patch.pair:
        nodes = pair.compliance.interface.x
        shear = _lump_forces(shear, patch.x, nodes)
        normal = _lump_forces(normal, patch.x, nodes)
    low_shear, high_shear = pair.forces(shear)
    low_normal, high_normal = pair.forces(normal)
    return [(low_shear, low_normal), (-high_shear, high_normal)]


def _lump_forces(forces, x, nodes) -> np.ndarray:
    """Distribute forces (f, m) at positions x (m,) [m] to the neighbouring ones of nodes (n,) [m] by the lever rule.

    Both are in ascending order and have the same ends. The sum of the forces and their moment stay.
    """
    after = np.clip(np.searchsorted(nodes, x), 1, nodes.size - 1)
    fraction = (x - nodes[after - 1]) / (nodes[after] - nodes[after - 1])
    out = np.zeros((nodes.size, len(forces)))
    np.add.at(out, after, (forces * fraction).T)
    np.add.at(out, after - 1, (forces * (1 - fraction)).T)
    return out.T


class _Recoverer:
    """Recovery of the stress in a condensed piece, which serves both pieces if they are equal.

    Parameters
    ----------
    piece : Piece
        With y towards its inside.
    """

    def __init__(self, piece):
        self.piece = piece
        self.cells = recovery.get_cells(piece)
        self.fit = recovery.fit_recovery(self.cells)
        self.gauss_points = recovery.make_points(self.cells, "gauss")

    def load(self, sign: float, shear, normal, case) -> _LoadedPiece:
        """Return the piece with its displacement and stress under nodal forces [N/m].

        Parameters
        ----------
        sign : float
            -1 for the lower and 1 for the upper piece.
        shear, normal : (1 + d, n) array
            Forces on the nodes of its face [N/m]; the first row is the pressed state.
        case : (f,) array
            Number of the load case of each frame, from 0 to d - 1.
        """
        u = compute_displacement(self.piece, shear, normal)
        motion = u[:1] + u[1:]
        stress = recovery.compute_centre_stress(self.cells, motion)
        error = recovery.estimate_error(self.fit, motion, stress, self.gauss_points)
        nodes = self.piece.mesh.pressure_nodes
        return _LoadedPiece(sign, self.cells, nodes, u, stress, error, case)


def _make_piece(piece: _LoadedPiece, other_error, held) -> PieceFields:
    """Return the fields of a piece in the coordinates of the patch, with the motion of its holder.

    `held` (f, n, 2) [m] is the displacement of the points by their holder in each frame. `other_error` is the stress error
    of the other piece, because the relative error refers to the energy of both pieces.
    """
    flip = np.array([1.0, piece.sign])
    return PieceFields(
        points=piece.cells.points * flip,
        blocks=tuple(block[:, :: int(piece.sign)] for block in piece.cells.blocks),
        is_coating=piece.cells.is_coating,
        displacement=piece.add_up_frames(piece.u) * flip + held,
        stress=(piece.stress * [1.0, 1.0, 1.0, piece.sign])[piece.case],
        von_mises=von_mises(piece.stress)[piece.case],
        stress_error=piece.error.relative_error(other_error)[0][piece.case],
    )


def _bond_stress(piece: _LoadedPiece, side: str, x) -> dict[str, np.ndarray]:
    """Return the stresses (f, k) [Pa] between coating and substrate at x (k,) [m], {} without a coating.

    Compression is positive. The shear stress is that on the lower one of both along +x. `side`, "lower" or "upper", is
    at the end of the names of the stresses.
    """
    traction = coating_traction.compute_coating_traction(piece.cells, piece.u)
    bonds = coating_traction.interpolate_coating_traction(piece.cells, traction, x)
    signs = {"normal_bond": 1.0, "shear_bond": -piece.sign}
    return {f"{name}_{side}": signs[name] * piece.add_up_frames(u) for name, u in bonds.items()}


def _holder_motion(patch, fields: Arrays, points) -> np.ndarray:
    """Return the motion (f, n, 2) [m] of points (n, 2) [m] that move with the upper holder.

    `fields` are the fields of all frames by name. Where they lack the rotation or the approach, those of the pressed
    patch hold.
    """
    rotation = _holder_field(fields, "rotation", patch.pressure.rotation)
    closing = _holder_field(fields, "closing", patch.pressure.approach)
    slide = _holder_field(fields, "slide", 0.0)
    x, y = points.T
    return np.stack([slide - rotation * y, rotation * x - closing], axis=2)


def _holder_field(fields: Arrays, name: str, constant: float) -> np.ndarray:
    """Return a motion of the upper holder (f, 1), or the constant that it has in all frames.

    `fields` are those of all frames by name, and `name` is "rotation" [rad], "closing" or "slide" [m].
    """
    return fields.get(f"holder_{name}", np.full(len(fields["time"]), constant))[:, None]


def _interpolate_displacement(piece: PieceFields, interface, x) -> np.ndarray:
    """Return the displacement (f, k, 2) [m] of the face of a piece at positions x (k,) [m].

    `interface` has the node numbers of the face in order of x.
    """
    node_x = piece.points[interface, 0]
    face = piece.displacement[:, interface]
    by_axis = [[np.interp(x, node_x, row) for row in face[..., axis]] for axis in (0, 1)]
    return np.stack(by_axis, axis=2)


def add_yielding_notes(result, pieces: PieceFrames) -> None:
    """Add notes on materials that yield inside the pieces to the notes of a result.

    They replace notes on the same material at its face, which know only the pressure.
    """
    peak = result.measures.get("pressure_peak")
    has_peak = peak is not None and peak.value is not None
    min_peak = peak.value - (peak.error or 0.0) if has_peak else 0.0
    faces = result.yielding_faces
    yielding = faces | find_yielding(result.plan.model.patch, pieces, min_peak)
    notes = result.notes
    notes[:] = [text for text in notes if text not in faces.values()]
    notes += [text for text in yielding.values() if text not in notes]


def find_yielding(patch_model, pieces: PieceFrames, min_peak: float = 0.0) -> dict[Strength, str]:
    """Find the materials whose von Mises stress exceeds their yield strength in any frame.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with the strengths of its materials.
    pieces : PieceFrames
        Stresses of both pieces in all frames.
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
        # Height over that of the piece of the region at the held far face in which no yielding is
        # looked for: the stress in its corners is unbounded under a rigid holder.
        free_height = (1 - 0.2) * max_abs(piece.points[:, 1])
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
    places = {strength: list(sides.values()) for strength, sides in highest.items()}
    return {strength: _describe_yielding(strength, places[strength]) for strength in places}


def _describe_yielding(
    strength: Strength, places: list[tuple[float, str, tuple[float, float]]]
) -> str:
    """Return the note on a material that yields, from (stress [Pa], side, x and y [m]) of each piece."""
    stress, side, (x, y) = max(places, key=lambda place: place[0])
    both = "; the other piece exceeds its yield strength too" * (len(places) > 1)
    return (
        f"the von Mises stress reaches {stress / 1e6:.4g} MPa in the {strength.material} of the "
        f"{side} piece, at x = {format_length(x)} and {format_length(abs(y))} from the interface; "
        f"{strength.words}{both}; {YIELDING_NEGLECTED}"
    )
