"""Tracks and new valleys in the registration of two traces: where they are, and the traces without a track's edges."""

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...core import frozen_array, say
from ..edges import FLOOR, MEANS, edge, edge_near, floor_of, sure_of
from ..profile import Profile, runs_of
from ..quantity import SIDE, Quantity, around, refused
from ..roughness.filter import mean_line
from .carried import median_of_five
from .depth import summed
from .flanks import PARTS, Flanks
from .registration import REACH, Registration

LONG = 3.0  # longest waves of the band, and a track is longer; so is a piece of the traces whose roughness is compared
MEDIAN, UNWORN = 5, 0.05  # samples of the running median that is worn in a track, share of unworn heights in it
NEW = 10.0  # noises that a new valley is deeper than the trace before, and 3 below all of it nearby
FORM = 2.5  # longest waves, from which the shape of the depth is the form of a track
FROM, TO = ("x in the second trace (after wear) at which the longest track begins",
            "x in the second trace (after wear) at which the longest track ends")
DEPTH, BOTTOM = ("mean depth of the longest track: lost area divided by width",
                 "floor of the longest track: bottom of the parabola through the deepest fifth of its width")
WIDTH, STEP = ("width of the longest track",
               "step: mean depth over the middle third of the longest track, as ISO 5436-1 defines for a groove of "
               "type A1")
LEFT, RIGHT = (f"pile-up {side} the longest track: area above the first trace (before wear) within one track width"
               for side in ("before", "behind"))
GROSS, PILED, NET = ("area lost in the longest track", "pile-up on both sides: area above the first trace (before "
                                                       "wear), on each side within one track width of the "
                                                       "longest track", "lost area less pile-up")


class Valley(NamedTuple):
    """A valley that the trace after alone has: place [m] in it, and how far it is below the trace before [m]."""

    place: float
    depth: float


class Tracks(NamedTuple):
    """spans: first and last sample of each track; sizes: `Quantity` of the longest one by name (`_sizes`), all of one
    span, nothing without one; valley: the deepest new one, None without one; others: sizes of each other track."""

    spans: tuple
    sizes: Mapping = MappingProxyType({})
    valley: Valley | None = None
    others: tuple = ()


def tracks_of(found: Registration, together: float, longest: float) -> Tracks:
    """Tracks of a registration: runs of worn heights longer than three of the longest waves [m], hardly any unworn.

    A height of a run counts as worn where the median of five is deeper than 2.5 deviations. Edges are those of
    `edges.edge`; runs without an unworn place between them are one track. Tops that wore off stand between unworn
    valleys and are no track. A shallow track that the registration has (`shallow`) is the one. together: how many
    neighbouring heights err alike.
    """
    rest, noise = np.asarray(found.rest), found.noise
    runs = runs_of(median_of_five(rest / found.scatter) > REACH)
    spans = tuple((a, b) for a, b in runs if found.x[b] - found.x[a] > LONG * longest
                  and (rest[a:b + 1] <= REACH * noise).mean() < UNWORN) if found.track is None else \
        (tuple(end[0] for end in found.track),)
    if len(spans) > 1:
        spans = _joined(spans, [_with_flanks(rest, span, found.loudest, together) for span in spans])
    valley = _valley(found, spans, longest)
    if not spans:
        return Tracks((), valley=valley)
    widest = max(range(len(spans)), key=lambda at: spans[at][1] - spans[at][0])
    sizes = [_sizes_at(found, spans, at, together) for at in range(len(spans))]
    others = tuple({name: each._replace(text=each.text.replace(" the longest track", " this track"))
                    for name, each in one.items()} for at, one in enumerate(sizes) if at != widest)
    return Tracks(spans, sizes[widest], valley, others)


def _joined(spans: tuple, wide: list) -> tuple:
    """Runs (first, last) in one where their flanks (first, last) `wide` overlap: no mean height between them is unworn,
    as where a floor of another roughness reaches the unworn height here and there."""
    out, reach = [spans[0]], wide[0][1]
    for span, (first, last) in zip(spans[1:], wide[1:]):
        if first <= max(reach, out[-1][1]) or span[0] <= reach:
            out[-1] = out[-1][0], span[1]
        else:
            out.append(span)
        reach = max(reach, last)
    return tuple(out)


def _sizes_at(found: Registration, spans: tuple, at: int, together: float) -> dict:
    """Sizes of one of the tracks."""
    low = spans[at - 1][1] + 1 if at else 0
    high = spans[at + 1][0] if at + 1 < len(spans) else found.rest.size
    return _sizes(found, *_ends(found, spans[at], (low, high), together), together)


def _ends(found: Registration, span: tuple, around_it: tuple, together: float) -> tuple:
    """Where a track begins and ends, each a `Quantity`, and whether it reaches either end of the common part, so that
    it may be longer; around_it: samples without another track."""
    rest, x, (low, high) = np.asarray(found.rest), found.x, around_it
    first, last = span if found.track is not None else _with_flanks(rest, span, found.loudest, together)
    first, last = max(first, low), min(last, high - 1)
    centre, out, cut = (first + last) // 2, [], []
    for side, outside, text in ((slice(low, centre), first - low, FROM),
                                (slice(centre, high), high - 1 - last, TO)):
        part, places, scatter = (one[side] if text is FROM else one[side][::-1] for one in (rest, x, found.scatter))
        deep = np.flatnonzero((part > 2 * REACH * scatter)[:max(outside - MEDIAN, 0)])
        beside = int(deep[-1]) + 1 if deep.size else 0  # other worn places do not count
        if found.track is not None:
            beside, at = 0, found.track[0] if text is FROM else [rest.size - 1 - k for k in found.track[1]]
        else:
            at = edge_near(part[beside:], outside - beside, found.loudest, together)
        half = (places[0] - places[1]) / 2  # an edge lies between the last unworn sample and the first worn one
        cut.append(beside + at[0] < MEDIAN and outside == (first if text is FROM else rest.size - 1 - last))
        value, *ends = (float(places[beside + k] + half) for k in at)
        out.append(Quantity(value, min(ends), max(ends), "m", text))
    return (*out, tuple(cut))


def _with_flanks(rest, span: tuple, noise: float, together: float) -> tuple:
    """First and last sample of a track with the shallow ends of its flanks, where single heights do not stand out: as
    far as means of `MEANS[2]` neighbours do."""
    many, (first, last), sure = MEANS[2], span, sure_of(rest.size)
    worn = rest > sure * noise
    if rest.size >= many:
        mean = np.convolve(rest, np.full(many, 1 / many), "same")
        worn = mean > sure * noise * np.sqrt(together / many)
    worn[first:last + 1] = True
    return next((a, b) for a, b in runs_of(worn) if a <= first <= b)


def _sizes(found: Registration, start: Quantity, end: Quantity, cut: tuple, together: float) -> dict:
    """Width, depths, net and lost area, and pile-up of the track from start to end [m], each a `Quantity`.

    The interval of the mean depth has that of the width. cut: whether the common part ends within it on either side.
    """
    x, width = found.x, max(end.value - start.value, 1e-300)
    area, error = summed(found, (x > start.value) & (x < end.value), False)[:2]
    wide = float(np.hypot(*(one.high - one.low for one in (start, end)))) / (2 * SIDE)
    depth = area / width
    third = summed(found, abs(x - (start.value + end.value) / 2) <= width / 6, False)
    sides = [_pile_up(found, low, high, together, text) for low, high, text in
             ((start.value - width, start.value, LEFT), (end.value, end.value + width, RIGHT))]
    piled = sides[0].value + sides[1].value
    loose = float(np.hypot(*(max(one.high - one.value, one.value - one.low) for one in sides))) / SIDE
    out = {"from": start, "to": end, "width": around(width, wide, "m", WIDTH, 0.0),
            "depth_mean": around(depth, float(np.hypot(error / width, depth * wide / width)), "m", DEPTH, 0.0),
            "depth_floor": _floor(found, start.value, width, together),
            "step": around(third[0] / third[2], third[1] / third[2], "m", STEP, 0.0),
            "area_net": around(area - piled, float(np.hypot(error, loose)), "m2", NET),
            "area_gross": around(area, error, "m2", GROSS, 0.0), "pile_up": around(piled, loose, "m2", PILED, 0.0),
            "pile_up_left": sides[0], "pile_up_right": sides[1]}
    return _open(out, found.x, cut) if any(cut) else out


def _open(sizes: dict, x, cut: tuple) -> dict:
    """Sizes of a track that reaches an end of the common part: what is seen of it is the least that there is."""
    where = " and ".join(f"x = {say(float(x[k]), 4)}" for k, one in zip((0, -1), cut) if one)
    why = f"the track reaches the end of the common part of the traces at {where} and may be longer"
    gone = {"from": cut[0], "to": cut[1], "step": True, "area_net": True, "pile_up": True, "pile_up_left": cut[0],
            "pile_up_right": cut[1]}
    out = {name: refused(one.unit, one.text, why) if gone.get(name) else one for name, one in sizes.items()}
    least = {name: out[name]._replace(high=None, text=f"{out[name].text}, at least: {why}")
             for name in ("width", "area_gross")}
    seen = {name: out[name]._replace(text=f"{out[name].text}, of the part that the traces show")
            for name in ("depth_mean", "depth_floor")}
    return out | least | seen


def _pile_up(found: Registration, low: float, high: float, together: float, text: str) -> Quantity:
    """Area that stands above the trace before from low to high [m], from the edge of the track to the outer edge of
    what is raised; where nothing is, the interval holds what a low ridge may hide there."""
    near = np.flatnonzero((found.x > low) & (found.x < high))
    inward = near if text == LEFT else near[::-1]
    at = edge(-np.asarray(found.rest)[inward], found.loudest, together) if near.size > 8 else None
    held = np.isin(np.arange(found.x.size), inward[0 if at is None else at[0]:])
    area, error = summed(found, held, False)[:2] if held.any() else (0.0, 0.0)
    if at is None or area >= 0:
        return Quantity(0.0, 0.0, max(-area, 0.0) + SIDE * error, "m2", text)
    return around(-area, error, "m2", text, 0.0)


def _floor(found: Registration, start: float, width: float, together: float) -> Quantity:
    """Floor of a track (`floor_of`), which errs half as much again as the mean of its fifth."""
    top, deepest = floor_of(found.x, found.rest, (start, width), found.noise * np.sqrt(together))
    area, error, length = summed(found, deepest, False)[:3]
    return around(top, 1.5 * float(np.hypot(error / length, (top - area / length) / 4)), "m", BOTTOM, 0.0)


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


def pieces_of(found: Registration, tracks: Tracks, longest: float, flat: bool = False) -> list:
    """Pairs of traces, the second laid on the first, between and within the tracks: without the edges of these.

    An edge is a step, which has waves of every length; half of the longest wave [m] to either side, or three samples,
    stays out. The whole common part where no piece is three waves long. flat: the form of the tracks, that is the mean
    line of the depth at two and a half of the longest waves, is put back.
    """
    x, second = np.asarray(found.x), found.first - found.rest
    step = float(np.diff(x).mean())
    reach = max(longest / 2, 3 * step)
    cuts = _between(x, [x[k] for span in tracks.spans for k in span], reach, longest)
    out = []
    for one in cuts:
        form = mean_line(found.rest[one], FORM * longest / step, tilted=True) if flat and tracks.spans else 0.0
        out.append(tuple(Profile(frozen_array(x[one]), frozen_array(z), "the common part of both traces")
                         for z in (found.first[one], second[one] + form)))
    return out


def of_flanks(found: Flanks) -> Tracks:
    """The track below the unworn flanks of a trace: its ends are known to a part (`flanks.PARTS`), its pile-up not."""
    part = float(found.x[-1] - found.x[0]) / PARTS
    ends = [Quantity(one, one - part, one + part, "m", text) for one, text in ((found.start, FROM), (found.end, TO))]
    inside = np.asarray(found.depth)[(found.x >= found.start) & (found.x <= found.end)]
    many = max(inside.size // FLOOR, 1)
    floor = float(np.convolve(inside, np.full(many, 1 / many), "valid").max())
    off = found.largest[2] - found.largest[0]
    why = "the height of the first trace (before wear) beside the track is not known"
    width = Quantity(found.width, max(found.width - 2 * part, 0.0), found.width + 2 * part, "m", WIDTH)
    return Tracks((), {"from": ends[0], "to": ends[1], "width": width,
                       "depth_mean": Quantity(*(one / found.width for one in found.area), "m", DEPTH),
                       "depth_floor": Quantity(floor, max(floor - off, 0.0), floor + off, "m", BOTTOM),
                       "step": refused("m", STEP, "the roughness that wore away is not known at each point"),
                       "area_net": refused("m2", NET, why), "area_gross": Quantity(*found.area, "m2", GROSS),
                       **{name: refused("m2", text, why) for name, text in
                          (("pile_up", PILED), ("pile_up_left", LEFT), ("pile_up_right", RIGHT))}})


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
