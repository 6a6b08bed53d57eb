"""Coarse search for the position of a second scan on a first one.

Shifts, rotations by some degrees and by 180 degrees, mirrored and inverted scans are tried. Heights
are averaged over pixels, and long waves are subtracted. Heights above the median are clipped, as
wear removes them. The spectrum is whitened, so that a periodic lay does not hide the valleys that
mark a position (phase correlation; Kuglin and Hines, Proc. IEEE Conf. Cybernetics and Society (1975)
163). The masked correlation at every shift is computed by Fourier transforms for each rotation.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..areal import Areal
from ..profile import robust_deviation
from .model import make_raster, rotation

SIZE = 224  # number of pixels along the longer side of the images
ANGLES = np.radians(np.arange(-12, 13) / 2)  # -6 to 6 degrees [rad]; half a degree is one pixel
FINE_ANGLES = np.radians(np.arange(-3, 4) / 8)  # angles [rad] that are added to the best one
MIN_OVERLAP = 0.35  # smallest fraction of the smaller image that must overlap the other one
# Width, as a fraction of the shorter side, of the Gaussian filter whose mean is subtracted.
LONG_WAVES = 0.03
# Largest depth in standard deviations; deeper grooves and scratches do not identify a position.
MAX_VALLEY_DEPTH = 3.0
WHITENING_FLOOR = 0.3  # fraction of the rms of a spectrum; weaker waves are not amplified
WHITENING_WIDTH = 1.5  # width in pixels of the spectrum over which its power is averaged
TAPER = 0.25  # exponent of the Hann window, which keeps its tapered rim narrow
# Smallest significance of a position in standard deviations; false
# positions on a periodic lay reach 9.
MIN_SIGNIFICANCE = 10.0
MAX_PLACEMENTS = 8  # largest number of placements that are fitted to images, which limits the time
MAX_PER_VARIANT = 3  # largest number of placements of one mirrored or inverted variant
MIN_ANGLE_DISTANCE = 0.02  # smallest angle [rad] between two different placements
MIN_PIXEL_DISTANCE = 4  # smallest shift in pixels between two different placements


class Placement(NamedTuple):
    """Approximate position of the second scan relative to the first one.

    angle [rad], shift (2,) [m]: as defined in `model`; mirrored: axis of the second scan that was
    mirrored first, "x", "y" or ""; is_inverted: whether its heights changed sign; correlation: of
    the valleys; significance: standard deviations by which it exceeds that at other shifts.
    """

    angle: float
    shift: np.ndarray
    mirrored: str
    is_inverted: bool
    correlation: float
    significance: float


def transform_scan(scan: Areal, mirrored: str, is_inverted: bool) -> Areal:
    """Mirror a scan about its middle, and invert its heights on request."""
    x = scan.x[0] + scan.x[-1] - scan.x[::-1] if mirrored == "x" else scan.x
    y = scan.y[0] + scan.y[-1] - scan.y[::-1] if mirrored == "y" else scan.y
    z = {"": scan.z, "x": scan.z[:, ::-1], "y": scan.z[::-1]}[mirrored]
    return replace(scan, x=x, y=y, z=-z if is_inverted else z)


def find_placements(before: Areal, after: Areal) -> list:
    """Find the placements of the second scan with the highest correlation.

    The scan is tried as given, mirrored, inverted, and rotated by 180 degrees, until one placement
    is significant; this one is then returned alone.
    """
    step = pixel_size(before, after)
    search = _ImageCorrelator(*whiten_valleys(*resample_image(before, step)))
    out = []
    for is_inverted in (False, True):
        for mirrored, half_turn in (("", 0.0), ("x", 0.0), ("y", 0.0), ("", np.pi)):
            other = transform_scan(after, mirrored, is_inverted)
            offset = make_raster(other).middle - make_raster(before).middle
            image = whiten_valleys(*resample_image(other, step))
            for peak in search.find_peaks(*image, half_turn):
                shift = offset + rotation(peak.angle) @ (step * peak.lag)
                variant = (shift, mirrored, is_inverted)
                out.append(Placement(peak.angle, *variant, peak.correlation, peak.significance))
            best = max(out, key=lambda placement: placement.significance)
            if best.significance > MIN_SIGNIFICANCE:
                return [best]
    return sorted(out, key=lambda placement: -placement.correlation)[:MAX_PLACEMENTS]


def pixel_size(*scans: Areal) -> float:
    """Return the pixel size [m] of the images in which a placement is searched."""
    return max(max(np.ptp(scan.x), np.ptp(scan.y)) for scan in scans) / SIZE


def resample_image(scan: Areal, step: float) -> tuple:
    """Average the heights of a scan over larger pixels.

    Parameters
    ----------
    scan : Areal
    step : float
        Pixel size [m].

    Returns
    -------
    z : (m, n) array [m]
        Mean heights, 0 where less than half of a pixel was measured.
    known : (m, n) bool array
        Whether at least half of the pixel was measured.
    """
    from scipy.ndimage import map_coordinates, uniform_filter

    known = ~scan.missing
    z = np.where(known, scan.z - scan.z[known].mean(), 0.0)
    size = [max(1, round(step / own)) for own in make_raster(scan).steps[::-1]]
    weight = uniform_filter(known.astype(float), size)
    z = uniform_filter(z, size) / np.maximum(weight, 1e-6)
    places = [
        np.interp(_even_axis(axis, step), axis, np.arange(axis.size)) for axis in (scan.y, scan.x)
    ]
    grid = np.meshgrid(*places, indexing="ij")
    known = map_coordinates(weight, grid, order=1, mode="nearest") > 0.5
    return np.where(known, map_coordinates(z, grid, order=1, mode="nearest"), 0.0), known


def _even_axis(axis, step: float) -> np.ndarray:
    """Return evenly spaced positions, centred on the middle of the axis; step in [m]."""
    count = max(int(np.ptp(axis) / step + 1e-6) + 1, 2)
    return (axis[0] + axis[-1]) / 2 + step * (np.arange(count) - (count - 1) / 2)


def subtract_long_waves(z, known, sigma: float) -> np.ndarray:
    """Subtract the Gaussian mean over `sigma` pixels; unmeasured pixels become 0."""
    from scipy.ndimage import gaussian_filter

    weight = gaussian_filter(known.astype(float), sigma, truncate=3.0)
    mean = gaussian_filter(np.where(known, z, 0.0), sigma, truncate=3.0) / np.maximum(weight, 1e-6)
    return np.where(known, z - mean, 0.0)


def whiten_valleys(z, known) -> tuple:
    """Return the valleys of an image with whitened spectrum, and their mask."""
    from scipy.fft import irfft2, rfft2
    from scipy.ndimage import gaussian_filter

    flat = subtract_long_waves(z, known, LONG_WAVES * min(z.shape))
    flat = flat - np.median(flat[known])
    deepest = -MAX_VALLEY_DEPTH * robust_deviation(flat[known])
    valleys = np.where(known, np.clip(flat, deepest, 0.0), 0.0)
    window = np.outer(*(np.hanning(count + 2)[1:-1] ** TAPER for count in z.shape))
    spectrum = rfft2(valleys * window)
    power = np.abs(spectrum) ** 2
    floor = max(WHITENING_FLOOR * np.sqrt(power.mean()), 1e-300)
    spectrum = spectrum / (np.sqrt(gaussian_filter(power, WHITENING_WIDTH)) + floor)
    valleys = irfft2(spectrum, z.shape)
    return np.where(known, valleys - valleys[known].mean(), 0.0), known


class _Peak(NamedTuple):
    """Maximum of the correlation at an angle [rad] and a lag (2,) in pixels along x and y."""

    angle: float
    lag: np.ndarray
    correlation: float
    significance: float


class _ImageCorrelator:
    """Masked normalized correlation of a fixed image with other images."""

    def __init__(self, z, known):
        self.z = z
        self.known = known
        self.size = None

    def _prepare_transforms(self, shape) -> None:
        """Compute the Fourier transforms of the fixed image, padded for an image of this shape."""
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

    def correlate(self, z, known) -> np.ndarray:
        """Return the correlation at every lag; it is -1 where the images overlap too little."""
        from scipy.fft import irfft2, rfft2

        self._prepare_transforms(z.shape)
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
        product, first, second, count = (irfft2(a * b, self.size)[self.lags] for a, b in pairs)
        square = np.maximum(first, 0.0) * np.maximum(second, 0.0)
        valid = count > MIN_OVERLAP * min(self.known.sum(), known.sum())
        valid &= square > 1e-12 * square.max()
        return np.where(valid, product / np.sqrt(np.where(valid, square, 1.0)), -1.0)

    def _correlate_rotated(self, z, known, angle: float) -> np.ndarray:
        """Return the correlation with an image that is rotated back by an angle [rad]."""
        from scipy.ndimage import rotate

        z, known = (
            rotate(part.astype(float), np.degrees(angle), reshape=False, order=1)
            for part in (z, known)
        )
        known = known > 0.5
        return self.correlate(np.where(known, z, 0.0), known)

    def find_peaks(self, z, known, half_turn: float) -> list:
        """Find the highest peaks of the correlation over angle and lag.

        half_turn: pi if the image is rotated by 180 degrees first, else 0.
        """
        if half_turn:
            z = np.rot90(z, 2)
            known = np.rot90(known, 2)
        peaks = [_find_maximum(self._correlate_rotated(z, known, angle), angle) for angle in ANGLES]
        best = max(peaks)
        values = self._correlate_rotated(z, known, best.angle)
        for angle in best.angle + FINE_ANGLES[FINE_ANGLES != 0]:
            peaks.append(_find_maximum(self._correlate_rotated(z, known, angle), angle))
        rows, columns = np.indices(values.shape)
        distance = np.maximum(abs(rows - best.row), abs(columns - best.column))
        others = values[(distance > MIN_PIXEL_DISTANCE) & (values > -1.0)]
        others = np.arctanh(np.clip(others, -0.999999, 0.999999))
        centre = np.subtract(z.shape, self.z.shape)[::-1] / 2
        out = []
        for maximum in _select_distinct(peaks):
            lag = np.array([self.columns[maximum.column], self.rows[maximum.row]]) - centre
            excess = np.arctanh(min(maximum.value, 0.999999)) - others.mean()
            significance = float(excess / max(float(others.std()), 1e-9))
            out.append(_Peak(maximum.angle + half_turn, lag, maximum.value, significance))
        return out


class _Maximum(NamedTuple):
    """Largest correlation of two images at one rotation, with its shift."""

    value: float
    angle: float
    row: int
    column: int


def _find_maximum(values, angle: float) -> _Maximum:
    row, column = np.unravel_index(np.argmax(values), values.shape)
    return _Maximum(float(values[row, column]), float(angle), int(row), int(column))


def _select_distinct(peaks: list) -> list:
    """Select the largest peaks that differ from each other in angle or lag."""
    kept = []
    for new in sorted(peaks, reverse=True):
        is_new = all(
            abs(new.angle - other.angle) > MIN_ANGLE_DISTANCE
            or max(abs(new.row - other.row), abs(new.column - other.column)) > MIN_PIXEL_DISTANCE
            for other in kept
        )
        if is_new and len(kept) < MAX_PER_VARIANT:
            kept.append(new)
    return kept
