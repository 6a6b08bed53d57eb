"""Rules of [contact.grooves] and [normal.grooves]: flanks that do not lock, laws that act along them."""

from __future__ import annotations

from math import pi
from typing import Any

from ...effects import carries, has, listed, named, not_supported_message, refusal
from ..keys import removed
from .methods import changing_load, turning
from .scene_draft import Draft


def check_grooves(draft: Draft, kind: str) -> None:
    """Say every mistake of the grooves of a scene; silent where there are none."""
    found = grooves_of(draft.tables)
    if found is None:
        return
    at, grooves = found
    law = draft.tables.friction
    if kind not in ("bench", "rig"):
        if kind:
            draft.say(
                at,
                f"[{at}] needs a sliding motion: add [friction] and [slide], or [structure] with [drive]",
            )
        return
    if law is None or law.law is None:
        return
    _locks(draft, at, grooves, law)
    if kind == "bench" and grooves.lifted_mass:
        draft.remark(
            f"{at}.lifted_mass has no meaning with [slide], because a prescribed slide has no inertia, and is "
            "not used"
        )
    if grooves.amplitude:
        _beside(draft, at, grooves, law)


def grooves_of(tables: Any) -> tuple | None:
    """(key of the table, the table) of the grooves of a scene, as far as it could be read; None without them."""
    for name in ("contact", "normal"):
        table = getattr(tables, name)
        grooves = table and table.grooves
        if grooves is not None:
            return f"{name}.grooves", grooves
    return None


def _locks(draft: Draft, at: str, grooves: Any, law: Any) -> None:
    """Friction on a flank as steep as 1/mu holds against any force along x."""
    if grooves.wavelength is None or grooves.amplitude is None or law.static is None:
        return
    wave = 2 * pi / grooves.wavelength
    if law.static * wave * grooves.amplitude >= 1:
        most = 1 / (wave * law.static)
        draft.say(
            f"{at}.amplitude",
            f"{grooves.amplitude:.6g} m gives flanks of slope {wave * grooves.amplitude:.6g}, "
            f"on which the pieces lock with static = {law.static:g}: no force can move one "
            "piece over the flanks of the other; an amplitude below wavelength/(2 pi static) "
            f"= {most:.6g} m is needed, or a smaller `static`",
        )


def _beside(draft: Draft, at: str, grooves: Any, law: Any) -> None:
    """Grooves are climbed as a whole by one interface, whose load heave and pitch do not change."""
    contact, structure = draft.tables.contact, draft.tables.structure
    beside = f"with [{at}]"
    if has(law.law, "bonds") and (listed(law) or law.breakaway):
        key = "reading" if law.reading == "report" else "breakaway" if law.breakaway else "order"
        draft.say(f"friction.{key}", not_supported_message(beside, "recursion"))
    elif law.law in removed.LAWS_OVER_GROOVES:
        draft.say(
            "friction.law",
            f"{named(law)} {beside} was removed in patchfem 1.0; {refusal('grooves')}",
        )
    elif not carries(law, "grooves"):
        draft.say(
            "friction.law",
            not_supported_message(f"{named(law)} {beside}", refusal("grooves", odd=law)),
        )
    accuracy = draft.tables.accuracy  # None where [accuracy] could not be read
    if (
        has(law.law, "bonds")
        and accuracy is not None
        and accuracy.quadrature not in (None, "auto", "recursion")
    ):
        draft.say(
            "accuracy.quadrature",
            not_supported_message(f"'{accuracy.quadrature}' {beside}", "use 'recursion' or 'auto'"),
        )
    if accuracy is not None and accuracy.method == "harmonic" and accuracy.harmonics is not None:
        draft.say(
            "accuracy.harmonics",
            f"harmonic balance {beside} was removed in patchfem 1.0; leave `harmonics` "
            "out: method 'harmonic' then integrates in time until the motion repeats",
        )
    if contact is not None and contact.gives_way:
        if contact.holder is not None and contact.holder.tangential_stiffness is not None:
            draft.say("contact.holder.tangential_stiffness", not_supported_message(beside, "out"))
    if (
        contact is not None
        and contact.strips is not None
        and (turning(draft.tables) or contact.gives_way)
    ):
        draft.say(at, not_supported_message("with strips that yaw or are elastic", "either"))
    if cause := changing_load(draft.tables):
        over = "a normal load that oscillates over grooves was removed in patchfem 1.0; leave one of the two out"
        draft.say(
            cause, over if cause == "normal.amplitude" else not_supported_message(beside, "either")
        )
    lower = [
        f"contact.{name}.on"
        for name, one in (contact.shapes if contact is not None else {}).items()
        if one.on == "lower"
    ]
    if lower:
        draft.say(lower[0], not_supported_message(f"'lower' {beside}", "shapes"))
    if structure is None:
        return
    if structure.stiffening is not None:
        draft.say("structure.stiffening", not_supported_message(beside, "either"))
    if structure.bonded is not None and structure.bonded.wavelength is not None:
        draft.say("structure.bonded.wavelength", not_supported_message(beside, "either"))
