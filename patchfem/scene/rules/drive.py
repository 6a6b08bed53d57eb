"""Rules of [drive]: keys that its kind and its waveform need, exclude or do not use."""

from __future__ import annotations

from functools import cached_property

from ...effects import Waveform, find_waveform
from ..keys.tables import Drive
from .rule_table import MissingKeyRule, MistakeRule, RemarkRule, TableFacts, apply_rules
from .scene_draft import SceneDraft
from .selectors import WAVEFORM_SELECTOR, check_selector, list_dependent_keys, list_unused_keys
from .structure import check_driven_mass

# Smallest number of cycles in a run; a shorter one does not reach the first peak of the drive.
MIN_CYCLES = 0.25
RELEASE_KEYS = {"displacement", "cycles", "duration"}  # keys of waveforms that a release also uses
KEYS_UNUSED_BY_KIND = {  # keys that have no meaning for a drive.kind, whatever the waveform
    "base": ("force", "mass"),
    "force": ("acceleration", "displacement"),
    "free": ("waveform", *sorted(list_dependent_keys(WAVEFORM_SELECTOR) - RELEASE_KEYS)),
}


class DriveFacts(TableFacts):
    """Properties of the scene that the checks of [drive] use."""

    @cached_property
    def wave(self) -> Waveform:
        """Record of the waveform, or NO_WAVEFORM for a release."""
        return find_waveform(self.table)

    @property
    def is_driven(self) -> bool:
        """Whether the kind of drive is known and is not a release."""
        return self.kind in ("base", "force")

    @property
    def has_length(self) -> bool:
        """Whether the scene states when the run ends."""
        return self.has_any("cycles", "duration")

    @property
    def is_accelerated(self) -> bool:
        """Whether the base moves with an acceleration of constant amplitude."""
        return self.kind == "base" and self.wave.accepts_key("acceleration")

    @property
    def can_be_given_as_displacement(self) -> bool:
        """Whether a displacement may be given instead of the base acceleration."""
        return self.is_accelerated and self.wave.accepts_key("displacement")

    @property
    def has_start(self) -> bool:
        """Whether the scene has [structure.start]."""
        return self.draft.has("structure.start")

    @property
    def is_random(self) -> bool:
        """Whether the drive signal is a random record."""
        return self.wave.is_random

    @property
    def min_duration(self) -> float:
        """Shortest duration [s]."""
        return MIN_CYCLES / self.frequency


SIZE_RULES = (
    MistakeRule(
        lambda d: d.has("cycles", "duration"),
        "drive.duration",
        "`cycles` and `duration` exclude each other: keep one",
    ),
    MissingKeyRule(
        lambda d: not d.has_length and (d.kind == "free" or d.wave.needs_duration),
        "drive.cycles",
        "or drive.duration instead",
    ),
    MistakeRule(
        lambda d: d.can_be_given_as_displacement and d.has("acceleration", "displacement"),
        "drive.displacement",
        "`acceleration` and `displacement` exclude each other: keep one",
    ),
    MissingKeyRule(
        lambda d: d.can_be_given_as_displacement and not d.has_any("acceleration", "displacement"),
        "drive.acceleration",
        "or drive.displacement instead",
    ),
    MissingKeyRule(
        lambda d: (
            d.is_accelerated and not d.can_be_given_as_displacement and not d.has("acceleration")
        ),
        "drive.acceleration",
        "waveform '{waveform}' needs this key",
    ),
    MissingKeyRule(
        lambda d: d.kind == "force" and d.wave.accepts_key("force") and not d.has("force"),
        "drive.force",
        "kind 'force' needs this key",
    ),
    MissingKeyRule(
        lambda d: d.kind == "free" and not d.has("displacement") and not d.has_start,
        "drive.displacement",
        "kind 'free' needs this key, the displacement from which the structure is released; instead you can give "
        "[structure.start]",
    ),
    MistakeRule(
        lambda d: d.kind == "free" and d.has("displacement") and d.has_start,
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
        lambda d: d.wave.is_swept and d.has("rate", "log_rate"),
        "drive.log_rate",
        "`rate` (Hz/s) and `log_rate` (oct/min) exclude each other: keep one",
    ),
    MissingKeyRule(
        lambda d: d.wave.is_swept and not d.has_any("rate", "log_rate"),
        "drive.rate",
        "or drive.log_rate instead, such as '1 oct/min'",
    ),
    MistakeRule(
        lambda d: d.wave.is_swept and d.from_ == d.to,
        "drive.to",
        "{to:g} Hz is also the frequency at which the sweep starts; give a different frequency",
    ),
    MissingKeyRule(
        lambda d: d.wave.has_levels and d.onset == "gauge" and not d.has("onset_length"),
        "drive.onset_length",
        "onset 'gauge' needs this key, such as '0.01 mil'",
    ),
    RemarkRule(
        lambda d: d.wave.has_levels and d.has("onset_length") and d.onset != "gauge",
        "drive.onset_length",
        "has no meaning for onset '{onset}' and is not used",
    ),
    MistakeRule(
        lambda d: (
            d.wave.accepts_key("accelerations") and d.accelerations and not any(d.accelerations)
        ),
        "drive.accelerations",
        "all accelerations are 0, so nothing moves",
    ),
    MistakeRule(
        lambda d: d.is_random and d.has("spectrum", "file"),
        "drive.file",
        "`spectrum` and `file` exclude each other: keep one",
    ),
    MissingKeyRule(
        lambda d: d.is_random and not d.has_any("spectrum", "file"),
        "drive.spectrum",
        "or drive.file, a table with the header frequency [Hz],level [g^2/Hz]",
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
    if facts.is_driven:
        check_selector(facts, WAVEFORM_SELECTOR)
    apply_rules(draft, SIZE_RULES, facts)
    check_driven_mass(draft)
    for key in _list_keys_unused_by_kind(drive):
        if facts.has(key):
            draft.add_remark(
                f"drive.{key}", f"has no meaning for kind '{drive.kind}' and is not used"
            )
    if facts.is_driven:
        apply_rules(draft, WAVEFORM_RULES, facts)
        _check_tones(facts)


def check_length(draft: SceneDraft, kind: str) -> None:
    """Report a run that is shorter than a quarter of a cycle."""
    if kind in ("rig", "linear") and draft.tables.drive is not None:
        apply_rules(draft, LENGTH_RULES, DriveFacts(draft, "drive", draft.tables.drive))


def _check_tones(drive: DriveFacts) -> None:
    """Report drive lists whose length differs from the number of frequencies."""
    for key in ("accelerations", "phases"):
        values = drive[key]
        if not (drive.wave.accepts_key("frequencies") and drive.wave.accepts_key(key)):
            continue
        if values and drive.frequencies and len(values) != len(drive.frequencies):
            drive.draft.add_mistake(
                f"drive.{key}",
                f"{len(values)} values for {len(drive.frequencies)} frequencies; give one value for each frequency",
            )


def list_unused_drive_keys(drive: Drive) -> set[str]:
    """Return the keys of [drive] that have no meaning for its kind or its waveform."""
    by_waveform = list_unused_keys(drive, WAVEFORM_SELECTOR) if drive.kind != "free" else ()
    return {*_list_keys_unused_by_kind(drive), *by_waveform}


def _list_keys_unused_by_kind(drive: Drive) -> tuple[str, ...]:
    """Return the keys of [drive] that have no meaning for its kind with any waveform."""
    return KEYS_UNUSED_BY_KIND.get(drive.kind, ())
