"""The engine `harmonic`: the steady motion of a scene found directly, and its curve over frequency or level.

Coulomb interfaces by shooting on the map of their events (`steady_events`), elastic-plastic elements on that of their
yields (`pieces.steady`), other laws by harmonic balance (`steady_balance`). What is found is a motion that repeats with
the drive; its regime, multipliers and stability are named.
"""

from dataclasses import replace

from ...core import BaseSine, NotConverged
from .engines import steady_by
from .solution import Solution


def run_steady(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """The steady motion at a sine, or the largest on a curve over a sweep or over levels, whose sine is extra["at"].

    Where the map of yields does not settle, the balance of harmonics is tried.
    """
    by = steady_by(model)
    if by == "events":
        from .steady_events import Events

        return _found(Events(model, numerics, patch, say), model)
    if by == "yields":
        from .pieces.steady import Yields

        try:
            return _found(Yields(model, numerics, patch, frames, say), model)
        except NotConverged:
            if len(model.rig.interfaces) > 1:
                raise
    from .steady_balance import Balance

    return _found(Balance(model, numerics, patch, say), model)


def _found(finder, model) -> Solution:
    """What a finder finds under the drive of a model."""
    drive = model.rig.drive
    if isinstance(drive, BaseSine):
        raw, errors, extra = finder.point(drive)
        return replace(raw, errors=errors, extra=extra)
    curve, best, near = finder.curve(drive)
    raw, errors, extra = finder.point(best, near)
    return replace(raw, errors=errors, extra=extra | {"curve": curve, "at": best})
