"""Choice of the algorithm (engine) that sums eq. 2.17, and of its settings, by the tolerance.

The recursion is exact for reading="stretch" with p = 1. The list of strips (`list_kernels`) sums every law. It has two
settings: the fraction of the friction limit that its cut-off may lose, and the width up to which it merges strips. The
engines `direct`, `truncated` and `merged` use none, the first, and both. Which of them has the shortest list depends on
the law, the strokes and the steps.
"""

from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

from .list_numbers import MAX_DAMAGE, cutoff_age, sum_form
from .list_rows_kernels import FORM_GROWING, FORM_REPORT, MAX_STRIP_LENGTH
from .parameters import Bonds

# Settings of a list, by engine: whether it drops old strips, whether it merges strips
LIST_SETTINGS = {
    "direct": (False, False),
    "truncated": (True, False),
    "merged": (True, True),
}
ENGINES = (*LIST_SETTINGS, "recursion")
# Upper bounds of the error of merging, divided by the square of the merge width (measured by
# test_merge_bounds)
MERGE_ERROR_CONSTANT = 0.25  # bound for a constant bond length
MERGE_ERROR_STRETCH_GROWING = 1.0  # bound for reading="stretch" with growing bonds
MERGE_ERROR_GROWING = 6.0  # bound for reading="report" with growing bonds
# Error that merging adds at any merge width for growing bonds with p < 0; it is due to bonds that
# form at a reversal
NEGATIVE_ORDER_ERROR = 3e-4
# Largest change of the force due to the cut-off, as a fraction of the friction limit
MAX_TAIL = 1e-6
MAX_MERGE_WIDTH = 0.02  # largest merge width in bond lengths


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
    width = merge
    if width is None:
        width = min(MAX_MERGE_WIDTH, sqrt(0.09 * tolerance / _merge_error_factor(law)))
    choices = {}
    for name, (drops_strips, merges_strips) in LIST_SETTINGS.items():
        tail_used = tail * drops_strips
        choices[name] = _estimate(law, name, tail_used, width * merges_strips, stroke, steps)

    # An engine or a merge width that the scene prescribes is used. Otherwise the faster list is, but growing bonds of an
    # order below 0 have an error that no merge width reduces (NEGATIVE_ORDER_ERROR); if it is too large, none is merged.
    if engine != "auto":
        return choices[engine]
    if merge is not None:
        return choices["merged" if merge > 0 else "truncated"]
    if choices["merged"].error > 0.1 * tolerance:
        return choices["truncated"]
    return min(choices["truncated"], choices["merged"], key=lambda choice: choice.strips)


def _merge_error_factor(law: Bonds) -> float:
    """Return the bound of the error caused by merging strips, divided by the merge width squared."""
    if not law.has_growth:
        return MERGE_ERROR_CONSTANT
    return MERGE_ERROR_GROWING if law.reading == "report" else MERGE_ERROR_STRETCH_GROWING


def _estimate(
    law: Bonds, name: str, tail: float, merge: float, stroke: float, steps: float
) -> EngineChoice:
    """Estimate length and error of a bond list with given settings.

    Parameters
    ----------
    law : Bonds
        Parameters of the bonds.
    name : {"truncated", "merged"}
        Name of the engine.
    tail : float
        Largest fraction of the friction limit that dropped bonds may carry; 0: no bonds are dropped.
    merge : float
        Largest width [eps_0] of a joined strip of age 0; 0: no strips are joined.
    stroke : float
        Path between two reversals [eps_0].
    steps : float
        Number of steps on this path.

    Returns
    -------
    EngineChoice
        With the expected number of strips and the bound of the error.
    """
    # Every increment of a step adds a strip, or several if it is longer than a strip may be.
    form = sum_form(law)
    increment = stroke / max(steps, 1)
    reach = min(cutoff_age(law.order, tail) if tail > 0 else MAX_DAMAGE, MAX_DAMAGE)
    strips = reach / max(increment, 1e-12) * max(1.0, increment / MAX_STRIP_LENGTH)
    if form == FORM_REPORT:
        # A strip lasts from reversal to reversal
        strips = reach / stroke + 2
    elif form == FORM_GROWING:
        strips *= 2
    if merge > 0:
        # Strips of age R are joined up to merge exp(R/3), but not beyond a reversal
        strips = min(strips, 5 / merge + 20 + 2 * reach / stroke + 180 * (form == FORM_GROWING))

    error = tail + (_merge_error_factor(law) * merge**2 if merge > 0 else 0.0)
    if merge > 0 and form == FORM_GROWING and law.order < 0:
        error += NEGATIVE_ORDER_ERROR
    return EngineChoice(name, tail, merge, error, strips)
