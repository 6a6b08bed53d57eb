"""Track in the second trace alone, measured below the straight line through its unworn flanks.

It serves where both traces have no heights in common: the track left nothing of the old surface, or
the first trace was measured at another place and shows the roughness only.
"""

import numpy as np

from .changes import MIN_TRACK_PARTS, N_PARTS, make_boxes
from .depth_map import DepthErrors, DepthMap
from .raster import Raster, fill_gaps
from .statistics import estimate_correlation, solve_biweight_step

N_SURROGATES = 100  # number of random traces with the spectrum of the first one
# Height of a track relative to the largest one in all random traces, above which it is not chance.
MIN_CLEARANCE = 1.2
FLANK_PARTS = 6  # smallest number of parts of each flank
MIN_PART_SAMPLES = 4  # smallest number of samples of a part
SPECTRUM_ERROR = 1.4  # widens the errors, because the spectrum of one trace is an estimate itself


def find_flanked_track(first: Raster, second: Raster) -> DepthMap | None:
    """Find a track between flanks in the second trace; None if its roughness explains what is seen.

    A line with a box is fitted to means of parts. The box is a track if it is deeper than in all random
    traces with the spectrum of the first one (phases drawn, Theiler 1992), and if the flanks are no
    rougher than theirs. The errors are those of the same estimate in the random traces.
    """
    z = fill_gaps(second.z)
    if min(z.size, first.z.size) < MIN_PART_SAMPLES * N_PARTS:
        return None
    traces = _draw_traces(first, second)
    boxes = make_boxes(1, FLANK_PARTS, MIN_TRACK_PARTS)
    edges = np.linspace(0, z.size, N_PARTS + 1).astype(int)
    heights = -(boxes.shapes @ _average_parts(z[None], edges).T)[:, 0]
    chance = np.abs(boxes.shapes @ _average_parts(traces, edges).T).max()
    best = int(np.argmax(heights))
    if heights[best] <= MIN_CLEARANCE * chance:
        return None

    # The flanks keep a part of distance from the box, whose ends are known to one part.
    start, stop = boxes.spans[best]
    beside = np.ones(z.size, bool)
    beside[edges[max(start - 1, 0)] : edges[min(stop + 1, N_PARTS)]] = False
    depth = _subtract_line(z, beside)
    errors = np.array([_subtract_line(trace, beside) for trace in traces])
    roughness = np.median(np.abs(errors[:, beside]), axis=1)
    if np.median(np.abs(depth[beside])) > MIN_CLEARANCE * roughness.max():
        return None
    # A round track reaches beyond the best box, up to where the means of parts are those of flanks.
    means = _average_parts(depth[None], edges)[0]
    scatter = _average_parts(errors, edges).std()
    while start > 1 and means[start - 1] > scatter:
        start -= 1
    while stop < N_PARTS - 1 and means[stop] > scatter:
        stop += 1
    worn = np.zeros(z.size, bool)
    worn[edges[start] : edges[stop]] = True
    missing = np.isnan(second.z)
    return DepthMap(
        x=second.axes[0],
        before=0.0 * depth,
        after=-depth,
        depth=depth,
        noise=np.full(z.size, float(errors[:, beside].std())),
        unworn=beside,
        worn=worn,
        grown=np.zeros(z.size, bool),
        inside=np.ones(z.size, bool),
        missing=missing,
        cell=float(second.steps[0]),
        errors=DepthErrors(
            variance=lambda part: SPECTRUM_ERROR**2 * float(np.var(errors[:, part].sum(axis=1))),
            correlation=estimate_correlation(traces[0]),
        ),
    )


def _draw_traces(first: Raster, second: Raster) -> np.ndarray:
    """Draw random traces (k, n) [m] with the spectrum of the first trace at the samples of the second."""
    random = np.random.default_rng(0)
    step = float(second.steps[0])
    count = max(int(first.lengths[0] / step), 2)
    x = step * np.arange(count)
    z = np.interp(x, first.axes[0] - first.origin[0], fill_gaps(first.z))
    z = z - np.polyval(np.polyfit(x, z, 1), x)
    size = np.abs(np.fft.rfft(z * np.hanning(count))) * np.sqrt(8 / 3)
    phases = random.uniform(0, 2 * np.pi, (N_SURROGATES, size.size))
    drawn = np.fft.irfft(size * np.exp(1j * phases), count)
    # Pits and plateaus are not random waves, so half of the traces are the first one from other starts.
    for k in range(0, N_SURROGATES, 2):
        drawn[k] = np.roll(z, k * count // N_SURROGATES)[:: 1 if k % 4 else -1]
    repeats = -(-second.z.size // count)
    return np.tile(drawn, repeats)[:, : second.z.size]


def _average_parts(z, edges) -> np.ndarray:
    return np.add.reduceat(z, edges[:-1], axis=1) / np.diff(edges)


def _subtract_line(z, beside) -> np.ndarray:
    """Return the depths (n,) below the line through the flanks; pile-up beside the track gets no weight."""
    base = np.column_stack((np.ones(z.size), np.linspace(-1, 1, z.size)))
    line = np.linalg.lstsq(base[beside], z[beside], rcond=None)[0]
    for _ in range(10):
        residual = z[beside] - base[beside] @ line
        sigma = max(1.4826 * float(np.median(np.abs(residual))), 1e-15)
        line = line + solve_biweight_step(residual, -base[beside], sigma)
    return base @ line - z
