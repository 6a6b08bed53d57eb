"""The key or table that someone meant who wrote one that a scene does not have: by name, and by what it holds."""

from collections.abc import Collection
from difflib import get_close_matches

from pydantic import ValidationError

from .keys.types import Table, keys, model_of, record
from .rules.scene_draft import SELECTORS, each

NEAR = 0.6  # of difflib, from which two names are alike


def key_meant(model: type[Table], at: str, written: dict, key: str, there: bool = False) -> str:
    """The key of the table `at` that `key` stands for, "" where nothing tells.

    written: the table as it stands; a key that is there already is hardly meant. A name that is like it, or that shares
    a word with it, comes before a key that the table lacks, as far as its kind fits the value. there: the other keys
    of the table stand elsewhere, and the key may stand for one of them: among those that every such table has, where
    one alone fits.
    """
    free = [one for one in keys(model) if one not in written]
    fit = [one for one in free if _fits(model, one, written[key])]
    words = set(key.lower().split("_"))
    for found in (
        get_close_matches(key, fit, 1, NEAR),
        [one for one in fit if words & set(one.split("_"))],
        [one for one in fit if one.startswith(key.lower())],
        _needed(model, fit)
        if there
        else [one for one in fit if one in _lacking(model, at, written)],
        get_close_matches(key, free, 1, NEAR),
        get_close_matches(key, keys(model), 1, NEAR),
    ):
        if found:
            return found[0]
    return ""


def _needed(model: type[Table], fit: list) -> list:
    found = [
        key
        for key, name in keys(model).items()
        if key in fit and model.model_fields[name].is_required()
    ]
    return found if len(found) == 1 else []


def table_meant(model: type[Table], written: dict, key: str) -> str:
    """The table that the unknown one `key` stands for, by the keys that it holds and by its name; dotted where it lies
    deeper, "" where nothing tells."""
    held = written[key][0] if isinstance(written[key], list) else written[key]
    found = {}
    for name, inner in _tables(model):
        found[name] = len(set(held) & keys(inner).keys())
        for deeper, last in _tables(inner):
            found[f"{name}.{deeper}"] = len(set(held) & keys(last).keys())
    best, near = max(found, key=found.get, default=""), get_close_matches(key, found, 1, NEAR)
    if near and found[near[0]] >= found[best]:
        return near[0]
    return best if best and found[best] > len(held) / 2 else "".join(near)


def _tables(model: type[Table]) -> list:
    return [
        (key, inner)
        for key, name in keys(model).items()
        if (inner := model_of(model, name)) is not None
    ]


def _fits(model: type[Table], key: str, value: object) -> bool:
    """Whether the key takes the value."""
    try:
        model.model_validate({key: value})
    except ValidationError as wrong:
        return all(error["loc"][0] != key for error in wrong.errors(include_url=False))
    return True


def _lacking(model: type[Table], at: str, written: dict) -> Collection:
    """Keys that the table needs and has not: always, by the value of its selector, or under a condition."""
    need = [key for key, name in keys(model).items() if model.model_fields[name].is_required()]
    _, selector, by = SELECTORS.get(at, (None, "", {}))
    need += (
        each(by.get(written.get(selector), ("", ""))[0])
        if isinstance(written.get(selector), str)
        else []
    )
    need += [key for key in keys(model) if (found := record(model, key)) and found.needed]
    return [key for key in need if key not in written]
