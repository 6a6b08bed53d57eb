"""Line numbers of the keys of a TOML text, for messages, and parsing of dotted keys."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

# Largest number of parts in a dotted key; no key of a scene has more than five, and the run
# time is quadratic in their number.
MAX_KEY_PARTS = 50
_BARE_KEY_PATTERN = re.compile(r"[A-Za-z0-9_-]+")
_ITEM_PATTERN = re.compile(r"(.+)\[([1-9][0-9]{0,8})\]")
_ITEM_IN_MESSAGE_PATTERN = re.compile(
    r"\b((?:structure|drive)(?:\.[a-z_]+(?:\[[0-9]+\])?)+)\.([0-9]{1,9})(?![0-9a-zA-Z_])"
)
_BLANK_PATTERN = re.compile(r"(?:[ \t]+|\r?\n|#[^\n]*)*")
_SCALAR_PATTERN = re.compile(r"[^,\]}\n#]*")
_STRING_PATTERNS = (
    re.compile(r'"""(?:\\[\s\S]|[^\\])*?"{3,5}'),
    re.compile(r"'''[\s\S]*?'{3,5}"),
    re.compile(r'"(?:\\.|[^"\\\n])*"'),
    re.compile(r"'[^'\n]*'"),
)


def split_key(key: str) -> list[str]:
    """Split a dotted key into its parts, with items counted from 0."""
    parts = []
    for piece in key.split("."):
        item = _ITEM_PATTERN.fullmatch(piece.strip())
        parts += [item[1], str(int(item[2]) - 1)] if item else [piece.strip()]
    return parts


def number_items_from_one(text: str) -> str:
    """Write array items of a message in the form `structure.mode[1]`."""
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
        Dotted key. Its table stands in for a key that is not written; without its table there is no line.
    """
    lines = find_key_lines(text)
    line = lines.get(key) or lines.get(key.rpartition(".")[0])
    place = f"{path}:{line}" if line else path
    return f"{place}: {number_items_from_one(key)}"


@lru_cache(16)
def find_key_lines(text: str) -> dict[str, int]:
    """Return the line number of every key of a TOML text.

    A table has the line of its header; a table without a header that of the first key in it. Items of an array of
    tables count from 0, as in ``structure.mode.0.name``. A string that is not TOML gives the keys before the first error.
    Raises TooManyKeyParts for a key of more than MAX_KEY_PARTS parts.
    """
    scanner = _Scanner(text)
    try:
        scanner.scan_document()
    except (_SyntaxError, RecursionError):
        pass
    for path, line in list(scanner.lines.items()):
        while "." in path:
            path = path.rpartition(".")[0]
            scanner.lines.setdefault(path, line)
    return scanner.lines


class _SyntaxError(Exception):
    """Exception for text at the cursor that is not valid TOML."""


class TooManyKeyParts(ValueError):
    """Error for a key on `line`, counted from 1, that has more than MAX_KEY_PARTS parts."""

    def __init__(self, line: int) -> None:
        super().__init__(f"a key has more than {MAX_KEY_PARTS} parts; write table.key")
        self.line = line


class _Scanner:
    """Parser of TOML text that records the line of each key."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        self.lines: dict[str, int] = {}
        self._line = 1
        self._counted = 0  # text position up to which `_line` has counted the lines
        self._last_item: dict[str, int] = {}  # index of the last item of each array of tables

    def scan_document(self) -> None:
        """Scan a complete TOML text."""
        prefix = ""
        while self.peek():
            if self.take("["):
                prefix = self.scan_header()
            else:
                self.scan_pair(prefix)

    def scan_header(self) -> str:
        """Read the header of a table and return its dotted key."""
        is_array = self.text.startswith("[", self.position)
        self.position += is_array
        line = self.current_line()
        *outer, name = self.scan_key()
        path = ""
        for part in outer:
            path = self.last_item_path(_join_path(path, part))
        path = _join_path(path, name)
        self.expect("]]" if is_array else "]")
        if is_array:
            self.lines.setdefault(path, line)
            self._last_item[path] = self._last_item.get(path, -1) + 1
            path = self.last_item_path(path)
        self.lines[path] = line
        return path

    def last_item_path(self, path: str) -> str:
        """Return the dotted key of a table, with the index of its last item if it is an array."""
        return f"{path}.{self._last_item[path]}" if path in self._last_item else path

    def scan_pair(self, prefix: str) -> None:
        """Read ``key = value`` inside the table `prefix`."""
        self.peek()
        line = self.current_line()
        path = prefix
        for part in self.scan_key():
            path = _join_path(path, part)
            self.lines.setdefault(path, line)
        self.expect("=")
        self.scan_value(path)

    def scan_value(self, path: str) -> None:
        """Skip a value, and record the keys inside it."""
        start = self.peek()
        if start == "[":
            self.scan_items("]", lambda index: self.scan_item(f"{path}.{index}"))
        elif start == "{":
            self.scan_items("}", lambda _: self.scan_pair(path))
        elif start in ('"', "'"):
            self.scan_string()
        else:
            self.match(_SCALAR_PATTERN)

    def scan_item(self, path: str) -> None:
        """Scan one item of a TOML array."""
        self.peek()
        self.lines.setdefault(path, self.current_line())
        self.scan_value(path)

    def scan_items(self, end: str, scan_one: Callable) -> None:
        """Scan the items between brackets, separated by commas."""
        self.position += 1
        index = 0
        while not (self.peek() and self.take(end)):
            scan_one(index)
            index += 1
            self.peek()
            if not self.take(","):
                self.expect(end)
                return

    def scan_key(self) -> list[str]:
        """Read a dotted key and return its parts."""
        parts = []
        while True:
            if self.peek() in ('"', "'"):
                parts.append(self.scan_string()[1:-1])
            else:
                parts.append(self.match(_BARE_KEY_PATTERN))
            self.peek()
            if not self.take("."):
                return parts
            if len(parts) >= MAX_KEY_PARTS:
                raise TooManyKeyParts(self.current_line())

    def scan_string(self) -> str:
        """Read a string and return it with its quotes."""
        for pattern in _STRING_PATTERNS:
            if match := pattern.match(self.text, self.position):
                self.position = match.end()
                return match[0]
        raise _SyntaxError

    def match(self, pattern: re.Pattern[str]) -> str:
        """Consume the text that a pattern matches at the cursor."""
        match = pattern.match(self.text, self.position)
        if not match or not match[0]:
            raise _SyntaxError
        self.position = match.end()
        return match[0]

    def peek(self) -> str:
        """Skip blanks and comments and return the next character, or "" at the end of the text."""
        self.position = _BLANK_PATTERN.match(self.text, self.position).end()
        return self.text[self.position : self.position + 1]

    def take(self, mark: str) -> bool:
        """Consume a token if it is at the cursor, and return whether it was there."""
        if not self.text.startswith(mark, self.position):
            return False
        self.position += len(mark)
        return True

    def expect(self, mark: str) -> None:
        """Skip blanks and the token that must follow them."""
        self.peek()
        if not self.take(mark):
            raise _SyntaxError

    def current_line(self) -> int:
        """Return the number of the line at the cursor, counted from 1."""
        self._line += self.text.count("\n", self._counted, self.position)
        self._counted = self.position
        return self._line


def _join_path(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
