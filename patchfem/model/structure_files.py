"""Modes of structure.file and of [structure.reduced], with more modes for the error estimate of the latter.

An unchanged file is read, and its modes are built, only once.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core import ModalBasis, PatchfemError
from ..inputs import matrices
from ..scene.keys.tables import UNIVERSAL_EXTENSIONS
from ..scene.rules.structure import LOCATION_KEYS, MATRIX_KEYS
from ..structure import arrays, places, reduced, universal
from ..structure.modes import PATCH_MOTIONS
from ..structure.places import DIRECTION_NAMES
from .source import cache_by_file, name_key


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


class ReducedModes(NamedTuple):
    """Modes of a reduced structure.

    - modes: modes that the scene keeps.
    - other_modes: all modes that were computed, and half of those that the scene keeps (unless it
      keeps fewer than two); () if the scene keeps all.
    - notes: sentences for the user.
    - max_modes: largest number of modes that the scene can keep.
    """

    modes: ModalBasis
    other_modes: tuple[ModalBasis, ...]
    notes: list[str]
    max_modes: int


class _ReducedFiles(NamedTuple):
    """What the files of a reduced structure contain.

    - values: matrices by key.
    - boundary (b,): rows of the boundary coordinates.
    - moved (n,): motion of the coordinates for a unit motion of the base, or None if the base does not move.
    - notes: sentences on the files.
    """

    values: dict[str, Any]
    boundary: np.ndarray
    moved: np.ndarray | None
    notes: list[str]


def build_reduced_modes(scene) -> ReducedModes:
    """Reduce the structure of a scene to its boundary and its lowest modes.

    Returned are the modal basis, notes, the largest number of modes that can be kept, and the bases with more and with
    fewer modes, from which the run estimates its error. The key of a PatchfemError is the key at fault.
    """
    structure = scene.structure
    table = structure.reduced
    is_base_driven = scene.drive.kind == "base"
    output = structure.output_mass or 1
    with name_key("structure.reduced"):
        paths = _find_files(table, scene.resolve_path)
        # A damping ratio and the places that slide do not change the matrices.
        settings = table.model_copy(update={"damping": None, "slide": None})
        reduction, notes = _reduce(tuple(paths.values()), tuple(paths), settings, is_base_driven)
        pairs = list_slide_pairs(structure)
        driven_mass = None if is_base_driven else scene.drive.mass or output
        ratio = 0.0 if "damping" in paths else table.damping or 0.0
        names = [str(coordinate) for coordinate in table.boundary]

        # The modes that are left out show in runs with all computed modes and with half of those kept.
        n_computed = reduction.modes.omega.size
        counts = [table.modes]
        if not reduction.modes.is_complete or table.modes < n_computed:
            counts += [n_computed, table.modes // 2][: 1 + (table.modes > 1)]
        arguments = (pairs, output, driven_mass, ratio, names)
        modes, *other_modes = [reduced.build_basis(reduction, n, *arguments) for n in counts]
    max_modes = n_computed
    if not reduction.modes.is_complete:
        max_modes = reduction.n_coordinates - len(reduction.boundary)
    notes = [*notes, _describe_reduction(reduction, modes, table)]
    return ReducedModes(modes, tuple(other_modes), notes, max_modes)


def list_slide_pairs(structure) -> list[tuple[int, int]]:
    """List the pairs of coordinates of [structure], numbered from 1, between which interfaces slide.

    The number 0 stands for the base.
    """
    pairs = [interface.between for interface in structure.interface]
    if not pairs and structure.reduced is not None and structure.reduced.slide is not None:
        return [structure.reduced.slide]
    return pairs


def _describe_reduction(reduction, modes: ModalBasis, table) -> str:
    """Describe what a reduction keeps.

    The frequencies help the user notice wrong units. `modes` are the reduced modes, and `table` is [structure.reduced].
    """
    n_modes = min(table.modes, reduction.modes.omega.size)
    n_boundary = len(reduction.boundary)
    kind = "fixed-interface" if table.method == reduced.CRAIG_BAMPTON else "free-interface"
    text = (
        f"structure.reduced keeps {n_boundary} boundary coordinate{'s' * (n_boundary > 1)} and "
        f"{n_modes} {kind} modes"
    )
    if n_modes:
        text += f" up to {reduction.modes.omega[n_modes - 1] / (2 * np.pi):.4g} Hz"
    elastic = modes.omega[modes.omega > 0]
    if elastic.size:
        text += (
            f"; the first frequency of the reduced structure is {elastic[0] / (2 * np.pi):.5g} Hz"
        )
    return text


def _find_files(table, locate) -> dict[str, Path]:
    """Return the path of each matrix file of the table [structure.reduced] by its key.

    `locate` turns a name into a path.
    """
    names = {key: getattr(table, key) for key in MATRIX_KEYS}
    return {key: locate(name) for key, name in names.items() if isinstance(name, str)}


@cache_by_file
def read_matrix(path: Path, key: str) -> matrices.Matrix:
    """Read the matrix file `path`.

    The key of a PatchfemError is the key of the file. `key` is "stiffness", "mass" or "damping".
    """
    with name_key(f"structure.reduced.{key}"):
        return matrices.read_matrix(path, key)


@cache_by_file
def _reduce(paths: tuple[Path, ...], keys: tuple[str, ...], table, is_base_driven: bool):
    """Reduce the matrices in files, and return the `structure.reduced.Reduction` and notes.

    `_read_files` returns the matrices by key, the rows of the boundary and the motion of all coordinates with the base.
    `table.unit` is the length [m] of the unit in which the files are written.

    Parameters
    ----------
    paths : tuple of Path
        Files of the matrices.
    keys : tuple of str
        What each file contains: "stiffness", "mass" or "damping".
    table
        Table [structure.reduced] of the scene.
    is_base_driven : bool
        Whether the base drives the structure.
    """
    files = _read_files(dict(zip(keys, paths)), table, is_base_driven)
    values = {key: matrix / table.unit for key, matrix in files.values.items()}
    reduction = reduced.reduce_matrices(
        values["stiffness"],
        values["mass"],
        values.get("damping"),
        files.boundary,
        table.modes,
        table.method,
        files.moved,
    )
    return reduction, files.notes


def check_reduction(folder: Path, table, *, is_base_driven: bool) -> None:
    """Check matrices, boundary and moved coordinates, but reduce nothing.

    Parameters
    ----------
    folder : Path
        Folder of the scene.
    table : Reduced
        Table [structure.reduced].
    is_base_driven : bool
        Whether the base moves.

    Raises
    ------
    PatchfemError
        If they cannot be used.
    """
    _read_files(_find_files(table, folder.__truediv__), table, is_base_driven)


def _read_files(paths: dict[str, Path], table, is_base_driven: bool) -> _ReducedFiles:
    """Read the matrices, and find the rows of the boundary coordinates and of those that move with the base.

    Parameters
    ----------
    paths : dict of str to Path
        Files by what they contain: "stiffness", "mass" or "damping".
    table
        Table [structure.reduced] of the scene.
    is_base_driven : bool
        Whether the base drives the structure.

    Returns
    -------
    _ReducedFiles
        Matrices, rows of the boundary and motion with the base.
    """
    read = [read_matrix(path, key) for key, path in paths.items()]
    with name_key("structure.reduced.mass"):
        aligned = matrices.align_rows(*read)
        if len(read) > 1 and not abs(read[0].values - read[1].values).nnz:
            raise PatchfemError(
                "contains the same numbers as the stiffness; give the file of the mass"
            )
    values = {key: matrix.values for key, matrix in zip(paths, aligned)}
    places = aligned[0].places
    n = values["stiffness"].shape[0]

    # Rows of the boundary.
    with name_key("structure.reduced.boundary"):
        rows = np.concatenate([_find_rows(name, n, places) for name in table.boundary])
        if np.unique(rows).size < rows.size:
            raise PatchfemError("names a coordinate twice")
    if not is_base_driven:
        return _ReducedFiles(values, rows, None, [])

    # Rows of the boundary coordinates that the base moves along x.
    notes = []
    moved = table.moved
    if moved is None and places is not None:
        moved = ("x",)
    if moved is None:
        moved = (f"1..{n}",)
        if n > rows.size:
            notes.append(
                f"all {n} coordinates of structure.reduced are taken to move with the base, because the files name no "
                "directions; give the coordinates along x in structure.reduced.moved"
            )
    motion = np.zeros(n)
    with name_key("structure.reduced.moved"):
        for name in moved:
            motion[_find_moved_rows(name, n, places)] = 1.0
    return _ReducedFiles(values, rows, motion, notes)


def _find_moved_rows(name, n: int, places) -> np.ndarray:
    """Find the row indices (k,) from 0 of the coordinates that an entry of `moved` names.

    `name` is the name of a coordinate as for the boundary, a range of rows such as "1..30:10", or a direction such as
    "x". n is the number of rows, and `places` (n, 2) gives node and direction (1 to 6) of each, or is None if they are
    not known.
    """
    text = str(name)
    # Such as "a..b" or "a..b:n"
    row_range = re.fullmatch(r"(\d+)\.\.(\d+)(?::(\d+))?", text)
    if row_range is None:
        if places is not None and text in DIRECTION_NAMES:
            return np.flatnonzero(places[:, 1] == DIRECTION_NAMES.index(text) + 1)
        return _find_rows(name, n, places)

    # "a..b:n" stands for n evenly spaced rows, "a..b" for all of them.
    first, last, count = (int(number or 0) for number in row_range.groups())
    step, remainder = divmod(last - first, max((count or last - first + 1) - 1, 1))
    if not 1 <= first <= last <= n or remainder or (step == 0 and count > 1):
        raise PatchfemError(
            f"'{text}' is not a range of rows from 1 to {n}; write 'a..b:n' for n rows from a to b"
        )
    return np.arange(first - 1, last, max(step, 1))


def _find_rows(name, n: int, places) -> np.ndarray:
    """Find the row indices, counted from 0, of a coordinate that a scene names.

    Parameters
    ----------
    name : int or str
        A number from 1, or a node with a direction.
    n : int
        Number of rows.
    places : (n, 2) ndarray or None
        Node and direction of each row, if the files name them.

    Returns
    -------
    (k,) ndarray of int

    Raises
    ------
    PatchfemError
        If the matrix has no such coordinate.
    """
    if not isinstance(name, str):
        if name > n:
            raise PatchfemError(
                f"there is no coordinate {name}: the matrices have {n}, numbered from 1"
            )
        return np.array([name - 1])
    if places is None:
        raise PatchfemError(
            f"'{name}' names a node, but the files name no nodes; give row numbers of the matrices, "
            "which start at 1"
        )
    # Such as "1201:x" or "1201"
    match = re.fullmatch(r"(\d+)(?::(r?[xyz]))?", name)
    if match is None:
        raise PatchfemError(
            f"'{name}' is not a node with a direction; write node:direction, such as \"1201:x\""
        )
    place = (int(match[1]), DIRECTION_NAMES.index(match[2]) + 1 if match[2] else 0)
    rows = np.flatnonzero((places == place).all(axis=1))
    if rows.size:
        return rows

    # The message lists what the files have instead.
    directions = places[places[:, 0] == place[0], 1]
    advice = f"their nodes are {places[0, 0]} to {places[-1, 0]}"
    if directions.size:
        known = ", ".join(("no direction", *DIRECTION_NAMES)[direction] for direction in directions)
        advice = f"node {place[0]} has {known}"
    raise PatchfemError(f"the files have no {name}; {advice}")
