"""From where to where a trace is worn, and whether material grew: in the registration of two traces."""

from typing import NamedTuple

import numpy as np

from ...core import say
from .quantity import SIDE, Quantity
from .registration import REACH, Registration

FROM, TO = "first worn place", "last worn place"
SURE = 5.0  # noises of a mean of neighbours from which they are worn: chance brings it in 1 of 1000 traces
MEANS = (1, 4, 16, 64)  # neighbours
DEEP, LEAST, MOST = 10.0, 12, 400  # noises at which a flank of the wear ends; samples of it to either side
MORE = 1.1  # times the unworn heights, from which the other order of the traces is the likelier one
WORSE = 1.5  # times the noise, from which a fit is none: it runs between worn and unworn heights
DEPOSITED = 0.05  # of the worn area, what may stand above without a word


class Extent(NamedTuple):
    """First and last worn place in the x of the trace before and of the trace after, each a `Quantity` [m]."""

    before: tuple
    after: tuple


def extent_of(found: Registration, together: float) -> Extent | None:
    """Where the wear begins and ends, None where none stands out from the noise.

    The outermost heights count as worn whose mean, of 1 to 64 neighbours, is deeper than five times its noise. The edge
    is then that of the least-squares flank, zero outside and a + b t + c t^2 inside, fitted beside it as far as the
    depth reaches ten noises; every edge whose sum of squares is within 5.8 noise^2 of the least is in the interval
    (3.84, were the flank a parabola). What is worn less than the noise shows lies outside.
    together: how many neighbouring heights err alike.
    """
    rest = np.asarray(found.rest)
    ends = [edge(rest, found.noise, together), edge(rest[::-1], found.noise, together)]
    if None in ends:
        return None
    x, last = found.x, rest.size - 1
    places = [tuple(float(x[k]) for k in ends[0]), tuple(float(x[last - k]) for k in (ends[1][0], *ends[1][:0:-1]))]
    after = tuple(Quantity(*place, "m", f"{text}, in the x of the trace after")
                  for place, text in zip(places, (FROM, TO)))
    scale = 1 + (found.stretch[0] if found.stretch[2] else 0.0)
    moved = SIDE * found.errors[2]

    def back(place: float) -> float:
        return found.middle + (place - found.middle) / scale - found.shift

    before = tuple(Quantity(back(place), back(low) - moved, back(high) + moved, "m", f"{text}, in the x of the trace "
                            "before") for (place, low, high), text in zip(places, (FROM, TO)))
    return Extent(before, after)


def edge(rest, noise: float, together: float):
    """(edge, lowest, highest) index of the first worn height, None without one."""
    worn = None
    for many in MEANS:
        if many > rest.size:
            break
        mean = np.convolve(rest, np.full(many, 1 / many), "valid")
        deep = np.flatnonzero(mean > SURE * noise * np.sqrt((together if many > 1 else 1.0) / many))
        if deep.size and (worn is None or deep[0] + many - 1 < worn):
            worn = int(deep[0] + many - 1)
    if worn is None:
        return None
    deep = np.flatnonzero(rest[worn:] > DEEP * noise)
    reach = int(np.clip(deep[0] if deep.size else MOST, LEAST, MOST))
    low, high = max(worn - 2 * reach, 0), min(worn + reach, rest.size)
    part, sums = rest[low:high], []
    for k in range(part.size - 3):
        base = np.vander(np.arange(part.size - k) / part.size, 3)
        left = part[k:] - base @ np.linalg.lstsq(base, part[k:], rcond=None)[0]
        sums.append(float(part[:k] @ part[:k] + left @ left))
    sums = np.array(sums)
    near = np.flatnonzero(sums <= sums.min() + 1.5 * SIDE**2 * noise**2 * together)
    best = low + int(np.argmin(sums))
    return best, max(low + int(near[0]) - 1, 0), min(low + int(near[-1]) + 1, rest.size - 1)


def _unworn(found: Registration, other: Registration) -> tuple:
    """Shares of the heights that are unworn, within the smaller noise of both registrations; none of the other one
    where its noise is much the larger."""
    if other.noise > WORSE * found.noise:
        return 1.0, 0.0
    reach = REACH * min(found.noise, other.noise)
    return tuple(float(np.mean(np.abs(one.rest) <= reach)) for one in (found, other))


def exchanged(found: Registration, other: Registration | None, area: Quantity, deposited: float) -> bool:
    """Whether the other order of the traces is the likelier one; arguments as those of `grown`.

    Either it leaves more heights unworn, or more stands above the first trace than can be worn off it: deposited is
    beyond the interval of the worn area.
    """
    if other is not None:
        kept, more = _unworn(found, other)
        if more > MORE * kept:
            return True
    return deposited > area.high


def grown(found: Registration, other: Registration | None, area: float, deposited: float) -> list[str]:
    """What speaks for material that grew, or for files in the wrong order, as sentences.

    other: the first trace registered on the second one, None where that cannot be done; area, deposited [m2]: what is
    below and above the first trace. Two traces have no height in common but that of their unworn parts, and wear is
    taken for that order in which the second one lies below. Where the other order leaves more heights unworn, within
    the smaller noise of both, it is the likelier one.
    """
    if other is not None:
        kept, more = _unworn(found, other)
        if more > MORE * kept:
            top = float(np.quantile(other.rest, 0.99))
            return [f"taken the other way round, as wear of the trace after, {100 * more:.0f} % of the heights are "
                    f"alike, as given {100 * kept:.0f} %: material grew by up to about {say(top)} between the traces, "
                    "or the two files are in the wrong order; worn depths are no wear then"]
    if deposited > DEPOSITED * abs(area) and deposited > 0:
        return [f"{1e12 * deposited:.3g} um^2 of the trace after stand above the trace before: material grew there "
                "(deposits), or the two files are in the wrong order"]
    return []
