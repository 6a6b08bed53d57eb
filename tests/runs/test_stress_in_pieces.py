"""Stress inside the pieces under a uniform load."""

import numpy as np
import pytest

import patchfem as pf
from patchfem.runs import compute_pieces
from patchfem.runs.patch.condensed import condense

UNIFORM = """\
[contact]
length = "10 mm"
width = "10 mm"
height = "2 mm"
load = "5 kN"
element_size = "100 um"
substrate = {young = "200 GPa", poisson = 0.0, density = "7850 kg/m^3"}
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


def test_stress_on_a_coarser_mesh():
    """On a mesh with half the columns the resultants of the forces stay, and the peak stress changes by its error."""
    tilted = (
        UNIFORM.replace('element_size = "100 um"\n', "") + '[contact.tilt]\nangle = "0.2 mrad"\n'
    )
    result = pf.run(pf.load(tilted))
    patch = result.patch
    fine = compute_pieces(result)
    coarse = compute_pieces(result, condense(patch.model, patch.pair.grid.coarsen()))
    assert len(coarse.lower.points) < 0.3 * len(fine.lower.points)
    assert coarse.upper.von_mises.max() == pytest.approx(fine.upper.von_mises.max(), rel=0.02)
    motion = fine.interface["displacement"]
    atol = 5e-3 * np.abs(motion).max()
    np.testing.assert_allclose(coarse.interface["displacement"], motion, atol=atol)


def test_exact_stress_of_equal_frames_is_that_of_each():
    """Under full slip, where many frames have the same tractions, the fields of a frame are those of it alone."""
    slip = '[friction]\nlaw = "coulomb"\nstatic = 0.3\n[slide]\nkind = "sine"\namplitude = "9 um"\nfrequency = "9 Hz"\n'
    result = pf.run(pf.load(UNIFORM + slip))
    pieces = compute_pieces(result)
    n_frames = len(result.fields["time"])
    assert len(np.unique(pieces.upper.stress, axis=0)) < n_frames
    for frame in (0, n_frames // 3, n_frames - 1):
        fields = {name: values[frame : frame + 1] for name, values in result.fields.items()}
        alone = compute_pieces(result.with_changes(fields=fields))
        for name in ("displacement", "stress", "von_mises", "stress_error"):
            values = getattr(pieces.upper, name)
            atol = 1e-9 * np.abs(values).max()
            np.testing.assert_allclose(getattr(alone.upper, name)[0], values[frame], 1e-9, atol)
        for name, values in pieces.interface.items():
            np.testing.assert_allclose(alone.interface[name][0], values[frame], 1e-9, 1e-12)
