"""What [wear] asks of the rest of a scene."""

from itertools import pairwise
from math import pi

from ...effects import has, not_supported_message, takes, using, waveform_of
from ..keys.tables import WornFriction
from .grooves import grooves_of
from .scene_draft import Draft

LATER = "leave out [wear] or {}"


def check_wear(draft: Draft, kind: str) -> None:
    """Say what [wear] cannot go with; silent about values not there."""
    tables = draft.tables
    if tables.wear is None:
        return
    if kind == "patch":
        draft.say(
            "wear",
            "wear needs a slide: add [friction] with [slide], or with [structure] and [drive]",
        )
    for key, words in _beside(draft, tables, kind):
        draft.say("wear", not_supported_message(f"with {key}", words))
    if tables.wear.friction is not None:
        _friction(draft, tables.wear.friction)
    if tables.normal is not None:
        if draft.given("wear.start"):
            draft.say(
                "wear.start",
                "[normal] is a point and has no worn depth to start from: use [contact], or "
                "leave wear.start out and add the worn volumes of both runs",
            )
        for key in ("jumps", "upper_share"):
            if draft.given(f"wear.{key}"):
                draft.remark(f"wear.{key} has no meaning without [contact] and is not used")
    elif (
        draft.given("wear.upper_share")
        and grooves_of(tables) is None
        and not _coated(tables.contact)
    ):
        draft.remark(
            "wear.upper_share has no effect on the measures without grooves or a coating: the measure "
            "worn_depth is the depth worn off both pieces together"
        )


def _friction(draft: Draft, change: WornFriction) -> None:
    """Say every mistake of the table of friction over the worn depth."""
    at, law, depth = "wear.friction", draft.tables.friction, change.depth
    if draft.tables.normal is not None:
        draft.say(at, "a [normal] contact has no area, so its wear has no depth: use [contact]")
    if depth is not None and (depth[0] != 0 or any(two <= one for one, two in pairwise(depth))):
        draft.say(
            f"{at}.depth", 'depths that rise from 0 are needed, such as ["0 um", "1 um", "5 um"]'
        )
    names = ("coefficient_factor", "bond_length_factor")
    if not any(draft.given(f"{at}.{name}") for name in names):
        draft.lacks(
            f"{at}.coefficient_factor",
            "the table needs a factor: coefficient_factor, bond_length_factor or both",
        )
    for name in names:
        factors = getattr(change, name)
        if factors is not None and depth is not None and len(factors) != len(depth):
            draft.say(
                f"{at}.{name}",
                f"{len(factors)} factors for {len(depth)} depths; give one factor for each depth",
            )
        elif factors is not None and factors[0] != 1:
            draft.say(
                f"{at}.{name}",
                f"the first factor must be 1, not {factors[0]:g}, because [friction] itself "
                "describes the contact at depth 0",
            )
    if law is None:
        return
    if change.bond_length_factor is not None and not takes(law.law, "bond_length"):
        draft.say(
            f"{at}.bond_length_factor",
            f"law '{law.law}' has no bond_length; leave this key out, or use "
            f"{using('bond_length')}",
        )
    elif change.bond_length_factor is not None and law.stiffness is not None:
        draft.say(
            f"{at}.bond_length_factor",
            "has no meaning with friction.stiffness; give friction.bond_length in "
            "place of friction.stiffness",
        )
    if change.coefficient_factor is not None and law.static == 0:
        draft.remark(f"{at}.coefficient_factor has no effect, because static = 0")
    _locks(draft, change, law.static)


def _locks(draft: Draft, change: WornFriction, static: float | None) -> None:
    """Say grooves on whose flanks friction holds against any force where it has risen."""
    found = grooves_of(draft.tables)
    if (
        found is None
        or change.coefficient_factor is None
        or None in (static, found[1].amplitude, found[1].wavelength)
    ):
        return
    steepest, most = (
        2 * pi * found[1].amplitude / found[1].wavelength,
        static * max(change.coefficient_factor),
    )
    if most * steepest >= 1 > static * steepest:
        draft.say(
            "wear.friction.coefficient_factor",
            f"{max(change.coefficient_factor):g} raises static to {most:g}, "
            "at which the pieces lock on the flanks of the unworn grooves "
            f"(slope {steepest:.6g}); factors below "
            f"{1 / steepest / static:.6g} are needed",
        )


def _coated(contact) -> bool:
    """Whether a piece of [contact] may have a coating."""
    pieces = () if contact is None else (contact.upper, contact.lower)
    return contact is not None and any(
        one is not None and one.coating is not None for one in (contact, *pieces)
    )


def _beside_strips(draft: Draft, contact):
    """What wear of strips does not go with, each with what to do."""
    if contact.gives_way:
        yield f"contact.strips with {contact.gives_way}", LATER.format(contact.gives_way)
    if any(shape.on == "lower" for shape in contact.shapes.values()):
        yield (
            "contact.strips with a shape on the lower piece",
            LATER.format("put all shapes on the upper piece"),
        )
    if draft.given("wear.start"):
        yield "contact.strips with wear.start", LATER.format("leave out wear.start")


def _beside(draft: Draft, tables, kind: str):
    """Tables and values that wear does not go with, each with what to do."""
    contact, structure, drive = tables.contact, tables.structure, tables.drive
    method = tables.accuracy and tables.accuracy.method  # None where [accuracy] could not be read
    grooves = grooves_of(tables)
    if grooves is not None and tables.normal is not None and grooves[1].amplitude:
        yield (
            f"[{grooves[0]}]",
            "a [normal] contact has no area, so its wear has no depth: use [contact]",
        )
    if contact is not None and contact.strips is not None:
        yield from _beside_strips(draft, contact)
    if tables.normal is not None and tables.normal.amplitude and kind == "rig":
        yield "normal.amplitude", LATER.format("the amplitude")
    if structure is not None and structure.interface:
        yield (
            "[[structure.interface]]",
            LATER.format("describe a single interface by [friction] and [normal]"),
        )
    if structure is not None and any(mode.normal or mode.pitch for mode in structure.mode or ()):
        yield "modes with `normal` or `pitch`", LATER.format("these keys")
    waveform = waveform_of(drive)
    if (
        kind == "rig"
        and drive is not None
        and (drive.kind == "free" or (waveform.name and not waveform.is_sine))
    ):
        yield (
            "drive.kind = 'free'"
            if drive.kind == "free"
            else f"drive.waveform = '{drive.waveform}'",
            "wear is computed from the last cycle of a steady motion: use "
            + ("kind 'base' or 'force'" if drive.kind == "free" else "waveform 'sine'"),
        )
    if kind == "rig" and method == "harmonic":
        yield f"accuracy.method '{method}'", "use 'auto', 'exact' or 'march'"
    if tables.friction is not None and has(tables.friction.law, "averaged"):
        yield f"law '{tables.friction.law}'", LATER.format("use law 'coulomb'")
