"""An areal scan of heights on a rectangular raster: its rows and columns as traces, and its levelling."""

from dataclasses import dataclass, replace

import numpy as np

from ..core import PatchfemError, frozen_array
from .profile import Profile

RELAXED, DAMPED = 40, 0.6  # rounds of the surface over missing heights, half of them by the Laplacian; under 5/8
CROSS = (0, 1), (0, -1), (1, 0), (-1, 0)
LAPLACE = ((1 / 4, CROSS),)
BILAPLACE = ((8 / 20, CROSS), (-2 / 20, ((1, 1), (1, -1), (-1, 1), (-1, -1))),
             (-1 / 20, ((0, 2), (0, -2), (2, 0), (-2, 0))))

@dataclass(frozen=True, eq=False, slots=True)
class Areal:
    """Heights z (m, n) [m] at x (n,) [m] along a row and y (m,) [m] along a column, NaN where none was measured.

    x and y increase. source: a name of the scan for messages; notes: what was done to it on the way, one sentence each.
    """

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    source: str
    notes: tuple = ()

    @property
    def missing(self) -> np.ndarray:
        """Whether no height was measured, (m, n) bool."""
        return np.isnan(self.z)

    def row(self, k: int) -> Profile:
        """The trace along x at y[k]; negative k count from the end."""
        return self._trace(self.x, self.z[self._within(k, 0)], f"row {k}")

    def column(self, k: int) -> Profile:
        """The trace along y at x[k]; negative k count from the end."""
        return self._trace(self.y, self.z[:, self._within(k, 1)], f"column {k}")

    def _within(self, k: int, axis: int) -> int:
        count = self.z.shape[axis]
        if not -count <= k < count:
            name = ("row", "column")[axis]
            raise PatchfemError(f"{self.source}: no {name} {k}; the scan has {count} of them, counted from 0")
        return k

    def _trace(self, along, heights, name: str) -> Profile:
        return Profile(frozen_array(along), frozen_array(heights), f"{self.source}, {name}", self.notes)


def filled(z, missing) -> np.ndarray:
    """Heights (m, n) with a smooth surface over what is missing: from the nearest ones on, relaxed towards a zero
    bi-Laplacian, which a single hole reaches to the fourth order of the step."""
    from scipy.ndimage import distance_transform_edt

    if not missing.any():
        return z
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    room = np.pad(z[tuple(nearest)], 2, "reflect", reflect_type="odd")
    rows, columns = (one + 2 for one in np.nonzero(missing))
    for turn in range(RELAXED):
        lap = 0.0
        for weight, moves in (LAPLACE if turn < RELAXED // 2 else BILAPLACE):
            for down, right in moves:
                lap = lap + weight * room[rows + down, columns + right]
        room[rows, columns] += DAMPED * (lap - room[rows, columns])
    return room[2:-2, 2:-2]


def level_plane(scan: Areal) -> Areal:
    """Level a scan: subtract the least-squares plane of its measured heights, which all count alike (`level`)."""
    return level(scan, 1)


def level(scan: Areal, degree: int) -> Areal:
    """A scan less the least-squares polynomial in x and y of its measured heights, x^i y^j with i + j <= degree.

    PatchfemError where the measured heights do not determine it, such as all of them in one line.
    """
    there, count = ~scan.missing, int((~scan.missing).sum())
    across, along = (np.polynomial.legendre.legvander(_reduced(axis), degree) for axis in (scan.x, scan.y))
    terms = np.add.outer(np.arange(degree + 1), np.arange(degree + 1)) <= degree  # of y, of x
    pairs = there.astype(float) @ (across[:, :, None] * across[:, None, :]).reshape(scan.x.size, -1)
    normal = np.einsum("mik,mj,ml->jilk", pairs.reshape(-1, degree + 1, degree + 1), along, along, optimize=True)
    normal = normal[terms][:, terms]
    if count < len(normal) or np.linalg.matrix_rank(normal / count, tol=1e-12, hermitian=True) < len(normal):
        raise PatchfemError(f"{scan.source}: {count} heights, which all lie on one straight line; a plane needs three "
                            "points that do not"
                            if degree == 1 else f"{scan.source}: {count} heights do not determine a polynomial of "
                            f"degree {degree}; use a lower degree")
    mean = scan.z[there].mean()
    found = np.zeros(terms.shape)
    found[terms] = np.linalg.solve(normal, (along.T @ np.where(there, scan.z - mean, 0.0) @ across)[terms])
    return replace(scan, z=frozen_array(scan.z - (mean + along @ found @ across.T)))


def _reduced(axis) -> np.ndarray:
    """An axis from -1 to 1."""
    half = (axis[-1] - axis[0]) / 2
    return (axis - (axis[0] + axis[-1]) / 2) / (half if half > 0 else 1.0)
