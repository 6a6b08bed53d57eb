"""Fixtures and bodies of a patch through its scene: springs, approach, unlike pieces, a step, any mesh."""

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pair_meshes import pair_mesh
from scene_texts import COATING, PIECE

from patchfem.contact.gaps import step
from patchfem.core import Outcome, PatchfemError
from patchfem.mesh.files import CELL_TAGS, EDGE_TAGS
from patchfem.mesh.tensor import graded_grid
from patchfem.model.model import build
from patchfem.model.pieces import bodies_of
from patchfem.runs.patch import measures as patch_measures
from patchfem.runs.patch.ladder import solve_all
from patchfem.runs.patch.values import values
from patchfem.scene import scene

TEXT = PIECE + """\
element_size = "0.2 mm"
substrate = "Ti-8Al-1Mo-1V"
{}
""" + COATING + "{}\n"
LOAD = 'load = "26 lbf"'
TOLERANCE = 1e-3


def solved(keys=LOAD, tables=""):
    found = build(scene.loads(TEXT.format(keys, tables))).patch
    patch = solve_all(found, TOLERANCE, False)[0]
    return patch, values(patch)


def test_exact_a_soft_holder_is_a_free_piece_and_a_stiff_one_a_clamp():
    line, tilt = '[contact.load_line]\noffset = "0.5 mm"\n', '[contact.tilt]\nangle = "0.1 mrad"\n'
    spring = '[contact.holder]\nrotational_stiffness = "{} N m/rad"\n'
    free, clamped = solved(tables=line)[1], solved(tables=tilt)[1]
    soft, stiff = solved(tables=line + spring.format("1e-6"))[1], solved(tables=tilt + spring.format("1e13"))[1]
    for name in ("contact_fraction", "rotation", "moment", "approach", "pressure_peak"):
        assert soft[name] == pytest.approx(free[name], rel=1e-8)
        assert stiff[name] == pytest.approx(clamped[name], rel=1e-6)


@given(st.floats(0, 8), st.floats(-2e-4, 2e-4), st.floats(-5e-3, 5e-3))
def test_always_the_holder_carries_what_the_pressure_does_not(power, angle, offset):
    """Moment about the middle: sum f x = N offset + K (rotation - angle)."""
    stiffness = 10.0**power
    patch, found = solved(tables=f'[contact.tilt]\nangle = "{angle} rad"\n[contact.load_line]\noffset = "{offset} m"\n'
                                 f'[contact.holder]\nrotational_stiffness = "{stiffness} N m/rad"\n')
    wanted = found["normal_load"] * offset + stiffness * (found["rotation"] - angle)
    assert found["moment"] == pytest.approx(wanted, abs=1e-9 * (found["normal_load"] * 6e-3 + stiffness * 3e-4))
    assert max(patch.pressure.residuals.values()) < 1e-9


def test_always_a_stiffer_holder_keeps_more_of_the_tilt():
    tilt = '[contact.tilt]\nangle = "0.1 mrad"\n[contact.holder]\nrotational_stiffness = "{} N m/rad"\n'
    found = [solved(tables=tilt.format(k))[1] for k in (1, 1e3, 1e4, 1e5, 1e6)]
    assert np.all(np.diff([f["rotation"] for f in found]) > 0)
    assert np.all(np.diff([f["contact_fraction"] for f in found]) <= 0)
    assert found[0]["contact_fraction"] == 1 and found[-1]["contact_fraction"] < 0.25


@pytest.mark.parametrize("shape", ["", '[contact.crown]\nradius = "5 m"\n', '[contact.tilt]\nangle = "4 urad"\n'])
def test_exact_approach_gives_back_the_load_that_made_it(shape):
    by_load = solved(tables=shape)[1]
    by_approach = solved("", shape + f'[contact.approach]\ndistance = "{by_load["approach"]!r} m"\n')[1]
    for name, value in by_load.items():
        assert by_approach[name] == pytest.approx(value, rel=1e-8, abs=1e-12 * abs(by_load["normal_load"]))


def test_exact_no_contact_before_the_first_touch():
    patch, found = solved("", '[contact.crown]\nradius = "5 m"\n[contact.approach]\ndistance = "0 m"\n')
    assert patch.pressure.outcome == "no_contact" and found["normal_load"] == 0


UNLIKE = '[contact.{}]\nheight = "9 mm"\nsubstrate = "steel"\ncoating = "none"\n'


def test_exact_unlike_pieces_add_their_compliances_and_may_be_swapped():
    tilt = '[contact.tilt]\nangle = "0.1 mrad"\n'
    (a, one), (_, two) = solved(tables=tilt + UNLIKE.format("upper")), solved(tables=tilt + UNLIKE.format("lower"))
    for name, value in one.items():
        assert two[name] == pytest.approx(value, rel=1e-9, abs=1e-15)
    assert a.pair.upper_grid.height == 9e-3 and a.pair.grid.height == 6.35e-3 and a.pair.upper_grid.coating_rows == 0
    like = solved(tables=tilt)[0]
    other = solved(tables=tilt + UNLIKE.format("upper") + UNLIKE.format("lower"))[0]
    assert a.pieces.normal == pytest.approx((like.pieces.normal + other.pieces.normal) / 2, rel=1e-9)


def test_exact_naming_what_a_piece_is_anyway_changes_nothing():
    patch, found = solved(tables='[contact.upper]\nheight = "6.35 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n')
    assert patch.pair.upper is patch.pair.piece and found == solved()[1]


def test_exact_a_step_lifts_one_side():
    patch, found = solved(tables='[contact.step]\nheight = "1 um"\nat = "2 mm"\n')
    x = patch.pair.grid.x
    assert patch.gap == pytest.approx(np.where(x > 2e-3, 1e-6, 0.0))
    assert patch.pressure.sigma_n[x > 2e-3].max() == 0 and found["pressure_centre"] < 0
    assert step(np.array([-1.0, 0.0, 1.0]), 2.0, 0.0).tolist() == [0.0, 1.0, 2.0]



def triangles(path, size, shift=0.0):
    """The pieces of TEXT cut into triangles, as a tagged .msh; the upper piece shifted along x."""
    pair = pair_mesh(graded_grid(12.7e-3, 6.35e-3, size, 152.4e-6))
    quads, points = pair["quads"], pair["points"].copy()
    points[len(points) // 2:, 0] += shift
    cells = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = meshio.Mesh(np.column_stack([points, np.zeros(len(points))]), [("triangle", cells), ("line", pair["edges"])])
    tags = [np.concatenate([pair["tags"]] * 2).astype(np.int32), pair["edge_tags"].astype(np.int32)]
    mesh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    mesh.field_data = {k: np.array([v, 2]) for k, v in CELL_TAGS.items()}
    mesh.field_data |= {k: np.array([v, 1]) for k, v in EDGE_TAGS.items()}
    meshio.write(path, mesh, file_format="gmsh22", binary=True)


def test_exact_a_scene_on_triangles_is_within_its_error_of_the_quads(tmp_path):
    triangles(tmp_path / "pieces.msh", 2e-4)
    text = TEXT.format(LOAD + '\nmesh = "pieces.msh"', '[contact.tilt]\nangle = "0.1 mrad"\n').replace(
        'element_size = "0.2 mm"\n', "")
    (tmp_path / "scene.toml").write_text(text, "utf-8")
    found = build(scene.load(tmp_path / "scene.toml")).patch
    patch, finer, _ = solve_all(found, TOLERANCE)
    assert finer.pair.grid.x.size == 2 * patch.pair.grid.x.size - 1
    cut = patch_measures.measures(patch, finer)
    grids = build(scene.loads(TEXT.format(LOAD, '[contact.tilt]\nangle = "0.1 mrad"\n'))).patch
    whole = patch_measures.measures(*solve_all(grids, TOLERANCE))
    for name, measure in cut.items():
        assert abs(measure.value - whole[name].value) <= measure.error + whole[name].error + measure.floor
    assert cut["normal_load"].value == pytest.approx(26 * 4.4482216152605, rel=1e-12)


def test_refuses_a_mesh_whose_interfaces_do_not_match(tmp_path):
    triangles(tmp_path / "pieces.msh", 5e-4, shift=1e-4)
    (tmp_path / "scene.toml").write_text(TEXT.format(LOAD + '\nmesh = "pieces.msh"', ""), "utf-8")
    with pytest.raises(PatchfemError, match=r"pieces.msh.*let both interfaces begin and end"):
        bodies_of(build(scene.load(tmp_path / "scene.toml")).patch)


@pytest.mark.parametrize("angle", [5e-6, 1e-4, 1e-3])
def test_exact_a_soft_linear_skin_is_the_wedge_on_a_foundation(angle):
    """Bodies a thousand times stiffer than the skin: contact length sqrt(2 N/(k theta b)), full below 2 p/(k L)."""
    stiffness, load, size = 1e10, 26 * 4.4482216152605, 12.7e-3
    found = solved(tables=f'[contact.tilt]\nangle = "{angle} rad"\n[contact.asperities]\nlaw = "linear"\n'
                          f'normal_stiffness = "{stiffness} Pa/m"\ntangential_ratio = 0.8\n')[1]
    opening = 2 * load / size**2 / (stiffness * size)
    length = min(size, np.sqrt(2 * load / (stiffness * angle * size)))
    assert (found["contact_fraction"] == 1) == (angle < opening)
    assert found["contact_fraction"] == pytest.approx(length / size, abs=0.02)
    assert found["normal_stiffness"] == pytest.approx(stiffness * size * found["contact_fraction"] * size, rel=2e-3)
    assert found["tangential_stiffness"] == pytest.approx(0.8 * found["normal_stiffness"], rel=2e-2)


def test_exact_a_hard_skin_is_none():
    tilt, skin = '[contact.tilt]\nangle = "0.1 mrad"\n', '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = '
    bare, hard = solved(tables=tilt)[1], solved(tables=tilt + skin + '"1e21 Pa/m"\n')[1]
    for name, value in bare.items():
        assert hard[name] == pytest.approx(value, rel=1e-6)


TURNING = {
    "spring": '[contact.holder]\nrotational_stiffness = "1e4 N m/rad"\n[contact.tilt]\nangle = "0.01 mrad"\n',
    "offset": '[contact.load_line]\noffset = "2 mm"\n',
    "moment": '[contact.load_line]\nmoment = "0.05 N m"\n',
    "spring and offset": '[contact.holder]\nrotational_stiffness = "1e3 N m/rad"\n'
                         '[contact.load_line]\noffset = "1 mm"\n',
    "smooth skin": '[contact.load_line]\noffset = "2 mm"\n[contact.asperities]\nlaw = "hertz"\nradius = "10 um"\n'
                   'density = "1e8 1/m^2"\nheight_deviation = "0.05 um"\n',
    "strips": '[contact.load_line]\noffset = "2 mm"\n[contact.strips]\ncount = 4\nroll = "0.01 mrad"\n',
}


@pytest.mark.share(0, 2, 5)
@pytest.mark.parametrize("tables", TURNING.values(), ids=TURNING.keys())
def test_exact_an_approach_with_a_turning_piece_is_the_load_that_reaches_it(tables):
    """The approach that a load gives, asked for in its place, gives that load back, the rotation and the pressure."""
    _, loaded = solved(tables=tables)
    closed = solved("", tables + f'[contact.approach]\ndistance = "{loaded["approach"]!r} m"\n')[1]
    assert closed["normal_load"] == pytest.approx(loaded["normal_load"], rel=1e-7)
    for name in ("rotation", "moment", "pressure_peak", "approach"):
        assert closed[name] == pytest.approx(loaded[name], rel=1e-6, abs=1e-13), name


def test_exact_a_turning_piece_above_first_touch_is_apart():
    tables = TURNING["spring"]
    patch, found = solved("", tables.replace("0.01 mrad", "0 mrad") + '[contact.approach]\ndistance = "0 m"\n')
    assert patch.pressure.outcome is Outcome.NO_CONTACT and found["normal_load"] == 0
