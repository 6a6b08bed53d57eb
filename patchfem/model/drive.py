"""The drive signal of a rig from [drive], and the length of the run in drive cycles."""

from pathlib import Path

from ..core import ModalBasis, PatchfemError
from ..effects import find_waveform, import_effect
from ..inputs import signals
from ..structure import drives
from ..structure.drive_sizes import DriveKeys, count_cycles_per_level, find_first_period
from .file_cache import cache_by_file

# Smallest number of drive cycles in a run whose length is given as a duration.
MIN_RUN_CYCLES = 0.25


def build_signal(scene, modes: ModalBasis):
    """Build the drive signal of a scene in the form that the solvers use.

    A displacement amplitude X of the base becomes the acceleration amplitude X omega^2, and a force F
    becomes F over the modal mass. A drive without a frequency of its own gets its cycle from the
    first elastic mode.
    """
    if scene.drive.kind == "free":
        return drives.make_release(find_first_period(modes))
    keys = DriveKeys(
        scene.drive, modes.mass, find_first_period(modes), lambda: _read_recorded_drive(scene)
    )
    waveform = scene.drive.waveform
    return import_effect(f"drive.waveform={waveform}").DRIVE_BUILDERS[waveform](keys)


def has_levels(keys) -> bool:
    """Return whether the amplitude of the drive signal is raised in levels."""
    return find_waveform(keys).has_levels


def count_run_cycles(keys, signal) -> float:
    """Return the length of a run in drive cycles, including all levels of a stepped amplitude.

    `keys` are those of [drive], `signal` is the drive that follows from them.
    """
    if has_levels(keys):
        return count_cycles_per_level(keys) * len(keys.levels)
    if keys.cycles is not None:
        return keys.cycles
    duration = signal.duration if keys.duration is None else keys.duration
    return max(duration / signal.period, MIN_RUN_CYCLES)


def _read_recorded_drive(scene) -> tuple:
    """Read the columns of the file drive.file; an error names the line of this key."""
    try:
        path = scene.resolve_path(scene.drive.file)
        if find_waveform(scene.drive).is_random:
            return signals.read_spectrum(path)
        return read_drive_file(path, scene.drive.kind)
    except PatchfemError as error:
        raise type(error)(f"{scene.where('drive.file')}: {error}") from None


@cache_by_file
def read_drive_file(path: Path, kind: str) -> tuple:
    """Read a recorded drive signal.

    Parameters
    ----------
    path : Path
    kind : str
        ``"base"`` for an acceleration of the base, else the file contains a force.

    Returns
    -------
    tuple of numpy.ndarray
        Time (k,) [s] from 0 on, and acceleration (k,) [m s-2] or force (k,) [N].
    """
    return signals.read_signal(path, "acceleration" if kind == "base" else "force")
