"""Tracks and new valleys in the registration of two traces: where they are, and the traces without a track's edges."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ...core import frozen_array
from ..profile import Profile
from .depth import summed
from .extent import edge
from .flanks import PARTS, Flanks
from .quantity import Quantity, around
from .registration import REACH, Registration

LONG = 3.0  # longest waves of the band, and a track is longer; so is a piece of the traces whose roughness is compared
MEDIAN, UNWORN = 5, 0.05  # samples of the running median that is worn in a track, share of unworn heights in it
NEW = 10.0  # noises that a new valley is deeper than the trace before, and 3 below all of it nearby
FROM, TO, DEPTH = ("where the longest track begins, in the x of the trace after",
                   "where the longest track ends, in the x of the trace after", "mean worn depth of the longest track")


class Valley(NamedTuple):
    """A valley that the trace after alone has: place [m] in it, and how far it is below the trace before [m]."""

    place: float
    depth: float


class Tracks(NamedTuple):
    """spans: first and last sample of each track; start, end, depth: `Quantity` of the longest one, None without one;
    valley: the deepest new one, None without one."""

    spans: tuple
    start: Quantity | None = None
    end: Quantity | None = None
    depth: Quantity | None = None
    valley: Valley | None = None


def tracks_of(found: Registration, together: float, longest: float) -> Tracks:
    """Tracks of a registration: runs of worn heights longer than three of the longest waves [m], hardly any unworn.

    A height of a run counts as worn where the median of five is deeper than 2.5 noises. Edges are those of
    `extent.edge`. Tops that wore off stand between unworn valleys and are no track. together: how many neighbouring
    heights err alike.
    """
    rest, noise = np.asarray(found.rest), found.noise
    middle = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(rest, MEDIAN // 2, "edge"), MEDIAN), axis=1)
    runs = _runs(middle > REACH * noise)
    spans = tuple((a, b) for a, b in runs if found.x[b] - found.x[a] > LONG * longest
                  and (rest[a:b + 1] <= REACH * noise).mean() < UNWORN)
    valley = _valley(found, spans, longest)
    if not spans:
        return Tracks((), valley=valley)
    widest = max(spans, key=lambda one: one[1] - one[0])
    at = spans.index(widest)
    low = spans[at - 1][1] + 1 if at else 0
    high = spans[at + 1][0] if at + 1 < len(spans) else rest.size
    return Tracks(spans, *_ends(found, widest, (low, high), together), _depth(found, widest), valley)


def _runs(flags) -> list:
    """First and last index of each run of true flags."""
    change = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return list(zip(change[::2].tolist(), (change[1::2] - 1).tolist()))


def _ends(found: Registration, span: tuple, around_it: tuple, together: float) -> tuple:
    """Where a track begins and ends, each a `Quantity`; around_it: samples without another track."""
    rest, x, (first, last), (low, high) = np.asarray(found.rest), found.x, span, around_it
    centre, out = (first + last) // 2, []
    for side, outside, text in ((slice(low, centre), first - low, FROM),
                                (slice(centre, high), high - 1 - last, TO)):
        part, places = (one[side] if text is FROM else one[side][::-1] for one in (rest, x))
        deep = np.flatnonzero(part[:max(outside - MEDIAN, 0)] > 2 * REACH * found.noise)
        beside = int(deep[-1]) + 1 if deep.size else 0  # other worn places do not count
        at = edge(part[beside:], found.noise, together) or (outside - beside,) * 3
        value, *ends = (float(places[beside + k]) for k in at)
        out.append(Quantity(value, min(ends), max(ends), "m", text))
    return tuple(out)


def _depth(found: Registration, span: tuple) -> Quantity:
    inside = np.zeros(found.rest.size, bool)
    inside[span[0]:span[1] + 1] = True
    area, error, length = summed(found, inside)[:3]
    return around(area / length, error / length, "m", DEPTH, 0.0)


def _valley(found: Registration, spans: tuple, longest: float) -> Valley | None:
    """The deepest valley that the trace before has not, outside of tracks."""
    rest, noise = np.array(found.rest), found.noise
    near = max(MEDIAN, int(np.ceil(longest / max(float(np.diff(found.x).mean()), 1e-300))))
    for first, last in spans:
        rest[max(first - MEDIAN, 0):last + MEDIAN + 1] = 0.0
    at = int(np.argmax(rest))
    if not rest[at] > NEW * noise or (rest[max(at - 1, 0):at + 2] > REACH * noise).sum() < 2:
        return None
    floor = found.first[max(at - near, 0):at + near + 1].min()
    if not found.first[at] - rest[at] < floor - 3 * noise:
        return None
    return Valley(float(found.x[at]), float(rest[at]))


def pieces_of(found: Registration, tracks: Tracks, longest: float) -> list:
    """Pairs of traces, the second laid on the first, between and within the tracks: without the edges of these.

    An edge is a step, which has waves of every length; half of the longest wave [m] to either side, or three samples,
    stays out. The whole common part where no piece is three waves long.
    """
    x, second = np.asarray(found.x), found.first - found.rest
    reach = max(longest / 2, 3 * float(np.diff(x).mean()))
    cuts = _between(x, [x[k] for span in tracks.spans for k in span], reach, longest)
    return [tuple(Profile(frozen_array(x[one]), frozen_array(z[one]), "the common part")
                  for z in (found.first, second)) for one in cuts]


def beside_flanks(after: Profile, found: Flanks, longest: float) -> list:
    """The trace after in pieces, without the edges of its track, which are known to about a part (`flanks.PARTS`)."""
    reach = max(longest / 2, after.length / PARTS)
    return [Profile(frozen_array(after.x[one]), frozen_array(after.z[one]), after.source)
            for one in _between(after.x, [found.start, found.end], reach, longest)]


def _between(x, cuts: list, reach: float, longest: float) -> list:
    """Samples (bool) of each piece between cuts [m] that is long enough; all of them where none is."""
    pieces = [(x > low + reach) & (x < high - reach) for low, high in pairwise([-np.inf, *cuts, np.inf])]
    out = [one for one in pieces if one.sum() > 16 and np.ptp(x[one]) > LONG * longest]
    return out or [np.ones(x.size, bool)]
