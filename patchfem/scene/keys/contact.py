"""The tables under [contact] as frozen pydantic models: materials, pieces, shapes of the gap, what presses them.

As in `tables`: one model per table, one attribute per key, floats in SI.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from .materials import MATERIALS
from .types import Force, Length, Place, Positive, Table, Text, choices, key, number, quantity, whole

Piece = Literal["upper", "lower"]


class Material(Table):
    """Elastic constants of a piece or a coating, written inline or looked up by name."""

    name: key(str | None, "name of the material in the material table") = None
    young: key(quantity("pressure", gt=0), "Young's modulus")
    poisson: key(number(gt=-1, lt=0.5), "Poisson's ratio")
    density: key(quantity("density", gt=0), "mass per volume")


def material(value: object) -> object:
    """A name of the material table as a Material; anything but a name passes; ValueError for an unknown name."""
    if isinstance(value, Material):
        return value
    if not isinstance(value, str):
        raise ValueError('a material name or {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"} is needed')
    if value not in MATERIALS:
        raise ValueError(f"unknown material '{value}'; {choices(value, MATERIALS)}")
    known = MATERIALS[value]
    return Material.model_construct(name=value, young=known.young, poisson=known.poisson, density=known.density)


Substance = Annotated[Material, BeforeValidator(material)]


class Coating(Table):
    """A hard layer on a piece; its thickness is part of the height of the piece."""

    material: key(Substance, "material of the coating, given in the same way as substrate")
    thickness: key(Length, "thickness of the coating, included in the height of its piece")


class OnePiece(Table):
    """Properties of one piece that differ from those in [contact]; `coating = "none"` removes the coating."""

    height: key(Length | None, "height of this piece; default contact.height") = None
    length: key(Length | None, "length of this piece, centred at x = 0; default contact.length; the interface has the "
                               "length of the shorter piece") = None
    substrate: key(Substance | None, "material of this piece; default contact.substrate") = None
    coating: key(Coating | Literal["none"] | None, 'coating of this piece, {material = ..., thickness = ...}, or '
                                                   '"none"; default contact.coating') = None
    chamfer: key(Length | None, "size of the 45 degree chamfer at both ends; the interface stops where the chamfer "
                 "starts") = None
    end_radius: key(Length | None, "radius of the rounded ends; the interface stops where the slope of "
                    "the rounding exceeds 0.097") = None


class Tilt(Table):
    """A prescribed angle between the pieces; `on` is the piece that carries the shape."""

    angle: key(quantity("angle"), "angle between the pieces; > 0 opens the gap at +x")
    on: key(Piece, "the piece that carries the shape; the pressure moves with this piece as it slides") = "upper"


class LoadLine(Table):
    """An off-centre load, given by its offset or its moment; the upper piece is free to rotate."""

    offset: key(Place | None, "distance of the load line from the middle of the patch; > 0 moves the pressure to "
                "+x", "unless moment") = None
    moment: key(quantity("moment") | None, "moment about the middle of the patch, in place of the offset") = None


class Approach(Table):
    """A prescribed approach of the holders in place of the load."""

    distance: key(quantity("length", ge=0), "approach of the holders from first touch, in place of a load")


class Holder(Table):
    """Springs between the far face of a piece and its holder."""

    rotational_stiffness: key(quantity("rotational stiffness", gt=0) | None, "rotational stiffness between the far "
                              "face and its holder", "unless tangential_stiffness") = None
    tangential_stiffness: key(quantity("stiffness", gt=0) | None, "stiffness along x between the far face and its "
                                                                  "holder; default rigid") = None


def convex(value: object) -> object:
    """A radius as it is; ValueError with what to write instead for one below 0, a hollow."""
    if str(value).lstrip().startswith("-"):
        raise ValueError("a crown is convex, so its radius must be > 0; for a hollow leave out [contact.crown] and "
                         'give a file with the columns "x [mm],z [um]" of z = x^2/(2 radius) as '
                         "contact.profile.file")
    return value


class Crown(Table):
    """A cylindrical crown of the patch."""

    radius: key(Annotated[Length, BeforeValidator(convex)], "radius of the crown: the gap grows as x^2/(2 radius)")
    on: key(Piece, "the piece that carries the shape") = "upper"


class Step(Table):
    """A step of the gap at one position along x."""

    height: key(Place, "height of the step, by which the gap is wider where x > `at`")
    at: key(Place, "position x of the step; 0 is the middle of the patch")
    on: key(Piece, "the piece that carries the shape") = "upper"


class ProfileFile(Table):
    """Measured heights that are added to the gap."""

    file: key(Text, "file of one height trace along x: text with units in its header, or an instrument's file")
    heights: key(Literal["gap", "surface"], "'gap': larger heights open the gap; 'surface': a stylus trace, whose "
                 "peaks are material of the piece that carries the shape") = "gap"
    on: key(Piece, "the piece that carries the shape") = "upper"


class Asperities(Table):
    """A compliant rough layer; the law decides which of the other keys are used."""

    law: key(Literal["linear", "exponential", "hertz"], "law of the rough layer: pressure linear or exponential in its "
             "compression, or from spherical peaks of Gaussian heights")
    normal_stiffness: key(quantity("foundation stiffness", gt=0) | None, "pressure per compression of the layer; for "
                          "law 'exponential' its value at first touch") = None
    decay_length: key(Length | None, "compression over which the pressure of law 'exponential' grows by a "
                      "factor e") = None
    radius: key(Length | None, "tip radius of the peaks", "law `hertz`, unless from or rms_height") = None
    density: key(quantity("areal density", gt=0) | None, "number of peaks per area", "as radius") = None
    height_deviation: key(Length | None, "standard deviation of the peak heights", "as radius") = None
    from_: key(Text | None, "file of a height trace from which the peaks are taken: one rough piece on a smooth one",
               "law `hertz`, unless radius or rms_height") = Field(None, alias="from")
    rms_height: key(Length | None, "root mean square height of the rough trace; for two rough pieces the root of "
                    "the sum of both squares, as for slope and curvature",
                    "law `hertz`, unless radius or from") = None
    rms_slope: key(Positive | None, "root mean square slope of that trace", "as rms_height") = None
    rms_curvature: key(quantity("curvature", gt=0) | None, "root mean square curvature of that trace",
                       "as rms_height") = None
    cutoff: key(Length | None, "wavelength that divides a trace (Gaussian filter of ISO 16610-21): longer waves belong "
                               "to [contact.profile], shorter ones to the asperities; default: length/100 with a "
                               "profile, all waves of `from` without one") = None
    tangential_ratio: key(Positive | None, "tangential over normal stiffness of the rough layer; default: rigid along "
                                           "x") = None


class Shear(Table):
    """Tangential compliance of the pieces, which allows partial slip; it has no keys."""


class Grooves(Table):
    """Matched grooves in both surfaces; the upper piece rides up their flanks against the load."""

    wavelength: key(Length, "wavelength of the grooves along x")
    amplitude: key(quantity("length", ge=0), "half the height of the grooves from valley to peak; with 0 the friction "
                   "law acts alone")
    phase: key(quantity("angle"), "phase 2 pi x/wavelength of a groove's bottom, where x counts from the start of the "
                                  "run") = 0.0
    lifted_mass: key(quantity("mass", ge=0), "mass that rises as the upper piece rides up the grooves; it adds inertia "
                                             "only, because the weight is part of the load") = 0.0


def outermost(width: float, count: int) -> float:
    """Place [m] of the middle of the outermost of `count` equal strips over `width` [m]; a load line lies within it."""
    return width / 2 * (1 - 1 / count)


class Strips(Table):
    """The patch divided into equal strips side by side over the width."""

    count: key(whole(1, 10_000), "number of equal strips side by side over the width")
    roll: key(quantity("angle"), "rotation of the holder about x, which shifts the pressure sideways") = 0.0
    offset: key(Place | None, "lateral position of the load "
                              "line; if given, the upper piece is free to rotate about x") = None


class Contact(Table):
    """Two equal pieces pressed together; sub-tables change one piece or the gap, or add compliance."""

    length: key(Length, "length of both pieces along the sliding direction x")
    width: key(Length, "width of the patch perpendicular to the plane of the model")
    height: key(Length, "height of each piece from the interface to its held far face, coating included")
    load: key(Force | None, "total normal force on the interface, weight included; or give "
              "[contact.approach]", "unless [contact.approach]") = None
    pairs: key(whole(1, 1_000_000), "number of equal patches that share the load; forces and stiffnesses are reported "
               "for all of them together") = 1
    plane: key(Literal["strain", "stress"], "plane strain or plane stress in the pieces") = "strain"
    element_size: key(Length | None, "element length of a uniform mesh along the interface; unless given, the mesh is "
                      "graded to meet the tolerance") = None
    substrate: key(Substance, "material of the pieces: a name of the material table, or a table of young, "
                   "poisson, density")
    mesh: key(Text | None, "a mesh file of both pieces, tagged as GUIDE.md says; unless given, the mesh "
              "is made from the dimensions") = None
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
    strips: Strips | None = None
    grooves: Grooves | None = None

    @property
    def shapes(self) -> dict:
        """Name -> table of every shape given: the tables that lie `on` a piece."""
        parts = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: part for name, part in parts.items() if hasattr(part, "on")}

    @property
    def gives_way(self) -> str:
        """What lets the patch slip part by part under one slide of the holders, as written; empty where nothing."""
        if self.shear is not None:
            return "[contact.shear]"
        soft = self.asperities is not None and self.asperities.tangential_ratio is not None
        if soft:
            return "contact.asperities.tangential_ratio"
        held = self.holder is not None and self.holder.tangential_stiffness is not None
        return "contact.holder.tangential_stiffness" if held else ""
