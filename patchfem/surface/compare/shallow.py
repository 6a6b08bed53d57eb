"""Tracks that are shallower than the noise of one height: found by their means over many heights, or how deep one
would have to be."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ...core import frozen_array, say
from ..edges import foot
from ..quantity import SIDE
from .carried import Carried
from .registration import KEPT, REACH, TRIMMED, Registration, together

PARTS, FLANK, NARROW = 60, 6, 3  # parts of the trace, fewest of each unworn flank, fewest of a track
CLEAR = 8.0  # standard deviations of a step that a track has at least; 2 of 100 random walks have it too
CLIPPED = 4.0  # deviations beyond which a depth counts no further, as that of a speck
DEGREE = 3  # of the polynomial that a datum may add


class Shallow(NamedTuple):
    """span: first and last sample of the track, None without one; least [m]: depth from which a track over the middle
    third of the length would have been found."""

    span: tuple | None
    least: float


def shallow_of(found: Registration) -> Shallow | None:
    """Look for one track in the means of a registration over 60 parts, None for traces with too few heights.

    Every step down and up again with a tenth of the length on either side is fitted together with a cubic, which is
    what a datum may add, after what the shift, the stretch and a gain may add has left the depths by least squares. The
    step is a track where it is eight times its standard deviation. This deviation comes from the scatter of the parts
    about the fit and from how many neighbouring parts err alike, so that slow drift is no track.
    """
    if found.rest.size < 8 * PARTS:
        return None
    edges = np.linspace(0, found.rest.size, PARTS + 1).astype(int)
    means = np.add.reduceat(_plain(found), edges[:-1]) / np.diff(edges)
    boxes, sizes, places, base = _boxes()
    means = means - base @ (base.T @ means)
    heights = boxes @ means
    best = int(np.argmax(heights))
    left = means - heights[best] * boxes[best]
    spread = float(np.sqrt((left @ left) / (PARTS - DEGREE - 4) * together(left, np.ones(PARTS, bool))))
    third = places.index((PARTS // 3, PARTS - PARTS // 3))
    track = heights[best] > CLEAR * spread
    span = (int(edges[places[best][0]]), int(edges[places[best][1]]) - 1) if track else None
    return Shallow(span, CLEAR * spread / float(sizes[third]))


def _plain(found: Registration) -> np.ndarray:
    """Depths (n,) [m] without what errors of shift, stretch and gain add to them."""
    most = CLIPPED * found.scatter
    rest = np.clip(found.rest, -most, most)
    along = np.linspace(-1, 1, rest.size)
    form = np.vander(along, DEGREE + 1)
    fall = found.gradient[:, 2]
    other = np.column_stack([fall, fall * along, found.first])
    other = other - form @ np.linalg.lstsq(form, other, rcond=None)[0]
    size = np.linalg.norm(other, axis=0)
    other = other / np.where(size > 0, size, 1.0)
    return rest - other @ np.linalg.lstsq(other, rest - form @ np.linalg.lstsq(form, rest, rcond=None)[0],
                                          rcond=None)[0]


@cache
def _boxes() -> tuple:
    """Boxes (m, parts) less their cubic and of length one, their lengths, the parts (from, to) of each, and the base
    (parts, 4) of cubics."""
    places = [(i, j) for i in range(FLANK, PARTS) for j in range(i + NARROW, PARTS - FLANK + 1)]
    t = np.arange(PARTS)
    box = np.array([(t >= i) & (t < j) for i, j in places], float)
    base = np.linalg.qr(np.vander(np.linspace(-1, 1, PARTS), DEGREE + 1))[0]
    box -= box @ base @ base.T
    sizes = np.linalg.norm(box, axis=1)
    return box / sizes[:, None], sizes, places, base


def on_flanks(found: Registration, span: tuple, again: bool = True) -> tuple:
    """(the registration fitted again to the heights beside a track, what carries it); again: once more where the track
    shows to be wider."""
    x, margin = np.asarray(found.x), found.x.size // PARTS
    beside = np.ones(x.size, bool)
    beside[span[0] - margin:span[1] + margin + 1] = False
    rest, gradient = np.array(found.rest), np.asarray(found.gradient)
    noise, step = found.noise, np.zeros(gradient.shape[1])
    for _ in range(4):
        used = beside & (np.abs(rest) <= REACH * noise)
        change = -np.linalg.lstsq(gradient[used], rest[used], rcond=1e-10)[0]
        rest, step = rest + gradient @ change, step + change
        noise = 1.4826 * float(np.median(np.abs(rest[beside])))
    used = beside & (np.abs(rest) <= REACH * noise)
    part, alike = gradient[used], together(rest, used)
    track = _edges(rest, span, noise * float(np.sqrt(alike)))
    if again and (track[0][0] < span[0] - margin or track[1][0] > span[1] + margin):
        return on_flanks(found, (track[0][0], track[1][0]), False)
    inverse = np.linalg.pinv(part.T @ part, rcond=1e-14, hermitian=True)
    covariance = inverse * float(np.mean(rest[used] ** 2)) / KEPT * TRIMMED * alike
    stretch = (found.stretch[0] + step[3], *found.stretch[1:]) if step.size > 3 else found.stretch
    bend = found.bend + float(step[4] * gradient[:, 4].max()) if step.size > 4 else found.bend
    new = replace(found, shift=found.shift + float(step[2]), slope=found.slope + float(step[1]),
                  offset=found.offset + float(step[0]), noise=noise, rest=frozen_array(rest), used=used,
                  covariance=frozen_array(covariance), doubt=frozen_array(np.zeros(step.size)), stretch=stretch,
                  bend=bend, track=track)
    parts = ((float(x[0]), float(x[track[0][0]])), (float(x[track[1][0]]), float(x[-1])))
    return new, Carried("parts", parts, float(used.mean()))


def _edges(rest, span: tuple, noise: float) -> tuple:
    """((first, lowest, highest), (last, lowest, highest)) sample of a track: where a step of its mean depth fits best,
    up to a part away, and every place at which the sum of squares is within 5.8 noise^2 of the least, as for deeper
    tracks (`depth.extent_of`). Where a flank that begins at zero, as that of a parabola, fits as well or better, its
    foot sinks in the noise: then the edge is that of the flank (`edges.foot`)."""
    steps, (first, last) = _steps(rest, span, noise), span
    middle = (first + last) // 2
    feet = foot(rest[:middle], first, noise), foot(rest[middle:][::-1], rest.size - 1 - last, noise)
    feet = feet[0], None if feet[1] is None else tuple(rest.size - 1 - k for k in (feet[1][0], *feet[1][:0:-1]))
    return tuple(step if one is None else one for step, one in zip(steps, feet))


def _steps(rest, span: tuple, noise: float) -> tuple:
    """The same of steps alone."""
    part, (first, last) = rest.size // PARTS, span
    depth = float(rest[first + part:last - part + 1].mean())
    total, out = np.cumsum(rest - depth / 2), []
    for side, low, high in ((1, first - part, first + part), (-1, last - part, last + part)):
        cost = 2 * depth * side * total[low:high + 1]
        near = low + np.flatnonzero(cost <= cost.min() + 1.5 * SIDE**2 * noise**2)
        best = low + int(np.argmin(cost)) + (side > 0)
        out.append((best, int(near[0]) + (side > 0) - 1, int(near[-1]) + (side > 0) + 1))
    return tuple(out)


def would_show(least: float) -> str:
    """How deep a track would have been found, as a sentence."""
    return ("A track over the middle third of the common length, with both of its flanks unworn, would have been found "
            f"from a mean depth of {say(least, 2)} on.")
