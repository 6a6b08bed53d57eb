"""From where to where a trace is worn: in the registration of two traces."""

from typing import NamedTuple

import numpy as np

from .quantity import SIDE, Quantity
from .registration import Registration

FROM, TO = "first worn place", "last worn place"
SURE = 5.0  # noises of a mean of neighbours from which they are worn: chance brings it in 1 of 1000 traces
MEANS = (1, 4, 16, 64)  # neighbours
DEEP, LEAST, MOST = 10.0, 12, 400  # noises at which a flank of the wear ends; samples of it to either side


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
