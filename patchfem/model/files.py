"""Check of the files that a scene names.

Each file is read as a run reads it, so that a run does not refuse a file that passes here. Nothing is
computed. The module that reads a kind of file is imported only if a scene names such a file, because
the imports are half of the time of a check.
"""

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
    layer_heights,
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
        # The kind of a drive tells how its file is read.
        compare = FILE_CHECKS.get(checked.key) if is_valid or key == "drive.file" else None
        sentences = None
        try:
            if compare is not None:
                sentences = compare(path, checked.tables)
            else:
                FILE_READERS[checked.key](path)
        except PatchfemError as error:
            fault_key = checked.prefix + (error.key or checked.key)
            faults.append(Fault(fault_key, str(error).removeprefix(f"{checked.key}: ")))
            continue
        if notes is not None:
            notes += [sentence.replace(str(path), path.name) for sentence in sentences or ()]
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


def _check_mesh(path: Path, tables) -> None:
    """Read a mesh file, and compare its sizes with those of the scene."""
    _, unit = patch.find_mesh_file(tables.contact, Path)
    pair = files.read_pieces(path, unit)
    pieces.check_mesh_size(patch.build_pieces(tables.contact), pair.lower, pair.upper, unit)


def _check_profile(path: Path, tables) -> tuple[str, ...]:
    """Check that the trace in the file `path` covers the interface, and return notes about it.

    `tables` are those of the scene. If the scene has a mesh file, the trace is only read.
    """
    import numpy as np

    profile.read_trace(path)
    contact = tables.contact
    if contact.mesh is not None:
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


def _check_scan(path: Path, tables) -> tuple[str, ...]:
    """Check that the areal scan in the file `path` covers half of the face of the scene, and return notes about it."""
    contact = tables.contact
    return face.read_face(path, contact.profile.at, contact.length, contact.width).notes


def _check_drive(path: Path, tables) -> None:
    """Read a recorded drive signal, or its spectrum."""
    if find_waveform(tables.drive).is_random:
        inputs.signals.read_spectrum(path)
    elif tables.drive.kind is not None:
        rig.read_drive_file(path, tables.drive.kind)


def _check_structure(path: Path, tables) -> None:
    """Compute modes from the matrices in the file `path`, but only read a universal file."""
    if structure_files.is_universal(path):
        structure_files.read_content(path)
        return
    rubs = tables.friction is not None or bool(tables.structure.interface)
    structure_files.read_modes(path, tables.structure, tables.drive, needs_interface=rubs)


def _check_wear_start(path: Path, tables) -> tuple[str]:
    """Check that the earlier run in the file `path` has the pieces of the scene; return a note on its worn depth."""
    return (wear.read_earlier_wear(path, tables).sentence,)


def _check_asperities(path: Path, tables) -> None:
    """Check that a rough surface can have the asperity peaks of the trace in the file `path`, below the cut-off."""
    length = patch.build_pieces(tables.contact).length
    peaks.read_spectral_moments(path, patch.find_shortest_wavelength(tables.contact, length))


def _check_layer_heights(path: Path, tables) -> None:
    """Check that the trace or the scan in the file `path` is longer than the cut-off of the layer of the scene."""
    layer_heights.read_heights(path, tables.contact.asperities.cutoff)


# Function that reads a file without using the other keys of the scene, by the key that names it. Modules are loaded on use.
FILE_READERS = {
    "contact.mesh": lambda path: files.read_pieces(path),
    "contact.asperities.from": lambda path: peaks.read_spectral_moments(path),
    "contact.asperities.heights": lambda path: layer_heights.read_heights(path),
    "contact.profile.file": lambda path: profile.read_trace(path),
    "contact.profile.scan": lambda path: face.read_scan(path),
    "slide.file": lambda path: slide.read_path_file(path),
    "structure.file": lambda path: structure_files.read_content(path),
    **{
        f"structure.reduced.{name}": lambda path, name=name: structure_files.read_matrix(path, name)
        for name in MATRIX_KEYS
    },
    "measured.file": lambda path: inputs.measured.read_table(path),
    "wear.start": lambda path: wear.read_end_state(path),
}
# Function that also compares a file with the tables of the scene, and returns notes
FILE_CHECKS = {
    "contact.mesh": _check_mesh,
    "contact.asperities.from": _check_asperities,
    "contact.asperities.heights": _check_layer_heights,
    "contact.profile.file": _check_profile,
    "contact.profile.scan": _check_scan,
    "drive.file": _check_drive,
    "structure.file": _check_structure,
    "wear.start": _check_wear_start,
}
