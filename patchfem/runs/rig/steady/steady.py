"""Steady motion of a rig under a sine, and the largest one over a sweep.

In: a Model, its Numerics and its Patch. Out: the Solution of the periodic motion with its regime,
Floquet multipliers and stability, by shooting with the map of a period (`shooting`).
"""

from ....core import SineDrive
from ..solution import Solution
from .peak import solve_peak
from .shooting import ShootingFinder


def solve_steady_motion(
    model, numerics, patch, frames: int = 0, say=None, progress=None
) -> Solution:
    """Compute the steady motion under a sine, or the largest one over a sweep.

    The drive of the largest motion is `Solution.drive`.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Settings of the run, from which the finder makes its own.
    patch : Patch or None
        None under [normal] and between masses.
    frames : int
        Number of snapshots of the interface in a cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction; progress is not used.

    Returns
    -------
    Solution
    """
    finder = ShootingFinder(model, numerics, patch, frames, say)
    drive = model.rig.drive.signal
    if isinstance(drive, SineDrive):
        return finder.compute_steady_motion(drive)
    return solve_peak(finder.trace_curve(drive), finder)
