"""Rules of [drive]: keys that its kind and its waveform need, exclude or do not use."""

from ...effects import find_waveform
from .facts import TableFacts
from .scene_draft import SceneDraft

# Smallest number of cycles in a run; a shorter one does not reach the first peak of the drive.
MIN_DRIVE_CYCLES = 0.25


def check_drive(draft: SceneDraft) -> None:
    """Report mistakes inside [drive] of a scene draft."""
    drive = TableFacts(draft, "drive", draft.tables.drive)
    if drive.kind in ("base", "force"):
        _check_waveform(drive)


def _check_waveform(drive: TableFacts) -> None:
    """Report values of [drive] with which its waveform has no meaning."""
    wave = find_waveform(drive.table)
    if drive.kind == "force" and wave.is_for_base_only:
        drive.add_mistake(
            "kind",
            f"waveform '{drive.waveform}' can only shake the base; set drive.kind = 'base', or give a record of the "
            "force with drive.waveform = 'file'",
        )
    amplitudes = drive.accelerations
    if wave.accepts_key("accelerations") and amplitudes and not any(amplitudes):
        drive.add_mistake(
            "accelerations", "all accelerations are 0, so nothing moves; give one above 0"
        )

    # The two frequencies of a sweep, or of the band of a random drive.
    if wave.is_swept and drive.from_ == drive.to:
        drive.add_mistake(
            "to",
            f"{drive.to:g} Hz is also the frequency at which the sweep starts; give a different frequency",
        )
    if wave.is_random and drive.to <= drive.from_:
        drive.add_mistake(
            "to",
            f"{drive.to:g} Hz is not above drive.from, {drive.from_:g} Hz; "
            "raise it, or lower drive.from",
        )
    for key in ("from", "to"):
        if wave.is_random and drive.has("spectrum") and not drive.has(key):
            drive.add_missing(
                key,
                "drive.spectrum needs a lowest frequency (`from`) and a highest frequency (`to`)",
            )


def check_length(draft: SceneDraft, kind: str) -> None:
    """Report a draft whose run is shorter than a quarter of a drive cycle.

    `kind` is the kind of scene. Only "rig" and "linear" have a drive.
    """
    if kind not in ("rig", "linear"):
        return
    drive = TableFacts(draft, "drive", draft.tables.drive)
    advice = "the run must last at least a quarter of a cycle"
    if drive.cycles < MIN_DRIVE_CYCLES:
        drive.add_mistake(
            "cycles", f"{advice}: cycles >= {MIN_DRIVE_CYCLES} is needed, not {drive.cycles:g}"
        )
    elif drive.duration * drive.frequency < MIN_DRIVE_CYCLES:
        shortest = MIN_DRIVE_CYCLES / drive.frequency
        drive.add_mistake(
            "duration",
            f"{advice}: duration >= {shortest:g} s is needed, not {drive.duration:g} s",
        )
