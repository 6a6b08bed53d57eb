"""Areal scan of heights on a rectangular raster: its rows and columns, and its levelling."""

from dataclasses import dataclass, replace

import numpy as np

from ..core import PatchfemError, frozen_array
from .profile import Profile

# Number of relaxation sweeps with each operator; the heights of
# single holes have converged by then.
N_SWEEPS = 20
# Fraction of each correction that is applied; relaxation of the bi-Laplacian diverges from 5/8 on.
DAMPING = 0.6
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


def fill_missing(z, missing) -> np.ndarray:
    """Fill missing heights (m, n) of a scan with a smooth surface.

    The height of the nearest measured point is relaxed by the Laplace equation first and then by the
    biharmonic equation, which reproduces a single missing height to the fourth order of the step.
    """
    from scipy.ndimage import convolve, distance_transform_edt

    if not missing.any():
        return z
    nearest = distance_transform_edt(missing, return_distances=False, return_indices=True)
    padded = np.pad(z[tuple(nearest)], 2, "reflect", reflect_type="odd")
    heights = padded.ravel()
    rows, columns = np.nonzero(missing)
    holes = (rows + 2) * padded.shape[1] + columns + 2
    laplacian = np.pad([[0, -1, 0], [-1, 4, -1], [0, -1, 0]], 1)
    for stencil in (laplacian, convolve(laplacian, laplacian, mode="constant")):
        down, right = np.nonzero(stencil)
        offsets = (down - 2) * padded.shape[1] + right - 2
        terms = list(zip(offsets, stencil[down, right] * (DAMPING / stencil[2, 2])))
        for _ in range(N_SWEEPS):
            heights[holes] -= sum(weight * heights[holes + offset] for offset, weight in terms)
    return padded[2:-2, 2:-2]


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
