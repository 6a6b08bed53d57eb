"""The tables under [contact] as frozen pydantic models: materials, pieces, shapes of the gap, what presses them.

As in `tables`: one model per table, one attribute per key, floats in SI.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator

from .materials import MATERIALS
from .types import Force, Length, Place, Positive, Table, Text, choices, number, quantity, whole

Piece = Literal["upper", "lower"]


class Material(Table):
    """Elastic constants of a piece or a coating, written inline or looked up by name."""

    name: str | None = None
    young: quantity("pressure", gt=0)
    poisson: number(gt=-1, lt=0.5)
    density: quantity("density", gt=0)


def material(value: object) -> object:
    """A name of the material table as a Material; anything but a name passes; ValueError for an unknown name."""
    if isinstance(value, Material):
        return value
    if not isinstance(value, str):
        raise ValueError('a material name or {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"} is wanted')
    if value not in MATERIALS:
        raise ValueError(f"unknown material '{value}'; {choices(value, MATERIALS)}")
    known = MATERIALS[value]
    return Material.model_construct(name=value, young=known.young, poisson=known.poisson, density=known.density)


Substance = Annotated[Material, BeforeValidator(material)]


class Coating(Table):
    """A hard layer on a piece: what it is made of and how thick it is, part of the piece's height."""

    material: Substance
    thickness: Length


class OnePiece(Table):
    """What one of the two pieces has otherwise than the other; `coating = "none"` leaves it bare."""

    height: Length | None = None
    length: Length | None = None
    substrate: Substance | None = None
    coating: Coating | Literal["none"] | None = None
    chamfer: Length | None = None
    end_radius: Length | None = None


class Tilt(Table):
    """A prescribed angle between the pieces; `on` is the piece that carries the shape."""

    angle: quantity("angle")
    on: Piece = "upper"


class LoadLine(Table):
    """The line of the load beside the middle of a piece that is free to rotate, by offset or by moment."""

    offset: Place | None = None
    moment: quantity("moment") | None = None


class Approach(Table):
    """A prescribed closing of the holders in place of the load."""

    distance: quantity("length", ge=0)


class Holder(Table):
    """The springs between the far face and what holds it."""

    rotational_stiffness: quantity("rotational stiffness", gt=0) | None = None
    tangential_stiffness: quantity("stiffness", gt=0) | None = None


def convex(value: object) -> object:
    """A radius as it is; ValueError with what to write instead for one below 0, a hollow."""
    if str(value).lstrip().startswith("-"):
        raise ValueError("a crown is convex, its radius > 0; a hollow is told by its heights: leave [contact.crown] "
                         'out and name a file with the columns "x [mm],z [um]" of z = x^2/(2 radius) as '
                         "contact.profile.file")
    return value


class Crown(Table):
    """A rounding of this radius over the patch."""

    radius: Annotated[Length, BeforeValidator(convex)]
    on: Piece = "upper"


class Step(Table):
    """A step of this height at this place."""

    height: Place
    at: Place
    on: Piece = "upper"


class ProfileFile(Table):
    """Measured heights, added to the gap."""

    file: Text
    heights: Literal["gap", "surface"] = "gap"
    on: Piece = "upper"


class Asperities(Table):
    """A compliant rough layer; the law decides which of the other keys are used."""

    law: Literal["linear", "exponential", "hertz"]
    normal_stiffness: quantity("foundation stiffness", gt=0) | None = None
    decay_length: Length | None = None
    radius: Length | None = None
    density: quantity("areal density", gt=0) | None = None
    height_deviation: Length | None = None
    tangential_ratio: Positive | None = None


class Shear(Table):
    """Tangential compliance of the pieces; it has no keys."""


class Grooves(Table):
    """Matched grooves whose flanks the load climbs."""

    wavelength: Length
    amplitude: quantity("length", ge=0)
    phase: quantity("angle") = 0.0
    lifted_mass: quantity("mass", ge=0) = 0.0


def outermost(width: float, count: int) -> float:
    """Place [m] of the middle of the outermost of `count` equal strips over `width` [m]; a load line lies within it."""
    return width / 2 * (1 - 1 / count)


class Strips(Table):
    """The patch as equal strips side by side over the width."""

    count: whole(1, 10_000)
    roll: quantity("angle") = 0.0
    offset: Place | None = None


class Contact(Table):
    """The patch: two alike pieces pressed together; its sub-tables change the shape or add compliance."""

    length: Length
    width: Length
    height: Length
    load: Force | None = None
    pairs: whole(1, 1_000_000) = 1
    plane: Literal["strain", "stress"] = "strain"
    element_size: Length | None = None
    substrate: Substance
    mesh: Text | None = None
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
