"""What a scene must satisfy beyond the limits of each key: which keys belong together, which exclude each other.

Each rule looks at a `Draft`: the tables as far as they could be read (None where a value is missing or wrong), and
what was written. A rule says every mistake it finds and stays silent about values that are not there.
"""

from __future__ import annotations

from typing import Any, Protocol

from pydantic import BaseModel

from patchfem.scene_built import NOT_YET_BUILT
from patchfem.scene_drive import check_drive, check_length
from patchfem.scene_friction import check_spread, remark_temperature
from patchfem.scene_structure import check_structure
from patchfem.scene_tables import Friction, Tables
from patchfem.scene_types import keys

# selector value -> keys it needs, keys it can use; a key of the table that stands in neither list is not used
LAWS: dict[str, tuple[str, str]] = {
    "coulomb": ("", "kinetic"),
    "tanh": ("reference_speed", ""),
    "elastic-plastic": ("bond_length", ""),
    "nonlocal": (
        "bond_length",
        "kinetic reading order rest_growth slip_growth rest_speed initial_bonds breakaway spread temperature",
    ),
    "convolution": ("bond_length", "order spread"),
}
SLIDES: dict[str, tuple[str, str]] = {
    "constant": ("speed distance", ""),
    "sine": ("amplitude frequency", "cycles"),
    "triangle": ("amplitude speed", "distance cycles"),
    "dwell": ("speed distance hold", "distance_after"),
    "file": ("file", ""),
}
ASPERITIES: dict[str, tuple[str, str]] = {
    "linear": ("normal_stiffness", "tangential_ratio"),
    "exponential": ("decay_length", "normal_stiffness tangential_ratio"),
    "hertz": ("radius density height_deviation", "tangential_ratio"),
}


class Draft(Protocol):
    """A scene being read: the tables so far, what was written, and where mistakes go."""

    tables: Tables

    def given(self, key: str) -> bool: ...
    def say(self, key: str, message: str) -> None: ...
    def remark(self, sentence: str) -> None: ...
    def lacks(self, key: str, reason: str) -> None: ...
    def lacks_table(self, name: str, reason: str) -> None: ...


def check(draft: Draft) -> str:
    """Say every mistake of the whole draft; the kind of run (``patch``, ``bench``, ``rig``, ``linear`` or empty)."""
    for rule in (_contact, _load_line, _normal, _frictions, _slide, check_structure, check_drive):
        rule(draft)
    kind = _kind(draft)
    for rule in (_method, _quadrature, _sliding, check_length):
        rule(draft, kind)
    return kind


def unused(table: BaseModel, selector: str, used: dict[str, tuple[str, str]]) -> set[str]:
    """Keys of a table that the value of its selector gives no meaning, among those that depend on it."""
    needs, can = used[getattr(table, selector)]
    dependent = {key for pair in used.values() for keys in pair for key in keys.split()}
    return (dependent - set(needs.split()) - set(can.split())) & keys(type(table)).keys()


def _needs(draft: Draft, at: str, table: Any, selector: str, used: dict[str, tuple[str, str]]) -> None:
    """Missing keys that the selector's value needs; remarks on those it gives no meaning."""
    value = getattr(table, selector, None)
    if value not in used:
        return
    for key in used[value][0].split():
        if not draft.given(f"{at}.{key}"):
            draft.lacks(f"{at}.{key}", f"{selector} '{value}' needs it")
    for key in sorted(unused(table, selector, used)):
        if draft.given(f"{at}.{key}") and key not in ("kinetic", "spread"):
            draft.remark(f"{at}.{key} has no meaning for {selector} '{value}' and is not used")


def _contact(draft: Draft) -> None:
    contact = draft.tables.contact
    if contact is None:
        return
    load, approach = draft.given("contact.load"), draft.given("contact.approach")
    if load and approach:
        draft.say("contact.approach", "[contact.approach] and contact.load exclude each other: keep one")
    if not load and not approach:
        draft.lacks("contact.load", "" if "contact.approach" in NOT_YET_BUILT else "or [contact.approach] instead")
    if contact.element_size and contact.length and contact.element_size > contact.length:
        draft.say("contact.element_size", f"{contact.element_size} m is longer than contact.length {contact.length} m")
    if contact.element_size and contact.mesh:
        draft.remark("contact.element_size is not used beside contact.mesh, whose elements are those of the file")
    pieces = [("contact.coating", contact.coating, contact.height)]
    for name in ("upper", "lower"):
        if piece := getattr(contact, name):
            own = piece.coating if piece.coating is not None else contact.coating
            at = f"contact.{name}.coating" if piece.coating is not None else f"contact.{name}"
            pieces.append((at, own, piece.height or contact.height))
    for at, coating, height in pieces:
        thickness = getattr(coating, "thickness", None)
        if thickness and height and thickness >= height:
            key = f"{at}.thickness" if at.endswith("coating") else f"{at}.height"
            draft.say(key, f"coating of {thickness} m must be thinner than the height {height} m of its piece")
    if contact.holder and not draft.given("contact.holder.rotational_stiffness"):
        if not draft.given("contact.holder.tangential_stiffness"):
            draft.say("contact.holder", "rotational_stiffness, tangential_stiffness or both are wanted")
    if contact.step and contact.step.at is not None and contact.length and abs(contact.step.at) >= contact.length / 2:
        draft.say("contact.step.at", f"{contact.step.at} m lies outside the patch, |at| < length/2 is wanted")
    if contact.asperities:
        _needs(draft, "contact.asperities", contact.asperities, "law", ASPERITIES)
        bare = contact.asperities.law == "exponential" and contact.asperities.normal_stiffness is None
        if contact.approach and bare:
            draft.lacks("contact.asperities.normal_stiffness", "law 'exponential' beside [contact.approach] needs it "
                        "at first touch, where an approach starts")  # fmt: skip


def _load_line(draft: Draft) -> None:
    contact = draft.tables.contact
    line = contact and contact.load_line
    if not line:
        return
    at = "contact.load_line"
    offset, moment = draft.given(f"{at}.offset"), draft.given(f"{at}.moment")
    if offset and moment:
        draft.say(f"{at}.moment", "offset and moment exclude each other: keep one")
    if not offset and not moment:
        draft.lacks(f"{at}.offset", "or load_line.moment instead")
    if draft.given("contact.tilt.angle") and not draft.given("contact.holder"):
        draft.say(at, "stands beside contact.tilt.angle without [contact.holder]: a piece free to rotate has no "
                      "prescribed angle; keep one of the two or add the holder's spring")  # fmt: skip
    half = contact.length / 2 if contact.length else None
    if half and line.offset is not None and abs(line.offset) >= half:
        draft.say(f"{at}.offset", f"{line.offset} m lies outside the patch: |offset| < length/2 = {half} m is wanted")
    if half and line.moment and contact.load is not None and abs(line.moment) >= half * contact.load:
        draft.say(f"{at}.moment", f"{line.moment} N m over the load {contact.load} N lies outside the patch: "
                                  f"|moment|/load < length/2 = {half} m is wanted")  # fmt: skip


def _normal(draft: Draft) -> None:
    if draft.tables.normal is None:
        return
    if draft.given("normal.amplitude") and not draft.given("normal.frequency"):
        draft.lacks("normal.frequency", "an amplitude needs it")
    for key in ("frequency", "phase"):
        if draft.given(f"normal.{key}") and not draft.given("normal.amplitude"):
            draft.lacks("normal.amplitude", f"{key} needs it")
    if draft.given("normal.width") and not draft.given("friction.spread"):
        draft.remark("normal.width has no meaning without friction.spread and is not used")


def _frictions(draft: Draft) -> None:
    if draft.tables.friction is not None:
        _friction(draft, "friction", draft.tables.friction)
    if draft.tables.structure is not None:
        for index, interface in enumerate(draft.tables.structure.interface or ()):
            _friction(draft, f"structure.interface.{index}", interface)


def _friction(draft: Draft, at: str, law: Friction) -> None:
    _needs(draft, at, law, "law", LAWS)
    if draft.given(f"{at}.kinetic") and law.law not in ("coulomb", "nonlocal", None):
        draft.say(f"{at}.kinetic", f"law '{law.law}' has one coefficient only; kinetic belongs to coulomb and nonlocal")
    elif law.kinetic is not None and law.static is not None and law.kinetic > law.static:
        draft.say(f"{at}.kinetic", f"{law.kinetic} is larger than static = {law.static}; kinetic <= static is wanted")
    elif kinetic_unused(law):
        draft.remark(f"{at}.kinetic has no effect while the bond length is constant; add rest_growth and slip_growth")
    check_spread(draft, at, law)
    remark_temperature(draft, at, law)
    for key, other in (("rest_growth", "slip_growth"), ("slip_growth", "rest_growth")):
        if draft.given(f"{at}.{key}") and not draft.given(f"{at}.{other}"):
            draft.lacks(f"{at}.{other}", f"{key} needs it; leave both out for a constant bond length")
    printed = law.reading != "stretch" or law.law == "convolution"
    if law.order is not None and (law.order <= -1 or (law.order < 0 and not printed)):
        wanted = ">= 0 (reading 'stretch')" if not printed else "> -1 (reading 'report')"
        wanted = "> -1" if law.law == "convolution" else wanted
        draft.say(f"{at}.order", f"must be {wanted}, not {law.order}")
    if law.breakaway and law.reading == "report":
        draft.say(f"{at}.breakaway", "the law as printed (reading 'report') has none; use 'stretch' or leave it out")
    contact = draft.tables.contact
    if law.reading == "report" and law.law in ("nonlocal", None) and contact and contact.gives_way:
        draft.say(f"{at}.reading", f"'report' is refused beside {contact.gives_way}; use 'stretch' or leave it out")
    if law.static == 0 and contact and contact.gives_way:
        draft.say(f"{at}.static", f"0 beside {contact.gives_way}: no point carries friction; static > 0 is wanted, or "
                                  f"leave out {contact.gives_way}")  # fmt: skip


def kinetic_unused(law: Friction) -> bool:
    """Whether a smaller kinetic coefficient stands where no bond ever changes its length."""
    weaker = law.kinetic is not None and law.static is not None and law.kinetic < law.static
    return weaker and law.law == "nonlocal" and law.rest_growth is None and law.slip_growth is None


def _slide(draft: Draft) -> None:
    slide = draft.tables.slide
    if slide is None:
        return
    _needs(draft, "slide", slide, "kind", SLIDES)
    if slide.kind in ("constant", "dwell") and slide.distance == 0.0:
        draft.say("slide.distance", f"must be > 0 m for kind '{slide.kind}'")
    law = draft.tables.friction
    if slide.kind == "dwell" and slide.hold and law is not None and _ageless(law):
        draft.remark("slide.hold has no effect while nothing ages at rest; add friction.rest_growth and slip_growth to "
                     "law 'nonlocal'")  # fmt: skip


def _ageless(law: Friction) -> bool:
    ageless = ("coulomb", "elastic-plastic", "convolution")
    return law.law in ageless or (law.law == "nonlocal" and law.rest_growth is None)




def _kind(draft: Draft) -> str:
    """The kind of run from the tables that stand together, or a mistake for each one missing or in the way."""
    has = {name for name in ("contact", "normal", "friction", "slide", "structure", "drive", "wear")
           if draft.given(name)}  # fmt: skip
    if draft.given("structure.interface"):
        for name in sorted(has & {"friction", "normal", "contact"}):
            draft.say(name, f"[{name}] and [[structure.interface]] exclude each other: an interface carries its own")
        has |= {"friction", "normal"}
    if {"contact", "normal"} <= has:
        draft.say("normal", "[contact] and [normal] exclude each other: keep one source of the normal load")
        has.discard("normal")
    moves, pressed = has & {"structure", "drive"}, has & {"contact", "normal"}
    if "slide" in has and moves:
        draft.say("slide", "[slide] prescribes the motion, [structure] with [drive] computes it: keep one")
        return ""
    if has == {"contact"}:
        return "patch"
    if has == {"structure", "drive"}:
        return "linear"
    return _with_friction(draft, has, pressed, moves)


def _with_friction(draft: Draft, has: set[str], pressed: set[str], moves: set[str]) -> str:
    if not has:
        draft.lacks_table("contact", "a scene needs [contact], or [structure] with [drive], or both with [friction]")
        return ""
    if moves and "drive" not in has:
        draft.lacks_table("drive", "[structure] needs it")
    if moves and "structure" not in has:
        draft.lacks_table("structure", "[drive] needs it")
    friction = pressed or has & {"friction", "slide", "wear"}
    if friction and "friction" not in has:
        others = ", ".join(f"[{name}]" for name in sorted(has))
        draft.lacks_table("friction", f"{others} without it are no kind of run")
    if friction and draft.given("structure.masses") and not draft.given("structure.interface"):
        draft.lacks("structure.interface", "masses rub at interfaces between two of them: write "
                                           "[[structure.interface]] with its law and load instead of [friction]")
    if friction and not pressed:
        draft.lacks_table("contact", "friction needs a normal load, [contact] or [normal]")
    if friction and not moves and "slide" not in has:
        draft.lacks_table("slide", "friction needs a motion, [slide] or [structure] with [drive]")
    return "bench" if "slide" in has else "rig"


def _method(draft: Draft, kind: str) -> None:
    accuracy, law, contact = draft.tables.accuracy, draft.tables.friction, draft.tables.contact
    method = accuracy and accuracy.method
    if method in method_unused(kind):
        draft.remark(f"accuracy.method = '{method}' has no meaning in a {kind} scene and is not used")
    if method == "harmonic" and kind in ("rig", "linear"):
        _harmonic(draft)
    if method != "exact" or kind != "rig" or law is None or law.law is None:
        return
    shear = contact.gives_way if contact is not None else ""
    if law.law not in ("coulomb", "convolution") or shear:
        beside = f" beside {shear}" if shear else ""
        draft.say("accuracy.method", f"no exact solution exists for law '{law.law}'{beside}; use 'march' or leave "
                                     "method out")  # fmt: skip


def _harmonic(draft: Draft) -> None:
    """A steady motion needs a drive that repeats, and one way to find it for every force in the scene."""
    drive, structure, law = draft.tables.drive, draft.tables.structure, draft.tables.friction
    if drive is not None and (drive.kind == "free" or drive.waveform in ("step", "file")):
        draft.say("accuracy.method", "'harmonic' finds the steady motion under a sine, or its curve over a sweep or "
                                     "over levels; use 'march' or leave method out")  # fmt: skip
    elif drive is not None and drive.kind == "base" and drive.waveform == "sweep" and drive.displacement is not None:
        draft.say("accuracy.method", "'harmonic' keeps the acceleration over a sweep; give drive.acceleration")
    if structure is None:
        return
    bends = "[structure.stiffening]" if structure.stiffening is not None else ""
    if structure.bonded is not None and structure.bonded.wavelength is not None:
        bends = "structure.bonded.wavelength"
    rigid = law is not None and law.law in ("coulomb", "convolution")
    if bends and (rigid or any(one.law in ("coulomb", "convolution") for one in structure.interface)):
        draft.say("accuracy.method", f"'harmonic' with a law that jumps beside {bends}: use 'march', or law "
                                     "'elastic-plastic' with a short bond_length; not yet built")  # fmt: skip


def _quadrature(draft: Draft, kind: str) -> None:
    """An engine of the sum over bonds must be able to sum the law, and the run must have such a sum."""
    accuracy, law, contact = draft.tables.accuracy, draft.tables.friction, draft.tables.contact
    engine = accuracy and accuracy.quadrature
    if engine in (None, "auto") or f"accuracy.quadrature={engine}" in NOT_YET_BUILT:
        return
    if law is None or law.law != "nonlocal" or kind not in ("bench", "rig"):
        draft.remark(f"accuracy.quadrature = '{engine}' has no meaning without law 'nonlocal' and is not used")
        return
    alone = law.reading == "stretch" and law.order == 1
    key, shear = "accuracy.quadrature", contact.gives_way if contact is not None else ""
    if engine == "recursion" and not alone:
        draft.say(key, "'recursion' sums reading 'stretch' with order = 1 alone; use 'auto' or 'merged'")
    elif engine != "recursion" and shear:
        draft.say(key, f"'{engine}' beside {shear}: every point has its own path there; use 'recursion' or 'auto'")
    elif engine in ("merged", "exponential") and kind == "bench":
        draft.say(key, f"'{engine}' in a bench: use 'auto', 'direct' or 'truncated'; not yet built")
    elif engine == "exponential" and (law.reading != "report" or law.order not in (0, 1, 2)):
        draft.say(key, "'exponential' sums reading 'report' with order 0, 1 or 2 alone; use 'auto' or 'merged'")


def method_unused(kind: str) -> tuple[str, ...]:
    """Methods that a kind of run gives no meaning: without a time integration there is nothing to choose."""
    return ("exact", "march") if kind in ("patch", "bench") else ()


def _sliding(draft: Draft, kind: str) -> None:
    structure = draft.tables.structure
    modes = structure.mode if kind == "rig" and structure is not None else ()
    if modes and all(mode.slide == 0 for mode in modes):
        draft.say("structure.mode.0.slide", "0 in every mode, so nothing slides at the patch; give the slide of a mode "
                                            "that moves it, or leave out [friction] and its load")  # fmt: skip
