"""Which line of a TOML text holds which key, so that every mistake can name its line."""

from __future__ import annotations

import re
from functools import lru_cache

DEEPEST = 50  # parts of a dotted key; no key of a scene has more than five
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_ITEM = re.compile(r"(.+)\[([1-9][0-9]{0,8})\]")
_PLACE = re.compile(
    r"\b((?:structure|drive)(?:\.[a-z_]+(?:\[[0-9]+\])?)+)\.([0-9]{1,9})(?![0-9a-zA-Z_])"
)
_BLANK = re.compile(r"(?:[ \t]+|\r?\n|#[^\n]*)*")
_SCALAR = re.compile(r"[^,\]}\n#]*")
_STRINGS = (
    re.compile(r'"""(?:\\[\s\S]|[^\\])*?"{3,5}'),
    re.compile(r"'''[\s\S]*?'{3,5}"),
    re.compile(r'"(?:\\.|[^"\\\n])*"'),
    re.compile(r"'[^'\n]*'"),
)


def pieces_of(key: str) -> list[str]:
    """The parts of a dotted key; an item that counts from one, ``structure.mode[1]``, has its place from 0 as a part of
    its own, as in ``structure.mode.0``."""
    out = []
    for piece in key.split("."):
        found = _ITEM.fullmatch(piece.strip())
        out += [found[1], str(int(found[2]) - 1)] if found else [piece.strip()]
    return out


def counted(text: str) -> str:
    """A message whose keys name items of a list as people count them: ``structure.mode.0`` is ``structure.mode[1]``."""
    found = _PLACE.sub(lambda found: f"{found[1]}[{int(found[2]) + 1}]", text)
    return found if found == text else counted(found)  # an item of a list in an item


def place_of(path, text: str, key: str) -> str:
    """``FILE:LINE: key`` for a message about a key of a text.

    The line is that of its table where the key is not written itself; without either there is none.
    """
    lines = key_lines(text)
    line = lines.get(key) or lines.get(key.rpartition(".")[0])
    return f"{path}:{line}: {counted(key)}" if line else f"{path}: {counted(key)}"


@lru_cache(16)
def key_lines(text: str) -> dict[str, int]:
    """Dotted key path -> line (from 1) in a valid TOML text; a table has the line of its header.

    Items of an array of tables count from 0 here (``structure.mode.0.name``, of which `counted` makes what people
    read); a table that only its sub-tables or dotted keys create has the line of the first of these. A text that is not
    TOML gives what was found before the fault. TooDeep for a key of more than DEEPEST parts: the paths of all of them
    would take the square of their number.
    """
    scan = _Scan(text)
    try:
        scan.document()
    except (_Fault, RecursionError):
        pass
    for path, line in list(scan.lines.items()):
        while "." in path:
            path = path.rpartition(".")[0]
            scan.lines.setdefault(path, line)
    return scan.lines


class _Fault(Exception):
    """The text is not TOML here."""


class TooDeep(ValueError):
    """A key of more than DEEPEST parts; `line`: where it stands, from 1."""

    def __init__(self, line: int) -> None:
        super().__init__(f"a key has more than {DEEPEST} parts; write table.key")
        self.line = line


class _Scan:
    """A cursor over TOML text that notes the line of each key and skips the values."""

    def __init__(self, text: str) -> None:
        self.text, self.at, self.lines = text, 0, {}
        self._line, self._counted = 1, 0
        self._last: dict[str, int] = {}

    def document(self) -> None:
        prefix = ""
        while self.peek():
            if self.take("["):
                prefix = self.header()
            else:
                self.pair(prefix)

    def header(self) -> str:
        many = self.text.startswith("[", self.at)
        self.at += many
        line = self.line()
        *outer, name = self.key()
        path = ""
        for part in outer:
            path = self.inside(_join(path, part))
        path = _join(path, name)
        self.expect("]]" if many else "]")
        if many:
            self.lines.setdefault(path, line)
            self._last[path] = self._last.get(path, -1) + 1
            path = self.inside(path)
        self.lines[path] = line
        return path

    def inside(self, path: str) -> str:
        return f"{path}.{self._last[path]}" if path in self._last else path

    def pair(self, prefix: str) -> None:
        self.peek()
        line = self.line()
        path = prefix
        for part in self.key():
            path = _join(path, part)
            self.lines.setdefault(path, line)
        self.expect("=")
        self.value(path)

    def value(self, path: str) -> None:
        start = self.peek()
        if start == "[":
            self.items("]", lambda index: self.item(f"{path}.{index}"))
        elif start == "{":
            self.items("}", lambda _: self.pair(path))
        elif start in ('"', "'"):
            self.string()
        else:
            self.match(_SCALAR)

    def item(self, path: str) -> None:
        self.peek()
        self.lines.setdefault(path, self.line())
        self.value(path)

    def items(self, end: str, one) -> None:
        self.at += 1
        index = 0
        while not (self.peek() and self.take(end)):
            one(index)
            index += 1
            self.peek()
            if not self.take(","):
                self.expect(end)
                return

    def key(self) -> list[str]:
        parts = []
        while True:
            if self.peek() in ('"', "'"):
                parts.append(self.string()[1:-1])
            else:
                parts.append(self.match(_BARE_KEY))
            self.peek()
            if not self.take("."):
                return parts
            if len(parts) >= DEEPEST:
                raise TooDeep(self.line())

    def string(self) -> str:
        for form in _STRINGS:
            if found := form.match(self.text, self.at):
                self.at = found.end()
                return found[0]
        raise _Fault

    def match(self, form: re.Pattern[str]) -> str:
        found = form.match(self.text, self.at)
        if not found or not found[0]:
            raise _Fault
        self.at = found.end()
        return found[0]

    def peek(self) -> str:
        """The next character that is neither blank nor comment; empty at the end."""
        self.at = _BLANK.match(self.text, self.at).end()
        return self.text[self.at : self.at + 1]

    def take(self, mark: str) -> bool:
        if not self.text.startswith(mark, self.at):
            return False
        self.at += len(mark)
        return True

    def expect(self, mark: str) -> None:
        self.peek()
        if not self.take(mark):
            raise _Fault

    def line(self) -> int:
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        return self._line


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
