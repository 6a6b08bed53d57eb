"""A rough skin peak by peak: three ways to find its stiffness, none of which shares its equations with another.

Crests lie one WAVE apart with the curvature of the report's 80 um waves, either as ridges across the whole width (plane
strain) or as round peaks both ways. `one_each` has one unknown force per peak: its own Hertz (peaks) or Westergaard
(ridges) closing, and what the forces of the others sink it by, summed over the waves of the coated half planes.
`explicit` resolves the ridges themselves; `separate` is Greenwood and Williamson's peaks, which do not feel each other.
"""

import sys
from functools import cache
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import contact_forms as exact
from halfspace import press_periodic

from patchfem.contact import HertzAsperities, Holders, press_patch
from patchfem.core import Compliance, Interface

CARBIDE = (250e9, 0.24)  # Young's modulus [Pa] and Poisson's ratio in rig.toml
TITANIUM = (121e9, 0.32)  # Young's modulus [Pa] and Poisson's ratio in rig.toml
COATING = 152.4e-6  # [m] thickness in rig.toml
MEAN = 26 * 4.4482216152605 / 12.7e-3**2  # [Pa] mean pressure of the rig, 0.717 MPa
WAVE = 80e-6  # [m] wavelength, the 80 micron scale of the report, 4.D
HEIGHT = 15.5e-6  # [m] amplitude, mean of the 13 to 18 micron of the report, 4.D
RADIUS = WAVE**2 / (4 * np.pi**2 * HEIGHT)  # [m] radius of a crest, 10.5 um
LATTICE = -3.9002649  # sum of 1/r over a square lattice less its mean


def depths(count: int, scatter: float, shape: str, seed: int = 0) -> np.ndarray:
    """Draw the depths (count,) [m] of peaks below the highest one, in random order.

    Parameters
    ----------
    count : int
    scatter : float
        Range of uniform heights, or standard deviation of Gaussian ones [m].
    shape : {"uniform", "gaussian"}
        Distribution, of which the quantiles are taken.
    seed : int
    """
    share = (np.random.default_rng(seed).permutation(count) + 0.5) / count
    depth = scatter * (share if shape == "uniform" else norm.ppf(share))
    return depth - depth.min()


def closing_of_waves(k, coat: tuple = CARBIDE) -> np.ndarray:
    """Return the closing of both coated faces per unit pressure of a wave with wave number k [1/m]; 0 for k = 0."""
    k = np.asarray(k, float)
    out = np.zeros(k.shape)
    out[k > 0] = 2 * exact.layered_compliance(k[k > 0], coat, TITANIUM, COATING)
    return out


@cache
def between_ridges(count: int, coat: tuple) -> np.ndarray:
    """Return the closing (count,) at each ridge per force on the first [m2/N], less the mean effect of equal forces.

    Parameters
    ----------
    count : int
        Number of ridges.
    coat : tuple
        Young's modulus [Pa] and Poisson's ratio of the coating.
    """
    step = 2 * np.pi / WAVE
    around = step * np.arange(-200, 201)  # periods that are summed
    waves = closing_of_waves(np.abs(step * np.fft.fftfreq(count)[:, None] + around), coat)
    return np.fft.ifft((waves - closing_of_waves(np.abs(around), coat)).sum(axis=1)).real / WAVE


@cache
def between_peaks(side: int, coat: tuple) -> np.ndarray:
    """Return the closing (side, side) at each peak of a square lattice per unit force on the first peak [m/N].

    The Hertzian closing of the first peak itself is left out.

    Parameters
    ----------
    side : int
        Peaks along a side.
    coat : tuple
        Young's modulus [Pa] and Poisson's ratio of the coating.
    """
    shells = 40  # periods that are summed
    step = 2 * np.pi / WAVE
    modulus = exact.combined_modulus(*coat)
    qx, qy = np.meshgrid(*[step * np.fft.fftfreq(side)] * 2, indexing="ij")
    # contribution of the waves beyond the summed shells
    waves = np.pi * (qx**2 + qy**2) / (modulus * step**3 * (shells + 0.5))
    for i in range(-shells, shells + 1):
        for j in range(-shells, shells + 1):
            if np.hypot(i, j) <= shells:
                waves = waves + closing_of_waves(np.hypot(qx + i * step, qy + j * step), coat)
                waves -= closing_of_waves(step * np.hypot(i, j), coat)
    return np.fft.ifft2(waves / WAVE**2 + LATTICE / (np.pi * modulus * WAVE)).real


def own_ridge(force, modulus: float) -> tuple:
    """Return the closing [m] of one of equal ridges under a force [N/m], and its derivative (Westergaard)."""
    full = exact.westergaard_full_pressure(WAVE, HEIGHT, modulus) * WAVE
    return HEIGHT * force / full * (1 - np.log(force / full)), -HEIGHT / full * np.log(force / full)


def own_peak(force, modulus: float) -> tuple:
    """Return the closing [m] of a round peak under a force [N], and its derivative (Hertz)."""
    closing = (9 * force**2 / (16 * RADIUS * modulus**2)) ** (1 / 3)
    return closing, 2 / 3 * closing / force


def one_each(depth, round_peaks: bool = False, coat: tuple = CARBIDE) -> tuple:
    """Solve peaks with one force each; return k_n = dp/d(closing) [Pa/m] and the forces (count,).

    Parameters
    ----------
    depth : (count,) array
        Of the peaks below the highest [m].
    round_peaks : bool
        Round peaks instead of ridges.
    coat : tuple
        Young's modulus [Pa] and Poisson's ratio of the coating.
    """
    count = depth.size
    modulus = exact.combined_modulus(*coat)
    number = np.arange(count)
    if round_peaks:
        side = round(count**0.5)
        own = own_peak
        cell = WAVE**2
        i, j = np.divmod(number, side)
        c = between_peaks(side, coat)[(i[:, None] - i) % side, (j[:, None] - j) % side]
    else:
        own = own_ridge
        cell = WAVE
        c = between_ridges(count, coat)[(number[:, None] - number) % count]
    force = np.full(count, MEAN * cell)
    last = 0.0
    interface = Interface(number.astype(float), np.ones(count), 1.0)
    holder = Holders(MEAN * cell * count)
    # secant iteration of the force on each peak; each iteration reduces the error to a third or less
    while np.abs(force - last).max() > 1e-11 * force.max():
        last = force
        soft = np.maximum(force, 1e-9 * force.max())
        softened = c + np.diag(own(soft, modulus)[0] / soft)
        force = press_patch(Compliance(interface, softened, softened), depth, holder).force
    live = np.flatnonzero(force > 0)
    tangent = c[np.ix_(live, live)] + np.diag(own(force[live], modulus)[1])
    return float(np.linalg.solve(tangent, np.ones(live.size)).sum() / (count * cell)), force


def explicit(depth, points: int) -> float:
    """Return k_n [Pa/m] of ridges at `depth` (count,) that a grid of `points` resolves.

    It is computed from two pressures, 2 % below and above the mean pressure.
    """
    length = WAVE * depth.size
    x = np.arange(points) * (length / points)
    gap = (
        HEIGHT * (1 - np.cos(2 * np.pi * x / WAVE))
        + depth[np.round(x / WAVE).astype(int) % depth.size]
    )
    waves = closing_of_waves(2 * np.pi * np.fft.rfftfreq(points, length / points))
    low, high = (press_periodic(waves, gap, by * MEAN).closing for by in (0.98, 1.02))
    return 0.04 * MEAN / (high - low)


def separate(scatter: float, shape: str) -> float:
    """Return k_n [Pa/m] of round peaks that do not interact, with equal, `uniform` or `gaussian` heights."""
    modulus = exact.combined_modulus(*CARBIDE)
    density = WAVE**-2
    rate = 4 / 3 * modulus * RADIUS**0.5 * density
    if scatter == 0:
        return 1.5 * rate ** (2 / 3) * MEAN ** (1 / 3)
    if shape == "gaussian":
        law = HertzAsperities(RADIUS, density, scatter, modulus)
        return float(law.stiffness(law.separation(np.array([MEAN])))[0])

    def carried_pressure(power: float, depth: float) -> float:
        return rate * (depth**power - max(depth - scatter, 0.0) ** power) / scatter

    depth = brentq(lambda d: carried_pressure(2.5, d) / 2.5 - MEAN, 0, 1e-4, xtol=1e-18)
    return carried_pressure(1.5, depth)
