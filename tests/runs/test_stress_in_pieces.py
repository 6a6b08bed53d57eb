"""Stress inside the pieces: a uniform load, and equilibrium under friction."""

import numpy as np

import patchfem as pf
from patchfem.runs import compute_pieces

WIDTH = 10e-3  # [m]
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
