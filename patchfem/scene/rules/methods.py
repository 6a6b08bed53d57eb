"""What the engine that accuracy.method names does not take: one reason at most, with what serves meanwhile."""

from __future__ import annotations

from typing import Any, NamedTuple

from ...effects import Waveform, carries, has, named, not_supported_message, refusal, waveform_of
from ..keys.tables import Interface, Tables
from .scene_draft import Draft

KEY = "accuracy.method"


class Motion(NamedTuple):
    """What a method meets: tables of the laws of all interfaces; give: what lets the patch of each slip part by part;
    varies: how the load changes; yaws: strips slide each by themselves; spring that bends, or grooves; waveform of the
    drive, NO_WAVEFORM of a release and of the sine of a curve; drive as its table; lower: the key that puts the
    pressure on the lower piece; plane: whether an interface slides in one. Texts are empty where there is nothing."""

    laws: list
    give: list
    varies: str
    yaws: bool
    spring: str
    waveform: Waveform
    drive: Any = None
    lower: str = ""
    plane: bool = False

    @property
    def soft(self) -> str:
        """What lets the first patch that slips part by part do so."""
        return next(filter(None, self.give), "")


class Takes(NamedTuple):
    """What an engine takes: law: the word of `effects.carries` that every law must have, "" for any; beside: words of
    BESIDE for what may stand beside it."""

    law: str
    beside: str


BESIDE = {  # word -> what a Motion has of it, as words behind an engine; "" where it has none
    "no-law": lambda m: "" if m.laws else "for law 'none'",
    "load": lambda m: m.varies,
    "yaw": lambda m: "with strips that yaw" if m.yaws else "",
    "yaw-levels": lambda m: (
        "with strips that yaw and waveform 'levels'" if m.yaws and m.waveform.has_levels else ""
    ),
    "parts": lambda m: f"with {m.soft}" if m.laws and m.soft else "",
    "grooves": lambda m: f"with {m.spring}" if m.spring.endswith("grooves]") else "",
    "spring": lambda m: (
        f"with {m.spring}" if m.spring and not m.spring.endswith("grooves]") else ""
    ),
    "plane": lambda m: "with structure.interface.lateral" if m.plane else "",
    "faces": lambda m: "with several interfaces" if len(m.laws) > 1 else "",
    "levels": lambda m: "with waveform 'levels'" if m.waveform.has_levels else "",
}
TAKES = {  # engine -> what it takes; the records of `runs.rig.engines` refer to it by name
    "exact": Takes("exact", "no-law yaw faces levels"),
    "piecewise": Takes("pieces", "parts faces levels"),
    "smooth": Takes("", ""),
    "march": Takes("", " ".join(BESIDE)),
    "harmonic": Takes("", "no-law parts grooves spring faces levels"),
}
# accuracy.method -> engines of that name, where they are several
METHODS = {"exact": ("exact", "piecewise")}


def lacking(engine: str, m: Motion) -> str:
    """The first thing in a Motion that an engine of TAKES does not take, as words behind it; "" where it takes all."""
    return first_lacking(TAKES[engine], m)


def first_lacking(takes: Takes, m: Motion) -> str:
    """Return the first thing in a Motion that is not taken, as words behind an engine; "" where all is taken."""
    odd = _odd(takes.law, m)
    if odd is not None:
        soft = next(give for one, give in zip(m.laws, m.give) if one is odd)
        return f"for law '{odd.law}'" + (f" with {soft}" if soft else "")
    beside = takes.beside.split()
    return next(
        (words for word, of in BESIDE.items() if word not in beside and (words := of(m))), ""
    )


def _odd(word: str, m: Motion):
    """The first law of a Motion that an engine which asks for a word of `carries` does not take; None where it takes
    all.

    An exact engine of slips as a whole has no law beside pieces that give way; one of yields has elements behind a
    law that holds without a stretch only there.
    """
    behind = {
        "exact": lambda law, soft: not soft,
        "pieces": lambda law, soft: soft or not has(law, "set-valued"),
    }.get(word, lambda law, soft: True)
    return next(
        (
            one
            for one, soft in zip(m.laws, m.give)
            if word and not (carries(one, word) and behind(one.law, soft))
        ),
        None,
    )


def check_method(draft: Draft, kind: str) -> None:
    """Say why the engine that the scene names cannot run it, or that it has no meaning."""
    accuracy = draft.tables.accuracy
    method = accuracy and accuracy.method
    if method in method_unused(kind):
        draft.remark(
            f"accuracy.method = '{method}' has no meaning in a {kind} scene and is not used"
        )
    if kind not in ("rig", "linear") or method in (None, "auto", "march"):
        return
    found = motion(draft.tables, kind)
    if reason := {"exact": _exact, "harmonic": _harmonic}[method](found, method):
        draft.say(KEY, reason)


def method_unused(kind: str) -> tuple[str, ...]:
    """Methods that a kind of run gives no meaning: without a time integration there is nothing to choose."""
    return ("exact", "march") if kind in ("patch", "bench") else ()


def motion(tables: Tables, kind: str) -> Motion:
    """What an engine meets in a scene, as far as its tables could be read."""
    contact, structure, rubs = tables.contact, tables.structure, kind == "rig"
    laws = [
        one
        for one in (
            tables.friction,
            *((structure.interface if structure is not None else ()) or ()),
        )
        if rubs and one is not None and one.law is not None
    ]
    cause = changing_load(tables) if laws else ""
    apart = rubs and contact is not None and contact.strips is not None and bool(turning(tables))
    lower = [
        f"contact.{name}.on = 'lower'"
        for name, one in (contact.shapes if contact is not None else {}).items()
        if one.on == "lower"
    ]
    drive = tables.drive
    give = [
        one.gives_way
        if isinstance(one, Interface)
        else contact.gives_way
        if contact is not None
        else ""
        for one in laws
    ]
    return Motion(
        laws,
        give,
        beside_load(cause),
        apart,
        bending(structure) or (climbed(tables) if rubs else ""),
        waveform_of(drive),
        drive,
        lower[0] if rubs and lower else "",
        any(getattr(one, "lateral", None) is not None for one in laws),
    )


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
    """The key that changes the load as the words behind another effect: "with a mode's pitch"."""
    if cause in ("", "normal.amplitude"):
        return cause and f"with {cause}"
    return f"with a mode's {cause.rpartition('.')[2]}"


def _exact(m: Motion, method: str) -> str:
    reasons = {engine: lacking(engine, m) for engine in METHODS[method]}
    if not all(reasons.values()):
        return ""
    why = next(
        (reason for engine, reason in reasons.items() if _odd(TAKES[engine].law, m) is None),
        reasons["exact"],
    )
    return f"no exact solution exists {why}; use 'march' or leave `method` out"


def _harmonic(m: Motion, method: str) -> str:
    """A steady motion needs a drive that repeats, and one way to find it for every force in the scene."""
    drive = m.drive
    once = m.waveform.name and not m.waveform.has_steady_motion
    if drive is not None and (drive.kind == "free" or once):
        return (
            "'harmonic' finds only steady motion: under a sine, over the frequencies of a sweep, or over the "
            "levels of waveform 'levels'; use 'march' or leave `method` out"
        )
    if (
        drive is not None
        and drive.kind == "base"
        and m.waveform.is_swept
        and drive.displacement is not None
    ):
        return (
            "'harmonic' needs a constant acceleration over a sweep; give drive.acceleration in place of "
            "drive.displacement"
        )
    if why := lacking(method, m):
        return not_supported_message(f"'{method}' {why}", "march")
    if (
        not m.laws
        or not all(lacking(engine, m) for engine in METHODS["exact"])
        or m.spring.endswith("grooves]")
    ):
        return ""  # over grooves a march is brought to repeat
    law = m.laws[0]
    if len(m.laws) > 1:
        return not_supported_message(
            "'harmonic' with several interfaces and a law without exact solution or a nonlinear spring",
            "march",
        )
    if has(law.law, "set-valued") and not m.soft:
        return not_supported_message(
            f"'harmonic' with law '{law.law}', whose force jumps, and {m.spring}", "march or stiff"
        )
    if not has(law.law, "set-valued") and not carries(law, "harmonic"):
        return not_supported_message(
            f"'harmonic' with {named(law)}", f"use 'march', or {refusal('harmonic', odd=law)}"
        )
    beside = next((key for key in ("rest_growth", "breakaway") if getattr(law, key)), "")
    beside = f"friction.{beside}" if beside else m.soft or m.lower
    return (
        not_supported_message(f"'harmonic' with law '{law.law}' and {beside}", "march")
        if has(law.law, "bonds") and beside
        else ""
    )
