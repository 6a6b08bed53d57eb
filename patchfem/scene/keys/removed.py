"""Keys, files and options that patchfem no longer takes: one table, with what to use instead."""

import tomllib
from functools import cache
from pathlib import Path


@cache
def read_removed_names() -> dict[str, list[str]]:
    """Return the version that removed a key, files or an option of a verb, and what to use instead, by name."""
    return tomllib.loads(Path(__file__).with_name("removed.toml").read_text(encoding="utf-8"))


def describe_removed(name: str, shown: str = "this key") -> str:
    """State that something was removed and what to do instead, or return "" if it was not removed.

    Parameters
    ----------
    name : str
        Name in removed.toml, such as "friction.breakaway" or "fit --placebo".
    shown : str
        What the sentence calls it, such as "fit --placebo" or, in Python, "fit: placebo".
    """
    if name not in read_removed_names():
        return ""
    version, instead = read_removed_names()[name]
    return f"{shown} was removed in patchfem {version}; {instead}"
