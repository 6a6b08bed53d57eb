"""The engine `harmonic`: the steady motion of a scene found directly, and its curve over frequency or level.

Coulomb interfaces and elastic-plastic elements by shooting on the map of their events and yields (`maps`), other laws
by harmonic balance (`balance`), those over grooves by a march (`marched`). What is found is a
motion that repeats with the drive; its regime, multipliers and stability are named.
"""

from ....core import NotConverged, SineDrive
from ..engines import FINDERS, PIECES, function_of, steady_by
from ..solution import Solution
from .curves import motion_at_levels
from .top import at_the_top


def run_steady(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """The steady motion at a sine, or the largest on a curve over a sweep or over levels, whose sine is extra["at"].

    Where the map of yields does not settle, the balance of harmonics is tried.
    """
    by = steady_by(model)
    try:
        return _found(function_of(by.solve)(model, numerics, patch, frames, say), model)
    except NotConverged:
        if by.like != PIECES.name or len(model.rig.friction.interfaces) > 1:
            raise
    return _found(function_of(FINDERS["balance"].solve)(model, numerics, patch, frames, say), model)


def _found(finder, model) -> Solution:
    """What a finder finds under the drive of a model."""
    drive = model.rig.drive.signal
    if isinstance(drive, SineDrive):
        return finder.point(drive)[0]
    if model.rig.drive.levels.amplitudes:
        return motion_at_levels(finder, drive)
    return at_the_top(*finder.curve(drive), finder)
