"""Convergence of measures over a numerical setting: observed order, and the coarsest run that is accurate enough.

In: runs of `cost` from coarse to fine. Out: a `Convergence` per measure.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..core import Measure
from .cost import Cost
from .numerical_settings import TOLERANCE_SETTING

# Settings that fall with the error; others are counts, whose reciprocals do
FALLING_SETTINGS = ("element_size", TOLERANCE_SETTING)
ORDER_RANGE = (0.05, 12.0)  # smallest and largest order that is looked for
# Relative change of a value below which it counts as round-off, which has no order
ROUND_OFF = 1e-11
# Numbers of runs of a regression for the order: fewer than three show no scatter, and coarser ones are not asymptotic.
MIN_RUNS_FOR_ORDER = 3
N_RUNS_FOR_ORDER = 4
# Smallest order of stated errors that is extrapolated, and largest ratio of sizes: beyond it a prediction says little
MIN_EXTRAPOLATED_ORDER = 0.3
MAX_EXTRAPOLATED_RATIO = 30.0


class Convergence(NamedTuple):
    """Convergence of a measure over a setting.

    Attributes
    ----------
    reference : Measure
        Most accurate value of the measure, with its error.
    order : float or None
        Order with which the values of the finest runs with a fixed setting approach the reference, or their own limit if
        the reference is one of them. None if they approach neither, or differ by round-off.
    changes : list of float
        Difference of each run with a fixed setting from the reference, relative to the value of the reference.
    """

    reference: Measure
    order: float | None
    changes: list[float]


class ExtrapolatedRun(NamedTuple):
    """Setting at which a run is expected to meet a tolerance, from the stated errors of two runs.

    - value: value of the setting in SI.
    - seconds: expected CPU time [s].
    """

    value: float
    seconds: float


def find_reference(runs: Sequence[Cost], name: str) -> Measure | None:
    """Return the value of a measure with the smallest stated error in any run; None if no run states one."""
    known = [run.measures[name] for run in runs if run.has_error(name)]
    return min(known, key=lambda measure: measure.error, default=None)


def measure_convergence(
    runs: list[Cost], setting: str, name: str, reference: Measure | None = None
) -> Convergence:
    """Return the `Convergence` of a measure.

    Parameters
    ----------
    runs : list of Cost
        Runs with rising accuracy, each with a value of the measure; one with a setting by the tolerance does not count.
    setting : str
        Name of the setting, one of NUMERICAL_SETTINGS.
    name : str
        Name of the measure.
    reference : Measure, optional
        Most accurate value of the measure (`find_reference`); by default that of the finest run.
    """
    fixed = [run for run in runs if run.value is not None]
    measures = [run.measures[name] for run in fixed]
    if reference is None:
        reference = measures[-1]
    values = np.array([measure.value for measure in measures])
    scale = max(abs(reference.value), reference.floor, np.finfo(float).tiny)
    changes = np.abs(values - reference.value)
    sizes = _measure_sizes(fixed, setting)

    # Differences from a more accurate value need not have one sign. Coarse runs may be far from their asymptotic order.
    order = None
    is_known = changes > max(reference.error or 0.0, ROUND_OFF * scale)
    near = np.flatnonzero(is_known)[-N_RUNS_FOR_ORDER:]
    if all(measure is not reference for measure in measures) and near.size >= MIN_RUNS_FOR_ORDER:
        order = float(np.polyfit(np.log(sizes[near]), np.log(changes[near]), 1)[0])
    elif len(values) > 2 and np.abs(np.diff(values[-3:])).min() > ROUND_OFF * scale:
        order = find_order(sizes[-3:], values[-3:])
    return Convergence(reference, order, (changes / scale).tolist())


def _measure_sizes(runs: list[Cost], setting: str) -> np.ndarray:
    """Return the sizes (m,) of elements or steps in runs with a fixed setting: lengths [m], tolerances, or 1/counts."""
    values = np.array([run.value for run in runs], float)
    return values if setting in FALLING_SETTINGS else 1 / values


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

    Stated error and difference from the most accurate value must both lie within the tolerance, in this run and in finer
    ones. A run without a stated error does not count as accurate.

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


def extrapolate_sufficient_run(
    runs: list[Cost], setting: str, name: str, tolerance: float
) -> ExtrapolatedRun | None:
    """Return the setting at which the stated error of a measure is expected to meet a relative tolerance.

    Error and CPU time are powers of the size of elements or steps, as in the two finest runs.

    Parameters
    ----------
    runs : list of Cost
        Runs with rising accuracy, of which none meets the tolerance; one with a setting by the tolerance does not count.
    setting : str
        Name of the setting, one of NUMERICAL_SETTINGS.
    name : str
        Name of the measure.
    tolerance : float
        Largest stated error, relative to the value.

    Returns
    -------
    ExtrapolatedRun or None
        None if the errors are not known, do not fall, or fall so slowly that the setting is far away.
    """
    pair = [run for run in runs if run.value is not None][-2:]
    if len(pair) < 2 or not all(run.has_error(name) for run in pair):
        return None
    coarse, fine = (run.measures[name].error_ratio(tolerance) for run in pair)
    if not coarse > fine > 1:
        return None
    sizes = _measure_sizes(pair, setting)
    step = np.log(sizes[0] / sizes[1])
    order = np.log(coarse / fine) / step
    ratio = fine ** (1 / order)  # of the finest size to the one that is looked for
    if order < MIN_EXTRAPOLATED_ORDER or ratio > MAX_EXTRAPOLATED_RATIO:
        return None
    size = sizes[1] / ratio
    growth = max(0.0, np.log(pair[1].seconds / pair[0].seconds) / step)
    value = size if setting in FALLING_SETTINGS else 1 / size
    return ExtrapolatedRun(float(value), float(pair[1].seconds * ratio**growth))
