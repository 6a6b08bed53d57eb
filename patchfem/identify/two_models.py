"""Least squares of a dear model by way of a cheap one that is made to touch it.

The cheap model times the share of the dear one in it at a point has the value of the dear one there, but other slopes:
a search by it ends where what is left over is orthogonal to the wrong slopes, which is beside the least squares unless
nothing is left over. With the difference of the slopes besides, it has both, and where its search moves no more is the
least squares of the dear model (manifold mapping: Echeverria and Hemker 2005).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core import PatchfemError
from .least_squares import descend, descents, starting_points
from .space import Counted, Space

# of a search, until the dear model is the cheap one to so much of the residual
ROUNDS, SAME = (
    4,
    1e-3,
)
MANY = 24  # values for each coordinate at which the cheap model is computed to choose the starts
# ends of the cheap search that go on, at most; their distance in the cube, at
VALLEYS, APART, WORSE = (
    3,
    0.03,
    10.0,
)
# least; their sum of squares over the least, at most
RIVAL = 1.5  # of the least sum of squares of the dear model: another point below it gets the slopes of this model, too
STEP = 1e-4  # of the cube, in slopes of the dear model
STEADY = 1e-4  # of a sum of squares, a change that ends the search


@dataclass(frozen=True, eq=False, slots=True)
class TwoModels:
    """cheap and dear: values (n,) -> an array; off: such an array -> residual (r,); box: the Space of the values.

    A PatchfemError of either is a failure at these values.
    """

    cheap: Callable
    dear: Callable
    off: Callable
    box: Space

    def searched(self, own, starts: int) -> tuple:
        """(model(values) or None, values (n,)) where the sum of squares of the dear model is the least found, from
        values own (n,) and others.

        The model is the cheap one with the value and the slopes of the dear one there; None where the search does not
        settle. starts: of the search by the cheap model. PatchfemError where the dear model fails at all its ends,
        NotConverged where the cheap one fails everywhere.
        """
        counted, n = Counted(lambda values: self.off(self.cheap(values)), self.box), len(own)
        ends = descents(counted, starting_points(counted, self.box.unit(own), starts, MANY * n))
        first, reasons = [], []
        for u in _valleys(ends):
            try:
                first.append(self._shared(u))
            except PatchfemError as reason:
                reasons.append(reason)
        if not first:
            raise reasons[0]
        rivals = [one for one in first if one[0] <= RIVAL * min(squares for squares, _ in first)]
        _, u, model = min((self._sloped(*one) for one in rivals), key=lambda one: one[0])
        return model, self.box.values(u)

    def touching(self, u, told, rest=None) -> Callable:
        """The cheap model times what makes it `told` at u (n,), plus differences of slopes (..., n) over the cube."""
        here = self.cheap(self.box.values(u))
        share = np.divide(told, here, out=np.ones_like(told), where=here != 0)

        def model(values) -> np.ndarray:
            out = told + share * (self.cheap(values) - here)
            return out if rest is None else out + rest @ (self.box.unit(values) - u)

        return model

    def _shared(self, u) -> tuple:
        """(sum of squares of the dear model, point (n,)), the least seen where the cheap model that has its value at
        one end of the search is searched for the next one."""
        told = self.dear(self.box.values(u))
        least, best = self._squares(told), u
        for _ in range(ROUNDS):
            model = self.touching(u, told)
            u = self._descended(model, u)
            try:
                told = self.dear(self.box.values(u))
            except PatchfemError:
                break
            if (squares := self._squares(told)) < least:
                least, best = squares, u
            if np.abs(self.off(told) - self.off(model(self.box.values(u)))).max() < SAME:
                break
        return least, best

    def _sloped(self, squares: float, u) -> tuple:
        """(sum of squares of the dear model, point (n,), model or None) from such a point on with the slopes of the
        dear model; None where the sum of squares does not settle."""
        for _ in range(ROUNDS):
            try:
                model = self._tangent(u)
                new = self._descended(model, u)
                fresh = self._squares(self.dear(self.box.values(new)))
            except PatchfemError:
                break
            if fresh > squares * (1 - STEADY):
                return squares, u, model if fresh < squares * (1 + STEADY) else None
            squares, u = fresh, new
        return squares, u, None

    def _tangent(self, u) -> Callable:
        """The cheap model with the value and the slopes of the dear one at u (n,), by one-sided differences."""
        told = self.dear(self.box.values(u))
        plain, rest = self.touching(u, told), []
        for i in range(u.size):
            beside = u.copy()
            beside[i] += -STEP if u[i] > 0.5 else STEP
            values = self.box.values(beside)
            rest.append((self.dear(values) - plain(values)) / (beside[i] - u[i]))
        return self.touching(u, told, np.stack(rest, axis=-1))

    def _descended(self, model, u) -> np.ndarray:
        """Point (n,) of the cube where the descent by a model from u (n,) ends."""
        return descend(Counted(lambda values: self.off(model(values)), self.box), u, range(u.size))[
            0
        ]

    def _squares(self, told) -> float:
        return float(np.square(self.off(told)).sum())


def _valleys(ends: list) -> list:
    """Points (n,) of the cube where some Descents ended, the best first, that lie apart from each other."""
    ends = sorted((one for one in ends if np.isfinite(one.cost)), key=lambda one: one.cost)
    out = []
    for one in ends:
        if one.cost <= WORSE * ends[0].cost and all(
            np.abs(one.u - other).max() >= APART for other in out
        ):
            out.append(one.u)
    return out[:VALLEYS]
