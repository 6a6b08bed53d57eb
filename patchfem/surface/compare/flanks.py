"""Track in the second trace alone, measured below the straight line through its unworn flanks.

It serves where both traces have no heights in common: the track left nothing of the old surface, or
the first trace was measured at another place and shows the roughness only.
"""

import numpy as np

from ...core import max_abs
from ..profile import find_runs
from .changes import MIN_SHALLOW_TRACK_PARTS, N_TRACE_PARTS, make_boxes
from .depth_map import DepthMap
from .depths import make_section
from .raster import Raster, fill_gaps
from .statistics import subtract_plane

# Number of shifted copies of the first trace, and of copies with random phases, that show what its roughness alone does
N_SHIFTED_COPIES = 50
# Height of a track relative to the largest one in the copies of the first trace, above which it is not chance
MIN_TRACK_OVER_CHANCE_HEIGHT = 1.2


def find_flanked_track(first: Raster, second: Raster) -> DepthMap | None:
    """Find a track between flanks in the second trace; None if its roughness explains what is seen.

    A line with a box is fitted to means of 60 parts. The box is a track if it is deeper than in the first trace from 50
    starts and with 50 random phases (Theiler 1992), and if the flanks are no rougher than this trace.

    Parameters
    ----------
    first, second : Raster
        Traces before and after wear, which share no place.

    Returns
    -------
    DepthMap or None
        Depths of the second trace below the line through its flanks.
    """
    z = fill_gaps(second.z)
    step = float(second.steps[0])
    count = int(first.lengths[0] / step)
    # Smallest number of samples of a part
    if min(z.size, count) < 4 * N_TRACE_PARTS:
        return None
    rough = np.interp(step * np.arange(count), first.axes[0] - first.origin[0], fill_gaps(first.z))
    rough = subtract_plane(rough, np.array([np.ones(count), np.linspace(-1, 1, count)]))
    # Pits and plateaus are no random waves, so other starts of the trace count as well as other phases of its waves.
    random = np.random.default_rng(0)
    waves = np.fft.rfft(rough)
    traces = []
    for start in np.arange(N_SHIFTED_COPIES) * count // N_SHIFTED_COPIES:
        phases = np.exp(2j * np.pi * random.random(waves.size))
        traces.append(np.resize(np.roll(rough, start), z.size))
        traces.append(np.resize(np.fft.irfft(np.abs(waves) * phases, count), z.size))

    edges = np.linspace(0, z.size, N_TRACE_PARTS + 1).astype(int)
    means, *others = np.add.reduceat([z, *traces], edges[:-1], axis=1) / np.diff(edges)
    # Smallest number of parts of each flank
    boxes = make_boxes(1, 6, MIN_SHALLOW_TRACK_PARTS)
    heights = -boxes.shapes @ means
    best = int(np.argmax(heights))
    if heights[best] <= MIN_TRACK_OVER_CHANCE_HEIGHT * max_abs(boxes.shapes @ np.array(others).T):
        return None

    # The flanks keep a part of distance from the box, whose ends are known to one part.
    start, stop = boxes.spans[best]
    is_flank = np.ones(N_TRACE_PARTS, bool)
    is_flank[start - 1 : stop + 1] = False
    # Pile-up on the flanks does not move the line of repeated medians.
    from scipy import stats

    centers = (edges[1:] + edges[:-1] - 1) / 2
    line = stats.siegelslopes(means[is_flank], centers[is_flank])
    depth = np.polyval(line[:2], np.arange(z.size)) - z
    beside = np.repeat(is_flank, np.diff(edges))
    roughness = np.median(np.abs(np.array(traces)[:, beside]), axis=1)
    if np.median(np.abs(depth[beside])) > MIN_TRACK_OVER_CHANCE_HEIGHT * roughness.max():
        return None

    # A round track reaches beyond the best box, up to where the means of parts are those of flanks.
    is_low = np.polyval(line[:2], centers) - means > np.std(others)
    is_low[start:stop] = True
    is_low[[0, -1]] = False
    start, stop = next(run for run in find_runs(is_low) if run[0] <= start <= run[1])
    worn = np.zeros(z.size, bool)
    worn[edges[start] : edges[stop + 1]] = True
    sigma = float(depth[beside].std())
    return make_section(second.axes[0], depth, sigma, worn, np.isnan(second.z))
