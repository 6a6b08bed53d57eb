"""The files that a scene names."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from .keys.choices import find_choices, iterate_tables
from .keys.tables import Tables
from .keys.types import Table, list_keys
from .rules.scene_draft import SceneDraft


def list_named_files(tables: Any) -> list[tuple[str, str]]:
    """Return (dotted key, file) for every file that a scene, or its tables, names.

    Keys that have no effect, such as those of another law of the asperities, are left out.
    """
    if not isinstance(tables, Tables):
        tables = tables.tables()
    named = []
    for table_key, table in iterate_tables(tables):
        keys = [key for key in list_keys(type(table)).values() if key.names_file]
        unused = find_choices(table).unused if keys else ()
        for key in keys:
            value = getattr(table, key.attribute)
            # The damping of a reduced structure may also be a ratio.
            if isinstance(value, str) and key.name not in unused:
                named.append((f"{table_key}.{key.name}", value))
    return named


def file_exists(path: Path) -> bool:
    """Return whether a path is that of an existing file; it is not if the operating system does not accept the path."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def list_absent_files(tables: Any, folder: Path) -> list[tuple[str, str]]:
    """List the files that a scene names and that do not exist, as (dotted key, message).

    `tables` are those of the scene, and `folder` is the folder to which its paths are relative.
    """
    return [
        (key, f"there is no file {folder / file}; paths are relative to the scene")
        for key, file in list_named_files(tables)
        if not file_exists(folder / file)
    ]


def require_files(scene: Any) -> Any:
    """Require that the files exist that a scene names, and return the scene.

    SceneError names the files that do not exist.
    """
    absent = list_absent_files(scene, scene.path.parent)
    if absent:
        draft = SceneDraft(str(scene.path), scene.text, {})
        draft.sets = {key for key, _ in absent if key not in draft.lines}
        for key, message in absent:
            draft.add_mistake(key, message)
        draft.raise_mistakes()
    return scene


def rename_files(table: Table, rename: Callable[[str], str]) -> Table:
    """Return a copy of a table in which the names of files, also those in the tables inside it, are changed by `rename`."""
    changes = {}
    for key in list_keys(type(table)).values():
        value = getattr(table, key.attribute)
        if isinstance(value, Table):
            changes[key.attribute] = rename_files(value, rename)
        elif isinstance(value, tuple) and key.inner is not None:
            changes[key.attribute] = tuple(rename_files(item, rename) for item in value)
        elif isinstance(value, str) and key.names_file:
            changes[key.attribute] = rename(value)
    return table.model_copy(update=changes)
