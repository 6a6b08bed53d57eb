"""Faults of the files that a scene names, found by reading each of them; nothing is computed.

Each file is read as the run reads it, so that what passes here is not refused there. Of a large mesh
only the first bytes are looked at. What reads a file is imported where a scene names such a file: half of the time of a
check otherwise.
"""

from pathlib import Path

from ..effects import waveform_of
from ..exceptions import PatchfemError
from ..inputs import measured
from ..mesh import files
from ..scene.rules import limits
from ..scene.scene import files_of, is_there
from . import drive, patch, peaks, profile, slide, structure_files, structure_reduced, worn

WHOLE = 2 * 2**20  # bytes of a mesh that is read whole
STARTS = {
    ".msh": (b"$MeshFormat",),
    ".vtu": (b"<?xml", b"<VTKFile"),
    ".inp": (b"*",),
    ".unv": (b"-1", b"    -1"),
}


def faults(tables, folder: Path, whole: bool = True, notes: list | None = None) -> list:
    """(key, message) of each fault in the files that the tables of a scene name.

    whole: the tables have no mistake, so that a file may be held against them; else what is wrong in them is None, and
    a file is only read. Files that are not there are left out. notes: takes what a run would say of the files that are
    right, one sentence each.
    """
    found = []
    for key, file in files_of(tables):
        path, (at, own, beside) = folder / file, _of_interface(key, tables)
        if not is_there(path):
            continue
        try:
            said = READERS[own](path, beside, whole)
            if notes is not None:
                notes += [text.replace(str(path), path.name) for text in said or ()]
        except PatchfemError as error:
            found.append((at + (error.key or own), str(error).removeprefix(f"{own}: ")))
    return found if found or not whole else [*found, *_reduced(tables, folder)]


def _of_interface(key: str, tables) -> tuple:
    """(what stands before the key of a patch's file, its key below that, tables whose [contact] is that patch); as they
    are of a key of no interface."""
    at, found, own = key.partition(".contact.")
    if not found:
        return "", key, tables
    face = tables.structure.interface[int(at.rpartition(".")[2])]
    return f"{at}.", f"contact.{own}", tables.model_copy(update={"contact": face.contact})


def _reduced(tables, folder: Path) -> list:
    """Faults of the matrices of [structure.reduced] beside each other and of its coordinates; nothing is reduced."""
    table = tables.structure and tables.structure.reduced
    if not table or not all(
        is_there(folder / file) for key, file in files_of(tables) if "reduced" in key
    ):
        return []
    try:
        structure_reduced.checked(folder, table, tables.drive.kind == "base")
    except PatchfemError as error:
        return [(error.key, str(error))]
    return []


def _mesh(path: Path, tables, whole: bool) -> None:
    start = STARTS.get(path.suffix)
    if start is None or path.stat().st_size <= WHOLE:
        files.read_pieces(path)
        return
    with open(path, "rb") as file:
        if not file.read(4096).lstrip().startswith(start):
            raise PatchfemError(
                f"{path}: not a readable {path.suffix} file (the content does not start as in such a "
                "file)"
            )


def _profile(path: Path, tables, whole: bool) -> tuple:
    """A trace that covers the interface and is no finer than the patch can show; what is done to it."""
    import numpy as np

    profile.trace_of(path)
    contact = tables.contact
    if not whole or contact.mesh is not None:
        return ()
    pieces = patch.build_pieces(contact)
    size = contact.element_size or pieces.length / patch.DEFAULT_CELLS
    n_cells = max(1, round(pieces.length / size))
    x = np.linspace(-pieces.length / 2, pieces.length / 2, n_cells + 1)
    return profile.profile_gap(
        path,
        x,
        patch.profile_lengths(contact, pieces),
        contact.asperities is not None,
        contact.profile.heights == "surface",
    )[1]


def _slide(path: Path, tables, whole: bool) -> None:
    """A path that the law and the contact can follow, sideways too where it goes there."""
    across = len(slide.rows_of(path)) == 3
    if whole and across and (reason := limits.sideways(tables)):
        raise PatchfemError(reason)


def _drive(path: Path, tables, whole: bool) -> None:
    if waveform_of(tables.drive).is_random:
        drive.signals.read_spectrum(path)
    elif whole or tables.drive.kind is not None:
        drive.record(path, tables.drive.kind)


def _structure(path: Path, tables, whole: bool) -> None:
    """The arrays of the file as a basis; a universal file is only read, its responses are not fitted here."""
    if path.suffix.lower() in (".uff", ".unv") or not whole:
        structure_files.content(path)
        return
    rubs = tables.friction is not None or bool(tables.structure.interface)
    structure_files.built(path, tables.structure, tables.drive, rubs)


def _matrix(key: str):
    return lambda path, tables, whole: structure_reduced.read(path, key)


def _measured(path: Path, tables, whole: bool) -> None:
    measured.read_table(path)


def _worn(path: Path, tables, whole: bool) -> tuple:
    """The end of a run of the same pieces; what goes on from it."""
    found = worn.of_pieces(path, tables) if whole else worn.read(path)
    return (found.sentence,)


def _rough(path: Path, tables, whole: bool) -> None:
    """A trace whose peaks those of a surface can be."""
    cutoff = None
    if whole:
        cutoff = patch.shortest_wave(tables.contact, patch.build_pieces(tables.contact).length)
    peaks.of_trace(path, cutoff)


READERS = {
    "contact.mesh": _mesh,
    "contact.asperities.from": _rough,
    "contact.profile.file": _profile,
    "slide.file": _slide,
    "drive.file": _drive,
    "structure.file": _structure,
    **{f"structure.reduced.{key}": _matrix(key) for key in ("stiffness", "mass", "damping")},
    "measured.file": _measured,
    "wear.start": _worn,
}
