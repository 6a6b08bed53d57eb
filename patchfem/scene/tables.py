"""The tables of a scene as frozen pydantic models: one model per table, one attribute per key, floats in SI.

Here stand kind, limits and default of each key; its meaning in `scene.meanings`, what goes together in `scene.rules`.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from ..effects import LAWS
from .materials import MATERIALS
from .types import Table, choices, number, quantity, whole

Text = Annotated[str, Field(min_length=1)]
Number, Share, Positive, NotNegative = number(), number(ge=0, le=1), number(gt=0), number(ge=0)
Place, Length, Force = quantity("length"), quantity("length", gt=0), quantity("force", ge=0)
Mass, Seconds, Frequency = quantity("mass", gt=0), quantity("time", gt=0), quantity("frequency", gt=0)
Speed, Acceleration = quantity("velocity", gt=0), quantity("acceleration", gt=0)
Kelvin, PerMetre = quantity("temperature", gt=0), quantity("participation")
Piece = Literal["upper", "lower"]
LawName = Literal[tuple(LAWS)]


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
    substrate: Substance | None = None
    coating: Coating | Literal["none"] | None = None


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


class Crown(Table):
    """A rounding of this radius over the patch."""

    radius: Length
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


class Strips(Table):
    """The patch as equal strips side by side over the width."""

    count: whole(1)
    roll: quantity("angle") = 0.0


class Contact(Table):
    """The patch: two alike pieces pressed together; its sub-tables change the shape or add compliance."""

    length: Length
    width: Length
    height: Length
    load: Force | None = None
    pairs: whole(1) = 1
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


class Normal(Table):
    """A normal load on a single point, with an optional oscillation."""

    load: Force
    amplitude: Force | None = None
    frequency: Frequency | None = None
    phase: quantity("angle") | None = None
    width: Length | None = None


class Temperature(Table):
    """Surface temperature and the activation of bond growth."""

    surface: Kelvin
    reference: Kelvin
    rest_activation: quantity("temperature", ge=0) | None = None
    slip_activation: quantity("temperature", ge=0) | None = None


class Friction(Table):
    """The friction law; which keys it needs depends on `law`."""

    law: LawName
    static: NotNegative
    kinetic: NotNegative | None = None
    reference_speed: Speed | None = None
    bond_length: Length | None = None
    stiffness: quantity("stiffness", gt=0) | None = None
    chi: number(gt=-1, le=0) | None = None
    beta: NotNegative | None = None
    exponent: Positive = 1.0
    shape: number(gt=0, le=1) = 0.5
    stribeck_speed: Speed | None = None
    micro_damping: quantity("damping", ge=0) = 0.0
    viscous: quantity("damping", ge=0) = 0.0
    reading: Literal["stretch", "report"] = "stretch"
    order: Number = 1.0
    rest_growth: Acceleration | None = None
    slip_growth: Length | None = None
    rest_speed: Speed | None = None
    initial_bonds: Share = 1.0
    breakaway: number(ge=0, lt=1) = 0.0
    spread: Length | None = None
    temperature: Temperature | None = None


class Slide(Table):
    """A prescribed motion; which keys it needs depends on `kind`."""

    kind: Literal["constant", "sine", "triangle", "dwell", "file"]
    amplitude: Length | None = None
    frequency: Frequency | None = None
    speed: Speed | None = None
    distance: quantity("length", ge=0) | None = None
    hold: quantity("time", ge=0) | None = None
    distance_after: quantity("length", ge=0) | None = None
    cycles: Positive | None = None
    file: Text | None = None


class Mode(Table):
    """One mode of the rig: how it vibrates, how it moves the patch, the base's share and the accelerometer's."""

    name: Text
    frequency: quantity("frequency", ge=0)
    damping: NotNegative
    slide: Number
    normal: Number = 0.0
    pitch: PerMetre = 0.0
    lateral: Number = 0.0
    yaw: PerMetre = 0.0
    base: Number | None = None
    output: Number | None = None


class Stiffening(Table):
    """A cubic restoring force on the block."""

    cubic: quantity("cubic stiffness")


class Bonded(Table):
    """A second load path beside the contact."""

    stiffness: quantity("stiffness", ge=0)
    damping: quantity("damping", ge=0) = 0.0
    wavelength: Length | None = None


Between = tuple[whole(0), whole(0)]


class Spring(Table):
    """A spring between two masses, 0 being the base."""

    between: Between
    stiffness: quantity("stiffness", ge=0)


class Damper(Table):
    """A damper between two masses, 0 being the base."""

    between: Between
    coefficient: quantity("damping", ge=0)


class Interface(Friction):
    """A friction interface between two masses, with its own law and load."""

    between: Between
    load: Force


class Start(Table):
    """Displacements and velocities at t = 0, one per mode or mass."""

    displacement: Annotated[tuple[quantity("length"), ...], Field(min_length=1)] | None = None
    velocity: Annotated[tuple[quantity("velocity"), ...], Field(min_length=1)] | None = None


class Structure(Table):
    """The rig: modes, or masses with springs, or a file; `..._at` name places in a file of measured modes."""

    moving_mass: Mass | None = None
    travel: Length | None = None
    mode: tuple[Mode, ...] = ()
    stiffening: Stiffening | None = None
    bonded: Bonded | None = None
    masses: tuple[Mass, ...] | None = None
    output_mass: whole(1) | None = None
    spring: tuple[Spring, ...] = ()
    damper: tuple[Damper, ...] = ()
    interface: tuple[Interface, ...] = ()
    file: Text | None = None
    slide_at: Text | None = None
    output_at: Text | None = None
    base_at: Text | None = None
    force_at: Text | None = None
    normal_at: Text | None = None
    pitch_at: Text | None = None
    start: Start | None = None


class Drive(Table):
    """What sets the rig in motion; which keys it needs depends on `kind` and `waveform`."""

    kind: Literal["base", "force", "free"]
    waveform: Literal["sine", "step", "sweep", "levels", "file"] = "sine"
    frequency: Frequency | None = None
    from_: Frequency | None = Field(None, alias="from")
    to: Frequency | None = None
    rate: quantity("sweep rate", gt=0) | None = None
    log_rate: quantity("logarithmic sweep rate", gt=0) | None = None
    acceleration: quantity("acceleration", ge=0) | None = None
    displacement: quantity("length", ge=0) | None = None
    levels: Annotated[tuple[quantity("acceleration", ge=0), ...], Field(min_length=1)] | None = None
    force: Force | None = None
    mass: whole(1) | None = None
    cycles: Positive | None = None
    duration: Seconds | None = None
    file: Text | None = None


class Wear(Table):
    """Material removed over many cycles."""

    coefficient: quantity("wear coefficient", ge=0)
    upper_share: Share = 0.5
    cycles: Positive
    jumps: Literal["auto"] | whole(1) = "auto"


def _still_summed(value: object) -> object:
    """An engine of the sum over bonds; ValueError for the one that 0.4 had besides."""
    if value == "exponential":
        raise ValueError("'exponential' is gone: it served order 0, 1 and 2 of reading 'report' alone and was at most "
                         "1.4 times faster than the list over a whole run; use 'merged'")  # fmt: skip
    return value


Summing = Annotated[Literal["auto", "direct", "truncated", "merged", "recursion"], BeforeValidator(_still_summed)]


class Accuracy(Table):
    """The tolerance from which every numerical choice follows, and the knobs that pin one."""

    tolerance: Positive = 1e-3
    method: Literal["auto", "exact", "march", "duhamel", "newmark", "euler", "harmonic"] = "auto"
    steps_per_cycle: whole(4) | None = None
    quadrature: Summing = "auto"
    tail: NotNegative | None = None
    merge: NotNegative | None = None
    harmonics: whole(1) | None = None
    shear_modes: whole(1) | None = None
    convergence: Literal["force", "velocity", "displacement"] | None = None
    convergence_tolerance: Positive | None = None
    stick_speed: Speed | None = None


class Measured(Table):
    """A table of measurements to stand beside the results."""

    file: Text
    acceleration_gain: Positive = 1.0


class Tables(Table):
    """The whole scene as tables, in the order in which effects are named."""

    title: str = ""
    contact: Contact | None = None
    normal: Normal | None = None
    friction: Friction | None = None
    slide: Slide | None = None
    structure: Structure | None = None
    drive: Drive | None = None
    wear: Wear | None = None
    accuracy: Accuracy = Accuracy.model_construct()
    measured: Measured | None = None
