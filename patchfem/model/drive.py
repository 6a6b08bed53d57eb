"""The drive signal of a rig from [drive]."""

from pathlib import Path

import numpy as np

from .. import inputs
from ..core import ModalBasis
from ..effects import find_waveform, import_effect
from ..structure import drives
from ..structure.drive_sizes import DriveKeys, find_first_period
from .file_cache import cache_by_file
from .source import name_key


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


def _read_recorded_drive(scene) -> tuple[np.ndarray, np.ndarray]:
    """Read both columns (k,) of the file drive.file of a scene.

    They are time [s] and signal, or frequency [Hz] and spectral density. The signal is an acceleration [m s-2] or a
    force [N], by the kind of the drive.
    """
    path = scene.resolve_path(scene.drive.file)
    with name_key("drive.file"):
        if find_waveform(scene.drive).is_random:
            return inputs.signals.read_spectrum(path)
        return read_drive_file(path, scene.drive.kind)


@cache_by_file
def read_drive_file(path: Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Read a recorded drive signal.

    Parameters
    ----------
    path : Path
        File to read.
    kind : str
        ``"base"`` for an acceleration of the base, else the file contains a force.

    Returns
    -------
    tuple of numpy.ndarray
        Time (k,) [s] from 0 on, and acceleration (k,) [m s-2] or force (k,) [N].
    """
    return inputs.signals.read_signal(path, "acceleration" if kind == "base" else "force")
