"""What a scene must satisfy beyond the limits of each key: which keys belong together, which exclude each other.

Each rule looks at a `Draft`: the tables as far as they could be read (None where a value is missing or wrong), and
what was written. A rule says every mistake it finds and stays silent about values that are not there.
"""

from __future__ import annotations

from ...effects import has, waveform_of
from ..keys.tables import Friction
from .accuracy import _knobs, _quadrature
from .contact import check_contacts
from .drive import check_drive, check_length
from .friction import _frictions
from .grooves import check_grooves
from .scene_draft import SLIDES, Draft, _needs
from .structure import check_gains, check_structure, modes_instead
from .wear import check_wear


def check(draft: Draft) -> str:
    """Say every mistake of the whole draft; the kind of run (``patch``, ``bench``, ``rig``, ``linear`` or empty)."""
    for rule in (
        check_contacts,
        _normal,
        _frictions,
        _slide,
        check_structure,
        check_drive,
        _measured,
    ):
        rule(draft)
    kind = _kind(draft)
    for rule in (
        _quadrature,
        _knobs,
        _idle,
        _sliding,
        check_length,
        check_wear,
        check_grooves,
        check_gains,
    ):
        rule(draft, kind)
    return kind


def _normal(draft: Draft) -> None:
    if draft.tables.normal is None:
        return
    if draft.given("normal.amplitude") and not draft.given("normal.frequency"):
        draft.lacks("normal.frequency", "normal.amplitude needs this key")
    for key in ("frequency", "phase"):
        if draft.given(f"normal.{key}") and not draft.given("normal.amplitude"):
            draft.lacks("normal.amplitude", f"{key} needs this key")
    if draft.given("normal.width") and not draft.given("friction.spread"):
        draft.remark("normal.width has no meaning without friction.spread and is not used")


def _measured(draft: Draft) -> None:
    if draft.tables.measured is None or draft.tables.measured.reading is None:
        return
    low, cut = draft.tables.measured.reading == "lowpass", draft.given("measured.reading_cutoff")
    if low and not cut:
        draft.lacks("measured.reading_cutoff", "reading 'lowpass' needs this key, such as '600 Hz'")
    drive = draft.tables.drive
    if draft.tables.measured.reading != "peak" and not waveform_of(drive).is_sine:
        draft.remark("measured.reading has a meaning only under a sine drive and is not used")
    if cut and not low:
        draft.remark(
            f"measured.reading_cutoff has no meaning for reading '{draft.tables.measured.reading}' and is not "
            "used"
        )


def _slide(draft: Draft) -> None:
    slide = draft.tables.slide
    if slide is None:
        return
    _needs(draft, "slide", slide, "kind", SLIDES)
    if slide.kind in ("constant", "dwell") and slide.distance == 0.0:
        draft.say("slide.distance", f"must be > 0 m for kind '{slide.kind}'")
    law = draft.tables.friction
    if slide.kind == "dwell" and slide.hold and law is not None and _ageless(law):
        draft.remark("slide.hold has no effect, because no bond grows at rest; add friction.rest_growth and "
                     "slip_growth to law 'nonlocal'")  # fmt: skip


def _ageless(law: Friction) -> bool:
    return has(law.law, "timeless") or (has(law.law, "bonds") and law.rest_growth is None)


def _kind(draft: Draft) -> str:
    """The kind of run from the tables that stand together, or a mistake for each one missing or in the way."""
    has = {name for name in ("contact", "normal", "friction", "slide", "structure", "drive", "wear")
           if draft.given(name)}  # fmt: skip
    if draft.given("structure.interface"):
        for name in sorted(has & {"friction", "normal", "contact"}):
            instead = (
                (
                    "; move [contact] into the interface that it presses, as [structure.interface.contact] in place "
                    "of `load`"
                )
                if name == "contact"
                else ""
            )
            draft.say(
                name,
                f"[{name}] and [[structure.interface]] exclude each other: each interface has its own "
                f"law and load{instead}",
            )
        # an interface's load is no [normal] that someone wrote
        has = has - {"contact"} | {
            "friction",
            "normal",
        }
    if {"contact", "normal"} <= has:
        draft.say(
            "normal",
            "[contact] and [normal] exclude each other: keep one source of the normal load",
        )
        has.discard("normal")
    moves, pressed = has & {"structure", "drive"}, has & {"contact", "normal"}
    if "slide" in has and moves:
        draft.say(
            "slide",
            "[slide] prescribes the motion, but [structure] with [drive] computes the motion: keep only "
            "[slide], or only [structure] with [drive]",
        )
        return ""
    if has == {"contact"}:
        return "patch"
    if has == {"structure", "drive"}:
        return "linear"
    return _with_friction(draft, has, pressed, moves)


def _with_friction(draft: Draft, has: set[str], pressed: set[str], moves: set[str]) -> str:
    if not has:
        draft.lacks_table(
            "contact",
            "a scene needs [contact] (pressed pieces), or [structure] with [drive] (a "
            "vibrating structure); with [friction] a scene needs a load and a motion",
        )
        return ""
    if moves and "drive" not in has:
        draft.lacks_table("drive", "[structure] needs this table")
    if moves and "structure" not in has:
        draft.lacks_table("structure", "[drive] needs this table")
    friction = pressed or has & {"friction", "slide", "wear"}
    if friction and "friction" not in has:
        others = ", ".join(f"[{name}]" for name in sorted(has))
        draft.lacks_table("friction", f"a run with {others} also needs this table")
    if friction and draft.given("structure.masses") and not draft.given("structure.interface"):
        if "contact" in has:
            draft.say(
                "structure.masses",
                f"structure.masses cannot be used with [contact]; {modes_instead(draft)}, or "
                "keep the masses, write the friction law in [[structure.interface]] and the "
                "patch in [structure.interface.contact]",
            )
        else:
            draft.lacks(
                "structure.interface",
                "friction between masses needs an interface: write "
                "[[structure.interface]] with `law` and `load` instead of [friction]",
            )
    if friction and not pressed:
        draft.lacks_table("contact", "friction needs a normal load, [contact] or [normal]")
    if friction and not moves and "slide" not in has:
        draft.lacks_table("slide", "friction needs a motion, [slide] or [structure] with [drive]")
    return "bench" if "slide" in has else "rig"


def _idle(draft: Draft, kind: str) -> None:
    """Remarks on keys that mean something to a patch that slides, or that rubs, alone."""
    contact = draft.tables.contact if kind == "patch" else None
    still = (
        ["holder.tangential_stiffness"]
        if draft.given("contact.holder.tangential_stiffness")
        else []
    )
    for key in (
        ()
        if contact is None
        else still
        + [
            f"{name}.on"
            for name, shape in contact.shapes.items()
            if shape.on == "lower" and name != "tilt"
        ]
    ):
        draft.remark(
            f"contact.{key} has no meaning in a patch scene, where nothing slides, and is not used"
        )
    modes = (
        draft.tables.structure.mode
        if kind == "linear" and draft.tables.structure is not None
        else ()
    )
    for key in ("normal", "pitch", "yaw"):
        for index, mode in enumerate(modes or ()):
            if getattr(mode, key):
                at = draft.shown(f"structure.mode.{index}.{key}")
                draft.remark(
                    f"{at} has no meaning in a linear scene, which has no friction, and is not used"
                )


def _sliding(draft: Draft, kind: str) -> None:
    structure = draft.tables.structure
    modes = structure.mode if kind == "rig" and structure is not None else ()
    if modes and all(mode.slide == 0 for mode in modes):
        draft.say(
            "structure.mode.0.slide",
            "`slide` is 0 in every mode, so nothing slides at the patch; give `slide` "
            "for the mode that moves the patch, or leave out [friction] and the load",
        )
