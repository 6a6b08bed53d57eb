"""A scene: the checked values of one TOML file in SI, read with every mistake named at once.

`load` reads a file and `loads` a text. Both return a `Scene`, whose attributes are the tables: `scene.contact.length` is
a float in metres, and a missing table is None. Otherwise they raise a `SceneError` with one line per mistake.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import shorten

from . import assignments
from .defaults import complete_tables
from .files import list_absent_files, rename_files, require_files
from .keys import tables
from .keys.lines import find_scene_value, locate_key, split_assignment
from .keys.values import TomlValue
from .reader import apply_set, read_tables
from .rules.check import check_scene
from .rules.scene_draft import SceneDraft, SceneError
from .rules.structure import describe_mode_defaults
from .rules.support import check_combinations
from .sets import format_assignments, require_units
from .text import format_toml, list_named_effects
from .toml_text import name_file, parse_text, read_text

__all__ = [
    "Scene",
    "SceneError",
    "add_sets",
    "attach_written",
    "load",
    "loads",
    "read_sweep_axes",
]


@dataclass(frozen=True)
class Scene:
    """Validated scene in SI units.

    - path: file of the scene; its own paths are relative to the folder of this file.
    - text: content of the file.
    - kind: kind of run: "patch", "bench", "rig" or "linear".
    - title, contact, normal, friction, slide, structure, drive, wear, accuracy, measured: title and tables;
      None for a table that the scene does not contain.
    - remarks: sentences about keys that are not used.
    - sets: the ``table.key=value`` of --set, in their order.
    - sweep: axes of the table [sweep].
    - notes: sentences about what the defaults leave out.
    - written: the scene of the file, without `sets`, if its joint may have to be subtracted from modes
      that were measured with it; None for other scenes and without `sets`.
    """

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
    sweep: tuple[assignments.Axis, ...] = ()
    notes: tuple[str, ...] = ()
    written: Scene | None = None

    def __repr__(self) -> str:
        words = ", ".join((*self.effect_names(), *self.sets))
        return f"Scene of {self.path.name}: {self.kind}; {shorten(words, 160)}"

    def with_(self, **sets: TomlValue) -> Scene:
        """Return a copy of the scene with the values of the given keys replaced.

        Texts are written as in a scene, numbers are in SI. Raises SceneError as in `load`, and for a length without a unit
        that is longer than any joint.
        """
        scene = loads(self.text, self.path, (*self.sets, *format_assignments(sets)))
        return require_units(require_files(scene), sets)

    def tables(self) -> tables.Tables:
        """All tables of the scene as one record; a missing table is None."""
        names = tables.Tables.model_fields
        return tables.Tables.model_construct(**{name: getattr(self, name) for name in names})

    def resolved(self, folder: Path | None = None) -> str:
        """Return the scene as TOML in SI with all defaults; loading it gives the same values.

        The names of files are relative to `folder`, or to the folder of the scene without it.
        """
        if folder is None:
            return format_toml(self.tables())
        start = os.path.realpath(folder)

        def rename(name: str) -> str:
            """Return the name of a file relative to the new folder; absolute names are kept."""
            if Path(name).is_absolute():
                return name
            return name_file(self.resolve_path(name), start)

        return format_toml(rename_files(self.tables(), rename))

    def effect_names(self) -> list[str]:
        """Return the names of the physical effects that the scene contains."""
        return [*list_named_effects(self), "sweep"] if self.sweep else list_named_effects(self)

    def where(self, key: str) -> str:
        """Return ``FILE:LINE: key`` for a message about a key."""
        return locate_key(self.path, self.text, key)

    def resolve_path(self, name: str) -> Path:
        """Return the path of a file whose name in the scene is relative to the folder of the scene."""
        return self.path.parent / name


def load(
    path: str | Path,
    sets: Iterable[str] = (),
    faults: Callable | None = None,
    prepare: Callable | None = None,
) -> Scene:
    """Read a scene file.

    Parameters
    ----------
    path : str or Path
        File to read.
    sets : iterable of str
        ``table.key=value`` as of --set, applied in their order.
    faults : Callable, optional
        faults(tables, folder, is_valid) returns (key, message) of further mistakes, such as those inside the files that
        the scene names. `tables` are as far as they could be read; `is_valid` is True if they have no mistake.
    prepare : Callable, optional
        prepare(raw) changes the plain values before they are read.

    Raises
    ------
    SceneError
        With all mistakes at once. A file that the scene names and that does not exist is a mistake.
    """
    folder = Path(path).parent

    def find_file_faults(read: tables.Tables, is_valid: bool) -> Iterable[tuple[str, str]]:
        """Return (key, message) of the files that do not exist or, if these are looked at, have faults.

        `read` are the tables, and `is_valid` tells whether they are free of mistakes.
        """
        return [
            *list_absent_files(read, folder),
            *(faults(read, folder, is_valid) if faults else ()),
        ]

    return loads(read_text(path), path, sets, find_file_faults, prepare)


def loads(
    text: str,
    path: str | Path = "scene.toml",
    sets: Iterable[str] = (),
    faults: Callable | None = None,
    prepare: Callable | None = None,
) -> Scene:
    """Read a scene from its text.

    Parameters
    ----------
    text : str
        Content of a scene file.
    path : str or Path
        File that messages name, and to whose folder the paths in the scene are relative.
    sets : iterable of str
        ``table.key=value`` as of --set. A key among them is no longer an axis of [sweep].
    faults : Callable, optional
        faults(tables, is_valid) returns (key, message) of further mistakes.
    prepare : Callable, optional
        prepare(raw) changes the plain values of the text and of the sets before they are read.

    Raises
    ------
    SceneError
        With all mistakes at once.
    """
    return attach_written(_read_scene(text, path, sets, faults, prepare), prepare)


def _read_scene(
    text: str,
    path: str | Path,
    sets: Iterable[str],
    faults: Callable | None = None,
    prepare: Callable | None = None,
) -> Scene:
    """Read a scene from its text, with the parameters of `loads`, but without the scene as written."""
    raw = parse_text(text, path)
    sets = tuple(sets)
    draft = SceneDraft(str(path), text, raw)
    swept = []
    if "sweep" in raw:
        fixed = {split_assignment(assignment)[0] for assignment in sets}
        swept = [axis for axis in _read_axes(draft, raw.pop("sweep")) if axis.key not in fixed]
    # A key that only [sweep] holds gets its first value.
    for axis in swept:
        if find_scene_value(raw, axis.key)[1] is None:
            draft.swept_key = f"sweep.{axis.key}"
            apply_set(draft, f"{axis.key}={axis.texts[0]}")
    draft.swept_key = ""
    for assignment in sets:
        apply_set(draft, assignment)
    if prepare is not None:
        prepare(draft.raw)
    scene = finish_scene(draft, path, text, sets, faults)
    return replace(scene, sweep=tuple(swept)) if swept else scene


def finish_scene(
    draft: SceneDraft,
    path: str | Path,
    text: str,
    sets: tuple[str, ...],
    faults: Callable | None = None,
) -> Scene:
    """Read the tables of a draft, check them with all rules, fill in defaults, and return the Scene.

    Parameters
    ----------
    draft : SceneDraft
        Plain values of the file; the tables read from them are added here.
    path, text, sets, faults
        File, its content, assignments of --set, and function of the tables that returns further mistakes.

    Raises
    ------
    SceneError
        With all mistakes at once.
    """
    # First the values of each key, then rules on tables, then combinations that no engine computes yet. Each adds its
    # mistakes to the draft, so that the user sees all of them.
    read_tables(draft)
    kind = check_scene(draft)
    is_valid = not draft.has_mistakes
    check_combinations(draft, kind)

    # Defaults can be filled in only if no value is missing, and files be compared only with valid tables.
    completed = complete_tables(draft.tables, kind) if is_valid else None
    for key, message in faults(draft.tables, not draft.has_mistakes) if faults else ():
        draft.add_mistake(key, message)
    draft.raise_mistakes()
    return Scene(
        path=path if isinstance(path, Path) else Path(path),
        text=text,
        kind=kind,
        remarks=draft.remarks,
        sets=sets,
        notes=tuple(describe_mode_defaults(draft.tables)),
        **{name: getattr(completed, name) for name in tables.Tables.model_fields},
    )


def add_sets(scene: Scene, sets: Iterable[str]) -> Scene:
    """Return a copy of a scene with further assignments `table.key=value`, `sets`."""
    return loads(scene.text, scene.path, [*scene.sets, *sets])


def attach_written(
    scene: Scene, prepare: Callable | None = None, known: Scene | None = None
) -> Scene:
    """Return a scene with the scene of its file, whose joint is subtracted from modes that were measured with it.

    So all changes of a scene leave its structure alone. A scene without changes is returned unchanged.

    Parameters
    ----------
    scene : Scene
        Checked scene.
    prepare : Callable, optional
        prepare(raw) changes the plain values of the file before they are read.
    known : Scene, optional
        Scene of the file, if it was read before.

    Raises
    ------
    SceneError
        If the scene of the file is not valid, but its joint is needed.
    """
    structure = scene.structure
    if not scene.sets or structure is None or structure.measured == "free":
        return scene
    if structure.measured_joint == "case":
        return scene
    try:
        written = known or require_files(loads(scene.text, scene.path, prepare=prepare))
    except SceneError as error:
        if structure.measured_stiffness is not None:
            return scene
        raise SceneError(
            [
                f"{scene.where('structure.measured')}: the joint that was bolted in the modal test is that of the scene "
                f"as written, without --set, --over and --free, but that scene has a mistake: {error.mistakes[0]}; mend "
                "it, or give structure.measured_stiffness"
            ]
        ) from None
    return replace(scene, written=replace(written, sweep=()) if written.sweep else written)


def read_sweep_axes(text: str, path: str | Path) -> tuple[list[assignments.Axis], list[str]]:
    """Return the axes of the table [sweep] in a text, and one line for each mistake in it.

    An axis is a key with its values. `path` names the file in the lines.
    """
    raw = parse_text(text, path)
    draft = SceneDraft(str(path), text, raw)
    swept = _read_axes(draft, raw["sweep"]) if "sweep" in raw else []
    return swept, draft.mistake_lines()


def _read_axes(draft: SceneDraft, table: TomlValue) -> list[assignments.Axis]:
    """Return the axes of a table [sweep]; mistakes are added to the draft."""
    swept, mistakes = assignments.read_table(table)
    for key, message in mistakes:
        draft.add_mistake(key, message)
    return swept
