"""Unworn flanks: a wear track that ends within a trace, below the line through the surface on both of its sides."""

from dataclasses import dataclass

import numpy as np

from ..profile import Profile, even, level
from ..quantity import LEVEL
from ..roughness.intervals import made_traces
from ..roughness.parameters import Heights
from ..roughness.spectrum import spectrum_of

PARTS = 40  # of the trace, in which the track is looked for
LEAST = 4  # parts of each flank
DRAWS = 100  # made traces that the track is put into for the intervals
WIDER = 1.4  # for a spectrum that is itself estimated: without it 85 of 100 intervals hold the area
CLEAR = 1.2  # times the largest step, or roughness of the flanks, of all made traces without a track


@dataclass(frozen=True, eq=False)
class Flanks:
    """A wear track between two flanks.

    start, end [m]: of the track; line (2,): height [m] at x = 0 and slope of the flanks; depth (n,) [m] below the line
    at x (n,) [m]; area [m2] and largest depth [m] as (value, low, high).
    """

    start: float
    end: float
    line: tuple
    x: np.ndarray
    depth: np.ndarray
    area: tuple
    largest: tuple

    @property
    def width(self) -> float:
        """Width of the track [m]."""
        return self.end - self.start


def flanks_of(before: Profile, after: Profile) -> Flanks | None:
    """Find the wear track in a trace longer than it, None where nothing stands out from the roughness of `before`.

    The trace is cut into 40 parts; a straight line with a box in it is fitted to their means for every place of the box
    that leaves a tenth of the trace on either side. The box counts where it is clearer than in each of 200 traces
    without a track, made with the spectrum of `before`, and the flanks are no rougher than theirs: unworn flanks have
    the roughness of the trace before. A line is then fitted to the flanks, which counts what sticks
    out of them (pile-up) little, and the track runs as far as the mean depth of a part lies below the line. Intervals
    come from the same search with this track put into the made traces: the roughness that wore away is not known.
    """
    one, other = level(even(before)), even(after)
    step = other.length / (other.x.size - 1)
    if other.x.size < 8 * PARTS or one.x.size < 16:
        return None
    spectrum = spectrum_of(one.z, one.length / (one.x.size - 1))
    made = _made(spectrum, other, step)
    boxes = _boxes()
    best = [_steps(_means(z), boxes) for z in made]
    own = _steps(_means(other.z), boxes)
    if own.max() <= CLEAR * max((each.max() for each in best), default=0.0) or own.max() <= 1e-12:
        return None
    box = boxes[1][int(np.argmax(own))]
    if _roughness(other, other.z, box) > CLEAR * max((_roughness(other, z, box) for z in made[:DRAWS]), default=np.inf):
        return None
    line, depth, ends = _track(other.x, other.z, box)
    return _with_intervals(other, (line, depth, ends), box, made)


def _track(x, z, box: tuple) -> tuple:
    """Line of the flanks, depth (n,) [m] below it, and the first and last sample of the track."""
    edges, beside = _beside(x.size, box)
    line = _line(x[beside], z[beside])
    depth = line[0] + line[1] * x - z
    return line, depth, _ends(depth, edges, *box)


def _beside(size: int, box: tuple) -> tuple:
    """First samples (PARTS + 1,) of the parts, and which samples (size,) lie in the flanks, a part off the box."""
    edges = np.linspace(0, size, PARTS + 1).astype(int)
    beside = np.ones(size, bool)
    beside[edges[max(box[0] - 1, 1)]:edges[min(box[1] + 1, PARTS - 1)]] = False
    return edges, beside


def _roughness(other: Profile, z, box: tuple) -> float:
    """Median distance [m] of the flanks' heights from their line, which pile-up changes little."""
    beside = _beside(z.size, box)[1]
    offset, slope = _line(other.x[beside], z[beside])
    return float(np.median(np.abs(z[beside] - offset - slope * other.x[beside])))


def _made(spectrum, other: Profile, step: float) -> np.ndarray:
    """Traces (k, n) at the samples of `other` with the spectrum of the one before."""
    if not spectrum.density.any():
        return np.zeros((0, other.x.size))
    made = made_traces(spectrum, Heights(other.z, step), None)
    own = np.linspace(0, 1, other.x.size)
    return np.array([np.interp(own, np.linspace(0, 1, one.z.size), one.z) for one in made])


def _means(z) -> np.ndarray:
    edges = np.linspace(0, z.size, PARTS + 1).astype(int)
    return np.add.reduceat(z, edges[:-1]) / np.diff(edges)


def _boxes() -> tuple:
    """Boxes less their line and mean, of length one, and the parts (from, to) of each."""
    places = [(i, j) for i in range(LEAST, PARTS) for j in range(i + 2, PARTS - LEAST + 1)]
    t = np.arange(PARTS)
    box = np.array([(t >= i) & (t < j) for i, j in places], float)
    base = np.linalg.qr(np.column_stack([np.ones(PARTS), t]))[0]
    box -= box @ base @ base.T
    return box / np.linalg.norm(box, axis=1, keepdims=True), places


def _steps(means, boxes) -> np.ndarray:
    return -(boxes[0] @ means)


def _line(x, z) -> tuple:
    """Straight line by Tukey's weights: heights beyond 4.7 robust deviations do not count."""
    t = (x - x.mean()) / (np.ptp(x) / 2)
    weight = np.ones(x.size)
    for _ in range(30):
        slope, offset = np.polyfit(t, z, 1, w=np.sqrt(weight))
        rest = z - offset - slope * t
        spread = 1.4826 * float(np.median(np.abs(rest)))
        if spread <= 1e-15:
            break
        weight = np.clip(1 - (rest / (4.685 * spread)) ** 2, 0, 1) ** 2 + 1e-12
    slope = slope / (np.ptp(x) / 2)
    return float(offset - slope * x.mean()), float(slope)


def _ends(depth, edges, low: int, high: int) -> tuple:
    """First and last sample of the track: from its middle out to where the running mean of half a part is zero."""
    width = max((edges[1] - edges[0]) // 2, 1)
    smooth = np.convolve(np.pad(depth, (width // 2, width - 1 - width // 2), "edge"), np.full(width, 1 / width),
                         "valid")
    out = np.flatnonzero(smooth <= 1e-9 * smooth.max())  # zero but for round-off
    middle = edges[low] + int(np.argmax(smooth[edges[low]:edges[high]]))
    before, after = out[out < middle], out[out > middle]
    return (int(before[-1]) + 1 if before.size else 0), (int(after[0]) - 1 if after.size else depth.size - 1)


def _with_intervals(other: Profile, found: tuple, box: tuple, made) -> Flanks:
    """The track with its intervals: the same search in tracks of this shape cut into made traces."""
    line, depth, ends = found
    x, step = other.x, other.length / (other.x.size - 1)

    def sizes(depth, ends) -> tuple:
        part = depth[ends[0]:ends[1] + 1]
        return float(part.sum()) * step, float(part.max())

    own = sizes(depth, ends)
    shape = np.zeros(x.size)
    width = max(x.size // PARTS // 2, 1)
    smooth = np.convolve(np.pad(depth, (width // 2, width - 1 - width // 2), "edge"), np.full(width, 1 / width),
                         "valid")
    shape[ends[0]:ends[1] + 1] = np.maximum(smooth[ends[0]:ends[1] + 1], 0)
    if not len(made):
        return Flanks(float(x[ends[0]]), float(x[ends[1]]), line, x, depth, (own[0],) * 3, (own[1],) * 3)
    tail = (1 - LEVEL) / 2
    errors = np.array([sizes(*_track(x, z - shape, box)[1:])[0] for z in made[:DRAWS]]) - float(shape.sum()) * step
    middle = float(np.median(errors))
    low, high = middle + WIDER * (np.quantile(errors, (tail, 1 - tail)) - middle)
    peak = float(np.quantile(np.abs(made[:, ends[0]:ends[1] + 1]).max(axis=1), 1 - tail))  # it may stand anywhere
    area = own[0], float(np.clip(own[0] - high, 0.0, own[0])), float(max(own[0] - low, own[0]))
    largest = own[1], max(own[1] - peak, 0.0), own[1] + peak
    return Flanks(float(x[ends[0]]), float(x[ends[1]]), line, x, depth, area, largest)
