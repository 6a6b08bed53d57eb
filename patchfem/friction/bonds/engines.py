"""Choice of the algorithm (engine) that sums eq. 2.17, and of its settings, by the tolerance.

The recursion is exact for reading="stretch" with p = 1. The list of strips (`strip_kernels`) sums every law. It has two
settings: the fraction of the friction limit that its cut-off may lose, and the width up to which it merges strips. The
engines `direct`, `truncated` and `merged` use none, the first, and both.
"""

from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

from .list_numbers import JOIN_ERROR, MAX_STRIPS, cutoff_age, find_max_age
from .parameters import Bonds

ENGINES = ("direct", "truncated", "merged", "recursion")


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

    def find_error(self, join_error: float) -> float:
        """Return the bound of the total error / friction limit.

        `join_error` is the largest error / load of a join that made room in a full list, or 0.
        """
        return max(self.error, self.tail + join_error)

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
        # Largest change of the force due to the cut-off, as a fraction of the friction limit
        tail = min(1e-3 * tolerance, 1e-6)
    if merge is None:
        # Largest merge width in bond lengths
        merge = min(0.04, sqrt(0.09 * tolerance / JOIN_ERROR))
    if engine == "auto":
        engine = "merged" if merge > 0 else "truncated"
    tail = 0.0 if engine == "direct" else tail
    merge = merge if engine == "merged" else 0.0

    # A stroke adds a strip, or one per step where bonds grow.
    reach = min(cutoff_age(law.order, tail) if tail > 0 else inf, find_max_age(law.order))
    strips = reach / stroke * (steps if law.has_growth else 1.0)
    strips = min(strips, MAX_STRIPS) if merge else strips
    return EngineChoice(engine, tail, merge, tail + JOIN_ERROR * merge**2, strips)
