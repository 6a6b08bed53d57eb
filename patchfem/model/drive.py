"""The drive of a scene as a drive of the engines: signal, length of a cycle, length of the run, sizes for defaults."""

from functools import lru_cache

import numpy as np

from ..core import BaseSine, ModalBasis
from ..effects import module_of
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
    drives = module_of(f"drive.waveform={drive.waveform}")
    if drive.waveform == "levels":
        return drives.levels(drive.levels, 2 * np.pi * drive.frequency, cycles_per_level(drive))
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


def levelled(asked) -> bool:
    """Whether the drive is raised in levels."""
    return asked.kind == "base" and asked.waveform == "levels"


def cycles_per_level(asked) -> float:
    """Drive cycles of each level: whole ones, so that a level begins where the sine does."""
    cycles = asked.cycles if asked.cycles is not None else asked.duration * asked.frequency
    return float(max(1, round(cycles)))


def cycles_of(asked, drive) -> float:
    """Length of the run in cycles of the drive that [drive] asks for; of levels, all of them."""
    if levelled(asked):
        return cycles_per_level(asked) * len(asked.levels)
    if asked.cycles is not None:
        return asked.cycles
    duration = asked.duration
    if duration is None:
        duration = sweep_duration(asked) if asked.waveform == "sweep" else float(drive.time[-1])
    return max(duration / drive.period, 0.25)


def recorded(scene) -> tuple:
    """(time (k,) [s], value (k,)) of drive.file: acceleration [m s-2] of the base, or force [N]; from 0 s on."""
    name, path = "acceleration" if scene.drive.kind == "base" else "force", scene.beside(scene.drive.file)
    return _read(path, name, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=4)
def _read(path, name: str, _changed: int) -> tuple:
    from ..inputs.signals import read_signal

    return read_signal(path, name)
