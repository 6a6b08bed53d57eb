"""Where a scan lies on another one, roughly: every shift, rotations of some degrees, mirrored and turned over."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..areal import Areal

SIZE = 224  # pixels along the longer side of the images of the search
ANGLES = np.radians(np.arange(-6.0, 6.01, 0.5))  # rotations that are tried; a pixel at the edge of an image
FINER = np.radians([-0.375, -0.25, -0.125, 0.125, 0.25, 0.375])  # about the likeliest of them
OVERLAP = 0.35  # of the smaller scan, at least, lies on the other one
WAVES = 0.03  # of the shorter side: standard deviation of the Gauss filter whose mean is taken off the heights
DEEP = 3.0  # scatters below the median beyond which a valley counts no more: a deep groove is no mark of the place
FLOOR, BESIDE = 0.3, 1.5  # of the root mean square of a spectrum, added to what it is divided by; of its pixels
TAPER = 0.25  # power of the Hann window that takes the edges of an image off
CLEAR = 10.0  # scatters above the likeness at other shifts; wrong places of a lay that repeats itself reach 9
SURE = 14.0  # beyond which no other variant is tried
TRIED, EACH = 8, 3  # places that are looked at closely, of one variant at most
APART = 0.02  # rad from which on two rotations at one shift are two places
NEAR = 4  # pixels around the likest shift that belong to it


class Guess(NamedTuple):
    """A place of a scan on another one.

    angle [rad], shift (2,) [m]: a place of the first scan, turned by the angle about its middle and moved by the shift,
    is where it stands in the second, whose x or y is mirrored before ("" for neither) and whose heights are turned
    over, where it says so; likeness: correlation of the valleys there; clear: how many scatters of the likeness at
    other shifts it lies above their mean.
    """

    angle: float
    shift: np.ndarray
    mirrored: str
    turned: bool
    likeness: float
    clear: float


def variant(scan: Areal, mirrored: str, turned: bool) -> Areal:
    """A scan with x or y mirrored about its own middle, and with heights of the other sign."""
    x = scan.x[0] + scan.x[-1] - scan.x[::-1] if mirrored == "x" else scan.x
    y = scan.y[0] + scan.y[-1] - scan.y[::-1] if mirrored == "y" else scan.y
    z = {"": scan.z, "x": scan.z[:, ::-1], "y": scan.z[::-1]}[mirrored]
    return replace(scan, x=x, y=y, z=-z if turned else z)


def middle(scan: Areal) -> np.ndarray:
    """Middle (x, y) [m] of a scan."""
    return np.array([scan.x[0] + scan.x[-1], scan.y[0] + scan.y[-1]]) / 2


def guesses(before: Areal, after: Areal) -> list:
    """The likeliest places of a scan on another: as given, mirrored, turned over or both, and turned half round. One
    alone where it is clear.

    Heights are averaged over pixels, long waves taken off, and what lies above the median is cut off, as wear does.
    All wavelengths are made about as strong, so that a lay that repeats itself does not hide the marks that do not
    (Kuglin and Hines 1975). The masked correlation is taken by transforms at each rotation, missing heights left out.
    """
    step, out = step_of(before, after), []
    fixed = image(before, step)
    for turned in (False, True):
        for mirrored, half in (("", 0.0), ("x", 0.0), ("y", 0.0), ("", np.pi)):
            other = variant(after, mirrored, turned)
            away = middle(other) - middle(before)
            for angle, lag, *rest in _Search(valleys(*fixed)).best(valleys(*image(other, step)), half, step):
                out.append(Guess(angle, away + rotation(angle) @ lag, mirrored, turned, *rest))
            if max(one.clear for one in out) > SURE:
                return [max(out, key=lambda one: one.clear)]
    return sorted(out, key=lambda one: -one.likeness)[:TRIED]


def step_of(*scans: Areal) -> float:
    """Step [m] of the images of a search."""
    return max(max(np.ptp(one.x), np.ptp(one.y)) for one in scans) / SIZE


def rotation(angle: float) -> np.ndarray:
    """Matrix (2, 2) of a rotation, anticlockwise > 0."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def image(scan: Areal, step: float) -> tuple:
    """Heights (m, n) [m] about the mean at an even step [m], each the mean over a pixel, and whether half of it was
    measured (m, n); 0 where not."""
    from scipy.ndimage import map_coordinates, uniform_filter

    there = ~scan.missing
    z = np.where(there, scan.z - scan.z[there].mean(), 0.0)
    own = [np.ptp(axis) / (axis.size - 1) for axis in (scan.y, scan.x)]
    size = [max(1, round(step / one)) for one in own]
    weight = uniform_filter(there.astype(float), size)
    z = uniform_filter(z, size) / np.maximum(weight, 1e-6)
    places = [np.interp(_even(axis, step), axis, np.arange(axis.size)) for axis in (scan.y, scan.x)]
    grid = np.meshgrid(*places, indexing="ij")
    known = map_coordinates(weight, grid, order=1, mode="nearest") > 0.5
    return np.where(known, map_coordinates(z, grid, order=1, mode="nearest"), 0.0), known


def _even(axis, step: float) -> np.ndarray:
    """Places about the middle of an axis at an even step [m]."""
    count = max(int(np.ptp(axis) / step + 1e-6) + 1, 2)
    return (axis[0] + axis[-1]) / 2 + step * (np.arange(count) - (count - 1) / 2)


def without_waves(z, known, sigma: float) -> np.ndarray:
    """Heights without the mean of a Gauss filter over `sigma` pixels, of what was measured; 0 elsewhere."""
    from scipy.ndimage import gaussian_filter

    weight = gaussian_filter(known.astype(float), sigma, truncate=3.0)
    mean = gaussian_filter(np.where(known, z, 0.0), sigma, truncate=3.0) / np.maximum(weight, 1e-6)
    return np.where(known, z - mean, 0.0)


def valleys(z, known) -> tuple:
    """What lies below the median of the heights without long waves, every wavelength about as strong (whitened), about
    its mean, and what was measured."""
    from scipy.fft import irfft2, rfft2
    from scipy.ndimage import gaussian_filter

    flat = without_waves(z, known, WAVES * min(z.shape))
    flat = flat - np.median(flat[known])
    low = np.where(known, np.clip(flat, -DEEP * 1.4826 * np.median(np.abs(flat[known])), 0.0), 0.0)
    window = np.outer(*(np.hanning(count + 2)[1:-1]**TAPER for count in z.shape))
    waves = rfft2(low * window)
    power = np.abs(waves)**2
    waves = waves / (np.sqrt(gaussian_filter(power, BESIDE)) + max(FLOOR * np.sqrt(power.mean()), 1e-300))
    low = irfft2(waves, z.shape)
    return np.where(known, low - low[known].mean(), 0.0), known


class _Search:
    """Masked correlation of a fixed image with others."""

    def __init__(self, fixed: tuple):
        self.z, self.known = fixed
        self.size = None

    def _sized(self, shape) -> None:
        from scipy.fft import next_fast_len, rfft2

        size = tuple(next_fast_len(a + b, real=True) for a, b in zip(self.z.shape, shape))
        if size != self.size:
            self.size = size
            self.ffts = [np.conj(rfft2(one, size)) for one in (self.z, self.z**2, self.known.astype(float))]
            rows, columns = (np.arange(1 - one, two) for one, two in zip(self.z.shape, shape))
            self.lags = np.ix_(rows % size[0], columns % size[1])
            self.places = rows, columns

    def likeness(self, z, known) -> np.ndarray:
        """Correlation at every lag; -1 where too little is in common."""
        from scipy.fft import irfft2, rfft2

        self._sized(z.shape)
        moved = [rfft2(one, self.size) for one in (z, z**2, known.astype(float))]
        product, one, two, count = (irfft2(a * b, self.size)[self.lags] for a, b in
                                    ((self.ffts[0], moved[0]), (self.ffts[1], moved[2]), (self.ffts[2], moved[1]),
                                     (self.ffts[2], moved[2])))
        square = np.maximum(one, 0.0) * np.maximum(two, 0.0)
        enough = (count > OVERLAP * min(self.known.sum(), known.sum())) & (square > 1e-12 * square.max())
        return np.where(enough, product / np.sqrt(np.where(enough, square, 1.0)), -1.0)

    def _turned(self, moved: tuple, half: float, angle: float) -> tuple:
        """(likeness at every lag, the likeliest one) of an image turned by an angle, and half round or not."""
        from scipy.ndimage import rotate

        z, known = (np.rot90(one, 2) for one in moved) if half else moved
        # the image in the axes of the fixed one: rows count along y, so a positive angle turns them back
        z, known = (rotate(one.astype(float), np.degrees(angle), reshape=False, order=1) for one in (z, known))
        known = known > 0.5
        here = self.likeness(np.where(known, z, 0.0), known)
        return here, np.unravel_index(np.argmax(here), here.shape)

    def best(self, moved: tuple, half: float, step: float) -> list:
        """(angle, shift [m], likeness, clear) of the likest places of an image, turned half round or not."""
        found, like = [], None
        for angle in ANGLES:
            here, at = self._turned(moved, half, angle)
            if like is None or here[at] > max(found)[0]:
                like, top = here, at
            found.append((float(here[at]), angle, at))
        for _, angle, _ in sorted(found, reverse=True)[:1]:
            for finer in angle + FINER:
                here, at = self._turned(moved, half, finer)
                found.append((float(here[at]), finer, at))
        kept = []
        for one in sorted(found, reverse=True):
            if len(kept) < EACH and all(abs(one[1] - other[1]) > APART or
                                        np.abs(np.subtract(one[2], other[2])).max() > NEAR for other in kept):
                kept.append(one)
        rows, columns = np.indices(like.shape)
        beside = (np.maximum(abs(rows - top[0]), abs(columns - top[1])) > NEAR) & (like > -1.0)
        z = np.arctanh(np.clip(like[beside], -0.999999, 0.999999))
        mean, scatter, shapes = z.mean(), max(float(z.std()), 1e-9), np.subtract(moved[0].shape, self.z.shape) / 2
        return [(angle + half, step * np.array([self.places[1][at[1]] - shapes[1], self.places[0][at[0]] - shapes[0]]),
                 one, float((np.arctanh(min(one, 0.999999)) - mean) / scatter)) for one, angle, at in kept]
