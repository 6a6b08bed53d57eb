"""What [wear] asks of the rest of a scene."""

from ...effects import has, unbuilt
from .draft import Draft
from .grooves import grooves_of

LATER = "leave out [wear] or {}"


def check_wear(draft: Draft, kind: str) -> None:
    """Say what [wear] cannot go with; silent about values not there."""
    tables = draft.tables
    if tables.wear is None:
        return
    if kind == "patch":
        draft.say("wear", "nothing slides: wear needs [friction] with [slide], or with [structure] and [drive]")
    for key, words in _beside(tables, kind):
        draft.say("wear", unbuilt(f"beside {key}", words))
    if draft.given("wear.scheme") and tables.wear.scheme == "explicit" and not draft.given("wear.jumps"):
        draft.lacks("wear.jumps", "scheme 'explicit' needs the number of its jumps")
    if tables.normal is not None:
        for key in ("jumps", "upper_share", "scheme"):
            if draft.given(f"wear.{key}"):
                draft.remark(f"wear.{key} has no meaning without [contact] and is not used")
    elif draft.given("wear.upper_share") and grooves_of(tables) is None and not _coated(tables.contact):
        draft.remark("wear.upper_share has no effect on the measures without grooves or a coating: worn_depth is that "
                     "of both pieces together")


def _coated(contact) -> bool:
    """Whether a piece of [contact] may have a coating."""
    pieces = () if contact is None else (contact.upper, contact.lower)
    return contact is not None and any(one is not None and one.coating is not None for one in (contact, *pieces))


def _beside(tables, kind: str):
    """Tables and values that wear does not go with, each with what to do."""
    contact, structure, drive = tables.contact, tables.structure, tables.drive
    method = tables.accuracy and tables.accuracy.method  # None where [accuracy] could not be read
    grooves = grooves_of(tables)
    if grooves is not None and tables.normal is not None and grooves[1].amplitude:
        yield f"[{grooves[0]}]", "a point has no area from which the wear lowers the grooves: use [contact]"
    if contact is not None and contact.strips is not None:
        yield "contact.strips", LATER.format("the strips")
    if tables.normal is not None and tables.normal.amplitude and kind == "rig":
        yield "normal.amplitude", LATER.format("the amplitude")
    if structure is not None and structure.interface:
        yield "[[structure.interface]]", LATER.format("write one interface as [friction] and [normal]")
    if structure is not None and any(mode.normal or mode.pitch or mode.yaw for mode in structure.mode or ()):
        yield "modes with normal, pitch or yaw", LATER.format("these keys")
    if kind == "rig" and drive is not None and (drive.kind == "free" or drive.waveform not in (None, "sine")):
        yield f"a drive '{drive.kind if drive.kind == 'free' else drive.waveform}'", \
            "wear repeats the last cycle of a steady motion: use " + \
            ("kind 'base' or 'force'" if drive.kind == "free" else "waveform 'sine'")
    if kind == "rig" and method in ("duhamel", "newmark", "euler", "harmonic"):
        yield f"accuracy.method '{method}'", "use 'auto', 'exact' or 'march'"
    if tables.friction is not None and has(tables.friction.law, "averaged"):
        yield f"law '{tables.friction.law}'", LATER.format("use law 'coulomb'")
