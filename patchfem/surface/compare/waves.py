"""Waves and roughness before and after wear: ratios of amplitude and slope, and sizes in a track."""

import numpy as np
from scipy import ndimage, special

from ..profile import find_runs
from ..quantity import SIDE, Quantity
from ..roughness.filter import mean_surface
from ..roughness.report import fitting_cutoff
from ..roughness.spectrum import BAND
from .depth_map import DepthMap
from .records import DEFINITIONS, name_quantity, name_unknown

MAX_BLOCKS = 12  # largest number of blocks whose ratios show the scatter of a ratio
MIN_BLOCKS = 4  # smallest number of blocks
BLOCK_WAVES = 2.0  # smallest length of a block in the longest wave; shorter blocks are correlated
# Deviation of the Gaussian filter of ISO 16610-21 relative to its cut-off.
CUTOFF_TO_DEVIATION = 0.187
RATIO_ERROR = 0.004  # standard deviation of a ratio due to tip, interpolation and datum
MAX_NOISE_FRACTION = 0.5  # noise relative to the size of the surface above which a ratio is unknown
MIN_WAVES = 3.0  # smallest length of a trace relative to the longest wave of the band
MIN_STEPS = 4.0  # smallest length of the shortest wave of the band in steps
# Sizes of the roughness in a track.
ROUGHNESS_NAMES = ("Ra", "Rq", "slope")


def compare_waves(lines: list[np.ndarray], step: float, noise: float) -> dict[str, Quantity]:
    """Compute the ratios of amplitude and slope, after divided by before, with their intervals.

    Each line is levelled. The band is cut out by two Gaussian filters. The interval of the logarithm follows from
    the scatter of the ratios of blocks, which aligned surfaces share.

    Parameters
    ----------
    lines : list of (k, n) array [m]
        Lines before and after wear, at one step.
    step : float
        Step [m].
    noise : float
        Standard deviation of the depth [m], of both surfaces together.
    """
    n_lines, count = np.min([line.shape for line in lines], axis=0)
    length = count * step
    if length < MIN_WAVES * BAND[1] or step > BAND[0] / MIN_STEPS:
        return {name: name_unknown(name, "band") for name in ("amplitude_ratio", "slope_ratio")}
    lines = [_level(line[:n_lines, :count]) for line in lines]
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


def _level(lines) -> np.ndarray:
    """Subtract its least-squares line from each line (k, n)."""
    base = np.vander(np.linspace(-1, 1, lines.shape[1]), 2)
    return lines - (base @ np.linalg.lstsq(base, lines.T, rcond=None)[0]).T


def measure_roughness(depths: DepthMap, spans) -> tuple[dict, float | None]:
    """Measure Ra, Rq and slope inside and outside of the tracks, before and after wear.

    Half a cut-off of the roughness profile is trimmed on both sides of an end of a track.

    Parameters
    ----------
    depths : DepthMap
        Of traces.
    spans : list
        First and last sample of each track.

    Returns
    -------
    regions : dict
        {"inside", "outside": {"before", "after", "ratio": {name: Quantity}}}; {} if a region is too short.
    cutoff : float or None
        Cut-off [m] that fits both regions.
    """
    step = depths.cell
    inside = np.zeros(depths.x.size, bool)
    for first, last in spans:
        inside[first : last + 1] = True
    pieces = {"inside": find_runs(inside), "outside": find_runs(~inside)}
    lengths = [max((last - first for first, last in runs), default=0) for runs in pieces.values()]
    cutoff = fitting_cutoff(min(lengths) * step, step)
    if cutoff is None:
        return {}, None

    rough = {}
    for side in ("before", "after"):
        z = getattr(depths, side)
        rough[side] = z - mean_surface(z, (cutoff / step,))
    edge = int(np.ceil(cutoff / 2 / step))
    regions = {}
    for region, runs in pieces.items():
        sections = []
        for first, last in runs:
            kept = np.arange(first + edge, last + 1 - edge)
            if kept.size > edge:
                sections += np.array_split(kept, max(int(kept.size * step / cutoff), 1))
        if not sections:
            return {}, None
        tables = {side: _tabulate(z, sections, step) for side, z in rough.items()}
        regions[region] = {side: _pool(table) for side, table in tables.items()}
        regions[region]["ratio"] = _divide(tables["before"], tables["after"])
    return regions, cutoff


def _tabulate(z, sections: list, step: float) -> np.ndarray:
    """Return Ra [m], mean square height [m2] and mean square slope (k, 3) of sections."""
    parts = [z[section] for section in sections]
    sizes = [
        (np.abs(part).mean(), np.mean(part**2), np.mean(np.diff(part) ** 2) / step**2)
        for part in parts
    ]
    return np.array(sizes)


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
