"""Types of plain values, of which the tables of a scene are read."""

from typing import TypeAlias

# Value and table as tomllib gives them; a user of Python may write the same.
TomlValue: TypeAlias = "str | int | float | bool | list[TomlValue] | dict[str, TomlValue]"
TomlTable: TypeAlias = "dict[str, TomlValue]"
