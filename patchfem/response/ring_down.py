"""Frequency and damping of a motion that dies down, over its amplitude: from turn to turn.

Half a swing S_k lies between two turns. Two that follow each other, at the amplitude (S_k S_{k+1})^(1/2)/2, tell the
logarithmic decrement of half a cycle, delta = ln(S_k/S_{k+1}) = pi zeta/(1 - zeta^2)^(1/2), and the period from the
first turn to the third. Of a viscous decay this is exact, of any other the mean over a cycle.
"""

from typing import NamedTuple

import numpy as np

REST = 1e-12  # of the largest speed, one below which a sample is a turn itself
FAINT = 1e-9  # of the largest swing, one below which is round-off
FEWEST = 4  # turns that a decay is read from


class RingDown(NamedTuple):
    """Of each pair of half swings, largest first: amplitude (k,) [m], frequency (k,) [Hz] as it is seen, damping ratio
    (k,) [1]; whether it goes on to the last turn."""

    amplitude: np.ndarray
    frequency: np.ndarray
    damping: np.ndarray
    whole: bool = False

    def at(self, amplitudes) -> tuple:
        """(frequency, damping) at amplitudes (m,) [m], straight in their logarithms; NaN outside those of the decay."""
        return self._between(amplitudes, slice(None), np.nan)

    def bend(self, amplitudes) -> tuple:
        """What (frequency, damping) at amplitudes (m,) [m] change by where every second pair of swings is left out."""
        whole = np.array(self.at(amplitudes))
        if self.amplitude.size < FEWEST:
            return tuple(np.abs(whole))
        return tuple(np.max([np.abs(np.array(self._between(amplitudes, part, None)) - whole)
                             for part in (slice(0, None, 2), slice(1, None, 2))], axis=0))

    def _between(self, amplitudes, part: slice, outside) -> tuple:
        if not self.amplitude.size:
            return tuple(np.full((2, len(amplitudes)), np.nan))
        order = np.argsort(self.amplitude[part])
        x, inside = np.log(self.amplitude[part][order]), np.log(amplitudes)
        return tuple(np.interp(inside, x, one[part][order], outside, outside) for one in (self.frequency, self.damping))


def turns(time, place, speed) -> tuple:
    """(times (k,) [s], places (k,) [m]) where a motion turns, by the cubic between the samples on both sides.

    time, place [m], speed [m/s]: (n,) of samples, however far apart, where each turn lies between two or at one.
    """
    speed = np.where(np.abs(speed) <= REST * np.abs(speed).max(initial=0.0), 0.0, speed)
    at = [(t, y) for t, y, v in zip(time, place, speed) if v == 0]
    for k in np.flatnonzero(speed[:-1] * speed[1:] < 0):
        span, part = time[k + 1] - time[k], slice(k, k + 2)
        share = _zero(place[part], speed[part] * span)
        at.append((time[k] + share * span, _cubic(place[part], speed[part] * span, share)))
    at.sort()
    kept = [one for k, one in enumerate(at) if k == 0 or one[0] > at[k - 1][0]]
    return tuple(np.array(part) for part in zip(*kept)) if kept else (np.empty(0), np.empty(0))


def ring_down(times, places, every: int = 1) -> RingDown:
    """Frequency and damping over the amplitude from the turns of a decay, (k,) [s] and (k,) [m].

    every: of so many half swings each, an odd number; a decay that is read anew from more of them tells how much it
    bends. What follows a swing that is no smaller than the one before is left out, as another motion rings there, and
    what is below round-off of the first swing.
    """
    swing = np.abs(np.diff(places[::every]))
    whole = np.flatnonzero((swing[1:] >= swing[:-1]) | (swing[1:] <= FAINT * swing.max(initial=0.0)))
    count = int(whole[0]) if whole.size else max(swing.size - 1, 0)
    if count + 2 < FEWEST:
        return RingDown(*np.empty((3, 0)))
    swing, t = swing[:count + 1], times[::every][:count + 2]
    loss = np.log(swing[:-1] / swing[1:]) / every
    return RingDown(np.sqrt(swing[:-1] * swing[1:]) / 2, every / (t[2:] - t[:-2]), loss / np.hypot(np.pi, loss),
                    not whole.size)


def _cubic(place, speed, share: float) -> float:
    """Place at a share of the step by the cubic of both ends; speed over the step."""
    (a, b), (c, d), s = place, speed, share
    return float(a + s * (c + s * (3 * (b - a) - 2 * c - d + s * (2 * (a - b) + c + d))))


def _zero(place, speed) -> float:
    """Share of the step where the cubic turns."""
    (a, b), (c, d) = place, speed
    two, three = 3 * (b - a) - 2 * c - d, 2 * (a - b) + c + d
    found = np.roots([3 * three, 2 * two, c])
    inside = [one.real for one in np.atleast_1d(found) if abs(one.imag) < 1e-9 and -1e-9 <= one.real <= 1 + 1e-9]
    return float(np.clip(inside[0], 0, 1)) if inside else float(c / (c - d))
