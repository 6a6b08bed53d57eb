"""Modes of structure.file; an unchanged file is read, and its modes are built, only once."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import ModalBasis, PatchfemError
from ..scene.files import UNIVERSAL_EXTENSIONS
from ..scene.rules.structure import LOCATION_KEYS
from ..structure import arrays, places, universal
from ..structure.modes import PATCH_MOTIONS
from .file_cache import cache_by_file
from .source import name_key


class FileModes(NamedTuple):
    """Modes from a file, with sentences for the user on what was neglected or changed."""

    modes: ModalBasis
    notes: list[str]


def read_scene_modes(scene) -> FileModes:
    """Read the modes from structure.file of a scene.

    An error has the key at fault.
    """
    path = scene.resolve_path(scene.structure.file)
    return read_modes(path, scene.structure, scene.drive, needs_interface=scene.kind == "rig")


def read_modes(path: Path, structure, drive, *, needs_interface: bool) -> FileModes:
    """Read the modes from a file.

    Parameters
    ----------
    path : Path
        Universal file, or file of matrices.
    structure, drive
        Tables [structure] and [drive] of the scene.
    needs_interface : bool
        Whether the modes must say where the rig slides.

    Returns
    -------
    FileModes

    Raises
    ------
    PatchfemError
        If the file cannot be used; its `key` is the key at fault.
    """
    mass = None if drive.kind == "base" else drive.mass
    with name_key("structure.file"):
        return _build_modes(path, structure, drive.kind, mass, needs_interface)


@cache_by_file
def read_content(path: Path):
    """Read the file `path` but build no modes: return arrays by name, or the shapes of a universal file."""
    with name_key("structure.file"):
        return universal.read_universal(path) if is_universal(path) else arrays.read_arrays(path)


def is_universal(path: Path) -> bool:
    """Return whether a path has the extension of a universal file."""
    return path.suffix.lower() in UNIVERSAL_EXTENSIONS


@cache_by_file
def _build_modes(
    path: Path, structure, drive_kind: str, mass: int | None, needs_interface: bool
) -> FileModes:
    """Build the modes of a structure from the content of a file.

    Parameters
    ----------
    path : Path
        Universal file, or file of matrices.
    structure
        Table [structure] of the scene.
    drive_kind : str
        "force", or another kind of the drive.
    mass : int or None
        Number of the mass that a force drives.
    needs_interface : bool
        Whether the modes must have an interface that slides.

    Returns
    -------
    FileModes
        Modal basis, and sentences on what was neglected or changed.
    """
    content = read_content(path)
    is_forced = drive_kind == "force"
    if is_universal(path):
        if mass is not None:
            raise PatchfemError(
                "a universal file has no numbered masses; use structure.force_at or output_at",
                "drive.mass",
            )
        place_texts = {key: getattr(structure, key) for key in LOCATION_KEYS}
        modes = places.build_basis(content, structure.moving_mass, place_texts, is_forced=is_forced)
        return FileModes(
            modes, [*content.notes, *([] if is_forced else places.note_missing_mass(modes))]
        )

    # Matrices of a file name no place; an error names the file.
    pairs = [interface.between for interface in structure.interface]
    try:
        modes = arrays.build_basis(content, pairs, mass if is_forced else None, is_forced=is_forced)
        if needs_interface:
            _require_slides(modes, content)
    except PatchfemError as error:
        raise PatchfemError(f"{path}: {error}", error.key) from None
    return FileModes(modes, [])


def _require_slides(modes: ModalBasis, content: dict[str, np.ndarray]) -> None:
    """Raise PatchfemError unless every interface slides in some of the modes.

    The `content` of the file must also move the patch along x alone: arrays such as `pitch` must be absent or 0.
    """
    if not len(modes.interfaces):
        raise PatchfemError(
            "lacks `slide`, the motion at the patch; add `slide` to the file, or write "
            "[[structure.interface]]"
        )
    if not modes.interfaces.any(axis=1).all():
        raise PatchfemError(
            "`slide` of an interface is 0 in every mode, so nothing slides there; give the motion at the patch"
        )
    for key in PATCH_MOTIONS:
        if np.any(content.get(key, 0)):
            raise PatchfemError(
                f"contains `{key}`, but the modes of such a file move the patch along x alone; list the modes in "
                f"[[structure.mode]], which has the key {key}, or leave this array out"
            )
