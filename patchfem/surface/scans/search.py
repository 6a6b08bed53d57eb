"""Coarse search for the place of a scan on another one: shifts, rotations by some degrees, mirrored or inverted scans.

Heights are averaged over pixels and their long waves are taken off. What lies above the median is cut
off, as wear does. All wavelengths are then made about equally strong, so that a lay that repeats itself
does not hide the marks that do not (phase correlation; Kuglin and Hines, Proc. IEEE Conf. Cybernetics
and Society (1975) 163). The masked correlation at every shift is computed by Fourier transforms for each
rotation.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..areal import Areal
from .model import raster_of, rotation

SIZE = 224  # pixels along the longer side of the images
ANGLES = np.radians(
    np.arange(-6.0, 6.01, 0.5)
)  # rad: rotations that are tried; a step is a pixel at an edge
FINER_ANGLES = np.radians(
    [-0.375, -0.25, -0.125, 0.125, 0.25, 0.375]
)  # rad: tried about the best of them
OVERLAP = 0.35  # fraction of the smaller scan that lies on the other one, at least
LONG_WAVES = (
    0.03  # of the shorter side: standard deviation of the Gauss filter that takes long waves off
)
DEEP = 3.0  # standard deviations of a valley beyond which its depth counts no more: a groove marks no place
WHITENING_FLOOR = 0.3  # of the root mean square of a spectrum, added to what it is divided by
WHITENING_WIDTH = 1.5  # pixels of the spectrum over which its power is averaged
TAPER = 0.25  # exponent of the Hann window that tapers the edges of an image
CLEAR = 10.0  # standard deviations above the likeness at other shifts; wrong places of a periodic lay reach 9
SURE = 14.0  # the same, beyond which no other variant is tried
MAX_GUESSES = 8  # places that are returned
MAX_OF_VARIANT = 3  # places of a variant
ANGLE_APART = 0.02  # rad: smallest difference of two rotations that count as two candidates
PIXELS_APART = 4  # pixels: smallest difference of two shifts that count as two candidates


class Guess(NamedTuple):
    """A place of a scan on another one.

    angle [rad], shift (2,) [m]: see `model`; mirrored: "x" or "y" where that axis of the second scan
    was mirrored first, else ""; turned: whether its heights were inverted; likeness: correlation of
    the valleys there; clear: standard deviations of the likeness at other shifts by which it lies
    above their mean.
    """

    angle: float
    shift: np.ndarray
    mirrored: str
    turned: bool
    likeness: float
    clear: float


def variant(scan: Areal, mirrored: str, turned: bool) -> Areal:
    """Return a scan mirrored in x or y about its centre, and with inverted heights if `turned`."""
    x = scan.x[0] + scan.x[-1] - scan.x[::-1] if mirrored == "x" else scan.x
    y = scan.y[0] + scan.y[-1] - scan.y[::-1] if mirrored == "y" else scan.y
    z = {"": scan.z, "x": scan.z[:, ::-1], "y": scan.z[::-1]}[mirrored]
    return replace(scan, x=x, y=y, z=-z if turned else z)


def guesses(before: Areal, after: Areal) -> list:
    """Find the likeliest places of a scan on another one, as given, mirrored, inverted, or turned by 180 degrees.

    A single place is returned where it is clear.
    """
    step = step_of(before, after)
    search = _Search(*valleys(*image(before, step)))
    out = []
    for turned in (False, True):
        for mirrored, half_turn in (("", 0.0), ("x", 0.0), ("y", 0.0), ("", np.pi)):
            other = variant(after, mirrored, turned)
            away = raster_of(other).middle - raster_of(before).middle
            for peak in search.find_peaks(*valleys(*image(other, step)), half_turn):
                shift = away + rotation(peak.angle) @ (step * peak.lag)
                out.append(Guess(peak.angle, shift, mirrored, turned, peak.likeness, peak.clear))
            if max(guess.clear for guess in out) > SURE:
                return [max(out, key=lambda guess: guess.clear)]
    return sorted(out, key=lambda guess: -guess.likeness)[:MAX_GUESSES]


def step_of(*scans: Areal) -> float:
    """Return the pixel size [m] of the images of a search."""
    return max(max(np.ptp(scan.x), np.ptp(scan.y)) for scan in scans) / SIZE


def image(scan: Areal, step: float) -> tuple:
    """Return the mean heights (m, n) [m] over pixels of a step [m], and whether half of each was measured."""
    from scipy.ndimage import map_coordinates, uniform_filter

    known = ~scan.missing
    z = np.where(known, scan.z - scan.z[known].mean(), 0.0)
    size = [max(1, round(step / own)) for own in raster_of(scan).steps[::-1]]
    weight = uniform_filter(known.astype(float), size)
    z = uniform_filter(z, size) / np.maximum(weight, 1e-6)
    places = [
        np.interp(_even_axis(axis, step), axis, np.arange(axis.size)) for axis in (scan.y, scan.x)
    ]
    grid = np.meshgrid(*places, indexing="ij")
    known = map_coordinates(weight, grid, order=1, mode="nearest") > 0.5
    return np.where(known, map_coordinates(z, grid, order=1, mode="nearest"), 0.0), known


def _even_axis(axis, step: float) -> np.ndarray:
    """Return places about the middle of an axis at an even step [m]."""
    count = max(int(np.ptp(axis) / step + 1e-6) + 1, 2)
    return (axis[0] + axis[-1]) / 2 + step * (np.arange(count) - (count - 1) / 2)


def without_waves(z, known, sigma: float) -> np.ndarray:
    """Return heights less their mean in a Gauss filter over `sigma` pixels; 0 where none was measured."""
    from scipy.ndimage import gaussian_filter

    weight = gaussian_filter(known.astype(float), sigma, truncate=3.0)
    mean = gaussian_filter(np.where(known, z, 0.0), sigma, truncate=3.0) / np.maximum(weight, 1e-6)
    return np.where(known, z - mean, 0.0)


def valleys(z, known) -> tuple:
    """Return the whitened valleys of an image about their mean, and what was measured."""
    from scipy.fft import irfft2, rfft2
    from scipy.ndimage import gaussian_filter

    flat = without_waves(z, known, LONG_WAVES * min(z.shape))
    flat = flat - np.median(flat[known])
    low = np.where(known, np.clip(flat, -DEEP * 1.4826 * np.median(np.abs(flat[known])), 0.0), 0.0)
    window = np.outer(*(np.hanning(count + 2)[1:-1] ** TAPER for count in z.shape))
    waves = rfft2(low * window)
    power = np.abs(waves) ** 2
    floor = max(WHITENING_FLOOR * np.sqrt(power.mean()), 1e-300)
    waves = waves / (np.sqrt(gaussian_filter(power, WHITENING_WIDTH)) + floor)
    low = irfft2(waves, z.shape)
    return np.where(known, low - low[known].mean(), 0.0), known


class _Peak(NamedTuple):
    """A likely place: angle [rad], lag (2,) in pixels along x and y, likeness, and how clear it is (`Guess`)."""

    angle: float
    lag: np.ndarray
    likeness: float
    clear: float


class _Search:
    """Masked correlation of a fixed image with others."""

    def __init__(self, z, known):
        self.z = z
        self.known = known
        self.size = None

    def _prepare(self, shape) -> None:
        """Transform the fixed image for images of a shape."""
        from scipy.fft import next_fast_len, rfft2

        size = tuple(next_fast_len(a + b, real=True) for a, b in zip(self.z.shape, shape))
        if size == self.size:
            return
        self.size = size
        self.transforms = [
            np.conj(rfft2(part, size)) for part in (self.z, self.z**2, self.known.astype(float))
        ]
        self.rows, self.columns = (
            np.arange(1 - own, other) for own, other in zip(self.z.shape, shape)
        )
        self.lags = np.ix_(self.rows % size[0], self.columns % size[1])

    def likeness(self, z, known) -> np.ndarray:
        """Return the correlation at every lag, -1 where the images have too little in common."""
        from scipy.fft import irfft2, rfft2

        self._prepare(z.shape)
        fixed, fixed_squares, fixed_known = self.transforms
        moved, moved_squares, moved_known = (
            rfft2(part, self.size) for part in (z, z**2, known.astype(float))
        )
        pairs = (
            (fixed, moved),
            (fixed_squares, moved_known),
            (fixed_known, moved_squares),
            (fixed_known, moved_known),
        )
        product, one, two, count = (irfft2(a * b, self.size)[self.lags] for a, b in pairs)
        square = np.maximum(one, 0.0) * np.maximum(two, 0.0)
        enough = (count > OVERLAP * min(self.known.sum(), known.sum())) & (
            square > 1e-12 * square.max()
        )
        return np.where(enough, product / np.sqrt(np.where(enough, square, 1.0)), -1.0)

    def _likeness_turned(self, z, known, angle: float) -> np.ndarray:
        """Return the likeness of an image that is turned by an angle [rad]."""
        from scipy.ndimage import rotate

        # rows count along y, so a positive angle of `rotate` turns the image back
        z, known = (
            rotate(part.astype(float), np.degrees(angle), reshape=False, order=1)
            for part in (z, known)
        )
        known = known > 0.5
        return self.likeness(np.where(known, z, 0.0), known)

    def find_peaks(self, z, known, half_turn: float) -> list:
        """Find the likeliest places of an image; half_turn [rad]: pi where it is turned by 180 degrees first."""
        if half_turn:
            z, known = np.rot90(z, 2), np.rot90(known, 2)
        tried = [_top_of(self._likeness_turned(z, known, angle), angle) for angle in ANGLES]
        _, angle, top = max(tried)
        like = self._likeness_turned(z, known, angle)
        for finer in angle + FINER_ANGLES:
            tried.append(_top_of(self._likeness_turned(z, known, finer), finer))
        rows, columns = np.indices(like.shape)
        beside = np.maximum(abs(rows - top[0]), abs(columns - top[1])) > PIXELS_APART
        others = np.arctanh(np.clip(like[beside & (like > -1.0)], -0.999999, 0.999999))
        centre = np.subtract(z.shape, self.z.shape)[::-1] / 2
        out = []
        for likeness, angle, at in _distinct(tried):
            lag = np.array([self.columns[at[1]], self.rows[at[0]]]) - centre
            clear = (np.arctanh(min(likeness, 0.999999)) - others.mean()) / max(
                float(others.std()), 1e-9
            )
            out.append(_Peak(angle + half_turn, lag, likeness, float(clear)))
        return out


def _top_of(like, angle: float) -> tuple:
    """Return the largest likeness of a map, the angle [rad], and its row and column."""
    top = np.unravel_index(np.argmax(like), like.shape)
    return float(like[top]), float(angle), top


def _distinct(tried: list) -> list:
    """Return the likeliest (likeness, angle, lag) that differ from each other in angle or lag."""
    kept = []
    for one in sorted(tried, reverse=True):
        is_new = all(
            abs(one[1] - other[1]) > ANGLE_APART
            or np.abs(np.subtract(one[2], other[2])).max() > PIXELS_APART
            for other in kept
        )
        if is_new and len(kept) < MAX_OF_VARIANT:
            kept.append(one)
    return kept
