"""Selector keys such as friction.law, whose value decides which other keys are used."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from pydantic import BaseModel

from ... import effects
from ..keys.contact import Asperities
from ..keys.tables import Drive, Friction, Slide
from ..keys.types import attributes_by_key
from .rule_table import TableFacts

HERTZ_PEAK_DESCRIPTIONS = (  # alternative descriptions of the peaks of law 'hertz'
    ("radius", "density", "height_deviation"),
    ("from",),
    ("rms_height", "rms_slope", "rms_curvature"),
)
KEYS_WITH_OWN_RULE = ("kinetic", "spread")  # unused keys of [friction] that other rules report


@dataclass(frozen=True, eq=False, slots=True)
class Selector:
    """A key whose value decides which other keys of its table are required or used.

    - model: the table.
    - key: the selector key of the table.
    - choices: value of the selector -> (required keys, optional keys), each a text with keys separated by
      blanks; "a|b" stands for one of two keys. A key that stands in neither text is not used with this value.
    """

    model: type[BaseModel]
    key: str
    choices: dict[str, tuple[str, str]]


LAW_SELECTOR = Selector(Friction, "law", {name: law.keys for name, law in effects.LAWS.items()})
SLIDE_KIND_SELECTOR = Selector(
    Slide,
    "kind",
    {
        "constant": ("speed distance", ""),
        "sine": ("amplitude frequency", "cycles"),
        "triangle": ("amplitude speed", "distance cycles"),
        "dwell": ("speed distance hold", "distance_after"),
        "file": ("file", ""),
    },
)
ASPERITY_LAW_SELECTOR = Selector(
    Asperities,
    "law",
    {
        "linear": ("normal_stiffness", "cutoff tangential_ratio"),
        "exponential": ("decay_length", "normal_stiffness cutoff tangential_ratio"),
        "hertz": (
            "",
            "radius density height_deviation from rms_height rms_slope rms_curvature cutoff tangential_ratio",
        ),
    },
)
WAVEFORM_SELECTOR = Selector(
    Drive, "waveform", {name: waveform.keys for name, waveform in effects.WAVEFORMS.items()}
)
# Selectors that the schema and the suggestions explain, by the dotted key of their table.
SELECTORS = {
    "friction": LAW_SELECTOR,
    "slide": SLIDE_KIND_SELECTOR,
    "contact.asperities": ASPERITY_LAW_SELECTOR,
}


def split_keys(words: str) -> list[str]:
    """Split a list of required keys, with alternatives as separate keys."""
    return words.replace("|", " ").split()


def list_unused_keys(table: BaseModel, selector: Selector) -> tuple[str, ...]:
    """Return the keys of a table that depend on the selector and have no meaning for its value."""
    return _list_keys_unused_by_value(type(table), selector, getattr(table, selector.key))


@cache
def _list_keys_unused_by_value(
    model: type[BaseModel], selector: Selector, value: str
) -> tuple[str, ...]:
    used = split_keys(" ".join(selector.choices[value]))
    return tuple(
        sorted((list_dependent_keys(selector) - set(used)) & attributes_by_key(model).keys())
    )


@cache
def list_dependent_keys(selector: Selector) -> frozenset[str]:
    """Return the keys that at least one value of a selector requires or uses."""
    return frozenset(split_keys(" ".join(map(" ".join, selector.choices.values()))))


def check_selector(facts: TableFacts, selector: Selector) -> None:
    """Report keys that the value of a selector requires or excludes; add a remark on each unused key.

    Parameters
    ----------
    facts : TableFacts
        Facts of the table of the selector.
    selector : Selector
    """
    value = facts[selector.key]
    if value not in selector.choices:
        return
    draft = facts.draft
    reason = f"{selector.key} '{value}'"
    for word in selector.choices[value][0].split():
        alternatives = word.split("|")
        keys = {key: f"{facts.table_key}.{key}" for key in alternatives}
        written = [key for key in keys if facts.has(key) or keys[key] in draft.suggested_keys]
        if not written:
            first, *others = alternatives
            needs = " or ".join((f"{reason} needs this key", *others))
            draft.add_missing(f"{facts.table_key}.{first}", needs)
        elif len(written) > 1:
            draft.add_mistake(
                f"{facts.table_key}.{written[-1]}",
                f"{reason} takes either this key or {written[0]}, not both; leave one of the two keys out",
            )
    for key in list_unused_keys(facts.table, selector):
        if facts.has(key) and key not in KEYS_WITH_OWN_RULE:
            draft.add_remark(
                f"{facts.table_key}.{key}", f"has no meaning for {reason} and is not used"
            )
