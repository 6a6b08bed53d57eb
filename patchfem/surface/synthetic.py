"""Made traces with known spectra, heights counted as gap like those of a file: a larger z is more open."""

import numpy as np

from ..core import PatchfemError, frozen_array
from .profile import Profile


def sine(x: np.ndarray, amplitude: float, wavelength: float, phase: float = 0.0) -> Profile:
    """A sine trace, amplitude sin(2 pi x/wavelength + phase) [m], at rising x (n,) [m].

    amplitude, wavelength [m], phase [rad]. PatchfemError as in `waves`.
    """
    return waves(x, [amplitude], [wavelength], [phase])


def waves(x: np.ndarray, amplitudes, wavelengths, phases=None) -> Profile:
    """Trace of k sines in sum, at rising x (n,) [m].

    amplitudes, wavelengths: (k,) [m]; phases: (k,) [rad], 0 where left out. PatchfemError for lists of unlike lengths,
    numbers that are not finite, wavelengths not above zero, and places that do not rise.
    """
    x = _places(x)
    a, length = _finite("amplitudes", amplitudes), _finite("wavelengths", wavelengths)
    shift = np.zeros(a.size) if phases is None else _finite("phases", phases)
    if not a.size == length.size == shift.size:
        raise PatchfemError(f"waves: {a.size} amplitudes, {length.size} wavelengths, {shift.size} phases")
    if (length <= 0).any():
        raise PatchfemError("waves: wavelengths are above zero")
    z = np.zeros(x.size)
    for one, wave, start in zip(a, length, shift):
        z += one * np.sin(2 * np.pi * x / wave + start)
    return Profile(x, frozen_array(z), f"{a.size} sines")


def peaks(x: np.ndarray, at, heights, widths) -> Profile:
    """Trace of k Gaussian peaks in sum, heights exp(-(x - at)^2/(2 widths^2)), at rising x (n,) [m].

    at, heights, widths: (k,) [m]; a height below zero is material that sticks out into the gap. PatchfemError as in
    `waves`.
    """
    x = _places(x)
    at, heights, widths = (_finite(name, v) for name, v in (("at", at), ("heights", heights), ("widths", widths)))
    if not at.size == heights.size == widths.size:
        raise PatchfemError(f"peaks: {at.size} places, {heights.size} heights, {widths.size} widths")
    if (widths <= 0).any():
        raise PatchfemError("peaks: widths are above zero")
    z = np.zeros(x.size)
    for place, height, width in zip(at, heights, widths):
        z += height * np.exp(-((x - place) / width) ** 2 / 2)
    return Profile(x, frozen_array(z), f"{at.size} Gaussian peaks")


def self_affine(length: float, count: int, rms: float, hurst: float, longest: float, shortest: float,
                seed: int) -> Profile:
    """A periodic random trace over [-length/2, length/2] with `count` even steps, first and last height alike.

    The mean square per wave number q = 2 pi k / length goes like 1 for waves above `longest` (roll-off) and like
    (q longest / 2 pi)^(-1 - 2 hurst) from there to `shortest`, nothing below; phases are random and even, so every
    realisation has exactly this spectrum and exactly the `rms` [m] (mean over the period). Same seed, same heights.
    Persson et al., J. Phys. Condens. Matter 17 (2005) R1. PatchfemError unless 0 < hurst <= 1 and
    2 steps < shortest <= longest <= length.
    """
    if not (np.isfinite([length, rms]).all() and length > 0 and rms >= 0 and count >= 4):
        raise PatchfemError("self_affine: a length above zero, an rms of zero or more and four steps are wanted")
    if not 0 < hurst <= 1:
        raise PatchfemError(f"self_affine: the Hurst exponent is {hurst:g}; it lies above 0 and at 1 at most")
    if not 2 * length / count < shortest <= longest <= length:
        raise PatchfemError("self_affine: two steps < shortest <= longest <= length is wanted, not "
                            f"{2 * length / count:g}, {shortest:g}, {longest:g}, {length:g} m")
    k = np.arange(count // 2 + 1)
    ratio = np.maximum(k * longest / length, 1.0)
    power = np.where((k > 0) & (k * shortest <= length * (1 + 1e-12)), ratio ** (-1 - 2 * hurst), 0.0)
    amplitude = np.sqrt(2 * power / power.sum()) * rms
    phase = np.random.default_rng(seed).uniform(0.0, 2 * np.pi, k.size)
    z = np.fft.irfft(amplitude * np.exp(1j * phase) * count / 2, count)
    x = np.linspace(-length / 2, length / 2, count + 1)
    return Profile(frozen_array(x), frozen_array(np.append(z, z[0])), f"self-affine trace (seed {seed})")


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
