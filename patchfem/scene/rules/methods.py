"""What the engine that accuracy.method names does not take: one reason at most, with what serves meanwhile."""

from __future__ import annotations

from typing import Any, NamedTuple

from ...effects import LAWS, WAVEFORMS, carries, has, named, refusal, unbuilt, waves
from ..keys.tables import Tables
from .draft import Draft

KEY = "accuracy.method"


class Motion(NamedTuple):
    """What an engine meets: laws of all interfaces; soft: what lets the patch slip part by part; varies: how the load
    changes; apart: strips slide each by themselves; spring that bends, or grooves; drive as its table; lower:
    the key that puts the pressure on the lower piece. Texts are empty where there is nothing."""

    laws: list
    soft: str
    varies: str
    apart: bool
    spring: str
    drive: Any
    lower: str


def check_method(draft: Draft, kind: str) -> None:
    """Say why the engine that the scene names cannot run it, or that it has no meaning."""
    accuracy = draft.tables.accuracy
    method = accuracy and accuracy.method
    if method in method_unused(kind):
        draft.remark(f"accuracy.method = '{method}' has no meaning in a {kind} scene and is not used")
    if kind not in ("rig", "linear") or method in (None, "auto", "march"):
        return
    found = motion(draft.tables, kind)
    if reason := {"exact": _exact, "harmonic": _harmonic}.get(method, _compared)(found, method):
        draft.say(KEY, reason)


def method_unused(kind: str) -> tuple[str, ...]:
    """Methods that a kind of run gives no meaning: without a time integration there is nothing to choose."""
    return ("exact", "march") if kind in ("patch", "bench") else ()


def motion(tables: Tables, kind: str) -> Motion:
    """What an engine meets in a scene, as far as its tables could be read."""
    contact, structure, rubs = tables.contact, tables.structure, kind == "rig"
    laws = [one for one in (tables.friction, *((structure.interface if structure is not None else ()) or ()))
            if rubs and one is not None and one.law is not None]
    cause = changing_load(tables) if laws else ""
    apart = rubs and contact is not None and contact.strips is not None and bool(turning(tables))
    lower = [f"contact.{name}.on = 'lower'" for name, one in (contact.shapes if contact is not None else {}).items()
             if one.on == "lower"]
    return Motion(laws, contact.gives_way if rubs and contact is not None else "", beside_load(cause), apart,
                  bending(structure) or (climbed(tables) if rubs else ""), tables.drive,
                  lower[0] if rubs and lower else "")


def bending(structure) -> str:
    """The spring beside the contact that is not linear, as the scene writes it; empty where there is none."""
    if structure is None:
        return ""
    if structure.stiffening is not None:
        return "[structure.stiffening]"
    bends = structure.bonded is not None and structure.bonded.wavelength is not None
    return "structure.bonded.wavelength" if bends else ""


def climbed(tables: Tables) -> str:
    """The grooves that the load climbs, as the scene writes them; empty where there are none, or they are flat."""
    for name in ("contact", "normal"):
        table = getattr(tables, name)
        if table is not None and table.grooves is not None and table.grooves.amplitude:
            return f"[{name}.grooves]"
    return ""


def turning(tables: Tables) -> str:
    """Key of the first mode that yaws the patch; empty where none does."""
    modes = (tables.structure.mode if tables.structure is not None else ()) or ()
    return next((f"structure.mode.{k}.yaw" for k, mode in enumerate(modes) if mode.yaw), "")


def changing_load(tables: Tables) -> str:
    """The key by which the load of a rig changes, empty where it stays."""
    normal, structure = tables.normal, tables.structure
    if normal is not None and normal.amplitude:
        return "normal.amplitude"
    for index, mode in enumerate((structure.mode if structure is not None else ()) or ()):
        for key in ("normal", "pitch"):
            if getattr(mode, key, None):
                return f"structure.mode.{index}.{key}"
    return ""


def beside_load(cause: str) -> str:
    """The key that changes the load as the words behind another effect: "beside a mode's pitch"."""
    if cause in ("", "normal.amplitude"):
        return cause and f"beside {cause}"
    return f"beside a mode's {cause.rpartition('.')[2]}"


def no_closed_form(laws: list, soft: str, varies: str, apart: bool, waveform: str, spring: str) -> str:
    """Why a run has no exact solution; empty where it has one.

    laws: names; waveform: "" where the engine drives by sines of its own; the others as in a Motion. Constants and
    sines have closed forms, and a sweep or the rows of a record have series between the events.
    """
    odd = next((law for law in laws if "exact" not in LAWS[law].carries.split()), laws[0] if soft and laws else "")
    if odd:
        return f"for law '{odd}'" + (f" beside {soft}" if soft else "")
    if varies:
        return varies
    if apart and waveform == "levels":
        return "beside strips that yaw, level by level"
    return f"beside {spring}" if spring else ""


def no_pieces(laws: list, soft: str, varies: str, apart: bool, waveform: str, spring: str) -> str:
    """Why a run is not linear from yield to yield, as elements that stick or slip make it; empty where it is.

    Arguments as in `no_closed_form`. Coulomb's law is such a law where the pieces give way.
    """
    odd = next((law for law in laws if "pieces" not in LAWS[law].carries.split()
                or (has(law, "set-valued") and not soft)), "" if laws else "none")
    if odd:
        return f"for law '{odd}'" + (f" beside {soft}" if soft else "")
    if varies:
        return varies
    if apart:
        return "beside strips that yaw"
    return f"beside {spring}" if spring else ""


def balances_over_grooves(law) -> bool:
    """Whether the harmonic balance takes the law of a [friction] table along the flanks of grooves."""
    return carries(law, "varying-load") and carries(law, "harmonic") and not has(law.law, "bonds")


def _exact(m: Motion, method: str) -> str:
    waveform = m.drive.waveform if m.drive is not None and m.drive.kind != "free" else ""
    laws = [one.law for one in m.laws]
    meets = m.soft, m.varies, m.apart, waveform, m.spring
    why = no_closed_form(laws, *meets)
    yields = laws and all("pieces" in LAWS[law].carries.split() for law in laws)
    if why and yields and (m.soft or not all("exact" in LAWS[law].carries.split() for law in laws)):
        why = no_pieces(laws, *meets)
    return f"no exact solution exists {why}; use 'march' or leave method out" if why else ""


def _common(m: Motion, method: str) -> str:
    """What only the march takes."""
    if m.apart:
        return unbuilt(f"'{method}' beside strips that yaw", "march")
    return unbuilt(f"'{method}' {m.varies} takes the load as constant", "march") if m.varies else ""


def _harmonic(m: Motion, method: str) -> str:
    """A steady motion needs a drive that repeats, and one way to find it for every force in the scene."""
    drive = m.drive
    once = drive is not None and drive.waveform in WAVEFORMS and not waves(drive.waveform, "steady")
    if drive is not None and (drive.kind == "free" or once):
        return ("'harmonic' finds the steady motion under a sine, or its curve over a sweep or over levels; use "
                "'march' or leave method out")
    if drive is not None and drive.kind == "base" and drive.waveform == "sweep" and drive.displacement is not None:
        return "'harmonic' keeps the acceleration over a sweep; give drive.acceleration"
    if reason := _common(m, method):
        return reason
    if not m.laws or not no_closed_form([one.law for one in m.laws], m.soft, "", False, "", m.spring):
        return ""
    if m.spring.endswith("grooves]"):  # by a balance, or a march that is brought to repeat
        return ""
    law = m.laws[0]
    if len(m.laws) > 1:
        if not no_pieces([one.law for one in m.laws], m.soft, "", False, "", m.spring):
            return ""
        return unbuilt("'harmonic' beside several interfaces where a law has no exact solution or a spring bends",
                       "march")
    if has(law.law, "set-valued") and not m.soft:
        return unbuilt(f"'harmonic' with a law that jumps beside {m.spring}", "march or stiff")
    if not has(law.law, "set-valued") and not carries(law, "harmonic"):
        return f"'harmonic' with {named(law)}: use 'march', or {refusal('harmonic', odd=law)}"
    beside = next((key for key in ("rest_growth", "breakaway") if getattr(law, key)), "")
    beside = f"friction.{beside}" if beside else m.soft or m.lower
    return unbuilt(f"'harmonic' with law '{law.law}' beside {beside}", "march") if has(law.law, "bonds") and beside \
        else ""


def _compared(m: Motion, method: str) -> str:
    """The comparison methods take one force per interface and linear modes."""
    odd = next((one for one in m.laws if not carries(one, "comparison")), None)
    if odd is not None:
        return f"'{method}' with {named(odd)}: use 'march', or {refusal('comparison', odd=odd)}"
    if reason := _common(m, method):
        return reason
    if m.soft:
        return f"'{method}' takes an interface as a whole, not {m.soft}; use 'march' or leave method out"
    return unbuilt(f"'{method}' beside {m.spring}", "march") if m.spring else ""
