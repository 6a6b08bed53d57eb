"""Solution of a rig by the engine of its numerical settings.

In: a Model, its Numerics and its Patch. Out: a Solution. `engines` lists what each engine can
compute.
"""

from . import bond_lists, costs, event_to_event, march
from .solution import Solution, replace_output_by_gauge
from .steady import steady


def solve_rig(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Compute the motion of a rig with the engine of its settings; the output is that of the gauge.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Numerical settings, including the name of the engine.
    patch : Patch or None
        None under [normal] and between masses.
    frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.

    Returns
    -------
    Solution
    """
    if numerics.engine == "hybrid":
        run = event_to_event.run_from_event_to_event
    elif numerics.engine == "march":
        run = march.march_in_time
    else:
        run = steady.solve_steady_motion
    return replace_output_by_gauge(model, run(model, numerics, patch, frames, say, progress))


def refuse_long_run(model, numerics) -> None:
    """Raise Missing if a run would take too much CPU time, or has too long time steps."""
    if numerics.engine == "hybrid":
        costs.refuse_long_hybrid_run(model)
    elif numerics.engine == "march":
        bond_lists.refuse_unresolved_bond_vibration(model, numerics)
