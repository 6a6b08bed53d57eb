"""Made traces with known spectra, heights counted as gap like those of a file: a larger z is more open.

The report's surface (`report_trace`, `report_area`) has as many hills as valleys alike: its heights may be read as gap
or as surface.
"""

import numpy as np

from patchfem.core import PatchfemError, frozen_array
from patchfem.formatting import format_length
from patchfem.surface import Profile

DOMINANT = 80e-6  # [m] dominant wavelength, the 80 micron scale of the report, 4.D
SHORTEST = 8e-6  # [m] shortest wave that a stylus of 12.5 um traces
# [m] rms height of the larger swings of 13 to 18 um in 4.D; Fig. 30 prints a range of 30.6 um, for which Rt is 31 um
SIGMA = 6.3e-6


def sine(x: np.ndarray, amplitude: float, wavelength: float, phase: float = 0.0) -> Profile:
    """Return the trace amplitude sin(2 pi x/wavelength + phase) at rising x (n,) [m].

    PatchfemError as in `waves`.

    Parameters
    ----------
    x : (n,) array
        [m]
    amplitude, wavelength : float
        [m]
    phase : float
        [rad]
    """
    return waves(x, [amplitude], [wavelength], [phase])


def waves(x: np.ndarray, amplitudes, wavelengths, phases=None) -> Profile:
    """Return the sum of k sines as a trace at rising x (n,) [m].

    PatchfemError for lists of unlike lengths, numbers that are not finite, wavelengths not above zero, and places that
    do not rise.

    Parameters
    ----------
    x : (n,) array
        [m]
    amplitudes, wavelengths : (k,) array
        [m]
    phases : (k,) array, optional
        [rad]; 0 by default.
    """
    x = _places(x)
    a = _finite("amplitudes", amplitudes)
    length = _finite("wavelengths", wavelengths)
    shift = np.zeros(a.size) if phases is None else _finite("phases", phases)
    if not a.size == length.size == shift.size:
        raise PatchfemError(
            f"waves: {a.size} amplitudes, {length.size} wavelengths, {shift.size} phases"
        )
    if (length <= 0).any():
        raise PatchfemError("waves: wavelengths are above zero")
    z = np.zeros(x.size)
    for one, wave, start in zip(a, length, shift):
        z += one * np.sin(2 * np.pi * x / wave + start)
    return Profile(x, frozen_array(z), f"{a.size} sines")


def peaks(x: np.ndarray, at, heights, widths) -> Profile:
    """Return the sum of k Gaussian peaks, heights exp(-(x - at)^2/(2 widths^2)), as a trace.

    PatchfemError as in `waves`.

    Parameters
    ----------
    x : (n,) array
        Rising [m].
    at, heights, widths : (k,) array
        [m]; a height below zero is material that sticks out into the gap.
    """
    x = _places(x)
    at, heights, widths = (
        _finite(name, v) for name, v in (("at", at), ("heights", heights), ("widths", widths))
    )
    if not at.size == heights.size == widths.size:
        raise PatchfemError(
            f"peaks: {at.size} places, {heights.size} heights, {widths.size} widths"
        )
    if (widths <= 0).any():
        raise PatchfemError("peaks: widths are above zero")
    z = np.zeros(x.size)
    for place, height, width in zip(at, heights, widths):
        z += height * np.exp(-(((x - place) / width) ** 2) / 2)
    return Profile(x, frozen_array(z), f"{at.size} Gaussian peaks")


def self_affine(
    length: float, count: int, rms: float, hurst: float, longest: float, shortest: float, seed: int
) -> Profile:
    """Return a periodic random trace over [-length/2, length/2] with `count` equal intervals.

    First and last height are equal.
    """
    if not (np.isfinite([length, rms]).all() and length > 0 and rms >= 0 and count >= 4):
        raise PatchfemError(
            "self_affine: a length above zero, an rms of zero or more and four steps are wanted"
        )
    if not 0 < hurst <= 1:
        raise PatchfemError(
            f"self_affine: the Hurst exponent is {hurst:g}; it lies above 0 and at 1 at most"
        )
    if not 2 * length / count < shortest <= longest <= length:
        raise PatchfemError(
            "self_affine: two steps < shortest <= longest <= length is wanted, not "
            f"{2 * length / count:g}, {shortest:g}, {longest:g}, {length:g} m"
        )
    k = np.arange(count // 2 + 1)
    ratio = np.maximum(k * longest / length, 1.0)
    power = np.where(
        (k > 0) & (k * shortest <= length * (1 + 1e-12)), ratio ** (-1 - 2 * hurst), 0.0
    )
    amplitude = np.sqrt(2 * power / power.sum()) * rms
    phase = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, k.size)
    z = np.fft.irfft(amplitude * np.exp(1j * phase) * count / 2, count)
    x = np.linspace(-length / 2, length / 2, count + 1)
    return Profile(
        frozen_array(x), frozen_array(np.append(z, z[0])), f"self-affine trace (seed {seed})"
    )


def report_density(q: np.ndarray) -> np.ndarray:
    """Return the spectral density of the report's surface before the tests, up to a factor.

    q (any shape) are wave numbers [rad/m].
    """
    ratio = np.abs(np.asarray(q, float)) * (DOMINANT / (2 * np.pi))
    ring = np.exp(-((ratio - 1) ** 2) * 8)
    rest = np.where(ratio <= DOMINANT / SHORTEST * (1 + 1e-12), np.maximum(ratio, 1.0) ** -3.6, 0.0)
    return np.where(ratio > 0, 0.8 * ring + 0.2 * rest, 0.0)


def report_trace(length: float, count: int, seed: int, sigma: float = SIGMA) -> Profile:
    """Return a periodic trace of the report's surface over [-length/2, length/2] with `count` equal intervals.

    Its spectrum is that of a straight cut: `report_density` summed over the waves across the trace. Such a cut shows
    oblique waves longer than they are: an octave of the trace holds most height at 85 um, not at 80 um. Phases are
    random, the standard deviation over the period is `sigma` [m] in every trace (pieces of one long trace, and traces
    cut from `report_area`, scatter as measured ones do). Same seed, same bytes. PatchfemError unless a wave of 8 um
    holds two steps and the length one of 80 um.
    """
    _check_resolution("report_trace", length, length, length / max(count, 1), sigma)
    q = 2 * np.pi / length * np.arange(count // 2 + 1)
    across = 2 * np.pi / SHORTEST * (np.arange(1000) + 0.5) / 1000
    power = np.array([report_density(np.hypot(one, across)).sum() for one in q])
    power[0] = 0.0
    phase = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, q.size)
    z = _scale(np.fft.irfft(np.sqrt(power) * np.exp(1j * phase), count), sigma)
    x = np.linspace(-length / 2, length / 2, count + 1)
    return Profile(
        frozen_array(x), frozen_array(np.append(z, z[0])), f"report's surface, trace (seed {seed})"
    )


def report_area(shape: tuple, step: float, seed: int, sigma: float = SIGMA) -> tuple:
    """Return an isotropic area of the report's surface before the tests: (x (n,), y (m,), z (m, n)) [m].

    shape: (m, n), points along y and along x; the periods are m and n times the step [m]. Phases are random, every
    realisation has the spectrum `report_density` and the standard deviation `sigma` [m] over the period. Same seed,
    same bytes, whatever the number of threads. A megapixel: 0.2 s. PatchfemError unless a wave of 8 um holds two steps
    and both periods one of 80 um.
    """
    m, n = shape
    _check_resolution("report_area", m * step, n * step, step, sigma)
    qy = 2 * np.pi * np.fft.fftfreq(m, step)
    qx = 2 * np.pi * np.fft.rfftfreq(n, step)
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((m, n)))
    wave = noise / np.abs(noise)  # the phases of white noise: random, and those of a real surface
    z = _scale(
        np.fft.irfft2(wave * np.sqrt(report_density(np.hypot(qy[:, None], qx))), (m, n)), sigma
    )
    return frozen_array(step * np.arange(n)), frozen_array(step * np.arange(m)), frozen_array(z)


def _check_resolution(name: str, one: float, other: float, step: float, sigma: float) -> None:
    if not (np.isfinite([one, other, step, sigma]).all() and step > 0 and sigma >= 0):
        raise PatchfemError(
            f"{name}: a size and a step above zero and a sigma of zero or more are wanted"
        )
    if 2 * step > SHORTEST * (1 + 1e-12) or min(one, other) < DOMINANT * (1 - 1e-12):
        raise PatchfemError(
            f"{name}: waves of 80 um down to 8 um want a step of 4 um at most and a size of 80 um at "
            f"least, not {format_length(step)} and {format_length(min(one, other))}"
        )


def _scale(z, sigma: float) -> np.ndarray:
    """Scale heights to zero mean and the given root mean square.

    This is done twice because of the round-off of the first time.
    """
    for _ in range(2):
        z = z - z.mean()
        z = z * (sigma / np.sqrt((z * z).mean()))
    return z


def _places(x) -> np.ndarray:
    x = _finite("x", x)
    if x.size < 2 or not (np.diff(x) > 0).all():
        raise PatchfemError("the places of a made trace are two or more and grow")
    return x


def _finite(name: str, values) -> np.ndarray:
    out = frozen_array(values)
    if out.ndim != 1 or not np.isfinite(out).all():
        raise PatchfemError(f"{name} of a made trace are a list of finite numbers")
    return out
