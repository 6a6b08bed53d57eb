"""Reading of the text of a scene: the file, the TOML values, and messages about TOML syntax."""

from __future__ import annotations

import os
import re
import tomllib
from contextlib import suppress
from pathlib import Path

from ..disk.open_with_timeout import open_for_reading
from .keys.values import TomlTable
from .rules.scene_draft import SceneError

# Largest size of a scene file in bytes; larger data belong in files that the scene names.
MAX_SCENE_FILE_BYTES = 4 * 2**20
# Pattern of a quantity or a word without quotes
_QUANTITY_OR_WORD_PATTERN = re.compile(
    r"[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(?![eE]$)[a-zA-Z%\u00b5\u03bc][a-zA-Z\u00b5\u03bc/^0-9 -]*|"
    r"[a-zA-Z][\w./ -]*"
)


def name_file(path: Path, folder: str | Path) -> str:
    """Return the name of the file `path` in a scene of a folder.

    It is relative, with slashes; absolute for a file on another drive, to which Windows has no relative path.
    """
    path = os.path.abspath(path)
    with suppress(ValueError):
        path = os.path.relpath(path, folder)
    return Path(path).as_posix()


def read_text(path: str | Path) -> str:
    """Return the text of the scene file `path`.

    SceneError is raised if it cannot be read.
    """
    try:
        with open_for_reading(path) as file:
            content = file.read(MAX_SCENE_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        advice = "; give a scene file, such as rig.toml" if Path(path).is_dir() else ""
        raise SceneError([f"{path}: cannot be read: {reason}{advice}"]) from None

    # A large file would take minutes to read.
    if len(content) > MAX_SCENE_FILE_BYTES:
        raise SceneError(
            [
                f"{path}: more than {MAX_SCENE_FILE_BYTES >> 20} MiB, too large for a scene; put matrices into a file "
                "and give its name in structure.file"
            ]
        )
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        byte = content[error.start]
        raise SceneError(
            [f"{path}:{line}: not UTF-8: byte 0x{byte:02x}; save the scene as UTF-8 text"]
        ) from None


def parse_text(text: str, path: str | Path) -> TomlTable:
    """Return the values of a TOML text.

    `path` names the file in the message of the SceneError that is raised if the text is not TOML.
    """
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SceneError([_describe_syntax(error, text, path)]) from None


def _describe_syntax(error: Exception, text: str, path: str | Path) -> str:
    """Return the message on a TOML syntax error in the text of the file `path`."""
    if isinstance(error, RecursionError):
        return f"{path}:1: not valid TOML: nested too deeply"
    message = str(error)
    place = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    line = text.count("\n") + (not text.endswith("\n"))
    where = ""
    if place:
        message = message[: place.start()]
        where = " (at the end of the file)"
    if place and place[1]:
        line = int(place[1])
        where = f" (column {place[2]})"
    return f"{path}:{line}: not valid TOML: {message}{where}{_advise_spelling(text, line)}"


def _advise_spelling(text: str, line: int) -> str:
    """Return how to write the value in a `line` of a text that lacks quotes or a digit, or "" for others."""
    # A key with a value that opens neither quotes nor a bracket
    match = re.match(r"\s*([\w.-]+)\s*=\s*([^#\"'\[{]+)", [*text.split("\n"), ""][line - 1])
    if match is None:
        return ""
    key = match[1]
    value = match[2].strip()
    # A number may lack a digit before or after its point
    point = re.fullmatch(r"([-+]?)(\d*)\.(\d*)((?:[eE][-+]?\d+)?)", value)
    if point and (point[2] or point[3]):
        number = f"{point[1]}{point[2] or 0}.{point[3] or 0}{point[4]}"
        return f"; put a digit on both sides of the point: {key} = {number}"
    if re.fullmatch(r"[-+]?\d+,\d+", value):
        return f"; write the decimal comma as a point: {key} = {value.replace(',', '.')}"
    if _QUANTITY_OR_WORD_PATTERN.fullmatch(value) and len(value) < 60:
        return f'; put a quantity or a word in quotes: {key} = "{value}"'
    return ""
