"""The engine `harmonic`: the steady motion of a scene found directly, and its curve over frequency or level.

Coulomb interfaces by shooting on the map of their events (`steady_events`), other laws by harmonic balance
(`steady_balance`). What is found is a motion that repeats with the drive; its regime, multipliers and stability are
named.
"""

from dataclasses import replace

from ...core import BaseSine
from .engines import no_closed_form
from .solution import Solution


def run_steady(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """The steady motion at a sine, or the largest on a curve over a sweep or over levels, whose sine is extra["at"]."""
    drive = model.rig.drive
    sine = drive if isinstance(drive, BaseSine) else None
    if no_closed_form(model, steady=True):
        from .steady_balance import Balance as Finder
    else:
        from .steady_events import Events as Finder
    finder = Finder(model, numerics, patch, say)
    if sine is not None:
        raw, errors, extra = finder.point(sine)
        return replace(raw, errors=errors, extra=extra)
    curve, best, near = finder.curve(drive)
    raw, errors, extra = finder.point(best, near)
    return replace(raw, errors=errors, extra=extra | {"curve": curve, "at": best})
