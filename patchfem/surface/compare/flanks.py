"""Track in the second trace alone, measured below the straight line through its unworn flanks.

It serves where both traces have no heights in common: the track left nothing of the old surface, or
the first trace was measured at another place and shows the roughness only.
"""

import numpy as np

from ..profile import Profile
from .changes import MIN_TRACK_PARTS, N_PARTS, make_boxes
from .section import Section
from .statistics import estimate_correlation, solve_biweight_step

N_SURROGATES = 100  # number of random traces with the spectrum of the first one
# Height of a track relative to the largest one in all random traces, above which it is not chance.
MIN_CLEARANCE = 1.2
FLANK_PARTS = 6  # smallest number of parts of each flank
MIN_PART_SAMPLES = 4  # smallest number of samples of a part
SPECTRUM_ERROR = 1.4  # widens the errors, because the spectrum of one trace is an estimate itself


def find_flanked_track(before: Profile, after: Profile) -> Section | None:
    """Find a track between flanks in the second trace; None if its roughness explains what is seen.

    A line with a box is fitted to means of parts. The box is a track if it is deeper than in all random
    traces with the spectrum of the first one (phases drawn, Theiler 1992), and if the flanks are no
    rougher than theirs. The errors are those of the same estimate in the random traces.
    """
    n = after.x.size
    if n < MIN_PART_SAMPLES * N_PARTS or before.x.size < MIN_PART_SAMPLES * N_PARTS:
        return None
    traces = _draw_traces(before, after)
    boxes = make_boxes(1, FLANK_PARTS, MIN_TRACK_PARTS)
    edges = np.linspace(0, n, N_PARTS + 1).astype(int)
    heights = -(boxes.shapes @ _average_parts(after.z[None], edges).T)[:, 0]
    chance = np.abs(boxes.shapes @ _average_parts(traces, edges).T).max()
    best = int(np.argmax(heights))
    if heights[best] <= MIN_CLEARANCE * chance:
        return None

    # The flanks keep a part of distance from the box, whose ends are known to one part.
    first, stop = boxes.spans[best]
    inside = slice(edges[max(first - 1, 0)], edges[min(stop + 1, N_PARTS)])
    beside = np.ones(n, bool)
    beside[inside] = False
    u = np.linspace(-1, 1, n)
    depth = _fit_line(u, after.z, beside) - after.z
    errors = np.array([_fit_line(u, z, beside) - z for z in traces])
    roughness = np.median(np.abs(errors[:, beside]), axis=1)
    if np.median(np.abs(depth[beside])) > MIN_CLEARANCE * roughness.max():
        return None
    # A round track reaches beyond the best box, up to where the means of parts are those of flanks.
    means = _average_parts(depth[None], edges)[0]
    scatter = _average_parts(errors, edges).std()
    while first > 1 and means[first - 1] > scatter:
        first -= 1
    while stop < N_PARTS - 1 and means[stop] > scatter:
        stop += 1
    worn = np.zeros(n, bool)
    worn[edges[first] : edges[stop]] = True
    noise = np.full(n, float(errors[:, beside].std()))
    return Section(
        x=after.x,
        depth=depth,
        noise=noise,
        unworn=beside,
        worn=worn,
        grown=np.zeros(n, bool),
        correlation=estimate_correlation(traces[0]),
        draws=SPECTRUM_ERROR * errors,
        changes=np.zeros((N_SURROGATES, 1)),
        after=-depth,
    )


def _draw_traces(before: Profile, after: Profile) -> np.ndarray:
    """Draw random traces (k, n) [m] with the spectrum of the first trace at the samples of the second."""
    random = np.random.default_rng(0)
    step = float(np.median(np.diff(after.x)))
    count = max(int(before.length / step), 2)
    x = before.x[0] + step * np.arange(count)
    z = np.interp(x, before.x, before.z)
    z = z - np.polyval(np.polyfit(x, z, 1), x)
    size = np.abs(np.fft.rfft(z * np.hanning(count))) * np.sqrt(8 / 3)
    phases = random.uniform(0, 2 * np.pi, (N_SURROGATES, size.size))
    drawn = np.fft.irfft(size * np.exp(1j * phases), count)
    # Pits and plateaus are not random waves, so half of the traces are the first one from other starts.
    for k in range(0, N_SURROGATES, 2):
        drawn[k] = np.roll(z, k * count // N_SURROGATES)[:: 1 if k % 4 else -1]
    repeats = -(-after.x.size // count)
    return np.tile(drawn, repeats)[:, : after.x.size]


def _average_parts(z, edges) -> np.ndarray:
    return np.add.reduceat(z, edges[:-1], axis=1) / np.diff(edges)


def _fit_line(place, z, beside) -> np.ndarray:
    """Return the line (n,) through the flanks; biweight steps give pile-up beside the track no weight."""
    base = np.column_stack((np.ones(place.size), place))
    line = np.zeros(2)
    sigma = np.inf
    for _ in range(10):
        residual = z[beside] - base[beside] @ line
        scale = 1e300 if sigma == np.inf else sigma
        line = line + solve_biweight_step(residual, -base[beside], scale)
        residual = z[beside] - base[beside] @ line
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 1e-15)
    return base @ line
