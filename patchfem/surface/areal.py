"""Areal scan of heights on a rectangular raster: its rows and columns, and its levelling."""

from dataclasses import dataclass, replace

import numpy as np

from ..core import PatchfemError, frozen_array
from .profile import Profile, robust_deviation

SPIKE_THRESHOLDS = (10.0, 40.0, 160.0)  # |height - median of 5 x 5| in standard deviations
MAX_SPIKE_POINTS = 12  # number of points of a spike; a larger group is a feature of the surface
SPIKE_WINDOW = 5  # side of the square of the median
# Singular value of the normal equations per height, at or below which it counts as round-off.
RANK_TOL = 1e-12


@dataclass(frozen=True, eq=False, slots=True)
class Areal:
    """Areal scan: heights z (m, n) [m] at x (n,) [m] along rows and y (m,) [m] along columns.

    Missing heights are NaN; x and y increase. source: name of the scan for messages; notes:
    sentences on its treatment.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    source: str
    notes: tuple = ()

    @property
    def missing(self) -> np.ndarray:
        """Mask (m, n) of the points that have no measured height."""
        return np.isnan(self.z)

    def row(self, k: int) -> Profile:
        """Return the trace along x at y[k]."""
        return self._trace(self.x, self.z, k, "row")

    def column(self, k: int) -> Profile:
        """Return the trace along y at x[k]."""
        return self._trace(self.y, self.z.T, k, "column")

    def _trace(self, places, heights, k: int, name: str) -> Profile:
        count = len(heights)
        if not -count <= k < count:
            raise PatchfemError(
                f"{self.source}: no {name} {k}; the scan has {count} of them, counted from 0"
            )
        return Profile(
            frozen_array(places), frozen_array(heights[k]), f"{self.source}, {name} {k}", self.notes
        )


def fill_nearest(z) -> np.ndarray:
    """Give missing heights (NaN) of a map (m, n) the value of the nearest measured point."""
    from scipy.ndimage import distance_transform_edt

    missing = np.isnan(z)
    if not missing.any():
        return z
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    return z[tuple(nearest)]


def find_scan_spikes(scan: Areal) -> np.ndarray:
    """Return a mask (m, n) of heights far from the median of the 5 x 5 around them, in small groups.

    A larger group is a feature of the surface; the threshold rises until the groups are small.
    """
    from scipy import ndimage

    filled = fill_nearest(scan.z)
    distance = np.abs(filled - ndimage.median_filter(filled, SPIKE_WINDOW))
    deviation = robust_deviation(distance[distance > 0]) if (distance > 0).any() else 0.0
    spikes = np.zeros(filled.shape, bool)
    if not deviation > 0:
        return spikes
    for threshold in SPIKE_THRESHOLDS:
        groups, count = ndimage.label(distance > threshold * deviation, np.ones((3, 3)))
        sizes = np.bincount(groups.ravel(), minlength=count + 1)
        spikes |= (sizes <= MAX_SPIKE_POINTS)[groups] & (groups > 0)
    return spikes & ~scan.missing


def level_plane(scan: Areal) -> Areal:
    """Subtract the least-squares plane of the measured heights of a scan."""
    return level(scan, 1)


def level(scan: Areal, degree: int) -> Areal:
    """Subtract the least-squares polynomial in x and y, of a given total degree, from a scan.

    Raises PatchfemError if the measured heights do not determine it, such as all of them in one
    line.
    """
    known = ~scan.missing
    count = int(known.sum())
    along_x, along_y = (
        np.polynomial.legendre.legvander(_reduce_axis(axis), degree) for axis in (scan.x, scan.y)
    )
    powers = np.arange(degree + 1)
    # Exponents of y along the rows, of x along the columns.
    is_term = np.add.outer(powers, powers) <= degree
    products = (along_x[:, :, None] * along_x[:, None, :]).reshape(scan.x.size, -1)
    sums = (known.astype(float) @ products).reshape(-1, degree + 1, degree + 1)
    normal = np.einsum("mik,mj,ml->jilk", sums, along_y, along_y, optimize=True)[is_term][
        :, is_term
    ]
    rank = np.linalg.matrix_rank(normal / max(count, 1), tol=RANK_TOL, hermitian=True)
    if count < len(normal) or rank < len(normal):
        if degree == 1:
            raise PatchfemError(
                f"{scan.source}: {count} heights, which all lie on one straight line; a plane "
                "needs three points that do not"
            )
        raise PatchfemError(
            f"{scan.source}: {count} heights do not determine a polynomial of degree {degree}; use "
            "a lower degree"
        )
    mean = scan.z[known].mean()
    right = along_y.T @ np.where(known, scan.z - mean, 0.0) @ along_x
    factors = np.zeros(is_term.shape)
    factors[is_term] = np.linalg.solve(normal, right[is_term])
    return replace(scan, z=frozen_array(scan.z - (mean + along_y @ factors @ along_x.T)))


def _reduce_axis(axis) -> np.ndarray:
    """Scale the positions along an axis to the interval [-1, 1]."""
    half = (axis[-1] - axis[0]) / 2
    return (axis - (axis[0] + axis[-1]) / 2) / (half if half > 0 else 1.0)
