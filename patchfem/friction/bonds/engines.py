"""Which engine sums the bonds of a shared list, from the tolerance and the cost: eq. 2.17 has more than one exact or
bounded way to be summed, and which is cheapest depends on the law, the strokes and the steps."""

from dataclasses import dataclass
from math import ceil, sqrt

from .bond_list import AGED, MOMENTS, POWER, SHARES, form_of
from .parameters import Bonds

ENGINES = ("direct", "truncated", "merged", "recursion")
MERGING = (0.25, 2.5, 1.0)  # largest measured error over merge width squared: order >= 1, growing bonds, order < 1
YOUNG = 3e-4  # error of merging growing bonds of order < 0 besides, at any width: of bonds that form at a reversal
STRIP = {MOMENTS: 3e-10, POWER: 3e-9, SHARES: 2e-9, AGED: 3e-9}  # seconds per strip and pass, measured on one core
SHARES_ANY = 4e-8  # the same for the printed law at constant length with an order other than 0, 1, 2
PASS, STEP = 1.5e-7, 5e-7  # seconds per pass over the list and per step besides
PASSES = 9  # over the list in a step of the rig: three for each of the two or three trial increments
RECURSION = 3e-8  # seconds per step


@dataclass(frozen=True, slots=True)
class Choice:
    """An engine and its parameters. tail: what the cut-off may lose, merge: width [eps_0], error: bound of all over the
    friction limit, strips: expected length of the list, seconds: per step."""

    engine: str
    tail: float
    merge: float
    error: float
    strips: float
    seconds: float

    def said(self) -> str:
        """One line for a plan."""
        parts = [f"{self.engine}: about {self.strips:.0f} strips of bonds, {1e6 * self.seconds:.2g} us per step"]
        if self.engine in ("truncated", "merged"):
            parts.append(f"tail {self.tail:.1g}")
        if self.engine == "merged":
            parts.append(f"merge width {self.merge:.2g} bond lengths")
        return ", ".join([*parts, f"error of the sum {self.error:.1g} of the friction limit"])


def impossible(engine: str, reading: str, order: float) -> str:
    """Why an engine cannot sum such a law and what can; empty where it can."""
    if engine == "recursion" and (reading != "stretch" or order != 1):
        return "sums reading = \"stretch\" with order = 1 alone; use \"auto\" or \"merged\""
    return ""


def choose(law: Bonds, tolerance: float, stroke: float, steps: float, engine: str = "auto", tail: float | None = None,
           merge: float | None = None) -> Choice:
    """The cheapest engine whose error bound meets a tenth of the tolerance.

    stroke: path between reversals [eps_0]; steps: steps per stroke; engine, tail, merge: pinned unless "auto", None.
    ValueError for an engine that cannot sum the law.
    """
    reason = impossible(engine, law.reading, law.order)
    if reason:
        raise ValueError(f"{engine} {reason}")
    if engine == "recursion" or (engine == "auto" and form_of(law) == MOMENTS):
        return Choice("recursion", 0.0, 0.0, 0.0, 0.0, RECURSION)
    cut = tail if tail is not None else min(1e-3 * tolerance, 1e-6)
    width = merge if merge is not None else min(0.02, sqrt(0.09 * tolerance / _merging(law)))
    found = [_priced(law, name, cut, width, stroke, steps) for name in ("truncated", "merged")]
    if engine == "direct":
        return _priced(law, "direct", 0.0, 0.0, stroke, steps)
    if engine != "auto":
        return found[0] if engine == "truncated" else found[1]
    if merge is not None:
        return found[1] if merge > 0 else found[0]
    fit = [choice for choice in found if choice.error <= 0.1 * tolerance] or found[:1]
    return min(fit, key=lambda choice: choice.seconds)


def _merging(law) -> float:
    return MERGING[1 if form_of(law) == AGED else 2 if law.order < 1 else 0]


def _priced(law, name, tail, merge, stroke, steps) -> Choice:
    from .quadrature import cutoff

    form, reach = form_of(law), cutoff(law.order, tail) if tail > 0 else 745.0
    each = stroke / max(steps, 1)
    pieces = max(1.0, each / 0.25)
    strips = min(reach, 745.0) / max(each, 1e-12) * pieces
    if form == SHARES:
        strips = reach / stroke + 2
    elif form == AGED:
        strips *= 2
    if name == "merged" and merge > 0:
        strips = min(strips, 5 / merge + 20 + 2 * min(reach / stroke, 50) + (180 if form == AGED else 0))
    cost = STRIP[form]
    if form == SHARES and law.order not in (0, 1, 2):
        cost = SHARES_ANY
    panels = 1 if each <= 1 else 2 + ceil(each).bit_length()
    seconds = STEP + PASSES * (PASS + cost * strips) * (1 if each <= 0.1 else 5 / 2 * panels)
    error = tail
    if name == "merged" and merge > 0 and form != MOMENTS:
        error += _merging(law) * merge**2 + (YOUNG if form == AGED and law.order < 0 else 0.0)
    return Choice(name, tail, merge if name == "merged" else 0.0, error, strips, seconds)
