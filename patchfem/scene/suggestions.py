"""Suggestion of the key or table that was probably meant by an unknown one."""

from collections.abc import Iterable
from difflib import get_close_matches

from pydantic import ValidationError

from .keys.choices import find_selectors, split_keys
from .keys.types import (
    MIN_NAME_SIMILARITY,
    Table,
    attributes_by_key,
    find_inner_table,
    list_required_keys,
)


def suggest_key(model: type[Table], written_table: dict, key: str, *, is_set: bool = False) -> str:
    """Return the key of a table that is most similar to an unknown key, or "" if none is similar.

    A key with a similar name, or with a word in common, comes first, then a key that the table lacks. Keys that accept
    the value come before those that do not.

    Parameters
    ----------
    model : type
        The table.
    written_table : dict
        What is written in the table. A key that is there already is hardly meant.
    key : str
        The unknown key.
    is_set : bool
        Whether --set wrote the unknown key: the keys of the file are not in `written`, and one of them may be meant.
    """
    free = [name for name in attributes_by_key(model) if name not in written_table]
    fitting = [name for name in free if _accepts_value(model, name, written_table[key])]
    words = set(key.lower().split("_"))
    needed = _list_missing_keys(model, written_table)
    lacking = [name for name in fitting if name in needed]
    if is_set:
        required = [name for name in list_required_keys(model) if name in fitting]
        lacking = required if len(required) == 1 else []
    candidates = (
        _find_similar_names(key, fitting),
        [name for name in fitting if words & set(name.split("_"))],
        [name for name in fitting if name.startswith(key.lower())],
        lacking,
        _find_similar_names(key, free),
        _find_similar_names(key, attributes_by_key(model)),
    )
    return next((names[0] for names in candidates if names), "")


def suggest_table(model: type[Table], written_table: dict, key: str) -> str:
    """Return the table that is most similar to an unknown table, or "" if none is similar.

    A table with a similar name is taken unless another has more of the keys inside.

    Parameters
    ----------
    model : type
        The table that contains the unknown one.
    written_table : dict
        What is written in it.
    key : str
        Name of the unknown table.
    """
    inside = written_table[key][0] if isinstance(written_table[key], list) else written_table[key]
    n_shared = {}  # number of keys that each table shares with the unknown one, by its dotted name
    for name, inner in _list_inner_tables(model):
        n_shared[name] = len(set(inside) & attributes_by_key(inner).keys())
        for deeper, last in _list_inner_tables(inner):
            n_shared[f"{name}.{deeper}"] = len(set(inside) & attributes_by_key(last).keys())
    best = max(n_shared, key=n_shared.get, default="")
    similar = _find_similar_names(key, n_shared)
    if similar and n_shared[similar[0]] >= n_shared[best]:
        return similar[0]
    if best and n_shared[best] > len(inside) / 2:
        return best
    return "".join(similar)


def _find_similar_names(key: str, names: Iterable[str]) -> list[str]:
    """Return a list of the names that are most similar to a key, which is empty if none is similar."""
    return get_close_matches(key, names, 1, MIN_NAME_SIMILARITY)


def _list_inner_tables(model: type[Table]) -> list[tuple[str, type[Table]]]:
    """Return (key, model) of the tables inside a table."""
    pairs = ((key, find_inner_table(model, name)) for key, name in attributes_by_key(model).items())
    return [(key, inner) for key, inner in pairs if inner is not None]


def _accepts_value(model: type[Table], key: str, value: object) -> bool:
    """Return whether a key accepts a value."""
    try:
        model.model_validate({key: value})
    except ValidationError as caught:
        return all(error["loc"][0] != key for error in caught.errors(include_url=False))
    return True


def _list_missing_keys(model: type[Table], written_table: dict) -> list[str]:
    """Return the keys that a table lacks: those needed always or by a selector."""
    needed = list(list_required_keys(model))
    for selector in find_selectors(model):
        value = written_table.get(selector.key, "")
        if isinstance(value, str) and value in selector.choices:
            needed += split_keys(selector.choices[value][0])
    return [key for key in needed if key not in written_table]
