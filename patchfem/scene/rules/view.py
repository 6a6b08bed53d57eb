"""Tables as the rules read them: a value that is missing or was refused compares as false."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ..keys.types import Table


class _Unknown(float):
    """Value of a key that is missing or was refused: NaN, false and empty, with itself as every attribute."""

    def __bool__(self) -> bool:
        return False

    def __iter__(self) -> Iterator:
        return iter(())

    def __getattr__(self, name: str) -> _Unknown:
        return self


# As with every NaN, no comparison with this value holds except `!=`.
UNKNOWN = _Unknown("nan")


class View:
    """A table for reading, in which every missing value is UNKNOWN and every table is a view.

    A rule compares the values of a view without asking first whether they are there. A field of a sentence, such as
    `{length:g}`, names an attribute of the view. AttributeError for a name that the table does not have.
    """

    def __init__(self, table: Table | None) -> None:
        self.table = table

    def __getattr__(self, name: str) -> Any:
        value = UNKNOWN if self.table is None else view(getattr(self.table, name))
        self.__dict__[name] = value  # the next access finds it without this method
        return value

    def __getitem__(self, name: str) -> Any:
        return getattr(self, name)


def view(value: Any) -> Any:
    """Return a value as rules read it: a view of a table, UNKNOWN in place of None."""
    if value is None:
        return UNKNOWN
    if isinstance(value, Table):
        return View(value)
    if isinstance(value, tuple):
        return tuple(map(view, value))
    return value
