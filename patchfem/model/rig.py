"""The unsolved rig of a scene: modes, drive signal, initial state, interfaces and springs."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .. import inputs
from ..core import InitialState, ModalBasis, array_dataclass, max_abs
from ..effects import Waveform, find_waveform, import_effect
from ..scene.rules.methods import find_load_change_key
from ..structure import drives
from ..structure.drive_sizes import (
    DriveKeys,
    count_cycles_per_level,
    count_repeat_cycles,
    estimate_peak_speed,
    find_decay_rate,
    find_drive_omega,
    find_first_period,
    find_max_acceleration,
)
from . import structure_files
from .law import InterfaceLaw, build_interface_laws, make_interface_names
from .source import cache_by_file, name_key
from .structure import (
    SubtractedJoint,
    build_modes,
    build_modes_without_bond,
    build_start,
    find_bolted_scene,
    find_bolted_spring,
    find_known_joint,
    has_pressed_joint,
    name_joint_source,
    needs_band_displacements,
    read_file_notes,
)

if TYPE_CHECKING:
    from ..scene.keys.tables import Friction
    from ..structure.drives import DriveSignal

# Largest displacement [m] up to which a motion that grows without bound is computed.
MAX_COMPUTED_DISPLACEMENT = 1e3

# Tables of the joint that was bolted when the modes were measured.
JOINT_TABLES = ("contact.", "normal.", "friction.", "structure.bonded.", "structure.interface.")


@dataclass(frozen=True, slots=True)
class DriveLevels:
    """Amplitudes of a drive signal that is raised in levels; empty for any other drive signal.

    - amplitudes: acceleration [m s-2], or force over the modal mass, of each level.
    - cycles: drive cycles of each level.
    - onset: kind of event that counts as the onset of slip, and its length [m] or None.
    """

    amplitudes: tuple[float, ...] = ()
    cycles: float = 0.0
    onset: tuple[str, float | None] = ("distortion", None)


@array_dataclass
class RigDrive:
    """Drive signal of a rig, with its kind, frequency and number of cycles.

    - signal: drive signal in the form that the solvers use: base acceleration or force over the modal mass.
    - kind: ``"base"``, ``"force"`` or ``"free"``.
    - frequency: frequency [Hz] of a sine or of levels.
    - cycles: drive cycles of the whole run.
    - force: amplitude [N] of a force drive.
    - waveform: form of the signal, with what the engines must know of it.
    - levels: amplitudes of a drive that is raised in levels.
    """

    signal: "DriveSignal"
    kind: str
    waveform: Waveform
    frequency: float | None
    cycles: float
    force: float | None
    levels: DriveLevels = DriveLevels()

    @property
    def is_release(self) -> bool:
        """Whether the rig is released from a displacement, and then not driven."""
        return self.kind == "free"


@array_dataclass
class RigFriction:
    """Friction interfaces of a rig.

    - interfaces: friction laws of the interfaces, empty in a linear rig.
    - names: names of the interfaces between masses, empty in other rigs.
    - load_varies: whether the normal load changes with the motion or in time.
    - bands_slide_apart: whether a mode yaws a face, so that its bands have different displacements.
    """

    interfaces: tuple[InterfaceLaw, ...]
    names: tuple[str, ...]
    load_varies: bool
    bands_slide_apart: bool

    @property
    def has_partial_slip(self) -> bool:
        """Whether an interface has a patch that allows partial slip."""
        return any(interface.partial_slip for interface in self.interfaces)


@dataclass(frozen=True, slots=True)
class RigSprings:
    """Springs of the rig in addition to the contact, and the limit of the motion.

    - bonded: stiffness [N/m] of the bonded spring.
    - interlock: stiffness [N/m] and wavelength [m] of a bonded spring that is not linear.
    - cubic: stiffening at the output [N/m3].
    - travel: largest displacement [m]: the stop of the scene, `MAX_COMPUTED_DISPLACEMENT` if a mode gains energy
      or a spring softens, else infinite.
    """

    bonded: float | None
    interlock: tuple[float, float] | None
    cubic: float | None
    travel: float

    @property
    def is_nonlinear(self) -> bool:
        """Whether one of these springs is not linear."""
        return self.cubic is not None or self.interlock is not None


@array_dataclass
class FirstMode:
    """First elastic mode of the scene, for the rig without the spring of the bonded joint.

    - frequency: natural frequency [Hz], 0 if all modes are rigid.
    - mass: moving mass [kg].
    - contact_mass: modal mass over the square of its slide [kg], 0 if the mode does not move the
      first interface.
    - slides: slide of the first interface in each mode of the scene per coordinate of the rig, this
      mode first, shape (p, n).
    """

    frequency: float
    mass: float
    contact_mass: float
    slides: np.ndarray

    @property
    def stiffness(self) -> float:
        """Modal stiffness [N/m] referred to the contact, or 0 if the mode does not move the contact.

        The mode moves the contact by its slide s per unit of its coordinate, so that
        (mass omega^2/2)(A/s)^2 is its energy at a slide of A.
        """
        return self.contact_mass * (2 * np.pi * self.frequency) ** 2

    def fraction_of_other_modes(self, modal) -> float:
        """Return the largest slide range due to the other modes, divided by the range of the whole slide.

        Parameters
        ----------
        modal : (k, n) array_like
            Coordinates of the rig [m].

        Returns
        -------
        float
            0 if nothing slides.
        """
        slides = np.asarray(modal) @ self.slides.T
        whole_range = float(np.ptp(slides.sum(axis=1), axis=0))
        if whole_range <= 0:
            return 0.0
        return float(np.ptp(slides[:, 1:], axis=0).max(initial=0.0)) / whole_range


class BoltedJoint(NamedTuple):
    """Joint that was bolted when the modes of a rig were measured.

    - origin: where the joint comes from, "given", "written" or "case" as in `structure.JOINT_WORDS`.
    - spring: linear spring and damper beside this joint.
    - subtracted: what is subtracted from the modes, or None as long as a patch has to be solved for it.
    - build_rig: function of what is subtracted that returns the rig without this joint, or None if the rig has no patch
      whose stiffness in stick is computed.
    - build_stiffer_rig: the same for a joint that is stiffer by the error of its stiffness, if this stiffness determines
      the slide of the modes, or None.
    - model: `model.Model` of the scene with this joint, or None if it is the model of the rig itself.
    - stuck_stiffness: stiffness [N/m] of the solved patch of the rig in full stick, or None without one.
    """

    origin: str
    spring: SubtractedJoint
    subtracted: SubtractedJoint | None = None
    build_rig: "Callable[[SubtractedJoint], Rig] | None" = None
    build_stiffer_rig: "Callable[[SubtractedJoint], Rig] | None" = None
    model: object = None
    stuck_stiffness: float | None = None


@array_dataclass
class RigStructure:
    """Structure of a rig: its natural frequencies, and where its modes come from.

    - frequencies: natural frequencies [Hz], with the bonded spring, shape (n,).
    - lists_modes: whether the scene lists the modes.
    - notes: sentences for the user on a structure file.
    - bolted: joint with which the modes were measured; None for modes without a joint.
    - other_rigs: rigs of a reduced structure with more modes and with half of them (unless it has
      fewer than two); () if no mode is left out.
    - reduction_notes: sentences for the user on the reduction.
    - max_modes: number of modes that a reduced structure can keep, 0 for other structures.
    """

    frequencies: np.ndarray
    lists_modes: bool
    notes: tuple[str, ...]
    bolted: BoltedJoint | None = None
    other_rigs: tuple["Rig", ...] = ()
    reduction_notes: tuple[str, ...] = ()
    max_modes: int = 0

    @property
    def richer_rig(self) -> "Rig | None":
        """Rig of a reduced structure with more modes, None if no mode is left out."""
        return self.other_rigs[0] if self.other_rigs else None


@array_dataclass
class Rig:
    """Modes of a structure with the drive signal, the interfaces and the springs.

    - modes: modes without the contact.
    - drive: drive signal and how it acts.
    - start: initial motion, or None at rest.
    - friction: laws and loads of the interfaces.
    - springs: springs in addition to the contact, and the limit of the motion.
    - first_mode: first elastic mode of the scene.
    - structure: natural frequencies, and where the modes come from.
    """

    modes: ModalBasis
    drive: RigDrive
    start: InitialState | None
    friction: RigFriction
    springs: RigSprings
    first_mode: FirstMode
    structure: RigStructure

    @property
    def speed_scale(self) -> float:
        """Expected speed [m/s] from drive signal and initial state."""
        return estimate_peak_speed(self.drive.signal, self.start)

    @property
    def slide_speed_scale(self) -> float:
        """Expected sliding speed [m/s] of the fastest interface; it sets the default rest speed of bonds (2.10).

        It is that of modes without restoring forces, as far as the interfaces take part in them.
        """
        signal = self.drive.signal
        omega = find_drive_omega(signal)
        peaks = [np.abs(self.modes.base) * find_max_acceleration(signal) / omega]
        if self.start is not None:
            peaks += [np.abs(self.start.v), omega * np.abs(self.start.z)]
        speeds = np.abs(self.modes.interfaces) @ np.transpose(peaks)
        return float(speeds.max(initial=0.0))

    @property
    def displacement_scale(self) -> float:
        """Expected displacement [m]: the expected speed over the angular frequency of the drive signal."""
        return self.speed_scale / find_drive_omega(self.drive.signal)

    def count_repeat_cycles(self, load) -> float | None:
        """Return the number of drive cycles after which drive and load repeat, or None if the drive never does.

        `load` is the PointLoad of the model, or None.
        """
        frequency = load.frequency if load is not None and load.amplitude else None
        return count_repeat_cycles(self.drive.signal, frequency)

    def with_law(self, law: "Friction") -> "Rig":
        """Return a copy of the rig whose interfaces have another friction law."""
        interfaces = tuple(replace(one, numbers=law) for one in self.friction.interfaces)
        return replace(self, friction=replace(self.friction, interfaces=interfaces))

    def with_signal(self, signal, **changes) -> "Rig":
        """Return a copy of the rig with another drive signal; `changes` replace other fields of the drive."""
        return replace(self, drive=replace(self.drive, signal=signal, **changes))


def build_rig(scene, joint: SubtractedJoint | None = None) -> Rig:
    """Build the rig of a scene with [structure] and [drive].

    The modes have natural frequencies omega [rad/s] and damping ratios, and per unit modal coordinate
    the displacement at each interface (`slide`), that at the output and the excitation by the base. They
    are those of [[structure.mode]], or of its masses, springs, beams or matrices. A drive by the base
    is its acceleration a(t) [m s-2], such as a sin(omega t) with the amplitude `acceleration`.

    Parameters
    ----------
    scene : Scene
        Checked scene with [structure] and [drive].
    joint : SubtractedJoint, optional
        Joint of a solved patch, which is subtracted from modes measured with it.

    Returns
    -------
    Rig

    Raises
    ------
    PatchfemError
        If a file or a start cannot be used.
    """
    interfaces = build_interface_laws(scene)
    rig = _build(scene, build_modes_without_bond(scene, joint), interfaces, joint)
    if scene.structure.reduced is None:
        return rig
    reduced = structure_files.build_reduced_modes(scene)
    structure = replace(
        rig.structure,
        other_rigs=tuple(_build(scene, modes, interfaces) for modes in reduced.other_modes),
        reduction_notes=tuple(reduced.notes),
        max_modes=reduced.max_modes,
    )
    return replace(rig, structure=structure)


def _build(
    scene,
    unbonded: ModalBasis,
    interfaces: tuple[InterfaceLaw, ...],
    joint: SubtractedJoint | None = None,
) -> Rig:
    """Build the rig of a scene from its modes without the spring of the bonded joint.

    Parameters
    ----------
    scene : Scene
        Checked scene with [structure] and [drive].
    unbonded : ModalBasis
        Modes without the spring of the bonded joint.
    interfaces : tuple of InterfaceLaw
        Friction laws of the interfaces, or () without friction.
    joint : SubtractedJoint, optional
        Joint of a solved patch that was subtracted from measured modes.

    Returns
    -------
    Rig
    """
    modes = build_modes(scene, unbonded)
    friction = RigFriction(
        interfaces=interfaces,
        names=tuple(make_interface_names(scene.structure)),
        load_varies=bool(interfaces and find_load_change_key(scene)),
        bands_slide_apart=needs_band_displacements(scene),
    )
    return Rig(
        modes=modes,
        drive=build_drive(scene, modes),
        start=build_start(scene, modes),
        friction=friction,
        springs=_build_springs(scene.structure, modes),
        first_mode=_build_first_mode(scene, unbonded, modes),
        structure=_build_structure(scene, modes, joint),
    )


def build_drive(scene, modes: ModalBasis) -> RigDrive:
    """Build the drive signal of a rig from [drive] of a scene, and the number of drive cycles.

    `modes` are those of the rig.
    """
    keys = scene.drive
    signal = build_signal(scene, modes)
    waveform = find_waveform(keys)
    levels = DriveLevels()

    # Number of cycles of the whole run.
    if waveform.has_levels:
        amplitudes = tuple(segment.amplitude for segment in signal.segments)
        levels = DriveLevels(
            amplitudes, count_cycles_per_level(keys), (keys.onset, keys.onset_length)
        )
        cycles = levels.cycles * len(keys.levels)
    elif keys.cycles is not None:
        cycles = keys.cycles
    else:
        duration = signal.duration if keys.duration is None else keys.duration
        # Smallest number of drive cycles in a run whose length is given as a duration.
        cycles = max(duration / signal.period, 0.25)

    return RigDrive(
        signal=signal,
        kind=keys.kind,
        waveform=waveform,
        frequency=keys.frequency,
        cycles=float(cycles),
        force=keys.force if keys.kind == "force" else None,
        levels=levels,
    )


def build_signal(scene, modes: ModalBasis):
    """Build the drive signal of a scene in the form that the solvers use.

    A displacement amplitude X of the base becomes the acceleration amplitude X omega^2, and a force F
    becomes F over the modal mass. A drive without a frequency of its own gets its cycle from the
    first elastic mode.
    """
    if scene.drive.kind == "free":
        return drives.make_release(find_first_period(modes))
    keys = DriveKeys(
        scene.drive, modes.mass, find_first_period(modes), lambda: _read_recorded_drive(scene)
    )
    waveform = scene.drive.waveform
    return import_effect(f"drive.waveform={waveform}").DRIVE_BUILDERS[waveform](keys)


def _read_recorded_drive(scene) -> tuple[np.ndarray, np.ndarray]:
    """Read both columns (k,) of the file drive.file of a scene.

    They are time [s] and signal, or frequency [Hz] and spectral density. The signal is an acceleration [m s-2] or a
    force [N], by the kind of the drive.
    """
    path = scene.resolve_path(scene.drive.file)
    with name_key("drive.file"):
        if find_waveform(scene.drive).is_random:
            return inputs.signals.read_spectrum(path)
        return read_drive_file(path, scene.drive.kind)


@cache_by_file
def read_drive_file(path: Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Read a recorded drive signal.

    Parameters
    ----------
    path : Path
        File to read.
    kind : str
        ``"base"`` for an acceleration of the base, else the file contains a force.

    Returns
    -------
    tuple of numpy.ndarray
        Time (k,) [s] from 0 on, and acceleration (k,) [m s-2] or force (k,) [N].
    """
    return inputs.signals.read_signal(path, "acceleration" if kind == "base" else "force")


def _build_springs(structure, modes: ModalBasis) -> RigSprings:
    """Build the springs of a rig beside its modes from the table [structure].

    They are the bonded spring and the cubic spring of the output. The travel [m] limits the motion: it is that of the
    scene, or MAX_COMPUTED_DISPLACEMENT if the motion of the `modes` can grow without limit, else inf.
    """
    bonded = structure.bonded
    interlock = None
    if bonded is not None and bonded.wavelength is not None:
        interlock = (bonded.stiffness, bonded.wavelength)
    cubic = structure.stiffening.cubic if structure.stiffening is not None else None
    travel = structure.travel
    if not travel:
        can_grow = find_decay_rate(modes) < 0 or (cubic or 0.0) < 0
        travel = MAX_COMPUTED_DISPLACEMENT if can_grow else np.inf
    stiffness = bonded.stiffness if bonded is not None else None
    return RigSprings(stiffness, interlock, cubic, travel)


def _build_first_mode(scene, unbonded: ModalBasis, modes: ModalBasis) -> FirstMode:
    """Build the record of the first elastic mode of a scene.

    `unbonded` are the modes without the bonded spring, `modes` the coordinates of the rig.
    """
    structure = scene.structure
    interfaces = unbonded.interfaces
    slide = interfaces[0] if len(interfaces) else unbonded.output
    elastic = np.flatnonzero(unbonded.omega > 0)
    first = int(elastic[0]) if elastic.size else 0
    frequency = float(unbonded.omega[first]) / (2 * np.pi)

    # The mass at the output is that of this mode, or of all coordinates if the mode does not move the output.
    mass = structure.moving_mass
    if mass is None or not (structure.mode or structure.file):
        squared = np.square(unbonded.output)
        total = max(float(squared.sum()), 1e-300)
        # Fraction of the squared motion of the output below which a mode moves the output by round-
        # off only.
        moves_output = squared[first] > 1e-12 * total
        mass = float(unbonded.mass / (squared[first] if moves_output else total))
    contact_mass = 0.0
    # Slide of the first mode per modal coordinate, relative to the largest one of all modes, below
    # which it is round-off.
    if abs(slide[first]) > 1e-9 * max_abs(slide):
        contact_mass = float(unbonded.mass / max(slide[first] ** 2, 1e-300))

    # Both bases describe the same masses, so a least-squares fit converts the coordinates.
    unbonded_from_modes = np.eye(slide.size)
    if modes is not unbonded and modes.shapes is not None:
        unbonded_from_modes = modes.shapes
        if unbonded.shapes is not None:
            unbonded_from_modes = np.linalg.lstsq(unbonded.shapes, modes.shapes, rcond=None)[0]
    order = [first, *(k for k in range(slide.size) if k != first)]
    return FirstMode(frequency, mass, contact_mass, (slide[:, None] * unbonded_from_modes)[order])


def _build_structure(scene, modes: ModalBasis, joint: SubtractedJoint | None) -> RigStructure:
    """Build the RigStructure of a scene from the modes of its rig.

    `joint` is the joint of a solved patch that was bolted in the modal test, if it is known already.
    """
    structure = scene.structure
    bolted = None
    if structure.measured == "stuck":
        is_pressed = has_pressed_joint(scene) or has_pressed_joint(find_bolted_scene(scene))
        bolted = BoltedJoint(
            name_joint_source(structure),
            find_bolted_spring(scene),
            find_known_joint(scene) if joint is None else joint,
            partial(build_rig, scene) if joint is None and is_pressed else None,
        )
    return RigStructure(
        frequencies=modes.omega / (2 * np.pi),
        lists_modes=bool(structure.mode),
        notes=tuple(read_file_notes(scene)),
        bolted=bolted,
    )
