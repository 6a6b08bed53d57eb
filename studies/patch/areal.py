"""Can sections, one plane problem per wave number across the width, carry an areal contact?

Yes: the peak and the half-axes of Hertz circles and ellipses hold 1e-3 from 12 cells per shorter half-axis on, every
pressure of the inner half about so from 16 on, in 1 to 2 s on one core. Both pieces are alike blocks, 12 longer
half-axes long, wide and tall from the middle. Between planes of symmetry a pressure cos(ky) across the width moves a
section by (u, w) cos(ky) and v sin(ky), bilinear over x and z. All sections together are one dense compliance of the
points that may touch, and the solver of the plane patch finds the forces. Its entries depend on k so smoothly that 24
sections carry all 96 to 576. Relative errors of the peak and the half-axes (a fit to p^2 over the inner half), largest
error of a nodal pressure there over the peak, and seconds for sections | contact:

    cells     peak        a         b     pressure       s
    circle
      8     1.2e-3    6.3e-5    7.1e-4    3.3e-3    0.2 | 0.001
     12     7.2e-4   -2.4e-5   -3.6e-4    1.2e-3    0.5 | 0.002
     16     4.8e-4    1.2e-5    2.0e-5    9.7e-4    1.0 | 0.008
     24     3.1e-4   -1.7e-4   -9.6e-5    3.6e-4    3.0 | 0.01
    ellipse, 2 to 1
      8     1.3e-3    3.0e-4    1.0e-3    3.9e-3    0.2 | 0.002
     12     7.1e-4   -8.6e-5    4.0e-5    1.5e-3    0.9 | 0.004
     16     4.0e-4   -1.1e-4    1.1e-4    1.0e-3    1.9 | 0.02
     24     2.4e-4   -1.1e-4   -8.6e-5    3.6e-4    7.0 | 0.07

Some 1e-4 of it are the far faces and the neighbours behind the planes of symmetry, which Hertz does not have. Left out:
coatings, a free side of the width, and more points than a dense matrix holds (1e4 take 0.8 GB).

Run: python studies/patch/areal.py [8 12 16 24]
"""

import sys
from time import perf_counter
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BarycentricInterpolator
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ellipe, ellipk

from patchfem.contact.unilateral import solve_forces

YOUNG, POISSON = 121e9, 0.32
LAME = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON), YOUNG / 2 / (1 + POISSON)
MODULUS = YOUNG / 2 / (1 - POISSON**2)  # E* of two alike pieces
LONG, PEAK = 1e-3, 5e8  # a longer half-axis [m] and the pressure [Pa] in its middle
FAR = 12.0  # half the length and width of the pieces, and their height, over LONG
SECTIONS = 24  # solved, at Chebyshev places of arsinh(n); the others follow to 3e-6
NEAR = 1.2  # candidates for contact, over the half-axes


class Ellipse(NamedTuple):
    """Hertz contact (Johnson 1985, ch. 4.2): half-axes a along x >= b along y [m], peak pressure [Pa]."""

    a: float
    b: float
    peak: float

    def pressure(self, x, y):
        """Pressure [Pa] at places x, y [m]."""
        return self.peak * np.sqrt(np.maximum(0.0, 1 - (x / self.a) ** 2 - (y / self.b) ** 2))

    @property
    def load(self) -> float:
        """Load [N] of the whole ellipse."""
        return 2 / 3 * np.pi * self.a * self.b * self.peak

    @property
    def curvatures(self) -> tuple:
        """(A, B) [1/m] of the gap A x^2 + B y^2 that leads to it."""
        share = 1 - (self.b / self.a) ** 2
        if share < 1e-12:
            return (np.pi * self.peak / (4 * MODULUS * self.a),) * 2
        k, e, front = (
            ellipk(share),
            ellipe(share),
            self.peak * self.b / MODULUS / (share * self.a**2),
        )
        return front * (k - e), front * ((self.a / self.b) ** 2 * e - k)


def graded(cell: float, even: float, far: float, growth: float) -> np.ndarray:
    """Places from 0 to `far` [m]: even cells to `even` [m], then each longer by `growth`."""
    steps = [cell] * round(even / cell)
    while sum(steps) < far:
        steps.append(min(steps[-1] * growth, far / 10))
    return np.concatenate([[0.0], np.cumsum(steps)]) * (far / sum(steps))


def line(x) -> tuple:
    """Mass, stiffness and D_ij = int N_i' N_j of linear elements on x (n,), as dense matrices."""
    h = np.diff(x)
    mass, stiff, mixed = (np.zeros((x.size, x.size)) for _ in range(3))
    for k, size in enumerate(h):
        at = np.ix_([k, k + 1], [k, k + 1])
        mass[at] += size / 6 * np.array([[2, 1], [1, 2]])
        stiff[at] += np.array([[1, -1], [-1, 1]]) / size
        mixed[at] += np.array([[-1, -1], [1, 1]]) / 2
    return mass, stiff, mixed


def blocks(x, z, k: float) -> tuple:
    """Stiffness of a section for displacements (u, w) cos ky and v sin ky: blocks between rows of z, each over x.

    Diagonal and upper blocks (rows, 3 nx, 3 nx) [Pa] without those of u at the guided sides.
    """
    lame, shear = LAME
    (m, s, d), (mz, sz, dz) = line(x), line(z)

    def block(i: int, j: int) -> np.ndarray:
        mm, ss, dd, td = mz[i, j], sz[i, j], dz[i, j], dz[j, i]
        uu = (lame + 2 * shear) * s * mm + shear * m * (ss + k**2 * mm)
        ww = (lame + 2 * shear) * m * ss + shear * (s + k**2 * m) * mm
        vv = shear * (s * mm + m * ss) + (lame + 2 * shear) * k**2 * m * mm
        uw, wu = lame * d * td + shear * d.T * dd, lame * d.T * dd + shear * d * td
        uv, vu = k * (lame * d - shear * d.T) * mm, k * (lame * d.T - shear * d) * mm
        wv, vw = k * m * (lame * dd - shear * td), k * m * (lame * td - shear * dd)
        return np.block([[uu, uw, uv], [wu, ww, wv], [vu, vw, vv]])

    free = np.ones(3 * x.size, bool)
    free[[0, x.size - 1]] = False
    cut, rows = np.ix_(free, free), range(z.size - 1)
    return [block(i, i)[cut] for i in rows], [block(i, i + 1)[cut] for i in rows[:-1]]


def section(x, z, k: float, near: int) -> np.ndarray:
    """Compliance (near, near) [m2/N] of one piece over its first interface nodes for normal forces p cos ky; the last
    row of z is held, what lies between is eliminated row by row from there."""
    own, across = blocks(x, z, k)
    whole = own[-1]
    for here, up in zip(own[-2::-1], across[::-1], strict=True):
        whole = here - up @ cho_solve(cho_factor(whole, lower=True), up.T)
    push = np.zeros((len(whole), near))
    push[x.size - 2 + np.arange(near), np.arange(near)] = 1.0
    return cho_solve(cho_factor(whole, lower=True), push)[x.size - 2 : x.size - 2 + near]


def sections(x, z, far: float, count: int, near: int) -> np.ndarray:
    """Compliances (count, near, near) of the wave numbers pi n/far, interpolated from SECTIONS of them."""
    size = np.arcsinh(np.arange(count))
    if count <= SECTIONS:
        return np.array([section(x, z, np.pi * n / far, near) for n in range(count)])
    nodes = size[-1] / 2 * (1 - np.cos(np.pi * np.arange(SECTIONS) / (SECTIONS - 1)))
    made = np.array([section(x, z, np.pi / far * np.sinh(node), near) for node in nodes])
    return BarycentricInterpolator(nodes, made)(size)


class Quarter(NamedTuple):
    """A quarter of the interface: places x (m,), y (n,) [m] of the candidates, areas (m,) [m2] of a node at each x,
    compliance (m n, m n) [m/N] of both pieces."""

    x: np.ndarray
    y: np.ndarray
    area: np.ndarray
    compliance: np.ndarray


def quarter(cells: int, shape: Ellipse) -> Quarter:
    """The operator on cells of 1/cells of the shorter half-axis, as many cosines across the width as rows of points."""
    cell, far = shape.b / cells, FAR * LONG
    x = graded(cell, NEAR * shape.a, far, 1.25 ** (8 / cells))
    z = graded(cell, 0.6 * shape.b, far, 1.2 ** (8 / cells))
    count, near, rows = (
        round(far / cell),
        round(NEAR * shape.a / cell) + 1,
        round(NEAR * shape.b / cell),
    )
    step = far / count
    y = (np.arange(count) + 0.5) * step
    waves = np.cos(np.pi / far * np.outer(np.arange(count), y[:rows]))
    # of a force at one point in each cosine
    share = np.where(np.arange(count), 2.0, 1.0) / (count * step)
    pairs = (waves[:, :, None] * waves[:, None, :] * 2 * share[:, None, None]).reshape(count, -1)
    found = sections(x, z, far, count, near).reshape(count, -1).T @ pairs
    found = found.reshape(near, near, rows, rows).swapaxes(1, 2).reshape(near * rows, -1)
    width = np.full(near, x[1] - x[0])
    width[0] /= 2
    return Quarter(x[:near], y[:rows], width * step, found)


def row(cells: int, shape: Ellipse) -> dict:
    """Relative errors of an ellipse on `cells` cells to its shorter half-axis, with the unknowns and the seconds."""
    begin = perf_counter()
    one = quarter(cells, shape)
    made = perf_counter()
    x, y = (part.ravel() for part in np.meshgrid(one.x, one.y, indexing="ij"))
    a, b = shape.curvatures
    force, _, _ = solve_forces(one.compliance, x, a * x**2 + b * y**2, np.array([shape.load / 4]))
    pressed = perf_counter()
    p = force.reshape(one.x.size, -1) / one.area[:, None]
    p, exact = p.ravel(), shape.pressure(x, y)
    inside = (x / shape.a) ** 2 + (y / shape.b) ** 2 < 0.5
    fit = np.linalg.lstsq(
        np.column_stack([np.ones(inside.sum()), x[inside] ** 2, y[inside] ** 2]), p[inside] ** 2
    )[0]
    return {
        "cells": cells,
        "points": p.size,
        "peak": fit[0] ** 0.5 / shape.peak - 1,
        "a": (-fit[0] / fit[1]) ** 0.5 / shape.a - 1,
        "b": (-fit[0] / fit[2]) ** 0.5 / shape.b - 1,
        "pressure": np.abs(p - exact)[inside].max() / shape.peak,
        "sections": made - begin,
        "contact": pressed - made,
    }


def main(cells=(4, 8)) -> list:
    """Rows for a circle and for an ellipse of 2 to 1."""
    return [
        row(n, shape)
        for shape in (Ellipse(LONG, LONG, PEAK), Ellipse(LONG, LONG / 2, PEAK))
        for n in cells
    ]


if __name__ == "__main__":
    for found in main(tuple(map(int, sys.argv[1:])) or (4, 8)):
        print("  ".join(f"{name} {value:.3g}" for name, value in found.items()))
