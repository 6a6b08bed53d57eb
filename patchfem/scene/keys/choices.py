"""Keys that a table needs, takes and excludes, for each value of its selectors such as friction.law.

In the texts of KEY_SELECTORS and NEEDED_KEYS, blanks separate words. A word "a" is one key, "a|b" means either of two
keys, "a/b" one of them or both, and "a+b|c" means that `a` and `b` describe together what `c` describes alone.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from ... import effects
from . import contact, tables
from .types import Table, list_keys


@dataclass(frozen=True, eq=False, slots=True)
class Selector:
    """A key whose value decides which other keys of its table are required or used.

    - model: class of the table.
    - key: name of the selector; "" for keys that the table needs or excludes in any case.
    - choices: value of the selector -> required keys and optional keys. A key that stands here only with other values
      is
      not used with this one.
    """

    model: type[Table]
    key: str
    choices: dict[str, tuple[str, str]]


# Keys of a drive besides those of its waveform; a release has no waveform.
_WAVEFORM_KEYS = " ".join(" ".join(wave.keys) for wave in effects.WAVEFORMS.values())
_OTHER_WAVEFORM_KEYS = " ".join(
    dict.fromkeys(
        re.findall(r"\w+", re.sub("acceleration[|]displacement|force", "", _WAVEFORM_KEYS))
    )
)
ALTERNATIVE_KEYS = {  # keys of which a table always needs one
    contact.Contact: "load|approach",
    contact.LoadLine: "offset/moment/across",
    contact.ProfileFile: "file|scan",
    contact.Holder: "rotational_stiffness/tangential_stiffness",
    tables.Interface: "load|contact",
    tables.Structure: "mode|masses|file|reduced",
    tables.Start: "displacement/velocity",
    tables.WornFriction: "coefficient_factor/bond_length_factor",
}
# A selector that an earlier one of the same table leaves unused does not count, and neither do the keys that the
# earlier one leaves unused.
KEY_SELECTORS = (
    *(Selector(model, "", {"": (words, "")}) for model, words in ALTERNATIVE_KEYS.items()),
    Selector(contact.OnePiece, "", {"": ("", "chamfer|end_radius")}),
    Selector(
        contact.Asperities,
        "law",
        {
            "linear": ("normal_stiffness", "cutoff tangential_ratio hardness heights"),
            "exponential": (
                "decay_length",
                "normal_stiffness cutoff tangential_ratio hardness heights",
            ),
            "hertz": (
                "radius+density+height_deviation|from|rms_height+rms_slope+rms_curvature",
                "cutoff tangential_ratio hardness heights",
            ),
        },
    ),
    Selector(
        tables.Friction,
        "law",
        {name: law.keys for name, law in effects.LAWS.items()},
    ),
    Selector(
        tables.Slide,
        "kind",
        {
            "constant": ("speed distance", ""),
            "sine": ("amplitude frequency", "cycles"),
            "triangle": ("amplitude speed", "distance cycles"),
            "dwell": ("speed distance hold", "distance_after"),
            "file": ("file", ""),
        },
    ),
    Selector(
        tables.Drive,
        "kind",
        {
            "base": ("", f"waveform acceleration displacement {_OTHER_WAVEFORM_KEYS}"),
            "force": ("", f"waveform force mass {_OTHER_WAVEFORM_KEYS}"),
            "free": ("cycles|duration", "displacement mass"),
        },
    ),
    Selector(tables.Drive, "waveform", {name: w.keys for name, w in effects.WAVEFORMS.items()}),
    Selector(
        tables.Drive,
        "onset",
        {"slip": ("", ""), "distortion": ("", ""), "gauge": ("onset_length", "")},
    ),
    Selector(
        tables.Measured,
        "reading",
        {
            "peak": ("", ""),
            "fundamental": ("", ""),
            "rms": ("", ""),
            "lowpass": ("reading_cutoff", ""),
        },
    ),
)
NEEDED_KEYS = {  # keys that a key of a table needs
    tables.Normal: {"amplitude": "frequency", "frequency": "amplitude", "phase": "amplitude"},
    tables.Friction: {"rest_growth": "slip_growth", "slip_growth": "rest_growth"},
    tables.Structure: {"output_mass": "masses/reduced", "interface": "masses/file/reduced"},
}
EQUALLY_LONG_LISTS = {  # lists that need one value for each value of another list
    tables.Drive: {"accelerations": "frequencies", "phases": "frequencies"},
    tables.WornFriction: {"coefficient_factor": "depth", "bond_length_factor": "depth"},
}
REFUSED_KEYS = (
    "kinetic",
    "spread",
)  # keys that are refused, not only ignored, where they are not used


class Need(NamedTuple):
    """Keys of which a table needs some.

    - bundles: alternatives; the keys of each belong together.
    - is_exclusive: whether only one of the alternatives may be given.
    """

    bundles: tuple[tuple[str, ...], ...]
    is_exclusive: bool


@cache
def parse_needs(words: str) -> tuple[Need, ...]:
    """Parse the keys that a value of a selector needs or may have.

    `words` separates the needs by blanks: "a+b" are keys that are given together, "a|b" are keys of which exactly one
    is given, and "a/b" keys of which one or several are given.
    """
    return tuple(
        Need(tuple(tuple(part.split("+")) for part in re.split("[|/]", word)), "/" not in word)
        for word in words.split()
    )


def split_keys(words: str) -> list[str]:
    """Return all keys of a text `words` of required or optional keys, such as "a+b c|d"."""
    return re.findall(r"\w+", words)


def format_keys(words: str) -> str:
    """Return a text of keys such as "a+b c|d" in words: "a and b, c or d"."""
    return re.sub("[|/]", " or ", words.replace(" ", ", ").replace("+", " and "))


@cache
def find_selectors(model: type[Table]) -> tuple[Selector, ...]:
    """Return the selectors of a table, in the order in which they count.

    A selector is a key whose value decides which other keys the table needs, such as `law` or `waveform`. `model` is the
    class of the table.
    """
    return tuple(selector for selector in KEY_SELECTORS if issubclass(model, selector.model))


@cache
def list_keys_unused_by_value(selector: Selector, value: str) -> tuple[str, ...]:
    """Return the keys that have no meaning for a value of a selector."""
    dependent = split_keys(" ".join(map(" ".join, selector.choices.values())))
    used = split_keys(" ".join(selector.choices[value]))
    return tuple(sorted({*dependent} - {*used}))


class TableChoices(NamedTuple):
    """Keys that a table needs, and keys without a meaning in it, by its selectors: keys such as `law` that choose others.

    - needs: groups of keys, whether a key of the group is required, and the selector with its value, such as
      "law 'nonlocal'".
    - unused: selector with its value, by key without a meaning.
    """

    needs: list[tuple[Need, bool, str]]
    unused: dict[str, str]


def find_choices(table: Table) -> TableChoices:
    """Return the keys that a table needs, and the keys in it that have no meaning.

    Both follow from its selectors, keys such as `law` whose value decides which other keys are used.
    """
    choices = TableChoices([], {})
    for selector in find_selectors(type(table)):
        value = getattr(table, selector.key, "")
        if value not in selector.choices:
            break
        if selector.key in choices.unused:
            continue
        reason = f"{selector.key} '{value}'" if selector.key else ""
        for words, is_required in zip(selector.choices[value], (True, False)):
            choices.needs.extend((need, is_required, reason) for need in parse_needs(words))
        for key in list_keys_unused_by_value(selector, value):
            choices.unused.setdefault(key, reason)
    return choices


def iterate_tables(table: Table, table_key: str = "") -> Iterator[tuple[str, Table]]:
    """Yield (dotted key, table) for a table and all tables inside it."""
    yield table_key, table
    for name, key in list_keys(type(table)).items():
        value = getattr(table, key.attribute)
        path = f"{table_key}.{name}" if table_key else name
        if isinstance(value, Table):
            yield from iterate_tables(value, path)
        elif isinstance(value, tuple) and key.inner is not None:
            for index, item in enumerate(value):
                yield from iterate_tables(item, f"{path}.{index}")
