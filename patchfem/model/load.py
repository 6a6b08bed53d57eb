"""The load of [normal] in time, N = max(0, load + amplitude cos(2 pi f t + phase)), and a bench's samples under it."""

import numpy as np

from ..core import Missing

MOST_SAMPLES = 5_000_000


def varies(scene) -> bool:
    """Whether the scene names a load that changes in time."""
    return scene.normal is not None and bool(scene.normal.amplitude)


def load_at(scene, time) -> np.ndarray:
    """Load (k,) [N] at the times (k,) [s]."""
    normal = scene.normal
    wave = np.cos(2 * np.pi * normal.frequency * np.asarray(time) + (normal.phase or 0.0))
    load = normal.load + normal.amplitude * wave
    return np.where(load > 1e-12 * (normal.load + normal.amplitude), load, 0.0)  # round-off carries nothing


def refined(scene, time, slide, steps: int) -> tuple:
    """(time, slide) with samples fine enough for the load as well: `steps` per period of it, its extremes, and the
    instants at which the contact is lost or made. Missing where that is too many."""
    normal, period = scene.normal, 1 / scene.normal.frequency
    span = time[-1] - time[0]
    if span / period * steps + time.size > MOST_SAMPLES:
        raise Missing(f"{scene.path}: the load makes {span / period:.3g} periods during the slide, more than "
                      f"{MOST_SAMPLES} samples resolve; lower normal.frequency, slide.cycles or slide.hold")
    lag = (normal.phase or 0.0) / (2 * np.pi)
    marks = np.arange(np.floor(time[0] / period + lag) - 1, time[-1] / period + lag + 2)
    inner = [marks[:, None] + np.arange(steps) / steps]
    if normal.amplitude > normal.load:
        edge = np.arccos(-normal.load / normal.amplitude) / (2 * np.pi)
        inner += [marks[:, None] + np.array([edge, 1 - edge])]
    extra = (np.concatenate([part.ravel() for part in inner]) - lag) * period
    grid = np.union1d(time, extra[(extra > time[0]) & (extra < time[-1])])
    kept = np.append(True, np.diff(grid) > 1e-9 * period) | np.isin(grid, time)
    grid = grid[kept]
    if scene.slide.kind == "sine":
        return grid, scene.slide.amplitude * np.sin(2 * np.pi * scene.slide.frequency * grid)
    return grid, np.interp(grid, time, slide)


def spring_of(contact) -> float:
    """Rotational stiffness of the holder [N m/rad], 0 where none is named."""
    return (contact.holder.rotational_stiffness or 0.0) if contact.holder is not None else 0.0


def moment_of(contact) -> float | None:
    """Moment of the load about the middle of the patch [N m], None where the rotation is held."""
    if contact.load_line is None:
        return 0.0 if spring_of(contact) > 0 else None
    if contact.load_line.moment is not None:
        return contact.load_line.moment
    return contact.load * contact.load_line.offset
