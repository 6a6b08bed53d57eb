"""Modes of [structure.reduced]: the modes that the scene keeps, and more for the error estimate."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core import ModalBasis, PatchfemError
from ..formatting import format_number
from ..inputs import matrices
from ..scene.rules.structure import MATRIX_KEYS
from ..structure import reduced
from ..structure.places import DIRECTION_NAMES
from .file_cache import cache_by_file
from .source import name_key

# Smallest relative uncertainty of a frequency that is reported.
MIN_REPORTED_UNCERTAINTY = 1e-5
NODE_PATTERN = re.compile(r"(\d+)(?::(r?[xyz]))?")  # pattern of "1201:x" or "1201"
RANGE_PATTERN = re.compile(r"(\d+)\.\.(\d+)(?::(\d+))?")  # pattern of "a..b" or "a..b:n"


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
    notes: list
    max_modes: int


class _Coordinates(NamedTuple):
    """Boundary rows (b,), motion (n,) for a unit motion of the base or None, and notes."""

    boundary: np.ndarray
    moved: np.ndarray | None
    notes: list


def build_reduced_modes(scene) -> ReducedModes:
    """Reduce the structure of a scene; the key of a PatchfemError is the key at fault."""
    structure = scene.structure
    table = structure.reduced
    is_base_driven = scene.drive.kind == "base"
    output = structure.output_mass or 1
    with name_key("structure.reduced"):
        files = _find_files(table, scene.resolve_path)
        reduction, notes = _reduce(
            tuple(files.values()),
            tuple(files),
            table.boundary,
            table.modes,
            table.method,
            table.moved,
            table.unit,
            is_base_driven,
        )
        pairs = list_slide_pairs(structure)
        driven_mass = None if is_base_driven else scene.drive.mass or output
        ratio = 0.0
        if table.damping is not None and not isinstance(table.damping, str):
            ratio = table.damping
        names = [str(coordinate) for coordinate in table.boundary]

        def build(count: int) -> ModalBasis:
            return reduced.build_basis(reduction, count, pairs, output, driven_mass, ratio, names)

        modes = build(table.modes)
        n_computed = reduction.modes.omega.size
        keeps_all = reduction.modes.is_complete and table.modes >= n_computed
        counts = [] if keeps_all else [n_computed, table.modes // 2][: 1 + (table.modes > 1)]
        other_modes = tuple(build(count) for count in counts)
    notes = [*notes, _describe_reduction(reduction, modes, table)]
    max_modes = n_computed
    if not reduction.modes.is_complete:
        max_modes = reduction.lowest.size - len(reduction.boundary)
    return ReducedModes(modes, other_modes, notes, max_modes)


def list_slide_pairs(structure) -> list[tuple[int, int]]:
    """List the pairs of coordinates between which the interfaces slide."""
    pairs = [interface.between for interface in structure.interface]
    if not pairs and structure.reduced is not None and structure.reduced.slide is not None:
        return [structure.reduced.slide]
    return pairs


def _describe_reduction(reduction, modes: ModalBasis, table) -> str:
    """Describe what the reduction keeps; the frequencies help the user notice wrong units."""
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
    """Return the path of each matrix of [structure.reduced] by its key; `locate` turns a name into a path."""
    names = {key: getattr(table, key) for key in MATRIX_KEYS}
    return {key: locate(name) for key, name in names.items() if isinstance(name, str)}


@cache_by_file
def read_matrix(path: Path, key: str) -> matrices.Matrix:
    """Read a matrix file; the key of a PatchfemError is the key of the file."""
    with name_key(f"structure.reduced.{key}"):
        return matrices.read_matrix(path, key)


@cache_by_file
def _reduce(
    paths: tuple,
    keys: tuple,
    boundary: tuple,
    modes: int,
    method: str,
    moved: tuple | None,
    unit: float,
    is_base_driven: bool,
) -> tuple:
    """Reduce the matrices in files; return the Reduction and notes."""
    matrix_list = list(map(read_matrix, paths, keys))
    coordinates = _locate_coordinates(matrix_list, boundary, moved, is_base_driven)
    aligned = matrices.align_rows(*matrix_list)
    values = {key: matrix.values / unit for key, matrix in zip(keys, aligned)}
    reduction = reduced.reduce_matrices(
        values["stiffness"],
        values["mass"],
        values.get("damping"),
        coordinates.boundary,
        modes,
        method,
        coordinates.moved,
    )
    names = [path.name for path in paths]
    rounding_notes = _note_rounding(names, aligned, values["stiffness"], unit, reduction.lowest)
    return reduction, [*coordinates.notes, *rounding_notes]


def _note_rounding(names: list, aligned: list, stiffness, unit: float, shape) -> list:
    """Return a note about each matrix whose rounded numbers make the lowest frequency uncertain.

    The uncertainty of the square of the frequency is two standard deviations of shape^T A shape, with
    the shape (n,) of the lowest mode of unit modal mass; that of the frequency is half as large.
    """
    notes = []
    square = shape @ (stiffness @ shape)
    for name, key, matrix, scale in zip(names, MATRIX_KEYS, aligned, (square, 1.0)):
        rounding = matrices.estimate_rounding(matrix.values)
        if rounding is None or not square:
            continue
        deviation = matrices.compute_form_deviation(matrix.values, rounding.deviation, shape)
        uncertainty = deviation / unit / scale
        if uncertainty > MIN_REPORTED_UNCERTAINTY:
            notes.append(
                f"{name} stores the {key} in {rounding.digits}, which leaves the lowest "
                f"frequency of the structure uncertain by {format_number(100 * uncertainty, 2)} %; write the "
                "file in double precision"
            )
    return notes


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
    files = _find_files(table, folder.__truediv__)
    matrix_list = [read_matrix(path, key) for key, path in files.items()]
    _locate_coordinates(matrix_list, table.boundary, table.moved, is_base_driven)


def _locate_coordinates(
    matrix_list: list, boundary: tuple, moved: tuple | None, is_base_driven: bool
) -> _Coordinates:
    """Find the rows of the boundary coordinates, and of those that move with the base."""
    with name_key("structure.reduced.mass"):
        stiffness = matrices.align_rows(*matrix_list)[0]
    if len(matrix_list) > 1 and not abs(matrix_list[0].values - matrix_list[1].values).nnz:
        raise PatchfemError(
            "contains the same numbers as the stiffness; give the file of the mass",
            "structure.reduced.mass",
        )
    n = stiffness.values.shape[0]
    rows = np.concatenate([_find_rows(name, stiffness, "boundary") for name in boundary])
    if np.unique(rows).size < rows.size:
        raise PatchfemError("names a coordinate twice", "structure.reduced.boundary")
    if not is_base_driven:
        return _Coordinates(rows, None, [])
    motion = np.zeros(n)
    notes = []
    if moved is None and stiffness.places is not None:
        moved = ("x",)
    if moved is None:
        motion[:] = 1.0
        if n > rows.size:
            notes.append(
                f"all {n} coordinates of structure.reduced are taken to move with the base, because the files name no "
                "directions; give the coordinates along x in structure.reduced.moved"
            )
    for name in moved or ():
        motion[_find_rows(name, stiffness, "moved")] = 1.0
    return _Coordinates(rows, motion, notes)


def _find_rows(name, matrix: matrices.Matrix, key: str) -> np.ndarray:
    """Find the row indices, counted from 0, of the coordinates that a scene names.

    Parameters
    ----------
    name : int or str
        A number from 1, a node with a direction or, for `moved`, a range of numbers or a direction.
    matrix : Matrix
    key : str
        Key of [structure.reduced], ``"boundary"`` or ``"moved"``.

    Returns
    -------
    (k,) ndarray of int

    Raises
    ------
    PatchfemError
        If the matrix has no such coordinate; its `key` is the key at fault.
    """
    full_key = f"structure.reduced.{key}"
    n = matrix.values.shape[0]
    if not isinstance(name, str):
        if name > n:
            raise PatchfemError(
                f"there is no coordinate {name}: the matrices have {n}, numbered from 1", full_key
            )
        return np.array([name - 1])
    row_range = RANGE_PATTERN.fullmatch(name)
    if key == "moved" and row_range:
        return _list_rows_in_range(row_range, n, full_key)
    if matrix.places is None:
        raise PatchfemError(
            f"'{name}' names a node, but the files name no nodes; give row numbers of the matrices, "
            "which start at 1",
            full_key,
        )
    if key == "moved" and name in DIRECTION_NAMES:
        return np.flatnonzero(matrix.places[:, 1] == DIRECTION_NAMES.index(name) + 1)
    match = NODE_PATTERN.fullmatch(name)
    if match is None:
        raise PatchfemError(
            f"'{name}' is not a node with a direction; write node:direction, such as \"1201:x\"",
            full_key,
        )
    node = int(match[1])
    direction = DIRECTION_NAMES.index(match[2]) + 1 if match[2] else 0
    rows = np.flatnonzero((matrix.places == (node, direction)).all(axis=1))
    if not rows.size:
        raise PatchfemError(f"the files have no {name}; {_list_directions(matrix, node)}", full_key)
    return rows


def _list_rows_in_range(row_range: re.Match, n: int, full_key: str) -> np.ndarray:
    """Return the row indices, counted from 0, for a range "a..b" or "a..b:n" of row numbers."""
    first = int(row_range[1])
    last = int(row_range[2])
    count = int(row_range[3] or 0) or last - first + 1
    step = (last - first) / max(count - 1, 1)
    if not 1 <= first <= last <= n or step != int(step) or (step == 0 and count > 1):
        raise PatchfemError(
            f"'{row_range[0]}' is not a range of rows from 1 to {n}; write 'a..b:n' for n rows from "
            "a to b",
            full_key,
        )
    return np.arange(first - 1, last, max(int(step), 1))


def _list_directions(matrix: matrices.Matrix, node: int) -> str:
    """List the directions of a node, or the nodes in the files if the node does not exist."""
    directions = matrix.places[matrix.places[:, 0] == node, 1]
    if not directions.size:
        return f"their nodes are {matrix.places[0, 0]} to {matrix.places[-1, 0]}"
    names = [
        DIRECTION_NAMES[direction - 1] if direction else "no direction" for direction in directions
    ]
    return f"node {node} has {', '.join(names)}"
