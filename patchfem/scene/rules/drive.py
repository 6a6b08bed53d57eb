"""Rules of [drive]: which keys its kind and its waveform need, which they give no meaning."""

from __future__ import annotations

from functools import cache
from typing import Any

from ...effects import NO_WAVEFORM, WAVEFORMS, Waveform, waveform_of
from .scene_draft import Draft
from .structure import drives_mass

LEAST = 0.25  # of a cycle, of a run


def check_drive(draft: Draft) -> None:
    """Say every mistake of [drive]."""
    drive = draft.tables.drive
    if drive is None:
        return
    waveform = waveform_of(drive) if drive.kind in ("base", "force") else NO_WAVEFORM
    if waveform.name:
        for key in waveform.required_keys:
            if not draft.given(f"drive.{key}"):
                draft.lacks(f"drive.{key}", f"waveform '{drive.waveform}' needs this key")
        for key in sorted(waveform_unused(drive)):
            if draft.given(f"drive.{key}"):
                draft.remark(
                    f"drive.{key} has no meaning for waveform '{drive.waveform}' and is not used"
                )
    cycles, duration = draft.given("drive.cycles"), draft.given("drive.duration")
    if cycles and duration:
        draft.say("drive.duration", "`cycles` and `duration` exclude each other: keep one")
    if not cycles and not duration and (drive.kind == "free" or waveform_of(drive).needs_length):
        draft.lacks("drive.cycles", "or drive.duration instead")
    _size(draft, drive)
    if drive.kind == "force" and waveform.is_for_base_only:
        draft.say(
            "drive.kind",
            f"waveform '{waveform.name}' can only shake the base; set drive.kind = 'base', or give "
            "a record of the force with drive.waveform = 'file'",
        )
    if waveform.is_swept:
        _sweep(draft, drive)
    if waveform.has_levels:
        _onset(draft, drive)
    if waveform.takes("frequencies"):
        _tones(draft, drive, waveform)
    if waveform.is_random:
        _random(draft, drive)


def _onset(draft: Draft, drive: Any) -> None:
    given = draft.given("drive.onset_length")
    if drive.onset == "gauge" and not given:
        draft.lacks("drive.onset_length", "onset 'gauge' needs this key, such as '0.01 mil'")
    if given and drive.onset != "gauge":
        draft.remark(f"drive.onset_length has no meaning for onset '{drive.onset}' and is not used")


def _sweep(draft: Draft, drive: Any) -> None:
    rate, octaves = draft.given("drive.rate"), draft.given("drive.log_rate")
    if rate and octaves:
        draft.say(
            "drive.log_rate", "`rate` (Hz/s) and `log_rate` (oct/min) exclude each other: keep one"
        )
    elif not rate and not octaves:
        draft.lacks("drive.rate", "or drive.log_rate instead, such as '1 oct/min'")
    if drive.from_ is not None and drive.from_ == drive.to:
        draft.say(
            "drive.to",
            f"{drive.to:g} Hz is also the frequency at which the sweep starts; give a different "
            "frequency",
        )


def _tones(draft: Draft, drive: Any, waveform: Waveform) -> None:
    for key in ("accelerations", "phases"):
        given = getattr(drive, key) if waveform.takes(key) else None
        if (
            given is not None
            and drive.frequencies is not None
            and len(given) != len(drive.frequencies)
        ):
            draft.say(
                f"drive.{key}",
                f"{len(given)} values for {len(drive.frequencies)} frequencies; give one value "
                "for each frequency",
            )
    if (
        waveform.takes("accelerations")
        and drive.accelerations is not None
        and not any(drive.accelerations)
    ):
        draft.say("drive.accelerations", "all accelerations are 0, so nothing moves")


def _random(draft: Draft, drive: Any) -> None:
    level, table = draft.given("drive.spectrum"), draft.given("drive.file")
    if level and table:
        draft.say("drive.file", "`spectrum` and `file` exclude each other: keep one")
    elif not level and not table:
        draft.lacks(
            "drive.spectrum", "or drive.file, a table with the header frequency [Hz],level [g^2/Hz]"
        )
    for key in ("from", "to") if level else ():
        if not draft.given(f"drive.{key}"):
            draft.lacks(
                f"drive.{key}",
                "drive.spectrum needs a lowest frequency (`from`) and a highest frequency (`to`)",
            )
    if drive.from_ is not None and drive.to is not None and drive.to <= drive.from_:
        draft.say("drive.to", f"{drive.to:g} Hz is not above drive.from, {drive.from_:g} Hz")


def _size(draft: Draft, drive: Any) -> None:
    acceleration, displacement = (
        draft.given("drive.acceleration"),
        draft.given("drive.displacement"),
    )
    waveform = waveform_of(drive)
    if drive.kind == "base" and waveform.takes("acceleration"):
        either = waveform.takes("displacement")
        if acceleration and displacement and either:
            draft.say(
                "drive.displacement",
                "`acceleration` and `displacement` exclude each other: keep one",
            )
        if not acceleration and not (displacement and either):
            draft.lacks(
                "drive.acceleration",
                "or drive.displacement instead"
                if either
                else f"waveform '{drive.waveform}' needs this key",
            )
    if drive.kind == "force" and waveform.takes("force") and not draft.given("drive.force"):
        draft.lacks("drive.force", "kind 'force' needs this key")
    begins = draft.given("structure.start")
    if drive.kind == "free" and not displacement and not begins:
        draft.lacks(
            "drive.displacement",
            "kind 'free' needs this key, the displacement from which the structure is "
            "released; instead you can give [structure.start]",
        )
    if drive.kind == "free" and displacement and begins:
        draft.say(
            "structure.start",
            "[structure.start] and drive.displacement exclude each other: keep one",
        )
    drives_mass(draft)
    for key in drive_unused(drive):
        if draft.given(f"drive.{key}"):
            draft.remark(f"drive.{key} has no meaning for kind '{drive.kind}' and is not used")


def drive_unused(drive: Any) -> list[str]:
    """Keys of [drive] that its kind gives no meaning, whatever the waveform."""
    without = {
        "base": ["force", "mass"],
        "force": ["acceleration", "displacement"],
        "free": [
            "acceleration",
            "force",
            "frequency",
            "from",
            "to",
            "rate",
            "log_rate",
            "levels",
            "onset",
            "onset_length",
            "file",
            "waveform",
            "spectrum",
            "seed",
            "frequencies",
            "accelerations",
            "phases",
        ],
    }
    return without.get(drive.kind, [])


def waveform_unused(drive: Any) -> frozenset[str]:
    """Keys of [drive] that its waveform gives no meaning, among those that depend on it."""
    return _unused(drive.waveform)


@cache
def _unused(waveform: str) -> frozenset[str]:
    needs, can = WAVEFORMS[waveform].keys
    dependent = {key for one in WAVEFORMS.values() for keys in one.keys for key in keys.split()}
    return frozenset(dependent - set(needs.split()) - set(can.split()))


def check_length(draft: Draft, kind: str) -> None:
    """Say a run that is shorter than a quarter of a cycle."""
    drive = draft.tables.drive
    if kind not in ("rig", "linear") or drive is None:
        return
    if drive.cycles is not None and drive.cycles < LEAST:
        draft.say(
            "drive.cycles",
            f"the run must last at least a quarter of a cycle: cycles >= {LEAST} is needed, not "
            f"{drive.cycles:g}",
        )
    elif (
        drive.duration is not None and drive.frequency and drive.duration * drive.frequency < LEAST
    ):
        draft.say("drive.duration", "the run must last at least a quarter of a cycle: duration >= "
                                    f"{LEAST / drive.frequency:g} s is needed, not {drive.duration:g} s")  # fmt: skip
