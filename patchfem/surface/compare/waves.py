"""Waves and roughness before and after wear: ratios of amplitude and slope, and sizes in a track."""

from collections.abc import Sequence

import numpy as np
from scipy import special

from ...core import PatchfemError
from ...formatting import format_length
from ..profile import find_runs
from ..quantity import Quantity
from ..roughness.filter import mean_surface
from ..roughness.report import fitting_cutoff
from ..spectrum import WAVE_BAND
from .depth_map import DepthMap
from .records import COMPARISON_DEFINITIONS, name_quantity, name_unknown
from .statistics import make_polynomials, smooth
from .track import get_margin

RATIO_NAMES = ("amplitude_ratio", "slope_ratio")


def compare_waves(
    lines: list[np.ndarray], step: float, noise: float, ends: Sequence[float] = ()
) -> dict[str, Quantity]:
    """Compute the ratios of amplitude and slope, after divided by before, with their intervals.

    Each line is levelled. The band is cut out by two Gaussian filters, and longer waves have no part in the slope. Waves
    shorter than 8 steps have none either, because one of the surfaces is interpolated between its samples. The noise of
    the slope is subtracted. The ends of tracks, whose flanks have all waves, do not count. The interval of the logarithm
    follows from the scatter of the ratios of blocks, which aligned surfaces share.

    Parameters
    ----------
    lines : list of (k, n) array [m]
        Lines before and after wear, at one step.
    step : float
        Step [m].
    noise : float
        Standard deviation of the depth [m], of both surfaces together.
    ends : sequence of float, optional
        Ends of tracks, in samples.

    Returns
    -------
    dict of str to Quantity
        "amplitude_ratio" and "slope_ratio", without value where noise or the length does not allow one.
    """
    is_kept = np.ones(lines[0].shape[1], bool)
    for end in ends:
        is_kept &= np.abs(np.arange(is_kept.size) - end) > WAVE_BAND[1] / step
    length = is_kept.sum() * step
    # A trace needs three of the longest waves, and four steps per shortest wave
    if length < 3.0 * WAVE_BAND[1] or step > WAVE_BAND[0] / 4.0:
        return {name: name_unknown(name, "band") for name in RATIO_NAMES}

    # The shape of a track has no part in its waves: the second filter removes what the first one leaves of a bend.
    lines = [_subtract_polynomial(line, 1) for line in lines]
    # Interpolation between samples changes the slope of waves longer than 8 steps by less than 1 %
    waves = (*WAVE_BAND, 8.0 * step)
    # The deviation of the Gaussian filter of ISO 16610-21 is .187 of its cut-off.
    deviations = [(0.0, 0.187 * wave / step) for wave in waves]
    lines = [z - smooth(z, deviations[1]) for z in lines]
    passed = [(smooth(z, deviations[0]) - smooth(z, deviations[1]))[:, is_kept] for z in lines]
    slopes = [(np.diff(smooth(z, deviations[2]), axis=1) / step)[:, is_kept[1:]] for z in lines]

    # White noise of each surface in the band of the amplitude, and behind the filter of the slope.
    white = noise / np.sqrt(2)
    band_noise = white * np.sqrt(2 * step * (1 / WAVE_BAND[0] - 1 / WAVE_BAND[1]))
    slope_noise = white / step * np.sqrt(1 / (4 * np.sqrt(np.pi) * deviations[2][1] ** 3))
    # Blocks that are shorter than two of the longest waves are correlated; 4 to 12 blocks show the scatter of a ratio
    n_blocks = int(np.clip(length / (2.0 * WAVE_BAND[1]), 4, 12))
    values = {}
    errors = (band_noise, slope_noise)
    for name, sizes, error in zip(RATIO_NAMES, (passed, slopes), errors):
        blocks = [_average_squares(np.array_split(size, n_blocks, 1)) for size in sizes]
        if _is_noise(error, blocks):
            values[name] = name_unknown(name, "noise")
            continue
        blocks = [block - error**2 for block in blocks]
        values[name] = name_quantity(name, *_divide_means(*blocks, 0.5))
    return values


def _subtract_polynomial(z, degree: int) -> np.ndarray:
    """Subtract the polynomial of least squares from heights z (n,), or from each line of z (k, n).

    The polynomial has this degree over the position in the line.
    """
    basis = make_polynomials(z.shape[-1], degree)
    return z - z @ basis @ basis.T


def _average_squares(parts: list[np.ndarray]) -> np.ndarray:
    """Return the mean squares (k,) of k arrays of values."""
    return np.array([np.mean(part**2) for part in parts])


def _is_noise(error: float, squares: Sequence[np.ndarray]) -> bool:
    """Return whether noise of a size is so large a part of one of two sizes that their ratio is unknown.

    Interpolation between the samples lowers the noise of one surface. `squares` are the mean squares (k,) in blocks of
    the sizes before and after wear.
    """
    smallest = min(block.mean() for block in squares)
    # Largest mean square of the noise, relative to that of a surface, at which the ratio
    # after/before of the surfaces is known
    return not smallest > 0 or error**2 > 0.5 * smallest


def _divide_means(before, after, power: float) -> np.ndarray:
    """Return the ratio of two means to a power, after divided by before wear, and the ends of its 95 % interval.

    `before` and `after` (k,) are means over the same k blocks of both surfaces, so that the scatter of the ratio does
    not contain that of the surface.
    """
    first = before.mean()
    second = after.mean()
    # Linearised ratio of two means: the scatter of its numerator and denominator together.
    influence = after / second - before / first
    scatter = power * influence.std(ddof=1) / np.sqrt(len(before))
    student = float(special.stdtrit(len(before) - 1, 0.975))
    # Standard deviation of a ratio due to tip, interpolation and datum
    width = student * float(np.hypot(scatter, 0.004))
    return (second / first) ** power * np.exp([0.0, -width, width])


def measure_roughness(
    depths: DepthMap, spans: list[tuple[int, int]], cutoff: float | None = None
) -> tuple[dict, float | None]:
    """Measure Ra, Rq and slope inside of the longest track and outside of all tracks, before and after wear.

    As in ISO 21920-2, they are those of the whole roughness profile about its mean line. The form of a part is
    subtracted, then its mean line; half a cut-off is left out beside the ends of a track, and half a cut-off more at
    the ends of the filter. The scatter of sections of a cut-off gives the intervals.

    Parameters
    ----------
    depths : DepthMap
        Of traces.
    spans : list
        First and last sample of each track, the longest one first.
    cutoff : float, optional
        Cut-off [m]; by default the longest standard one that fits both regions.

    Returns
    -------
    regions : dict
        {"inside", "outside": {"before", "after", "ratio": {name: Quantity}}}; {} if a region is too short.
    cutoff : float or None
        Cut-off [m] that fits both regions.

    Raises
    ------
    PatchfemError
        If the given cut-off does not fit them.
    """
    # Half a flank belongs neither to the track nor to what is beside it.
    step = depths.cell
    outside = np.ones(depths.x.size, bool)
    for first, last in spans:
        flank = get_margin((first, last))
        outside[max(first - flank, 0) : last + 1 + flank] = False
    flank = get_margin(spans[0])
    inside = [(spans[0][0] + flank, spans[0][1] - flank)]
    parts = {"inside": inside, "outside": find_runs(outside)}
    lengths = [max((last - first for first, last in runs), default=0) for runs in parts.values()]
    fitting = fitting_cutoff(min(lengths) * step, step)
    if cutoff is not None and not 4 * step <= cutoff <= (fitting or 0.0):
        longest = (
            f"the longest standard one is {format_length(fitting)}" if fitting else "none fits"
        )
        raise PatchfemError(
            f"compare: the cut-off {format_length(cutoff)} does not fit six times into the track and into what is beside "
            f"it, or is shorter than four steps; {longest}"
        )
    cutoff = cutoff or fitting
    if cutoff is None:
        return {}, None

    # Each region is cut into sections of one cut-off, whose parameters scatter. Their means have intervals.
    regions = {}
    edge = int(np.ceil(cutoff / 2 / step))
    for region, runs in parts.items():
        sizes = {}
        for side, z in zip(("before", "after"), depths.heights):
            sections = []
            for first, last in runs:
                part = z[first + edge : last + 1 - edge]
                # The bottom of a track is bent
                sections += _cut_sections(part, cutoff / step, {"inside": 4, "outside": 1}[region])
            sizes[side] = _measure_sections(sections, step)
        table = {"before": {}, "after": {}, "ratio": {}}
        # Power of the mean over sections that gives a size of the roughness
        for name, power in {"Ra": 1.0, "Rq": 0.5, "slope": 0.5}.items():
            pair = [sizes[side][name] for side in ("before", "after")]
            for side, values in zip(table, pair):
                bounds = _divide_means(np.ones(len(values)), values, power)
                table[side][name] = name_quantity(name, *bounds)
            text = f"{COMPARISON_DEFINITIONS[name][1]}, after wear divided by before"
            ratio = _divide_means(*pair, power).tolist()
            reason = ""
            if name == "slope" and _is_noise(depths.noise_level / step, pair):
                ratio = [None] * 3
                reason = "noise"
            table["ratio"][name] = Quantity(*ratio, "1", text, reason)
        regions[region] = table
    return regions, cutoff


def _cut_sections(z, cutoff: float, degree: int) -> list[np.ndarray]:
    """Subtract form and mean line from a part of a profile, and cut its roughness into sections; [] if it is too short.

    Parameters
    ----------
    z : (n,) array [m]
        Heights.
    cutoff : float
        Cut-off and length of a section, in samples.
    degree : int
        Degree of the polynomial that is the form.
    """
    edge = int(np.ceil(cutoff / 2))
    count = int((z.size - 2 * edge) / cutoff)
    if count < 1:
        return []
    z = _subtract_polynomial(z, degree)
    rough = z - mean_surface(z, (cutoff,))
    return np.array_split(rough[edge : z.size - edge], count)


def _measure_sections(sections: list[np.ndarray], step: float) -> dict[str, np.ndarray]:
    """Return the mean (k,) in each section of the absolute height [m], of its square, and of the squared slope.

    `sections` are arrays of heights (n,) [m] with this step [m] between neighbours.
    """
    return {
        "Ra": np.array([np.abs(part).mean() for part in sections]),
        "Rq": _average_squares(sections),
        "slope": _average_squares([np.diff(part) / step for part in sections]),
    }
