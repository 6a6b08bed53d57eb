"""A scene: one TOML file, read into SI values with every mistake named at once.

`load` reads a file, `loads` a text; both give a `Scene` whose attributes are the tables (`scene.contact.length` is a
float in metres, an absent table is None) or raise a `SceneError` that holds one line per mistake.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import shorten
from typing import Any

from ..disk.open_with_timeout import reading
from ..effects import MOST_COORDINATES, takes
from . import axes
from .keys import tables
from .keys.memoize import once
from .keys.types import keys as keys_of
from .lines import DEEPEST, TooDeep, key_lines, place_of
from .reader import Draft, SceneError, apply_set
from .rules.accuracy import knobs_unused
from .rules.check import check
from .rules.drive import drive_unused, waveform_unused
from .rules.friction import kinetic_unused, rest_speed_unused, temperature_unused
from .rules.limits import combinations, not_yet_built
from .rules.methods import method_unused
from .rules.scene_draft import ASPERITIES, LAWS, SLIDES, unused
from .rules.structure import unseen
from .sets import assignments, sized
from .text import effects, toml

AT = "structure.interface"
LARGEST = 32 * 2**20  # bytes of a scene
# a key with a value that opens no quotes and no bracket
_VALUE = re.compile(r"\s*([\w.-]+)\s*=\s*([^#\"'\[{]+)")


@dataclass(frozen=True)
class Scene:
    """A valid scene in SI: its tables (None where absent), the kind of run, its text, remarks on unused keys, the
    --set strings that were applied, the axes of [sweep], () without it, and notes on what its defaults leave out."""

    path: Path
    text: str
    kind: str
    title: str
    contact: tables.Contact | None
    normal: tables.Normal | None
    friction: tables.Friction | None
    slide: tables.Slide | None
    structure: tables.Structure | None
    drive: tables.Drive | None
    wear: tables.Wear | None
    accuracy: tables.Accuracy
    measured: tables.Measured | None
    remarks: list[str]
    sets: tuple[str, ...] = ()
    sweep: tuple = ()
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        sets = f"\n  with {shorten(', '.join(self.sets), 160)}" if self.sets else ""
        return (
            f"Scene of {self.path.name}: {self.kind}; {shorten(', '.join(self.named()), 160)}{sets}"
        )

    def with_(self, **sets: Any) -> Scene:
        """A copy with other values, as ``scene.with_(**{"contact.load": "26 lbf"})``: texts as in a scene, numbers in
        SI. SceneError as `load`, and for a length without a unit that no joint has."""
        return sized(
            with_files(loads(self.text, self.path, (*self.sets, *assignments(sets)))), sets
        )

    def tables(self) -> tables.Tables:
        """All tables as one model, absent ones None."""
        names = tables.Tables.model_fields
        return tables.Tables.model_construct(**{name: getattr(self, name) for name in names})

    def resolved(self) -> str:
        """The scene as TOML in SI with every default written out; loading it gives the same values."""
        return toml(self.tables())

    def named(self) -> list[str]:
        """The effects the scene names: a table, or ``table.key=value`` for the selectors of a table that has them."""
        return effects(self) + ["sweep"] * bool(self.sweep)

    def where(self, key: str) -> str:
        """``FILE:LINE: key`` for a message about a key."""
        return place_of(self.path, self.text, key)

    def beside(self, name: str) -> Path:
        """A path written in the scene, which is relative to the scene's own folder."""
        return self.path.parent / name


def load(path: str | Path, sets: Iterable[str] = (), faults: Callable | None = None) -> Scene:
    """Read a scene file, with ``table.key=value`` strings applied in order; SceneError with all mistakes at once.

    A file that the scene names and that is not there is a mistake. faults(tables, folder, whole) gives (key, message)
    of more mistakes, such as those inside these files; it sees the tables as far as they could be read, whole where
    they have no mistake.
    """
    text = text_of(path)

    def of_files(found: tables.Tables, whole: bool) -> Iterable[tuple[str, str]]:
        folder = Path(path).parent
        return [*absent_files(found, folder), *(faults(found, folder, whole) if faults else ())]

    return loads(text, path, sets, of_files)


def text_of(path: str | Path) -> str:
    """The text of a scene file; SceneError where it cannot be read."""
    try:
        with reading(path) as file:
            content = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        advice = "; give a scene file, such as rig.toml" if Path(path).is_dir() else ""
        raise SceneError([f"{path}: cannot be read: {reason}{advice}"]) from None
    if len(content) > LARGEST:
        raise SceneError(
            [
                f"{path}: more than {LARGEST >> 20} MiB, too large for a scene; put matrices into a file and "
                "give its name in structure.file"
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


def moved(found: Scene, path: Path) -> Scene:
    """The scene as if it stood at another path, its own files named from there."""
    sets = [
        f"{key}={Path(os.path.relpath(found.beside(file), path.parent)).as_posix()}"
        for key, file in files_of(found)
    ]
    return loads(found.text, path, [*found.sets, *sets])


def with_files(found: Scene) -> Scene:
    """The scene itself; SceneError where a file that it names is not there."""
    absent = absent_files(found, found.path.parent)
    if absent:
        lines = key_lines(found.text)
        raise SceneError(
            [
                f"{found.path}:{lines[key]}: {key}: {message}"
                if key in lines
                else f"--set: {key}: {message}"
                for key, message in absent
            ]
        )
    return found


def files_of(found: tables.Tables | Scene) -> list[tuple[str, str]]:
    """(key, file) of every file that the tables of a scene name."""
    own = (found.structure and found.structure.interface) or ()
    named = [
        *_contact_files(found.contact, "contact"),
        *(
            one
            for k, face in enumerate(own)
            for one in _contact_files(face.contact, f"{AT}.{k}.contact")
        ),
        ("slide.file", found.slide and found.slide.file),
        ("drive.file", found.drive and found.drive.file),
        ("structure.file", found.structure and found.structure.file),
        *_reduced_files(found.structure),
        ("measured.file", found.measured and found.measured.file),
        ("wear.start", found.wear and found.wear.start),
    ]
    return [(key, file) for key, file in named if file]


def _contact_files(contact: tables.Contact | None, at: str) -> list[tuple[str, Any]]:
    """(key, file or nothing) of the files of a patch."""
    if contact is None:
        return []
    profile, rough = contact.profile, contact.asperities
    return [
        (f"{at}.mesh", contact.mesh),
        (f"{at}.profile.file", profile and profile.file),
        (f"{at}.asperities.from", rough and rough.law == "hertz" and rough.from_),
    ]


def _reduced_files(structure: tables.Structure | None) -> list[tuple[str, Any]]:
    """(key, file) of the matrices of [structure.reduced]; a damping ratio is no file."""
    reduced = structure and structure.reduced
    return [
        (f"structure.reduced.{name}", file)
        for name in ("stiffness", "mass", "damping")
        if reduced and isinstance(file := getattr(reduced, name), str)
    ]


def is_there(path: Path) -> bool:
    """Whether a path is that of a file; False for a text that can be no path."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def absent_files(found: tables.Tables | Scene, folder: Path) -> list[tuple[str, str]]:
    """(key, message) of every file that the tables name and that is not there."""
    return [
        (key, f"there is no file {folder / file}; paths are relative to the scene")
        for key, file in files_of(found)
        if not is_there(folder / file)
    ]


def loads(
    text: str,
    path: str | Path = "scene.toml",
    sets: Iterable[str] = (),
    more: Callable | None = None,
) -> Scene:
    """Read a scene from its text; `path` only names it in messages and is what its own paths are relative to.

    more(tables, whole) gives (key, message) of mistakes beside those of the text; whole: the tables have none. A key
    that `sets` holds is swept no more.
    """
    raw, lines = _parsed(text, path)
    sets, axes = tuple(sets), []
    draft = Draft(str(path), lines, raw)
    if "sweep" in raw:
        fixed = {one.partition("=")[0].strip() for one in sets}
        axes = [axis for axis in _axes(draft, raw.pop("sweep")) if axis.key not in fixed]
    # of a key that only [sweep] holds
    first = [axis for axis in axes if not draft.given_as_set(axis.key)]
    for one in (*(f"{axis.key}={axis.texts[0]}" for axis in first), *sets):
        apply_set(draft, one)
    found = scene_of(draft, path, text, sets, more)
    return replace(found, sweep=tuple(axes)) if axes else found


def scene_of(
    draft: Draft, path: str | Path, text: str, sets: tuple[str, ...], more: Callable | None = None
) -> Scene:
    """The scene of a draft in which nothing is read yet and `sets` are applied; arguments and errors as `loads`."""
    draft.read()
    kind = check(draft)
    wrong = bool(draft.mistakes)
    combinations(draft, kind)
    found = None if wrong else _finish(draft.tables, kind)
    for key, message in () if found is None else not_yet_built(found):
        draft.say(key, message)
    for key, message in () if more is None else more(draft.tables, not draft.mistakes):
        draft.say(key, message)
    if draft.mistakes:
        raise SceneError(draft.lines_of_mistakes())
    values = {name: getattr(found, name) for name in tables.Tables.model_fields}
    path = path if isinstance(path, Path) else Path(path)
    drive = draft.tables.drive
    notes = tuple(unseen(draft.tables.structure, drive is not None and drive.kind == "base"))
    return Scene(
        path=path, text=text, kind=kind, remarks=draft.remarks, sets=sets, notes=notes, **values
    )


def axes_of(text: str, path: str | Path) -> tuple[list, list[str]]:
    """(axes, mistakes) of the table [sweep] of a text, of which nothing else is read; SceneError if it is no TOML."""
    raw, lines = _parsed(text, path)
    draft = Draft(str(path), lines, raw)
    axes = _axes(draft, raw["sweep"]) if "sweep" in raw else []
    return axes, draft.lines_of_mistakes()


def _parsed(text: str, path: str | Path) -> tuple[dict, dict[str, int]]:
    """The plain values of a text and the lines of its keys; SceneError if it is no TOML, or names too many masses."""
    try:
        if any(line.count(".") > DEEPEST for line in text.split("\n")):
            key_lines(text)  # it refuses keys of so many parts that reading them takes minutes
        raw = tomllib.loads(text)
        _refuse_crowds(raw, text, path)
        return raw, key_lines(text)
    except TooDeep as error:
        raise SceneError([f"{path}:{error.line}: {error}"]) from None
    except (ValueError, RecursionError) as error:
        raise SceneError([_syntax(error, text, path)]) from None


def _refuse_crowds(raw: dict, text: str, path: str | Path) -> None:
    """SceneError for more masses or modes than any run can take, before each of their tables is read."""
    structure = raw.get("structure")
    for key, form in (("masses", r"masses\s*="), ("mode", r"\[\[\s*structure\s*\.\s*mode\s*\]\]")):
        count = (
            len(items)
            if isinstance(structure, dict) and isinstance(items := structure.get(key), list)
            else 0
        )
        if count > MOST_COORDINATES:
            found = re.search(rf"^[ \t]*{form}", text, re.MULTILINE)
            line = f":{text.count(chr(10), 0, found.start()) + 1}" if found else ""
            raise SceneError(
                [
                    f"{path}{line}: structure.{key}: {count} entries are more than the limit of "
                    f"{MOST_COORDINATES}; solving their modes as one full matrix would take "
                    f"{8e-9 * 3 * count**2:.2g} GB of memory and about {1.5e-9 * count**3:.2g} s of "
                    "computing time; give fewer entries, or give the modes themselves in structure.file"
                ]
            )


def _axes(draft: Draft, table: Any) -> list:
    """The axes of [sweep]; mistakes are said."""
    found, wrong = axes.of_table(table)
    for key, message in wrong:
        draft.say(key, message)
    return found


def _syntax(error: Exception, text: str, path: str | Path) -> str:
    if isinstance(error, RecursionError):
        return f"{path}:1: not valid TOML: nested too deeply"
    message = str(error)
    found = re.search(r" \(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    line = int(found[1]) if found and found[1] else text.count("\n") + (not text.endswith("\n"))
    where = (
        f" (column {found[2]})"
        if found and found[2]
        else " (at the end of the file)"
        if found
        else ""
    )
    message = message[: found.start()] if found else message
    return f"{path}:{line}: not valid TOML: {message}{where}{_unquoted(text, line)}"


def _unquoted(text: str, line: int) -> str:
    """How a value is written that TOML refuses for want of quotes or of a digit; empty for any other mistake."""
    found = _VALUE.match([*text.split("\n"), ""][line - 1])
    if found is None:
        return ""
    key, value = found[1], found[2].strip()
    point = re.fullmatch(r"([-+]?)(\d*)\.(\d*)((?:[eE][-+]?\d+)?)", value)
    if point and (point[2] or point[3]):
        return f"; put a digit on both sides of the point: {key} = {point[1]}{point[2] or 0}.{point[3] or 0}{point[4]}"
    if re.fullmatch(r"[-+]?\d+,\d+", value):
        return f"; write the decimal comma as a point: {key} = {value.replace(',', '.')}"
    if value.lower() in ("true", "false"):
        return f"; {key} = {value.lower()}"
    if percent := re.fullmatch(r"([-+]?(?:\d+\.?\d*|\.\d+))\s*%", value):
        return f"; write a percentage as a plain number: {key} = {float(percent[1]) / 100:.12g}"
    quoted = re.fullmatch(
        r"[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(?![eE]$)[a-zA-Z%\u00b5\u03bc][a-zA-Z\u00b5\u03bc/^0-9 -]*|"
        r"[a-zA-Z][\w./ -]*",
        value,
    )
    return (
        f'; put a quantity or a word in quotes: {key} = "{value}"'
        if quoted and len(value) < 60
        else ""
    )


def _finish(found: tables.Tables, kind: str) -> tables.Tables:
    """Fill the defaults that depend on other keys and drop the keys that the chosen law or kind does not use."""
    new: dict[str, Any] = {}
    if found.contact:
        new["contact"] = _contact(found.contact)
    without = list(knobs_unused(found, kind)) + ["method"] * (
        found.accuracy.method in method_unused(kind)
    )
    if without:
        new["accuracy"] = _without(found.accuracy, without)
    if found.friction:
        new["friction"] = _law(found.friction)
    if found.slide:
        new["slide"] = _slide(found.slide)
    if found.structure:
        new["structure"] = _structure(found.structure)
    if found.drive:
        new["drive"] = _drive(found.drive)
    return found.model_copy(update=new)


@once
def _slide(slide: tables.Slide) -> tables.Slide:
    slide = _without(slide, unused(slide, "kind", SLIDES))
    fill = {
        "sine": {"cycles": 1.0},
        "triangle": {"cycles": 1.0, "distance": 0.0},
        "dwell": {"distance_after": 0.0},
    }
    return _filled(slide, fill.get(slide.kind, {}))


@once
def _structure(structure: tables.Structure) -> tables.Structure:
    update: dict[str, Any] = {
        "mode": tuple(_mode(mode, not index) for index, mode in enumerate(structure.mode))
    }
    update["interface"] = tuple(
        one if one.contact is None else one.model_copy(update={"contact": _contact(one.contact)})
        for one in map(_law, structure.interface)
    )
    if (structure.masses or structure.reduced) and structure.output_mass is None:
        update["output_mass"] = 1
    return structure.model_copy(update=update)


@once
def _drive(drive: tables.Drive) -> tables.Drive:
    keys = set(drive_unused(drive))
    if drive.kind != "free":
        keys |= waveform_unused(drive)
    return _without(drive, keys)


@once
def _contact(contact: tables.Contact) -> tables.Contact:
    if contact.asperities:
        asperities = _without(contact.asperities, unused(contact.asperities, "law", ASPERITIES))
        contact = contact.model_copy(update={"asperities": asperities})
    return _without(contact, ["element_size"]) if contact.mesh else contact


@once
def _law(law: tables.Friction) -> tables.Friction:
    idle = {
        "kinetic": kinetic_unused(law),
        "rest_speed": rest_speed_unused(law),
        "temperature": temperature_unused(law),
    }
    law = _without(
        law, unused(law, "law", LAWS) | {key for key, without in idle.items() if without}
    )
    return _filled(law, {"kinetic": law.static}) if takes(law.law, "kinetic") else law


def _mode(mode: tables.Mode, first: bool) -> tables.Mode:
    share = mode.slide if first else 0.0
    mode = _filled(mode, {"base": share, "output": share})
    return _filled(mode, {"accelerometer": mode.output, "gauge": mode.output})


def _filled(table: Any, values: dict[str, Any]) -> Any:
    """The table with values in place of None."""
    return table.model_copy(
        update={name: value for name, value in values.items() if getattr(table, name) is None}
    )


def _without(table: Any, keys: Iterable[str]) -> Any:
    """The table with these keys back at their defaults."""
    fields, names = type(table).model_fields, keys_of(type(table))
    return table.model_copy(update={names[key]: fields[names[key]].default for key in keys})
