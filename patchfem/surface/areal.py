"""Areal scan of heights on a rectangular raster, and its levelling."""

from dataclasses import replace

import numpy as np

from ..core import PatchfemError, array_dataclass, frozen_array
from .profile import Profile, robust_deviation


@array_dataclass
class Areal:
    """Areal scan of a surface.

    - x (n,), y (m,): increasing positions along rows and along columns [m].
    - z (m, n): heights [m], or NaN where one is missing.
    - source: name of the scan for messages.
    - notes: sentences on its treatment.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    source: str
    notes: tuple[str, ...] = ()

    @property
    def missing(self) -> np.ndarray:
        """Mask (m, n) of the points that have no measured height."""
        return np.isnan(self.z)


def fill_nearest(z) -> np.ndarray:
    """Give missing heights (NaN) of a map z (m, n) the value of the nearest measured point."""
    from scipy.ndimage import distance_transform_edt

    missing = np.isnan(z)
    if not missing.any():
        return z
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    return z[tuple(nearest)]


def find_scan_spikes(scan: Areal) -> np.ndarray:
    """Return a mask (m, n) of spikes of a scan: small groups of heights far from the median of the 5 x 5 heights around.

    A larger group is a feature of the surface; the threshold is raised until all groups are small.
    """
    from scipy import ndimage

    filled = fill_nearest(scan.z)
    # Side of the square of the median
    distance = np.abs(filled - ndimage.median_filter(filled, 5))
    spikes = np.zeros(filled.shape, bool)
    if not distance.any():
        return spikes
    deviation = robust_deviation(distance[distance > 0])
    # |height - median of 5 x 5| in standard deviations
    for threshold in (10.0, 40.0, 160.0):
        groups, count = ndimage.label(distance > threshold * deviation, np.ones((3, 3)))
        sizes = np.bincount(groups.ravel(), minlength=count + 1)
        # Number of points of a spike; a larger group is a feature of the surface
        spikes |= (sizes <= 12)[groups] & (groups > 0)
    return spikes & ~scan.missing


def level(surface: Profile | Areal) -> Profile | Areal:
    """Subtract the least-squares line (trace) or plane (scan) from the heights of a surface.

    Raises PatchfemError if the measured heights do not determine the plane, such as all of them in one line.
    """
    known = ~surface.missing
    axes = (surface.x,) if surface.z.ndim == 1 else (surface.x, surface.y[:, None])
    # Positions from -1 to 1 make the rank independent of units.
    unit = [2 * (axis - axis[0]) / np.ptp(axis) - 1 for axis in axes]
    base = np.array([np.broadcast_to(part, known.shape) for part in (1.0, *unit)])
    # The measured points of a scan lie in one line, which determines no plane, if the smallest
    # singular value of their coordinates (1, x, y) is below this fraction of the largest one. Such
    # a value is round-off.
    factors, _, rank, _ = np.linalg.lstsq(base[:, known].T, surface.z[known], rcond=1e-6)
    if rank < len(base):
        needs = ("a line needs two", "a plane needs three that do not lie on one straight line")
        raise PatchfemError(f"{surface.source}: {known.sum()} heights; {needs[known.ndim - 1]}")
    return replace(surface, z=frozen_array(surface.z - np.tensordot(factors, base, 1)))
