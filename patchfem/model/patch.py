"""The patch that a scene asks for: its two pieces, what presses them, what lets them slip in part. Nothing is
solved."""

from dataclasses import dataclass, replace
from math import asinh, sinh, sqrt
from pathlib import Path
from typing import NamedTuple

from ..mesh.ends import SHARP, End
from ..scene.keys.contact import Asperities, Coating, Contact, Material
from . import peaks, profile
from .gap import Gap, gap_asked

CHOSEN_POINTS = 160  # about what a patch takes at the default tolerance
AUTOMATIC_CELLS = 200  # along the interface, of an even mesh; a profile beside asperities keeps waves of two of them
CLOSE = 1e-9  # lengths below this share of another one are nothing


@dataclass(frozen=True, slots=True)
class OnePiece:
    """One of the two pieces of a patch.

    height [m], its coating included; coating: None where the piece is bare; length [m] along x; end: shape of both
    ends.
    """

    height: float
    substrate: Material
    coating: Coating | None
    length: float
    end: End

    @property
    def thickness(self) -> float:
        """Thickness of the coating [m], 0 where the piece is bare."""
        return self.coating.thickness if self.coating else 0.0

    @property
    def bearing(self) -> float:
        """Half the length [m] of the face that can touch."""
        return self.end.bearing(self.length)

    def corner(self, half: float) -> str:
        """What the face does at the distance `half` [m] from its middle: "flat" where it goes on, else the kind of its
        end."""
        return "flat" if self.bearing > half * (1 + CLOSE) else self.end.kind


class Meshes(NamedTuple):
    """The meshes of patches that share them, the one of the answer first and then those of its error.

    levels: (lower, upper or None where it is alike) each; name: hash of what they hold.
    """

    levels: tuple
    name: str


class PrescribedSlip(NamedTuple):
    """A slide of the holders that lets a patch slip part by part at a friction limit per node.

    amplitude [m]: half the range of the slide; static [1]: coefficient of friction; bond_length
    [m]: of the springs of the law in series with the pieces, 0 without them.
    """

    amplitude: float
    static: float
    bond_length: float


@dataclass(frozen=True, eq=False, slots=True)
class PatchModel:
    """Two pieces and what presses them.

    length [m] of the interface, which is where both faces can touch; width, height [m], the last of a piece that names
    none; pairs: equal patches that share the load; plane: "strain" or "stress"; substrate: of the pieces that name
    none. element_size [m] pins an even interface; None lets the tolerance choose; still: nothing of the patch moves, so
    that all the time there is may be spent on it; sweeps: what moves the edges of the contact on the way, "load",
    "wear" or ""; mesh: file of the two pieces. load [N] or approach [m], the other None. offset [m] and line_moment
    [N m] of a load line; rotates: the upper piece is free to turn; spring [N m/rad] and slide_spring [N/m, None: rigid]
    of the holder. skin: asperities; strips: (count, roll [rad], lateral place [m] of the load line or None where the
    roll is held); shear: the pieces are compliant tangentially; gives_way: the effect that lets the patch slip part by
    part, as the scene writes it; mesh_tolerance: relative error that a chosen mesh is to meet, None: the tolerance of
    the run. meshes: those that serve all cases of a sweep, None: the patch has its own. gathers: fields of its motion
    are not asked for, so that few points may stand for it. solved: how it was pressed together with others, a
    `runs.patch.static.SolvedPatch`, None: its run presses it; never kept where another value changes.
    slip: the slide whose partial slip the mesh has to show, None where there is none.
    """

    length: float
    width: float
    height: float
    pairs: int
    plane: str
    substrate: Material
    lower: OnePiece
    upper: OnePiece
    gap: Gap
    element_size: float | None
    still: bool
    sweeps: str
    mesh: Path | None
    load: float | None
    approach: float | None
    offset: float | None
    line_moment: float | None
    rotates: bool
    spring: float
    slide_spring: float | None
    skin: Asperities | None
    strips: tuple | None
    shear: bool
    gives_way: str
    mesh_tolerance: float | None = None
    meshes: Meshes | None = None
    gathers: bool = False
    solved: object = None
    slip: PrescribedSlip | None = None

    @property
    def alike(self) -> bool:
        """Whether the pieces have the same height, material, coating, length and ends."""
        return self.lower == self.upper

    @property
    def chosen(self) -> bool:
        """Whether the tolerance chooses the mesh."""
        return self.element_size is None and self.mesh is None

    @property
    def outlined(self) -> bool:
        """Whether a piece reaches beyond the interface, by its length or by its ends."""
        return any(piece.length > self.length * (1 + CLOSE) for piece in (self.lower, self.upper))

    @property
    def singular_ends(self) -> bool:
        """Whether pressure at the ends of the interface has no bound.

        It has none where a corner of one piece meets a face that goes on, or a chamfer. Two sharp ends that meet are
        bounded: by symmetry either piece is half of a straight bar. Nothing is said of the ends in a mesh file.
        """
        corners = {piece.corner(self.length / 2) for piece in (self.lower, self.upper)}
        return self.mesh is None and "radius" not in corners and corners != {"sharp"}

    @property
    def size(self) -> float:
        """Element size [m] of an even interface: that of the scene, or the automatic one, which shows the waves that a
        cut-off leaves to the mesh."""
        least = self.gap.average if self.gap.rough and self.gap.average else self.length
        return self.element_size or min(self.length / AUTOMATIC_CELLS, least)

    @property
    def nominal_load(self) -> float:
        """Load [N] of all pairs; for a prescribed approach that of flat layers as bars in series, which a moment turns
        about the middle of the patch, an upper estimate."""
        if self.load is not None:
            return self.load
        flat = self.approach / bars(self, lambda m: (1 - m.poisson**2) / m.young)
        return (
            turned(flat, self.line_moment or 0.0, self.length)
            if self.rotates and not self.spring
            else flat
        )

    def sized(self, size: float | None) -> "PatchModel":
        """The patch with another element size [m]; None: the mesh that the tolerance chooses."""
        gap = (
            self.gap
            if self.gap.rough or self.mesh is not None
            else replace(self.gap, average=size, limit=size)
        )
        return replace(self, element_size=size, gap=gap)

    @property
    def moment(self) -> float | None:
        """Moment of the load about the middle of the patch, sum f x [N m]; None where the rotation is held."""
        if not self.rotates:
            return 0.0 if self.spring > 0 else None
        return self.line_moment if self.line_moment is not None else self.load * self.offset


def patch_asked(contact: Contact, kind: str, beside) -> PatchModel:
    """The patch of [contact]; kind: of the run; beside(name) -> path of a file that the scene names."""
    lower, upper = pieces = pieces_asked(contact)
    length = interface_of(pieces)
    line, holder, strips = contact.load_line, contact.holder, contact.strips
    return PatchModel(
        length,
        contact.width,
        contact.height,
        contact.pairs,
        contact.plane,
        contact.substrate,
        lower,
        upper,
        gap_asked(contact, profile_lengths(contact, pieces), beside),
        contact.element_size,
        kind == "patch",
        "",
        beside(contact.mesh) if contact.mesh is not None else None,
        contact.load,
        contact.approach.distance if contact.approach is not None else None,
        line.offset if line is not None else None,
        line.moment if line is not None else None,
        line is not None,
        (holder.rotational_stiffness or 0.0) if holder is not None else 0.0,
        (holder.tangential_stiffness or None) if holder is not None else None,
        contact.asperities
        if contact.asperities is None or contact.asperities.law != "hertz"
        else peaks.skin_asked(contact.asperities, beside, split_at(contact, length)),
        (strips.count, strips.roll, strips.offset) if strips is not None else None,
        contact.shear is not None,
        contact.gives_way,
    )


def pieces_asked(contact: Contact) -> tuple:
    """The lower and the upper OnePiece of [contact]."""
    return _piece(contact, contact.lower), _piece(contact, contact.upper)


def profile_lengths(contact: Contact, pieces) -> tuple:
    """(average, limit) [m] of a profile, as `Gap` has them.

    A mesh that the tolerance chooses shows all that the file holds; its cells are automatic ones at most, which is the
    limit where the finest waves cannot be solved apart (asperities, strips, pieces that reach beyond the interface).
    """
    length = interface_of(pieces)
    automatic = length / AUTOMATIC_CELLS
    if contact.asperities is not None:
        split = split_at(contact, length)
        return split and split / profile.ELEMENTS_PER_WAVE, None
    if contact.mesh is not None or contact.element_size:
        return (
            (None, 0.0)
            if contact.mesh is not None
            else (contact.element_size, contact.element_size)
        )
    apart = contact.strips is None and all(piece.length <= length * (1 + CLOSE) for piece in pieces)
    return None, None if apart else automatic


def split_at(contact: Contact, length: float) -> float | None:
    """Wavelength [m] between the waves of a profile and those of [contact.asperities] over an interface of this length
    [m]; None where all waves are of the asperities."""
    if contact.asperities.cutoff is not None or contact.profile is None:
        return contact.asperities.cutoff
    return profile.ELEMENTS_PER_WAVE * length / AUTOMATIC_CELLS


def interface_of(pieces) -> float:
    """Length [m] over which the faces of both pieces, centred at x = 0, can touch: that of the shorter one."""
    return 2 * min(piece.bearing for piece in pieces)


def _piece(contact: Contact, own) -> OnePiece:
    """One piece: its own table before the common keys."""
    height, substrate, coating = contact.height, contact.substrate, contact.coating
    length, end = contact.length, SHARP
    if own is not None:
        height, substrate = own.height or height, own.substrate or substrate
        coating = None if own.coating == "none" else own.coating or coating
        length = own.length or length
        if own.chamfer or own.end_radius:
            end = End("chamfer", own.chamfer) if own.chamfer else End("radius", own.end_radius)
    return OnePiece(height, substrate, coating, length, end)


def bars(patch: PatchModel, softness) -> float:
    """Compliance [m/N] of the layers of both pieces as bars in series, all pairs together.

    softness(material) [1/Pa]: the sum of thickness * softness over the layers is divided by the area of all pairs.
    """
    total = 0.0
    for piece in (patch.lower, patch.upper):
        total += (piece.height - piece.thickness) * softness(piece.substrate)
        total += piece.thickness * softness(piece.coating.material) if piece.coating else 0.0
    return total / (patch.pairs * patch.length * patch.width)


def turned(load: float, moment: float, length: float) -> float:
    """Load [N] of bars side by side along a length [m], pressed by `load` [N] at no rotation, when a moment [N m]
    turns them about their middle, which stays at its depth.

    All of them bear up to load * length/6. Beyond, those over u L do: the pressure is a triangle, N = M/(L/2 - u L/3),
    and with v = u - 1/2 and m = M/(load L) depth and moment give 2 v^3 + (12 m - 3/2) v = 1/2, whose one root is real.
    """
    m = abs(moment) / (load * length)
    if m <= 1 / 6:
        return load
    p = 6 * m - 0.75
    v = 2 * sqrt(p / 3) * sinh(asinh(0.375 / p * sqrt(3 / p)) / 3)
    return load * m / (1 / 3 - v / 3)


def block_shear(patch: PatchModel) -> float:
    """Shear stiffness [N/m] of the two pieces as blocks in series, layer by layer, all pairs together.

    Short blocks held at both faces are stiffer than that.
    """
    return 1 / bars(patch, lambda m: 2 * (1 + m.poisson) / m.young)
