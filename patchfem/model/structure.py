"""[structure] of a scene as a modal basis: from modes, masses or a file, with the drive's share and the start.

Where a number is wanted before anything runs (`plan`), the functions here give it for every description of the rig.
"""

from dataclasses import replace
from math import inf, pi

import numpy as np

from ..core import ModalBasis, PatchfemError, Start, frozen_array
from ..effects import has, module_of, waveform_of
from ..friction import record
from ..scene.keys.memoize import memoize
from ..structure import masses, starts
from ..structure.modes import basis
from . import structure_files, structure_reduced
from .law import build_interface_laws, load_of_scene


def modes_of(scene, own: ModalBasis | None = None) -> ModalBasis:
    """Coordinates of [structure] with a linear [structure.bonded] worked in; `base` is the drive's participation.

    own: what `own_modes` gives, where it is known.

    A moving base: each coordinate's share of its motion. A force: minus its share, with a(t) = F/basis.mass; it acts
    on drive.mass (structure.output_mass unless given), at the output of [[structure.mode]] and of a file without a
    force of its own. PatchfemError names what a file lacks.
    """
    found = _over_strips(scene, own_modes(scene) if own is None else own)
    if found.faces is not None and not len(found.faces):
        # nothing rubs: the output stands for a slide without friction
        found = replace(found, faces=None)
    bonded = scene.structure.bonded
    # interlocking is no spring: it acts in the march
    if bonded is None or bonded.wavelength is not None:
        return found
    if len(found.interfaces) != 1 and not scene.structure.mode:
        raise PatchfemError(
            f"{scene.where('structure.bonded')}: applies only to a single contact, but the rig has "
            f"{len(found.interfaces)} interfaces; instead write a spring between the two places that "
            "an interface joins"
        )
    return module_of("structure.bonded").add_spring(found, bonded.stiffness, bonded.damping)


def _instrumented(modes, found: ModalBasis) -> ModalBasis:
    """The basis with the accelerometer as its output and the gauge beside it, where [[structure.mode]] tells them
    apart."""
    felt, seen = (
        np.array([getattr(mode, key) for mode in modes], float)
        for key in ("accelerometer", "gauge")
    )
    if np.array_equal(felt, found.output) and np.array_equal(seen, found.output):
        return found
    return replace(
        found,
        output=frozen_array(felt),
        gauge=None if np.array_equal(felt, seen) else frozen_array(seen),
    )


def _over_strips(scene, found: ModalBasis) -> ModalBasis:
    """The basis with one face per strip, where modes yaw a patch in strips: the strip at y slides by slide - y yaw."""
    if not yaws(scene):
        return found
    count, width = scene.contact.strips.count, scene.contact.width
    offsets = (np.arange(count) + 0.5) * (width / count) - width / 2
    return replace(found, faces=frozen_array(strip_rows(found, offsets)))


def own_modes(scene, joint: float | None = None) -> ModalBasis:
    """Coordinates of [structure] without the bonded spring; of masses the eigenproblem is solved.

    joint: stiffness [N/m] of the contact, taken off modes that were measured with it; left out, that of the laws.
    """
    found = _as_given(scene)
    if scene.structure.measured == "free" or (joint is None and of_a_patch(scene)):
        return found
    bonded = scene.structure.bonded
    held = np.array([joint] if joint is not None else joints(scene))
    if bonded is not None and held.size:
        held[0] += bonded.stiffness
    try:
        return module_of("structure.bonded").remove_springs(
            found, held, 0.0 if bonded is None else bonded.damping
        )
    except PatchfemError as error:
        raise PatchfemError(
            f"{scene.where('structure.measured')}: {error}; give the frequencies of the bolted rig, "
            "give a softer joint, or leave `measured` out if the frequencies were measured without the "
            "joint"
        ) from None


def of_a_patch(scene) -> bool:
    """Whether the stiffness of the joint is that of a pressed patch, which its laws alone do not tell."""
    contact = scene.contact
    return (
        scene.friction is not None
        and contact is not None
        and bool(contact.compliance_key or contact.load is None)
    )


def joints(scene) -> list:
    """Stiffness [N/m] of every interface while nothing slips, of its law alone; PatchfemError of one that has none."""
    load, out = load_of_scene(scene), []
    for one in build_interface_laws(scene):
        try:
            out.append(stiffness_of(one, load if one.load is None else one.load))
        except PatchfemError as error:
            raise PatchfemError(f"{scene.where('structure.measured')}: {error}") from None
    return out


def stiffness_of(one, load: float) -> float:
    """Tangential stiffness [N/m] of an InterfaceLaw under a load [N]; PatchfemError where it has no one stiffness."""
    f = one.numbers
    held, curved = (
        record.held_stiffness(f, load),
        has(f.law, "bonds") and (f.order, f.reading) != (1, "stretch"),
    )
    if 0 < held < inf and not curved:
        return held
    why = (
        "sticks rigidly"
        if held == inf
        else "has no single stiffness"
        if curved
        else "has no stiffness"
    )
    raise PatchfemError(
        f"{one.key}: law '{f.law}' {why} in this scene, so its stiffness cannot be subtracted from the "
        "modes; add an elastic part ([contact.shear], or a law with a stiffness such as iwan), or give "
        "the modes without the joint",
        "structure.measured",
    )


def _as_given(scene) -> ModalBasis:
    """Coordinates of [structure] as it stands, without the bonded spring."""
    structure, drive = scene.structure, scene.drive
    forced = drive.kind == "force"
    if structure.mode:
        return _of_modes(structure, forced)
    if structure.masses:
        pairs, laterals = structure_reduced.pairs_of(structure)
        return masses.set_lateral_faces(
            masses.basis(
                structure.masses,
                [(s.between, s.stiffness) for s in structure.spring],
                [(d.between, d.coefficient) for d in structure.damper],
                pairs,
                structure.output_mass or 1,
                pushed_mass(structure, drive) if forced else None,
            ),
            laterals,
        )
    if structure.reduced is not None:
        return structure_reduced.found(scene)[0]
    return _read(scene)[0]


def richer_modes(scene) -> tuple:
    """(coordinates of a reduced [structure] with more modes than it keeps, None where no mode is left out; notes; how
    many modes there are at most, 0 of others)."""
    return (None, (), 0) if scene.structure.reduced is None else structure_reduced.found(scene)[1:]


@memoize
def _of_modes(structure, forced: bool) -> ModalBasis:
    """The basis of [[structure.mode]] under a force or a moving base."""
    found = basis(structure.mode, structure.moving_mass)
    if forced:
        found = replace(found, base=frozen_array(-found.output))
    return _instrumented(structure.mode, found)


def notes_of(scene) -> list:
    """Sentences for the user on a structure.file that was read otherwise than as it stands; [] without a file."""
    if scene.structure is None or scene.structure.file is None:
        return []
    return _read(scene)[1]


def _read(scene) -> tuple:
    """(basis, notes) of structure.file."""
    return structure_files.found_in_file(scene)


def pushed_mass(structure, drive) -> int:
    """The mass that a force drives or a release moves, from 1: drive.mass, or else structure.output_mass."""
    return drive.mass or structure.output_mass or 1


def start_state(scene, found: ModalBasis) -> Start:
    """Coordinates and rates at t = 0 in the basis of the scene.

    [structure.start] gives them per mode or mass. kind = "free": released at rest; with masses drive.mass alone is
    moved (structure.output_mass unless given), else the output by drive.displacement in the shape of a static force
    there. A base step in displacement leaves everything where it was. Otherwise at rest.
    """
    structure, drive = scene.structure, scene.drive
    if structure.start is not None:
        try:
            return starts.from_values(
                found,
                *(
                    _of_boundary(structure, found, values)
                    for values in (structure.start.displacement, structure.start.velocity)
                ),
            )
        except PatchfemError as error:
            text = str(error).removeprefix("structure.start: ")
            raise PatchfemError(f"{scene.where('structure.start')}: {text}") from None
    if drive.kind == "free":
        named = structure.masses is not None or drive.mass is not None
        if not named:
            return starts.from_output_displacement(found, drive.displacement)
        moved = np.zeros(len(found.names))
        if pushed_mass(structure, drive) > moved.size:
            raise PatchfemError(
                f"{scene.where('drive.mass')}: the rig has only {moved.size} coordinates"
            )
        moved[pushed_mass(structure, drive) - 1] = drive.displacement
        return starts.from_values(found, moved)
    if drive.kind == "base" and waveform_of(drive).is_step and drive.displacement is not None:
        return step_start(found, drive.displacement)
    return starts.at_rest(found)


def _of_boundary(structure, found: ModalBasis, values):
    """Values of a start, of a reduced structure those of its boundary with its modes at rest."""
    if structure.reduced is None or values is None:
        return values
    return np.append(np.asarray(values, float), np.zeros(len(found.names) - len(values)))


def step_start(found: ModalBasis, displacement: float) -> Start:
    """Start after the base has jumped by `displacement` [m]: nothing has moved yet, z = -displacement base."""
    return starts.from_base_step(found, displacement)


def motions(found: ModalBasis, modal) -> np.ndarray:
    """Motions (k, p) [m] of the scene's own modes or masses, from coordinates modal (k, n) [m] of the basis."""
    return modal if found.shapes is None else modal @ found.shapes.T


def frequencies(structure, modes: ModalBasis) -> np.ndarray:
    """Natural frequencies (n,) [Hz] of the coordinates, bonded spring included, rigid ones 0."""
    if structure.mode and structure.bonded is None and structure.measured == "free":
        return np.array([mode.frequency for mode in structure.mode])
    return modes.omega / (2 * pi)


def first_of(scene, found: ModalBasis) -> tuple:
    """Frequency [Hz] and mass [kg] of the first mode that is not rigid, without the bonded spring; 0 where all are
    rigid. found: what `own_modes` gives.

    mass: structure.moving_mass, or the modal mass at the output; where that mode leaves the output at rest, the mass of
    all coordinates. Masses and files have their modes in ascending order.
    """
    structure = scene.structure
    if structure.mode:
        given = (
            [mode.frequency for mode in structure.mode]
            if structure.measured == "free"
            else (found.omega / (2 * pi)).tolist()
        )
        return next((one for one in given if one > 0), 0.0), structure.moving_mass
    held = np.flatnonzero(found.omega > 0)
    k = held[0] if held.size else 0
    frequency = float(found.omega[k] / (2 * pi)) if held.size else 0.0
    share = found.output[k] ** 2
    reach = max(float(np.square(found.output).sum()), 1e-300)
    if structure.moving_mass is not None and structure.file is not None:
        return frequency, structure.moving_mass
    # round-off: it leaves the output at rest
    return frequency, float(found.mass / (share if share > 1e-12 * reach else reach))


def start_of(scene, modes: ModalBasis):
    """Start of a scene that does not begin at rest, else None; PatchfemError where it lies beyond structure.travel."""
    start, travel = start_state(scene, modes), scene.structure.travel
    if travel is not None and abs(float(modes.output @ start.z)) > travel:
        raise PatchfemError(
            f"{scene.where('structure.travel')}: the motion starts beyond this travel; raise "
            "structure.travel or start nearer to the middle"
        )
    return start if start.z.any() or start.v.any() else None


def yaws(scene) -> bool:
    """Whether strips slide each by themselves: modes that yaw the patch about its normal, over [contact.strips]."""
    strips = scene.contact is not None and scene.contact.strips is not None
    return strips and scene.friction is not None and any(mode.yaw for mode in scene.structure.mode)


def strip_rows(basis: ModalBasis, offsets) -> np.ndarray:
    """Slide (s, n) of strips at offsets y (s,) [m] from the middle: slide - y yaw.

    yaw > 0 turns +x to +y, so a piece at +y goes back. A moment about +z on the upper piece is sum y f of the friction
    f that resists.
    """
    yaw = np.zeros(basis.slide.size) if basis.yaw is None else basis.yaw
    return basis.slide - np.outer(offsets, yaw)


def acts(scene) -> bool:
    """Whether the load of a rig changes with its motion (modes with normal or pitch) or in time (normal.amplitude)."""
    if scene.friction is None and not scene.structure.interface:
        return False
    varies = scene.normal is not None and bool(scene.normal.amplitude)
    return varies or any(mode.normal or mode.pitch for mode in scene.structure.mode)
