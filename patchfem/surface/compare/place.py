"""Search for the place of a second surface on the first one, by the correlation of their short waves."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import fft, ndimage

from ..profile import robust_deviation
from .raster import Raster, fill_gaps
from .statistics import TINY, remove_long_waves, smooth

# By number of axes: errors of length of a trace, and rotations of a scan [rad], the same turned by 180 degrees too.
ANGLES = np.radians(np.arange(-6, 6.1, 0.5))
TURNS = {1: np.linspace(-0.01, 0.01, 11), 2: np.concatenate((ANGLES, ANGLES + np.pi))}
# How the second surface may have been measured: against the direction of x, as a replica with inverted heights.
VARIANTS = {
    1: ((False, False), (True, False)),
    2: ((False, False), (True, False), (False, True), (True, True)),
}
MAX_PIXELS = {1: 4000, 2: 96}  # points along the longer side of the images that are correlated
IMAGE_WAVES = {
    1: 40,
    2: 12,
}  # side of an image relative to the deviation of the Gaussian of its long waves
MIN_OVERLAP = 0.33  # smallest common part relative to the smaller image
N_PARTS = 3  # number of parts whose places are sought if that of the whole surface is not clear
N_PEAKS = 3  # number of peaks of a correlation that are tried
PEAK_REACH = 10  # pixels around a peak that belong to it
N_CANDIDATES = 6  # number of places that are refined if none leads clearly
CLEAR_SIGNIFICANCE = 20.0  # significance of a place beyond which no other one is tried
MIN_SIGNIFICANCE = 8.0  # significance of a place that no unrelated surfaces have
CLEAR_LEAD = 1.3  # significance of a place relative to that of the next one, which makes it clear


class Place(NamedTuple):
    """Place of the second surface: shift (d,) [m] and turn of the map from own to other points (`model`).

    mirrored, inverted: how the second surface was measured. significance: of the correlation.
    """

    shift: np.ndarray
    turn: float
    mirrored: bool = False
    inverted: bool = False
    significance: float = np.inf


def make_matrix(turn: float, n_axes: int) -> np.ndarray:
    """Return the matrix (d, d) of the map from own to other points: a stretch of traces, a rotation of scans."""
    if n_axes == 1:
        return np.array([[1 + turn]])
    cos = np.cos(turn)
    sin = np.sin(turn)
    return np.array([[cos, sin], [-sin, cos]])


def change_second(second: Raster, *, mirrored: bool, inverted: bool) -> Raster:
    """Undo a mirrored measurement and a replica."""
    second = second.mirror() if mirrored else second
    return second._replace(z=-second.z) if inverted else second


def order(first: Raster, second: Raster) -> tuple[Raster, Raster]:
    """Return own and other surface: depths stand at the samples of the second trace, or of the first scan."""
    return (second, first) if first.z.ndim == 1 else (first, second)


def find_places(first: Raster, second: Raster) -> list[Place]:
    """Find places of the second surface, the most significant first; a single one if it is clear.

    The significance is Fisher's z times the root of the number of common points, relative to its scatter over all lags.
    """
    n_axes = first.z.ndim
    longest = max(first.lengths.max(), second.lengths.max())
    finest = min(first.steps.min(), second.steps.min())
    pixel = max(finest, longest / MAX_PIXELS[n_axes])
    found: list[Place] = []
    # A part of the surface may show its place although new roughness in a track hides that of the whole.
    for n_parts in (1, N_PARTS):
        for mirrored, inverted in VARIANTS[n_axes]:
            changed = change_second(second, mirrored=mirrored, inverted=inverted)
            for shift, turn, significance in _correlate_turned(
                *order(first, changed), pixel, n_parts
            ):
                found.append(Place(shift, turn, mirrored, inverted, significance))
            found.sort(key=lambda place: -place.significance)
            if found[0].significance > CLEAR_SIGNIFICANCE and n_axes > 1:
                break
        if found[0].significance > CLEAR_SIGNIFICANCE:
            return found[:1]
        if found[0].significance > MIN_SIGNIFICANCE:
            break

    # Places whose shifts differ by less than the waves are the same.
    distinct: list[Place] = []
    for place in found:
        is_new = all(
            np.abs(place.shift - earlier.shift).max() > 2 * PEAK_REACH * pixel
            or place[2:4] != earlier[2:4]
            for earlier in distinct
        )
        if is_new:
            distinct.append(place)
    is_clear = len(distinct) < 2 or distinct[0].significance > CLEAR_LEAD * distinct[1].significance
    return distinct[: 1 if is_clear else N_CANDIDATES]


def _correlate_turned(
    own: Raster, other: Raster, pixel: float, n_parts: int
) -> Iterator[tuple[np.ndarray, float, float]]:
    """Yield shift, turn and significance of the best places of parts of the own surface, for each turn of the other."""
    images = [_make_images(surface, pixel) for surface in (own, other)]
    for turn in TURNS[own.z.ndim]:
        matrix = make_matrix(turn, own.z.ndim)
        for image, other_image in zip(*images):
            center = (np.array(other_image.shape) - 1) / 2
            offset = center - matrix @ center
            turned = ndimage.affine_transform(other_image, matrix, offset, order=1)
            count = image.shape[-1] // n_parts
            for start in range(0, n_parts * count, count):
                for lag, significance in _find_peaks(image[..., start : start + count], turned):
                    # The middle of the own surface lies at this point of the turned image.
                    lag[-1] += start
                    at = (own.middle - own.origin) / pixel - lag
                    place = other.origin + pixel * (center + matrix @ (at - center))
                    yield place - own.middle, float(turn), significance


def _make_images(surface: Raster, pixel: float) -> tuple[np.ndarray, ...]:
    """Return the short waves on square pixels [m]: all, the valleys, which do not wear, and valleys of equal power.

    Without their periods, turned surfaces differ from one feed to the next.
    """
    z = smooth(fill_gaps(surface.z), 0.4 * pixel / surface.steps)
    shape = (surface.lengths / pixel).astype(int) + 1
    z = ndimage.affine_transform(
        z, pixel / surface.steps, output_shape=tuple(shape), order=1, mode="nearest"
    )
    z = remove_long_waves(z, IMAGE_WAVES[z.ndim])
    whole = np.clip(z, -3 * z.std(), 3 * z.std())
    valleys = np.minimum(whole, np.median(z))
    valleys = valleys - valleys.mean()
    images = (valleys, _whiten(valleys))
    return images[1:] if z.ndim > 1 else (whole - whole.mean(), *images)


def _whiten(z) -> np.ndarray:
    """Return heights whose waves are equally high, so that a periodic lay does not hide the others."""
    spectrum = fft.rfftn(z)
    size = np.abs(spectrum)
    return fft.irfftn(spectrum / (size + np.median(size) + TINY), z.shape)


def _find_peaks(first, second) -> list[tuple[np.ndarray, float]]:
    """Return the lags (d,) of the highest peaks of the correlation of two images, and their significance."""
    significance = correlate(first, second)
    size = np.array(significance.shape)
    peaks = []
    for _ in range(N_PEAKS if first.ndim == 1 else 1):
        best = np.array(np.unravel_index(np.argmax(significance), size))
        lag = np.where(best < first.shape, best, best - size)
        peaks.append((lag, float(significance[tuple(best)])))
        # The neighbourhood of a peak belongs to it.
        near = [(at + np.arange(-PEAK_REACH, PEAK_REACH + 1)) % n for at, n in zip(best, size)]
        significance[np.ix_(*near)] = -np.inf
    return peaks


def correlate(first, second) -> np.ndarray:
    """Return the significance of the correlation of two images at each lag, negative lags at the end.

    It is -inf where the images overlap too little.
    """
    size = [fft.next_fast_len(a + b, real=True) for a, b in zip(first.shape, second.shape)]
    powers = [(z, z**2, np.ones(z.shape)) for z in (first, second)]
    transforms, others = ([fft.rfftn(values, size) for values in group] for group in powers)
    product, count, power1, power2 = (
        fft.irfftn(transforms[i] * others[k].conj(), size)
        for i, k in ((0, 0), (2, 2), (1, 2), (2, 1))
    )
    norm = np.sqrt(np.maximum(power1 * power2, 1e-12 * power1.max() * power2.max()))
    fisher = np.arctanh(np.clip(product / (norm + TINY), -0.9999, 0.9999))
    fisher *= np.sqrt(np.maximum(count, 0.0))
    usable = count > MIN_OVERLAP * min(first.size, second.size)
    known = fisher[usable]
    scatter = max(robust_deviation(known - np.median(known)), 1e-12)
    return np.where(usable, fisher / scatter, -np.inf)
