"""Search for the place of a second surface on the first one, by the correlation of their short waves."""

from itertools import product
from typing import NamedTuple

import numpy as np
from scipy import fft, ndimage

from ..profile import robust_deviation
from .raster import Raster, fill_gaps
from .statistics import MIN_DIVISOR, remove_long_waves, smooth

# Rotations of a scan [rad] that are tried, also after half a turn
TRIED_ROTATIONS = np.radians(np.arange(-6, 6.1, 0.5))
# Turns that are tried, by number of axes: relative differences in length of traces, and rotations [rad] of scans
TRIED_TURNS = {
    1: np.linspace(-0.01, 0.01, 11),
    2: np.concatenate((TRIED_ROTATIONS, TRIED_ROTATIONS + np.pi)),
}


class Place(NamedTuple):
    """Place of one surface on the other: the map from sampled to other points (`model`) in d dimensions.

    - shift (d,): shift of the map [m].
    - turn: stretch of traces [1], or rotation of scans [rad].
    - mirrored: whether the second surface was measured against the direction of x.
    - significance: significance of the correlation of both surfaces at this place.
    """

    shift: np.ndarray
    turn: float
    mirrored: bool = False
    significance: float = np.inf


def make_matrix(turn: float, n_axes: int) -> np.ndarray:
    """Return the matrix (d, d) of the map from sampled to other points: a stretch of traces, a rotation of scans.

    `turn` is the stretch [1] or the rotation [rad], and `n_axes` is 1 for traces and 2 for scans.
    """
    if n_axes == 1:
        return np.array([[1 + turn]])
    cos = np.cos(turn)
    sin = np.sin(turn)
    return np.array([[cos, sin], [-sin, cos]])


def order(first: Raster, second: Raster) -> tuple[Raster, Raster]:
    """Return the sampled and the other surface, of the surfaces before and after wear.

    Depths are computed at the points of the sampled surface: the second of two traces, the first of two scans.
    """
    return (second, first) if first.z.ndim == 1 else (first, second)


def find_place(first: Raster, second: Raster) -> Place:
    """Find the place of the second surface with the most significant correlation.

    The significance is Fisher's z times the root of the number of common points, relative to its scatter over all lags.

    Parameters
    ----------
    first, second : Raster
        Heights before and after wear.

    Returns
    -------
    Place
        Shift [m], turn and mirroring of the second surface.
    """
    # Both surfaces become images with the same square pixels: those of the finer surface, unless they were too many.
    n_axes = first.z.ndim
    longest = max(first.lengths.max(), second.lengths.max())
    finest = min(first.steps.min(), second.steps.min())
    # Points along the longer side of the images that are correlated
    pixel = max(finest, longest / {1: 4000, 2: 96}[n_axes])

    best = Place(np.zeros(n_axes), 0.0, significance=-np.inf)
    for mirrored in (False, True):
        sampled, other = order(first, second.mirror() if mirrored else second)
        images = zip(*(_make_images(surface, pixel) for surface in (sampled, other)))
        for (image, other_image), turn in product(images, TRIED_TURNS[n_axes]):
            # The other image is turned about its middle, and correlated with the sampled one at all lags at once.
            matrix = make_matrix(turn, n_axes)
            center = (np.array(other_image.shape) - 1) / 2
            offset = center - matrix @ center
            turned = ndimage.affine_transform(other_image, matrix, offset, order=1)
            significance = correlate(image, turned)
            peak = np.unravel_index(np.argmax(significance), significance.shape)
            if significance[peak] <= best.significance:
                continue

            # Lags beyond the size of the sampled image are negative: they stand at the end of each axis.
            lag = np.where(
                np.array(peak) < image.shape, peak, np.subtract(peak, significance.shape)
            )
            # The middle of the sampled surface lies at this point of the turned image.
            at = (sampled.middle - sampled.origin) / pixel - lag
            place = other.origin + pixel * (center + matrix @ (at - center))
            best = Place(place - sampled.middle, float(turn), mirrored, float(significance[peak]))
        # Mirrored scans are tried only if this side does not fit clearly. Traces are always tried both ways.
        # Significance of a place beyond which no mirrored scan is tried.
        if best.significance > 9.0 and n_axes > 1:
            break
    return best


def _make_images(surface: Raster, pixel: float) -> tuple[np.ndarray, ...]:
    """Return images of the short waves of a surface on square pixels [m], by which its position is sought.

    They are all waves (traces only), those of the valleys, which wear last (traces only), and those of the valleys with
    equal power at all wavelengths. Without equal power, turned surfaces would agree at each period of their feed marks.
    """
    z = smooth(fill_gaps(surface.z), 0.4 * pixel / surface.steps)
    shape = (surface.lengths / pixel).astype(int) + 1
    z = ndimage.affine_transform(
        z, pixel / surface.steps, output_shape=tuple(shape), order=1, mode="nearest"
    )
    z = remove_long_waves(z, {1: 40, 2: 12}[z.ndim])
    clipped = np.clip(z, -3 * z.std(), 3 * z.std())
    valleys = np.minimum(clipped, np.median(z))
    valleys = valleys - valleys.mean()
    images = (valleys, _whiten(valleys))
    return images[1:] if z.ndim > 1 else (clipped - clipped.mean(), *images)


def _whiten(z) -> np.ndarray:
    """Return heights z (n,) or (m, n) whose waves have nearly equal amplitudes, so that a periodic lay hides no others.

    A trace is first tapered to zero at its ends, because jumps there would be short waves that both traces share.
    """
    if z.ndim == 1:
        # Tukey's window falls to zero as half a period of a cosine at each end.
        from_end = np.minimum(np.arange(z.size), np.arange(z.size)[::-1]) / (z.size - 1)
        # Fraction of a trace, half of it at each end, over which its heights fall to zero before
        # its spectrum is whitened
        z = z * np.sin(np.pi * np.minimum(from_end / 0.1, 0.5)) ** 2
    spectrum = fft.rfftn(z)
    size = np.abs(spectrum)
    return fft.irfftn(spectrum / (size + np.median(size) + MIN_DIVISOR), z.shape)


def correlate(first, second) -> np.ndarray:
    """Return the significance of the correlation of two images at each lag, or -inf where they overlap too little.

    `first` and `second` (n,) or (m, n) are heights without long waves on equal pixels. A lag is the number of pixels by
    which the second image is moved. Negative lags stand at the end of each axis.
    """
    size = [fft.next_fast_len(a + b, real=True) for a, b in zip(first.shape, second.shape)]
    powers = [(z, z**2, np.ones(z.shape)) for z in (first, second)]
    transforms, others = ([fft.rfftn(values, size) for values in group] for group in powers)
    product, count, power1, power2 = (
        fft.irfftn(transforms[i] * others[k].conj(), size)
        for i, k in ((0, 0), (2, 2), (1, 2), (2, 1))
    )
    norm = np.sqrt(np.maximum(power1 * power2, 1e-12 * power1.max() * power2.max()))
    fisher = np.arctanh(np.clip(product / (norm + MIN_DIVISOR), -0.9999, 0.9999))
    fisher *= np.sqrt(np.maximum(count, 0.0))
    # Smallest common part relative to the smaller image
    usable = count > 0.33 * min(first.size, second.size)
    known = fisher[usable]
    scatter = max(robust_deviation(known - np.median(known)), 1e-12)
    return np.where(usable, fisher / scatter, -np.inf)
