"""Waves and roughness before and after wear: ratios of amplitude and slope, and sizes in a track."""

from itertools import pairwise

import numpy as np
from scipy import ndimage, special

from ...core import PatchfemError
from ..profile import Profile
from ..quantity import SIDE, Quantity
from ..roughness.filter import filter_trace
from ..roughness.report import fitting_cutoff
from ..roughness.spectrum import BAND
from .records import DEFINITIONS, TraceCurves, name_quantity, name_unknown

MAX_BLOCKS = 12  # largest number of blocks whose ratios show the scatter of a ratio
MIN_BLOCKS = 4  # smallest number of blocks
BLOCK_WAVES = 2.0  # smallest length of a block in the longest wave; shorter blocks are correlated
CUTOFF_TO_DEVIATION = (
    0.187  # deviation of the Gaussian filter of ISO 16610-21 relative to its cut-off
)
RATIO_ERROR = 0.004  # standard deviation of a ratio due to tip, interpolation and datum
MAX_NOISE_FRACTION = 0.5  # noise relative to the size of the surface above which a ratio is unknown
MIN_CUTOFFS = 2.0  # smallest length of a piece in cut-offs, half of one is trimmed at each end
MIN_WAVES = 3.0  # smallest length of a trace relative to the longest wave of the band
# Sizes of the roughness in a track.
ROUGHNESS_NAMES = ("Ra", "Rq", "slope")
MIN_STEPS = 4.0  # smallest length of the shortest wave of the band in steps


def compare_waves(lines: list[np.ndarray], step: float, noise: float) -> dict[str, Quantity]:
    """Compute the ratios of amplitude and slope, after divided by before, with their intervals.

    The band is cut out by two Gaussian filters. The interval of the logarithm follows from the scatter of
    the ratios of blocks, which aligned surfaces share.

    Parameters
    ----------
    lines : list of (k, n) array [m]
        Levelled lines before and after wear, at one step.
    step : float
        Step [m].
    noise : float
        Standard deviation of the depth [m], of both surfaces together.
    """
    length = min(line.shape[1] for line in lines) * step
    if length < MIN_WAVES * BAND[1] or step > BAND[0] / MIN_STEPS:
        return {name: name_unknown(name, "band") for name in ("amplitude_ratio", "slope_ratio")}
    passed = [_pass_band(z, step) for z in lines]
    slopes = [np.diff(z, axis=1) / step for z in lines]
    # White noise has the slope noise sqrt(2)/step, and the fraction of its band in the amplitude.
    band_noise = noise / np.sqrt(2) * np.sqrt(2 * step * (1 / BAND[0] - 1 / BAND[1]))
    count = int(np.clip(length / (BLOCK_WAVES * BAND[1]), MIN_BLOCKS, MAX_BLOCKS))
    if min(len(line) for line in lines) >= MAX_BLOCKS:
        count = MAX_BLOCKS  # groups of lines
    values = {}
    for name, sizes, error in (
        ("amplitude_ratio", passed, band_noise),
        ("slope_ratio", slopes, noise / step),
    ):
        blocks = np.array([_mean_squares(size, count) for size in sizes])
        totals = blocks.mean(axis=1)
        if not totals.min() > 0 or error**2 > MAX_NOISE_FRACTION * totals.min():
            values[name] = name_unknown(name, "noise")
            continue
        ratio = _divide_means(*blocks, 0.5, DEFINITIONS[name][1])
        values[name] = ratio._replace(name=name)
    return values


def _divide_means(before, after, power: float, text: str) -> Quantity:
    """Return the ratio of the means of blocks (k,), after divided by before, to a power; text: its definition.

    Both surfaces have the same blocks, so the scatter of the ratio does not contain that of the surface.
    """
    first = before.mean()
    second = after.mean()
    ratio = float((second / first) ** power)
    if len(before) < 2:
        return Quantity(ratio, None, None, "1", text)
    # Linearised ratio of two means: the scatter of its numerator and denominator together.
    influence = after / second - before / first
    scatter = power * influence.std(ddof=1) / np.sqrt(len(before))
    student = float(special.stdtrit(len(before) - 1, 0.975))
    width = student * float(np.hypot(scatter, RATIO_ERROR))
    ends = ratio * np.exp(np.array([-width, width]))
    return Quantity(ratio, *ends.tolist(), "1", text)


def _pass_band(z, step: float) -> np.ndarray:
    """Return the waves (k, n) [m] of the band."""
    short, long = (CUTOFF_TO_DEVIATION * wave / step for wave in BAND)
    return ndimage.gaussian_filter1d(z, short) - ndimage.gaussian_filter1d(z, long)


def _mean_squares(values, count: int) -> np.ndarray:
    """Return the mean squares of blocks: along a single line, or of groups of lines."""
    parts = np.array_split(values, count, axis=0 if len(values) >= MAX_BLOCKS else 1)
    return np.array([np.mean(part**2) for part in parts])


def measure_roughness(curves: TraceCurves, spans) -> tuple[dict, float | None]:
    """Measure Ra, Rq and slope inside and outside of the tracks, before and after wear.

    Returns
    -------
    regions : dict
        {"inside", "outside": {"before", "after", "ratio": {name: Quantity}}}; {} if a region is too short.
    cutoff : float or None
        Cut-off [m] that fits both regions.
    """
    edges = [
        0,
        *(index for first, last in sorted(spans) for index in (first, last)),
        curves.x.size - 1,
    ]
    pieces = list(pairwise(edges))
    groups = {"outside": pieces[::2], "inside": pieces[1::2]}
    step = float(np.median(np.diff(curves.x)))
    lengths = [max((last - first for first, last in group), default=0) for group in groups.values()]
    cutoff = fitting_cutoff(min(lengths) * step, step)
    if cutoff is None:
        return {}, None
    regions = {}
    for region, group in groups.items():
        tables = [
            _tabulate_sections(curves.x, z, group, cutoff) for z in (curves.before, curves.after)
        ]
        if not all(table.size for table in tables):
            return {}, None
        regions[region] = {
            "before": _pool(tables[0]),
            "after": _pool(tables[1]),
            "ratio": _divide(*tables),
        }
    return regions, cutoff


def _tabulate_sections(x, z, pieces, cutoff: float) -> np.ndarray:
    """Return Ra [m], mean square height [m2] and mean square slope (k, 3) of the sections of one cut-off."""
    step = float(np.median(np.diff(x)))
    sections = []
    for first, last in pieces:
        if x[last] - x[first] < MIN_CUTOFFS * cutoff:
            continue
        places = np.arange(x[first], x[last], step)
        piece = Profile(places, np.interp(places, x, z), "piece")
        try:
            rough = filter_trace(piece, cutoff)[1].z
        except PatchfemError:
            continue
        count = max(int(rough.size * step / cutoff), 1)
        for part in np.array_split(rough, count):
            slope = np.mean(np.diff(part) ** 2) / step**2
            sections.append((np.abs(part).mean(), np.mean(part**2), slope))
    return np.array(sections)


def _pool(table) -> dict[str, Quantity]:
    """Return the sizes of sections (k, 3) together; their scatter gives the intervals."""
    means = table.mean(axis=0)
    errors = SIDE * table.std(axis=0, ddof=1) / np.sqrt(len(table)) if len(table) > 1 else means
    out = {}
    for k, name in enumerate(ROUGHNESS_NAMES):
        bounds = np.array([means[k], max(means[k] - errors[k], 0.0), means[k] + errors[k]])
        if name != "Ra":
            bounds = np.sqrt(bounds)
        out[name] = name_quantity(name, *bounds)
    return out


def _divide(before, after) -> dict[str, Quantity]:
    """Return the ratios of the sizes of sections (k, 3), after divided by before, with their intervals."""
    out = {}
    for k, name in enumerate(ROUGHNESS_NAMES):
        text = f"{DEFINITIONS[name][1]}, after wear divided by before"
        power = 1.0 if name == "Ra" else 0.5
        out[name] = _divide_means(before[:, k], after[:, k], power, text)
    return out
