"""The tables of a scene as frozen pydantic models: one model per table, one attribute per key, floats in SI.

What a key means stands in `meanings`; here stand its kind, its limits and its default. Whether keys fit together
is the business of `scene.rules.check`, reading a file that of `scene`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from ...effects import LAWS, WAVEFORMS
from .accuracy import Accuracy
from .contact import Contact, Grooves
from .quantities import format_si, parse
from .types import (
    Acceleration,
    Force,
    Frequency,
    Kelvin,
    Length,
    Mass,
    NotNegative,
    Number,
    PerMetre,
    Positive,
    Seconds,
    Share,
    Speed,
    Table,
    Text,
    Title,
    number,
    quantity,
    whole,
)

LawName, WaveName = Literal[tuple(LAWS)], Literal[tuple(WAVEFORMS)]


class Normal(Table):
    """A normal load on a single point, with an optional oscillation."""

    load: Force
    amplitude: Force | None = None
    frequency: Frequency | None = None
    phase: quantity("angle") | None = None
    width: Length | None = None
    grooves: Grooves | None = None


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
    order: number(le=100) = 1.0
    rest_growth: Acceleration | None = None
    slip_growth: Length | None = None
    rest_speed: Speed | None = None
    initial_bonds: Share = 1.0
    breakaway: number(ge=0, le=1) = 0.0
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
    accelerometer: Number | None = None
    gauge: Number | None = None


class Stiffening(Table):
    """A cubic restoring force on the block."""

    cubic: quantity("cubic stiffness")


class Bonded(Table):
    """A second load path beside the contact."""

    stiffness: quantity("stiffness", ge=0)
    damping: quantity("damping", ge=0) = 0.0
    wavelength: Length | None = None


MOST_MASSES = 1_000_000
Between = tuple[whole(0, MOST_MASSES), whole(0, MOST_MASSES)]


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
    output_mass: whole(1, MOST_MASSES) | None = None
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
    waveform: WaveName = "sine"
    frequency: Frequency | None = None
    from_: Frequency | None = Field(None, alias="from")
    to: Frequency | None = None
    rate: quantity("sweep rate", gt=0) | None = None
    log_rate: quantity("logarithmic sweep rate", gt=0) | None = None
    acceleration: quantity("acceleration", ge=0) | None = None
    displacement: quantity("length", ge=0) | None = None
    levels: Annotated[tuple[quantity("acceleration", ge=0), ...], Field(min_length=1)] | None = None
    onset: Literal["slip", "distortion", "gauge"] = "distortion"
    onset_length: Length | None = None
    force: Force | None = None
    mass: whole(1, MOST_MASSES) | None = None
    cycles: Positive | None = None
    duration: Seconds | None = None
    file: Text | None = None

    @field_validator("levels", mode="before")
    @classmethod
    def _forces(cls, value: Any, info: Any) -> Any:
        """Levels of a force drive, each a force in SI behind the unit of an acceleration."""
        if info.data.get("kind") != "force" or not isinstance(value, list | tuple):
            return value
        return [format_si(parse(one, "force"), "acceleration") for one in value]


class Wear(Table):
    """Material removed over many cycles."""

    coefficient: quantity("wear coefficient", ge=0)
    upper_share: Share = 0.5
    cycles: Positive
    jumps: Literal["auto"] | whole(1, 1_000_000) = "auto"
    form: Literal["archard", "energy"] = "archard"
    scheme: Literal["implicit", "explicit"] = "implicit"


class Measured(Table):
    """A table of measurements to stand beside the results."""

    file: Text
    acceleration_gain: Positive = 1.0
    reading: Literal["peak", "fundamental", "rms", "lowpass"] = "peak"
    reading_cutoff: Frequency | None = None


class Tables(Table):
    """The whole scene as tables, in the order in which effects are named."""

    title: Title = ""
    contact: Contact | None = None
    normal: Normal | None = None
    friction: Friction | None = None
    slide: Slide | None = None
    structure: Structure | None = None
    drive: Drive | None = None
    wear: Wear | None = None
    accuracy: Accuracy = Accuracy.model_construct()
    measured: Measured | None = None
