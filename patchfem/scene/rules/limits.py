"""What a scene may say but no run can do yet: the list of keys without an implementation, and combinations.

Each message says what serves meanwhile and ends in "not yet built". Building one means deleting its line or rule.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...effects import carries, has, listed, named, refusal
from ..keys.contact import Contact
from ..keys.tables import Friction, Tables
from .draft import Draft

# Valid in a scene but without an implementation -> what serves meanwhile.
NOT_YET_BUILT: dict[str, str] = {
    "structure.mode.lateral": "",
}


def not_yet_built(tables: Tables) -> Iterator[tuple[str, str]]:
    """Key and message for everything the tables name that has no implementation yet; a zero number names nothing."""
    for entry, instead in NOT_YET_BUILT.items():
        path, _, value = entry.partition("=")
        use = f"use {instead} meanwhile; " if instead else ""
        for key, found in _find(tables, path):
            if value and found == value:
                yield key, f"'{value}': {use}not yet built"
            elif not value and found not in (None, (), 0, 0.0):
                yield key, f"{use}not yet built"


def _find(table: Any, path: str, at: str = "") -> Iterator[tuple[str, Any]]:
    name, _, rest = path.partition(".")
    value = getattr(table, name, None)
    at = f"{at}.{name}" if at else name
    if not rest:
        yield at, value
    elif isinstance(value, tuple):
        for index, item in enumerate(value):
            yield from _find(item, rest, f"{at}.{index}")
    elif value is not None:
        yield from _find(value, rest, at)


def combinations(draft: Draft, kind: str) -> None:
    """Say every combination of built keys that a run of this kind cannot do yet; silent about values not there."""
    contact, law = draft.tables.contact, draft.tables.friction
    shear = contact.gives_way if contact is not None else ""
    if kind not in ("bench", "rig") or law is None or law.law is None:
        return
    if kind == "rig" and (cause := _changing_load(draft)):
        _under_changing_load(draft, law, shear, cause)
    if kind == "bench" and _still(law) and draft.tables.normal is not None and draft.tables.normal.amplitude:
        draft.say("normal.amplitude", f"beside law '{law.law}': {refusal('varying-load')}")
    if kind == "rig" and has(law.law, "bonds") and law.breakaway and law.order != 1:
        draft.say("friction.breakaway", f"beside order = {law.order:g} in a rig: use order = 1; not yet built")
    if kind == "rig":
        _yawing(draft, law, contact)
    if shear:
        _behind_shear(draft, law, shear)
    if contact is not None:
        _on_pieces(draft, contact, _only_on_upper(kind, law, shear))
        if contact.strips is not None and shear:
            draft.say("contact.strips", f"beside {shear}: leave one of them out; not yet built")
        elif contact.strips is not None and has(law.law, "averaged"):
            draft.say("contact.strips", f"beside law '{law.law}': leave it out; not yet built")


def _yawing(draft: Draft, law: Friction, contact: Contact | None) -> None:
    """A yaw needs strips to turn, and laws that a strip can have."""
    structure = draft.tables.structure
    turning = [k for k, mode in enumerate(structure.mode if structure is not None else ()) if mode.yaw]
    if not turning:
        return
    key = f"structure.mode.{turning[0]}.yaw"
    if contact is None or contact.strips is None:
        draft.say(key, "turns the patch about its normal: name [contact.strips], which slide each by themselves")
        return
    if not carries(law, "joints"):
        draft.say(key, f"beside strips with {named(law)}: {refusal('joints')}")
    accuracy = draft.tables.accuracy
    if accuracy is not None and accuracy.method not in ("auto", "march", "exact", None):
        draft.say("accuracy.method", f"'{accuracy.method}' beside strips that yaw: use 'march'; not yet built")


def _changing_load(draft: Draft) -> str:
    """The key by which the load of a rig changes, empty where it stays."""
    normal, structure = draft.tables.normal, draft.tables.structure
    if normal is not None and normal.amplitude:
        return "normal.amplitude"
    for index, mode in enumerate(structure.mode if structure is not None else ()):
        for key in ("normal", "pitch"):
            if getattr(mode, key, None):
                return f"structure.mode.{index}.{key}"
    return ""


def _under_changing_load(draft: Draft, law: Friction, shear: str, cause: str) -> None:
    """Say what a load that changes in a run cannot stand beside."""
    contact, structure = draft.tables.contact, draft.tables.structure
    beside = f"beside {cause}" if cause == "normal.amplitude" else f"beside a mode's {cause.rpartition('.')[2]}"
    if contact is None and cause != "normal.amplitude":
        draft.say(cause, "one rigid point leaves no room for heave or pitch: name [contact] in place of [normal]")
    accuracy = draft.tables.accuracy
    if accuracy is not None and accuracy.method == "exact" and carries(law, "exact") and not shear:
        draft.say("accuracy.method", f"no exact solution exists {beside}; use 'march' or leave method out")
    if accuracy is not None and accuracy.method in ("duhamel", "newmark", "euler", "harmonic"):
        draft.say("accuracy.method", f"'{accuracy.method}' {beside} takes the load as constant: use 'march'; not yet "
                                     "built")  # fmt: skip
    if not has(law.law, "bonds") and not carries(law, "varying-load"):
        draft.say("friction.law", f"'{law.law}' {beside}: {refusal('varying-load')}")
    elif listed(law) or (has(law.law, "bonds") and law.breakaway):
        key = "reading" if law.reading == "report" else "breakaway" if law.breakaway else "order"
        draft.say(f"friction.{key}", f"{beside}: use reading = \"stretch\" with order = 1 and no breakaway; not yet "
                                     "built")  # fmt: skip
    if shear and has(law.law, "set-valued") and carries(law, "shear"):
        draft.say("friction.law", f"'{law.law}' {beside} and {shear}: use law 'elastic-plastic' with a short "
                                  "bond_length, which is Coulomb behind stiff springs; not yet built")  # fmt: skip
    if structure is not None and structure.stiffening is not None:
        draft.say("structure.stiffening", f"{beside}: leave one of them out; not yet built")
    if structure is not None and structure.bonded is not None and structure.bonded.wavelength is not None:
        draft.say("structure.bonded.wavelength", f"{beside}: leave one of them out; not yet built")
    if contact is None:
        return
    if contact.strips is not None:
        draft.say("contact.strips", f"{beside}: leave one of them out; not yet built")
    if contact.asperities is not None and contact.asperities.law not in ("linear", None):
        draft.say("contact.asperities.law", f"'{contact.asperities.law}' {beside}: use 'linear'; not yet built")
    for name, shape in contact.shapes.items():
        if shape.on == "lower":
            draft.say(f"contact.{name}.on", f"'lower' {beside}: put the shapes on the upper piece; not yet built")


def _behind_shear(draft: Draft, law: Friction, shear: str) -> None:
    least = -1 if law.reading == "report" else 0
    if has(law.law, "bonds") and law.order != 1 and (law.order == 0 or _inside(law.order, least)):
        draft.say("friction.order", f"{law.order:g} beside {shear}: use order = 1; not yet built")
    if not has(law.law, "bonds") and not carries(law, "shear"):
        draft.say("friction.law", f"'{law.law}' beside {shear}: leave it out, or {refusal('shear')}")
    weakens = law.static is not None and _inside(law.kinetic, -1, law.static)
    if has(law.law, "set-valued") and carries(law, "shear") and weakens:
        draft.say("friction.kinetic", f"{law.kinetic:g} below static = {law.static:g} beside {shear}: leave kinetic "
                                      "out; not yet built")  # fmt: skip


def _only_on_upper(kind: str, law: Friction, shear: str) -> str:
    """What keeps the pressure of such a run on the upper piece; empty where it may lie on the lower one as well."""
    if shear:
        return f"beside {shear}"
    if kind == "bench":
        return f"with law '{law.law}'" if _still(law) else ""
    if not has(law.law, "bonds"):
        return f"in a rig with law '{law.law}'"
    if law.reading == "report":
        return "in a rig with reading 'report'"
    return f"in a rig with order = {law.order:g}" if listed(law) else ""


def _still(law: Friction) -> bool:
    """Whether a law knows no pressure that changes: it remembers, and no changing load carries it."""
    return not (has(law.law, "memoryless") or has(law.law, "bonds") or carries(law, "varying-load"))


def _on_pieces(draft: Draft, contact: Contact, only_upper: str) -> None:
    sides = {f"contact.{name}.on": shape.on for name, shape in contact.shapes.items() if shape.on is not None}
    lower = [key for key, side in sides.items() if side == "lower"]
    if len(set(sides.values())) > 1:
        key = next((key for key in reversed(sides) if draft.given(key)), next(iter(sides)))
        piece = "the upper piece" if only_upper else "one piece"
        names = " and ".join(key.removesuffix(".on") for key in sides)
        draft.say(key, f"{names} lie on different pieces: put all shapes on {piece}; not yet built")
    elif lower and only_upper:
        draft.say(lower[0], f"'lower' {only_upper}: put the shapes on the upper piece; not yet built")


def _inside(value: float | None, low: float, high: float = float("inf")) -> bool:
    return value is not None and low < value < high
