"""Solution of a rig by the engine that its numerical settings name.

In: a Model, its Numerics and its pressed patch. Out: a Solution. `engines` says what each engine
can compute; the module of an engine is loaded when it solves.
"""

from . import costs, lists, march, pieces, smooth
from .solution import Solution, seen_by_gauge
from .steady import steady

# function of each engine: (model, numerics, patch, frames, say, progress) -> Solution
SOLVERS = {
    "exact": lambda *arguments: pieces.run_exact(*arguments),
    "piecewise": lambda *arguments: pieces.run_piecewise(*arguments),
    "smooth": lambda *arguments: smooth.run_smooth(*arguments),
    "march": lambda *arguments: march.run_march(*arguments),
    "harmonic": lambda *arguments: steady.run_steady(*arguments),
}


def solve(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Solve a rig, and return the Solution as its gauge sees it.

    Parameters
    ----------
    model : Model
    numerics : Numerics
        Its engine solves.
    patch : Patch or None
    frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.

    Returns
    -------
    Solution
    """
    solution = SOLVERS[numerics.engine](model, numerics, patch, frames, say, progress)
    return seen_by_gauge(model, solution)


def refuse_long_run(model, numerics) -> None:
    """Raise Missing if the engine of the settings would take too long."""
    if numerics.engine in ("exact", "piecewise"):
        costs.refuse_endless(model)
    elif numerics.engine == "march":
        lists.refuse_long_list(model, numerics)
