"""Rules of [structure]: the rig is described once, masses exist, participations are possible."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from ..keys.tables import UNIVERSAL_EXTENSIONS, Tables
from ..keys.types import advise_on_name
from .facts import TableFacts
from .scene_draft import SceneDraft

ARRAY_EXTENSIONS = (".npz", ".mat")
MATRIX_KEYS = ("stiffness", "mass", "damping")  # keys of the files of [structure.reduced]
# Largest plausible damping ratio, at which a free oscillation decays to a few per cent within one
# cycle; a larger value probably has a wrong unit, because 1 % is 0.01.
MAX_USUAL_DAMPING = 0.5
# Keys that name places of a universal file
LOCATION_KEYS = ("slide_at", "output_at", "base_at", "force_at", "normal_at", "pitch_at")


def check_structure(draft: SceneDraft) -> None:
    """Report mistakes inside [structure] of a scene draft."""
    structure = TableFacts(draft, "structure", draft.tables.structure)
    if draft.tables.structure is None:
        return
    if not structure.has("moving_mass", "masses", "file", "reduced"):
        structure.add_missing("moving_mass")
    _check_modes(structure)
    _check_numbered_places(structure)
    if structure.file:
        _check_file(structure)
    if structure.reduced:
        _check_reduced(structure)
    _check_joint(structure)
    _check_start(structure)


def _check_file(structure: TableFacts) -> None:
    """Report a structure.file whose extension is not supported, and keys that do not apply to such a file."""
    extension = Path(structure.file).suffix.lower()
    if extension not in (*ARRAY_EXTENSIONS, *UNIVERSAL_EXTENSIONS):
        advice = advise_on_name(extension, (*ARRAY_EXTENSIONS, ".uff"))
        structure.add_mistake(
            "file",
            f"{_describe_extension(extension)}; {advice}: matrices as arrays, or universal files",
        )

    # The arrays of a file have names, the places of a universal file have keys.
    if extension not in UNIVERSAL_EXTENSIONS:
        keys = LOCATION_KEYS if extension in ARRAY_EXTENSIONS else ()
        for key in filter(structure.has, keys):
            array = key.removesuffix("_at")
            structure.add_mistake(
                key,
                f"names a place in a universal file; a {extension} file contains the array {array}",
            )
        return

    # What a universal file does not say.
    if not structure.has("moving_mass"):
        structure.add_missing(
            "moving_mass", "the modes of a universal file are scaled to this mass"
        )
    if not structure.has("slide_at"):
        structure.add_missing(
            "slide_at", 'the node and direction that slide, such as slide_at = "12:+x"'
        )
    if structure.has("interface"):
        structure.add_mistake(
            "interface", "a universal file has nodes, not masses; use slide_at with [friction]"
        )


def _check_joint(structure: TableFacts) -> None:
    """Report a bonded spring of a structure that has no interface or several, and a stiffness of the wrong interface."""
    n_interfaces = len(tuple(structure.interface))
    if structure.has("measured_stiffness") and n_interfaces > 1:
        structure.add_mistake(
            "measured_stiffness",
            f"applies only to a single contact, but there are {n_interfaces} interfaces; give each of them its own "
            "structure.interface.measured_stiffness",
        )
    for index in range(n_interfaces):
        if not structure.has(f"interface.{index}.measured_stiffness"):
            continue
        if structure.measured != "stuck":
            instead = 'structure.measured = "stuck"'
        elif n_interfaces == 1:
            instead = "structure.measured_stiffness in its place"
        else:
            continue
        structure.add_mistake(
            f"interface.{index}.measured_stiffness",
            f"is for a structure of several interfaces whose modes were measured with the joint; give {instead}",
        )
    if structure.bonded and structure.table.masses is not None and n_interfaces != 1:
        structure.add_mistake(
            "bonded",
            f"applies only to a single contact, but there are {n_interfaces} interfaces; instead write a "
            "[[structure.spring]] between the masses of the interface",
        )


def _check_reduced(structure: TableFacts) -> None:
    """Report wrong coordinates of [structure.reduced].

    Parameters
    ----------
    structure : TableFacts
        Table [structure] with the table [structure.reduced].
    """
    reduced = structure.reduced

    # Coordinates of the boundary, of the base and of the joint.
    boundary = tuple(reduced.boundary)
    for k, name in enumerate(boundary):
        if name in boundary[:k]:
            structure.add_mistake(
                "reduced.boundary", f"names {name} twice; name each coordinate once"
            )
            break
    is_rubbing = structure.draft.has("friction") and not structure.has("interface")
    if is_rubbing and not structure.has("reduced.slide"):
        structure.add_missing(
            "reduced.slide",
            "which two boundary coordinates rub against each other, such as slide = [1, 0] for coordinate 1 against "
            "the base (0); or write [[structure.interface]] with its own law",
        )


def _describe_extension(extension: str) -> str:
    """Say in a message which extension a file has that cannot be read."""
    return f"the name ends in '{extension}'" if extension else "the name has no extension"


def _check_modes(structure: TableFacts) -> None:
    """Report modes of a structure with equal names, and participations in the base motion above 1.

    Unusually high damping gets a remark.
    """
    names: set[str] = set()
    squares = []
    for index, mode in enumerate(structure.mode):
        path = f"mode.{index}"
        if mode.name in names:
            structure.add_mistake(
                f"{path}.name", f"two modes are named '{mode.name}'; give each its own name"
            )
        if mode.name:
            names.add(mode.name)
        if mode.damping >= MAX_USUAL_DAMPING:
            structure.add_remark(
                f"{path}.damping",
                f"= {mode.damping:g} is a damping ratio: 1 means critical damping, and 1 % is written 0.01",
            )
        # Participation in the base motion: that of the first mode is the one in the sliding unless it is given.
        default = 0.0 if index else mode.slide
        base = mode.base if structure.has(f"{path}.base") else default
        squares.append((base or 0.0) ** 2)

    if sum(squares) > 1 + 1e-9:  # round-off of the mode shapes can cause this excess
        path = f"mode.{squares.index(max(squares))}"
        key = "base" if structure.has(f"{path}.base") else "slide"
        structure.add_mistake(
            f"{path}.{key}",
            f"the sum of `base`^2 over the modes is {sum(squares):.6g}, but at most 1 is possible (`base` is the "
            "participation of a mode in the base motion; for the first mode, `base` = `slide` unless given)",
        )


def check_energy_gain(draft: SceneDraft, kind: str) -> None:
    """Report modes of a draft that gain energy in a scene without friction (of the kind "linear")."""
    for index, mode in enumerate(draft.values.structure.mode if kind == "linear" else ()):
        if mode.damping < 0:
            draft.add_mistake(
                f"structure.mode.{index}.damping",
                f"{mode.damping:g} is negative damping, and without friction the motion would grow for ever; add "
                "[friction], or set damping >= 0",
            )


def default_output(index: int) -> float:
    """Return the default of `output` of the mode with this index: the first mode alone moves the output point."""
    return 0.0 if index else 1.0


def describe_mode_defaults(tables: Tables) -> list[str]:
    """Return a sentence on each mode whose default of `output` or `base` decides what a drive or sensor does.

    The default of `output` is 1 for the first mode, which matters if a force drives the output point, and 0 for the
    others, which matters for those that slide and have no sensor key. The default of `base` is `slide` for the first
    mode, which matters if the base moves. `tables` are those of the scene.
    """
    modes = tables.structure.mode if tables.structure is not None else ()
    drive = tables.drive
    kind = drive.kind if drive is not None else ""
    sentences = []

    # The first mode alone moves the output by default.
    for mode in modes[:1]:
        if mode.output is None and kind == "force":
            sentences.append(
                f"the force acts at the output point, which moves by 1 per unit of the coordinate of mode '{mode.name}' "
                f"(default of `output`); the patch moves by {mode.slide:g} (`slide`)"
            )
        if mode.base is None and kind == "base" and mode.slide != 1:
            sentences.append(
                f"the base drives mode '{mode.name}' with the participation {mode.slide:g}, its `slide` (default of "
                "`base`); give `base` if it differs"
            )

    for mode in modes[1:]:
        if mode.slide and (mode.output, mode.accelerometer, mode.gauge) == (None, None, None):
            sentence = (
                f"mode '{mode.name}' does not move the output point (`output` is 0 by default)"
            )
            if kind == "base" and mode.base is None:
                sentence += (
                    ", and the base motion does not drive this mode (`base` is 0 by default)"
                )
            sentences.append(sentence)
    return sentences


def find_instrument_key(draft: SceneDraft) -> str:
    """Return the key of the first sensor of a draft that moves unlike the output, "" if there is none."""
    for index, mode in enumerate(draft.values.structure.mode):
        output = default_output(index) if mode.table.output is None else mode.output
        for key in ("accelerometer", "gauge"):
            if getattr(mode.table, key) is not None and mode[key] != output:
                return f"structure.mode.{index}.{key}"
    return ""


class CoordinateNumbers(NamedTuple):
    """Coordinates to which the numbers in `between` and `mass` refer.

    - values: masses or boundary coordinates; () if there are none, or if they are not known.
    - noun: "mass" or "boundary coordinate".
    - key: key that lists them.
    """

    values: tuple[Any, ...]
    noun: str
    key: str


def _find_coordinates(structure: TableFacts) -> CoordinateNumbers:
    """Return the coordinates to which the numbers in a table [structure] refer."""
    if structure.reduced:
        boundary = tuple(structure.reduced.boundary)
        return CoordinateNumbers(boundary, "boundary coordinate", "structure.reduced.boundary")
    return CoordinateNumbers(tuple(structure.masses), "mass", "structure.masses")


def _iterate_numbered_places(structure: TableFacts) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield each key of a structure that names masses or coordinates by number, with the numbers.

    The number 0 stands for the base.
    """
    for name in ("spring", "damper", "interface"):
        for index, item in enumerate(structure[name]):
            yield f"structure.{name}.{index}.between", tuple(item.between)
    yield "structure.reduced.slide", tuple(structure.reduced.slide)
    yield "structure.output_mass", (structure.output_mass or 0,)
    drive = structure.scene.drive
    if drive.kind != "base" and not structure.has("mode"):
        yield "drive.mass", (drive.mass or 0,)


def _check_numbered_places(structure: TableFacts) -> None:
    """Report masses or coordinates that a structure does not have, and pairs that join one to itself."""
    values, noun, list_key = _find_coordinates(structure)
    for key, numbers in _iterate_numbered_places(structure):
        base = "; 0 stands for the base" if len(numbers) == 2 else ""
        if len(numbers) == 2 and numbers[0] == numbers[1]:
            place = f"{noun} {numbers[0]}" if numbers[0] else "the base"
            structure.draft.add_mistake(
                key, f"joins {place} to itself; two different ends are needed{base}"
            )
        for number in dict.fromkeys(numbers):
            if values and number > len(values):
                structure.draft.add_mistake(
                    key,
                    f"there is no {noun} {number}: {list_key} has {len(values)}, numbered from 1{base}",
                )


def _check_start(structure: TableFacts) -> None:
    """Report initial values of a structure that are not one for each mode, mass or coordinate."""
    coordinates = _find_coordinates(structure)
    if coordinates.values:
        count = len(coordinates.values)
        noun = coordinates.noun
    else:
        count = len(tuple(structure.mode))
        noun = "mode"
    for key in ("displacement", "velocity"):
        n_values = len(tuple(structure.start[key]))
        if n_values and count and n_values != count:
            structure.add_mistake(
                f"start.{key}",
                f"the number of values is {n_values}, but one value for each {noun} is needed, in the same order: "
                f"{count}",
            )
