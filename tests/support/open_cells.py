"""Cells of half-spaces, as operators of `patchfem.contact.bounded`: open kernels and periodic waves, for closed forms.

Arrays over the cells are (ny, nx); a half-space has the elastic constants of a `LayerStack` without layers or below them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import dctn, idctn, irfft2, next_fast_len, rfft2
from scipy.interpolate import CubicSpline
from scipy.special import j0

from patchfem.contact.waves import compute_wave_compliance
from patchfem.elasticity import LayerStack


@dataclass(frozen=True, eq=False)
class Cells:
    """Equal cells of a rectangle, with what `press_cells` reads.

    - size: lengths along x and y [m].
    - waves (ny, nx): compliance [m/Pa] of cosine waves, which preconditions; that of k = 0 is a guess.
    """

    size: tuple[float, float]
    waves: np.ndarray
    is_rigid = False

    @property
    def shape(self):
        """Number of cells (ny, nx)."""
        return self.waves.shape

    @property
    def cell_area(self):
        """Area of a cell [m2]."""
        return self.size[0] * self.size[1] / self.waves.size

    @property
    def x(self):
        """Centres of the columns [m]."""
        return ((np.arange(self.shape[1]) + 0.5) / self.shape[1] - 0.5) * self.size[0]

    @property
    def y(self):
        """Centres of the rows [m]."""
        return ((np.arange(self.shape[0]) + 0.5) / self.shape[0] - 0.5) * self.size[1]

    def precondition(self, displacement):
        """Return the traction of guided waves [Pa]."""
        return idctn(dctn(displacement, norm="ortho") / self.waves, norm="ortho")


@dataclass(frozen=True, eq=False)
class OpenCells(Cells):
    """Cells of half-spaces under uniform tractions; `kernel` (2 ny, 2 nx) is wrapped [m/Pa]."""

    kernel: np.ndarray

    def __post_init__(self):
        padded = tuple(next_fast_len(2 * n, real=True) for n in self.shape)
        places = [np.fft.fftfreq(n, 1 / n).astype(int) for n in padded]
        places = [np.clip(p, 1 - n, n - 1) for p, n in zip(places, self.shape)]
        object.__setattr__(self, "_padded", padded)
        object.__setattr__(self, "_transform", rfft2(self.kernel[np.ix_(*places)]))

    @property
    def self_compliance(self):
        """Displacement of a cell per traction on it [m/Pa]."""
        return float(self.kernel[0, 0])

    def product(self, traction):
        """Return the displacement [m]."""
        displacement = irfft2(self._transform * rfft2(traction, self._padded), self._padded)
        return displacement[: self.shape[0], : self.shape[1]]


@dataclass(frozen=True, eq=False)
class PeriodicCells(Cells):
    """Cells of periodic half-spaces, whose mean displacement is left out; `periodic` (ny, nx/2 + 1) are its waves."""

    periodic: np.ndarray

    @property
    def self_compliance(self):
        """Displacement of a cell per traction on it [m/Pa]."""
        unit = np.zeros(self.shape)
        unit[0, 0] = 1.0
        return float(self.product(unit)[0, 0])

    def product(self, traction):
        """Return the displacement [m]."""
        return irfft2(self.periodic * rfft2(traction), self.shape)

    def precondition(self, displacement):
        """Return the traction [Pa]."""
        stiffness = 1 / np.where(self.periodic > 0, self.periodic, np.inf)
        return irfft2(stiffness * rfft2(displacement), self.shape)


def _combine(waves, k_x, k, direction):
    """Return the compliance of waves for normal or shear tractions."""
    if direction == "normal":
        return waves.normal
    fraction = np.divide(k_x**2, k**2, out=np.ones(k.shape), where=k > 0)
    return fraction * waves.along + (1 - fraction) * waves.across


def make_open_cells(shape, size, stack: LayerStack, direction="normal") -> OpenCells:
    """Return two equal half-spaces, homogeneous or with one layer (normal tractions only)."""
    cell = (size[0] / shape[1], size[1] / shape[0])
    k_x = np.arange(shape[1]) * np.pi / size[0]
    k = np.hypot(k_x, np.arange(shape[0])[:, None] * np.pi / size[1])
    k[0, 0] = k[0, 1] / 2
    waves = 2 * _combine(compute_wave_compliance(k, stack), k_x, k, direction)

    x = np.fft.fftfreq(2 * shape[1], 1 / (2 * shape[1]))[None] * cell[0]
    y = np.fft.fftfreq(2 * shape[0], 1 / (2 * shape[0]))[:, None] * cell[1]
    top = (*stack.moduli, stack.base)[0]
    kernel = 2 * _integrate_half_space(x, y, cell, top, direction)
    if stack.thicknesses:
        kernel += 2 * cell[0] * cell[1] * _coating_kernel(np.hypot(x, y), stack)
    return OpenCells(size, waves, kernel)


def make_periodic_cells(shape, size, stack: LayerStack) -> PeriodicCells:
    """Return two equal periodic half-spaces."""
    k_x = 2 * np.pi * np.fft.rfftfreq(shape[1], size[0] / shape[1])
    k_y = 2 * np.pi * np.fft.fftfreq(shape[0], size[1] / shape[0])[:, None]
    k = np.hypot(k_x, k_y)
    k[0, 0] = 1.0
    waves = 2 * compute_wave_compliance(k, stack).normal
    waves[0, 0] = 0.0
    return PeriodicCells(size, np.ones(shape), waves)


def _integrate_half_space(x, y, cell, moduli, direction):
    """Return the displacement at (x, y) per uniform traction on the cell at 0 (Love 1929; Johnson 1985)."""
    lam, mu = moduli
    nu = lam / (2 * (lam + mu))
    total = 0.0
    for side_x in (-1, 1):
        for side_y in (-1, 1):
            a = x + side_x * cell[0] / 2
            b = y + side_y * cell[1] / 2
            along = b * np.arcsinh(a / np.abs(b))
            across = a * np.arcsinh(b / np.abs(a))
            factors = (1 - nu, 1 - nu) if direction == "normal" else (1.0, 1 - nu)
            total = total + side_x * side_y * (factors[0] * along + factors[1] * across)
    return total / (2 * np.pi * mu)


def _coating_kernel(r, stack: LayerStack):
    """Return the change [m/N] of the point kernel by a coating at distances r: a Hankel integral without its 1/k part."""
    (depth,), (top,), base = stack

    def soften(moduli):
        return (moduli[0] + 2 * moduli[1]) / (2 * moduli[1] * (moduli[0] + moduli[1]))

    nodes, weights = np.polynomial.legendre.leggauss(16)
    largest = 45.0 / depth
    edges = np.concatenate(
        [[0.0], np.geomspace(1e-6, 1e-2, 9) * largest, np.linspace(0.02, 1, 120) * largest]
    )
    half = np.diff(edges)[:, None] / 2
    k = (edges[:-1, None] + half * (1 + nodes)).ravel()
    far = soften(base) - soften(top)
    waves = compute_wave_compliance(k, stack).normal
    change = (waves - soften(top) / k - far / k * np.exp(-k * depth)) * k * (half * weights).ravel()
    grid = np.concatenate([[0.0], np.geomspace(depth * 1e-2, r.max() * 1.001, 400)])
    smooth = CubicSpline(np.sqrt(grid), j0(np.outer(grid, k)) @ change)(np.sqrt(r))
    return (smooth + far / np.hypot(r, depth)) / (2 * np.pi)
