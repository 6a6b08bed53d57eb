"""Mean section across a track of a scan, which is measured like a trace."""

import numpy as np

from .changes import find_changed
from .depth_map import UNWORN_LIMIT, DepthErrors, DepthMap
from .depths import estimate_variance
from .records import Track, name_quantity
from .statistics import estimate_one_sided_scale
from .track import find_spans, measure_track

MIN_ELONGATION = 2.0  # length of a worn place relative to its width, from which on it is a track
END_QUANTILE = 0.05  # fraction of the worn points beyond each end of the sections
MIN_SECTIONS = 8  # smallest number of sections across a track


def average_section(scan: DepthMap) -> tuple[Track, ...]:
    """Measure the mean section across an elongated worn place; () if it is not one."""
    y, x = np.meshgrid(scan.y, scan.x, indexing="ij")
    weights = np.maximum(scan.depth[scan.worn], 0.0)
    points = np.array([x[scan.worn], y[scan.worn]])
    moments, axes = np.linalg.eigh(np.cov(points, aweights=weights))
    if moments[1] < MIN_ELONGATION**2 * max(moments[0], 1e-300):
        return ()
    along = axes[:, 1] if axes[0, 1] >= 0 else -axes[:, 1]
    across = np.array([-along[1], along[0]])
    across *= np.sign(across[np.argmax(np.abs(across))])

    # Means over the sections that cross the worn place.
    places = across[0] * x + across[1] * y
    lengths = along[0] * x + along[1] * y
    ends = np.quantile(lengths[scan.worn], (END_QUANTILE, 1 - END_QUANTILE))
    step = float(max(np.diff(axis).mean() for axis in (scan.y, scan.x)))
    n_sections = int(np.ptp(ends) / step)
    use = scan.inside & ~scan.missing & (lengths >= ends[0]) & (lengths <= ends[1])
    bins = ((places[use] - places.min()) / step).astype(int)
    counts = np.bincount(bins)
    full = np.flatnonzero(counts > n_sections / 2)
    if n_sections < MIN_SECTIONS or full.size < 4 * MIN_SECTIONS:
        return ()
    depth, squares, after = (
        np.bincount(bins, values[use])[full] / counts[full]
        for values in (scan.depth, scan.depth**2, scan.after)
    )
    scatter = np.sqrt(np.maximum(squares - depth**2, 0.0))
    v = places.min() + (full + 0.5) * step

    sigma = estimate_one_sided_scale(depth)
    noise = np.full(depth.size, sigma)
    worn = find_changed(depth, noise)
    unworn = (np.abs(depth) < UNWORN_LIMIT * sigma) & ~worn
    if not worn.any() or unworn.sum() < MIN_SECTIONS:
        return ()
    base = np.vander(np.linspace(-1, 1, v.size), 2, increasing=True).T
    variance, drift = estimate_variance(depth, noise, unworn, base)
    section = DepthMap(
        x=v,
        before=after + depth,
        after=after,
        depth=depth,
        noise=noise,
        unworn=unworn,
        worn=worn,
        grown=find_changed(-depth, noise) & ~worn,
        inside=np.ones(v.size, bool),
        missing=np.zeros(v.size, bool),
        cell=step,
        errors=DepthErrors(variance, drift, model=scan.errors.model),
    )
    track = measure_track(section, find_spans(section)[0])
    length = float(np.ptp(lengths[scan.worn]))
    direction = float(np.arctan2(along[1], along[0]))
    values = track.values | {
        "direction": name_quantity("direction", direction, None, None),
        "length": name_quantity("length", length, max(length - 2 * step, 0.0), length + 2 * step),
        "volume": name_quantity(
            "volume", *(bound * length for bound in track.values["area_gross"][:3])
        ),
    }
    return (Track(values, track.cut, (v, depth, scatter), n_sections),)
