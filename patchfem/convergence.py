"""Error of a value from its changes between successive runs (grid convergence index).

In a run that is coarser by a factor `ratio` (in steps, elements, cells of a density, harmonics, modes or the tolerance
of a step), a value changes by ratio**p - 1 times its error, where p is the order of convergence. The error estimate is
therefore ERROR_SAFETY_FACTOR times the change divided by ratio**p - 1 (Roache, J. Fluids Eng. 116, 405, 1994; ASME V&V
20); `convergence_error` is the only formula. No factor depends on a measure, law or scene. tests/README.md gives the
fraction of the error estimates of random scenes that contain the true error.
"""

import numpy as np

# Roache's safety factor for two runs; it also covers runs outside the asymptotic range.
ERROR_SAFETY_FACTOR = 3.0
MIN_CONVERGENCE_ORDER = 1.0  # Lowest order of convergence in an estimate.
# Highest order of convergence in an estimate, which is the order of the numerical methods.
MAX_CONVERGENCE_ORDER = 2.0
# Largest plausible ratio of two successive changes (order 4); beyond it, the last change is accidentally
# small.
MAX_PLAUSIBLE_CHANGE_RATIO = 16.0


def convergence_error(
    change,
    *coarser_changes,
    ratio: float = 2.0,
    order: float = MIN_CONVERGENCE_ORDER,
    max_order: float = MAX_CONVERGENCE_ORDER,
):
    """Estimate the error of a value from its changes between successive runs.

    The estimate is ERROR_SAFETY_FACTOR |change| / (growth - 1), where `growth` is the factor between the
    errors of a run and of the next coarser one.

    - Two runs (one change): growth = ratio**order.
    - Three runs: growth is the ratio of the two changes, at most 2**max_order, if it lies between
      ratio**order and MAX_PLAUSIBLE_CHANGE_RATIO. The change counts as at least 2**-max_order of the previous
      one, so that a change that is small by accident does not give a small error.
    - More runs: the estimate without the finest run is an upper limit if its interval contains the
      value; the error is assumed to decrease by at most 2**max_order from run to run.

    Parameters
    ----------
    change : float or (n,)
        Change from the second finest to the finest run.
    *coarser_changes : float or (n,)
        Changes between the runs before, from fine to coarse; nan if unknown. Arrays only for up to
        three runs.
    ratio : float
        Ratio of the step or cell sizes of two successive runs; below 1 if the only change is that to
        a finer run.
    order : float
        Order of convergence that is assumed if the changes do not show it.
    max_order : float
        Highest order of convergence that the changes can show.

    Returns
    -------
    float or (n,)
        Error in the unit of the value.
    """
    growth = ratio**order
    largest = np.abs(change)
    if coarser_changes:
        previous = coarser_changes[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            observed = np.divide(previous, change)
        shows_order = (observed > growth) & (observed <= MAX_PLAUSIBLE_CHANGE_RATIO)
        growth = np.where(shows_order, np.minimum(observed, 2.0**max_order), growth)
        largest = np.fmax(largest, np.abs(previous) / 2.0**max_order)
    error = (ERROR_SAFETY_FACTOR * largest / np.abs(growth - 1))[()]
    if len(coarser_changes) > 1:
        coarser_error = convergence_error(
            *coarser_changes, ratio=ratio, order=order, max_order=max_order
        )
        if abs(change) <= coarser_error:  # the value lies in the error interval of the coarser run
            error = min(error, coarser_error)
        error = max(error, coarser_error / 2**max_order)
    return error
