"""Campaign `roughness`: how often the 90 % intervals of `profile` cover the mean of their surface, Gaussian or not.

Each seed makes one trace of 2 mm at 1 um of one kind, computes every parameter of its levelled
trace and of its roughness at 0.25 mm with its interval, and checks whether the interval covers the
mean over OTHERS traces of the same surface, whose seeds start at 900 000. Seeds below 5000 were
used in developing the intervals, those from 5000 on only to test them.
"""

from collections import defaultdict
from functools import cache

import numpy as np
from campaigns import Row

UM = 1e-6
STEP, LENGTH, CUTOFF = UM, 2e-3, 250e-6
OTHERS, FIRST = 400, 900_000


def draw_gaussian(rng, slope: float = 4.0, wave: float = 60e-6, size: int = 0) -> np.ndarray:
    """Return Gaussian heights (n,) of unit deviation; the density is flat above `wave` and falls with -slope below it."""
    size = size or round(LENGTH / STEP) + 1
    period = 8 * size
    frequency = np.arange(period // 2 + 1) / (period * STEP)
    power = (1 + (frequency * wave) ** 2) ** (-slope / 2)
    power[0] = 0.0
    numbers = rng.standard_normal((2, frequency.size))
    z = np.fft.irfft(np.sqrt(power) * (numbers[0] + 1j * numbers[1]), period)[:size]
    return z / np.sqrt(power.sum() * 2) * period


def draw_pitted(rng) -> np.ndarray:
    """Return a fine surface with random round pits of 20 um, four deviations deep, ten per millimetre."""
    z = 0.5 * draw_gaussian(rng)
    x = np.arange(z.size) * STEP
    for centre in rng.uniform(0, LENGTH, rng.poisson(10e3 * LENGTH)):
        z -= rng.uniform(2, 4) * np.maximum(1 - ((x - centre) / 10e-6) ** 2, 0.0)
    return z


def draw_turned(rng) -> np.ndarray:
    """Return the cusps of a turned surface, 100 um apart, with roughness of a tenth of their height."""
    x = np.arange(round(LENGTH / STEP) + 1) * STEP
    t = (x / 100e-6 + rng.uniform()) % 1 - 0.5
    return 12 * t * t + 0.3 * draw_gaussian(rng)


KINDS = {
    "gaussian": draw_gaussian,
    "steep": lambda rng: draw_gaussian(rng, 6.0, 80e-6),
    "exponential": lambda rng: draw_gaussian(rng, 2.0, 60e-6),
    "fractal": lambda rng: draw_gaussian(rng, 2.6, 20 * LENGTH),
    "two_scale": lambda rng: (
        0.9 * draw_gaussian(rng, 4.0, 150e-6) + 0.4 * draw_gaussian(rng, 4.0, 15e-6)
    ),
    "truncated": lambda rng: np.minimum(draw_gaussian(rng), 0.5),
    "lognormal": lambda rng: np.exp(0.6 * draw_gaussian(rng)),
    "pitted": draw_pitted,
    "turned": draw_turned,
}


def make_trace(kind: str, seed: int):
    """Return a trace of a kind [Profile] with heights of about a micrometre."""
    from patchfem.surface import Profile

    z = UM * KINDS[kind](np.random.default_rng([seed, sorted(KINDS).index(kind)]))
    return Profile(np.arange(z.size) * STEP, z, f"{kind}-{seed}")


@cache
def compute_means(kind: str) -> dict:
    """Return the mean of every parameter over the other traces, by name, without intervals."""
    from patchfem.surface import BAND, Heights, level
    from patchfem.surface.roughness import rows
    from patchfem.surface.roughness.filter import filter_trace
    from patchfem.surface.roughness.spectrum import band_amplitude, estimate_spectrum

    samples = defaultdict(list)
    for seed in range(FIRST, FIRST + OTHERS):
        profile = level(make_trace(kind, seed))
        heights = Heights(profile.z, STEP)
        roughness = Heights(filter_trace(profile, CUTOFF)[1].z, STEP, CUTOFF)
        spectrum = estimate_spectrum(profile.z, STEP)
        for row, heights_used in [
            *((row, heights) for row in rows.PRIMARY),
            *((row, roughness) for row in rows.ROUGH),
        ]:
            if row.compute is not None:
                samples[row.name].append(row.compute(heights_used))
        samples["band_amplitude"].append(band_amplitude(spectrum, *BAND))
        samples["dominant_wavelength"].append(spectrum.dominant_wavelength)
    return {
        name: float(np.mean([profile for profile in values if profile is not None]))
        for name, values in samples.items()
        if any(profile is not None for profile in values)
    }


def compare_trace(seed: int, _folder, _earlier) -> dict:
    """Compare the intervals of a trace with the means over the others; consecutive seeds have different kinds."""
    from patchfem.surface import make_report

    kind = sorted(KINDS)[seed % len(KINDS)]
    truths = compute_means(kind)
    rows = []
    for parameter in make_report(make_trace(kind, seed), CUTOFF).values:
        if parameter.name in truths and parameter.low is not None:
            middle = (parameter.low + parameter.high) / 2
            rows.append(
                Row(
                    parameter.name,
                    middle,
                    parameter.high - middle,
                    0.0,
                    truths[parameter.name],
                    0.0,
                )
            )
    return {"rows": rows, "group": kind}
