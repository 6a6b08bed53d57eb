"""The patch of a scene: pieces, gap, load, interface and mesh, before anything is solved."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import array_dataclass
from ..mesh.ends import SHARP_END, End
from ..scene.keys.contact import Asperities, Coating, Contact, Material, OnePiece
from ..scene.keys.quantities import UNIT_FACTORS
from . import peaks, profile
from .gap import N_DEFAULT_CELLS, Gap, ProfileLengths, find_shape_side, list_gap_shapes

FindPath = Callable[[str], Path]  # function of a file name in the scene that returns its path
# Largest number of cells along the longer side of a face that is only pressed, of one whose slip is followed by parallel
# elements, of one whose cells are contact points of a law with memory or wear in many jumps, and of one whose cells have
# lists of bonds; each takes about 10 CPU s.
MAX_STATIC_CELLS = 512
MAX_SLIP_CELLS = 256
MAX_POINT_CELLS = 64
MAX_LIST_CELLS = 32
EQUAL_LENGTHS_TOL = 1e-9  # largest relative difference of equal lengths


@dataclass(frozen=True, slots=True)
class PatchPiece:
    """One of the two pieces of a patch.

    - height: height [m], with the coating.
    - coating: material and thickness of the coating, None if the piece is bare.
    - length: length [m] along x.
    - end: shape of both ends.
    - substrate: elastic material below the coating.
    """

    height: float
    substrate: Material
    coating: Coating | None
    length: float
    end: End

    @property
    def thickness(self) -> float:
        """Thickness of the coating [m], or 0 if the piece is bare."""
        return self.coating.thickness if self.coating else 0.0

    @property
    def face_material(self) -> Material:
        """Material at the interface: that of the coating, or the substrate of a bare piece."""
        return self.coating.material if self.coating else self.substrate

    @property
    def half_contact_length(self) -> float:
        """Half the length [m] of the face that can touch."""
        return self.end.half_contact_length(self.length)

    def corner_kind(self, half_length: float) -> str:
        """Return the kind of corner at the distance `half_length` [m] from the middle.

        It is that of the end of the piece, or "flat" if the face extends further.
        """
        if self.half_contact_length > half_length * (1 + EQUAL_LENGTHS_TOL):
            return "flat"
        return self.end.kind


@dataclass(frozen=True, slots=True)
class PatchPieces:
    """The two pieces of a patch and the interface between them.

    - length: length [m] of the interface, over which both faces can touch.
    - width: width [m] out of plane.
    - height: height [m] of a piece for which the scene gives no other.
    - substrate: substrate of a piece for which the scene gives no other.
    - pairs: number of equal patches that share the load.
    - plane: ``"strain"`` or ``"stress"``.
    - lower, upper: the pieces.
    """

    lower: PatchPiece
    upper: PatchPiece
    length: float
    width: float
    height: float
    substrate: Material
    pairs: int
    plane: str

    @property
    def both(self) -> tuple[PatchPiece, PatchPiece]:
        """The lower and the upper piece."""
        return self.lower, self.upper

    @property
    def are_alike(self) -> bool:
        """Whether the pieces have the same height, materials, length and ends."""
        return self.lower == self.upper

    @property
    def has_overhang(self) -> bool:
        """Whether a piece is longer than the interface."""
        limit = self.length * (1 + EQUAL_LENGTHS_TOL)
        return self.lower.length > limit or self.upper.length > limit

    @property
    def flat_half_length(self) -> float:
        """Half the length [m] of the part of the interface on which both faces are flat."""
        return min(piece.length / 2 - piece.end.size for piece in self.both)

    @property
    def surface_modulus(self) -> float:
        """Combined modulus E* [Pa] of the two surfaces, 1/E* = sum of (1 - nu^2)/E."""
        faces = [piece.face_material for piece in self.both]
        return 1 / sum((1 - face.poisson**2) / face.young for face in faces)

    @property
    def shear_stiffness(self) -> float:
        """Shear stiffness [N/m] of all equal pairs in parallel, in which the two pieces act as springs in series.

        Short blocks that are fixed at both faces are stiffer.
        """
        return 1 / self.series_compliance(
            lambda material: 2 * (1 + material.poisson) / material.young
        )

    def series_compliance(self, softness: Callable[[Material], float]) -> float:
        """Compliance [m/N] of all equal pairs in parallel, in which the layers of both pieces act in series.

        Parameters
        ----------
        softness : callable
            Function of a material that returns strain per stress [1/Pa].
        """
        total = 0.0
        for piece in self.both:
            total += (piece.height - piece.thickness) * softness(piece.substrate)
            if piece.coating:
                total += piece.thickness * softness(piece.coating.material)
        return total / (self.pairs * self.length * self.width)


@dataclass(frozen=True, slots=True)
class PatchLoading:
    """Normal load or approach of the upper piece, and the holder of this piece.

    - load: normal load [N]; None if the approach is prescribed.
    - approach: prescribed approach [m].
    - offset: distance [m] of the load line from the middle of the patch.
    - line_moment: moment [N m] of the load line about the middle of the patch.
    - can_rotate: whether the upper piece is free to rotate.
    - rotational_stiffness: stiffness [N m/rad] of the holder.
    - tangential_stiffness: stiffness [N/m] of the holder, None if it is rigid.
    - across: distance [m] of the load line from the middle along y; None if the upper piece cannot rotate about x.
    """

    load: float | None
    approach: float | None
    offset: float | None
    line_moment: float | None
    can_rotate: bool
    rotational_stiffness: float
    tangential_stiffness: float | None
    across: float | None = None

    @property
    def moment(self) -> float | None:
        """Moment of the load about the middle [N m], or None if the piece cannot rotate."""
        if not self.can_rotate:
            return 0.0 if np.any(np.greater(self.rotational_stiffness, 0.0)) else None
        return self.line_moment if self.line_moment is not None else self.load * self.offset


class PatchArea(NamedTuple):
    """Face on which pressure and slip vary along x and y.

    - cells: number of cells along the longer side; None: as many as the tolerance needs.
    - hardness: largest pressure [Pa]; None without a limit.
    - scan: measured heights over the face, or None.
    - max_cells: largest number of cells along the longer side that is chosen without `cells`.
    """

    cells: int | None
    hardness: float | None
    scan: "ScanFile | None"
    max_cells: int = MAX_SLIP_CELLS


class ScanFile(NamedTuple):
    """Areal scan of a face.

    - path: file.
    - at: place (x, y) [m] of the middle of the patch in the file; None for the middle of the scan.
    - is_material: whether a peak closes the gap.
    - file: name of the file in the scene.
    """

    path: Path
    at: tuple[float, float] | None
    is_material: bool
    file: str


@array_dataclass
class PatchInterface:
    """Interface of a patch: asperity layer and shear compliance.

    - has_shear: whether the pieces deform in shear.
    - partial_slip: key of the scene that allows partial slip, "" without partial slip.
    - skin: pressure law of the asperities on the faces, or None if the faces are smooth.
    """

    skin: Asperities | None
    has_shear: bool
    partial_slip: str


class PrescribedSlip(NamedTuple):
    """Prescribed slide of the holders that causes partial slip of a patch.

    - amplitude: half the range of the slide [m].
    - static: coefficient of friction.
    - bond_length: bond length [m]; 0 if the law has no springs.
    """

    amplitude: float
    static: float
    bond_length: float


class MeshFile(NamedTuple):
    """Mesh file of the two pieces.

    - path: path of the file.
    - unit: length unit [m] of its coordinates.
    """

    path: Path
    unit: float


@dataclass(frozen=True, slots=True)
class PatchMesh:
    """Settings of the mesh of a patch.

    - element_size: size [m] of the elements of an even interface.
    - file: mesh file of the two pieces.
    - is_fine: whether the patch is static or in a bench without wear, so that most of the time goes into the mesh.
    - edge_motion: cause of a motion of the edges of the contact: ``"load"``, ``"wear"`` or ``""``.
    - slip: slide whose partial slip the mesh has to resolve.
    - n_finer: halvings of the elements beyond those that the static measures need.
    """

    element_size: float | None
    file: MeshFile | None
    is_fine: bool = False
    edge_motion: str = ""
    slip: PrescribedSlip | None = None
    n_finer: int = 0

    @property
    def is_automatic(self) -> bool:
        """Whether the mesh is refined to the tolerance."""
        return self.element_size is None and self.file is None


@array_dataclass
class PatchModel:
    """Two pieces that are pressed together.

    - pieces: shape and material of both pieces.
    - gap: gap between them before they are loaded.
    - loading: what presses them together.
    - interface: asperity layer and shear compliance.
    - mesh: how they are meshed.
    - area: cells of a face on which the pressure also varies along y; None for a plane patch.
    """

    pieces: PatchPieces
    gap: Gap
    loading: PatchLoading
    interface: PatchInterface
    mesh: PatchMesh
    area: PatchArea | None = None

    @property
    def has_singular_ends(self) -> bool:
        """Whether the pressure at the ends of the interface has no bound.

        It has none where a sharp corner or a chamfer of one piece meets the flat face of the other.
        Two sharp ends are bounded: by symmetry each piece is half of a straight bar. The ends of a
        mesh file are not examined.
        """
        half_length = self.pieces.length / 2
        corners = {piece.corner_kind(half_length) for piece in self.pieces.both}
        return self.mesh.file is None and "radius" not in corners and corners != {"sharp"}

    @property
    def uniform_element_size(self) -> float:
        """Element size [m] of a uniform mesh of the interface.

        The automatic size resolves the waves that a cut-off leaves to the mesh.
        """
        if self.mesh.element_size:
            return self.mesh.element_size
        automatic = self.pieces.length / N_DEFAULT_CELLS
        if self.gap.is_rough and self.gap.average:
            return min(automatic, self.gap.average)
        return automatic

    @property
    def nominal_load(self) -> float:
        """Total load [N] of all equal pairs; an upper estimate, of flat bars in series, if the approach is prescribed."""
        loading = self.loading
        if loading.load is not None:
            return loading.load
        compliance = self.pieces.series_compliance(
            lambda material: (1 - material.poisson**2) / material.young
        )
        return loading.approach / compliance

    def with_element_size(self, size: float | None) -> "PatchModel":
        """Return a copy of the patch with an element size [m]; None: the mesh is refined to the tolerance."""
        gap = self.gap
        if not gap.is_rough and self.mesh.file is None:
            lengths = _average_over_cells(size, self.pieces)
            gap = replace(gap, average=lengths.average, limit=lengths.limit)
        return replace(self, mesh=replace(self.mesh, element_size=size), gap=gap)

    def with_loading(self, **changes) -> "PatchModel":
        """Return a copy of the patch with changed values of its loading.

        The keywords are fields of its `loading`, such as `load` [N].
        """
        return replace(self, loading=replace(self.loading, **changes))

    def with_mesh(self, **changes) -> "PatchModel":
        """Return a copy of the patch with changed settings of its mesh."""
        return replace(self, mesh=replace(self.mesh, **changes))


def build_patch(contact: Contact, resolve_path: FindPath) -> PatchModel:
    """Build the patch that a table [contact] describes.

    Parameters
    ----------
    contact : Contact
        Table [contact], or that of an interface.
    resolve_path : callable
        Function of a file name in the scene that returns its path.

    Returns
    -------
    PatchModel
    """
    pieces = build_pieces(contact)
    trace = contact.profile if contact.area is None else None
    lengths = find_profile_lengths(contact, pieces)
    gap = Gap(
        shapes=list_gap_shapes(contact),
        profile=resolve_path(trace.file) if trace is not None else None,
        average=lengths.average,
        limit=lengths.limit,
        is_rough=contact.asperities is not None,
        side=find_shape_side(contact),
        material=trace is not None and trace.heights == "surface",
        file=trace.file if trace is not None else "",
    )

    # Radius, density and heights of Hertzian asperities may follow from a trace or from its root mean squares.
    skin = contact.asperities
    if skin is not None and skin.law == "hertz":
        cutoff = find_shortest_wavelength(contact, pieces.length)
        skin = peaks.complete_asperities(skin, resolve_path, cutoff)
    if skin is not None and skin.heights is not None:
        skin = skin.model_copy(update={"heights": str(resolve_path(skin.heights))})

    return PatchModel(
        pieces=pieces,
        gap=gap,
        loading=_build_loading(contact),
        interface=PatchInterface(skin, contact.shear is not None, contact.compliance_key),
        mesh=PatchMesh(
            element_size=contact.element_size,
            file=find_mesh_file(contact, resolve_path),
        ),
        area=_build_area(contact, resolve_path),
    )


def _build_area(contact: Contact, resolve_path: FindPath) -> PatchArea | None:
    """Return the cells of a face that a table [contact] describes; None for a plane patch.

    `resolve_path` turns a file name in the scene into a path.
    """
    if contact.area is None:
        return None
    profile = contact.profile
    scan = None
    if profile is not None:
        is_material = profile.heights == "surface"
        scan = ScanFile(resolve_path(profile.scan), profile.at, is_material, profile.scan)
    return PatchArea(contact.area.cells, contact.area.hardness, scan)


def find_mesh_file(contact: Contact, resolve_path: FindPath) -> MeshFile | None:
    """Return the mesh file of a table [contact]; None if the mesh is made from the dimensions.

    `resolve_path` turns a file name in the scene into a path.
    """
    if contact.mesh is None:
        return None
    return MeshFile(resolve_path(contact.mesh), UNIT_FACTORS["length"][contact.mesh_unit or "m"])


def replace_loading_and_shapes(patch: PatchModel, contact: Contact) -> PatchModel:
    """Return a copy of a patch with the loading and the gap shapes of another table [contact]."""
    gap = replace(patch.gap, shapes=list_gap_shapes(contact))
    return replace(patch, gap=gap, loading=_build_loading(contact))


def build_pieces(contact: Contact) -> PatchPieces:
    """Build the two pieces that a table [contact] describes.

    Keys in the table of a piece take precedence over those in [contact]. The interface is as long
    as the shorter face.

    Parameters
    ----------
    contact : Contact
        Table [contact].

    Returns
    -------
    PatchPieces
        Pieces, and length, width and height [m] of the patch.
    """
    pieces = []
    for piece_keys in (contact.lower or OnePiece(), contact.upper or OnePiece()):
        end = SHARP_END
        if piece_keys.chamfer:
            end = End("chamfer", piece_keys.chamfer)
        elif piece_keys.end_radius:
            end = End("radius", piece_keys.end_radius)

        # Keys of the piece come before those of [contact].
        piece = PatchPiece(
            height=piece_keys.height or contact.height,
            substrate=piece_keys.substrate or contact.substrate,
            coating=None if piece_keys.coating == "none" else piece_keys.coating or contact.coating,
            length=piece_keys.length or contact.length,
            end=end,
        )
        pieces.append(piece)

    lower, upper = pieces
    return PatchPieces(
        lower=lower,
        upper=upper,
        length=2 * min(lower.half_contact_length, upper.half_contact_length),
        width=contact.width,
        height=contact.height,
        substrate=contact.substrate,
        pairs=contact.pairs,
        plane=contact.plane,
    )


def _build_loading(contact: Contact) -> PatchLoading:
    """Build the loading that a table [contact] describes."""
    line = contact.load_line
    holder = contact.holder
    stiffness = None if holder is None else holder.rotational_stiffness
    return PatchLoading(
        load=contact.load,
        approach=contact.approach.distance if contact.approach is not None else None,
        offset=line.offset if line is not None else None,
        line_moment=line.moment if line is not None else None,
        can_rotate=line is not None and (line.offset is not None or line.moment is not None),
        rotational_stiffness=0.0 if stiffness is None else stiffness,
        tangential_stiffness=None if holder is None else holder.tangential_stiffness,
        across=line.across if line is not None else None,
    )


def find_profile_lengths(contact: Contact, pieces: PatchPieces) -> ProfileLengths:
    """Return the lengths over which the profile of a table [contact] is averaged.

    The `pieces` give the length of the interface. A profile with asperities is averaged over a fraction of the
    cut-off, one on the nodes of a mesh file not at all, and any other over the cells.
    """
    if contact.asperities is not None:
        cutoff = find_shortest_wavelength(contact, pieces.length)
        average = cutoff and cutoff / profile.MIN_ELEMENTS_PER_WAVE
        return ProfileLengths(average, None)
    if contact.mesh is not None:
        return ProfileLengths(None, 0.0)
    return _average_over_cells(contact.element_size, pieces)


def _average_over_cells(size: float | None, pieces: PatchPieces) -> ProfileLengths:
    """Return the lengths over which a profile is averaged on a mesh with an element size [m], or on an automatic one.

    An automatic mesh resolves the whole file. Where the finest waves cannot be solved apart (pieces that reach beyond the
    interface), its cells are those of an even mesh at most.
    """
    if size:
        return ProfileLengths(size, size)
    if not pieces.has_overhang:
        return ProfileLengths(None, None)
    return ProfileLengths(None, pieces.length / N_DEFAULT_CELLS)


def find_shortest_wavelength(contact: Contact, length: float) -> float | None:
    """Return the shortest wavelength [m] of the profile that is included in the gap.

    Shorter waves belong to [contact.asperities]; None if all waves do. `length` [m] is that of the
    interface.
    """
    cutoff = contact.asperities.cutoff
    if cutoff is not None or contact.profile is None:
        return cutoff
    return profile.MIN_ELEMENTS_PER_WAVE * length / N_DEFAULT_CELLS
