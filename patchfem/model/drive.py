"""The drive of a scene as a drive of the engines: signal, length of a cycle, length of the run, sizes for defaults."""

from functools import lru_cache

from ..core import ModalBasis, PatchfemError
from ..effects import module_of, waveform_of
from ..inputs import signals
from ..structure import drives
from ..structure.drive_sizes import DriveKeys, first_period, level_cycles


def drive_of(scene, modes: ModalBasis):
    """The drive of [drive]; a displacement amplitude X of the base gives the acceleration X omega^2, a force F over the
    modal mass F/m. `modes` gives the cycle of what has no frequency of its own."""
    drive = scene.drive
    if drive.kind == "free":
        return drives.release(first_period(modes))
    asked = DriveKeys(drive, modes.mass, first_period(modes), lambda: recorded(scene))
    return module_of(f"drive.waveform={drive.waveform}").BUILDERS[drive.waveform](asked)


def levelled(asked) -> bool:
    """Whether the drive is raised in levels."""
    return waveform_of(asked).has_levels


def cycles_per_level(asked) -> float:
    """Drive cycles of each level."""
    return level_cycles(asked)


def cycles_of(asked, drive) -> float:
    """Length of the run in cycles of the drive that [drive] asks for; of levels, all of them."""
    if levelled(asked):
        return cycles_per_level(asked) * len(asked.levels)
    if asked.cycles is not None:
        return asked.cycles
    return max((drive.duration if asked.duration is None else asked.duration) / drive.period, 0.25)


def recorded(scene) -> tuple:
    """(time (k,) [s], value (k,)) of drive.file: acceleration [m s-2] of the base, or force [N]; from 0 s on.

    PatchfemError with file and line of the scene where the file has none.
    """
    try:
        path = scene.beside(scene.drive.file)
        is_spectrum = waveform_of(scene.drive).is_random
        return signals.read_spectrum(path) if is_spectrum else record(path, scene.drive.kind)
    except PatchfemError as error:
        raise type(error)(f"{scene.where('drive.file')}: {error}") from None


def record(path, kind: str) -> tuple:
    """(time (k,) [s], value (k,)) of a recorded drive of a kind, read once."""
    name = "acceleration" if kind == "base" else "force"
    return _read(path, name, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=4)
def _read(path, name: str, _changed: int) -> tuple:
    return signals.read_signal(path, name)
