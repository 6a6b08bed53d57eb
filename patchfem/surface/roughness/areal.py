"""What the parameters of an areal scan (ISO 25178-2) are read from: heights, slopes, autocorrelation, direction.

Where heights are missing nothing is read: no point, no slope to or from it, no cell of the area with it, no pair of
heights. Only for the direction of the texture do they count as zero.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core import say
from .parameters import Heights

FALLS = 0.2  # value of the autocorrelation at its length (ISO 25178-3)
NEAR = 2.0  # steps below which a length of autocorrelation is that of the raster
PLAIN = 0.5  # texture aspect ratio above which no direction stands out
BEAM = np.radians(10.0)  # to either side of the strongest direction, over which its middle is taken


@dataclass(frozen=True, eq=False)
class Surface:
    """Heights z (m, n) [m] about their reference surface, NaN where missing, with steps [m] along y and along x.

    level [m], ratios [1]: of the Abbott curve, as in `Heights`.
    """

    z: np.ndarray
    steps: tuple
    level: float = 0.0
    ratios: tuple = (0.1, 0.9)

    @cached_property
    def heights(self) -> Heights:
        """Its measured heights in a row, for what asks only how often a height occurs."""
        return Heights(self.z[~np.isnan(self.z)], min(self.steps), level=self.level, ratios=self.ratios)

    @cached_property
    def slopes(self) -> tuple:
        """Slopes between neighbours down the columns (m - 1, n) and along the rows (m, n - 1), NaN at missing ones."""
        return tuple(np.diff(self.z, axis=axis) / step for axis, step in enumerate(self.steps))

    @cached_property
    def lobe(self) -> tuple:
        """Shortest and longest distance [m] at which the autocorrelation falls to 0.2, None where it does not."""
        return _lobe(autocorrelation(self.z), self.steps) if self.heights.power > 0 else (None, None)


def gradient(surface: Surface) -> float:
    """Sdq: root mean square gradient [1], of the slopes between neighbours along x and along y."""
    return float(np.sqrt(sum(np.nanmean(one**2) for one in surface.slopes)))


def developed(surface: Surface) -> float:
    """Sdr: area of the surface over that of its plane, less one [1].

    Each cell of four heights is cut into two triangles, along either diagonal; its area is the mean of both.
    """
    down, right = (one**2 for one in surface.slopes)
    sums = [across[:, k:][:, :right.shape[1]] + along[j:][:down.shape[0]]
            for across, k in ((down, 0), (down, 1)) for along, j in ((right, 0), (right, 1))]
    return float(np.nanmean(sum(one / (1 + np.sqrt(1 + one)) for one in sums) / 4))


def autocorrelation(z: np.ndarray) -> np.ndarray:
    """Mean product of the heights (m, n) that lie a distance apart over their mean square, at up to half of each side:
    (2 (m // 2) + 1, 2 (n // 2) + 1), zero distance in the middle; each distance by the pairs that are measured."""
    from scipy.fft import irfft2, next_fast_len, rfft2

    there = ~np.isnan(z)
    halves = [count // 2 for count in z.shape]
    shape = [next_fast_len(count + half + 1, real=True) for count, half in zip(z.shape, halves)]
    sums = [irfft2(np.abs(rfft2(one, shape)) ** 2, shape) for one in (np.where(there, z, 0.0), there.astype(float))]
    whole = sums[0] / np.maximum(sums[1], 0.5)
    rows, columns = (np.arange(-half, half + 1) for half in halves)
    return whole[np.ix_(rows, columns)] / whole[0, 0]


def _lobe(rho, steps: tuple) -> tuple:
    """Nearest and farthest place [m] of the line at 0.2 around the middle; the farthest is None where it is open."""
    from contourpy import contour_generator

    y, x = (step * np.arange(-(count // 2), count // 2 + 1) for step, count in zip(steps, rho.shape))
    nearest, around = [], []
    for line in contour_generator(x, y, rho).lines(FALLS):
        start, along = line[:-1], np.diff(line, axis=0)
        share = np.clip(-(start * along).sum(1) / np.maximum((along**2).sum(1), 1e-300), 0, 1)
        nearest.append(float(np.hypot(*(start + share[:, None] * along).T).min()))
        turns = np.unwrap(np.arctan2(line[:, 1], line[:, 0]))
        if abs(turns[-1] - turns[0]) > 6:  # once round the middle
            around.append((nearest[-1], float(np.hypot(*line.T).max())))
    return min(nearest, default=None), min(around)[1] if around else None


def shortest(surface: Surface) -> float | None:
    """Sal: autocorrelation length [m]; None below two steps, or where the autocorrelation never falls to 0.2."""
    found = surface.lobe[0]
    return None if found is None or found < NEAR * max(surface.steps) else found


def aspect(surface: Surface) -> float | None:
    """Str: texture aspect ratio [1], None where the autocorrelation stays above 0.2 along some direction."""
    return None if shortest(surface) is None or surface.lobe[1] is None else surface.lobe[0] / surface.lobe[1]


def direction(surface: Surface) -> float | None:
    """Std: texture direction [rad], from x anticlockwise, 0 to pi; None where no direction stands out.

    The angular spectrum is the power of the waves of one direction, of the heights under a cosine taper; missing ones
    count as zero. Std is the direction of its largest value, the middle of the power within 10 deg to either side; the
    lay runs at right angles to it. Where Str is above 0.5 none stands out.
    """
    from scipy.fft import rfft2

    ratio = aspect(surface)
    if shortest(surface) is None or (ratio is not None and ratio > PLAIN):
        return None
    m, n = surface.z.shape
    power = np.abs(rfft2(np.nan_to_num(surface.z) * cosine_taper(m, n))) ** 2
    power[:, 0] /= 2  # the other waves have their half of the plane once
    power[0, 0] = 0.0
    down, right = np.fft.fftfreq(m, surface.steps[0])[:, None], np.fft.rfftfreq(n, surface.steps[1])
    angle = np.arctan2(down, right) % np.pi
    shares = np.bincount(np.rint(np.degrees(angle)).astype(int).ravel() % 180, power.ravel(), 180)
    shares = np.convolve(np.concatenate([shares[-2:], shares, shares[:2]]), np.ones(5), "valid")
    top = np.radians(np.argmax(shares))
    off = (angle - top + np.pi / 2) % np.pi - np.pi / 2
    near = np.abs(off) < BEAM
    found = float(top + (off[near] * power[near]).sum() / power[near].sum()) % np.pi
    return 0.0 if np.pi - found < 1e-9 else found


def lacking(surface: Surface, name: str) -> str:
    """Why a parameter has no value."""
    near = surface.lobe[0]
    half = min(step * (count // 2) for step, count in zip(surface.steps, surface.z.shape))
    if surface.heights.power == 0:
        return "the scan is flat"
    if name in ("Sal", "Str", "Std") and near is None:
        return "the autocorrelation stays above 0.2 over half of the scan"
    if name in ("Sal", "Str", "Std") and near < NEAR * max(surface.steps):
        return "the autocorrelation falls to 0.2 within two steps"
    if name == "Str":
        return f"along some direction the autocorrelation stays above 0.2 over {say(half)}, so Str is below " \
               f"{near / half:.2g}"
    return ("no direction stands out, because Str is "
            f"{aspect(surface):.2g}") if name == "Std" else "the heights do not determine this parameter"


def cosine_taper(m: int, n: int) -> np.ndarray:
    """Weights (m, n) of a spectrum: half a sine wave along each side."""
    return np.outer(np.sin(np.pi * (np.arange(m) + 0.5) / m), np.sin(np.pi * (np.arange(n) + 0.5) / n))
