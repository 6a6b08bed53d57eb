"""The box of a search as the unit cube, and the counted residual over it; a failed evaluation is a value."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core import Missing, PatchfemError

STEP = 1e-5  # of the range, in difference quotients


@dataclass(frozen=True, eq=False, slots=True)
class Space:
    """A box of values as the unit cube u in [0, 1]^n: bounds low < high, and whether each is searched in logarithms,
    all (n,)."""

    low: np.ndarray
    high: np.ndarray
    log: np.ndarray

    def values(self, u) -> np.ndarray:
        """Values (n,) at a point u (n,) of the unit cube; the ends of the cube are the bounds to the last bit."""
        u = np.asarray(u, float)
        inside = np.empty(u.size)
        for i, part in enumerate(u):
            a, b = self.low[i], self.high[i]
            inside[i] = a * (b / a) ** part if self.log[i] else a + (b - a) * part
        return np.where(u <= 0, self.low, np.where(u >= 1, self.high, inside))

    def unit(self, values) -> np.ndarray:
        """Point u (n,) of the unit cube of values (n,), held inside the cube."""
        out = np.empty(len(values))
        for i, value in enumerate(values):
            a, b = self.low[i], self.high[i]
            out[i] = (
                np.log(max(value, a) / a) / np.log(b / a) if self.log[i] else (value - a) / (b - a)
            )
        return np.clip(out, 0.0, 1.0)

    def slope(self, u) -> np.ndarray:
        """Slopes d value/d u (n,) at a point u (n,) of the unit cube."""
        values = self.values(u)
        return np.array(
            [
                v * np.log(b / a) if own else b - a
                for v, a, b, own in zip(values, self.low, self.high, self.log)
            ]
        )


def space(low, high, log=None) -> Space:
    """The Space of bounds low < high, (n,) each.

    log: (n,) flags; None: logarithms where 0 < low and high > 10 low. ValueError for bounds that are not finite or not
    in order, and for logarithms of a bound that is not positive.
    """
    low, high = np.array(low, float), np.array(high, float)
    if low.ndim != 1 or low.shape != high.shape or not low.size:
        raise ValueError(
            f"'low' and 'high' must be one-dimensional and of the same length, got shapes {low.shape} and "
            f"{high.shape}"
        )
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
        raise ValueError("bounds must be finite with low < high")
    wide = (low > 0) & (high > 10 * low)
    log = wide if log is None else np.array(log, bool)
    if log.shape != low.shape or (log & (low <= 0)).any():
        raise ValueError(
            "'log' needs one flag per parameter, and 'low' must be > 0 wherever the flag is set"
        )
    return Space(low, high, log)


class Counted:
    """A residual(values (n,)) -> (r,) over the cube that counts evaluations and failures and remembers the last one.

    A failure is a PatchfemError (but not Missing, which is passed on), an arithmetic error, or a residual that is not
    finite; `reason` keeps the first. quick: for a dear residual; differences are one-sided, of first order, and ends of
    profiles are to 1 %.
    """

    def __init__(self, residual: Callable, box: Space, quick: bool = False):
        self.residual, self.space, self.quick = residual, box, quick
        self.evaluations, self.failures, self.reason = 0, 0, ""
        self.largest, self.rows = 0.0, 0
        self._last = (None, None)

    def __call__(self, u) -> np.ndarray | None:
        """Residual (r,) at u (n,), None where it failed."""
        if self._last[0] is not None and np.array_equal(self._last[0], u):
            return self._last[1]
        out = self._evaluate(u)
        self._last = (np.array(u), out)
        return out

    def _evaluate(self, u):
        self.evaluations += 1
        try:
            out = np.asarray(self.residual(self.space.values(u)), float)
            reason = "" if np.isfinite(out).all() else "the residual is not finite"
        except Missing:
            raise
        except (PatchfemError, ArithmeticError, np.linalg.LinAlgError) as error:
            reason = str(error)
        if reason:
            self.failures += 1
            self.reason = self.reason or reason
            return None
        self.rows = out.size
        self.largest = max(self.largest, float(np.abs(out).max(initial=0.0)))
        return out

    def penalised(self, u) -> np.ndarray:
        """Residual (r,) at u (n,); where the evaluation failed, a row a thousand times the largest value yet seen."""
        out = self(u)
        return np.full(self.rows, 1e3 * max(self.largest, 1e-300)) if out is None else out

    def jacobian(self, u, free) -> np.ndarray:
        """Jacobian (r, f) by central differences along the coordinates `free` (f,); one-sided at a bound and beside a
        failure."""
        here, columns = self(u), []
        for i in free:
            points = {}
            for k in (1, -1, 2, -2):
                if self.quick and points:
                    break
                step = np.array(u, float)
                step[i] += k * STEP
                if 0 <= step[i] <= 1 and (abs(k) == 1 or 1 not in points or -1 not in points):
                    found = self(step)
                    if found is not None:
                        points[k] = found
            columns.append(_quotient(here, points))
        self._last = (np.array(u), here)
        return np.column_stack(columns) if columns else np.zeros((self.rows, 0))


def _quotient(here, points: dict) -> np.ndarray:
    if 1 in points and -1 in points:
        return (points[1] - points[-1]) / (2 * STEP)
    for k in (1, -1):
        if k in points and 2 * k in points:
            return k * (4 * points[k] - 3 * here - points[2 * k]) / (2 * STEP)
        if k in points:
            return k * (points[k] - here) / STEP
    return np.zeros_like(here)


def spread_points(count: int, n: int) -> np.ndarray:
    """Points (count, n) of the unit cube that fill it evenly and are the same every time.

    An additive recurrence on the root of x^(n + 1) = x + 1 (Roberts 2018).
    """
    root = 2.0
    for _ in range(60):
        root = (1 + root) ** (1 / (n + 1))
    return (0.5 + np.outer(np.arange(1, count + 1), root ** -np.arange(1.0, n + 1))) % 1.0
