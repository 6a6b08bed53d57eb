"""The tables of a scene as frozen pydantic models: attributes are keys, values are in SI.

An attribute says all about its key: type, unit, limits, meaning, when it is required, default. The reader, the schema
and the reference of keys are made from it. `scene.rules` says which keys need or exclude one another.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from ...effects import LAWS, MAX_RIG_COORDINATES, WAVEFORMS
from .accuracy import Accuracy
from .contact import Contact, Grooves
from .quantities import format_si, parse_quantity, spread_range
from .types import (
    MAX_MAGNITUDE,
    AbsoluteTemperature,
    Acceleration,
    Duration,
    FileName,
    Force,
    Fraction,
    Frequency,
    Length,
    Mass,
    NonNegative,
    Number,
    PerMetre,
    Positive,
    Speed,
    Table,
    Text,
    Title,
    array,
    key,
    number,
    optional,
    quantity,
    require_magnitude,
    whole_number,
)
from .values import TomlValue

LawName = Literal[tuple(LAWS)]
WaveName = Literal[tuple(WAVEFORMS)]
MAX_MASS_NUMBER = 1_000_000  # largest number of a mass in a key
# File name extensions of universal files, by which every reader knows them
UNIVERSAL_EXTENSIONS = (".uff", ".unv", ".uf", ".58")


class Normal(Table):
    """A normal load on a single contact point, constant or oscillating."""

    load: key(Force, "normal force on the point; for an oscillating load, the mean of this force")
    amplitude: optional(
        Force,
        "amplitude of the oscillating load `load` + `amplitude` cos(2 pi `frequency` t + "
        "`phase`); while this expression is negative, the load is 0",
    )
    frequency: optional(Frequency, "frequency of the oscillating load")
    phase: optional(quantity("angle"), "phase of the oscillating load at t = 0")
    width: optional(
        Length,
        "width of the contact perpendicular to the path; needed for the key `friction.spread`",
        "with `friction.spread`",
    )
    grooves: Grooves | None = None


class Temperature(Table):
    """Surface temperature, and activation temperatures for the growth of bonds."""

    surface: key(AbsoluteTemperature, "absolute temperature of the surfaces")
    reference: key(
        AbsoluteTemperature,
        "absolute temperature for which `rest_growth` and `slip_growth` are given",
    )
    rest_activation: optional(
        quantity("temperature", ge=0),
        "activation temperature of the growth of bonds at rest; default: 0",
    )
    slip_activation: optional(
        quantity("temperature", ge=0),
        "activation temperature of the growth of bonds in slip; default: 0",
    )


class Friction(Table):
    """The friction law; `law` decides which of the other keys are needed."""

    law: key(LawName, "the friction law")
    static: key(NonNegative, "coefficient of static friction mu_s")
    kinetic: optional(
        NonNegative,
        "coefficient of kinetic friction mu_k, at most `static`; default: `static`",
    )
    reference_speed: optional(Speed, "sliding speed v_0 of law 'tanh', in F = mu N tanh(v/v_0)")
    bond_length: optional(
        Length,
        "bond length eps_0 at rest: the length of slide over which a bond forms and "
        "breaks; with law 'elastic-plastic' the key `stiffness` may be given in place of this key",
    )
    stiffness: optional(
        quantity("stiffness", gt=0),
        "initial slope of the friction force over the slide, for the whole contact; in a patch, this stiffness is "
        "distributed over the points in proportion to their normal force",
    )
    chi: optional(
        number(gt=-1, le=0),
        "exponent of the distribution of the sliders of law 'iwan': in micro-slip "
        "the energy dissipated per cycle grows with the force amplitude to the power chi + 3",
    )
    beta: optional(
        NonNegative,
        "stiffness of the slider of law 'iwan' that slips last, divided by the stiffness of "
        "all other sliders together",
    )
    exponent: key(
        Positive,
        "exponent n of law 'bouc-wen': the larger n is, the sharper is the transition from stick to slip",
    ) = 1.0
    shape: key(
        number(gt=0, le=1),
        "parameter s of law 'bouc-wen' for the shape of unloading: with s = 1/2 unloading "
        "follows the elastic line; with s >= 1/2 the law creates no energy",
    ) = 0.5
    stribeck_speed: optional(
        Speed,
        "sliding speed v_s over which the friction coefficient falls from `static` to `kinetic`",
    )
    micro_damping: key(
        quantity("damping", ge=0),
        "damping force on the bristles divided by the rate of their deflection, for the whole contact",
    ) = 0.0
    viscous: key(
        quantity("damping", ge=0),
        "viscous force divided by the sliding speed, for the whole contact",
    ) = 0.0
    reading: key(
        Literal["stretch", "report"],
        "how equation 2.17 is read: 'stretch' separates the stretch of a bond from its damage, so that no energy is "
        "created; 'report' uses equation 2.17 as printed in the report",
    ) = "stretch"
    order: key(
        number(le=100),
        "power p with which the strength of a bond rises along its path; must be > -1, and >= "
        "0 with reading 'stretch'",
    ) = 1.0
    rest_growth: optional(
        Acceleration,
        "growth a_s of the bond length at rest (equation 2.10), also while the contact is open; without `rest_growth` and "
        "`slip_growth` the bond length is constant",
    )
    slip_growth: optional(
        Length,
        "slip length l_k over which the bond length approaches its value in fast slip (equation 2.10)",
    )
    rest_speed: optional(
        Speed,
        "lower limit v_h of the sliding speed |v| in the term a_s/|v| (equation 2.10); "
        "default: 1e-3 of the largest sliding speed; in a rig, of the one that its drive or start gives without resonance",
    )
    initial_bonds: key(
        Fraction, "fraction m_0 of all bonds that already exist when the run begins"
    ) = 1.0
    spread: optional(
        Length,
        "width rho of a bond perpendicular to the path (equation 2.15); default: this width is ignored",
    )
    temperature: Temperature | None = None


class Slide(Table):
    """A prescribed relative displacement; `kind` determines which of the other keys are needed."""

    kind: key(
        Literal["constant", "sine", "triangle", "dwell", "file"],
        "prescribed motion: 'constant', motion at constant speed; 'sine'; 'triangle'; 'dwell', a slide interrupted by "
        "a rest; 'file', a table of positions",
    )
    amplitude: optional(
        Length,
        "half the peak-to-peak motion; the motion starts in the middle, in the positive direction",
    )
    frequency: optional(Frequency, "frequency of kind 'sine'")
    speed: optional(Speed, "sliding speed")
    distance: optional(
        quantity("length", ge=0),
        "for kind 'constant', the sliding distance; for kind 'dwell', the distance before the rest; for kind "
        "'triangle', the distance of a first slide before the cycles (default: 0)",
    )
    hold: optional(quantity("time", ge=0), "duration of the rest")
    distance_after: optional(
        quantity("length", ge=0), "sliding distance after the rest; default: 0"
    )
    cycles: optional(Positive, "number of cycles, not necessarily a whole number; default: 1")
    file: optional(
        FileName,
        "table with the columns time and displacement",
    )


class Mode(Table):
    """One mode of the rig: its frequency and damping, the motion of the patch and of the output in this mode, and how
    strongly the base drives the mode."""

    name: key(Text, "unique name of the mode")
    frequency: key(quantity("frequency", ge=0), "natural frequency; 0 Hz for a rigid mode")
    damping: key(
        number(gt=-1),
        "damping ratio; a mode with a damping ratio below 0 gains energy, which friction must dissipate (flutter)",
    )
    slide: key(Number, "motion of the patch along x per unit of the modal coordinate")
    normal: key(
        Number,
        "motion of the patch normal to the interface, positive where it opens, per unit of the modal coordinate",
    ) = 0.0
    pitch: key(
        PerMetre, "rotation of the patch in the plane of the model per unit of the modal coordinate"
    ) = 0.0
    yaw: key(
        PerMetre,
        "rotation of the patch about its normal per unit of the modal coordinate; needs [contact.area]",
    ) = 0.0
    base: optional(
        Number,
        "participation of the mode in the base motion; default: the value of `slide` for the "
        "first mode (give `base` where `slide` is not 1), 0 for the others; the sum of the squares over "
        "all modes must be at most 1",
    )
    output: optional(
        Number,
        "motion of the output point per unit of the modal coordinate: a force drive, a release and `travel` refer to "
        "this point, and accelerometer and gauge are placed there; default: 1 for the first mode, 0 for the others",
    )
    accelerometer: optional(
        Number,
        "motion of the accelerometer per unit of the modal coordinate; default: `output`",
    )
    gauge: optional(
        Number,
        "motion of the displacement gauge per unit of the modal coordinate; default: `output`",
    )


class Stiffening(Table):
    """A cubic restoring force on the block."""

    cubic: key(
        quantity("cubic stiffness"),
        "coefficient k_3 of the force k_3 x^3 on the block, where x is the motion at the output",
    )


class Bonded(Table):
    """A spring in parallel with the contact; this spring carries a part of the force."""

    stiffness: key(
        quantity("stiffness", ge=0), "stiffness of the spring in parallel with the contact"
    )
    damping: key(
        quantity("damping", ge=0),
        "coefficient of a damper in parallel with this spring, linear or interlocking: force per rate of the slide",
    ) = 0.0
    wavelength: optional(
        Length,
        "period of an interlocking spring, whose force is k wavelength/(2 pi) sin(2 pi "
        "x/wavelength), where x is the slide; default: a linear spring",
    )


MassPair = tuple[whole_number(0, MAX_MASS_NUMBER), whole_number(0, MAX_MASS_NUMBER)]


class Spring(Table):
    """A spring between two masses, or between a mass and the base."""

    between: key(MassPair, "numbers of the two masses, counted from 1; 0 is the base")
    stiffness: key(quantity("stiffness", ge=0), "stiffness of the spring")


class Damper(Table):
    """A damper between two masses, or between a mass and the base."""

    between: key(MassPair, "numbers of the two masses, counted from 1; 0 is the base")
    coefficient: key(quantity("damping", ge=0), "damping coefficient, force per relative velocity")


class Interface(Friction):
    """A friction interface between two masses, or between a mass and the base. An interface has its own law, and its
    own load or patch. The patch is the table [structure.interface.contact] below the interface; it takes the keys
    and tables of [contact] except approach and grooves."""

    between: key(
        MassPair,
        "numbers of the two masses that rub, counted from 1, and 0 for the base; the slide is the motion "
        "of the first mass minus the motion of the second",
    )
    load: optional(
        Force,
        "normal force on the interface; a patch, [structure.interface.contact], may be given in place of this key",
        "unless [structure.interface.contact] is given",
    )
    measured_stiffness: optional(
        quantity("stiffness", ge=0),
        "structure.measured_stiffness of this interface, for a structure with several",
    )
    contact: Contact | None = None

    @property
    def normal_load(self) -> float | None:
        """Normal force [N] on the interface or on its patch."""
        return self.load if self.contact is None else self.contact.load

    @property
    def compliance_key(self) -> str:
        """Key of the compliance that enables partial slip, or "" if the interface slips as a whole."""
        key = self.contact.compliance_key if self.contact is not None else ""
        return key.replace("contact", "structure.interface.contact", 1)


Coordinate = whole_number(1, 2_000_000) | Text  # row of a matrix, or its name


class Reduced(Table):
    """Matrices of a finite-element program, reduced to boundary coordinates and a few modes."""

    stiffness: key(
        FileName,
        "file of the stiffness matrix: Matrix Market or Abaqus text (.mtx), MATLAB (.mat), NumPy or SciPy (.npz)",
    )
    mass: key(FileName, "file of the mass matrix; may be the same file as for the stiffness matrix")
    damping: optional(
        number(ge=0, lt=1) | FileName,
        "damping ratio of every mode of the structure with free "
        "interfaces, or a file of the damping matrix; default: no damping",
    )
    boundary: key(
        array(Coordinate),
        "coordinates that are kept as boundary coordinates: row numbers of the matrices, or node:direction, such as "
        "1201:x, if the files name nodes; interfaces, `drive.mass` and `structure.output_mass` refer to the boundary "
        "coordinates by number, counted from 1",
    )
    modes: key(
        whole_number(0, 1000), "number of modes kept in addition to the boundary coordinates"
    ) = 12
    method: key(
        Literal["craig-bampton", "free-interface"],
        "'craig-bampton': modes of the structure with the boundary held; 'free-interface': modes of the free "
        "structure, with residual attachment modes, which need fewer modes if the interfaces slide",
    ) = "craig-bampton"
    moved: optional(
        array(Coordinate),
        "coordinates that a base drive moves along x: row numbers, ranges of rows (['1..39:20'] means 20 evenly "
        "spaced rows from 1 to 39), nodes or directions; default: all coordinates in direction x, or all coordinates "
        "if the files name no directions",
    )
    slide: optional(
        MassPair,
        "numbers of the two boundary coordinates that the joint of [contact] or [normal] connects, counted from 1; 0 "
        "is the base; the slide is the motion of the first minus the motion of the second",
        "with [friction]",
    )
    unit: key(
        Length,
        'length unit of the files; the unit of force in the files must be N; "1 mm" means N, mm and tonne',
    ) = 1.0


class Start(Table):
    """Displacements and velocities at t = 0, one for each mode or mass."""

    displacement: optional(
        array(quantity("length")),
        "displacements at t = 0, one for each mode or mass; default: 0",
    )
    velocity: optional(
        array(quantity("velocity")),
        "velocities at t = 0, one for each mode or mass; default: 0",
    )


class Structure(Table):
    """The rig: modes, masses with springs, or a file. The keys that end in `_at` name a place in a file of measured
    modes."""

    moving_mass: optional(Mass, "modal mass, the same for every mode", "with modes")
    travel: optional(
        Length,
        "displacement at which the flexure meets its stop; a larger displacement ends the run; default: no stop",
    )
    mode: array(Mode, least=0, most=MAX_RIG_COORDINATES) = ()
    measured: key(
        Literal["free", "stuck"],
        "'free': the modes are those of the rig without the joint; 'stuck': frequencies and damping were measured "
        "with the joint bolted, and the stiffness of the joint is subtracted from the stiffness of the modes",
    ) = "free"
    measured_joint: optional(
        Literal["written", "case"],
        "which joint is subtracted in a sweep, fit or backbone that changes the joint: 'written' (the default): in "
        "every case that of the scene as written, before --set, --over and --free; 'case': in each case its own, as "
        "if each joint had been measured bolted with these frequencies",
    )
    measured_stiffness: optional(
        quantity("stiffness", ge=0),
        "stiffness that is subtracted from modes measured with the joint: that of the joint and of a spring in "
        "[structure.bonded]; resolved scenes have it; default: it is computed, for the joint of the file as written",
    )
    measured_stiffness_error: optional(
        quantity("stiffness", ge=0),
        "error of measured_stiffness, which widens the errors of all measures; default: 0",
    )
    measured_damper: optional(
        quantity("damping", ge=0),
        "coefficient of the damper that is subtracted from modes measured with the joint; default: that of "
        "[structure.bonded] in the file as written",
    )
    stiffening: Stiffening | None = None
    bonded: Bonded | None = None
    masses: optional(
        array(Mass, most=MAX_RIG_COORDINATES),
        "masses that are connected by springs; these masses replace the modes",
    )
    output_mass: optional(
        whole_number(1, MAX_MASS_NUMBER),
        "number of the mass that carries the accelerometer; default: 1",
    )
    spring: tuple[Spring, ...] = ()
    damper: tuple[Damper, ...] = ()
    interface: tuple[Interface, ...] = ()
    file: optional(
        FileName,
        "file of matrices (.npz, .mat) or mode shapes (.uff); replaces the tables of modes",
    )
    reduced: Reduced | None = None
    slide_at: optional(
        Text,
        "node and direction, as named in the file (such as 12:+x), whose motion is the motion of the patch along x",
    )
    output_at: optional(
        Text,
        "node and direction, as named in the file, at which the accelerometer is placed",
    )
    base_at: optional(Text, "node and direction, as named in the file, that is driven as the base")
    force_at: optional(Text, "node and direction, as named in the file, on which the force acts")
    normal_at: optional(
        Text, "node and direction, as named in the file, whose motion opens the contact"
    )
    pitch_at: optional(
        Text, "node and direction, as named in the file, whose motion rotates the patch"
    )
    start: Start | None = None


class Drive(Table):
    """What sets the rig in motion; `kind` and `waveform` decide which of the other keys are needed."""

    kind: key(
        Literal["base", "force", "free"],
        "what drives the motion: 'base', an accelerated base; 'force', a "
        "force; 'free', no drive: the rig is released from a given state",
    )
    waveform: key(WaveName, "waveform of the drive over time") = "sine"
    frequency: optional(Frequency, "frequency of waveform 'sine' or 'levels'")
    from_: key(
        Frequency | None, "start frequency of a sweep, or lowest frequency of a random drive"
    ) = Field(None, alias="from")
    to: optional(Frequency, "end frequency of a sweep, or highest frequency of a random drive")
    spectrum: optional(
        quantity("acceleration spectrum", gt=0),
        "one-sided spectral density of a random base acceleration, constant between `from` and `to`",
    )
    seed: optional(whole_number(0, 2**32 - 1), "seed of the random record; default: 0")
    rate: optional(
        quantity("sweep rate", gt=0),
        "rate at which the frequency of a linear sweep changes",
    )
    log_rate: optional(
        quantity("logarithmic sweep rate", gt=0),
        "rate of a logarithmic sweep, in octaves per unit of time",
    )
    acceleration: optional(
        quantity("acceleration", ge=0),
        "amplitude of the base acceleration, zero to peak",
        "with kind `base` and waveform `sine`, `step` or `sweep`, unless `displacement` is given",
    )
    displacement: optional(
        quantity("length", ge=0),
        "displacement of the base, zero to peak, in place of `acceleration`; with kind 'free', the displacement of "
        "the output at release: a static force at the output holds the structure, the interfaces free of force, and "
        "lets go; in a rig of masses, and if `mass` is given, that mass or coordinate alone is displaced",
        "with kind `free`, unless [structure.start] is given; with kind `base`, as `acceleration`",
    )
    levels: optional(
        array(quantity("acceleration", ge=0)),
        "amplitudes of the base acceleration, or of the force with kind 'force', applied one after the other, also as a "
        "range of equal steps, such as `2 g..6 g:5`; each level starts from the final state of the previous level",
    )
    frequencies: optional(
        array(Frequency, least=2, most=100),
        "frequencies of the sines of waveform 'tones', which act at the same time",
    )
    accelerations: optional(
        array(quantity("acceleration", ge=0), least=2),
        "amplitude of the base acceleration of each sine, zero to peak",
    )
    phases: optional(
        array(quantity("angle"), least=2),
        "phase of each sine at the start of the run; default: 0",
    )
    onset: key(
        Literal["slip", "distortion", "gauge"],
        "event that counts as the onset of slip in the measure "
        "onset_level. 'slip': the interface slips irreversibly (an elastic interface: by more than a thousandth "
        "of its elastic range). 'distortion': the third harmonic of the acceleration exceeds 3 % of the first "
        "harmonic. 'gauge': half the peak-to-peak motion at the output exceeds `onset_length`",
    ) = "distortion"
    onset_length: optional(
        Length,
        "smallest motion at the output that the gauge can show, half peak-to-peak",
    )
    force: optional(
        Force,
        "amplitude of the force, zero to peak",
        "with kind `force` and waveform `sine`, `step` or `sweep`",
    )
    mass: optional(
        whole_number(1, MAX_MASS_NUMBER),
        "number of the mass on which the force acts; default: the force acts at the output",
    )
    cycles: optional(
        Positive,
        "length of the run, or of each level, in cycles of the drive; with kind 'free', in cycles of the first mode whose "
        "frequency is not 0 (linear bonded springs count, interlocking ones do not)",
    )
    duration: optional(
        Duration, "length of the run, or of each level, as a time; replaces `cycles`"
    )
    file: optional(
        FileName,
        "file with a record of the drive, a table with units or UFF; for waveform 'random', a table of the spectrum",
    )

    @field_validator("levels", mode="before")
    @classmethod
    def _read_levels(cls, value: TomlValue, info: ValidationInfo) -> TomlValue:
        """Read a range of levels, and write each level of a force drive in SI as if it were an acceleration.

        `value` are the levels as written. `info` has the keys before this one, among them the kind of drive.
        """
        if isinstance(value, str) and ".." in value:
            value = spread_range(
                value, "force" if info.data.get("kind") == "force" else "acceleration"
            )
        if info.data.get("kind") != "force" or not isinstance(value, list | tuple):
            return value
        forces = [parse_quantity(level, "force") for level in value]
        for force in forces:
            require_magnitude(force, smallest=1 / MAX_MAGNITUDE, unit="N")
        return [format_si(force, "acceleration") for force in forces]


class WornFriction(Table):
    """Friction that changes with the worn depth. The factors are interpolated linearly between the given depths and are
    constant beyond the last depth."""

    depth: key(
        array(quantity("length", ge=0), least=2),
        "mean worn depths, rising from "
        "0; the mean worn depth is the worn volume of both pieces divided by the area of the patch",
    )
    coefficient_factor: optional(
        array(Positive, least=2),
        "factor on `static` and `kinetic` at each depth; must be 1 at depth 0",
    )
    bond_length_factor: optional(
        array(Positive, least=2),
        "factor on `bond_length` at each depth; must be 1 at depth 0",
    )


class Wear(Table):
    """Material removed over many cycles."""

    coefficient: key(
        quantity("wear coefficient", ge=0),
        "volume worn off both pieces together, divided by the "
        "product of load and slip path; with form 'energy', this volume divided by the friction work",
    )
    upper_share: key(Fraction, "fraction of the worn depth that is worn off the upper piece") = 0.5
    cycles: key(
        Positive,
        "number of cycles over which material is removed; each of these cycles is assumed equal to "
        "the last cycle of the run, in which the motion has converged",
    )
    jumps: key(
        Literal["auto"] | whole_number(1, 1_000_000),
        "number of equal jumps into which the cycles of wear are divided; default: set by the tolerance",
    ) = "auto"
    form: key(
        Literal["archard", "energy"],
        "'archard': the worn depth is proportional to pressure times slip path; "
        "'energy': the worn depth is proportional to the friction work per area",
    ) = "archard"
    start: optional(
        FileName,
        "file result.nc of an earlier run with [wear], such as out/before/result.nc; the new run "
        "starts from the worn depth of the earlier run; default: the pieces are new",
    )
    friction: WornFriction | None = None


class Measured(Table):
    """Measurements that are plotted together with the results."""

    file: key(
        FileName,
        "table of measurements with the columns frequency, input, acceleration, displacement and flag",
    )
    acceleration_gain: key(
        Positive, "ratio of the accelerometer reading to the true acceleration"
    ) = 1.0
    displacement_gain: key(Positive, "ratio of the gauge reading to the true displacement") = 1.0
    reading: key(
        Literal["peak", "fundamental", "rms", "lowpass"],
        "quantity that the accelerometer shows: 'peak', the largest acceleration; 'fundamental', the component of the "
        "acceleration at the drive frequency; 'rms', the root mean square of the acceleration; 'lowpass', the largest "
        "acceleration after a second-order low-pass filter",
    ) = "peak"
    reading_cutoff: optional(Frequency, "cut-off frequency of the low-pass filter")


class Tables(Table):
    """These keys stand at the top of the file, before the first table."""

    title: key(Title, "title of the results, one line of text") = ""
    contact: Contact | None = None
    normal: Normal | None = None
    friction: Friction | None = None
    slide: Slide | None = None
    structure: Structure | None = None
    drive: Drive | None = None
    wear: Wear | None = None
    accuracy: Accuracy = Accuracy.model_construct()
    measured: Measured | None = None
