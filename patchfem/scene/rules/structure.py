"""Rules of [structure]: one description of the rig, masses that exist, shares of the base that are possible."""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

from ...effects import not_supported_message, waveform_of
from ..keys.types import choices
from .scene_draft import Draft

MATRICES, MEASURED = (".npz", ".mat"), (".uff", ".unv")
# matrices of finite-element programs
REDUCED = (
    ".mtx",
    ".mat",
    ".npz",
    ".op4",
    ".pch",
    ".bdf",
    ".dat",
)
HEAVY = 0.5  # damping ratio from which a mode hardly swings: seldom meant
PLACES = ("slide_at", "output_at", "base_at", "force_at", "normal_at", "pitch_at")


def check_structure(draft: Draft) -> None:
    """Say every mistake of [structure] by itself."""
    structure = draft.tables.structure
    if structure is None:
        return
    forms = [
        key for key in ("mode", "masses", "file", "reduced") if draft.given(f"structure.{key}")
    ]
    if len(forms) > 1:
        draft.say(
            f"structure.{forms[1]}",
            f"{' and '.join(forms)} exclude each other: keep one description of the rig",
        )
    if not forms:
        draft.lacks("structure.mode", "at least one [[structure.mode]] is needed; a mass on a spring is a mode with "
                                      "the frequency sqrt(k/m)/(2 pi)")  # fmt: skip
    if not draft.given("structure.moving_mass") and forms in ([], ["mode"]):
        draft.lacks("structure.moving_mass", "")
    for key in ("spring", "damper", "output_mass"):
        if not {"masses", *(["reduced"] if key == "output_mass" else [])} & set(
            forms
        ) and draft.given(f"structure.{key}"):
            if draft.given("contact") and key != "output_mass":
                draft.say(
                    f"structure.{key}",
                    f"joins masses, which cannot be used with [contact]; {modes_instead(draft)}",
                )
            else:
                draft.lacks("structure.masses", f"structure.{key} needs this key")
    if not {"masses", "file", "reduced"} & set(forms) and draft.given("structure.interface"):
        draft.lacks(
            "structure.masses",
            "structure.interface needs this key, or structure.file or [structure.reduced]",
        )
    for key in PLACES:
        if "file" not in forms and draft.given(f"structure.{key}"):
            draft.say(
                f"structure.{key}",
                "names a place in a file of modes or responses, but the scene has no such "
                "file; give structure.file",
            )
    if forms in (["masses"], ["reduced"]) and draft.given("structure.moving_mass"):
        draft.remark(
            f"structure.moving_mass has no meaning with structure.{forms[0]} and is not used"
        )
    _modes(draft)
    _masses(draft, structure)
    _file(draft, structure)
    _reduced(draft, structure.reduced)
    _bonded(draft, structure)
    if structure.measured == "stuck":
        _bolted(draft, structure)
    _start(draft, structure)


def modes_instead(draft: Draft) -> str:
    """What to write beside [contact] instead of masses: one mass on springs to the base is the mode sqrt(k/m)/(2 pi)
    with the damping ratio c/(2 sqrt(k m)), in numbers where all of them are there."""
    structure = draft.tables.structure
    masses = structure.masses or (structure.moving_mass,)
    springs, dampers = ([(one.between, getattr(one, value)) for one in getattr(structure, name) or ()]
                        for name, value in (("spring", "stiffness"), ("damper", "coefficient")))  # fmt: skip
    k, c = (sum(value or 0.0 for _, value in one) for one in (springs, dampers))
    pairs = [sorted(pair) if pair else None for pair, _ in springs + dampers]
    if len(masses) != 1 or not masses[0] or not k or pairs != [[0, 1]] * len(pairs):
        return (
            "with [contact], describe these masses and springs by their modes: give structure.moving_mass, and for "
            "each mode a [[structure.mode]] with its frequency (sqrt(k/m)/(2 pi) for one mass on one spring)"
        )
    frequency, ratio = sqrt(k / masses[0]) / (2 * pi), c / (2 * sqrt(k * masses[0]))
    damping = f"damping = {ratio:.3g} (c/(2 sqrt(k m)))" if dampers else "its damping ratio"
    return (
        f'with [contact], give structure.moving_mass = "{masses[0]:g} kg" and a [[structure.mode]] with '
        f'frequency = "{frequency:.6g} Hz" (sqrt(k/m)/(2 pi)), {damping} and `slide` = 1.0'
    )


def _modes(draft: Draft) -> None:
    modes = draft.tables.structure.mode or ()
    names: set[str] = set()
    for index, mode in enumerate(modes):
        if mode.name is not None and mode.name in names:
            draft.say(
                f"structure.mode.{index}.name",
                f"two modes are named '{mode.name}'; give each its own name",
            )
        names.add(mode.name)
        if mode.damping is not None and mode.damping >= HEAVY:
            key = draft.shown(f"structure.mode.{index}.damping")
            draft.remark(
                f"{key} = {mode.damping:g} is a damping ratio: 1 means critical damping, and 1 % is written "
                "0.01"
            )
    _instruments(draft, modes)
    bases = [mode.base if draft.given(f"structure.mode.{index}.base") else 0.0 if index else mode.slide
             for index, mode in enumerate(modes)]  # fmt: skip
    squares = [(base or 0.0) * (base or 0.0) for base in bases]
    if sum(squares) > 1 + 1e-9:
        at = f"structure.mode.{squares.index(max(squares))}"
        key = f"{at}.base" if draft.given(f"{at}.base") else f"{at}.slide"
        draft.say(key, f"the sum of `base`^2 over the modes is {sum(squares):.6g}, but at most 1 is possible (`base` "
                       "is the participation of a mode in the base motion; for the first mode, `base` = `slide` unless "
                       "given)")  # fmt: skip


def check_gains(draft: Draft, kind: str) -> None:
    """A mode that gains energy stands beside friction, which takes it."""
    structure = draft.tables.structure
    for index, mode in enumerate(
        (structure.mode or ()) if structure is not None and kind == "linear" else ()
    ):
        if mode.damping is not None and mode.damping < 0:
            draft.say(
                f"structure.mode.{index}.damping",
                f"{mode.damping:g} is negative damping, and without friction "
                "the motion would grow for ever; add [friction], or set "
                "damping >= 0",
            )


def unseen(structure, driven: bool) -> list:
    """Sentences on modes that slide and, by a default, do not move the output; driven: the base drives the rig."""
    out = []
    for mode in (structure.mode or ())[1:] if structure is not None else ():
        if mode.slide and (mode.output, mode.accelerometer, mode.gauge) == (None, None, None):
            still = (
                (", and the base motion does not drive this mode (`base` is 0 by default)")
                if driven and mode.base is None
                else ""
            )
            out.append(
                f"mode '{mode.name}' does not move the output point (`output` is 0 by default){still}"
            )
    return out


def _instruments(draft: Draft, modes: tuple) -> None:
    """An accelerometer or a gauge that moves as the output does not stands beside what is judged at the output."""
    written = []
    for k, mode in enumerate(modes):
        output = mode.output if mode.output is not None else mode.slide if k == 0 else 0.0
        written += [
            f"structure.mode.{k}.{key}"
            for key in ("accelerometer", "gauge")
            if getattr(mode, key) not in (None, output)
        ]
    drive = draft.tables.drive
    if not written:
        return
    beside = next(
        (key for key in ("structure.travel", "structure.stiffening") if draft.given(key)), ""
    )
    if drive is not None and not beside:
        steady = draft.tables.accuracy is not None and draft.tables.accuracy.method == "harmonic"
        waveform = waveform_of(drive)
        beside = (
            "drive.kind = 'free'"
            if drive.kind == "free"
            else f"drive.waveform = '{drive.waveform}'"
            if (waveform.is_swept or waveform.has_levels) and not steady
            else ""
        )
    if beside:
        draft.say(
            written[0],
            not_supported_message(
                f"with {beside}", "give `accelerometer` and `gauge` the value of `output`"
            ),
        )


def _masses(draft: Draft, structure: Any) -> None:
    """Every spring, damper, interface and named mass must stand between masses that exist."""
    count = _numbered(structure)
    if structure.masses is not None and not structure.masses:
        draft.say("structure.masses", 'at least one mass is needed, such as masses = ["1 kg"]')
        return
    for name in ("spring", "damper", "interface"):
        for index, item in enumerate(getattr(structure, name) or ()):
            _between(draft, f"structure.{name}.{index}.between", item.between, count)
    for index, item in enumerate(structure.interface or ()):
        _lateral(draft, f"structure.interface.{index}.lateral", item, count)
    _known(draft, "structure.output_mass", structure.output_mass, count)


def _numbered(structure: Any) -> int | None:
    """Number of masses, or of boundary coordinates of a reduced structure; None of any other rig."""
    if structure.reduced is not None:
        return len(structure.reduced.boundary) if structure.reduced.boundary else None
    return len(structure.masses) if structure.masses is not None else None


def _between(draft: Draft, key: str, pair: Any, count: int | None) -> None:
    if pair is None:
        return
    what = "mass" if draft.tables.structure.reduced is None else "boundary coordinate"
    if pair[0] == pair[1]:
        draft.say(
            key,
            f"joins {'the base' if pair[0] == 0 else f'{what} {pair[0]}'} to itself; two different ends are "
            "needed, where 0 stands for the base",
        )
    for one in dict.fromkeys(pair):
        _known(draft, key, one, count)


def _lateral(draft: Draft, key: str, interface: Any, count: int | None) -> None:
    """A second direction is a pair of its own, of coordinates that the first has not."""
    pair, first = interface.lateral, interface.between
    _between(draft, key, pair, count)
    if pair is None:
        return
    if first is not None and (both := sorted({*pair} & {*first} - {0})):
        what = "mass" if draft.tables.structure.reduced is None else "boundary coordinate"
        draft.say(
            key,
            f"{what} {both[0]} is already in `between`; the second direction needs coordinates of its own, "
            "which must move at right angles to the coordinates of `between`",
        )
    if draft.given("structure.file"):
        draft.say(
            key,
            not_supported_message(
                "with structure.file",
                "use structure.masses or [structure.reduced], or leave this key out",
            ),
        )
    if draft.given("structure.bonded"):
        draft.say(
            key,
            not_supported_message(
                "with [structure.bonded]",
                "write a [[structure.spring]] between the same places"
                if draft.given("structure.masses")
                else "either",
            ),
        )


def _known(draft: Draft, key: str, mass: int | None, count: int | None) -> None:
    if count is not None and mass is not None and mass > count:
        what, where = (
            ("mass", "structure.masses")
            if draft.tables.structure.reduced is None
            else ("boundary coordinate", "structure.reduced.boundary")
        )
        draft.say(
            key,
            f"there is no {what} {mass}: {where} has {count}, numbered from 1"
            + ("; 0 stands for the base" if key.endswith(("between", "lateral", "slide")) else ""),
        )


def drives_mass(draft: Draft) -> None:
    """Say a drive.mass that does not exist or beside a rig without masses."""
    drive, structure = draft.tables.drive, draft.tables.structure
    if drive.mass is None or structure is None or drive.kind == "base":
        return
    if draft.given("structure.mode"):
        draft.say("drive.mass", "applies only to structure.masses, but a structure of [[structure.mode]] is driven at "
                                "its output point: leave drive.mass out")  # fmt: skip
    else:
        _known(draft, "drive.mass", drive.mass, _numbered(structure))


def _file(draft: Draft, structure: Any) -> None:
    if structure.file is None:
        return
    ending = "." + structure.file.rpartition(".")[2].lower()
    if ending not in (*MATRICES, *MEASURED):
        draft.say("structure.file", f"the name ends in '{ending}'; {choices(ending, (*MATRICES, '.uff'))}: matrices or "
                                    "modes as arrays, or universal files")  # fmt: skip
    measured = ending in MEASURED
    for key in PLACES:
        if not measured and draft.given(f"structure.{key}"):
            draft.say(f"structure.{key}", f"names a place in a universal file; a {ending} file contains the array "
                                          f"{key.removesuffix('_at')}")  # fmt: skip
    if measured and not draft.given("structure.moving_mass"):
        draft.lacks(
            "structure.moving_mass", "the modes of a universal file are scaled to this mass"
        )
    if measured and not draft.given("structure.slide_at"):
        draft.lacks(
            "structure.slide_at", 'the node and direction that slide, such as slide_at = "12:+x"'
        )
    if measured and draft.given("structure.interface"):
        draft.say(
            "structure.interface",
            "a universal file has nodes, not masses; use slide_at with [friction]",
        )


def _reduced(draft: Draft, reduced: Any) -> None:
    """Files that can be read, boundary coordinates that are named once, places that slide where something rubs."""
    if reduced is None:
        return
    for key in ("stiffness", "mass", "damping"):
        file = getattr(reduced, key)
        ending = "." + file.rpartition(".")[2].lower() if isinstance(file, str) else REDUCED[0]
        if ending not in REDUCED:
            draft.say(
                f"structure.reduced.{key}",
                f"the name ends in '{ending}'; {choices(ending, REDUCED)}",
            )
    twice = [one for k, one in enumerate(reduced.boundary or ()) if one in reduced.boundary[:k]]
    if twice:
        draft.say(
            "structure.reduced.boundary", f"names {twice[0]} twice; name each coordinate once"
        )
    drive = draft.tables.drive
    if reduced.moved is not None and drive is not None and drive.kind in ("force", "free"):
        draft.remark("structure.reduced.moved is not used, because it applies only to a base drive")
    _between(
        draft,
        "structure.reduced.slide",
        reduced.slide,
        len(reduced.boundary) if reduced.boundary else None,
    )
    if draft.given("structure.interface"):
        if reduced.slide is not None:
            draft.say(
                "structure.reduced.slide",
                "applies only to [friction]; a [[structure.interface]] names its two "
                "sides with the key `between`: leave structure.reduced.slide out",
            )
    elif draft.given("friction") and reduced.slide is None:
        draft.lacks(
            "structure.reduced.slide",
            "which two boundary coordinates rub against each other, such as slide = "
            "[1, 0] for coordinate 1 against the base (0); or write "
            "[[structure.interface]] with its own law",
        )


def _bonded(draft: Draft, structure: Any) -> None:
    """The spring beside the contact needs to know which contact."""
    if structure.bonded is None or structure.masses is None or len(structure.interface or ()) == 1:
        return
    draft.say("structure.bonded", f"applies only to a single contact, but there are {len(structure.interface or ())} "
                                  "interfaces; instead write a [[structure.spring]] between the masses of the "
                                  "interface")  # fmt: skip


def _bolted(draft: Draft, structure: Any) -> None:
    """Modes that were measured with a joint of one stiffness."""
    tables, key = draft.tables, "structure.measured"
    under = tables.contact if tables.contact is not None else tables.normal
    if tables.friction is None and not structure.interface:
        draft.say(
            key,
            "'stuck' subtracts the stiffness of the joint from the modes, but this scene has no joint; add "
            "[friction] and its load, or leave `measured` out",
        )
    for reason, holds in (
        ("structure.masses", structure.masses is not None),
        ("structure.reduced", structure.reduced is not None),
    ):
        if holds:
            draft.say(
                key,
                f"'stuck' cannot be used with {reason}, because only modes can be measured with the joint; "
                "leave `measured` out",
            )
    for reason, holds in (
        (
            "a spring of structure.bonded.wavelength",
            structure.bonded is not None and structure.bonded.wavelength is not None,
        ),
        ("grooves", under is not None and under.grooves is not None),
        (
            "a normal load that changes",
            bool(getattr(tables.normal, "amplitude", None))
            or any(mode.normal or mode.pitch for mode in structure.mode or ()),
        ),
        ("strips that yaw", any(mode.yaw for mode in structure.mode or ())),
        ("[structure.interface.contact]", any(one.contact for one in structure.interface or ())),
    ):
        if holds:
            draft.say(
                key,
                f"'stuck' cannot be used with {reason}, because the joint then has no single stiffness to "
                "subtract from the modes; give the modes without the joint",
            )


def _start(draft: Draft, structure: Any) -> None:
    start = structure.start
    if start is None:
        return
    if not draft.given("structure.start.displacement") and not draft.given(
        "structure.start.velocity"
    ):
        draft.lacks(
            "structure.start.displacement",
            "or structure.start.velocity, one value per mode or mass",
        )
    count = _numbered(structure) or len(structure.mode or ())
    form = (
        "boundary coordinates"
        if structure.reduced is not None
        else ("mass" if count == 1 else "masses")
        if structure.masses
        else "mode"
        if count == 1
        else "modes"
    )
    for key in ("displacement", "velocity"):
        values = getattr(start, key)
        if values is not None and count and len(values) != count:
            many = f"{len(values)} value{'s' if len(values) > 1 else ''}"
            draft.say(
                f"structure.start.{key}",
                f"{many} for {count} {form}; give one value for each, in the same order",
            )
