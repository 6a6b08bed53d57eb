"""What a scene may say but no run can do yet: a key without an implementation, and combinations.

Each message has the words "not supported yet" and what to do meanwhile. Building one means deleting its rule.
"""

from __future__ import annotations

from collections.abc import Iterator

from ...effects import MEANWHILE, carries, has, listed, named, not_supported_message, refusal, takes
from ..keys.contact import Contact
from ..keys.tables import Friction, Interface, Tables
from .contact import OfInterface, of_interfaces
from .methods import beside_load, changing_load, check_method, turning
from .scene_draft import Draft

NOT_YET_BUILT = "structure.mode.lateral"  # valid in a scene, but no run can do it


def not_yet_built(tables: Tables) -> Iterator[tuple[str, str]]:
    """Key and message of every mode that has the key without an implementation; a zero names nothing."""
    for index, mode in enumerate(tables.structure.mode if tables.structure else ()):
        if mode.lateral:
            yield f"structure.mode.{index}.lateral", "not supported yet"


def combinations(draft: Draft, kind: str) -> None:
    """Say every combination of built keys that a run of this kind cannot do yet; silent about values not there."""
    check_method(draft, kind)
    contact, law = draft.tables.contact, draft.tables.friction
    if kind == "rig" and draft.tables.structure is not None:
        _interfaces(draft, draft.tables.structure.interface or ())
    if kind not in ("bench", "rig") or law is None or law.law is None:
        return
    shear = contact.gives_way if contact is not None else ""
    _quadrature(draft, kind, law, shear)
    if kind == "rig" and (cause := changing_load(draft.tables)):
        _under_changing_load(draft, law, shear, cause)
    if (
        kind == "bench"
        and _still(law)
        and draft.tables.normal is not None
        and draft.tables.normal.amplitude
    ):
        draft.say(
            "normal.amplitude",
            not_supported_message(f"with law '{law.law}'", refusal("varying-load")),
        )
    if (kind == "rig" or shear) and has(law.law, "bonds") and law.breakaway and law.order != 1:
        where = "in a rig" if kind == "rig" else f"and {shear}"
        draft.say(
            "friction.breakaway",
            not_supported_message(f"with order = {law.order:g} {where}", "order"),
        )
    if kind == "rig":
        _yawing(draft, law, contact)
    if shear:
        _behind_shear(draft, law, shear)
    if contact is not None:
        _on_pieces(draft, contact, _only_on_upper(kind, law, shear))
        if contact.strips is not None and shear and not _slips_in_strips(kind, contact, law):
            draft.say("contact.strips", not_supported_message(f"with {shear}", "either"))
        elif contact.strips is not None and has(law.law, "averaged"):
            draft.say("contact.strips", not_supported_message(f"with law '{law.law}'", "out"))


def _slips_in_strips(kind: str, contact: Contact, law: Friction) -> bool:
    """Whether strips each slip part by part: elements of a constant load behind the pieces' own shear, and no spring
    that couples the strips."""
    skin, holder = contact.asperities, contact.holder
    alone = (skin is None or skin.tangential_ratio is None) and (
        holder is None or holder.tangential_stiffness is None
    )
    elements = carries(law, "pieces") and carries(law, "shear")
    return kind == "rig" and contact.shear is not None and alone and elements


def _interfaces(draft: Draft, interfaces: tuple) -> None:
    """Interfaces between masses are points without a width; beside one another they take laws of one point each."""
    for index, one in enumerate(interfaces):
        at = f"structure.interface.{index}"
        if one.contact is None and one.load is None and not draft.given(f"{at}.load"):
            draft.lacks(
                f"{at}.load", "or give this interface a patch with [structure.interface.contact]"
            )
        if one.spread is not None and takes(one.law, "spread"):
            draft.say(
                f"{at}.spread",
                not_supported_message("with masses, where an interface has no width", "out"),
            )
        if len(interfaces) > 1 and one.law is not None and not carries(one, "joints"):
            draft.say(
                f"{at}.law",
                not_supported_message(
                    f"{named(one)} with other interfaces", refusal("joints", odd=one)
                ),
            )
        if one.lateral is not None:
            _in_plane(draft, at, one)
    for own in of_interfaces(draft):
        _of_patch(own, own.tables.contact, own.tables.friction, len(interfaces) == 1)


def _in_plane(draft: Draft, at: str, one: Interface) -> None:
    """An interface that slides in a plane is a point, with a law that has a form in two directions."""
    if one.contact is not None:
        draft.say(
            f"{at}.lateral",
            not_supported_message(
                "with [structure.interface.contact]",
                "give the interface a load, or leave lateral out",
            ),
        )
    if one.law is not None and not carries(one, "plane"):
        draft.say(
            f"{at}.lateral",
            not_supported_message(
                f"with {named(one)}",
                "stiff"
                if has(one.law, "set-valued")
                else f"{refusal('plane')}, or leave lateral out",
            ),
        )


def _of_patch(draft: OfInterface, contact: Contact, law: Interface, alone: bool) -> None:
    """The patch of an interface has a constant load, shapes on its upper piece, and elements where it gives way; alone:
    there is no other interface."""
    patch, soft = "[structure.interface.contact]", law.gives_way
    if draft.given("friction.load"):
        draft.say("friction.load", f"{patch} has its own load; leave this key out")
    for key, instead in (("approach", "give contact.load instead"), ("grooves", "out")):
        if draft.given(f"contact.{key}"):
            draft.say(
                f"contact.{key}", not_supported_message("with [[structure.interface]]", instead)
            )
    _on_pieces(draft, contact, "with [[structure.interface]]")
    if law.law is None:
        return
    if alone and not carries(law, "joints") and not soft:
        draft.say(
            "friction.law",
            not_supported_message(f"{named(law)} with {patch}", refusal("joints", odd=law)),
        )
    if not soft:
        return
    if not (carries(law, "pieces") and carries(law, "shear")):
        draft.say(
            "friction.law",
            not_supported_message(
                f"{named(law)} with {soft}", f"leave out {soft}, or {refusal('pieces', 'shear')}"
            ),
        )
    else:
        _behind_shear(draft, law, soft)
    if contact.strips is not None and not _slips_in_strips("rig", contact, law):
        draft.say("contact.strips", not_supported_message(f"with {soft}", "either"))


def _quadrature(draft: Draft, kind: str, law: Friction, shear: str) -> None:
    """A list of bonds knows neither an elastic range nor, merged, a pressure that changes as it slides."""
    contact, normal, accuracy = draft.tables.contact, draft.tables.normal, draft.tables.accuracy
    engine = accuracy.quadrature if accuracy is not None else None
    if engine in (None, "auto", "recursion") or not has(law.law, "bonds") or shear:
        return
    lower = contact is not None and any(shape.on == "lower" for shape in contact.shapes.values())
    if kind == "rig" and (lower or law.breakaway) and not listed(law):
        beside = "a shape on the lower piece" if lower else "friction.breakaway"
        draft.say(
            "accuracy.quadrature",
            not_supported_message(
                f"'{engine}' with {beside} in a rig", "use 'recursion' or 'auto'"
            ),
        )
    varies = normal is not None and normal.amplitude
    if kind == "bench" and engine == "merged" and (lower or law.breakaway or varies):
        draft.say(
            "accuracy.quadrature",
            not_supported_message(
                "'merged' with friction.breakaway, or with a pressure that changes at "
                "a point during the slide,",
                "use 'auto', 'direct' or 'truncated'",
            ),
        )


def sideways(tables: Tables) -> str:
    """What a slide in two directions, which the file of a path shows, cannot do yet; empty where it can."""
    law, contact, normal = tables.friction, tables.contact, tables.normal
    lower = contact is not None and any(shape.on == "lower" for shape in contact.shapes.values())
    if not carries(law, "two-directions"):
        reason = f"law '{law.law}': {refusal('two-directions')}"
    elif law.spread is not None:
        reason = f"friction.spread: {MEANWHILE['either']}"
    elif law.breakaway:
        reason = f"friction.breakaway: {MEANWHILE['either']}"
    elif contact is not None and contact.gives_way:
        reason = f"{contact.gives_way}: {MEANWHILE['either']}"
    elif lower:
        reason = f"a shape on the lower piece: {MEANWHILE['shapes']}"
    elif normal is not None and normal.amplitude:
        reason = f"normal.amplitude: {MEANWHILE['either']}"
    else:
        return ""
    what, _, remedy = reason.partition(": ")
    return not_supported_message(
        f"a lateral column with {what}", f"{remedy}, or leave the lateral column out"
    )


def _yawing(draft: Draft, law: Friction, contact: Contact | None) -> None:
    """A yaw needs strips to turn, and laws that a strip can have."""
    key = turning(draft.tables)
    if not key:
        return
    if contact is None or contact.strips is None:
        draft.say(
            key,
            "`yaw` rotates the patch about its normal; add [contact.strips], whose strips slide "
            "independently",
        )
    elif not carries(law, "joints"):
        draft.say(
            key, not_supported_message(f"in strips with {named(law)}", refusal("joints", odd=law))
        )


def _under_changing_load(draft: Draft, law: Friction, shear: str, cause: str) -> None:
    """Say what a load that changes in a run cannot stand beside."""
    contact, structure, beside = draft.tables.contact, draft.tables.structure, beside_load(cause)
    if contact is None and cause != "normal.amplitude":
        draft.say(
            cause,
            "a single contact point cannot heave or pitch: use [contact] in place of [normal]",
        )
    if not has(law.law, "bonds") and not carries(law, "varying-load"):
        draft.say(
            "friction.law", not_supported_message(f"'{law.law}' {beside}", refusal("varying-load"))
        )
    elif has(law.law, "bonds") and (law.breakaway or (listed(law) and law.reading != "report")):
        key = "reading" if law.reading == "report" else "breakaway" if law.breakaway else "order"
        draft.say(f"friction.{key}", not_supported_message(beside, "recursion"))
    if shear and has(law.law, "set-valued") and carries(law, "shear"):
        draft.say(
            "friction.law", not_supported_message(f"'{law.law}' {beside} and {shear}", "stiff")
        )
    if structure is not None and structure.stiffening is not None:
        draft.say("structure.stiffening", not_supported_message(beside, "either"))
    if (
        structure is not None
        and structure.bonded is not None
        and structure.bonded.wavelength is not None
    ):
        draft.say("structure.bonded.wavelength", not_supported_message(beside, "either"))
    if contact is None:
        return
    if contact.strips is not None:
        draft.say("contact.strips", not_supported_message(beside, "either"))
    if contact.asperities is not None and contact.asperities.law not in ("linear", None):
        draft.say(
            "contact.asperities.law",
            not_supported_message(f"'{contact.asperities.law}' {beside}", "linear"),
        )
    for name, shape in contact.shapes.items():
        if shape.on == "lower":
            draft.say(f"contact.{name}.on", not_supported_message(f"'lower' {beside}", "shapes"))


def _behind_shear(draft: Draft, law: Friction, shear: str) -> None:
    if (
        has(law.law, "bonds")
        and law.reading == "report"
        and _inside(law.order, -1, 0)
        and law.initial_bonds
    ):
        draft.say(
            "friction.initial_bonds",
            f"{law.initial_bonds:g} with order = {law.order:g} and {shear} gives "
            "points that no force can move: in the law as printed in the report, "
            "(R/eps)^order is unbounded for bonds at rest; set initial_bonds = 0 or "
            "use order >= 0",
        )
    if not has(law.law, "bonds") and not carries(law, "shear"):
        draft.say(
            "friction.law",
            not_supported_message(
                f"'{law.law}' with {shear}", f"leave out {shear}, or {refusal('shear')}"
            ),
        )
    weakens = law.static is not None and _inside(law.kinetic, -1, law.static)
    if has(law.law, "set-valued") and carries(law, "shear") and weakens:
        draft.say(
            "friction.kinetic",
            not_supported_message(
                f"{law.kinetic:g} below static = {law.static:g} with {shear}", "kinetic"
            ),
        )


def _only_on_upper(kind: str, law: Friction, shear: str) -> str:
    """What keeps the pressure of such a run on the upper piece; empty where it may lie on the lower one as well."""
    if has(law.law, "bonds"):
        return "with friction.breakaway and " + shear if shear and law.breakaway else ""
    if shear:
        return f"with {shear} and law '{law.law}'"
    if kind == "bench":
        return f"with law '{law.law}'" if _still(law) else ""
    return f"in a rig with law '{law.law}'"


def _still(law: Friction) -> bool:
    """Whether a law knows no pressure that changes: it remembers, and no changing load carries it."""
    return not (has(law.law, "memoryless") or has(law.law, "bonds") or carries(law, "varying-load"))


def _on_pieces(draft: Draft, contact: Contact, only_upper: str) -> None:
    sides = {
        f"contact.{name}.on": shape.on
        for name, shape in contact.shapes.items()
        if shape.on is not None
    }
    lower = [key for key, side in sides.items() if side == "lower"]
    if len(set(sides.values())) > 1:
        key = next((key for key in reversed(sides) if draft.given(key)), next(iter(sides)))
        piece = "the upper piece" if only_upper else "one piece"
        names = " and ".join(key.removesuffix(".on") for key in sides)
        draft.say(
            key, not_supported_message(f"{names} on different pieces", f"put all shapes on {piece}")
        )
    elif lower and only_upper:
        draft.say(lower[0], not_supported_message(f"'lower' {only_upper}", "shapes"))


def _inside(value: float | None, low: float, high: float = float("inf")) -> bool:
    return value is not None and low < value < high
