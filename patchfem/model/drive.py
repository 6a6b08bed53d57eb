"""The drive of a scene as a drive of the engines: signal, length of a cycle, length of the run, sizes for defaults."""

from functools import lru_cache

import numpy as np

from ..core import BaseSine, ModalBasis
from ..structure.drive_sizes import own_period


def drive_of(scene, modes: ModalBasis):
    """The drive of [drive]; a displacement amplitude X of the base gives the acceleration X omega^2, a force F over the
    modal mass F/m. `modes` gives the cycle of what has no frequency of its own."""
    drive = scene.drive
    if drive.kind == "free":
        from ..structure.drives import release

        return release(own_period(modes))
    moving = drive.kind == "base"
    if drive.waveform == "sine":
        omega = 2 * np.pi * drive.frequency
        return BaseSine(float(_size(drive, modes, omega)), float(omega), moving)
    from ..structure import drives

    if drive.waveform == "levels":
        return drives.levels(drive.levels, 2 * np.pi * drive.frequency, cycles_per_level(scene))
    if drive.waveform == "step":
        if moving and drive.acceleration is None:
            return drives.release(own_period(modes))  # the base jumps: the start says so
        return drives.step(float(_size(drive, modes, 0.0)), own_period(modes), moving)
    if drive.waveform == "sweep":
        displaced = drive.displacement if moving and drive.acceleration is None else None
        size = 0.0 if displaced is not None else float(_size(drive, modes, 0.0))
        return drives.Sweep(drive.from_, drive.to, sweep_duration(drive), size, displaced, drive.rate is None, moving)
    time, value = recorded(scene)
    scale = 1.0 if moving else 1 / modes.mass
    return drives.Recorded(time, scale * value, own_period(modes), moving)


def _size(drive, modes: ModalBasis, omega: float) -> float:
    if drive.kind == "force":
        return drive.force / modes.mass
    return drive.acceleration if drive.acceleration is not None else drive.displacement * omega**2


def sweep_duration(drive) -> float:
    """Time [s] that a sweep takes from its first to its last frequency."""
    if drive.rate is not None:
        return abs(drive.to - drive.from_) / drive.rate
    return abs(np.log2(drive.to / drive.from_)) / drive.log_rate


def levelled(scene) -> bool:
    """Whether the drive is raised in levels."""
    return scene.drive.kind == "base" and scene.drive.waveform == "levels"


def cycles_per_level(scene) -> float:
    """Drive cycles of each level: whole ones, so that a level begins where the sine does."""
    drive = scene.drive
    cycles = drive.cycles if drive.cycles is not None else drive.duration * drive.frequency
    return float(max(1, round(cycles)))


def cycles_of(scene, drive) -> float:
    """Length of the run in cycles of the drive; of levels, all of them."""
    if levelled(scene):
        return cycles_per_level(scene) * len(scene.drive.levels)
    if scene.drive.cycles is not None:
        return scene.drive.cycles
    duration = scene.drive.duration
    if duration is None:
        duration = sweep_duration(scene.drive) if scene.drive.waveform == "sweep" else float(drive.time[-1])
    return max(duration / drive.period, 0.25)


def recorded(scene) -> tuple:
    """(time (k,) [s], value (k,)) of drive.file: acceleration [m s-2] of the base, or force [N]; from 0 s on."""
    return record(scene.beside(scene.drive.file), scene.drive.kind)


def record(path, kind: str) -> tuple:
    """(time (k,) [s], value (k,)) of a recorded drive of a kind, read once."""
    name = "acceleration" if kind == "base" else "force"
    return _read(path, name, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=4)
def _read(path, name: str, _changed: int) -> tuple:
    from ..inputs.signals import read_signal

    return read_signal(path, name)
