"""Pieces of unlike lengths and with shaped ends: corners, rounded punches, force balance and
exchanged pieces."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import grow_depth
from scene_texts import COATED
from wedges import singularity_exponent

from patchfem import build
from patchfem.closed_forms import rounded_punch_half_width
from patchfem.closed_forms.contact import rounded_punch_pressure
from patchfem.core import PatchfemError, frozen_array
from patchfem.elasticity import compute_coating_traction, compute_displacement, get_cells
from patchfem.mesh import TensorGrid, write_mesh
from patchfem.mesh.grid import graded_rows
from patchfem.model import extend_grid, find_file_faults, find_rounded_edges, make_piece_meshes
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.result import patch_warnings
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
OUTLINE = '[contact.{}]\nlength = "8 mm"\nchamfer = "0.3 mm"\n[contact.{}]\nend_radius = "1 mm"\n'


def build_patch_model(text: str):
    """Return the PatchModel of a scene."""
    return build(loads(text, "scene.toml")).patch


def solve_on_uniform_mesh(text: str):
    """Return the solved patch of a scene on its uniform interface mesh."""
    model = build_patch_model(text)
    return solve_patch_contact(model, condense(model, *make_piece_meshes(model)))


def graded_columns(place: float, half: float, smallest: float, growth: float = 1.2) -> np.ndarray:
    """Return symmetric columns over |x| <= half that grow from cells of `smallest` at |x| = place."""
    right = [place - np.append(0.0, np.cumsum(graded_rows(smallest, place, growth)))[::-1]]
    if half > place:
        right.append(place + np.cumsum(graded_rows(smallest, half - place, growth)))
    x = np.concatenate(right)
    x[0] = 0.0
    x[-1] = half
    return frozen_array(np.concatenate([-x[:0:-1], x]))


def solve_on_columns(patch, x, growth: float = 1.2, halvings: int = 0):
    """Return the patch solved on columns x of its interface, with rows graded alike and every
    element halved `halvings` times."""
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
    for _ in range(halvings):
        bodies = [body.refine() for body in bodies]
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


def test_order_of_rounded_punch_error_is_one():
    """The pressure of a stiff punch with rounded ends on a long block converges to the closed form
    with first order."""
    flat = 1e-3
    radius = 1e-3
    load = 2e6
    young = 120e9
    poisson = 0.3
    text = BLOCK.replace("24 mm", "80 mm").replace("8 mm", "40 mm").replace("100 kN", "2000 kN")
    model = build_patch_model(
        text + '[contact.upper]\nlength = "4 mm"\nheight = "2 mm"\nend_radius = "1 mm"\n'
        'substrate = {young = "1.2e6 GPa", poisson = 0.3, density = "1 kg/m^3"}\n'
    )
    modulus = young / (1 - poisson**2) / (1 + 1e-4)
    half = rounded_punch_half_width(load, flat, radius, modulus)
    errors = []
    for halvings in (0, 1):
        patch = solve_on_columns(
            model, graded_columns(half, model.pieces.length / 2, 2e-6), halvings=halvings
        )
        expected = rounded_punch_pressure(patch.x, load, flat, radius, modulus)
        difference = patch.pressure.sigma_n - expected
        weight = patch.pieces.interface.weight
        errors.append(np.sqrt((weight * difference**2).sum() / (weight * expected**2).sum()))
    # The nodes at the contact ends limit the convergence to first order.
    assert errors[1] < 4e-3 and errors[0] / errors[1] > 1.8
    assert patch.pressure.sigma_n.max() == pytest.approx(expected.max(), rel=4e-3)
    assert compute_static_values(patch)["contact_half_width"] == pytest.approx(half, rel=1e-3)
    assert "steep" not in " ".join(patch_warnings(model, patch))


def test_exact_narrow_piece_above_or_below_gives_same_pressure():
    """Exchanging the upper and the lower piece does not change the pressure and the values of the patch."""
    a, b = (
        solve_on_uniform_mesh(COATED + OUTLINE.format(*sides) + TILT.format(""))
        for sides in (("lower", "upper"), ("upper", "lower"))
    )
    assert np.abs(a.pressure.sigma_n - b.pressure.sigma_n).max() <= 1e-9 * a.pressure.sigma_n.max()
    assert compute_static_values(b) == pytest.approx(compute_static_values(a), rel=1e-8)


def test_exact_load_is_transferred_at_interface_and_bond_lines():
    """The pressure on the interface and the tractions on the bond line of each coating add up to
    the normal load."""
    model = build_patch_model(COATED + OUTLINE.format("upper", "lower") + TILT.format(""))
    patch = solve_patch_contact(model, condense(model, *make_piece_meshes(model)))
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    assert force.sum() == pytest.approx(model.loading.load, rel=1e-10)
    assert patch.pieces.interface.weight.sum() == pytest.approx(
        model.pieces.length * model.pieces.width, rel=1e-12
    )
    line = force / model.pieces.width
    for piece, nodal in zip((patch.pair.piece, patch.pair.upper), patch.pair.forces(line)):
        u = compute_displacement(piece, 0 * nodal, nodal)
        assert compute_coating_traction(get_cells(piece), u).force[0].sum(axis=0) == pytest.approx(
            [0.0, line.sum()], rel=1e-7, abs=1e-7 * line.sum()
        )


def test_exact_written_mesh_of_shaped_pieces_gives_same_patch(tmp_path):
    """The mesh of two shaped pieces, written to a file and read back, gives the same patch."""
    text = COATED + TILT.format("")
    model = build_patch_model(
        text.replace("[contact.tilt]", OUTLINE.format("upper", "lower") + "[contact.tilt]")
    )
    bodies = make_piece_meshes(model)
    write_mesh(bodies[0], tmp_path / "pair.vtu", bodies[1])
    read_model = build(
        loads(
            text.replace('length = "12.7 mm"', f'length = "{model.pieces.length!r} m"').replace(
                'element_size = "0.5 mm"', 'mesh = "pair.vtu"'
            ),
            tmp_path / "scene.toml",
        )
    ).patch
    a = compute_static_values(solve_patch_contact(model, condense(model, *bodies)))
    b = compute_static_values(
        solve_patch_contact(read_model, condense(read_model, *make_piece_meshes(read_model)))
    )
    assert b == pytest.approx(a, rel=1e-8)


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "tables", [NARROW.format("upper"), UPPER + 'length = "8 mm"\nend_radius = "2 mm"\n']
)
def test_always_errors_of_bounded_measures_cover_finer_mesh(tables):
    """On automatic meshes with sharp or rounded ends, the errors of bounded measures cover a
    smaller tolerance and stay below 5 %."""
    model = build_patch_model(BLOCK + tables)
    coarse, fine = (solve_with_coarser(model, tolerance)[0].measures for tolerance in (2e-2, 4e-3))
    for name in ("approach", "normal_stiffness", "tangential_stiffness", "contact_fraction"):
        assert (
            abs(coarse[name].value - fine[name].value) <= coarse[name].error + fine[name].error
        ), name
        assert coarse[name].error <= 0.05 * abs(coarse[name].value)


@pytest.mark.share(1)
@pytest.mark.parametrize("radius", ["2 um", "0.2 mm", "2 mm"])
@pytest.mark.parametrize("tilt", ["", TILT.format("")])
def test_always_errors_of_unresolved_rounding_cover_fine_mesh(radius, tilt):
    """The errors on meshes whose elements are larger than the rounding of the ends cover the
    results of a mesh that resolves it."""
    tables = UPPER + f'length = "8 mm"\nend_radius = "{radius}"\n' + tilt
    model = build_patch_model(BLOCK + tables)
    (*_, half), edge = find_rounded_edges(model)
    reference = compute_static_values(
        solve_on_columns(model, graded_columns(half, model.pieces.length / 2, edge / 30))
    )
    for cells in (20, 150):
        even = build_patch_model(
            BLOCK + f'element_size = "{model.pieces.length / cells!r} m"\n' + tables
        )
        measures = solve_with_coarser(even, 1e-3)[0].measures
        for name in ("pressure_peak", "contact_fraction", "contact_half_width", "approach"):
            assert abs(measures[name].value - reference[name]) <= measures[name].error, name
        assert measures["pressure_peak"].error < 20 * reference["pressure_peak"]


def test_refuses_profile_shorter_than_interface(tmp_path):
    """A profile may be shorter than the longer piece but not shorter than the interface."""
    x = np.linspace(0, 8.2, 400)
    rows = "\n".join(f"{a:.6f},{0.05 * np.sin(a):.6f}" for a in x)
    (tmp_path / "before.csv").write_text(f"x [mm],z [um]\n{rows}\n")
    profile = '[contact.profile]\nfile = "before.csv"\n'
    scene = loads(BLOCK + NARROW.format("upper") + profile, tmp_path / "scene.toml")
    model = build(scene).patch
    patch = solve_patch_contact(model, condense(model, *make_piece_meshes(model)))
    assert patch.x[-1] == 4e-3 and np.ptp(patch.unloaded_gap) > 0
    assert find_file_faults(scene, tmp_path) == []
    for text in (BLOCK, BLOCK + NARROW.format("upper").replace("8 mm", "8.3 mm")):
        scene = loads(text + profile, tmp_path / "scene.toml")
        model = build(scene).patch
        with pytest.raises(PatchfemError, match="trace"):
            solve_patch_contact(model, condense(model, *make_piece_meshes(model)))
        assert [key for key, _ in find_file_faults(scene, tmp_path)] == ["contact.profile.file"]
