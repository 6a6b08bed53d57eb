"""Modes of [structure] with their participation in the drive signal, and the initial state.

[structure] describes a rig by modes, by masses and springs, by matrices or by a file. The functions here
give the same quantities for each description.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from math import inf
from typing import NamedTuple

import numpy as np

from .. import friction
from ..core import InitialState, ModalBasis, PatchfemError, frozen_array
from ..effects import find_waveform, import_effect, law_has_trait
from ..scene.keys.memoize import memoize
from ..scene.rules.methods import find_yaw_key
from ..structure import masses, starts
from ..structure import modes as listed_modes
from . import structure_files
from .law import InterfaceLaw, build_interface_laws, find_normal_load
from .source import name_key

# What is subtracted from bolted modes, by `name_joint_source`
# Number of bands of cells across a face that slide by themselves if it yaws; each is an interface of the motion.
N_YAW_BANDS = 8
JOINT_WORDS = {
    "given": "structure.measured_stiffness",
    "written": "the stiffness of the joint of the scene as written",
    "case": "the stiffness of the joint of each case",
}

# Tables of a scene, besides [structure], that describe its joint
JOINT_TABLES = ("contact", "normal", "friction")

_build_listed_modes = memoize(listed_modes.build_basis)


class SubtractedJoint(NamedTuple):
    """Joint that is subtracted from modes that were measured with it, with its bonded spring and damper.

    - stiffness: stiffness [N/m] along each interface.
    - error: error [N/m] of the stiffness, which a pressed patch has.
    - damping: coefficient [N s/m] of the damper, or None for that of the scene itself.
    """

    stiffness: tuple[float, ...]
    error: float = 0.0
    damping: float | None = None

    def stiffen(self) -> "SubtractedJoint":
        """Return the joint that is stiffer by its error."""
        return self._replace(stiffness=tuple(k + self.error for k in self.stiffness))

    def list_values(self) -> dict[str, float]:
        """Return the keys with which a scene states this joint, and their values in SI."""
        if len(self.stiffness) == 1:
            values = {"structure.measured_stiffness": self.stiffness[0]}
        else:
            items = enumerate(self.stiffness)
            values = {f"structure.interface.{k}.measured_stiffness": value for k, value in items}
        if self.error:
            values["structure.measured_stiffness_error"] = self.error
        if self.damping is not None:
            values["structure.measured_damper"] = self.damping
        return values


def build_modes(scene, unbonded: ModalBasis | None = None) -> ModalBasis:
    """Build the modes of a rig, including the linear spring and the damper of the bonded joint.

    The field `base` is the participation of the drive. Of a moving base it is the participation of
    each coordinate in the base motion. Of a force F it is minus the motion of the driven place per
    coordinate, with a(t) = F/mass. The driven place is drive.mass or else structure.output_mass; of
    modes without numbered masses it is the output, or what the structure file states.

    Parameters
    ----------
    scene : Scene
        Checked scene with [structure] and [drive].
    unbonded : ModalBasis, optional
        Result of `build_modes_without_bond`, if it is known.

    Returns
    -------
    ModalBasis

    Raises
    ------
    PatchfemError
        If a file lacks something, or if a bonded spring has no single interface to act on.
    """
    modes = build_modes_without_bond(scene) if unbonded is None else unbonded
    # A mode that yaws a face gives each band of cells its own displacement, which is that at its middle.
    if needs_band_displacements(scene):
        offsets = compute_band_offsets(scene.contact.width)
        modes = replace(modes, faces=frozen_array(compute_band_slides(modes, offsets)))
    if modes.faces is not None and not len(modes.faces):
        # Without an interface there is no friction, and the motion of
        # the output replaces the slide.
        modes = replace(modes, faces=None)
    bonded = scene.structure.bonded
    # A spring that interlocks is not linear, so the time integration applies it. Its damper is linear.
    is_linear = bonded is not None and bonded.wavelength is None
    if not is_linear and (bonded is None or not bonded.damping):
        return modes
    if len(modes.interfaces) != 1 and not scene.structure.mode:
        raise PatchfemError(
            f"applies only to a single contact, but the rig has {len(modes.interfaces)} interfaces; "
            "instead write a spring between the two places that an interface joins",
            "structure.bonded",
        )
    stiffness = bonded.stiffness if is_linear else 0.0
    return import_effect("structure.bonded").add_spring(modes, stiffness, bonded.damping)


def build_modes_without_bond(scene, joint: SubtractedJoint | None = None) -> ModalBasis:
    """Build the modes of a rig, excluding the linear spring of the bonded joint.

    The joint is subtracted from modes that were measured while it stuck.

    Parameters
    ----------
    scene : Scene
        Checked scene with [structure] and [drive].
    joint : SubtractedJoint, optional
        Joint of a solved patch; by default that of `find_known_joint`. Modes that were measured
        with a pressed patch are not changed until its stiffness is given.

    Returns
    -------
    ModalBasis
        Modes with the participations of interfaces, drive and sensors.
    """
    modes = _build_given_modes(scene)

    # Modes without a joint are complete; a pressed patch must be solved first.
    if joint is None and scene.structure.measured == "stuck":
        joint = find_known_joint(scene)
    if joint is None:
        return modes

    damping = joint.damping
    if damping is None:
        damping = _find_damping(scene)
    try:
        return import_effect("structure.bonded").remove_springs(modes, joint.stiffness, damping)
    except PatchfemError as error:
        key = "structure.measured"
        slides = [abs(mode.slide) for mode in scene.structure.mode or ()]
        if slides and "`slide`" in str(error):
            key = f"structure.mode.{int(np.argmax(slides))}.slide"
        raise PatchfemError(
            f"{error}; or give the frequencies of the bolted rig, give a softer joint, or leave "
            "`measured` out if the frequencies were measured without the joint",
            key,
        ) from None


def name_joint_source(structure) -> str:
    """Return where the joint comes from that is subtracted from bolted modes: "given", "written" or "case".

    `structure` is the table [structure]. The keys of a scene give the joint; or it is that of the scene as written, or
    that of each case.
    """
    stiffnesses = [structure.measured_stiffness]
    stiffnesses += [interface.measured_stiffness for interface in structure.interface]
    if any(stiffness is not None for stiffness in stiffnesses):
        return "given"
    return structure.measured_joint or "written"


def find_bolted_scene(scene):
    """Return the scene whose joint was bolted when the modes were measured: the scene itself, or the one as written.

    It is the scene itself if all its changes leave the joint alone, or if each case has its own modal test.
    """
    written = scene.written
    if written is None or scene.structure.measured_joint == "case":
        return scene
    is_same = all(getattr(scene, name) == getattr(written, name) for name in JOINT_TABLES)
    joints = [(one.structure.bonded, one.structure.interface) for one in (scene, written)]
    return scene if is_same and joints[0] == joints[1] else written


def find_known_joint(scene) -> SubtractedJoint | None:
    """Return the joint that is subtracted from the modes of a scene, or None if a patch must be solved for it.

    The scene gives its stiffness, or it follows from the friction laws.
    """
    structure = scene.structure
    spring = find_bolted_spring(scene)
    if structure.measured_stiffness is not None:
        error = structure.measured_stiffness_error or 0.0
        return SubtractedJoint((structure.measured_stiffness,), error, spring.damping)
    bolted_scene = find_bolted_scene(scene)
    if has_pressed_joint(bolted_scene):
        return None
    given = [interface.measured_stiffness for interface in structure.interface]
    stiffnesses = _compute_joint_stiffnesses(bolted_scene, given)
    # The bonded spring acts beside a single interface.
    if len(stiffnesses) == 1:
        stiffnesses[0] += spring.stiffness[0]
    return spring._replace(stiffness=tuple(stiffnesses))


def find_bolted_spring(scene) -> SubtractedJoint:
    """Return the linear spring and the damper beside the joint that was bolted when the modes were measured."""
    bolted_scene = find_bolted_scene(scene)
    bonded = bolted_scene.structure.bonded
    damping = scene.structure.measured_damper
    if damping is None and _find_damping(bolted_scene) != _find_damping(scene):
        damping = _find_damping(bolted_scene)
    return SubtractedJoint((0.0 if bonded is None else bonded.stiffness,), damping=damping)


def _find_damping(scene) -> float:
    """Return the coefficient [N s/m] of the damper in [structure.bonded] of a scene."""
    bonded = scene.structure.bonded
    return 0.0 if bonded is None else bonded.damping


def has_pressed_joint(scene) -> bool:
    """Return whether the joint stiffness of a scene depends on a pressed patch, too.

    Otherwise it follows from the friction law and the load alone.
    """
    contact = scene.contact
    if scene.friction is None or contact is None:
        return False
    return bool(contact.compliance_key or contact.load is None)


def _compute_joint_stiffnesses(scene, given: Sequence[float | None]) -> list[float]:
    """Compute the stiffness [N/m] of each sticking interface of a scene from its law, unless it is `given`."""
    scene_load = find_normal_load(scene)
    stiffnesses = []
    for interface, stiffness in zip_longest(build_interface_laws(scene), given):
        if stiffness is None:
            load = scene_load if interface.load is None else interface.load
            stiffness = compute_sticking_stiffness(interface, load)
        stiffnesses.append(stiffness)
    return stiffnesses


def compute_sticking_stiffness(interface: InterfaceLaw, load: float) -> float:
    """Compute the tangential stiffness [N/m] of a sticking interface under a load [N].

    Raises
    ------
    PatchfemError
        If the law has no single finite stiffness.
    """
    law = interface.numbers
    stiffness = friction.record.stick_stiffness(law, load)
    is_curved = law_has_trait(law.law, "bonds") and (law.order, law.reading) != (1, "stretch")
    if 0 < stiffness < inf and not is_curved:
        return stiffness
    if stiffness == inf:
        reason = "sticks rigidly"
    elif is_curved:
        reason = "has no single stiffness"
    else:
        reason = "has no stiffness"
    raise PatchfemError(
        f"{interface.key}: law '{law.law}' {reason} in this scene, so its stiffness cannot be subtracted from the "
        "modes; add an elastic part ([contact.shear], or a law with a stiffness such as iwan), or give "
        "the modes without the joint",
        "structure.measured",
    )


def _build_given_modes(scene) -> ModalBasis:
    """Build the modes that [structure] of a scene describes, without the bonded spring.

    They are listed, or computed from reduced matrices, from a file, or from masses and springs.
    """
    structure = scene.structure
    if structure.mode:
        return _build_listed_modes(structure, scene.drive.kind)
    if structure.reduced is not None:
        return structure_files.build_reduced_modes(scene).modes
    if not structure.masses:
        return structure_files.read_scene_modes(scene).modes
    with name_key("structure"):
        return masses.build_basis(
            structure.masses,
            [(spring.between, spring.stiffness) for spring in structure.spring],
            [(damper.between, damper.coefficient) for damper in structure.damper],
            structure_files.list_slide_pairs(structure),
            structure.output_mass or 1,
            _find_driven_mass(scene) if scene.drive.kind == "force" else None,
        )


def read_file_notes(scene) -> list[str]:
    """Return sentences that tell the user what was neglected or changed in structure.file of a scene."""
    if scene.structure.file is None:
        return []
    return structure_files.read_scene_modes(scene).notes


def _find_driven_mass(scene) -> int:
    """Return the number of the mass on which the force of a scene acts or which is released."""
    return scene.drive.mass or scene.structure.output_mass or 1


def build_start(scene, modes: ModalBasis) -> InitialState | None:
    """Build the initial state of the rig of a scene in its modes, or None if it starts at rest.

    Raises
    ------
    PatchfemError
        If the motion starts beyond structure.travel.
    """
    start = compute_initial_state(scene, modes)
    travel = scene.structure.travel
    if travel is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError(
            "the motion starts beyond this travel; raise structure.travel or start nearer to the middle",
            "structure.travel",
        )
    return start if start.z.any() or start.v.any() else None


def compute_initial_state(scene, modes: ModalBasis) -> InitialState:
    """Compute displacements and velocities at t = 0 in the modal coordinates of the rig of a scene.

    [structure.start] gives them for each mode or mass. A release displaces one mass, or the output in
    the shape of a static force there. A step of the base displacement leaves the masses where they
    were. All other drives start at rest.
    """
    structure = scene.structure
    drive = scene.drive
    if structure.start is not None:
        displacement = _extend_boundary_values(structure, modes, structure.start.displacement)
        velocity = _extend_boundary_values(structure, modes, structure.start.velocity)
        return starts.start_from_values(modes, displacement, velocity)
    if drive.kind == "free":
        if structure.masses is None and drive.mass is None:
            return starts.start_from_output_displacement(modes, drive.displacement)
        displacement = np.zeros(len(modes.names))
        mass = _find_driven_mass(scene)
        if mass > displacement.size:
            raise PatchfemError(f"the rig has only {displacement.size} coordinates", "drive.mass")
        displacement[mass - 1] = drive.displacement
        return starts.start_from_values(modes, displacement)
    if drive.kind == "base" and find_waveform(drive).is_step and drive.displacement is not None:
        return starts.start_from_base_step(modes, drive.displacement)
    return starts.start_at_rest(modes)


def _extend_boundary_values(structure, modes: ModalBasis, values):
    """Append zeros for the modes of a reduced structure to the initial values of its boundary."""
    if structure.reduced is None or values is None:
        return values
    return np.append(np.asarray(values, float), np.zeros(len(modes.names) - len(values)))


def compute_named_motions(modes: ModalBasis, modal) -> np.ndarray:
    """Return the motions (k, p) [m] of the modes or masses that the scene names.

    `modal` (k, n) [m] are coordinates of `modes`.
    """
    return modal if modes.shapes is None else modal @ modes.shapes.T


def needs_band_displacements(scene) -> bool:
    """Return whether a mode of a scene yaws a face, whose bands of cells then have different displacements."""
    has_face = scene.contact is not None and scene.contact.area is not None
    return has_face and scene.friction is not None and bool(find_yaw_key(scene))


def compute_band_offsets(width: float) -> np.ndarray:
    """Return the distances y (N_YAW_BANDS,) [m] of the bands from the middle of a face of a width [m]."""
    return ((np.arange(N_YAW_BANDS) + 0.5) / N_YAW_BANDS - 0.5) * width


def compute_band_slides(modes: ModalBasis, offsets) -> np.ndarray:
    """Compute the relative displacement of each band per modal coordinate: slide - y yaw.

    A positive yaw turns +x towards +y, so that a piece at +y moves backwards. The friction forces f of
    the bands, which resist, exert the moment sum y f about +z on the upper piece.

    Parameters
    ----------
    modes : ModalBasis
        Modes of the rig, with their yaw.
    offsets : (s,) array_like
        Distance y [m] of each band from the middle of the patch.

    Returns
    -------
    (s, n) ndarray
    """
    yaw = np.zeros_like(modes.slide) if modes.yaw is None else modes.yaw
    return modes.slide - np.outer(offsets, yaw)
