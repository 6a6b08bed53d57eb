"""Peaks of a rough surface from mean squares of a trace over it, for Greenwood and Williamson's contact of peaks.

A surface of Gaussian heights, alike in all directions, whose traces have the mean squares m_0, m_2, m_4 of height,
slope and curvature has m_4/(6 pi 3^(1/2) m_2) summits per area of mean curvature (8/3) (m_4/pi)^(1/2) (Nayak, J. Lubr.
Technol. 93, 398, 1971). Their heights have the variance m_0 (1 - 0.8968/alpha) with alpha = m_0 m_4/m_2^2 (Bush, Gibson
and Keogh, Mech. Res. Commun. 3, 169, 1976); McCool (Wear 107, 37, 1986) makes the contact of peaks of them. No such
surface has alpha < 3/2. The shortest waves decide on m_4: the peaks are those of a sampling step, not of a surface. The
longest decide on m_0, so that a cut-off keeps those away which the mesh holds already.
"""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError, say
from ...scales import plain
from ..profile import Profile, despiked, even, level
from .filter import filtered

SUMMITS = 0.8968  # of m_0/alpha, that the heights of summits scatter less than all heights
NARROWEST = 1.5  # alpha of waves of one length in all directions
PERSSON = 0.4, 0.5  # u_0 over the rms height: Persson 2007, and Pastewka et al. 2013 by simulation
FEWEST = 16  # samples of a trace
FEW, MOSTLY = 0.005, 0.5  # share of the heights, and of the mean square curvature that so few of a surface do not have
SPIKY = 0.1  # share of the samples from which they are a surface and no spikes
ROUND = 1e-12  # of its heights, what levelling leaves of a straight line
SKEWED, PEAKED = 0.5, 1.0  # skewness and excess kurtosis from which heights are told not to be Gaussian
SURE = 3  # standard deviations of either over traces of that many waves, which it must exceed too


class Moments(NamedTuple):
    """Root mean squares over a trace: height [m], slope [1], curvature [1/m]."""

    height: float
    slope: float
    curvature: float

    @property
    def alpha(self) -> float:
        """Nayak's bandwidth m_0 m_4/m_2^2."""
        return (self.height * self.curvature / self.slope**2)**2

    def beside(self, other: "Moments") -> "Moments":
        """Those of the gap between two rough surfaces, whose mean squares add up."""
        return Moments(*np.hypot(self, other).tolist())


class Peaks(NamedTuple):
    """Peaks of a surface: radius [m] of the mean curvature of their tips, density [1/m2], deviation [m] of their
    heights."""

    radius: float
    density: float
    deviation: float


class Told(NamedTuple):
    """What a trace tells of its peaks: Moments of its samples; Moments of every second one, None where these tell
    none; how far its heights are from Gaussian ones, a clause or ""; which heights count too much or not at all,
    clauses (`_walls`)."""

    fine: Moments
    coarse: Moments | None
    doubt: str
    walls: tuple = ()

    def beside(self, other: "Told") -> "Told":
        """What two rough faces tell of the gap between them."""
        coarse = self.coarse.beside(other.coarse) if self.coarse and other.coarse else None
        return Told(self.fine.beside(other.fine), coarse, self.doubt or other.doubt,
                    (*self.walls, *other.walls))


def told_by(trace: Profile, cutoff: float | None = None) -> Told:
    """What the waves of a trace below a cut-off [m] tell (`moments_of`), None: all of its waves."""
    short = _short_waves(trace, cutoff)
    fine = _moments(short, 1)
    try:
        coarse = _moments(short, 2)
    except PatchfemError:
        coarse = None
    left = int((_clean(trace).missing & ~trace.missing).sum())
    walls = (f"{left} of {trace.z.size} heights are spikes, dropouts or dust and are left out",) if left else ()
    return Told(fine, coarse, _uneven(short.z, fine, short.length), (*walls, *_walls(short)))


def moments_of(trace: Profile, every: int = 1, cutoff: float | None = None) -> Moments:
    """Moments of a trace, levelled and without spikes, from neighbouring samples or every second (third, ...) of them.

    cutoff [m]: only the roughness below it counts (ISO 16610-21, half a cut-off trimmed at each end); a trace no longer
    than that holds no longer waves. Slope and curvature are first and second differences, which see a wave of length L
    as sinc(step/L) and sinc^2 of its own. PatchfemError for a trace of less than FEWEST such samples, for one without
    heights and for a cut-off of fewer than four steps.
    """
    return _moments(_short_waves(trace, cutoff), every)


def _short_waves(trace: Profile, cutoff: float | None) -> Profile:
    """The trace without spikes, levelled, and without waves longer than the cut-off."""
    tilted = even(_clean(trace))
    flat = level(tilted)
    if flat.z.size >= FEWEST and not np.ptp(flat.z) > ROUND * np.ptp(tilted.z):
        raise PatchfemError(f"{trace.source}: the trace is flat, so it has no peaks; leave [contact.asperities] out")
    return flat if cutoff is None or cutoff >= flat.length else filtered(flat, cutoff)[1]


def _clean(trace: Profile) -> Profile:
    """The trace without spikes, itself where these are too many for spikes."""
    clean = despiked(trace)
    return clean if (clean.missing & ~trace.missing).mean() <= SPIKY else trace


def _walls(trace: Profile) -> tuple:
    """That a few heights make up most of the mean square curvature, as the walls of dust do, a clause with the moments
    without them; () where not: of Gaussian heights these few make up a twentieth."""
    bent = np.diff(trace.z, 2)**2
    few = max(int(FEW * bent.size), 1)
    most = np.argsort(bent)[-few:]
    share = float(bent[most].sum()) / max(float(bent.sum()), 1e-300)
    if share < MOSTLY:
        return ()
    step, there = trace.length / (trace.z.size - 1), np.ones(trace.z.size, bool)
    worst = int(most[-1]) + 1
    there[most + 1] = False
    slope = np.diff(trace.z)[there[1:] & there[:-1]] / step
    curvature = float(np.sqrt(bent[there[1:-1]].mean())) / step**2
    return (f"{few} of {trace.z.size} heights, the sharpest at x = {say(float(trace.x[worst]))}, make up "
            f"{100 * share:.3g} % of the mean square curvature, as dust does; without them rms_slope is "
            f"{float(np.sqrt(np.mean(slope**2))):.4g} and rms_curvature {plain(curvature, 4)} 1/m; if they are dust, "
            "use these values or remove the dust from the trace",)


def _moments(trace: Profile, every: int) -> Moments:
    z, step = trace.z[::every], every * trace.length / (trace.z.size - 1)
    if z.size < FEWEST:
        raise PatchfemError(f"{trace.source}: {z.size} samples give no curvature; at least {FEWEST} are needed")
    return Moments(*(float(np.sqrt(np.mean(np.diff(z, order)**2)) / step**order) for order in range(3)))


def _uneven(z, moments: Moments, length: float) -> str:
    """The skewness and kurtosis of heights z (n,) [m] that Gaussian ones would not have, in words; "" of Gaussian ones.

    A Gaussian trace has slope length/(pi height) crossings of its mean line, each taken as one independent height.
    """
    unit = (z - z.mean()) / z.std()
    skew, excess = float(np.mean(unit**3)), float(np.mean(unit**4)) - 3
    count = max(moments.slope * length / (np.pi * moments.height), 1.0)
    if abs(skew) <= max(SKEWED, SURE * np.sqrt(6 / count)) and abs(excess) <= max(PEAKED, SURE * np.sqrt(24 / count)):
        return ""
    return (f"the heights have skewness {skew:.2g} and kurtosis {excess + 3:.2g}, but the theory assumes Gaussian "
            "heights (0 and 3): " + ("tops that were cut off by wear are stiffer than the theory "
                                     "predicts" if skew < -SKEWED else
                          "single high peaks are softer than the theory predicts" if skew > SKEWED else
                          "the stiffness from the theory is only a guess"))


def peaks_of(moments: Moments) -> Peaks:
    """The Peaks of a surface whose traces have some Moments; PatchfemError where no surface alike in all directions has
    them."""
    if not moments.alpha >= NARROWEST * (1 - 1e-9):
        raise PatchfemError(f"rms_height x rms_curvature/rms_slope^2 is {np.sqrt(moments.alpha):.3g}, but on an "
                            f"isotropic surface of Gaussian heights this number is at least {np.sqrt(NARROWEST):.3g}; "
                            "take all three from one trace across the lay, or give radius, density and "
                            "height_deviation of the peaks")
    m0, m2, m4 = (one**2 for one in moments)
    return Peaks(3 / 8 * float(np.sqrt(np.pi / m4)), float(m4 / (6 * np.pi * np.sqrt(3) * m2)),
                 float(np.sqrt(m0 * (1 - SUMMITS / moments.alpha))))


def persson_stiffness(pressure: float, height: float) -> tuple:
    """Least and largest stiffness [Pa/m] of a rough contact under a pressure [Pa] by a theory of waves of all lengths.

    p ~ exp(-u/u_0), u_0 = 0.4 to 0.5 of the rms height [m] (PERSSON), so that the stiffness is p/u_0: it does not hang
    on the shortest waves. It holds where little of the area touches.
    """
    return tuple(pressure / (share * height) for share in reversed(PERSSON))
