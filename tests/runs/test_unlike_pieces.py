"""Pieces of unlike lengths and with shaped ends: corners, and exchanged pieces."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import grow_depth
from scene_texts import COATED
from support.pieces import compute_row_heights
from wedges import singularity_exponent

from patchfem import build, closed_forms
from patchfem.core import frozen_array
from patchfem.mesh import TensorGrid
from patchfem.model import extend_grid, make_piece_meshes
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values
from patchfem.scene import loads

BLOCK = """\
[contact]
length = "24 mm"
width = "1 m"
height = "8 mm"
load = "100 kN"
substrate = {young = "120 GPa", poisson = 0.3, density = "1 kg/m^3"}
"""
NARROW = '[contact.{}]\nlength = "8 mm"\n'
UPPER, LOWER = "[contact.upper]\n", "[contact.lower]\n"
CHAMFER = 'length = "8 mm"\nchamfer = "1 mm"\n'
TILT = '[contact.tilt]\nangle = "{}0.04 mrad"\n'
STEP = '[contact.step]\nheight = "0.1 mm"\nat = "-3 mm"\n'
OUTLINE = '[contact.{}]\nlength = "8 mm"\nchamfer = "0.3 mm"\n[contact.{}]\nend_radius = "1 mm"\n'


def build_patch_model(text: str):
    """Return the PatchModel of a scene."""
    return build(loads(text, "scene.toml")).patch


def graded_columns(place: float, half: float, smallest: float, growth: float = 1.2) -> np.ndarray:
    """Return symmetric columns over |x| <= half that grow from cells of `smallest` at |x| = place."""
    right = [place - np.append(0.0, np.cumsum(compute_row_heights(smallest, place, growth)))[::-1]]
    if half > place:
        right.append(place + np.cumsum(compute_row_heights(smallest, half - place, growth)))
    x = np.concatenate(right)
    x[0] = 0.0
    x[-1] = half
    return frozen_array(np.concatenate([-x[:0:-1], x]))


def solve_on_columns(patch, x, growth: float = 1.2):
    """Return the patch solved on columns x of its interface, with rows graded alike."""
    pieces = (
        (patch.pieces.lower,)
        if patch.pieces.are_alike
        else (patch.pieces.lower, patch.pieces.upper)
    )
    fine = float(np.diff(x).min())
    grids = [
        TensorGrid(x, *grow_depth(piece.height, fine, piece.thickness, growth, 2))
        for piece in pieces
    ]
    bodies = [extend_grid(patch, piece, grid, growth) for piece, grid in zip(pieces, grids)]
    return solve_patch_contact(patch, condense(patch, *bodies))


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "tables, angles, printed",
    [
        (NARROW.format("upper"), (90, 180), 0.2260),
        (UPPER + CHAMFER, (135, 180), None),
        (UPPER + CHAMFER + LOWER + CHAMFER, (135, 135), None),
        (UPPER + CHAMFER + LOWER + 'length = "6 mm"\n', (135, 90), None),
    ],
)
def test_order_of_corner_pressure_agrees_with_wedge_exponent(tables, angles, printed):
    """The pressure grows towards the corner of a narrow piece with the exponent of the two wedges that meet there."""
    model = build_patch_model(BLOCK + tables)
    assert model.has_singular_ends
    expected = singularity_exponent(*angles)
    assert printed is None or expected == pytest.approx(printed, abs=5e-5)
    patch = solve_on_columns(
        model, graded_columns(model.pieces.length / 2, model.pieces.length / 2, 1e-8)
    )
    inward = patch.x[-1] - patch.x
    in_range = (inward > 1e-7) & (inward < 5e-6)
    exponent = -np.polyfit(np.log(inward[in_range]), np.log(patch.pressure.sigma_n[in_range]), 1)[0]
    assert exponent == pytest.approx(expected, abs=3e-3)


def test_exact_narrow_piece_above_or_below_gives_same_pressure():
    """Exchanging the upper and the lower piece does not change the pressure and the values of the patch."""
    patches = []
    for sides in (("lower", "upper"), ("upper", "lower")):
        model = build_patch_model(COATED + OUTLINE.format(*sides) + TILT.format(""))
        patches.append(solve_patch_contact(model, condense(model, *make_piece_meshes(model))))
    a, b = patches
    assert np.abs(a.pressure.sigma_n - b.pressure.sigma_n).max() <= 1e-9 * a.pressure.sigma_n.max()
    assert compute_static_values(b) == pytest.approx(compute_static_values(a), rel=1e-8)


@pytest.mark.parametrize("radius", [1e-4, 4e-4])
def test_exact_contact_beside_a_step_ends_on_the_rounded_end(radius):
    """A flat part between a step and a rounded end is in contact as a whole, as the pressure of a sharp corner is unbounded.

    The contact ends within the length on the rounding of a rounded punch that is as long as the flat part.
    """
    model = build_patch_model(BLOCK + STEP + LOWER + f'end_radius = "{radius} m"\n')
    found = solve_with_coarser(model, 1e-2)[0].measures["contact_fraction"]
    assert found.error <= 1e-4 * found.value
    pieces = model.pieces
    flat = (pieces.flat_half_length - 3e-3) / 2
    half_width = closed_forms.contact.rounded_punch_half_width(
        1e5, flat, radius, pieces.surface_modulus
    )
    beyond = found.value * pieces.length - 2 * flat
    assert -found.error * pieces.length <= beyond <= half_width - flat
