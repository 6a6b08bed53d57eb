"""Part of a trace that is too fine for the elements: the share of its height in short waves."""

import numpy as np

from ..core import PatchfemError, say
from .profile import Profile, even, level

ELEMENTS = 2  # a wave shorter than this many elements has no place on the nodes
LIMIT = 0.1  # share of the height in such waves from which something is really lost


def spectrum(profile: Profile) -> tuple:
    """Spectrum of the levelled trace: wavelength (k,) [m], falling from twice the length, and mean square (k,) [m2].

    The waves are the cosines of half a wave and its multiples over the trace. The mirror image of the trace goes on
    without a jump, so the ends put no false short waves in, as those of a Fourier series do. The mean squares add up to
    that of the trace, exactly by the trapezoidal rule. Uneven samples are first read off at an even step. PatchfemError
    for missing heights.
    """
    from scipy.fft import dct

    if profile.missing.any():
        raise PatchfemError(f"{profile.source}: {profile.missing.sum()} heights are missing; clean the trace first")
    z = level(even(profile)).z
    count = z.size - 1
    amplitude = dct(z, type=1) / count
    power = amplitude[1:] ** 2 / 2
    power[-1] /= 2  # the wave of two samples: its transform counts twice, its mean square is the square
    return 2 * profile.length / np.arange(1, count + 1), power


def fine_share(profile: Profile, length: float) -> float:
    """Share [1] of the height of the levelled trace in waves shorter than `length` [m], rms over rms, 0 to 1.

    PatchfemError for missing heights.
    """
    waves, power = spectrum(profile)
    return float(np.sqrt(_below(waves, power, length)))


def too_fine(profile: Profile, element: float, limit: float = LIMIT) -> str | None:
    """Sentence for a scene whose elements [m] are too long for the trace, None where `limit` is kept.

    It is the refusal of a scene without [contact.asperities], and a warning of `plan`.
    """
    waves, power = spectrum(profile)
    share = float(np.sqrt(_below(waves, power, ELEMENTS * element)))
    if share <= limit:
        return None
    most, nearly = (_two_digits(element_for(waves, power, kept)) for kept in (1 - limit, 1 - limit / 10))
    return (f"{profile.source} has {100 * share:.0f} % of its rms height in waves shorter than {ELEMENTS} elements "
            f"({say(ELEMENTS * element)}), which the mesh cannot resolve: add [contact.asperities], or set "
            f'element_size = "{say(most)}", which keeps {100 - 100 * limit:g} % of the height '
            f'("{say(nearly)}" keeps {100 - 10 * limit:g} %)')


def _below(waves, power, length: float) -> float:
    total = power.sum()
    return float(power[waves < length * (1 - 1e-9)].sum() / total) if total > 0 else 0.0


def element_for(waves, power, kept: float) -> float:
    """Largest element [m] whose waves of two elements and more keep the share `kept` of the height (rms).

    waves, power: (k,) as `spectrum` gives them. It is inf for a flat trace. PatchfemError unless 0 < kept < 1.
    """
    total = power.sum()
    if not 0 < kept < 1:
        raise PatchfemError(f"the share of the height to keep must lie between 0 and 1, but is {kept:g}")
    if total == 0:
        return np.inf
    lost = np.cumsum(power[::-1])[::-1] / total  # in this wave and all shorter ones
    kept_waves = np.flatnonzero(lost > (1 - kept) ** 2)
    return float(waves[kept_waves[-1]]) / ELEMENTS


def _two_digits(length: float) -> float:
    """A length rounded down to two digits, so that the suggestion itself passes."""
    unit = 10.0 ** (np.floor(np.log10(length)) - 1)
    return float(np.floor(length / unit * (1 + 1e-12)) * unit)
