"""From the plain values of a TOML file to the models, noting every mistake with its line."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from functools import cache, lru_cache
from typing import Any, Literal, get_args, get_origin

from pydantic import ValidationError

from ..exceptions import PatchfemError
from . import suggestions
from .keys import quantities, removed
from .keys.contact import Material
from .keys.tables import Tables
from .keys.types import Table, choices, keys, kind_of, model_of, parts
from .lines import counted, pieces_of

# .3 and 5., which TOML has no place for
_BARE_POINT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+\.)([eE][-+]?[0-9]+)?")
_PLAIN_TEXT = re.compile(r'"[^"\\\x00-\x1f\x7f]*"')  # a text in quotes without escapes
_LONG_WORD = re.compile(r"[^\s/\\:]{200,}")  # no key, unit or name of a file is as long
_LIMITS = {"greater_than": ("gt", ">"), "greater_than_equal": ("ge", ">="), "less_than": ("lt", "<"),
           "less_than_equal": ("le", "<=")}  # fmt: skip
_LAST = 10**9  # sorts the mistakes of --set behind those of the file


class SceneError(PatchfemError):
    """A scene that cannot be run; `mistakes` holds one whole line for each, ``FILE:LINE: table.key: message``."""

    def __init__(self, mistakes: Iterable[str]) -> None:
        self.mistakes = list(mistakes)
        super().__init__("\n".join(self.mistakes))


class Draft:
    """A scene being read: what was written, the tables as far as they are right, the mistakes found so far."""

    def __init__(self, path: str, lines: dict[str, int], raw: dict[str, Any]) -> None:
        self.path, self.lines, self.raw = path, lines, raw
        self.sets: set[str] = set()
        self.tables = _made(Tables, {})
        self.mistakes: dict[
            tuple[int, str], None
        ] = {}  # each once, in the order in which they were found
        self.remarks: list[str] = []
        self.read_before: dict[
            int, tuple[dict, Any]
        ] = {}  # id of a written table -> itself, and the table without
        self.made: dict[
            int, tuple[dict, Any]
        ] = {}  # mistakes that was read from it before; those read now

    def read(self) -> None:
        """Read all tables; mistakes are noted, values that are wrong stay None."""
        self.tables = _table(self, Tables, self.raw, "")

    def given(self, key: str) -> bool:
        """Whether the key or table was written, right or wrong."""
        return self.value(key) is not None

    def given_as_set(self, key: str) -> bool:
        """`given` of a key as --set and [sweep] write it, with items by name or number."""
        value: Any = self.raw
        for piece in pieces_of(key):
            if isinstance(value, list):
                at = next(
                    (
                        k
                        for k, one in enumerate(value)
                        if isinstance(one, dict) and one.get("name") == piece
                    ),
                    int(piece) if piece.isdecimal() else len(value),
                )
                value = value[at] if at < len(value) else None
            else:
                value = value.get(piece) if isinstance(value, dict) else None
        return value is not None

    def value(self, key: str) -> Any:
        """Value that was written at a dotted key; None where nothing was."""
        value: Any = self.raw
        for part in _pieces(key):
            if isinstance(value, dict):
                value = value.get(part)
            elif isinstance(value, list) and part.isdecimal() and int(part) < len(value):
                value = value[int(part)]
            else:
                return None
        return value

    def say(self, key: str, message: str) -> None:
        """Note a mistake at a key: at its line, or that of the nearest table above."""
        self._note(*self._where(key), counted(f"{self.shown(key)}: {message}"))

    def lacks(self, key: str, reason: str) -> None:
        """Note a missing key, at the line of its table."""
        model, name = owner_of(key)
        want = _wanted(model, name) if model else ""
        self.say(
            key, "missing" + "".join(f"; {text}" for text in dict.fromkeys((want, reason)) if text)
        )

    def lacks_table(self, name: str, reason: str) -> None:
        """Note a table that is missing altogether."""
        self._note(0, self.path, f"missing [{name}]: {reason}")

    def remark(self, sentence: str) -> None:
        """Keep a sentence for the user that is not a mistake."""
        sentence = counted(sentence)
        if sentence not in self.remarks:
            self.remarks.append(sentence)

    def lines_of_mistakes(self) -> list[str]:
        """One whole line per mistake, in the order of the file."""
        return [text for _, text in sorted(self.mistakes, key=lambda mistake: mistake[0])]

    def shown(self, key: str) -> str:
        """The key as a user writes it: a mode by its name where it has one that is no number."""
        pieces = key.split(".")
        if pieces[:2] == ["structure", "mode"] and len(pieces) > 2:
            mode = self.value(".".join(pieces[:3]))
            name = mode.get("name") if isinstance(mode, dict) else None
            if (
                isinstance(name, str)
                and name
                and not name.isdecimal()
                and len(pieces) > 3
                and pieces[3] != "name"
            ):
                pieces[2] = name
        return ".".join(pieces)

    def refuse_set(self, text: str) -> None:
        """Note that a ``--set`` could not be applied."""
        self._note(_LAST, "--set", text)

    def _where(self, key: str) -> tuple[int, str]:
        pieces = key.split(".")
        above = [".".join(pieces[:count]) for count in range(len(pieces), 0, -1)]
        if self.sets.intersection(above):
            return _LAST, "--set"
        line = next((self.lines[path] for path in above if path in self.lines), 0)
        return line, f"{self.path}:{line}" if line else self.path

    def _note(self, order: int, where: str, text: str) -> None:
        text = _LONG_WORD.sub(lambda word: f"{word[0][:60]}...", text)
        mistake = (
            order,
            f"{where}: " + "".join(sign if sign.isprintable() else " " for sign in text),
        )
        self.mistakes.setdefault(mistake)


def apply_set(draft: Draft, assignment: str) -> None:
    """Apply one ``table.key=value`` as if the scene said so; the value stands without quotes, modes by name."""
    try:
        assignment.encode()
    except UnicodeEncodeError:
        shown = assignment.encode(errors="backslashreplace").decode()
        draft.refuse_set(f"{shown}: contains bytes that are not UTF-8 text; save the file as UTF-8")
        return
    key, equals, text = assignment.partition("=")
    pieces = pieces_of(key)
    if not equals or not all(pieces):
        draft.refuse_set(f"{assignment}: table.key=value is needed, such as contact.load=26 lbf")
        return
    place: Any = draft.raw
    for index, piece in enumerate(pieces):
        if isinstance(place, list):
            pieces[index] = piece = _item(draft, place, piece, ".".join(pieces[: index + 1]), key)
            if not piece:
                return
        if index == len(pieces) - 1:
            break
        inner = place[int(piece)] if isinstance(place, list) else place.get(piece)
        if inner is None:
            inner = place[piece] = {}
            draft.sets.add(".".join(pieces[: index + 1]))
        if not isinstance(inner, dict | list):
            draft.refuse_set(
                f"{key.strip()}: {'.'.join(pieces[: index + 1])} is a value, not a table"
            )
            return
        place = inner
    path = ".".join(pieces)
    place[int(piece) if isinstance(place, list) else piece] = _set_value(path, text.strip())
    draft.sets.add(path)


def _item(draft: Draft, items: list[Any], wanted: str, key: str, written: str) -> str:
    """Index of the item of this name (or number) as text; empty, with a mistake noted, if there is none.

    written: the whole key, in which a number in brackets counts from one and one behind a dot from zero, as in Python.
    """
    names = [item.get("name") if isinstance(item, dict) else None for item in items]
    if wanted in names:
        return str(names.index(wanted))
    if wanted.isdecimal() and int(wanted) < len(items):
        return str(int(wanted))
    known, table = (
        [name for name in names if isinstance(name, str)],
        counted(key.rpartition(".")[0]),
    )
    number = wanted.isdecimal()
    dotted = number and f"[{int(wanted) + 1}]" not in written
    there = "such item" if number else f"'{wanted}'"
    draft.refuse_set(
        f"{f'{table}.{wanted}' if dotted else counted(key)}: no {there} here; "
        + (
            choices(wanted, known)
            if known
            else f"{table} has {len(items)}, numbered from 1 as in {table}[1]"
        )
        + (f"; {table}.0, with a dot, means {table}[1]" if dotted else "")
    )
    return ""


def _set_value(path: str, text: str) -> Any:
    model, name = owner_of(path)
    plain_text = model is not None and str in (
        model.model_fields[name].annotation,
        *_types(model, name),
    )
    if _PLAIN_TEXT.fullmatch(text):
        return text[1:-1]
    try:
        found = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return float(text) if _BARE_POINT.fullmatch(text) and not plain_text else text
    value = found["value"]
    if _ends_in_comment(text):  # a '#' is a sign of the value here, as in 26#
        return text
    if len(found) > 1 or not isinstance(value, str | bool | int | float | list | dict):
        return text
    return text if plain_text and isinstance(value, int | float) else value


def _ends_in_comment(text: str) -> bool:
    """Whether TOML takes the end of a valid value's text as a comment: it then swallows a bracket behind it."""
    if "#" not in text:
        return False
    try:
        tomllib.loads(f"value = [{text}]")
    except (ValueError, RecursionError):
        return True
    return False


@lru_cache(4096)
def _pieces(key: str) -> tuple[str, ...]:
    return tuple(key.split("."))


@lru_cache(1024)
def owner_of(key: str) -> tuple[type[Table] | None, str]:
    """Model and attribute a dotted key belongs to, items of an array by number or name; None for a key no table has."""
    model: type[Table] | None = Tables
    name, items = "", False
    for piece in pieces_of(key):
        if piece.isdigit() or items:
            items = False
            continue
        if name:
            model = model_of(model, name)
        name = keys(model).get(piece, "") if model else ""
        if not name:
            return None, ""
        items = (
            model_of(model, name) is not None
            and get_origin(model.model_fields[name].annotation) is tuple
        )
    return model, name


def known(key: str) -> tuple[type[Table], str]:
    """`owner_of` a key; ValueError, with the nearest known key, where no scene has it."""
    model, name = owner_of(key)
    if model is not None:
        return model, name
    table, _, last = key.rpartition(".")
    owner, at = owner_of(table) if table else (None, "")
    inner = model_of(owner, at) if owner is not None else None
    raise ValueError(
        "not a key of a scene" + (f"; {choices(last, keys(inner))}" if inner is not None else "")
    )


def held(key: str, value: Any, passed: Iterable[str] = ()) -> dict[str, Any]:
    """A value as the key holds it, by attribute; ValueError where it cannot hold it.

    passed: kinds of mistakes that are none here.
    """
    model, name = owner_of(key)
    alias, good = model.model_fields[name].alias or name, {}
    try:
        model.model_validate({alias: value}, context=good)
    except ValidationError as caught:
        for error in caught.errors(include_url=False):
            if error["loc"][0] == alias and error["type"] not in ("missing", *passed):
                raise ValueError(_message(model, name, error, value)) from None
    return good


def _table(draft: Draft, model: type[Table], raw: dict[str, Any], at: str) -> Any:
    """A table as its model; what is missing or wrong is said and left None."""
    if id(raw) in draft.read_before:
        return draft.read_before[id(raw)][1]
    names, values = keys(model), {}
    for key, value in raw.items():
        path = f"{at}.{key}" if at else key
        if key not in names:
            _unknown(draft, model, raw, key, path)
            continue
        inner = model_of(model, names[key])
        plain = is_value(model, names[key])
        if inner is not None and not (plain and not isinstance(value, dict)):
            value = _nested(draft, model, names[key], inner, value, path)
        if value is not None:
            values[key] = value
    good = _validated(draft, model, values, at)
    for key, name in names.items():
        if model.model_fields[name].is_required() and key not in raw:
            draft.lacks(f"{at}.{key}", "")
    unsure = {
        name: None
        for key, name in names.items()
        if key in raw or model.model_fields[name].is_required()
    }
    found = _made(model, unsure | good)
    draft.made[id(raw)] = raw, found
    return found


def _made(model: type[Table], values: dict[str, Any]) -> Any:
    """A table of values by attribute as `model_construct` makes it; it shares its defaults, which are frozen too."""
    found = model.__new__(model)
    for name, value in (
        ("__dict__", _defaults(model) | values),
        ("__pydantic_fields_set__", set(values)),
        ("__pydantic_extra__", None),
        ("__pydantic_private__", None),
    ):
        object.__setattr__(found, name, value)
    return found


@cache
def _defaults(model: type[Table]) -> dict[str, Any]:
    return {
        name: field.get_default(call_default_factory=True)
        for name, field in model.model_fields.items()
        if not field.is_required()
    }


def _validated(draft: Draft, model: type[Table], values: dict[str, Any], at: str) -> dict[str, Any]:
    """Attributes whose values are right; a mistake is said for each of the others."""
    good: dict[str, Any] = {}
    try:
        model.model_validate(values, context=good)
    except ValidationError as caught:
        seen = set()
        # of the answers of several types to one value, that of the type which only its limits refuse comes first
        for error in sorted(
            caught.errors(include_url=False), key=lambda one: one["type"] not in _LIMITS
        ):
            key = str(error["loc"][0])
            if (error["type"] == "missing" and len(error["loc"]) == 1) or key in seen:
                continue
            seen.add(key)
            path = f"{at}.{key}" if at else key
            index = next((part for part in error["loc"][1:] if isinstance(part, int)), None)
            value = values.get(key)
            if index is not None and isinstance(value, list) and index < len(value):
                path, value = f"{path}.{index}", value[index]
            draft.say(path, _message(model, keys(model)[key], error, value))
    return good


def _nested(
    draft: Draft, model: type[Table], name: str, inner: type[Table], value: Any, path: str
) -> Any:
    """A sub-table or an array of them; None, with the mistake said, where something else stands."""
    if get_origin(model.model_fields[name].annotation) is tuple:
        if isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            return tuple(
                _table(draft, inner, item, f"{path}.{index}") for index, item in enumerate(value)
            )
        draft.say(path, f"an array of tables [[{path}]] is needed, not {_show(value)}")
    elif isinstance(value, dict):
        return _table(draft, inner, value, path)
    else:
        draft.say(path, f"a table [{path}] is needed, not {_show(value)}")
    return None


def _unknown(draft: Draft, model: type[Table], raw: dict[str, Any], key: str, path: str) -> None:
    if path in removed.KEYS:
        draft.say(path, removed.KEYS[path])
        return
    value = raw[key]
    tables = [
        name for name, at in keys(model).items() if model_of(model, at) and not is_value(model, at)
    ]
    is_table = isinstance(value, dict) or (
        isinstance(value, list) and value and isinstance(value[0], dict)
    )
    known = tables if is_table and tables else list(keys(model))
    at = path.rpartition(".")[0]
    # a key of the file is not what someone means who writes another there, but may be what --set wants to change
    there = path in draft.sets
    written = {
        name: raw[name]
        for name in (*keys(model), key)
        if name in raw and (not there or f"{at}.{name}".strip(".") in draft.sets)
    }
    near = (
        suggestions.table_meant(model, written, key)
        if is_table
        else suggestions.key_meant(model, at, written, key, there)
    )
    # one that stands outside of every table, as --set may be given it, is meant where a table has it
    deeper = (
        []
        if at or is_table
        else [f"{name}.{key}" for name in tables if key in keys(model_of(model, keys(model)[name]))]
    )
    near = (
        next((one for one in deeper if one.partition(".")[0] in raw), "")
        or "' or '".join(deeper)
        or near
    )
    help = (
        f"did you mean '{near}'?"
        if near
        else f"known here: {', '.join(known)}"
        if known
        else "this table has no keys"
    )
    draft.say(path, f"unknown {'table' if is_table else 'key'}; {help}")


@cache
def _types(model: type[Table], name: str) -> tuple[Any, ...]:
    return tuple(parts(model.model_fields[name].annotation))


@cache
def is_value(model: type[Table], name: str) -> bool:
    """Whether a key that may hold an inline table may hold a plain value as well: a material, a coating."""
    return model_of(model, name) is Material or any(
        get_origin(part) is Literal for part in _types(model, name)
    )


def _allowed(model: type[Table], name: str) -> tuple[str, ...]:
    """The values of a selector key; empty for a key with free values."""
    annotation = model.model_fields[name].annotation
    literal = next(
        (part for part in (annotation, *_types(model, name)) if get_origin(part) is Literal), None
    )
    return get_args(literal) if literal else ()


def _wanted(model: type[Table], name: str) -> str:
    """Requirement of a key, as a clause of a message."""
    annotation = model.model_fields[name].annotation
    types = (annotation, *_types(model, name))
    clause = "a text in quotes is needed"
    if kind := kind_of(model, name):
        clause = quantities.wanted(kind)
        if tuple in map(get_origin, types):
            clause = f"an array of quantities is needed, such as ['{quantities.EXAMPLES[kind]}']"
    elif Material in types:
        clause = 'a material name or {young = "121 GPa", poisson = 0.32, density = "4370 kg/m^3"} is needed'
    elif allowed := _allowed(model, name):
        clause = f"one of {', '.join(allowed)} is needed" + (
            " (or a whole number)" if int in types else ""
        )
    elif tuple in map(get_origin, types):
        many = (
            "plain numbers are needed, such as [1, 1.5]"
            if float in types
            else f"{'' if any(... in get_args(one) for one in types) else 'two '}whole numbers are needed, such as [1, 2]"
        )
        clause = "" if model_of(model, name) else many
    elif float in types:
        clause = "a plain number is needed"
    elif int in types:
        clause = "a whole number is needed"
    return clause


def _message(model: type[Table], name: str, error: Any, value: Any) -> str:
    allowed = _allowed(model, name)
    if error["type"] in _LIMITS:
        key, sign = _LIMITS[error["type"]]
        bound = error["ctx"][key]
        bound = str(bound) if isinstance(bound, int) else f"{bound:g}"
        return f"must be {sign} {bound}, not {_show(value)}; {_wanted(model, name)}"
    if error["type"] == "too_short" and value and error["ctx"]["min_length"] > 1:
        return f"at least {error['ctx']['min_length']} values are needed, not {len(value)}"
    if error["type"] == "value_error":
        return str(error["ctx"]["error"])
    if allowed and isinstance(value, str):
        return f"unknown value {_show(value)}; {choices(value, allowed)}"
    return f"{_wanted(model, name) or 'another value is needed'}, not {_show(value)}"


def _show(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, list | tuple):
        return "an array" if value else "an empty array"
    try:
        text = repr(value)
    except ValueError:
        return "a huge number"
    return text if len(text) <= 60 else text[:57] + "..."
