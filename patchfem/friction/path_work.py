"""Friction work from samples of the relative displacement and of the friction force, and the phase of slip."""

import numpy as np

# Smallest mean resultant length of the doubled phases of slip starts that are one phase.
MIN_ALIGNMENT = 0.95


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


def mean_slip_phase(count, cosine, sine):
    """Return the mean phase [rad], modulo pi, at which slip begins, for one run or for (n,) runs.

    It is NaN if there is no onset, and if the onsets differ by more than MIN_ALIGNMENT allows: the
    mean of several slip phases in a half cycle is the phase of none.

    Parameters
    ----------
    count, cosine, sine : array_like
        Number of slip onsets, and sums of cosine and sine of twice their phases.

    Returns
    -------
    array_like
    """
    have_common_phase = (count > 0) & (np.hypot(cosine, sine) >= MIN_ALIGNMENT * count)
    return np.where(have_common_phase, np.arctan2(sine, cosine) / 2 % np.pi, np.nan)[()]
