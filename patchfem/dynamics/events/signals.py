"""Motion between events as series: polynomials on [0, 1], their Bernstein form and the first root that it isolates.

A piece of motion lasts at most 2/rate, so 27 terms of the exponential of the system are exact to round-off, whatever
its rates are: rigid, resonant without damping, overdamped, equal or defective. All coefficients of the Bernstein form
above zero prove that there is no root; one change of their sign proves that there is one (Descartes).
"""

from dataclasses import dataclass
from math import comb, inf

import numpy as np

TERMS = 27
REACH = 2.0  # longest piece times the fastest rate
ORDER = np.arange(TERMS)
ONE = np.ones(TERMS)
BERNSTEIN = np.array([[comb(j, k) / comb(TERMS - 1, k) for k in range(TERMS)] for j in range(TERMS)])
_LEFT = np.array([[comb(j, k) / 2.0**j for k in range(TERMS)] for j in range(TERMS)])
_RIGHT = _LEFT[::-1, ::-1].copy()
_SMALLEST = 2.0**-50
EPS = 2.0**-52


def first_root(coefs, noise: float = 0.0) -> float:
    """First u in [0, 1] at which sum coefs[k] u^k, positive just after 0, is no longer so; inf if none.

    coefs (TERMS,). A dip that does not go below -noise is passed over.
    """
    todo = [(BERNSTEIN @ coefs, 0.0, 1.0)]
    while todo:
        b, low, width = todo.pop()
        if b.min() >= -noise:
            continue
        below = b < 0
        if b[0] > 0 and np.count_nonzero(below[1:] != below[:-1]) == 1:
            k = int(below.argmax())
            guess = (k - 1 + float(b[k - 1] / (b[k - 1] - b[k]))) / (TERMS - 1)
            return polish(coefs, low, low + width, low + width * guess)
        if width <= _SMALLEST:
            return low
        todo += [(_RIGHT @ b, low + width / 2, width / 2), (_LEFT @ b, low, width / 2)]
    return inf


def polish(coefs, low: float, high: float, x: float) -> float:
    """The one root in [low, high] of a polynomial that falls there from above zero to below, by guarded Newton from x.
    """
    falling = coefs.tolist()[::-1]
    for _ in range(100):
        value = slope = 0.0
        for c in falling:
            slope = slope * x + value
            value = value * x + c
        if value > 0:
            low = x
        elif value < 0:
            high = x
        else:
            return x
        new = x - value / slope if slope < 0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - x) <= 2 * EPS * x:
            return new
        x = new
    return x


def derivative(coefs):
    """Derivatives over u of polynomials (..., TERMS, n) in u, along the axis before the last."""
    out = np.zeros_like(coefs)
    out[..., :-1, :] = coefs[..., 1:, :] * ORDER[1:, None]
    return out


@dataclass(frozen=True, eq=False, slots=True)
class Signal:
    """A scalar over consecutive pieces of time, a series in each.

    times: (k + 1,) [s] of their borders; unit: (k,) [s]; coefs: (k, TERMS) in t/unit, t from the piece's start.
    """

    times: np.ndarray
    unit: np.ndarray
    coefs: np.ndarray

    def many(self, t):
        """Values (j,) at times t (j,) [s] since the first border."""
        t = np.asarray(t, float)
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.unit) - 1)
        u, out = (t - self.times[k]) / self.unit[k], np.zeros(t.shape)
        for c in self.coefs[k].T[::-1]:
            out = out * u + c
        return out

    def __call__(self, t: float) -> float:
        return float(self.many(np.array([t]))[0])

    def rate(self) -> "Signal":
        """The time derivative as a Signal."""
        return Signal(self.times, self.unit, derivative(self.coefs[..., None])[..., 0] / self.unit[:, None])


def combine(signals, factors) -> Signal:
    """Sum of signals over the same pieces, weighted with `factors`."""
    return Signal(signals[0].times, signals[0].unit, sum(f * s.coefs for s, f in zip(signals, factors)))
