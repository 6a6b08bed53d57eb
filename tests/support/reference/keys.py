"""Reference of the contents of a scene: tables, keys, effects and units."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal, get_args, get_origin

from patchfem.effects import EFFECTS
from patchfem.scene import UNIT_FACTORS, Coating, Material, Tables
from patchfem.scene.keys.choices import (
    KEY_SELECTORS,
    NEEDED_KEYS,
    find_selectors,
    format_keys,
    parse_needs,
)
from patchfem.scene.keys.quantities import EXAMPLE_QUANTITIES
from patchfem.scene.keys.tables import Interface
from patchfem.scene.keys.types import Key, list_keys

FOLDER = Path(__file__).parents[3] / "patchfem/scene"
FILE = FOLDER / "README.md"
TABLE_NAMES = {
    "Friction": "friction",
    "Slide": "slide",
    "Asperities": "contact.asperities",
    "Drive": "drive",
}
CHOICES = {
    f"{TABLE_NAMES.get(one.model.__name__)}.{one.key}": one.choices
    for one in KEY_SELECTORS
    if one.key != "kind" or one.model.__name__ == "Slide"
}
SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
HEAD = """\
# Keys of a scene

`python tests/support/reference` generates this page from the program's own records. A quantity is written as a text
with one number and one unit, such as `"12.7 mm"`; the last section lists the units of each kind of quantity. A number
without a unit may be given in percent, as a text such as `"0.2 %"`. An effect takes part in the computation if the scene
contains the table of this effect. The column "required" says "yes" or gives the condition under which the key is
required. A number in brackets, such as (2.17), is an equation of the report.

See also [the guide](GUIDE.md), [the measures of a run](MEASURES.md), [materials by name](MATERIALS.md),
[limits](LIMITS.md) and [the equations of all effects](../../studies/site/theory.md#equations-of-all-effects).
"""


def text() -> str:
    """Return the page patchfem/scene/README.md, made from the records that the program reads."""
    units = [
        (kind, ", ".join(f"`{unit}`" for unit in units), f'`"{EXAMPLE_QUANTITIES[kind]}"`')
        for kind, units in UNIT_FACTORS.items()
    ]
    sections = [
        HEAD,
        "## Tables and keys",
        *_format_sections(),
        "## Units",
        format_table(("kind", "units, the first in SI", "example"), units),
    ]
    return "\n\n".join(section.strip("\n") for section in sections) + "\n"


def iterate_tables(model: type = Tables, header: str = "") -> Iterator[tuple]:
    """Yield (header, model) of every table of a scene in order, ("", Tables) first; the header of an array is [[...]].

    model: the pydantic class to begin with; header: its header.
    """
    yield (header, model)
    for name, key in list_keys(model).items():
        # An interface has the same tables as [contact].
        if not key.accepts_value and (model, name) != (Interface, "contact"):
            path = f"{header.strip('[]')}.{name}".strip(".")
            yield from iterate_tables(key.inner, f"[[{path}]]" if key.is_array else f"[{path}]")


def _format_sections() -> list:
    """Return the sections of all tables with their keys."""
    heads = {}
    out = []
    for header, model in iterate_tables():
        heads.setdefault(model, []).append(header)
    for model, named in heads.items():
        parent = model.__mro__[1]
        own = [
            key
            for key in list_keys(model).values()
            if key.attribute in model.__annotations__ and key.accepts_value
        ]
        about = " ".join((model.__doc__ or "").split())
        if parent in heads:
            about += f" `{named[0]}` also takes the keys of {heads[parent][0]}."
        out += [
            "### "
            + (
                ", ".join(f"`{header}`" for header in named)
                if model is not Tables
                else "At the top"
            ),
            about,
        ]
        if own:
            out.append(
                format_table(
                    ("key", "kind", "default", "required", "meaning"),
                    [format_row(key) for key in own],
                )
            )
    return out


def format_row(key: Key) -> tuple:
    """Return the row of a key: name, kind, default, condition and meaning."""
    field = key.field
    default = "" if field.is_required() or field.default in (None, "") else field.default
    if isinstance(default, int | float):
        default = " ".join([f"{default:g}", *list(UNIT_FACTORS.get(key.kind, ()))[:1]])
    elif default:
        default = f"`{default}`"
    required = "yes" if field.is_required() else _format_condition(key.table, key.name)
    return f"`{key.name}`", _format_kind(key), default, required, key.record.meaning


def _format_condition(model: type, key: str) -> str:
    """Return the condition that makes a key necessary: "with law `tanh`", "unless `to` is given", or a sentence."""
    if required := list_keys(model)[key].record.required:
        return required
    conditions = []
    for selector in find_selectors(model):
        values = {}  # other keys in place of this one -> values of the selector
        for value, (required, _) in selector.choices.items():
            for need in parse_needs(required):
                for bundle in need.bundles:
                    if key in bundle[1:]:
                        conditions += [f"with `{bundle[0]}`"]
                    elif key in bundle:
                        others = [f"`{other[0]}`" for other in need.bundles if other != bundle]
                        values.setdefault(" or ".join(others), []).append(f"`{value}`")
        for others, names in values.items():
            condition = f"with {selector.key} {', '.join(names)}" if selector.key else ""
            condition += f"{', ' if condition else ''}unless {others} is given" if others else ""
            conditions.append(condition)
    for name, needed in NEEDED_KEYS.get(model, {}).items():
        if needed == key:
            conditions.append(f"with `{name}`")
    return "; ".join(dict.fromkeys(conditions))


def _format_kind(key: Key) -> str:
    """Return the kind of value of a key, with its bounds."""
    types = key.types
    words = [
        f"`{value}`" for part in types if get_origin(part) is Literal for value in get_args(part)
    ]
    if key.kind:
        words.append(key.kind)
    elif Material in types:
        words = ["material"]
    elif Coating in types:
        words.append("table")
    elif float in types or int in types or not words:
        words.append("number" if float in types else "whole number" if int in types else "text")
    arrays = [get_args(part) for part in types if get_origin(part) is tuple]
    prefix = "" if not arrays else "list of " if ... in arrays[0] else "pair of "
    words = dict.fromkeys(map(_plural, words) if prefix else words)
    return ", ".join([prefix + ", ".join(words), *_format_bounds(key)])


def _plural(word: str) -> str:
    """Return the plural of a kind: masses, velocities, lengths."""
    return (
        f"{word[:-1]}ies"
        if word.endswith("y")
        else f"{word}es"
        if word.endswith("s")
        else f"{word}s"
    )


def _format_bounds(key: Key) -> list:
    """Return the bounds of a key, such as ">= 1"."""
    marks = [
        inner
        for mark in (*key.field.metadata, *key.types)
        for inner in (mark, *getattr(mark, "metadata", ()))
    ]
    return list(
        dict.fromkeys(
            f"{sign} {getattr(mark, word):.15g}"
            for mark in marks
            for word, sign in SIGNS.items()
            if isinstance(getattr(mark, word, None), int | float)
        )
    )


def iterate_bounds() -> Iterator[tuple]:
    """Yield (dotted key, kind with its bounds) of every key that is a whole number or has an upper bound."""
    for header, model in iterate_tables():
        for name, key in list_keys(model).items():
            if not key.accepts_value:
                continue
            kind = _format_kind(key)
            bound = _format_bounds(key)
            if bound and ("whole number" in kind or any(text.startswith("<") for text in bound)):
                yield f"{header.strip('[]')}.{name}".strip("."), kind


class Equations:
    """Table of the equations of all effects, in the page of the theory."""

    FILE = FOLDER.parents[1] / "studies/site/theory.md"
    BEGIN, END = "<!-- effects -->\n", "<!-- end -->"

    @classmethod
    def text(cls) -> str:
        """Return the page of the theory with its table of effects generated again."""
        before, _, rest = cls.FILE.read_text("utf-8").partition(cls.BEGIN)
        after = rest.partition(cls.END)[2]
        return f"{before}{cls.BEGIN}\n{format_effects()}\n\n{cls.END}{after}"


def format_effects() -> str:
    """Return the table of all effects: required keys, optional keys, and equations."""
    rows = []
    for name, effect in EFFECTS.items():
        selector, _, value = name.partition("=")
        used = [format_keys(words) for words in CHOICES.get(selector, {}).get(value, ("", ""))]
        rows += (
            [(f"`{name}`", *used, effect.equations)]
            if not name.startswith("structure.interface.")
            else []
        )
    return format_table(("effect", "required keys", "optional keys", "equations"), rows)


def find_example(model: type, name: str) -> str:
    """Return an example of the value of a key of a table, as it is written in a scene."""
    kind = list_keys(model)[name].kind
    return f'"{EXAMPLE_QUANTITIES[kind]}"' if kind else "1.0"


def format_table(head: tuple, rows: list) -> str:
    """Return a Markdown table from its head and rows of texts."""
    lines = [
        head,
        ("---",) * len(head),
        *([cell.replace("|", "\\|") for cell in row] for row in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
