"""structure.file of a scene as a modal basis; a file that is fitted or read once is kept for the runs that follow."""

from functools import lru_cache

from ..core import PatchfemError
from ..structure import arrays, places, universal

PLACES = ("slide_at", "output_at", "base_at", "force_at", "normal_at", "pitch_at")


def found_in_file(scene) -> tuple:
    """(basis, sentences on what was read otherwise than it stands) of structure.file; PatchfemError with its line."""
    try:
        return built(
            scene.beside(scene.structure.file), scene.structure, scene.drive, scene.kind == "rig"
        )
    except PatchfemError as error:
        raise type(error)(f"{scene.where(error.key)}: {error}") from None


def built(path, structure, drive, rubs: bool) -> tuple:
    """(basis, notes) of a file and the tables [structure] and [drive]; rubs: an interface is needed. PatchfemError with
    the key at fault."""
    try:
        stamp = path.stat()
    except OSError as error:
        raise PatchfemError(f"{path} cannot be read ({error.strerror})", "structure.file") from None
    try:
        return _built(
            path,
            stamp.st_mtime_ns,
            stamp.st_size,
            structure,
            drive.kind,
            None if drive.kind == "base" else drive.mass,
            rubs,
        )
    except PatchfemError as error:
        head, _, rest = str(error).partition(": ")
        named = head.startswith(("structure.", "drive."))
        raise type(error)(
            rest if named else str(error), head if named else "structure.file"
        ) from None


def content(path):
    """Content of a file: arrays by name, or Shapes; PatchfemError with the key."""
    stamp = path.stat()
    try:
        return _read(path, stamp.st_mtime_ns, stamp.st_size)
    except PatchfemError as error:
        raise type(error)(str(error).removeprefix("structure.file: "), "structure.file") from None


@lru_cache(maxsize=8)
def _read(path, changed: int, size: int):
    """Content of a file of this age: arrays by name, or Shapes."""
    return (universal if path.suffix.lower() in (".uff", ".unv") else arrays).read(path)


@lru_cache(maxsize=8)
def _built(
    path, changed: int, size: int, structure, kind: str, mass: int | None, rubs: bool
) -> tuple:
    """(basis, notes) of a file of this age; rubs: an interface is needed."""
    data = _read(path, changed, size)
    if path.suffix.lower() in (".uff", ".unv"):
        return _measured(data, structure, kind, mass)
    return _arrays(data, structure, kind, mass, rubs)


def _arrays(data, structure, kind, mass, rubs) -> tuple:
    forced = kind == "force"
    pairs = [one.between for one in structure.interface]
    found = arrays.basis(data, pairs, mass if forced else None, forced, structure.moving_mass)
    if rubs and not len(found.interfaces):
        raise PatchfemError(
            "structure.file: lacks `slide`, the motion at the patch; add `slide` to the file, or write "
            "[[structure.interface]]"
        )
    return found, []


def _measured(shapes, structure, kind, mass) -> tuple:
    forced = kind == "force"
    if mass is not None:
        raise PatchfemError(
            "drive.mass: a universal file has no numbered masses; use structure.force_at or output_at"
        )
    found = places.basis(
        shapes, structure.moving_mass, {key: getattr(structure, key) for key in PLACES}, forced
    )
    return found, [*shapes.notes, *([] if forced else places.participation_note(found))]
