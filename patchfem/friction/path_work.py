"""Friction work from samples of the relative displacement and of the friction force."""

import numpy as np


def sampled_work(rel_disp, force, force_after=None) -> np.ndarray:
    """Integrate the friction force over the displacement between samples (trapezoidal rule).

    An engine that integrates its energy balance from path means of the force cannot notice a wrong mean. This sum uses
    the samples alone, so it is an independent check.

    Parameters
    ----------
    rel_disp : (k,) array
        Relative displacement [m].
    force : (k,) array
        Friction force [N], positive against positive slip.
    force_after : (k - 1,) array, optional
        Force [N] in the step that follows a sample. It replaces the sample where the relative displacement starts or
        reverses, because friction may jump there, and the sample is then the force before the jump.

    Returns
    -------
    (k - 1,) array
        Friction work of each step [J].
    """
    steps = np.diff(rel_disp)
    force_sum = force[:-1] + force[1:]
    if force_after is not None:
        direction = np.sign(steps)
        is_reversed = (direction != 0) & (direction != np.append(0.0, direction[:-1]))
        force_sum = np.where(is_reversed, 2 * force_after, force_sum)
    return force_sum * steps / 2
