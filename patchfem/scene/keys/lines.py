"""Line numbers of the keys of a TOML text, for messages, and parsing of dotted keys."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

from .types import KeyValue
from .values import TomlTable, TomlValue

# Pattern of an item with its number from 1, such as mode[1]
_ITEM_PATTERN = re.compile(r"(.+)\[([1-9][0-9]{0,8})\]")
# Pattern of an item in a message with its number from 0, such as structure.mode.0
_ITEM_IN_MESSAGE_PATTERN = re.compile(
    r"\b((?:structure|drive|wear)(?:\.[a-z_]+(?:\[[0-9]+\])?)+)\.([0-9]{1,9})(?![0-9a-zA-Z_])"
)
_BLANK_PATTERN = re.compile(r"(?:[ \t]+|\r?\n|#[^\n]*)*")
# Pattern of one word of a dotted key in TOML, bare or in quotes
_KEY_PART = r"""[A-Za-z0-9_-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*'"""
_KEY = rf"((?:{_KEY_PART})(?:[ \t]*\.[ \t]*(?:{_KEY_PART}))*)[ \t]*"
_KEY_PART_PATTERN = re.compile(_KEY_PART)
_HEADER_PATTERN = re.compile(rf"\[(\[)?[ \t]*{_KEY}\](?(1)\])")
_PAIR_PATTERN = re.compile(rf"{_KEY}=")
# Value without inner values: a string in one of four kinds of quotes, a number, a date or a word.
_VALUE_PATTERN = re.compile(
    r'"""(?:\\[\s\S]|[^\\])*?"{3,5}|'
    r"\'\'\'[\s\S]*?\'{3,5}|"
    r'"(?:\\.|[^"\\\n])*"|'
    r"\'[^\'\n]*\'|"
    r"""[^,\]}\n#"'][^,\]}\n#]*"""
)


def split_key(key: str) -> list[str]:
    """Split a dotted key into its parts, with items counted from 0."""
    parts = []
    for piece in key.split("."):
        item = _ITEM_PATTERN.fullmatch(piece.strip())
        parts += [item[1], str(int(item[2]) - 1)] if item else [piece.strip()]
    return parts


def split_assignment(text: str) -> tuple[str, str]:
    """Split a text ``table.key=values`` into key and values.

    These are "" without an equals sign.
    """
    key, _, values = text.partition("=")
    return key.strip(), values.strip()


def list_item_names(items: Sequence[KeyValue | TomlValue]) -> list[str | None]:
    """Return the name of each table of an array, read or not, or None for an item without it."""
    return [find_part(item, "name") for item in items]


def find_item(items: Sequence[KeyValue | TomlValue], piece: str) -> int | None:
    """Return the index of the item that `piece` of a dotted key names, or None if there is none.

    An item of an array of tables is named by its key `name`, or by its number counted from 0.
    """
    names = list_item_names(items)
    if piece in names:
        return names.index(piece)
    return int(piece) if piece.isdecimal() and int(piece) < len(names) else None


def find_part(holder: KeyValue | TomlValue, name: str) -> KeyValue | TomlValue:
    """Return the value of the key `name` of a table, or None if there is none.

    `holder` is the table, either as plain values (a dict) or after it has been read.
    """
    return holder.get(name) if isinstance(holder, dict) else getattr(holder, name, None)


def find_scene_value(scene: KeyValue | TomlTable, key: str) -> tuple[str, KeyValue | TomlValue]:
    """Find the value of a dotted key in a scene or in its plain values.

    Returns the key with items by number, and the value or None.
    """
    value = scene
    pieces = []
    for piece in split_key(key):
        if isinstance(value, list | tuple):
            index = find_item(value, piece)
            piece = piece if index is None else str(index)
            value = None if index is None else value[index]
        else:
            value = find_part(value, piece)
        pieces.append(piece)
    return ".".join(pieces), value


def number_items_from_one(text: str) -> str:
    """Return the text of a message in which array items have the form `structure.mode[1]`.

    Inside the program they are `structure.mode.0`, counted from 0.
    """
    changed = _ITEM_IN_MESSAGE_PATTERN.sub(lambda item: f"{item[1]}[{int(item[2]) + 1}]", text)
    # An item inside another item needs a second pass.
    return changed if changed == text else number_items_from_one(changed)


def locate_key(path: str | Path, text: str, key: str) -> str:
    """Return ``FILE:LINE: key`` for a message about a key of a scene.

    Parameters
    ----------
    path : str or Path
        File of the scene.
    text : str
        Its content.
    key : str
        Dotted key. The nearest table above stands in for a key that is not written; without any there is no line.
    """
    line = find_line(find_key_lines(text), key)
    place = f"{path}:{line}" if line else path
    return f"{place}: {number_items_from_one(key)}"


def find_line(lines: dict[str, int], key: str) -> int:
    """Return the line of a key, or of the nearest table above it that has one; 0 if there is none."""
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return lines.get(key, 0)


@lru_cache(16)
def find_key_lines(text: str) -> dict[str, int]:
    """Return the line number of every key of a TOML text.

    A table has the line of its header; a table without a header that of the first key in it. Items of an array of
    tables count from 0, as in ``structure.mode.0.name``. A string that is not TOML gives the keys before the first error.

    Parameters
    ----------
    text : str
        Text of a scene.

    Returns
    -------
    dict of str to int
        Line, from 1, by dotted key.
    """
    lines: dict[str, int] = {}
    last_item: dict[str, int] = {}  # index of the last item of each array of tables
    table = ""  # dotted key of the table to which the pairs at this place belong
    opened: list[tuple[str, int | None]] = []  # arrays and their next index, inline tables and None
    line = 1
    position = 0
    while True:
        # Blanks, line breaks and comments.
        start = position
        position = _BLANK_PATTERN.match(text, position).end()
        line += text.count("\n", start, position)
        path, index = opened[-1] if opened else (table, None)

        # The end of an array or inline table, or the next item in it.
        if opened and text[position : position + 1] in ("]", "}", ","):
            opened.pop()
            if text[position] == ",":
                opened.append((path, None if index is None else index + 1))
            position += 1
            continue

        # The header of a table.
        if not opened and (match := _HEADER_PATTERN.match(text, position)):
            table = _record_header(
                lines, last_item, _split_written_key(match[2]), line, is_array=bool(match[1])
            )
            position = match.end()
            continue

        # An item of an array or a pair, followed by its value.
        if index is not None:
            path = f"{path}.{index}"
            lines.setdefault(path, line)
        elif match := _PAIR_PATTERN.match(text, position):
            for part in _split_written_key(match[1]):
                path = _join_path(path, part)
                lines.setdefault(path, line)
            position = _BLANK_PATTERN.match(text, match.end()).end()
        else:
            break

        # The value: an array or an inline table with further keys, or a number, text, truth or date.
        if text[position : position + 1] in ("[", "{"):
            opened.append((path, 0 if text[position] == "[" else None))
            position += 1
        elif match := _VALUE_PATTERN.match(text, position):
            line += match[0].count("\n")
            position = match.end()
        else:
            break

    # A table that has no header of its own.
    for path, line in list(lines.items()):
        while "." in path:
            path = path.rpartition(".")[0]
            lines.setdefault(path, line)
    return lines


def _record_header(
    lines: dict[str, int], last_item: dict[str, int], parts: list[str], line: int, *, is_array: bool
) -> str:
    """Record the line of the header of a table, and return the dotted key of the table.

    Parameters
    ----------
    lines : dict of str to int
        Lines by dotted key, which are extended.
    last_item : dict of str to int
        Index of the last item of each array of tables, by its dotted key. It is updated.
    parts : list of str
        Names in the header, such as ["structure", "interface"].
    line : int
        Number of the line.
    is_array : bool
        Whether the header is that of an item of an array, [[...]].
    """
    path = ""
    for part in parts:
        item = f".{last_item[path]}" if path in last_item else ""
        path = _join_path(f"{path}{item}", part)
    if is_array:
        lines.setdefault(path, line)
        last_item[path] = last_item.get(path, -1) + 1
        path = f"{path}.{last_item[path]}"
    lines[path] = line
    return path


def _split_written_key(key: str) -> list[str]:
    """Return the parts of a key of a TOML text, without their quotes."""
    return [part.strip("\"'") for part in _KEY_PART_PATTERN.findall(key)]


def _join_path(path: str, name: str) -> str:
    """Return the dotted key of `name` in the table `path`.

    The outermost table has the path "".
    """
    return f"{path}.{name}" if path else name
