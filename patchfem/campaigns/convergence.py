"""Convergence of measures over a numerical setting: observed order, and the coarsest run that is accurate enough.

In: runs of `cost` from coarse to fine. Out: a `Convergence` per measure.
"""

from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core import Measure
from .cost import Cost

ORDER_RANGE = (0.05, 12.0)  # smallest and largest order that is looked for
# Relative change of a value below which it counts as round-off, which has no order
ROUND_OFF = 1e-11


class Convergence(NamedTuple):
    """Convergence of a measure over a setting.

    Attributes
    ----------
    finest : Measure
        Measure in the finest run, with its error.
    order : float or None
        Order that the values of the three finest runs with a fixed setting show. None if they do not approach a limit from
        one side, or differ by round-off.
    changes : list of float
        Difference of each run from the finest one, relative to the value of the finest one.
    """

    finest: Measure
    order: float | None
    changes: list[float]


def measure_convergence(runs: list[Cost], setting: str, name: str) -> Convergence:
    """Return the `Convergence` of a measure.

    Parameters
    ----------
    runs : list of Cost
        Runs with rising accuracy, each with a value of the measure; one with a setting by the tolerance does not count.
    setting : str
        Name of the setting, one of NUMERICAL_SETTINGS.
    name : str
        Name of the measure.
    """
    fixed = [run for run in runs if run.value is not None]
    finest = fixed[-1].measures[name]
    values = np.array([run.measures[name].value for run in fixed])
    scale = max(abs(finest.value), finest.floor, np.finfo(float).tiny)
    sizes = np.array([run.value for run in fixed], float)
    # Settings that are lengths; others are counts, whose reciprocals count as lengths
    if setting not in ("element_size",):
        sizes = 1 / sizes
    order = None
    if len(values) > 2 and np.abs(np.diff(values[-3:])).min() > ROUND_OFF * scale:
        order = find_order(sizes[-3:], values[-3:])
    return Convergence(finest, order, (np.abs(values - finest.value) / scale).tolist())


def find_order(sizes: np.ndarray, values: np.ndarray) -> float | None:
    """Return the order p with which three values approach v + c h^p over the sizes h, or None without such an order.

    Parameters
    ----------
    sizes : (3,) array
        Falling sizes of elements or steps.
    values : (3,) array
        Values of the measure.
    """
    first, second = np.diff(values).tolist()
    if first * second <= 0:
        return None

    def compare(order: float) -> float:
        """Return the excess of the ratio of the changes over that of an order."""
        coarse, fine = np.diff((sizes / sizes[0]) ** order).tolist()
        return first * fine - second * coarse

    low, high = map(compare, ORDER_RANGE)
    return brentq(compare, *ORDER_RANGE) if low * high < 0 else None


def find_sufficient_run(
    runs: list[Cost], name: str, convergence: Convergence, tolerance: float
) -> Cost | None:
    """Return the coarsest run from which on a measure is accurate to a relative tolerance.

    Stated error and difference from the finest run must both lie within the tolerance, in this run and in finer ones. A
    run without a stated error does not count as accurate.

    Parameters
    ----------
    runs : list of Cost
        Runs with rising accuracy; one with a setting by the tolerance does not count.
    name : str
        Name of the measure.
    convergence : Convergence
        That of the measure in these runs.
    tolerance : float
        Largest error and difference, relative to the value.

    Returns
    -------
    Cost or None
        None if no run is accurate enough.
    """
    fixed = [run for run in runs if run.value is not None]
    found = None
    for run, change in zip(reversed(fixed), reversed(convergence.changes), strict=True):
        is_accurate = max(change / tolerance, run.measures[name].error_ratio(tolerance)) <= 1
        if not (is_accurate and run.has_error(name)):
            break
        found = run
    return found
