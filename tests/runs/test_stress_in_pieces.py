"""Stress inside the pieces: Hertz's line contact, a uniform load, and equilibrium under friction."""

from math import pi

import numpy as np
import pytest

import patchfem as pf
from patchfem.runs import compute_pieces
from patchfem.scene import MATERIALS

STEEL = MATERIALS["steel"]
RADIUS = 14.5e-3  # [m]
WIDTH = 10e-3  # [m]
HERTZ = """\
[contact]
length = "6 mm"
width = "10 mm"
height = "6 mm"
load = "{load!r} N"
element_size = "10 um"
substrate = "steel"
[contact.crown]
radius = "14.5 mm"
[accuracy]
tolerance = 1e-1
"""
UNIFORM = """\
[contact]
length = "10 mm"
width = "10 mm"
height = "2 mm"
load = "5 kN"
element_size = "100 um"
substrate = {young = "200 GPa", poisson = 0.0, density = "7850 kg/m^3"}
"""
SLIDING = """\
[contact.shear]
[friction]
law = "coulomb"
static = 0.3
kinetic = 0.3
[slide]
kind = "sine"
amplitude = "20 um"
frequency = "10 Hz"
"""


def test_exact_hertz_shear_stress_below_contact():
    """The largest shear stress of Hertz's line contact is 0.30 of the peak pressure at 0.786 half-widths.

    On the axis sigma_x = -p (1 + 2 s^2) / r + 2 p s and sigma_y = -p / r with r^2 = 1 + s^2, where s
    is the depth over the half-width (Johnson, Contact Mechanics, eq. 4.46).
    """
    peak = 500e6
    modulus = STEEL.young / (2 * (1 - STEEL.poisson**2))
    half_width = 2 * RADIUS * peak / modulus
    load = peak * pi * half_width / 2 * WIDTH
    pieces = compute_pieces(pf.run(pf.load(HERTZ.format(load=load))))
    for side, sign in (("lower", -1), ("upper", 1)):
        piece = getattr(pieces, side)
        centres = piece.points[np.concatenate(piece.blocks)].mean(axis=1)
        columns = np.unique(np.abs(centres[:, 0]))
        on_axis = np.abs(centres[:, 0]) < 1.5 * columns[0]  # the two columns beside the axis
        depth = sign * centres[on_axis, 1] / half_width
        xx, yy, zz, _ = piece.stress[-1, on_axis].T / peak
        root = np.hypot(1, depth)
        is_near = depth < 3
        np.testing.assert_allclose(yy[is_near], (-1 / root)[is_near], 0, 0.02)
        expected = 2 * depth - (1 + 2 * depth**2) / root
        np.testing.assert_allclose(xx[is_near], expected[is_near], 0, 0.02)
        # plane strain
        np.testing.assert_allclose(zz, STEEL.poisson * (xx + yy), 1e-9, 1e-12)

        shear = np.abs(xx - yy) / 2
        around = np.abs(depth - 0.786) < 0.3
        curve = np.polynomial.Polynomial.fit(depth[around], shear[around], 4)
        places = np.linspace(0.5, 1.05, 500)
        highest = np.argmax(curve(places))
        assert places[highest] == pytest.approx(0.786, abs=0.02)
        # 2 % come from the free sides, which are 48 half-widths away, and 1 % from the mesh
        assert curve(places[highest]) == pytest.approx(0.300, rel=0.035)


def test_exact_uniform_load_has_uniform_stress():
    """Without lateral contraction, flat pieces under a load have the same stress everywhere: load over area."""
    result = pf.run(pf.load(UNIFORM))
    pieces = compute_pieces(result)
    pressure = 5e3 / (10e-3 * 10e-3)
    for piece in (pieces.lower, pieces.upper):
        xx, yy, zz, xy = piece.stress[-1].T
        np.testing.assert_allclose(yy, -pressure, 1e-9)
        assert max(np.abs(part).max() for part in (xx, zz, xy)) < 1e-8 * pressure
        np.testing.assert_allclose(piece.von_mises[-1], pressure, 1e-9)
        assert piece.stress_error.max() < 1e-6
    # each piece shortens by pressure * height / young; the approach is that of both
    shortening = pressure * 2e-3 / 200e9
    far = pieces.upper.points[:, 1] == pieces.upper.points[:, 1].max()
    np.testing.assert_allclose(pieces.upper.displacement[-1, far, 1], -2 * shortening, 1e-9)
    face = pieces.lower.points[:, 1] == 0
    np.testing.assert_allclose(pieces.lower.displacement[-1, face, 1], -shortening, 1e-9)


def test_exact_stress_carries_load_and_friction():
    """Across a row of cells the stress of both pieces carries the load and the friction force of each frame within 2 %."""
    result = pf.run(pf.load(UNIFORM.replace("poisson = 0.0", "poisson = 0.3") + SLIDING))
    pieces = compute_pieces(result)
    assert np.array_equal(pieces.time, result.fields["time"])
    friction = pieces.interface["shear_stress"] @ pieces.weight
    assert friction.max() > 1e3 and friction.min() < -1e3
    for side in ("lower", "upper"):
        piece = getattr(pieces, side)
        cells = piece.points[np.concatenate(piece.blocks)]
        depth = np.abs(cells[..., 1].mean(axis=1))
        row = np.isclose(depth, np.unique(depth.round(12))[len(np.unique(depth.round(12))) // 2])
        length = np.ptp(cells[row][..., 0], axis=1)
        _, yy, _, xy = np.moveaxis(piece.stress[:, row], 2, 0)
        np.testing.assert_allclose(yy @ length * WIDTH, -5e3, 0.02)
        # the lower piece is pulled along +x at its face, where its normal is +y
        np.testing.assert_allclose(xy @ length * WIDTH, friction, 0, 0.02 * friction.max())
