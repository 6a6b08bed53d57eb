"""Ratio of two amplitudes or slopes with the interval that single traces allow."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, frozen_array
from ..areal import Areal, filled, level_plane
from ..profile import Profile, even, level
from ..quantity import LEVEL, SIDE, Quantity, refused
from ..roughness.intervals import Intervals
from ..roughness.parameters import Heights
from ..roughness.spectrum import BAND, Spectrum, amplitude_of, refuse_band, spectrum_of

BEYOND = 0.004  # standard deviation of a ratio by what noise does not tell: the tip, interpolation, the datum
BRIDGED = 1 / 3  # of the heights of a trace of a scan, at most, may be missing
MOST = 256  # traces of a scan in one direction that are read, spread over it: neighbours tell nearly the same
PLACES = 6  # parts of a trace whose mean squares scatter from place to place


class Size(NamedTuple):
    """Amplitude of the band [m] and root mean square of the slope [1], their degrees of freedom, and the spectrum."""

    amplitude: float
    slope: float
    freedom: tuple
    spectrum: Spectrum


def size_of(trace: Profile, step: float, band: tuple = BAND) -> Size:
    """Amplitude and slope of a trace, read at a step [m] so that slopes of several traces compare.

    PatchfemError where the trace cannot show the band.
    """
    z, step = at_step(trace, step)
    refuse_band(trace.source, *band, step * (z.size - 1), step)
    return _size(z, step, band)


def _size(z, step: float, band: tuple) -> Size:
    found = spectrum_of(z, step)
    heights = Heights(z, step)
    inner = Intervals(heights, 1, found, band)
    freedom = (inner.freedom("band"), inner.freedom("slope")) if found.density.any() else (1.0, 1.0)
    return Size(amplitude_of(found, *band), float(np.sqrt(np.mean(np.diff(z) ** 2))) / step, freedom, found)


def at_step(trace: Profile, step: float) -> tuple:
    """Levelled heights (n,) [m] of a trace near a step [m] that is no finer than its own, and that step."""
    flat = level(even(trace))
    own = flat.length / (flat.x.size - 1)
    if step < own * 1.01:
        return flat.z, own
    count = int(flat.length / step * (1 + 1e-9)) + 1
    x = flat.x[0] + step * np.arange(count)
    flat = level(Profile(frozen_array(x), frozen_array(np.interp(x, flat.x, flat.z)), flat.source))
    return flat.z, step


def bridged(scan: Areal) -> tuple:
    """A scan about its least-squares plane with a smooth surface over missing heights, and which these are (m, n)."""
    flat = level_plane(scan)
    return replace(flat, z=filled(flat.z, flat.missing)), flat.missing


def size_along(scan: Areal, lost, direction: str, band: tuple = BAND) -> Size:
    """Amplitude and slope of the traces of a `bridged` scan in one direction, rows for x and columns for y.

    Mean squares are averaged, of traces of which a third at most was missing, `MOST` of them. Neighbouring traces tell
    nearly the same: the degrees of freedom of one trace count as often as traces are independent, by the correlation of
    their mean squares across the scan. PatchfemError where no whole trace is left, or the traces cannot show the band.
    """
    z, lost, x = (scan.z, lost, scan.x) if direction == "x" else (scan.z.T, lost.T, scan.y)
    rows = np.flatnonzero(lost.mean(axis=1) <= BRIDGED)
    z = z[rows[np.linspace(0, rows.size - 1, min(rows.size, MOST)).astype(int)]]
    if not len(z):
        raise PatchfemError(f"{scan.source}: along {direction} every line of the scan lacks more than a third of its "
                            "heights")
    step = float(x[-1] - x[0]) / (x.size - 1)
    refuse_band(scan.source, *band, step * (x.size - 1), step)
    sizes = [_size(level(Profile(x, row, scan.source)).z, step, band) for row in z]
    squares = np.array([(one.amplitude**2, one.slope**2) for one in sizes])
    mean = np.sqrt(squares.mean(axis=0))
    freedom = np.mean([one.freedom for one in sizes], axis=0)
    freedom = tuple(float(f * _independent(column)) for f, column in zip(freedom, squares.T))
    density = np.mean([one.spectrum.density for one in sizes], axis=0)
    found = Spectrum(sizes[0].spectrum.frequency, frozen_array(density), sizes[0].spectrum.tapers,
                     sizes[0].spectrum.length)
    return Size(float(mean[0]), float(mean[1]), freedom, found)


def _independent(values) -> float:
    """How many of neighbouring values are independent: n / (1 + 2 sum of their correlations up to the first zero)."""
    off = values - values.mean()
    power, total = float(off @ off), 1.0
    if power == 0:
        return 1.0
    for lag in range(1, values.size):
        found = float(off[lag:] @ off[:-lag]) / power
        if found <= 0:
            break
        total += 2 * found
    return max(values.size / total, 1.0)


def ratio(part: str, text: str, over: Size, under: Size, alike: float = 0.0) -> Quantity:
    """Ratio of the amplitudes or slopes of two traces, part "amplitude" or "slope".

    alike: correlation of the two. Mean squares of traces from different places are independent chi-squares, and the
    interval is that of F; those of one place before and after vary together, and the interval is Pitman's for two
    correlated variances (Biometrika 31 (1939) 9), by Student's t with the fewer degrees of freedom.
    """
    from scipy.special import fdtri, stdtrit

    place = ("amplitude", "slope").index(part)
    one, other = over[place], under[place]
    if other <= 0:
        return refused("1", text, f"the {part} before wear is zero")
    value, (first, second) = one / other, (over.freedom[place], under.freedom[place])
    tail = (1 - LEVEL) / 2
    if alike <= 0:
        low, high = (1 / fdtri(first, second, p) for p in (1 - tail, tail))
    else:
        freedom = max(min(first, second) - 1, 1.0)
        k = 2 * (1 - min(alike, 1.0) ** 2) * stdtrit(freedom, 1 - tail) ** 2 / freedom
        high = 1 + k + np.sqrt(k * (2 + k))
        low = 1 / high
    return Quantity(value, value * float(np.sqrt(low)), value * float(np.sqrt(high)), "1", text)


def loose(one: Quantity, error: float) -> Quantity:
    """A ratio with a further standard deviation of its logarithm."""
    if one.value is None or one.value <= 0:
        return one
    sides = [np.hypot(np.log(end / one.value), SIDE * error) for end in (max(one.low, 1e-300), one.high)]
    return one._replace(low=one.value * float(np.exp(-sides[0])), high=one.value * float(np.exp(sides[1])))


def of_noise(sizes: tuple, noise: float, step: float, band: tuple) -> tuple:
    """Relative share of the noise [m] of a height difference in the amplitude and the slope of registered traces.

    Half of the mean square that white noise of one trace adds: it may be another one in each, and where the first trace
    is read between its samples, less. That takes most of it from the slope, of which all counts. noise [m]: of the
    difference.
    """
    least = [min(one[part] for one in sizes) for part in (0, 1)]
    squares = noise**2 * 2 * step * (1 / band[0] - 1 / band[1]), noise**2 / step**2
    return tuple(float(share * added / max(size**2, 1e-300)) for share, added, size in zip((0.5, 1.0), squares, least))


def scattered(trace: Profile, step: float, band: tuple = BAND) -> tuple:
    """Degrees of freedom of amplitude and slope by how their mean squares scatter along a trace at a step [m].

    The trace is cut into six parts; as the scatter of six is known to a third, half of what they show counts.
    """
    z, step = at_step(trace, step)
    wave = np.fft.rfftfreq(z.size, step)
    inside = (wave >= 1 / band[1]) & (wave <= 1 / band[0])
    edges = np.linspace(0, z.size - 1, PLACES + 1).astype(int)[:-1]
    out = []
    for part in (np.fft.irfft(np.where(inside, np.fft.rfft(z), 0.0), z.size)[:-1], np.diff(z)):
        means = np.add.reduceat(part**2, edges) / np.diff([*edges, part.size])
        scatter = float(means.var(ddof=1)) / PLACES
        out.append(float(np.clip(means.mean() ** 2 / max(scatter, 1e-300), 2.0, 1e9)))
    return tuple(out)


def likeness(first, second, step: float, band: tuple = BAND) -> tuple:
    """Correlation of two registered traces (n,) [m] every `step` [m]: that of their band and that of their slopes."""
    window = np.hanning(first.size)
    one, other = (np.fft.rfft((z - z.mean()) * window) for z in (first, second))
    wave = np.fft.rfftfreq(first.size, step)
    inside = (wave >= 1 / band[1]) & (wave <= 1 / band[0])
    out = []
    for a, b in ((one[inside], other[inside]), (np.diff(first), np.diff(second))):
        size = float(np.sqrt(np.vdot(a, a).real * np.vdot(b, b).real))
        out.append(float(np.clip(np.vdot(a, b).real / size, 0.0, 1.0)) if size > 0 else 0.0)
    return tuple(out)
