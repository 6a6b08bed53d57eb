"""[structure.reduced] of a scene as modal bases: of the modes that it keeps, and of more of them for the error."""

import re
from functools import lru_cache

import numpy as np

from ..core import ModalBasis, PatchfemError
from ..formatting import plain
from ..inputs import matrices
from ..structure import masses, reduced
from ..structure.places import AXES

TOLD = 1e-5  # of a frequency, an uncertainty that is told
FILES = ("stiffness", "mass", "damping")
_PLACE, _RANGE = re.compile(r"(\d+)(?::(r?[xyz]))?"), re.compile(r"(\d+)\.\.(\d+)(?::(\d+))?")


def found(scene) -> tuple:
    """(ModalBasis, the same with more modes or None where none is left out, notes, how many modes there are at most) of
    the structure of a scene.

    PatchfemError with the line of the key at fault.
    """
    table, structure, drive = scene.structure.reduced, scene.structure, scene.drive
    try:
        files = {
            key: scene.beside(name) for key in FILES if isinstance(name := getattr(table, key), str)
        }
        made, notes = _reduction(
            tuple((key, path, *_stamp(path, key)) for key, path in files.items()),
            table.boundary,
            table.modes,
            table.method,
            table.moved,
            table.unit,
            drive.kind == "base",
        )
        pairs, laterals = pairs_of(structure)
        pushed = None if drive.kind == "base" else drive.mass or structure.output_mass or 1
        ratio = 0.0 if table.damping is None or isinstance(table.damping, str) else table.damping
        names = [str(one) for one in table.boundary]
        basis, more = (
            masses.set_lateral_faces(
                reduced.basis(made, count, pairs, structure.output_mass or 1, pushed, ratio, names),
                laterals,
            )
            for count in (table.modes, made.omega.size)
        )
    except PatchfemError as error:
        raise type(error)(f"{scene.where(error.key or 'structure.reduced')}: {error}") from None
    most = made.omega.size if made.whole else made.lowest.size - len(made.boundary)
    return (
        basis,
        None if made.whole and table.modes >= made.omega.size else more,
        [*notes, _kept(made, basis, table)],
        most,
    )


def pairs_of(structure) -> tuple:
    """(pairs of coordinates that slide, the second directions behind the first; second pair of each interface, None of
    one without) of [structure]."""
    laterals, pairs = (
        [one.lateral for one in structure.interface],
        [one.between for one in structure.interface],
    )
    if not pairs and structure.reduced is not None and structure.reduced.slide is not None:
        pairs = [structure.reduced.slide]
    return pairs + [pair for pair in laterals if pair is not None], laterals


def _kept(made, basis: ModalBasis, table) -> str:
    """What is left of a structure, by which wrong units show."""
    count = min(table.modes, made.omega.size)
    kind = "fixed-interface" if table.method == reduced.CRAIG_BAMPTON else "free-interface"
    upto = f" up to {made.omega[count - 1] / (2 * np.pi):.4g} Hz" if count else ""
    moving = np.flatnonzero(basis.omega > 0)
    first = (
        (
            f"; the first frequency of the reduced structure is {basis.omega[moving[0]] / (2 * np.pi):.5g} "
            "Hz"
        )
        if moving.size
        else ""
    )
    return (
        f"structure.reduced keeps {len(made.boundary)} boundary coordinate{'s' * (len(made.boundary) > 1)} and "
        f"{count} {kind} modes{upto}{first}"
    )


def _stamp(path, key: str) -> tuple:
    try:
        stamp = path.stat()
    except OSError as error:
        raise PatchfemError(
            f"{path} cannot be read ({error.strerror})", f"structure.reduced.{key}"
        ) from None
    return stamp.st_mtime_ns, stamp.st_size


@lru_cache(maxsize=4)
def _file(key: str, path, changed: int, size: int) -> matrices.Matrix:
    try:
        return matrices.read(path, key)
    except PatchfemError as error:
        raise PatchfemError(str(error), f"structure.reduced.{key}") from None


@lru_cache(maxsize=4)
def _reduction(
    files: tuple,
    boundary: tuple,
    modes: int,
    method: str,
    moved: tuple | None,
    unit: float,
    driven: bool,
) -> tuple:
    """(Reduction, notes) of files (key, path, time, size)."""
    every = [_file(*one) for one in files]
    rows, moving, notes = _placed(every, boundary, moved, driven)
    found = dict(
        zip((key for key, *_ in files), (one.values / unit for one in matrices.align_rows(*every)))
    )
    made = reduced.reduce_matrices(
        found["stiffness"], found["mass"], found.get("damping"), rows, modes, method, moving
    )
    return made, [*notes, *_rounded(files, every, found["stiffness"], unit, made.lowest)]


def _rounded(files: tuple, every: list, stiffness, unit: float, shape) -> list:
    """A sentence for each of stiffness and mass whose digits leave the lowest frequency uncertain."""
    out, square = [], shape @ (stiffness @ shape)
    for (key, path, *_), one, scale in zip(files, matrices.align_rows(*every), (square, 1.0)):
        told = matrices.estimate_rounding(one.values)
        if told is None or not square:
            continue
        # two deviations, of half a square
        share = matrices.quadratic_form_deviation(one.values, told[1], shape) / unit / scale
        if share > TOLD:
            out.append(
                f"{path.name} stores the {key} in {told[0]}, which leaves the lowest frequency of the structure "
                f"uncertain by {plain(100 * share, 2)} %; write the file in double precision"
            )
    return out


def checked(folder, table, driven: bool) -> None:
    """PatchfemError with its key for files in a folder, boundary or moved coordinates that cannot be used; nothing is
    reduced."""
    every = [
        _file(key, folder / name, *_stamp(folder / name, key))
        for key in FILES
        if isinstance(name := getattr(table, key), str)
    ]
    _placed(every, table.boundary, table.moved, driven)


def read(path, key: str) -> None:
    """PatchfemError where a matrix cannot be read."""
    _file(key, path, *_stamp(path, key))


def _placed(every: list, boundary: tuple, moved: tuple | None, driven: bool) -> tuple:
    """(rows of the boundary, motion (n,) with the base or None, notes) in matrices that fit together."""
    try:
        one = matrices.align_rows(*every)[0]
    except PatchfemError as error:
        raise PatchfemError(str(error), "structure.reduced.mass") from None
    if len(every) > 1 and not abs(every[0].values - every[1].values).nnz:
        raise PatchfemError(
            "contains the same numbers as the stiffness; give the file of the mass",
            "structure.reduced.mass",
        )
    n = one.values.shape[0]
    rows = np.concatenate([_rows(each, one, n, "boundary") for each in boundary])
    if np.unique(rows).size < rows.size:
        raise PatchfemError("names a coordinate twice", "structure.reduced.boundary")
    if not driven:
        return rows, None, []
    moving, notes = np.zeros(n), []
    if moved is None and one.places is None:
        moving[:] = 1.0
        notes = (
            [
                f"all {n} coordinates of structure.reduced are taken to move with the base, because the files name no "
                "directions; give the coordinates along x in structure.reduced.moved"
            ]
            if n > rows.size
            else []
        )
    for each in ("x",) if moved is None and one.places is not None else moved or ():
        moving[_rows(each, one, n, "moved")] = 1.0
    return rows, moving, notes


def _rows(text, one: matrices.Matrix, n: int, key: str) -> np.ndarray:
    """Rows from 0 that a number from 1, a range of them, a node:direction or, of `moved`, a direction names."""
    where = f"structure.reduced.{key}"
    if not isinstance(text, str):
        if text > n:
            raise PatchfemError(
                f"there is no coordinate {text}: the matrices have {n}, numbered from 1", where
            )
        return np.array([text - 1])
    if key == "moved" and (found := _RANGE.fullmatch(text)):
        first, last, count = int(found[1]), int(found[2]), int(found[3] or 0)
        count = count or last - first + 1
        step = (last - first) / max(count - 1, 1)
        if not 1 <= first <= last <= n or step != int(step) or (step == 0 and count > 1):
            raise PatchfemError(
                f"'{text}' is not a range of rows from 1 to {n}; write 'a..b:n' for n rows from a to b",
                where,
            )
        return np.arange(first - 1, last, max(int(step), 1))
    if one.places is None:
        raise PatchfemError(
            f"'{text}' names a node, but the files name no nodes; give row numbers of the matrices, "
            "which start at 1",
            where,
        )
    if key == "moved" and text in AXES:
        return np.flatnonzero(one.places[:, 1] == AXES.index(text) + 1)
    found = _PLACE.fullmatch(text)
    if found is None:
        raise PatchfemError(
            f"'{text}' is not a node with a direction; write node:direction, such as \"1201:x\"",
            where,
        )
    place = int(found[1]), AXES.index(found[2]) + 1 if found[2] else 0
    rows = np.flatnonzero((one.places == place).all(axis=1))
    if not rows.size:
        own = one.places[one.places[:, 0] == place[0], 1]
        has = ", ".join(AXES[k - 1] if k else "no direction" for k in own)
        raise PatchfemError(
            f"the files have no {text}; "
            + (
                f"node {place[0]} has {has}"
                if own.size
                else f"their nodes are {one.places[0, 0]} to {one.places[-1, 0]}"
            ),
            where,
        )
    return rows
