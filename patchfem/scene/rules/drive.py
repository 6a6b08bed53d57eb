"""Rules of [drive]: keys that its kind and its waveform need, exclude or do not use."""

from __future__ import annotations

from functools import cached_property

from ...effects import Waveform, find_waveform
from .rule_table import MissingKeyRule, MistakeRule, TableFacts, apply_rules
from .scene_draft import SceneDraft

# Smallest number of cycles in a run; a shorter one does not reach the first peak of the drive.
MIN_CYCLES = 0.25


class DriveFacts(TableFacts):
    """Properties of the scene that the checks of [drive] use."""

    @cached_property
    def wave(self) -> Waveform:
        """Record of the waveform, or NO_WAVEFORM for a release."""
        return find_waveform(self.table)

    @property
    def is_random(self) -> bool:
        """Whether the drive signal is a random record."""
        return self.wave.is_random

    @property
    def min_duration(self) -> float:
        """Shortest duration [s]."""
        return MIN_CYCLES / self.frequency


SIZE_RULES = (
    MissingKeyRule(
        lambda d: (
            d.kind == "free" and not d.has("displacement") and not d.draft.has("structure.start")
        ),
        "drive.displacement",
        "kind 'free' needs this key, the displacement from which the structure is released; instead you can give "
        "[structure.start]",
    ),
    MistakeRule(
        lambda d: d.kind == "free" and d.has("displacement") and d.draft.has("structure.start"),
        "structure.start",
        "[structure.start] and drive.displacement exclude each other: keep one",
    ),
)
WAVEFORM_RULES = (
    MistakeRule(
        lambda d: d.kind == "force" and d.wave.is_for_base_only,
        "drive.kind",
        "waveform '{waveform}' can only shake the base; set drive.kind = 'base', or give a record of the force with "
        "drive.waveform = 'file'",
    ),
    MistakeRule(
        lambda d: d.wave.is_swept and d.from_ == d.to,
        "drive.to",
        "{to:g} Hz is also the frequency at which the sweep starts; give a different frequency",
    ),
    MistakeRule(
        lambda d: (
            d.wave.accepts_key("accelerations") and d.accelerations and not any(d.accelerations)
        ),
        "drive.accelerations",
        "all accelerations are 0, so nothing moves",
    ),
    *(
        MissingKeyRule(
            lambda d, key=key: d.is_random and d.has("spectrum") and not d.has(key),
            f"drive.{key}",
            "drive.spectrum needs a lowest frequency (`from`) and a highest frequency (`to`)",
        )
        for key in ("from", "to")
    ),
    MistakeRule(
        lambda d: d.is_random and d.to <= d.from_,
        "drive.to",
        "{to:g} Hz is not above drive.from, {from_:g} Hz",
    ),
)
LENGTH_RULES = (
    MistakeRule(
        lambda d: d.cycles < MIN_CYCLES,
        "drive.cycles",
        f"the run must last at least a quarter of a cycle: cycles >= {MIN_CYCLES} is needed, not {{cycles:g}}",
    ),
    MistakeRule(
        lambda d: not d.cycles < MIN_CYCLES and d.duration * d.frequency < MIN_CYCLES,
        "drive.duration",
        "the run must last at least a quarter of a cycle: duration >= {min_duration:g} s is needed, not {duration:g} s",
    ),
)


def check_drive(draft: SceneDraft) -> None:
    """Report mistakes inside [drive]."""
    drive = draft.tables.drive
    if drive is None:
        return
    facts = DriveFacts(draft, "drive", drive)
    apply_rules(draft, SIZE_RULES, facts)
    if facts.kind in ("base", "force"):
        apply_rules(draft, WAVEFORM_RULES, facts)


def check_length(draft: SceneDraft, kind: str) -> None:
    """Report a run that is shorter than a quarter of a cycle."""
    if kind in ("rig", "linear") and draft.tables.drive is not None:
        apply_rules(draft, LENGTH_RULES, DriveFacts(draft, "drive", draft.tables.drive))
