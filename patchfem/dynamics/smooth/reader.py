"""What the last cycles of a motion show, read off its steps: each is a polynomial through its values at some places.

The places are Chebyshev's, `arrays.ENDS`, so that a number which is smooth inside a step stands in its values to as
many digits as the step itself. Peaks are the extremes of the polynomials, integrals those of the polynomials.
Source: Trefethen, Approximation Theory and Approximation Practice (2013), ch. 5 and 19.
"""

from functools import cached_property

import numpy as np
from numpy.polynomial import chebyshev

from ...core import IntegratedMeasures, InterfaceLoop
from ...structure.drive_sizes import is_sinusoidal
from .arrays import ENDS, NODES

# places of a step between which slip may begin or end once: close to its ends, as a stick may last no longer
FINER = np.sort(np.append((1 - np.cos(np.pi * np.arange(25) / 24)) / 2, [1e-3, 1 - 1e-3]))
# among which its peaks are looked for: three make a parabola, to 1e-11 of its rise
FINEST = np.linspace(0.0, 1.0, 257)
BEST = 6  # steps with the largest values at FINER, which are looked at closely
RISES = 0.5  # of what a number changes by in a step, by which it may rise above its places
GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(12)
GAUSS = (1 + GAUSS) / 2
WEIGHTS = WEIGHTS / 2
HALVINGS = 30  # of the stretch of a step in which slip begins or ends
SHARE = 0.5  # irreversible part of the slide from which an interface slips, as `response.measures` has it
ROUND = 1e-13  # of the largest slide: round-off of what it changes by in a step, off its polynomial
STILL = 1e-7  # of the largest speed in a step, below which a slide turns: there slip and slide stand still together


def onto(places) -> np.ndarray:
    """Matrix (p, NODES) from the values of a polynomial at ENDS to those at other shares of the step (p,)."""
    return chebyshev.chebvander(2 * np.asarray(places) - 1, NODES - 1) @ TERMS


def along(terms, share):
    """Values (k,) of k polynomials with terms (k, NODES) in the powers of 2 share - 1 at shares (k,) of their steps."""
    x = 2 * share - 1
    out = terms[:, -1]
    for power in range(NODES - 2, -1, -1):
        out = out * x + terms[:, power]
    return out


def places_of(values, matrix) -> np.ndarray:
    """Values (k, p) of k polynomials by a matrix (p, NODES); so many rows are slower by threads of a matrix product."""
    return np.einsum("kj,pj->kp", values, matrix)


# Chebyshev coefficients of values at ENDS
TERMS = np.linalg.inv(chebyshev.chebvander(2 * ENDS - 1, NODES - 1))
# values to slopes over a step
SLOPES = chebyshev.chebvander(2 * ENDS - 1, NODES - 2) @ (2 * chebyshev.chebder(TERMS))
# values to terms in powers of 2 share - 1
POWERS = np.linalg.inv(np.vander(2 * ENDS - 1, NODES, increasing=True))
CLOSE = onto(FINER)
CLOSEST = onto(FINEST)
INSIDE = onto(GAUSS)


class Parts:
    """The last cycles of a motion as steps: `response`, a Response of all its places one after the other."""

    def __init__(self, response, period: float):
        self.period = period
        self.response = response
        self.time = response.time.reshape(-1, NODES)
        self.begin = self.time[:, 0]
        self.length = np.diff(self.time[:, [0, -1]])[:, 0]

    def of(self, name: str) -> np.ndarray:
        """A number of the response at the places of every step (k, NODES)."""
        return getattr(self.response, name).reshape(-1, NODES)

    def largest(self, values) -> tuple:
        """(largest of values (k, NODES) between the places, what the last terms of its polynomial leave open)."""
        top = values.max(axis=1)
        least = values.min(axis=1)
        steps = np.flatnonzero(top + RISES * (top - least) >= top.max())
        if steps.size > BEST:
            steps = steps[np.argsort(places_of(values[steps], CLOSE).max(axis=1))[-BEST:]]
        seen = places_of(values[steps], CLOSEST)
        every = np.arange(len(steps))
        at = np.clip(np.argmax(seen, axis=1), 1, FINEST.size - 2)
        left, mid, right = (seen[every, at + side] for side in (-1, 0, 1))
        bend = np.minimum(left - 2 * mid + right, 0.0)
        rise = np.where(
            np.abs(right - left) < -2 * bend,
            -((right - left) ** 2) / (8 * np.minimum(bend, -1e-300)),
            0.0,
        )
        found = np.maximum(mid + rise, seen.max(axis=1))
        best = int(np.argmax(found))
        return float(found[best]), float(np.abs(TERMS[-2:] @ values[steps[best]]).sum())

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights (k, 12) [s] of the places of Gauss's rule."""
        return self.length[:, None] * WEIGHTS

    @cached_property
    def turn(self) -> np.ndarray:
        """exp(-i omega t) at these places."""
        return np.exp(
            -2j * np.pi / self.period * (self.begin[:, None] + self.length[:, None] * GAUSS)
        )

    def harmonic(self, name: str, number: int = 1) -> complex:
        """Fourier coefficient 2/T int x exp(-i n omega t) dt of a number over all steps."""
        values = self.weights * places_of(self.of(name), INSIDE)
        return complex(2 / self.length.sum() * np.sum(values * self.turn**number))

    def mean(self, name: str, begin: float, end: float) -> float:
        """Time mean of a number from `begin` to `end` [s]."""
        length = np.maximum(self.length, 1e-300)  # of a step at an event, 0
        low, high = (np.clip((edge - self.begin) / length, 0.0, 1.0) for edge in (begin, end))
        part = np.flatnonzero(high > low)
        total = 0.0
        cut = part[(low[part] > 0) | (high[part] < 1)]
        whole = np.setdiff1d(part, cut)
        total = float((self.weights[whole] * places_of(self.of(name)[whole], INSIDE)).sum())
        for k in cut:
            size = high[k] - low[k]
            total += (
                size
                * self.length[k]
                * float(WEIGHTS @ (onto(low[k] + size * GAUSS) @ self.of(name)[k]))
            )
        return total / (end - begin)

    def drift(self) -> float | None:
        """Time mean of the slide in the last cycle less that in the first, per cycle between them [m]."""
        begin = self.time[0, 0]
        end = self.time[-1, -1]
        cycles = (end - begin) / self.period
        if cycles < 1.5:
            return None
        first = self.mean("slide", begin, begin + self.period)
        last = self.mean("slide", end - self.period, end)
        return (last - first) / (cycles - 1)

    def holds(self) -> tuple:
        """(time [s] in which less than SHARE of the slide is irreversible, times [s] at which more of it begins to be).

        Where the slide turns neither moves, and what is computed of them is round-off: there the place beside it in the
        step decides. A step that lies in such a place as a whole shows nothing.
        """
        slip, slide = (places_of(self.of(name), SLOPES) for name in ("slip", "slide"))
        moves, slides = (np.abs(places_of(rates, CLOSE)) for rates in (slip, slide))
        rest = STILL * slides.max(axis=1, keepdims=True) + ROUND * np.abs(self.response.slide).max(
            initial=0.0
        )
        still = slides <= rest
        shows = ~still.all(axis=1)
        still, slip, slide, begin, length = (
            one[shows] for one in (still, slip, slide, self.begin, self.length)
        )
        last_moving = np.maximum.accumulate(np.where(still, 0, np.arange(FINER.size)), axis=1)
        beside = np.maximum(last_moving, np.argmin(still, axis=1)[:, None])
        seen = np.take_along_axis((moves - SHARE * slides)[shows], beside, axis=1)
        before = seen[:, :-1]
        after = seen[:, 1:]
        turns = (before < 0) != (after < 0)
        steps, at = np.nonzero(turns)
        low = FINER[at]
        high = FINER[at + 1]
        below = before[steps, at] < 0
        one, other = (places_of(rates[steps], POWERS) for rates in (slip, slide))
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            same = (np.abs(along(one, middle)) < SHARE * np.abs(along(other, middle))) == below
            low = np.where(same, middle, low)
            high = np.where(same, high, middle)
        part = (before < 0) * np.diff(FINER) * ~turns
        part[steps, at] = np.where(below, low - FINER[at], FINER[at + 1] - low)
        times = begin[steps] + low * length[steps]
        between = np.flatnonzero((seen[:-1, -1] < 0) & (seen[1:, 0] >= 0))
        return float((part.sum(axis=1) * length).sum()), np.append(times[below], begin[between + 1])


def integrated(response, drive, ends) -> tuple:
    """(Integrated of the steps whose places are those of a Response, by measure what the last terms of the polynomials
    make of a peak).

    ends (2, 4): time [s], output [m], its rate [m/s] and friction work [J] where they begin and end.
    """
    period = drive.period
    parts = Parts(response, period)
    before, after = ends
    peaks = {
        name: [parts.largest(way * parts.of(name)) for way in (1, -1)]
        for name in ("acceleration", "force", "slip", "output")
    }
    gain, unsure = max(peaks["acceleration"])
    pull, loose = max(peaks["force"])
    slip, swing = ((up + down) / 2 for (up, _), (down, _) in (peaks["slip"], peaks["output"]))
    held, starts = parts.holds()
    loop = InterfaceLoop(
        parts.harmonic("slide"),
        parts.harmonic("force"),
        after[3] - before[3],
        2 * slip,
        min(held, parts.time[-1, -1] - parts.time[0, 0]),
        pull,
    )
    phases = 2 * np.pi * starts / period % np.pi
    return IntegratedMeasures(
        swing, gain, parts.drift(), _waves(parts, drive, ends), (loop,), phases
    ), {
        "absolute_acceleration_peak": unsure,
        "friction_force_peak": loose,
    }


def _waves(parts: Parts, drive, ends) -> tuple | None:
    """Sizes [m s-2] of the first and the third harmonic of the absolute acceleration at the output under a sine.

    That of the output relative to the base is that of the motion by parts.
    """
    if not is_sinusoidal(drive):
        return None
    before, after = ends
    gains = []
    for n in (1, 3):
        turn = 2j * np.pi * n / drive.period
        edge = [(one[2] + turn * one[1]) * np.exp(-turn * one[0]) for one in (before, after)]
        gains.append(
            2 / (after[0] - before[0]) * (edge[1] - edge[0]) + turn**2 * parts.harmonic("output", n)
        )
    last = drive.segments[-1]
    base = (
        -1j * last.amplitude * np.exp(1j * (last.phase - last.omega * last.start))
        if drive.moving
        else 0.0
    )
    return abs(gains[0] + base), abs(gains[1])
