"""Response of contact points to the prescribed displacement of a bench, and its energies.

In: a Contact and a `SlideTask`. Out: a `points.slides.SlideMotion`.
"""

import numpy as np

from ...core import NotConverged
from ...points import slides
from .ledger import SlideHistories, SlideTask, stack_energies


def follow_slide(contact, task: SlideTask) -> slides.SlideMotion:
    """Move contact points along the prescribed displacement of a bench run.

    Raises
    ------
    Missing
        If lists of bonds become too long.
    NotConverged
        If a step has too large a residual.
    """
    motion = slides.follow(
        contact,
        task.time,
        task.slide,
        task.frame_indices,
        task.options.say,
        task.options.report,
    )
    if motion.n_unsolved:
        raise NotConverged(
            f"in {motion.n_unsolved} time steps of the prescribed slide the friction force has an error "
            "above the limit; raise accuracy.steps_per_cycle",
            "",
        )
    return motion


def make_slide_histories(task: SlideTask, motion, load: float, tau, local) -> SlideHistories:
    """Return the histories of a bench run under constant load.

    Parameters
    ----------
    task : SlideTask
    motion : SlideMotion
    load : float
        [N]
    tau, local : (f, m)
        Traction [Pa] and slip [m] at the nodes in each frame.
    """
    losses = np.zeros((motion.force.size, 2))
    losses[1:, 0] = -np.minimum(motion.losses, 0.0)
    losses[1:, 1] = np.maximum(motion.losses, 0.0)
    work = np.append(0.0, np.cumsum(motion.losses + np.diff(motion.stored)))
    return SlideHistories(
        force=motion.force,
        load=np.full(motion.force.size, load),
        slip=motion.slip,
        ledger=stack_energies(work, motion.stored, losses),
        frames=task.frame_indices,
        tau=tau,
        local=local,
    )
