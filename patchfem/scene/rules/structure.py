"""Rules of [structure]: the rig is described once, masses exist, participations are possible."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any, NamedTuple

from ..keys.removed import describe_removed
from ..keys.tables import Tables
from ..keys.types import advise_on_name
from .rule_table import MissingKeyRule, MistakeRule, RemarkRule, TableFacts, apply_rules
from .scene_draft import SceneDraft

ARRAY_EXTENSIONS = (".npz", ".mat")
UNIVERSAL_EXTENSIONS = (".uff", ".unv")
# File extensions of matrices from finite-element programs, for [structure.reduced].
MATRIX_KEYS = ("stiffness", "mass", "damping")  # keys of the files of [structure.reduced]
MATRIX_EXTENSIONS = (".mtx", ".mat", ".npz")
# Largest plausible damping ratio, at which a free oscillation decays to a few per cent within one
# cycle; a larger value probably has a wrong unit, because 1 % is 0.01.
MAX_USUAL_DAMPING = 0.5
LOCATION_KEYS = ("slide_at", "output_at", "base_at", "force_at", "normal_at", "pitch_at")
# What describes a rig of masses in a scene with [contact].
MODES_ADVICE = (
    "with [contact], describe these masses and springs by their modes: give structure.moving_mass, and for each mode a "
    "[[structure.mode]] with its frequency (sqrt(k/m)/(2 pi) for one mass on one spring)"
)
# Keys that describe a rig; a scene has one of them.
DESCRIPTION_KEYS = ("mode", "masses", "file", "reduced")


class CoordinateNumbers(NamedTuple):
    """Coordinates to which the numbers in `between` and `mass` refer.

    - number: number of masses or boundary coordinates; None if there are none, or if their number is not
      known.
    - noun: "mass" or "boundary coordinate".
    - key: key that lists them.
    """

    number: int | None
    noun: str
    key: str

    @classmethod
    def from_structure(cls, structure: Any) -> CoordinateNumbers:
        """Return the coordinates to which the numbers in a table [structure] refer."""
        if structure.reduced is not None:
            number = len(structure.reduced.boundary or ()) or None
            return cls(number, "boundary coordinate", "structure.reduced.boundary")
        number = len(structure.masses) if structure.masses is not None else None
        return cls(number, "mass", "structure.masses")


class StructureFacts(TableFacts):
    """Properties of the scene that the checks of [structure] use."""

    @cached_property
    def descriptions(self) -> list[str]:
        """Keys of DESCRIPTION_KEYS that the scene sets."""
        return [key for key in DESCRIPTION_KEYS if self.has(key)]

    @property
    def description(self) -> str:
        """Description of the structure if there is exactly one, or "" otherwise."""
        return self.descriptions[0] if len(self.descriptions) == 1 else ""

    @property
    def is_universal(self) -> bool:
        """Whether structure.file is a universal file."""
        return self.extension in UNIVERSAL_EXTENSIONS

    @property
    def repeated_coordinate(self) -> Any:
        """Boundary coordinate that is named twice, or None if there is none."""
        boundary = self.table.reduced.boundary or ()
        return next((name for k, name in enumerate(boundary) if name in boundary[:k]), None)

    @property
    def extension(self) -> str:
        """Extension of structure.file in lower case, or "" if there is no file."""
        return find_file_extension(self.file) if self.file else ""

    @property
    def extension_advice(self) -> str:
        """Advice on an extension of structure.file that cannot be read."""
        return advise_on_name(self.extension, (*ARRAY_EXTENSIONS, ".uff"))

    @property
    def n_interfaces(self) -> int:
        """Number of interfaces that could be read."""
        return len(tuple(self.interface))


DESCRIPTION_RULES = (
    MistakeRule(
        lambda s: s.table.masses == (),
        "structure.masses",
        'at least one mass is needed, such as masses = ["1 kg"]',
    ),
    MistakeRule(
        lambda s: s.scene.drive.mass and s.scene.drive.kind != "base" and s.has("mode"),
        "drive.mass",
        "applies only to structure.masses, but a structure of [[structure.mode]] is driven at its output point: "
        "leave drive.mass out",
    ),
    MissingKeyRule(
        lambda s: not s.has("moving_mass") and s.descriptions in ([], ["mode"]),
        "structure.moving_mass",
        "",
    ),
    *(
        MistakeRule(
            lambda s, key=key: s.has(key) and not s.has("masses") and s.draft.has("contact"),
            f"structure.{key}",
            f"joins masses, which cannot be used with [contact]; {MODES_ADVICE}",
        )
        for key in ("spring", "damper")
    ),
    *(
        MissingKeyRule(
            lambda s, key=key: s.has(key) and not s.has("masses") and not s.draft.has("contact"),
            "structure.masses",
            f"structure.{key} needs this key",
        )
        for key in ("spring", "damper")
    ),
    *(
        MistakeRule(
            lambda s, key=key: s.has(key) and not s.has("file"),
            f"structure.{key}",
            "names a place in a file of modes or responses, but the scene has no such file; give structure.file",
        )
        for key in LOCATION_KEYS
    ),
    RemarkRule(
        lambda s: s.descriptions in (["masses"], ["reduced"]) and s.has("moving_mass"),
        "structure.moving_mass",
        "has no meaning with structure.{description} and is not used",
    ),
)
FILE_RULES = (
    MistakeRule(
        lambda s: s.file and s.extension not in (*ARRAY_EXTENSIONS, *UNIVERSAL_EXTENSIONS),
        "structure.file",
        "the name ends in '{extension}'; {extension_advice}: matrices or modes as arrays, or universal files",
    ),
    *(
        MistakeRule(
            lambda s, key=key: s.file and not s.is_universal and s.has(key),
            f"structure.{key}",
            f"names a place in a universal file; a {{extension}} file contains the array {key.removesuffix('_at')}",
        )
        for key in LOCATION_KEYS
    ),
    MissingKeyRule(
        lambda s: s.is_universal and not s.has("moving_mass"),
        "structure.moving_mass",
        "the modes of a universal file are scaled to this mass",
    ),
    MissingKeyRule(
        lambda s: s.is_universal and not s.has("slide_at"),
        "structure.slide_at",
        'the node and direction that slide, such as slide_at = "12:+x"',
    ),
    MistakeRule(
        lambda s: s.is_universal and s.has("interface"),
        "structure.interface",
        "a universal file has nodes, not masses; use slide_at with [friction]",
    ),
)
JOINT_RULES = (
    MistakeRule(
        lambda s: s.bonded and s.table.masses is not None and s.n_interfaces != 1,
        "structure.bonded",
        "applies only to a single contact, but there are {n_interfaces} interfaces; instead write a "
        "[[structure.spring]] between the masses of the interface",
    ),
    MistakeRule(
        lambda s: s.measured_joint and s.measured != "stuck",
        "structure.measured_joint",
        'names the joint that is subtracted from the modes, but nothing is subtracted; add measured = "stuck" or leave '
        "`measured_joint` out",
    ),
    MistakeRule(
        lambda s: s.measured == "stuck" and not (s.scene.friction or s.interface),
        "structure.measured",
        "'stuck' subtracts the stiffness of the joint from the modes, but this scene has no joint; add [friction] and "
        "its load, or leave `measured` out",
    ),
)
REDUCED_RULES = (
    MistakeRule(
        lambda s: s.repeated_coordinate,
        "structure.reduced.boundary",
        "names {repeated_coordinate} twice; name each coordinate once",
    ),
    RemarkRule(
        lambda s: s.reduced.moved and s.scene.drive.kind in ("force", "free"),
        "structure.reduced.moved",
        "is not used, because it applies only to a base drive",
    ),
    MistakeRule(
        lambda s: s.has("interface") and s.reduced.slide,
        "structure.reduced.slide",
        "applies only to [friction]; a [[structure.interface]] names its two sides with the key `between`: leave "
        "structure.reduced.slide out",
    ),
    MissingKeyRule(
        lambda s: not s.has("interface") and s.draft.has("friction") and not s.reduced.slide,
        "structure.reduced.slide",
        "which two boundary coordinates rub against each other, such as slide = [1, 0] for coordinate 1 against the "
        "base (0); or write [[structure.interface]] with its own law",
    ),
)


def check_structure(draft: SceneDraft) -> None:
    """Report mistakes inside [structure]."""
    structure = draft.tables.structure
    if structure is None:
        return
    facts = StructureFacts(draft, "structure", structure)
    apply_rules(draft, DESCRIPTION_RULES, facts)
    _check_modes(draft)
    _check_numbered_places(draft)
    apply_rules(draft, FILE_RULES, facts)
    if structure.reduced is not None:
        _check_matrix_files(draft)
        apply_rules(draft, REDUCED_RULES, facts)
    apply_rules(draft, JOINT_RULES, facts)
    if structure.start is not None:
        _check_start(draft)


def _check_modes(draft: SceneDraft) -> None:
    """Report modes of equal name, too much damping, and participation factors that are impossible."""
    modes = draft.values.structure.mode
    names: set[str] = set()
    for index, mode in enumerate(modes):
        if mode.name in names:
            draft.add_mistake(
                f"structure.mode.{index}.name",
                f"two modes are named '{mode.name}'; give each its own name",
            )
        if mode.name:
            names.add(mode.name)
        if mode.damping >= MAX_USUAL_DAMPING:
            draft.add_remark(
                f"structure.mode.{index}.damping",
                f"= {mode.damping:g} is a damping ratio: 1 means critical damping, and 1 % is written 0.01",
            )
    _check_base(draft, modes)


def _check_base(draft: SceneDraft, modes: tuple) -> None:
    """Report participations in the base motion whose squares add up to more than 1."""
    squares = []
    for index, mode in enumerate(modes):
        default = 0.0 if index else mode.slide
        base = mode.base if draft.has(f"structure.mode.{index}.base") else default
        squares.append((base or 0.0) ** 2)
    if sum(squares) > 1 + 1e-9:  # round-off of the mode shapes can cause this excess
        table_key = f"structure.mode.{squares.index(max(squares))}"
        key = "base" if draft.has(f"{table_key}.base") else "slide"
        draft.add_mistake(
            f"{table_key}.{key}",
            f"the sum of `base`^2 over the modes is {sum(squares):.6g}, but at most 1 is possible (`base` is the "
            "participation of a mode in the base motion; for the first mode, `base` = `slide` unless given)",
        )


def check_energy_gain(draft: SceneDraft, kind: str) -> None:
    """Report modes that gain energy in a scene without friction."""
    modes = draft.values.structure.mode if kind == "linear" else ()
    for index, mode in enumerate(modes):
        if mode.damping < 0:
            draft.add_mistake(
                f"structure.mode.{index}.damping",
                f"{mode.damping:g} is negative damping, and without friction the motion would grow for ever; add "
                "[friction], or set damping >= 0",
            )


def default_output(index: int) -> float:
    """Return the default of `output` of the mode with this index: the first mode alone moves the output point."""
    return 0.0 if index else 1.0


def describe_default_outputs(tables: Tables) -> list[str]:
    """Return a sentence about each mode whose default of `output` decides what a drive or a sensor does.

    These are the first mode under a force, which acts at the output point, and other modes that slide.
    """
    structure = tables.structure
    drive = tables.drive
    sentences = []
    first = structure.mode[0] if structure is not None and structure.mode else None
    if first is not None and first.output is None and drive is not None and drive.kind == "force":
        sentences.append(
            f"the force acts at the output point, which moves by 1 per unit of the coordinate of mode '{first.name}' "
            f"(default of `output`); the patch moves by {first.slide:g} (`slide`)"
        )
    for mode in structure.mode[1:] if structure is not None else ():
        if mode.slide and (mode.output, mode.accelerometer, mode.gauge) == (None, None, None):
            sentence = (
                f"mode '{mode.name}' does not move the output point (`output` is 0 by default)"
            )
            if drive is not None and drive.kind == "base" and mode.base is None:
                sentence += (
                    ", and the base motion does not drive this mode (`base` is 0 by default)"
                )
            sentences.append(sentence)
    return sentences


def find_instrument_key(draft: SceneDraft) -> str:
    """Return the key of the first sensor whose motion differs from that of the output, or "" if there is none."""
    for index, mode in enumerate(draft.values.structure.mode):
        output = default_output(index) if mode.table.output is None else mode.output
        for key in ("accelerometer", "gauge"):
            if getattr(mode.table, key) is not None and mode[key] != output:
                return f"structure.mode.{index}.{key}"
    return ""


def _iterate_numbered_places(draft: SceneDraft) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Yield each key that names masses or boundary coordinates by number, with the numbers."""
    structure = draft.values.structure
    for name in ("spring", "damper", "interface"):
        for index, item in enumerate(structure[name]):
            yield f"structure.{name}.{index}.between", item.between
    yield "structure.reduced.slide", structure.reduced.slide
    yield "structure.output_mass", (structure.output_mass or 0,)
    if draft.values.drive.kind != "base" and not draft.has("structure.mode"):
        yield "drive.mass", (draft.values.drive.mass or 0,)


def _check_numbered_places(draft: SceneDraft) -> None:
    """Report masses or boundary coordinates that do not exist, and pairs that join one of them to itself."""
    coordinates = CoordinateNumbers.from_structure(draft.tables.structure)
    for key, numbers in _iterate_numbered_places(draft):
        numbers = tuple(numbers)
        base = "; 0 stands for the base" if len(numbers) == 2 else ""
        if len(numbers) == 2 and numbers[0] == numbers[1]:
            place = f"{coordinates.noun} {numbers[0]}" if numbers[0] else "the base"
            draft.add_mistake(key, f"joins {place} to itself; two different ends are needed{base}")
        for number in dict.fromkeys(numbers):
            if coordinates.number and number > coordinates.number:
                draft.add_mistake(
                    key,
                    f"there is no {coordinates.noun} {number}: {coordinates.key} has {coordinates.number}, numbered "
                    f"from 1{base}",
                )


def _check_matrix_files(draft: SceneDraft) -> None:
    """Report files of [structure.reduced] that cannot be read by their extension."""
    reduced = draft.tables.structure.reduced
    for key in MATRIX_KEYS:
        file = getattr(reduced, key)
        if isinstance(file, str) and find_file_extension(file) not in MATRIX_EXTENSIONS:
            extension = find_file_extension(file)
            advice = advise_on_name(extension, MATRIX_EXTENSIONS)
            if extension in (".op4", ".pch", ".bdf", ".dat"):
                removed = describe_removed("files of Nastran", "reading files of Nastran")
                advice = f"{removed}; {advice}"
            draft.add_mistake(
                f"structure.reduced.{key}", f"the name ends in '{extension}'; {advice}"
            )


def find_file_extension(name: str) -> str:
    """Return the extension of a file name in lower case, with its dot."""
    return "." + name.rpartition(".")[2].lower()


def _check_start(draft: SceneDraft) -> None:
    """Report missing initial values, and lists without one value for each mode or mass."""
    structure = draft.tables.structure
    count = CoordinateNumbers.from_structure(structure).number or len(structure.mode or ())
    noun = "mode" if count == 1 else "modes"
    if structure.reduced is not None:
        noun = "boundary coordinates"
    elif structure.masses:
        noun = "mass" if count == 1 else "masses"
    for key in ("displacement", "velocity"):
        values = getattr(structure.start, key)
        if values is not None and count and len(values) != count:
            plural = "s" if len(values) > 1 else ""
            draft.add_mistake(
                f"structure.start.{key}",
                f"{len(values)} value{plural} for {count} {noun}; give one value for each, in the same order",
            )
