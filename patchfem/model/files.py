"""Check of the files that a scene names.

Each file is read as a run reads it, so that a run does not refuse a file that passes here. Nothing is
computed. The module that reads a kind of file is imported only if a scene names such a file, because
the imports are half of the time of a check.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from .. import inputs
from ..effects import find_waveform
from ..exceptions import PatchfemError
from ..mesh import files
from ..scene.files import file_exists, list_named_files
from ..scene.keys.tables import Tables
from ..scene.rules.structure import MATRIX_KEYS
from . import (
    face,
    gap,
    patch,
    peaks,
    pieces,
    profile,
    rig,
    slide,
    structure_files,
    wear,
)


class Fault(NamedTuple):
    """Key of a scene, or None, and the message on the fault of its value."""

    key: str | None
    message: str


def find_file_faults(
    tables, folder: Path, is_valid: bool = True, notes: list[str] | None = None
) -> list[Fault]:
    """Check the files that a scene names, and return the faults found in them.

    Parameters
    ----------
    tables : Tables
        Tables of the scene, as far as they could be read.
    folder : Path
        Folder of the scene; files that do not exist are left out.
    is_valid : bool
        Whether the tables are free of mistakes, so that a file may be compared with them. A value
        at fault is None, and then the files are only read.
    notes : list, optional
        Is extended by what a run would tell of files without a fault, one sentence each.

    Returns
    -------
    list of Fault
    """
    faults = []
    for key, file in list_named_files(tables):
        path = folder / file
        if not file_exists(path):
            continue
        checked = _select_interface(key, tables)
        try:
            sentences = FILE_CHECKS[checked.key](path, checked.tables, is_valid=is_valid) or ()
        except PatchfemError as error:
            fault_key = checked.prefix + (error.key or checked.key)
            faults.append(Fault(fault_key, str(error).removeprefix(f"{checked.key}: ")))
            continue
        if notes is not None:
            notes += [sentence.replace(str(path), path.name) for sentence in sentences]
    if faults or not is_valid:
        return faults
    return _check_reduction(tables, folder)


class _FileKey(NamedTuple):
    """Scene key that names a file, with the tables that are needed to check the file.

    - prefix: prefix of the keys of an interface, "" for any other file.
    - key: key of the file; for the patch of an interface, its key in [contact].
    - tables: tables of the scene; for the patch of an interface, with its [contact].
    """

    prefix: str
    key: str
    tables: Tables


def _select_interface(key: str, tables) -> _FileKey:
    """Return the key of a file and the tables used to check it: those of its own interface, if it has one."""
    prefix, separator, name = key.partition(".contact.")
    if not separator:
        return _FileKey("", key, tables)
    interface = tables.structure.interface[int(prefix.rpartition(".")[2])]
    own_tables = tables.model_copy(update={"contact": interface.contact})
    return _FileKey(f"{prefix}.", f"contact.{name}", own_tables)


def _check_reduction(tables, folder: Path) -> list[Fault]:
    """Check that the matrices of [structure.reduced] fit together; they are not reduced.

    `tables` are those of the scene, and `folder` is its folder. There is nothing to check if a file does not exist.
    """
    table = tables.structure and tables.structure.reduced
    matrices = [file for key, file in list_named_files(tables) if "reduced" in key]
    if not table or not all(file_exists(folder / file) for file in matrices):
        return []
    try:
        structure_files.check_reduction(folder, table, is_base_driven=tables.drive.kind == "base")
    except PatchfemError as error:
        return [Fault(error.key, str(error))]
    return []


def _check_mesh(path: Path, tables, *, is_valid: bool) -> None:
    """Check a mesh file by reading it, and compare its sizes with those of the scene.

    `path` is the mesh file, and `tables` are those of the scene. They are compared only if `is_valid`, without mistakes.
    """
    if not is_valid:
        files.read_pieces(path)
        return
    _, unit = patch.find_mesh_file(tables.contact, Path)
    pair = files.read_pieces(path, unit)
    pieces.check_mesh_size(patch.build_pieces(tables.contact), pair.lower, pair.upper, unit)


def _check_profile(path: Path, tables, *, is_valid: bool) -> tuple[str, ...]:
    """Check that the trace in the file `path` covers the interface, and return notes about it.

    `tables` are those of the scene. Unless they are valid (`is_valid`), or if the scene has a mesh file, the trace is
    only read.
    """
    import numpy as np

    profile.read_trace(path)
    contact = tables.contact
    if not is_valid or contact.mesh is not None:
        return ()
    patch_pieces = patch.build_pieces(contact)
    even_cell = patch_pieces.length / gap.N_DEFAULT_CELLS
    n_cells = max(1, round(patch_pieces.length / (contact.element_size or even_cell)))
    x = np.linspace(-patch_pieces.length / 2, patch_pieces.length / 2, n_cells + 1)
    _, notes = profile.compute_profile_gap(
        path,
        x,
        patch.find_profile_lengths(contact, patch_pieces),
        even_cell,
        is_rough=contact.asperities is not None,
        is_material=contact.profile.heights == "surface",
    )
    return notes


def _check_scan(path: Path, tables, *, is_valid: bool) -> tuple[str, ...]:
    """Check the areal scan in the file `path`, and return notes about it.

    If the `tables` of the scene are valid (`is_valid`), it must also cover half of the face.
    """
    if not is_valid:
        face.read_scan(path)
        return ()
    contact = tables.contact
    return face.read_face(path, contact.profile.at, contact.length, contact.width).notes


def _check_drive(path: Path, tables, *, is_valid: bool) -> None:
    """Check the file `path` of a recorded drive signal, or of its spectrum, by reading it.

    A signal is read only if its kind of drive is known: `is_valid`, or a kind in the `tables` of the scene.
    """
    if find_waveform(tables.drive).is_random:
        inputs.signals.read_spectrum(path)
    elif is_valid or tables.drive.kind is not None:
        rig.read_drive_file(path, tables.drive.kind)


def _check_structure(path: Path, tables, *, is_valid: bool) -> None:
    """Check structure.file: compute modes from matrices, but only read a universal file.

    `path` is the file, and `tables` are those of the scene. Unless they are valid (`is_valid`), matrices are only read,
    too.
    """
    if structure_files.is_universal(path) or not is_valid:
        structure_files.read_content(path)
        return
    rubs = tables.friction is not None or bool(tables.structure.interface)
    structure_files.read_modes(path, tables.structure, tables.drive, needs_interface=rubs)


def _check_by_reading(read: Callable[[Path], object]) -> Callable[..., None]:
    """Return the function that checks a file by reading it, whatever the other tables of the scene contain.

    `read` is a function of the path.
    """

    def check_file(path: Path, tables, *, is_valid: bool) -> None:
        """Read the file.

        Parameters
        ----------
        path : Path
            File to check.
        tables, is_valid
            Tables of the scene, and whether they are free of mistakes. Both have no effect.
        """
        read(path)

    return check_file


def _check_wear_start(path: Path, tables, *, is_valid: bool) -> tuple[str]:
    """Check the result.nc file `path` of an earlier run, and return a note about its worn depth.

    If the `tables` of this scene are valid (`is_valid`), the pieces must be those of the earlier run.
    """
    if is_valid:
        return (wear.read_earlier_wear(path, tables).sentence,)
    return (wear.read_end_state(path).sentence,)


def _check_asperities(path: Path, tables, *, is_valid: bool) -> None:
    """Check that a rough surface can have the asperity peaks found from the trace in the file `path`.

    If the `tables` of the scene are valid (`is_valid`), only waves shorter than the cut-off of the scene count.
    """
    cutoff = None
    if is_valid:
        cutoff = patch.find_shortest_wavelength(
            tables.contact, patch.build_pieces(tables.contact).length
        )
    peaks.read_spectral_moments(path, cutoff)


# Function that checks a file, by the key that names it
FILE_CHECKS = {
    "contact.mesh": _check_mesh,
    "contact.asperities.from": _check_asperities,
    "contact.profile.file": _check_profile,
    "contact.profile.scan": _check_scan,
    "slide.file": _check_by_reading(lambda path: slide.read_path_file(path)),
    "drive.file": _check_drive,
    "structure.file": _check_structure,
    **{
        f"structure.reduced.{name}": _check_by_reading(
            lambda path, name=name: structure_files.read_matrix(path, name)
        )
        for name in MATRIX_KEYS
    },
    "measured.file": _check_by_reading(inputs.measured.read_table),
    "wear.start": _check_wear_start,
}
