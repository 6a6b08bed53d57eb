"""Peaks of a rough surface from a trace, for the asperity law of Greenwood and Williamson.

An isotropic surface of Gaussian heights, whose traces have the mean squares m_0, m_2,
m_4 of height, slope and curvature has m_4/(6 pi 3^(1/2) m_2) summits per area of mean curvature
(8/3) (m_4/pi)^(1/2) (Nayak, J. Lubr. Technol. 93, 398, 1971). Their heights have the variance m_0
(1 - 0.8968/alpha) with alpha = m_0 m_4/m_2^2 (Bush, Gibson and Keogh, Mech. Res. Commun. 3, 169,
1976); McCool (Wear 107, 37, 1986) derives the contact of peaks from them. No such surface has alpha
< 3/2. The shortest waves decide on m_4, so the peaks are those of a sampling step; the longest
decide on m_0, so a cut-off removes the waves that the mesh resolves.
"""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError
from ...formatting import format_length
from ..areal import level
from ..profile import Profile, remove_spikes, resample_evenly
from .filter import filter_surface
from .parameters import HEIGHT_ROUND_OFF, MIN_TRACE_SAMPLES

# Nayak's spectral width alpha of an isotropic surface whose waves all have the same length. No surface has less.
MIN_SPECTRAL_WIDTH_ALPHA = 1.5
# Ratio of the decay length u_0 to the rms height by Persson 2007, and by simulation (Pastewka 2013)
DECAY_LENGTH_OVER_RMS_HEIGHT = (0.4, 0.5)
# Largest skewness whose effect on the stiffness is below the uncertainty of the theory.
MAX_HEIGHT_SKEWNESS = 0.5
# Standard deviations that skewness and kurtosis of Gaussian traces reach
MAX_GAUSSIAN_MOMENT_DEVIATIONS = 3


class Moments(NamedTuple):
    """Root mean square height [m], slope [1] and curvature [1/m] of a trace."""

    height: float
    slope: float
    curvature: float

    @property
    def alpha(self) -> float:
        """Nayak's bandwidth m_0 m_4/m_2^2."""
        return (self.height * self.curvature / self.slope**2) ** 2


class Peaks(NamedTuple):
    """Asperity peaks of a surface: radius [m], density [1/m2] and height deviation [m]."""

    radius: float
    density: float
    deviation: float


class TraceMoments(NamedTuple):
    """Spectral moments of a trace, with notes on their reliability.

    - fine: moments from all samples.
    - not_gaussian: a clause if the heights are not Gaussian, else "".
    - dust: clauses on heights that were left out or that look like dust.
    """

    fine: Moments
    not_gaussian: str
    dust: tuple[str, ...] = ()


def trace_moments(trace: Profile, cutoff: float | None = None) -> TraceMoments:
    """Measure the moments of the waves of a trace shorter than `cutoff` [m], or of all waves if it is None.

    Spikes are left out. With a cut-off the roughness profile counts (ISO 16610-21, half a cut-off trimmed at each end).
    A trace no longer than the cut-off keeps all of its waves. Raises PatchfemError for fewer than 16 samples, for a flat
    trace and for a cut-off of fewer than four steps.
    """
    clean = remove_spikes(trace)
    is_removed = clean.missing & ~trace.missing
    dust = ()
    # Largest fraction of the samples in spikes; more apparent spikes belong to the surface.
    if is_removed.mean() > 0.1:
        # So many apparent spikes belong to the surface.
        clean = trace
    elif is_removed.any():
        dust = (
            f"{is_removed.sum()} of {trace.z.size} heights are spikes, dropouts or dust and are left out",
        )
    tilted = resample_evenly(clean)
    flat = level(tilted)
    if flat.z.size >= MIN_TRACE_SAMPLES and not np.ptp(flat.z) > HEIGHT_ROUND_OFF * np.ptp(
        tilted.z
    ):
        raise PatchfemError(
            f"{trace.source}: the trace is flat, so it has no peaks; leave [contact.asperities] out"
        )
    if cutoff is not None and cutoff < flat.length:
        flat = filter_surface(flat, cutoff)[1]
    fine = rms_moments(flat)

    # A few heights, such as those of wide dust, may make up most of m_4.
    bend = np.diff(flat.z, 2) ** 2
    # Fraction of the heights that are the sharpest; those of a Gaussian trace have 5 % of m_4.
    order = np.argsort(bend)[::-1][: max(int(0.005 * bend.size), 1)]
    # Largest fraction of m_4 in the sharpest heights; more may be due to dust
    if bend[order].sum() > 0.5 * bend.sum():
        dust += (
            f"{order.size} of {flat.z.size} heights, the sharpest at x = {format_length(flat.x[order[0] + 1])}, make up "
            "most of the mean square curvature, as dust does; if they are dust, write nan for them",
        )
    return TraceMoments(fine, _describe_skew(flat.z, fine, flat.length), dust)


def rms_moments(trace: Profile) -> Moments:
    """Compute the spectral moments of a levelled trace.

    Slope and curvature are first and second differences, which see a wave of length L as
    sinc(step/L) and its square.
    """
    z = trace.z
    step = trace.length / (z.size - 1)
    if z.size < MIN_TRACE_SAMPLES:
        raise PatchfemError(
            f"{trace.source}: {z.size} samples give no curvature; at least {MIN_TRACE_SAMPLES} are needed"
        )
    return Moments(
        *(float(np.sqrt(np.mean(np.diff(z, order) ** 2)) / step**order) for order in range(3))
    )


def _describe_skew(z, moments: Moments, length: float) -> str:
    """State that skewness and kurtosis of heights z (n,) [m] are not Gaussian, or return "".

    A Gaussian trace has slope length/(pi height) crossings of its mean line, each taken as one
    independent height.

    `moments` are the rms height, slope and curvature of the trace, and `length` [m] is its length.
    """
    unit = (z - z.mean()) / z.std()
    skewness = float(np.mean(unit**3))
    excess = float(np.mean(unit**4)) - 3
    count = max(moments.slope * length / (np.pi * moments.height), 1.0)
    max_skewness = max(MAX_HEIGHT_SKEWNESS, MAX_GAUSSIAN_MOMENT_DEVIATIONS * np.sqrt(6 / count))
    # Largest kurtosis minus 3 whose effect on the stiffness is below the uncertainty of the theory
    max_excess = max(1.0, MAX_GAUSSIAN_MOMENT_DEVIATIONS * np.sqrt(24 / count))
    if abs(skewness) <= max_skewness and abs(excess) <= max_excess:
        return ""
    effect = "the stiffness from the theory is only a guess"
    if skewness < -MAX_HEIGHT_SKEWNESS:
        effect = "tops that were cut off by wear are stiffer than the theory predicts"
    elif skewness > MAX_HEIGHT_SKEWNESS:
        effect = "single high peaks are softer than the theory predicts"
    return (
        f"the heights have skewness {skewness:.2g} and kurtosis {excess + 3:.2g}, but the theory "
        f"assumes Gaussian heights (0 and 3): {effect}"
    )


def gaussian_peaks(moments: Moments) -> Peaks:
    """Compute the asperity peaks of an isotropic Gaussian surface from spectral moments.

    Raises PatchfemError if no isotropic surface of Gaussian heights has them.
    """
    if not moments.alpha >= MIN_SPECTRAL_WIDTH_ALPHA * (1 - 1e-9):
        raise PatchfemError(
            f"rms_height x rms_curvature/rms_slope^2 is {np.sqrt(moments.alpha):.3g}, but on an "
            "isotropic surface of Gaussian heights this number is at least "
            f"{np.sqrt(MIN_SPECTRAL_WIDTH_ALPHA):.3g}; take all three from one trace across the lay, or give "
            "radius, density and height_deviation of the peaks"
        )
    m0, m2, m4 = (moment**2 for moment in moments)
    return Peaks(
        radius=3 / 8 * float(np.sqrt(np.pi / m4)),
        density=float(m4 / (6 * np.pi * np.sqrt(3) * m2)),
        # Bush (1976)
        deviation=float(np.sqrt(m0 * (1 - 0.8968 / moments.alpha))),
    )


def persson_stiffness(pressure: float, height: float) -> tuple[float, float]:
    """Compute bounds of the stiffness [Pa/m] of a rough contact by Persson's theory.

    The pressure is proportional to exp(-u/u_0) with u_0 = 0.4 to 0.5 of the rms height [m], so the
    stiffness p/u_0 does not depend on the shortest waves. The theory holds while little of the area
    touches.
    """
    low, high = DECAY_LENGTH_OVER_RMS_HEIGHT
    return pressure / (high * height), pressure / (low * height)
