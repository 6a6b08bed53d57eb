"""A scene during reading: raw values, tables read so far, and every mistake with its line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cached_property, lru_cache

from ...exceptions import PatchfemError
from ..keys.lines import find_key_lines, find_line, number_items_from_one
from ..keys.lookup import describe_missing_key, find_key
from ..keys.tables import Tables
from ..keys.types import Table, build_table
from ..keys.values import TomlTable, TomlValue
from .view import TableView

# Sort order of mistakes in --set, which are listed after those of all lines of a file.
SET_MISTAKE_ORDER = 10**9
# Pattern of a word that is cut in a message; keys, units and file names are shorter
_LONG_WORD_PATTERN = re.compile(r"[^\s/\\:]{200,}")


class SceneError(PatchfemError):
    """Error of a scene that cannot be run, with all of its mistakes."""

    def __init__(self, mistakes: Iterable[str]) -> None:
        self.mistakes = list(mistakes)
        super().__init__("\n".join(self.mistakes))


class SceneDraft:
    """A scene while it is read and checked.

    Every mistake takes the same way: a rule names the key and the sentence, the draft finds the line of the key, and
    `mistake_lines` lists all mistakes in the order of the file.

    Parameters
    ----------
    path : str
        Path of the file, as messages name it.
    text : str
        Text of the file.
    raw : dict
        Plain values of the file. Values of --set are written into them.

    - sets: dotted keys that --set wrote.
    - swept_key: key of [sweep] whose first value is being written; "" for values of --set.
    - tables: the tables as far as they could be read; a value that is missing or wrong is None.
    - remarks: sentences for the user that are not mistakes.
    - read_before: id of a plain table of `raw` -> the table that it gives, which need not be read again.
    """

    def __init__(self, path: str, text: str, raw: TomlTable) -> None:
        self.path = path
        self.text = text
        self.raw = raw
        self.sets: set[str] = set()
        self.swept_key = ""
        self.tables = build_table(Tables, {})
        self._values = TableView(self.tables)
        self.remarks: list[str] = []
        self.read_before: dict[int, Table] = {}
        # Keys that an unknown key probably means; they are not reported as missing.
        self.suggested_keys: set[str] = set()
        # Keys (order, line of text); a dict lists each mistake only once.
        self._mistakes: dict[tuple[int, str], None] = {}

    @cached_property
    def lines(self) -> dict[str, int]:
        """Line of the file by dotted key, found when the first message needs it; a scene without mistakes needs none."""
        return dict(find_key_lines(self.text))

    @property
    def values(self) -> TableView:
        """Tables read so far, in which missing or invalid values are UNKNOWN_VALUE."""
        if self._values.table is not self.tables:
            self._values = TableView(self.tables)
        return self._values

    @property
    def has_mistakes(self) -> bool:
        """Whether a mistake was reported."""
        return bool(self._mistakes)

    def has(self, key: str) -> bool:
        """Return whether the scene contains a key or table, even if its value is invalid."""
        return self.written_value(key) is not None

    def written_value(self, key: str) -> TomlValue | None:
        """Return the value at a dotted key as the user wrote it, or None if there is none."""
        return find_value(self.raw, key)

    def add_mistake(self, key: str, message: str) -> None:
        """Add a message about a mistake at the line of a key.

        If the key is missing, it is the line of the nearest table above it.
        """
        order, location = self._locate(key)
        self._add(order, location, number_items_from_one(f"{self.display_key(key)}: {message}"))

    def add_missing(self, key: str, reason: str) -> None:
        """Add a missing key as a mistake at the line of its table.

        The reason says what needs it.
        """
        needed = describe_missing_key(find_key(key), key)
        clauses = dict.fromkeys(filter(None, ("missing", needed, reason)))
        self.add_mistake(key, "; ".join(clauses))

    def add_missing_table(self, name: str, reason: str) -> None:
        """Add the missing table `name` as a mistake of the whole file.

        The reason says what needs it.
        """
        self._add(0, self.path, f"missing [{name}]: {reason}")

    def add_set_mistake(self, text: str) -> None:
        """Add the text of a mistake in a --set option, or a first value of [sweep], that cannot be applied."""
        if self.swept_key:
            self.add_mistake(self.swept_key, text)
        else:
            self._add(SET_MISTAKE_ORDER, "--set", text)

    def record_set(self, key: str) -> None:
        """Record that --set or [sweep] wrote a key, so that its mistakes are found there."""
        if self.swept_key:
            self.lines.setdefault(key, self.lines.get(self.swept_key, 0))
        else:
            self.sets.add(key)

    def add_remark(self, key: str, sentence: str) -> None:
        """Add a remark on a key whose value is no mistake; `sentence` follows the name of the key."""
        remark = number_items_from_one(f"{self.display_key(key)} {sentence}")
        if remark not in self.remarks:
            self.remarks.append(remark)

    def mistake_lines(self) -> list[str]:
        """Return one line of text per mistake, in the order of the file."""
        return [text for _, text in sorted(self._mistakes, key=lambda mistake: mistake[0])]

    def raise_mistakes(self) -> None:
        """Raise a SceneError with all mistakes, if there are any."""
        if self._mistakes:
            raise SceneError(self.mistake_lines())

    def display_key(self, key: str) -> str:
        """Return a key as the user writes it: a mode has its name instead of its number."""
        pieces = key.split(".")
        if pieces[:2] != ["structure", "mode"] or len(pieces) < 4 or pieces[3] == "name":
            return key
        name = self.written_value(".".join([*pieces[:3], "name"]))
        if isinstance(name, str) and name and not name.isdecimal():
            pieces[2] = name
        return ".".join(pieces)

    def _locate(self, key: str) -> tuple[int, str]:
        """Return the sort order of a mistake at a key and the text that locates it, such as FILE:LINE."""
        if find_line(dict.fromkeys(self.sets, 1), key):
            return SET_MISTAKE_ORDER, "--set"
        line = find_line(self.lines, key)
        return line, f"{self.path}:{line}" if line else self.path

    def _add(self, order: int, location: str, text: str) -> None:
        """Add the text of a mistake once, with the location before it.

        Long words and control characters are cut. `order` sorts the mistakes: a line number, or 0 for the whole file.
        """
        text = _LONG_WORD_PATTERN.sub(lambda word: f"{word[0][:60]}...", text)
        printable = "".join(sign if sign.isprintable() else " " for sign in text)
        self._mistakes.setdefault((order, f"{location}: {printable}"))


def find_value(value: TomlValue | None, key: str) -> TomlValue | None:
    """Return the value at a dotted key of nested tables, or None if there is none."""
    for piece in _split_at_dots(key):
        if isinstance(value, dict):
            value = value.get(piece)
        elif isinstance(value, list) and piece.isdecimal() and int(piece) < len(value):
            value = value[int(piece)]
        else:
            return None
    return value


@lru_cache(4096)
def _split_at_dots(key: str) -> tuple[str, ...]:
    """Return the words of a dotted key."""
    return tuple(key.split("."))
