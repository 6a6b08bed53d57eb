"""Gaussian filters: a trace splits into waviness and roughness at a cut-off (ISO 16610-21), a scan likewise (-61)."""

from dataclasses import replace

import numpy as np

from ...core import PatchfemError, frozen_array, say
from ..areal import Areal
from ..profile import Profile, even, level

ALPHA = np.sqrt(np.log(2) / np.pi)  # half of a wave as long as the cut-off passes
REACH = 1.25  # cut-offs to either side; beyond them lies 1.5e-10 of the weight
FEWEST = 4  # steps of a cut-off


def filtered(profile: Profile, cutoff: float, ends: str = "trimmed") -> tuple:
    """Waviness and roughness of a trace at a cut-off [m], both of them a Profile.

    The trace is put on an even step (`even`), its least-squares line is subtracted, and the weighting function of
    ISO 16610-21, exp(-pi (x / (alpha cutoff))^2) / (alpha cutoff) with alpha = sqrt(ln 2 / pi), takes the mean line.
    ends: "trimmed": half a cut-off is left off at each end, and where the weighting function still reaches beyond the
    trace, the part within is scaled to a sum of one; "whole": nothing is left off, and the mean line at the ends is
    that of the weighted least-squares line (ISO 16610-28, first moment). PatchfemError for a cut-off of fewer
    than four steps or, trimmed, as long as the trace.
    """
    if ends not in ("trimmed", "whole"):
        raise PatchfemError(f"a filtered trace has no treatment of its ends called '{ends}'; use trimmed or whole")
    flat = level(even(profile))
    step = flat.length / (flat.x.size - 1)
    _refuse_short(profile.source, cutoff, step)
    edge = int(np.ceil(cutoff / 2 / step * (1 - 1e-9))) if ends == "trimmed" else 0
    if 2 * edge > flat.x.size - 2 or cutoff > 2 * flat.length:
        raise PatchfemError(f"{profile.source}: the trace is {say(flat.length)} long; half a cut-off of {say(cutoff)} "
                            "is trimmed at each end, so the cut-off must be shorter than the trace")
    line = mean_line(flat.z, cutoff / step, ends == "whole")
    keep = slice(edge, flat.x.size - edge)
    x = frozen_array(flat.x[keep])
    return (replace(flat, x=x, z=frozen_array(line[keep])), replace(flat, x=x, z=frozen_array((flat.z - line)[keep])))


def _refuse_short(source: str, cutoff: float, step: float) -> None:
    if not np.isfinite(cutoff) or cutoff < FEWEST * step * (1 - 1e-9):
        raise PatchfemError(f"{source}: a cut-off of {say(cutoff)} is shorter than {FEWEST} steps of {say(step)}; for "
                            f"this trace the cut-off must be at least {say(FEWEST * step)}")


def filtered_scan(scan: Areal, cutoff: float) -> tuple:
    """Waves longer and shorter than a cut-off [m] (the nesting index) of a scan, both of them an Areal.

    The weighting function is that of ISO 16610-61, the product of those of a trace along x and along y. Half a cut-off
    is left off at each border. A missing height has no weight and stays missing; beside it, and where the function
    still reaches beyond the border, the part on measured heights is scaled to a sum of one. The scan should be level:
    its form is bent beside holes and borders. PatchfemError for a cut-off of fewer than four steps or as long as the
    shorter side. 1000 x 1000 heights: 0.4 s.
    """
    steps = [float(axis[-1] - axis[0]) / (axis.size - 1) for axis in (scan.y, scan.x)]
    _refuse_short(scan.source, cutoff, max(steps))
    edges = [int(np.ceil(cutoff / 2 / step * (1 - 1e-9))) for step in steps]
    if any(2 * edge > count - 2 for edge, count in zip(edges, scan.z.shape)):
        short = min(float(axis[-1] - axis[0]) for axis in (scan.y, scan.x))
        raise PatchfemError(f"{scan.source}: the shorter side is {say(short)} long; half a cut-off of {say(cutoff)} "
                            "is trimmed at each border, so the cut-off must be shorter than that side")
    waves = mean_surface(scan.z, tuple(cutoff / step for step in steps))
    rows, columns = (slice(edge, count - edge) for edge, count in zip(edges, scan.z.shape))
    inner = replace(scan, x=frozen_array(scan.x[columns]), y=frozen_array(scan.y[rows]))
    return (replace(inner, z=frozen_array(waves[rows, columns])),
            replace(inner, z=frozen_array((scan.z - waves)[rows, columns])))


def mean_surface(z: np.ndarray, cutoffs: tuple) -> np.ndarray:
    """Mean surface (m, n) of heights z (m, n), NaN where missing, at cut-offs in steps down and along the rows."""
    from scipy.signal import oaconvolve

    there, sums = ~np.isnan(z), []
    for values in (np.where(there, z, 0.0), there.astype(float)):
        for axis, cutoff in enumerate(cutoffs):
            half = min(int(np.ceil(REACH * cutoff)), z.shape[axis] - 1)
            weight = np.exp(-np.pi * (np.arange(-half, half + 1.0) / (ALPHA * cutoff)) ** 2)
            values = oaconvolve(values, np.expand_dims(weight, 1 - axis), "same", axes=axis)
        sums.append(values)
    return np.divide(*sums, out=np.full(z.shape, np.nan), where=there)


def mean_line(z: np.ndarray, cutoff: float, tilted: bool = False) -> np.ndarray:
    """Mean line (n,) of even heights z (n,) at a cut-off in steps, scaled at the ends, or tilted with the trace there.

    One transform of the length of the trace and the weighting function. A million samples: 0.2 s.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    half = min(int(np.ceil(REACH * cutoff)), z.size - 1)
    t = np.arange(-half, half + 1.0)
    weight = np.exp(-np.pi * (t / (ALPHA * cutoff)) ** 2)
    size = next_fast_len(z.size + half, real=True)  # what wraps falls beyond the trace
    transform = rfft(z, size)

    def through(kernel):
        return irfft(transform * rfft(np.roll(np.pad(kernel, (0, size - kernel.size)), -half), size), size)[:z.size]

    line = through(weight) / weight.sum()
    last = min(half, (z.size - 1) // 2) + 1  # samples that see an end
    for flip in (False, True):
        place = np.arange(z.size)[::-1][:last] if flip else np.arange(last)
        line[place] = _at_end(z[::-1] if flip else z, weight, last, line[place] * weight.sum(), tilted)
    return line


def _at_end(z, weight, last: int, means, tilted: bool) -> np.ndarray:
    """Mean line at the first samples, whose weights start at the first sample and, in short traces, end at the last."""
    half, at = weight.size // 2, np.arange(last)
    low, high = np.maximum(half - at, 0), np.minimum(half + z.size - at, weight.size)

    def moment(values):
        total = np.concatenate([[0.0], np.cumsum(values)])
        return total[high] - total[low]

    t = np.arange(-half, half + 1.0)
    m0 = moment(weight)
    if not tilted:
        return means / m0
    m1, m2 = moment(weight * t), moment(weight * t * t)
    first = np.array([(weight[a:b] * t[a:b]) @ z[i - half + a:i - half + b] for i, a, b in zip(at, low, high)])
    return (means * m2 - first * m1) / (m0 * m2 - m1**2)
