"""What the rules of a scene share: the draft under check, and which key belongs to which selector."""

from functools import cache
from typing import Any, NamedTuple, Protocol

from pydantic import BaseModel

from ... import effects
from ..keys.contact import Asperities
from ..keys.tables import Friction, Slide, Tables
from ..keys.types import keys

# selector value -> keys it needs, "a|b" for one of two, keys it can use; what stands in neither list is not used
LAWS: dict[str, tuple[str, str]] = {name: law.keys for name, law in effects.LAWS.items()}
SLIDES: dict[str, tuple[str, str]] = {
    "constant": ("speed distance", ""),
    "sine": ("amplitude frequency", "cycles"),
    "triangle": ("amplitude speed", "distance cycles"),
    "dwell": ("speed distance hold", "distance_after"),
    "file": ("file", ""),
}
ASPERITIES: dict[str, tuple[str, str]] = {
    "linear": ("normal_stiffness", "cutoff tangential_ratio"),
    "exponential": ("decay_length", "normal_stiffness cutoff tangential_ratio"),
    "hertz": (
        "",
        "radius density height_deviation from rms_height rms_slope rms_curvature cutoff tangential_ratio",
    ),
}
PEAKS = (
    ("radius", "density", "height_deviation"),
    ("from",),
    ("rms_height", "rms_slope", "rms_curvature"),
)


SELECTORS = {  # table: its model, the key that decides which others it wants, what each value needs and can use
    "friction": (Friction, "law", LAWS),
    "slide": (Slide, "kind", SLIDES),
    "contact.asperities": (Asperities, "law", ASPERITIES),
}


class Acts(NamedTuple):
    """Where a knob of [accuracy] acts: kinds of run, and methods or engines, of which "auto" stands for those it may
    choose; law: a trait that one law must have, "" for any."""

    kinds: str
    methods: str
    law: str = ""


KNOBS: dict[str, Acts] = {
    "steps_per_cycle": Acts("bench rig linear", "auto bench march smooth harmonic"),
    "tail": Acts("bench rig", "auto bench march", "bonds"),
    "merge": Acts("bench rig", "auto bench march", "bonds"),
    "harmonics": Acts("rig", "harmonic"),
    "shear_modes": Acts("bench rig", "auto bench march"),
}


def acts(knob: str, kind: str, method: str) -> bool:
    """Whether a knob of KNOBS acts in a kind of run by a method, or by the engine that was chosen."""
    return kind in KNOBS[knob].kinds.split() and method in KNOBS[knob].methods.split()


def pinned(accuracy: Any) -> list[str]:
    """The knobs that a table [accuracy] names."""
    return [knob for knob in KNOBS if getattr(accuracy, knob) is not None]


class Draft(Protocol):
    """A scene being read: the tables so far, what was written, and where mistakes go."""

    tables: Tables

    def given(self, key: str) -> bool: ...
    def say(self, key: str, message: str) -> None: ...
    def remark(self, sentence: str) -> None: ...
    def lacks(self, key: str, reason: str) -> None: ...
    def lacks_table(self, name: str, reason: str) -> None: ...


def each(words: str) -> list[str]:
    """The keys of a record, each of several that stand for one another."""
    return words.replace("|", " ").split()


def unused(table: BaseModel, selector: str, used: dict[str, tuple[str, str]]) -> frozenset[str]:
    """Keys of a table that the value of its selector gives no meaning, among those that depend on it."""
    return _unused(type(table), getattr(table, selector), tuple(used.items()))


@cache
def _unused(model: type[BaseModel], value: str, used: tuple) -> frozenset[str]:
    needs, can = dict(used)[value]
    dependent = {key for _, pair in used for words in pair for key in each(words)}
    return frozenset((dependent - set(each(needs)) - set(each(can))) & keys(model).keys())


def _needs(
    draft: Draft, at: str, table: Any, selector: str, used: dict[str, tuple[str, str]]
) -> None:
    """Missing keys that the selector's value needs; remarks on those it gives no meaning."""
    value = getattr(table, selector, None)
    if value not in used:
        return
    for word in used[value][0].split():
        key, *others = word.split("|")
        given = [one for one in (key, *others) if draft.given(f"{at}.{one}")]
        if not given:
            draft.lacks(
                f"{at}.{key}", " or ".join((f"{selector} '{value}' needs this key", *others))
            )
        elif len(given) > 1:
            draft.say(
                f"{at}.{given[-1]}",
                f"{selector} '{value}' takes either this key or {key}, not both; leave one "
                "of the two keys out",
            )
    for key in sorted(unused(table, selector, used)):
        if draft.given(f"{at}.{key}") and key not in ("kinetic", "spread"):
            draft.remark(f"{at}.{key} has no meaning for {selector} '{value}' and is not used")
