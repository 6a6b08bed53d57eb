"""Choice of the algorithm (engine) that sums eq. 2.17, and of its settings, by the tolerance.

The recursion is exact for reading="stretch" with p = 1. The list of strips (`strip_kernels`) sums every law. It has two
settings: the fraction of the friction limit that its cut-off may lose, and the width up to which it merges strips. The
engines `direct`, `truncated` and `merged` use none, the first, and both.
"""

from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

from .list_numbers import MAX_DAMAGE, STRIPS_PER_WIDTH, UNMERGED_WIDTH, cutoff_age
from .parameters import Bonds

ENGINES = ("direct", "truncated", "merged", "recursion")
# Upper bounds of the error of strips, divided by the square of their width (measured by test_merge_bounds): in general, for
# growing bonds, and for orders between 0 and 1, whose bonds change steeply as they form
MERGE_ERROR = 0.05
MERGE_ERROR_GROWING = 0.1
MERGE_ERROR_STEEP = 0.3
# Error at any width for an order below 0, due to bonds that form at a reversal
NEGATIVE_ORDER_ERROR = 3e-3
# Largest change of the force due to the cut-off, as a fraction of the friction limit
MAX_TAIL = 1e-6
MAX_MERGE_WIDTH = 0.04  # largest merge width in bond lengths


@dataclass(frozen=True, slots=True)
class EngineChoice:
    """Engine, that is the algorithm that sums eq. 2.17, with its settings and the bound of its error.

    - engine: name of the engine, one of `ENGINES`
    - tail: fraction of the friction limit that the cut-off may lose
    - merge: width [eps_0] up to which strips are merged
    - error: bound of the total error / friction limit
    - strips: expected length of the list, to which its CPU time is proportional
    """

    engine: str
    tail: float
    merge: float
    error: float
    strips: float

    def reach(self, order: float) -> float:
        """Return the age [bond lengths] beyond which bonds are dropped, or inf if none are dropped."""
        return cutoff_age(order, self.tail) if self.tail > 0 else inf


# The recursion is exact and keeps no strips.
RECURSION = EngineChoice("recursion", 0.0, 0.0, 0.0, 0.0)


def unsupported_reason(engine: str, law: Bonds) -> str:
    """Return a sentence that states why an engine cannot sum a law, and which engine can; "" if it can."""
    if engine == "recursion" and (law.reading != "stretch" or law.order != 1):
        return 'works only with reading = "stretch" and order = 1; use "auto" or "merged"'
    return ""


class RequestedEngine(NamedTuple):
    """Engine, and its settings, that a scene prescribes.

    - name: name of the engine, or "auto"
    - tail: fraction of the friction limit that the cut-off may lose, None if it is not prescribed
    - merge: width [eps_0] up to which strips are merged, None if it is not prescribed
    """

    name: str = "auto"
    tail: float | None = None
    merge: float | None = None


def find_error_factor(law: Bonds) -> float:
    """Return the bound of the error of strips / (friction limit * width^2), with their width in bond lengths."""
    if law.order < 1 and law.order != 0:
        return MERGE_ERROR_STEEP
    return MERGE_ERROR_GROWING if law.has_growth else MERGE_ERROR


def estimate_strip_error(law: Bonds, width: float) -> float:
    """Return a bound of the error of the sum over strips, relative to the friction limit.

    Parameters
    ----------
    law : Bonds
        Parameters of the bonds.
    width : float
        Largest width of a strip [bond lengths].
    """
    return find_error_factor(law) * width**2 + NEGATIVE_ORDER_ERROR * (law.order < 0)


def choose_engine(
    law: Bonds,
    tolerance: float,
    stroke: float,
    steps: float,
    requested: RequestedEngine | None = None,
) -> EngineChoice:
    """Choose the cheapest engine whose error bound is at most a tenth of the tolerance.

    Parameters
    ----------
    law : Bonds
        Parameters of the bonds.
    tolerance : float
        Relative tolerance of the run.
    stroke, steps : float
        Path between two reversals [eps_0], and steps on it.
    requested : RequestedEngine, optional
        Engine and settings that must be used.

    Returns
    -------
    EngineChoice

    Raises
    ------
    ValueError
        If the engine cannot sum the law.
    """
    engine, tail, merge = requested or RequestedEngine()
    reason = unsupported_reason(engine, law)
    if reason:
        raise ValueError(f"{engine} {reason}")

    # Nothing is faster than the recursion, and it has no error.
    if engine == "recursion" or (engine == "auto" and not unsupported_reason("recursion", law)):
        return RECURSION

    # A list may use a tenth of the tolerance: merging, whose error grows with the square of the width, 0.09 of the
    # tolerance, and the cut-off 0.001.
    if tail is None:
        tail = min(1e-3 * tolerance, MAX_TAIL)
    if merge is None:
        merge = min(MAX_MERGE_WIDTH, sqrt(0.09 * tolerance / find_error_factor(law)))
    if engine == "auto":
        engine = "merged" if merge > 0 else "truncated"
    tail = 0.0 if engine == "direct" else tail
    merge = merge if engine == "merged" else 0.0

    # Without merging every increment of a step adds a strip.
    width = merge or UNMERGED_WIDTH
    error = tail + estimate_strip_error(law, width)
    reach = min(cutoff_age(law.order, tail) if tail > 0 else inf, MAX_DAMAGE)
    strips = STRIPS_PER_WIDTH / merge if merge > 0 else reach * max(steps / stroke, 1 / width)
    return EngineChoice(engine, tail, merge, error, strips)
