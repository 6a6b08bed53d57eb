"""Keys, files, options and names in Python that patchfem no longer has: one table, with what to use instead."""

import tomllib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any

from ...exceptions import PatchfemError


@cache
def read_removed_names() -> dict[str, list[str]]:
    """Return the version that removed a key, files, an option or an attribute, and what to use instead, by name."""
    return tomllib.loads(Path(__file__).with_name("removed.toml").read_text(encoding="utf-8"))


def describe_removed(name: str, shown: str = "") -> str:
    """State that something was removed and what to do instead, or return "" if it was not removed.

    Parameters
    ----------
    name : str
        Name in removed.toml, such as "friction.breakaway" or "fit --placebo".
    shown : str
        What the sentence calls it, such as "this key" or, in Python, "fit: placebo". Default: `name`.
    """
    if name not in read_removed_names():
        return ""
    version, instead = read_removed_names()[name]
    return f"{shown or name} was removed in patchfem {version}; {instead}"


def refuse_removed(verb: str, options: Iterable[str]) -> None:
    """Raise PatchfemError for the first name in Python that was an option of a verb, with what to use instead."""
    for option in options:
        if removed := describe_removed(f"{verb} --{option.replace('_', '-')}", f"{verb}: {option}"):
            raise PatchfemError(removed)


def refuse_attribute(record: Any, name: str) -> None:
    """Raise AttributeError for an attribute that a record lacks, with what to use instead if it was removed.

    It is the method `__getattr__` of records of the Python interface.
    """
    attribute = f"{type(record).__name__}.{name}"
    raise AttributeError(describe_removed(attribute) or f"there is no {attribute}")
