"""Worn depth of a trace, and from where to where it is worn: from its registration on the first one, from unworn
flanks, or a guess from valley tails."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..edges import edge
from ..profile import Profile, even, level
from ..quantity import LEVEL, SIDE, Quantity, around, refused
from ..roughness.intervals import made_traces
from ..roughness.parameters import Heights
from ..roughness.spectrum import spectrum_of
from .flanks import Flanks
from .largest import largest
from .registration import REACH, Registration, together

MAX, MEAN, AREA = ("largest worn depth, corrected for noise",
                   "mean worn depth over the common length",
                   "worn area of the section, which is the worn volume per unit of width")
WITHIN = "mean worn depth between the first and the last worn point, including the unworn valleys between these points"
TAIL = (0.02, 0.25)  # share of the lowest heights that both Abbott curves are laid on each other over
DEPOSIT = 4.0  # deviations above the trace before from which a height is a deposit, not noise
FROM, TO = "x of the first worn place", "x of the last worn place"
OUTSIDE = 5  # unworn heights, of which fewer do not show that the wear ends
SLIGHT = 0.5  # noises: wear less deep than that passes for none (test_registration)


class Extent(NamedTuple):
    """First and last worn place in the x of the trace before and of the trace after, each a `Quantity` [m]; cut:
    whether either is at the end of the common part, so that the wear may go on."""

    before: tuple
    after: tuple
    cut: tuple = (False, False)

    @property
    def known(self) -> "Extent":
        """The same without the places at which only the common part ends."""
        why = "the wear reaches the end of the common part of the traces here and may go on"
        sides = (tuple(refused(one.unit, one.text, why) if cut else one for one, cut in zip(ends, self.cut))
                 for ends in (self.before, self.after))
        return Extent(*sides, self.cut)


@dataclass(frozen=True, eq=False)
class Worn:
    """Worn depth of a trace: three `Quantity`, the area [m2] that stands above the first trace (deposits), from where
    to where it is worn and the mean depth within, both None where that is not known."""

    largest: Quantity
    mean: Quantity
    area: Quantity
    deposited: float = 0.0
    extent: Extent | None = None
    within: Quantity | None = None


def of_registration(found: Registration) -> Worn:
    """Worn depth over the common part of two registered traces.

    All depths are added up, so that noise of both signs cancels on the unworn heights, but not what stands more than 4
    deviations above the first trace: that is deposited. The interval of the sums has the noise of the worn heights, the
    uncertainty of shift, tilt and offset with what the deeper half of the unworn heights doubts of them, and the wear
    that hides in the noise: as many heights as are worn by 2.5 to 5 noises, by half a noise each. The largest
    depth is that of `largest`.
    """
    area, error, length, deposited = summed(found, np.ones(found.rest.size, bool))
    ends = area / found.rest.size / SIDE  # the common length is known to a sample
    extent = extent_of(found, neighbours(found))
    mean = around(area / length, float(np.hypot(error, ends)) / length, "m", MEAN, 0.0)
    return Worn(_at_least(_largest(found), mean), mean, around(area, error, "m2", AREA, 0.0), deposited, extent,
                None if extent is None else within(found, *extent.after))


def _at_least(largest: Quantity, mean: Quantity) -> Quantity:
    """A largest depth, which is never below the mean."""
    return largest if largest.value >= mean.value else largest._replace(
        value=mean.value, low=max(largest.low, mean.low), high=max(largest.high, mean.high))


def within(found: Registration, start: Quantity, end: Quantity) -> Quantity | None:
    """Mean worn depth between two places of the trace after, whose error counts as that of the width; None where the
    wear is so narrow that these are not known apart."""
    area, error, width = summed(found, (found.x >= start.value) & (found.x <= end.value))[:3]
    if width == 0:
        return None
    wide = float(np.hypot(start.high - start.low, end.high - end.low)) / (2 * SIDE)
    return around(area / width, float(np.hypot(error, area / width * wide)) / width, "m", WITHIN, 0.0)


def extent_of(found: Registration, together: float) -> Extent | None:
    """Where the wear begins and ends, None where none stands out from the noise.

    The outermost heights count as worn whose mean, of 1 to 64 neighbours, is deeper than noise alone brings it in 1 of
    1000 traces. The edge is then that of the least-squares flank, zero outside and b t + c t^2 inside, fitted beside it
    as far as the depth reaches ten noises, or a + b t + c t^2 where a step a fits clearly better; every edge whose sum
    of squares is within 5.8 noise^2 of the least is in the interval (3.84, were the flank a parabola). What is worn
    less than the noise shows lies outside.
    together: how many neighbouring heights err alike.
    """
    rest = np.asarray(found.rest)
    if found.track is None:
        ends = [edge(rest, found.loudest, together), edge(rest[::-1], found.loudest, together)]
    else:
        ends = [found.track[0], tuple(rest.size - 1 - k for k in (found.track[1][0], *found.track[1][:0:-1]))]
    if None in ends:
        return None
    x, last = found.x, rest.size - 1
    places = [tuple(float(x[k]) for k in ends[0]), tuple(float(x[last - k]) for k in (ends[1][0], *ends[1][:0:-1]))]
    after = tuple(Quantity(*place, "m", f"{text} in the second trace (after wear)")
                  for place, text in zip(places, (FROM, TO)))
    scale = 1 + (found.stretch[0] if found.stretch[2] else 0.0)
    moved = SIDE * found.errors[2]

    def back(place: float) -> float:
        return found.middle + (place - found.middle) / scale - found.shift

    before = tuple(Quantity(back(place), back(low) - moved, back(high) + moved, "m",
                            f"{text} in the first trace (before wear)")
                   for (place, low, high), text in zip(places, (FROM, TO)))
    return Extent(before, after, (ends[0][0] < OUTSIDE, ends[1][0] < OUTSIDE))


def summed(found: Registration, inside, deposits: bool = True) -> tuple:
    """(worn area [m2], its standard deviation, length [m], deposited area) of the samples inside (n,), all for bool;
    without deposits all heights count into the worn area, those that stand above the first trace with their sign."""
    width = np.where(inside, widths(found.x), 0.0)
    length, rest = float(width.sum()), found.rest
    deposit = (rest < -DEPOSIT * found.scatter) & deposits
    weight = np.where(deposit, 0.0, width)
    area = float(weight @ rest)
    far = ~found.used & ~deposit
    pull = (weight[far] @ found.gradient[far])
    off = np.abs(rest[far])
    scatter = np.where(off < DEPOSIT * found.noise, np.maximum(off, found.noise), found.noise)  # or the tail of noise
    moved = max(float(weight @ found.gradient @ found.doubt) ** 2 - 4 * float(pull @ found.covariance @ pull), 0.0)
    error = float(np.sqrt(pull @ found.covariance @ pull + moved + ((width[far] * scatter) ** 2).sum()))
    slight = (rest > REACH * found.noise) & (rest < 2 * REACH * found.noise)
    if found.track is not None:  # its heights are counted as worn
        slight[found.track[0][0]:found.track[1][0] + 1] = False
    slight = slight.sum() / found.used.sum()
    error = float(np.hypot(error, SLIGHT * slight * found.noise * length))
    error = max(error, 0.1 * found.noise * float(np.sqrt((width**2).sum())))  # digits, where no height is worn
    area = area if abs(area) > 1e-6 * found.noise * length else 0.0
    return area, error, length, float(-(width[deposit] @ rest[deposit]))


def balance(found: Registration) -> float:
    """(what is missing less what grew) / (both), by heights beyond 4 deviations: 1 for wear alone, 0 for neither."""
    rest = np.where(np.abs(found.rest) > DEPOSIT * found.scatter, found.rest, 0.0)
    both = float(np.abs(rest).sum())
    return float(rest.sum()) / both if both > 0 else 0.0


def widths(x) -> np.ndarray:
    """Share of the length that each sample stands for [m]."""
    edges = np.concatenate([[1.5 * x[0] - x[1] / 2], (x[1:] + x[:-1]) / 2, [1.5 * x[-1] - x[-2] / 2]])
    return np.diff(edges)


def _largest(found: Registration) -> Quantity:
    if float((found.rest / found.scatter).max()) <= 4.5:  # the largest of the noise of the whole trace
        return Quantity(0.0, 0.0, max(float(found.rest.max()), 0.0) + found.noise, "m", MAX)
    return around(*largest(found, neighbours(found)), "m", MAX, 0.0)


def neighbours(found: Registration) -> float:
    """How many neighbouring heights err alike, with what interpolation between samples does to the next two."""
    rest, used = found.rest, found.used
    total, power = 1.0, max(float(np.mean(rest[used] ** 2)), 1e-300)
    for lag in (1, 2):
        both = used[lag:] & used[:-lag]
        total += 2 * float(np.mean(rest[lag:][both] * rest[:-lag][both])) / power if both.any() else 0.0
    return max(total, together(rest, used))


def of_flanks(found: Flanks) -> Worn:
    """Worn depth below the unworn flanks of a trace, over the width of the track."""
    mean = "mean worn depth over the track"
    return Worn(Quantity(*found.largest, "m", MAX), Quantity(*(one / found.width for one in found.area), "m", mean),
                Quantity(*found.area, "m2", AREA))


def nowhere(reason: str, deposited: float = 0.0) -> Worn:
    """No worn depth, and why; deposited [m2]: what stands above the first trace nevertheless."""
    return Worn(refused("m", MAX, reason), refused("m", MEAN, reason), refused("m2", AREA, reason), deposited)


def abbott_estimate(before: Profile, after: Profile) -> Quantity:
    """Mean worn depth from two traces of different places: the valley tails of both Abbott curves laid on each other.

    Both traces are levelled by least squares; the mean of the second then stands lower over its valleys, by the mean
    worn depth. The interval is that of traces of this length made with the spectrum of the first one, of which none is
    worn. It takes the surface for alike everywhere and its deepest valleys, a quarter of the length, for unworn.
    """
    one, other = (level(even(each)) for each in (before, after))
    share = np.linspace(*TAIL, 24)
    found = float((np.quantile(other.z, share) - np.quantile(one.z, share)).mean())
    spectrum = spectrum_of(one.z, one.length / (one.x.size - 1))
    text = "mean worn depth estimated from the valley tails of both Abbott curves"
    if not spectrum.density.any():
        return refused("m", text, "the first trace (before wear) is flat")
    tails = []
    for each, half in ((one, 0), (other, 1)):
        heights = Heights(each.z, each.length / (each.x.size - 1))
        made = made_traces(spectrum, heights, 1)[half::2]
        tails.append(np.array([np.quantile(m.z, share).mean() * np.sqrt(min(1.0, m.length / heights.length))
                               for m in made]))
    low, high = np.quantile(tails[1] - tails[0], ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    return Quantity(found, found - float(high), found - float(low), "m", text)
