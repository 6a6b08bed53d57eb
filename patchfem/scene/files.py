"""The files that a scene names."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .lines import find_key_lines
from .rules.scene_draft import SceneDraft
from .rules.structure import MATRIX_KEYS
from .rules.view import wrap_value


def list_named_files(tables: Any) -> list[tuple[str, str]]:
    """Return (dotted key, file) for every file that a scene, or its tables, names."""
    scene = {name: wrap_value(getattr(tables, name)) for name in _TABLES_WITH_FILES}
    structure = scene["structure"]
    faces = structure.interface or ()
    keys_and_files = [
        *_list_patch_files("contact", scene["contact"]),
        *(
            file
            for index, face in enumerate(faces)
            for file in _list_patch_files(f"structure.interface.{index}.contact", face.contact)
        ),
        ("slide.file", scene["slide"].file),
        ("drive.file", scene["drive"].file),
        ("structure.file", structure.file),
        # Damping may also be a ratio, which is not the name of a file.
        *(
            (f"structure.reduced.{key}", structure.reduced[key])
            for key in MATRIX_KEYS
            if structure.reduced
        ),
        ("measured.file", scene["measured"].file),
        ("wear.start", scene["wear"].start),
    ]
    return [(key, file) for key, file in keys_and_files if isinstance(file, str) and file]


_TABLES_WITH_FILES = ("contact", "slide", "structure", "drive", "measured", "wear")


def _list_patch_files(table_key: str, contact: Any) -> list[tuple[str, Any]]:
    """List the file keys in the table of a patch, each with its file or UNKNOWN_VALUE."""
    asperities = contact.asperities
    return [
        (f"{table_key}.mesh", contact.mesh),
        (f"{table_key}.profile.file", contact.profile.file),
        (f"{table_key}.asperities.from", asperities.law == "hertz" and asperities.from_),
    ]


def file_exists(path: Path) -> bool:
    """Return whether a text is the path of an existing file."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def list_absent_files(tables: Any, folder: Path) -> list[tuple[str, str]]:
    """List the files that a scene names and that do not exist, with a message for each."""
    return [
        (key, f"there is no file {folder / file}; paths are relative to the scene")
        for key, file in list_named_files(tables)
        if not file_exists(folder / file)
    ]


def require_files(scene: Any) -> Any:
    """Return the scene itself; raise an error if a file that it names does not exist."""
    absent = list_absent_files(scene, scene.path.parent)
    if absent:
        draft = SceneDraft(str(scene.path), find_key_lines(scene.text), {})
        draft.sets = {key for key, _ in absent if key not in draft.lines}
        for key, message in absent:
            draft.add_mistake(key, message)
        draft.raise_mistakes()
    return scene


def make_relative_file_sets(scene: Any, folder: Path) -> list[str]:
    """Return assignments that make the file paths of a scene relative to another folder."""
    return [
        f"{key}={Path(os.path.relpath(scene.resolve_path(file), folder)).as_posix()}"
        for key, file in list_named_files(scene)
    ]
