"""Which engine sums eq. 2.17 and with which settings, from the tolerance and the cost.

There are two: the recursion, exact for stretch with p = 1 alone, and the list of strips (`list_kernels`) for every law.
The list has two settings, the tail that its cut-off may lose and the width up to which it merges strips; `direct`,
`truncated` and `merged` name which of them are used. What is cheapest depends on the law, the strokes and the steps.
"""

from dataclasses import dataclass
from math import ceil, inf, sqrt

from ... import cost_model
from .list_numbers import AGED, MOMENTS, POWER, SHARES, cutoff, form_of
from .parameters import Bonds

# (drops old strips, joins them)
LISTS = {
    "direct": (False, False),
    "truncated": (True, False),
    "merged": (True, True),
}
ENGINES = (*LISTS, "recursion")
# bounds of the error over merge width squared (test_merge_bounds): lengths that stay, stretch
# with growth, the print with growth, the print of order < 1
MERGING = (0.25, 1.0, 6.0, 1.0)
YOUNG = 3e-4  # error of merging growing bonds of order < 0 besides, at any width: of bonds that form at a reversal
# over the list in a step of the rig: three for each of the two or three trial increments
PASSES = 9


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

    def reach(self, order: float) -> float:
        """Age [bond lengths] from which bonds of this order are left out; inf where none is."""
        return cutoff(order, self.tail) if self.tail > 0 else inf

    def said(self) -> str:
        """One line for a plan: engine, length of the list, cost per step, settings and bound of the error."""
        if self.engine == "recursion":
            return f"recursion, exact, computing time {1e6 * self.seconds:.2g} us per time step"
        parts = [
            f"{self.engine}: about {self.strips:.0f} list entries, computing time {1e6 * self.seconds:.2g} us per "
            "time step"
        ]
        if self.tail > 0:
            parts.append(f"tail {self.tail:.1g}")
        if self.merge > 0:
            parts.append(f"merge width {self.merge:.2g} bond lengths")
        return ", ".join([*parts, f"error of the sum {self.error:.1g} of the friction limit"])


def impossible(engine: str, reading: str, order: float) -> str:
    """Why an engine cannot sum such a law and what can; empty where it can."""
    if engine == "recursion" and (reading != "stretch" or order != 1):
        return 'works only with reading = "stretch" and order = 1; use "auto" or "merged"'
    return ""


def choose(
    law: Bonds,
    tolerance: float,
    stroke: float,
    steps: float,
    engine: str = "auto",
    tail: float | None = None,
    merge: float | None = None,
) -> Choice:
    """The cheapest engine whose error bound meets a tenth of the tolerance.

    stroke: path between reversals [eps_0]; steps: steps per stroke; engine, tail, merge: pinned unless "auto", None.
    ValueError for an engine that cannot sum the law.
    """
    reason = impossible(engine, law.reading, law.order)
    if reason:
        raise ValueError(f"{engine} {reason}")
    if engine == "recursion" or (engine == "auto" and form_of(law) == MOMENTS):
        return Choice("recursion", 0.0, 0.0, 0.0, 0.0, cost_model.RECURSION_STEP_SECONDS)
    cut = tail if tail is not None else min(1e-3 * tolerance, 1e-6)
    width = merge if merge is not None else min(0.02, sqrt(0.09 * tolerance / _merging(law)))
    found = {
        name: _priced(law, name, cut * drops, width * joins, stroke, steps)
        for name, (drops, joins) in LISTS.items()
    }
    if engine != "auto":
        return found[engine]
    if merge is not None:
        return found["merged" if merge > 0 else "truncated"]
    fit = [
        choice for choice in found.values() if choice.tail > 0 and choice.error <= 0.1 * tolerance
    ]
    return min(fit or [found["truncated"]], key=lambda choice: choice.seconds)


def _merging(law: Bonds) -> float:
    """Bound of the error of merging over the square of its width."""
    form = form_of(law)
    return MERGING[
        2 if form == AGED else 1 if law.grows else 3 if form == SHARES and law.order < 1 else 0
    ]


def _priced(
    law: Bonds, name: str, tail: float, merge: float, stroke: float, steps: float
) -> Choice:
    """The list with these settings, 0 where one is not used."""
    form, reach = form_of(law), cutoff(law.order, tail) if tail > 0 else 745.0
    each = stroke / max(steps, 1)
    pieces = max(1.0, each / 0.25)
    strips = min(reach, 745.0) / max(each, 1e-12) * pieces
    if form == SHARES:
        strips = reach / stroke + 2
    elif form == AGED:
        strips *= 2
    if merge > 0:
        strips = min(
            strips, 5 / merge + 20 + 2 * min(reach / stroke, 50) + (180 if form == AGED else 0)
        )
    cost = cost_model.STRIP_SECONDS[int(form)]
    if form in (POWER, SHARES) and law.order not in (0, 1, 2):
        cost = cost_model.ANY_ORDER_STRIP_SECONDS
    panels = 1 if each <= 1 else 2 + ceil(each).bit_length()
    seconds = cost_model.LIST_STEP_SECONDS + PASSES * (cost_model.PASS_SECONDS + cost * strips) * (
        1 if each <= 0.1 else 5 / 2 * panels
    )
    error = tail
    if merge > 0 and form != MOMENTS:
        error += _merging(law) * merge**2 + (YOUNG if form == AGED and law.order < 0 else 0.0)
    return Choice(name, tail, merge, error, strips, seconds)
