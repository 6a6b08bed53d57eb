"""The table [contact] and its inner tables: materials, pieces, gap, load and compliance.

As in `tables`, each model is a table and each attribute is a key.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field

from .materials import MATERIALS, advise_on_material, find_material_name
from .quantities import UNIT_FACTORS
from .types import (
    FileName,
    Force,
    Length,
    Position,
    Positive,
    Table,
    array,
    key,
    list_inner_tables,
    number,
    optional,
    quantity,
    whole_number,
)
from .values import TomlValue

Piece = Literal["upper", "lower"]
LengthUnit = Literal[tuple(UNIT_FACTORS["length"])]
# Smallest and largest number of cells along the longer side of an area; the grids of the error estimate have a half and a
# quarter of them, and more cells than 1024 take minutes.
MIN_AREA_CELLS = 32
MAX_AREA_CELLS = 1024
# Largest angle [rad] between the pieces; the gap is angle * x, which differs from tan(angle) * x by 0.3 % there.
MAX_ANGLE_BETWEEN_PIECES = 0.1
SmallAngle = quantity("angle", ge=-MAX_ANGLE_BETWEEN_PIECES, le=MAX_ANGLE_BETWEEN_PIECES)
# What a key for a material needs, for messages
MATERIAL_REQUIREMENT = (
    'a material name or {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"} is needed'
)


class Material(Table):
    """Elastic constants and density of a piece or a coating, given as values or by the name of a material."""

    has_name: ClassVar[bool] = True

    name: optional(str, "name of a material that is listed in MATERIALS.md")
    young: key(quantity("pressure", gt=0), "Young's modulus")
    poisson: key(number(gt=-1, lt=0.5), "Poisson's ratio")
    density: key(quantity("density", gt=0), "mass per volume")
    yield_: key(
        quantity("pressure", gt=0) | None,
        "yield strength in tension; a note appears where the von Mises stress exceeds it; default: that of the named "
        "material in MATERIALS.md, if it has one",
    ) = Field(None, alias="yield")


def find_material(value: TomlValue | Material) -> Material:
    """Return the Material of a name.

    ValueError is raised for an unknown name and for other values.
    """
    if isinstance(value, Material):
        return value
    if isinstance(value, int | float) and find_material_name(str(value)) is not None:
        value = str(value)  # the name of a steel or alloy may be a number, such as 718 or 1.4404
    if not isinstance(value, str):
        raise ValueError(MATERIAL_REQUIREMENT)
    name = find_material_name(value)
    if name is None:
        raise ValueError(f"unknown material '{value}'; {advise_on_material(value)}")
    known = MATERIALS[name]
    return Material.model_construct(
        name=name, young=known.young, poisson=known.poisson, density=known.density
    )


Substance = Annotated[Material, BeforeValidator(find_material)]


class Coating(Table):
    """A hard layer on a piece; the thickness of this layer is part of the height of the piece."""

    material: key(
        Substance, "material of the coating, given in the same way as `contact.substrate`"
    )
    thickness: key(Length, "thickness of the coating, which is included in the height of the piece")


class OnePiece(Table):
    """Properties of one piece that differ from the properties in [contact]; `coating = "none"` removes the coating."""

    height: optional(Length, "height of this piece; default: `contact.height`")
    length: optional(
        Length,
        "length of this piece, centred at x = 0; default: `contact.length`; the interface has "
        "the length of the shorter piece",
    )
    substrate: optional(Substance, "material of this piece; default: `contact.substrate`")
    coating: optional(
        Coating | Literal["none"],
        'coating of this piece, {material = ..., thickness = ...}, or "none"; default: `contact.coating`',
    )
    chamfer: optional(
        Length,
        "length along x of the 45 degree chamfer at both ends; the interface stops where the chamfer starts",
    )
    end_radius: optional(
        Length,
        "radius of the rounded ends; the interface stops where the slope of the rounded end exceeds 0.097",
    )


class Tilt(Table):
    """Prescribed angles between the pieces; `on` names the piece that is tilted."""

    angle: key(
        SmallAngle,
        "angle between the pieces; an angle > 0 opens the gap at +x; the gap is this angle times x, so it must be small",
    )
    roll: optional(
        SmallAngle,
        "angle between the pieces about x, beside [contact.area]; an angle > 0 opens the gap at +y; default: 0",
    )
    on: key(
        Piece,
        "piece that is tilted; during the slide the pressure distribution moves with this piece",
    ) = "upper"


class LoadLine(Table):
    """An off-centre load, given by its offset or its moment; the upper piece is free to rotate."""

    offset: optional(
        Position,
        "distance of the load line from the middle of the patch; an offset > 0 moves the pressure towards +x",
    )
    across: optional(
        Position,
        "distance of the load line from the middle along y, beside [contact.area]; the upper piece is then free to "
        "rotate about x",
    )
    moment: optional(
        quantity("moment"),
        "moment of the load about the middle of the patch, in place of `offset`",
    )


class Approach(Table):
    """A prescribed approach of the holders in place of the load."""

    distance: key(
        quantity("length", ge=0),
        "distance by which the holders approach each other at x = 0 in place of a "
        "load, measured from the first touch of the flat pieces without tilt and crown",
    )


class Holder(Table):
    """Springs between the far face of a piece and its holder."""

    rotational_stiffness: optional(
        quantity("rotational stiffness", gt=0),
        "rotational stiffness of the spring between the far face of the piece and its holder",
    )
    tangential_stiffness: optional(
        quantity("stiffness", gt=0),
        "stiffness along x of the spring between the far face of the piece and its holder; default: rigid",
    )


def require_convex_radius(value: TomlValue) -> TomlValue:
    """Require that the radius of a crown is not that of a hollow, and return it.

    ValueError is raised for a negative radius.
    """
    if str(value).lstrip().startswith("-"):
        raise ValueError(
            "a crown is convex, so its radius must be > 0; for a hollow surface leave out [contact.crown] and give "
            'contact.profile.file, a file with the columns "x [mm],z [um]", where z = x^2/(2 radius)'
        )
    return value


class Crown(Table):
    """A cylindrical crown on one piece, or one with two radii."""

    radius: key(
        Annotated[Length, BeforeValidator(require_convex_radius)],
        "radius of the crown: the gap grows as x^2/(2 radius)",
    )
    across: optional(
        Annotated[Length, BeforeValidator(require_convex_radius)],
        "radius of the crown across its width, beside [contact.area]: the gap also grows as y^2/(2 across); a sphere "
        "has two equal radii; default: flat across",
    )
    on: key(
        Piece,
        "piece that has the crown; during the slide the pressure distribution moves with this piece",
    ) = "upper"


class Step(Table):
    """A step of the gap at one position along x."""

    height: key(Position, "height of the step: where x > `at`, the gap is wider by this height")
    at: key(Position, "position x of the step; 0 is the middle of the patch")
    on: key(
        Piece,
        "piece that has the step; during the slide the pressure distribution moves with this piece",
    ) = "upper"


class ProfileFile(Table):
    """Measured heights that are added to the gap."""

    file: optional(
        FileName,
        "file of one height trace along x: text with units in its header, or a file of a measuring instrument",
    )
    scan: optional(
        FileName,
        "file of an areal scan, beside [contact.area] and in place of `file`; spikes are removed and the scan is levelled",
    )
    at: optional(
        array(Position, 2, 2),
        "place of the patch on the scan: x and y of its middle, as the file counts them; default: the middle of the scan",
    )
    heights: key(
        Literal["gap", "surface"],
        "'gap': a larger height opens the gap; 'surface': the file is a stylus "
        "trace or a scan, so a larger height is more material on the piece that `on` names",
    ) = "gap"
    on: key(
        Piece,
        "piece that has the profile; during the slide the pressure distribution moves with this piece",
    ) = "upper"


class Asperities(Table):
    """A compliant rough layer between the pieces; `law` decides which of the other keys are used."""

    law: key(
        Literal["linear", "exponential", "hertz"],
        "how the pressure of the rough layer follows from its compression: 'linear'; 'exponential'; or 'hertz', from "
        "spherical peaks whose heights have a Gaussian distribution",
    )
    normal_stiffness: optional(
        quantity("foundation stiffness", gt=0),
        "pressure of the layer divided by its compression; for law 'exponential', the slope of pressure over "
        "compression at first touch",
    )
    decay_length: optional(
        Length,
        "compression over which the pressure of law 'exponential' grows by the factor e = 2.718",
    )
    radius: optional(
        Length,
        "tip radius of the peaks",
    )
    density: optional(quantity("areal density", gt=0), "number of peaks per area")
    height_deviation: optional(Length, "standard deviation of the peak heights")
    from_: key(
        FileName | None,
        "file of a height trace of a rough piece, from which the peaks are computed; the other "
        "piece is taken as smooth",
    ) = Field(None, alias="from")
    rms_height: optional(
        Length,
        "root mean square height of the rough piece; if both pieces are rough, the root of the sum of the squares of "
        "their two values; the same rule holds for `rms_slope` and `rms_curvature`",
    )
    rms_slope: optional(Positive, "root mean square slope of the rough piece")
    rms_curvature: optional(
        quantity("curvature", gt=0),
        "root mean square curvature of the rough piece",
    )
    cutoff: optional(
        Length,
        "wavelength that divides a trace (Gaussian filter of ISO 16610-21): longer waves belong to [contact.profile], "
        "shorter waves to the asperities; default: with [contact.profile], 1/100 of the length of the interface; "
        "without it, all waves of the trace in `from` belong to the asperities",
    )
    hardness: optional(
        quantity("pressure", gt=0),
        "largest pressure of the tops of the rough layer; with [wear] the layer then wears: its heights are cut at the "
        "level of the worn tops; default: the layer does not wear",
    )
    heights: optional(
        FileName,
        "file of a trace or an areal scan with the heights of the layer that wears, of waves shorter than `cutoff` if it is "
        "given; default: the short waves of the trace in [contact.profile]",
    )
    tangential_ratio: optional(
        Positive,
        "tangential stiffness of the rough layer divided by its normal stiffness; default: the layer is rigid along x",
    )


class Shear(Table):
    """Tangential compliance of the pieces, which allows partial slip; this table has no keys."""


class Grooves(Table):
    """Matched grooves in both surfaces; the upper piece rides up their flanks against the load."""

    wavelength: key(Length, "wavelength of the grooves along x")
    amplitude: key(
        quantity("length", ge=0),
        "half the height of the grooves from valley to peak; with amplitude 0 the surfaces are flat",
    )
    phase: key(
        quantity("angle"),
        "phase of the grooves: a groove has its bottom where 2 pi x/wavelength equals this "
        "phase; x is the slide since the start of the run",
    ) = 0.0
    lifted_mass: key(
        quantity("mass", ge=0),
        "mass that rises as the upper piece rides up the grooves; this mass adds "
        "only inertia, because its weight is part of the load",
    ) = 0.0


class Area(Table):
    """Pressure, slip and wear vary over the face, not only along x; no keys are required."""

    cells: optional(
        whole_number(MIN_AREA_CELLS, MAX_AREA_CELLS),
        "number of cells along the longer side of the face; default: doubled until the tolerance is met",
    )
    hardness: optional(
        quantity("pressure", gt=0),
        "largest pressure that a cell carries (perfectly plastic); the measure yielded_fraction is the share of cells "
        "that reach it",
    )


class Contact(Table):
    """Two pieces pressed together. The keys of this table hold for both pieces; its sub-tables change one piece or the
    gap, or add compliance."""

    length: key(Length, "length of both pieces along the sliding direction x")
    width: key(Length, "width of the patch perpendicular to the plane of the model")
    height: key(
        Length,
        "height of each piece from the interface to the far face, which is fixed to the holder; includes the coating",
    )
    load: optional(
        Force,
        "total normal force on the interface, weight included; [contact.approach] may be given in place of this key",
    )
    pairs: key(
        # Far more than any joint has
        whole_number(1, 1_000_000),
        "number of equal patches that share the load; forces and stiffnesses are reported "
        "for all these patches together",
    ) = 1
    plane: key(Literal["strain", "stress"], "plane strain or plane stress in the pieces") = "strain"
    element_size: optional(
        Length,
        "length of the elements along the interface in a uniform mesh; with half this length the elements are "
        "half as long in depth as well; default: a graded mesh that meets the tolerance",
    )
    substrate: key(
        Substance,
        "material of the pieces: a name from MATERIALS.md, or a table of young, poisson, density and, if known, yield",
    )
    mesh: optional(
        FileName,
        "file with a mesh of both pieces, which needs the tags listed in MESH.md; default: a mesh "
        "is made from the dimensions",
    )
    mesh_unit: optional(LengthUnit, "unit of the coordinates in the file of `mesh`; default: m")
    coating: Coating | None = None
    upper: OnePiece | None = None
    lower: OnePiece | None = None
    tilt: Tilt | None = None
    load_line: LoadLine | None = None
    approach: Approach | None = None
    holder: Holder | None = None
    crown: Crown | None = None
    step: Step | None = None
    profile: ProfileFile | None = None
    asperities: Asperities | None = None
    shear: Shear | None = None
    area: Area | None = None
    grooves: Grooves | None = None

    @property
    def shapes(self) -> dict[str, Table]:
        """Tables of the gap shapes that the scene contains, by name; the key `on` of a table names the piece."""
        tables = {name: getattr(self, name) for name in _list_shape_names()}
        return {name: table for name, table in tables.items() if table is not None}

    @property
    def compliance_key(self) -> str:
        """Key of the compliance that enables partial slip, or "" if the patch slips as a whole."""
        if self.shear is not None:
            return "[contact.shear]"
        if self.asperities is not None and self.asperities.tangential_ratio is not None:
            return "contact.asperities.tangential_ratio"
        if self.holder is not None and self.holder.tangential_stiffness is not None:
            return "contact.holder.tangential_stiffness"
        return ""


@cache
def _list_shape_names() -> tuple[str, ...]:
    """Return the names of the tables in [contact] that have a key `on`."""
    tables = list_inner_tables(Contact).items()
    return tuple(name for name, model in tables if "on" in model.model_fields)
