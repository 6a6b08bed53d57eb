"""Steady motion of a rig under a sine, and the largest one over a sweep.

In: a Model, its Numerics and its Patch. Out: the Solution of the periodic motion with its regime,
Floquet multipliers and stability. Coulomb interfaces, elastic-plastic elements and grooves are solved by shooting with
the map of a period (`shooting`), and other laws by harmonic balance (`balance`).
"""

from ....core import SineDrive
from ..engines import choose_steady_method
from ..solution import Solution
from .balance import BalanceFinder
from .peak import solve_peak
from .shooting import ShootingFinder

# Classes that find steady motions, by the name of the engine from `choose_steady_method`
FINDERS = {"hybrid": ShootingFinder, "harmonic": BalanceFinder}


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
        Settings of the run, from which each method makes its own.
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
    finder_class = FINDERS[choose_steady_method(model)]
    finder = finder_class(model, numerics, patch, frames, say)
    drive = model.rig.drive.signal
    if isinstance(drive, SineDrive):
        return finder.compute_steady_motion(drive)
    return solve_peak(finder.trace_curve(drive), finder)
