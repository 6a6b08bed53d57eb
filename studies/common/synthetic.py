"""Made traces with known spectra, heights counted as gap like those of a file: a larger z is more open.

The report's surface (`report_area`) has as many hills as valleys alike: its heights may be read as gap
or as surface.
"""

import numpy as np

from patchfem.core import frozen_array
from patchfem.surface import Profile

DOMINANT = 80e-6  # [m] dominant wavelength, the 80 micron scale of the report, 4.D
SHORTEST = 8e-6  # [m] shortest wave that a stylus of 12.5 um traces
# [m] rms height of the larger swings of 13 to 18 um in 4.D; Fig. 30 prints a range of 30.6 um, for which Rt is 31 um
SIGMA = 6.3e-6


def sine(x: np.ndarray, amplitude: float, wavelength: float, phase: float = 0.0) -> Profile:
    """Return the trace amplitude sin(2 pi x/wavelength + phase) at rising x (n,) [m].

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


def waves(x: np.ndarray, amplitudes, wavelengths, phases) -> Profile:
    """Return the sum of k sines as a trace at rising x (n,) [m].

    Parameters
    ----------
    x : (n,) array
        [m]
    amplitudes, wavelengths : (k,) array
        [m]
    phases : (k,) array
        [rad]
    """
    z = np.zeros(x.size)
    for amplitude, wavelength, phase in zip(amplitudes, wavelengths, phases, strict=True):
        z += amplitude * np.sin(2 * np.pi * x / wavelength + phase)
    return Profile(frozen_array(x), frozen_array(z), f"{len(amplitudes)} sines")


def self_affine(
    length: float, count: int, rms: float, hurst: float, longest: float, shortest: float, seed: int
) -> Profile:
    """Return a periodic random trace over [-length/2, length/2] with `count` equal intervals.

    First and last height are equal. Its power falls like k^(-1 - 2 hurst) from the wavelength `longest` to `shortest`
    [m], which holds more than two intervals.
    """
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


def report_area(shape: tuple[int, int], step: float, seed: int) -> tuple[np.ndarray, ...]:
    """Return an isotropic area of the report's surface before the tests: (x (n,), y (m,), z (m, n)) [m].

    shape: (m, n), points along y and along x; the periods are m and n times the step [m]. Phases are random, every
    realisation has the spectrum `report_density` and the standard deviation SIGMA over the period. Same seed,
    same bytes, whatever the number of threads. A megapixel: 0.2 s. A wave of 8 um must hold two steps, and both periods
    one of 80 um.
    """
    m, n = shape
    qy = 2 * np.pi * np.fft.fftfreq(m, step)
    qx = 2 * np.pi * np.fft.rfftfreq(n, step)

    # the phases are those of white noise: random, and those of a real surface
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal((m, n)))
    wave = noise / np.abs(noise)
    z = np.fft.irfft2(wave * np.sqrt(report_density(np.hypot(qy[:, None], qx))), (m, n))

    # scaled twice because of the round-off of the first time
    for _ in range(2):
        z = z - z.mean()
        z = z * (SIGMA / np.sqrt((z * z).mean()))
    return frozen_array(step * np.arange(n)), frozen_array(step * np.arange(m)), frozen_array(z)
