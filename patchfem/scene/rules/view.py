"""Views of the tables for the rules: a comparison with a missing or invalid value is false."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from ..keys.types import KeyValue, Table

# Value of a key as rules see it.
ViewValue: TypeAlias = "str | int | float | bool | TableView | tuple[ViewValue, ...]"


class _Unknown(float):
    """Placeholder for a missing or invalid value, which is false, empty and NaN."""

    def __bool__(self) -> bool:
        return False

    def __iter__(self) -> Iterator:
        return iter(())

    def __getattr__(self, name: str) -> _Unknown:
        """Return this value, whatever the attribute: a part of an unknown value is unknown."""
        return self

    def __getitem__(self, name: str) -> _Unknown:
        """Return this value, whatever the key."""
        return self


# As with every NaN, no comparison with this value holds except `!=`.
UNKNOWN_VALUE = _Unknown("nan")


class TableView:
    """Wrapper of a table in which missing values are UNKNOWN_VALUE.

    A rule compares the values of a view without asking first whether they are there. A field of a sentence, such as
    `{length:g}`, names an attribute of the view. AttributeError for a name that the table does not have.
    """

    def __init__(self, table: Table | None) -> None:
        self.table = table

    def __getattr__(self, name: str) -> ViewValue:
        """Return the value of a key of the table by its name, in the form of `wrap_value`.

        Without a table it is UNKNOWN_VALUE.
        """
        value = UNKNOWN_VALUE if self.table is None else wrap_value(getattr(self.table, name))
        self.__dict__[name] = value  # the next access finds the value without this method
        return value

    def __getitem__(self, name: str) -> ViewValue:
        """Return the value of a key of the table by its attribute name."""
        return getattr(self, name)


def wrap_value(value: KeyValue) -> ViewValue:
    """Wrap a value for the rules: a table becomes a TableView, and None becomes UNKNOWN_VALUE."""
    if value is None:
        return UNKNOWN_VALUE
    if isinstance(value, Table):
        return TableView(value)
    if isinstance(value, tuple):
        return tuple(map(wrap_value, value))
    return value
