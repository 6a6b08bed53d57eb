"""Effects of the static patch through their scenes: skins, strips, profiles, joined and rounded pieces."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from command_line import cli
from scene_texts import COATED, PIECE

from patchfem import build, plan
from patchfem.closed_forms import contact as exact
from patchfem.core import PatchfemError, frozen_array
from patchfem.formatting import format_length
from patchfem.mesh import graded_grid, write_mesh
from patchfem.mesh.pairs import as_piece
from patchfem.model import make_piece_meshes
from patchfem.runs import estimate_measures, solve_with_coarser
from patchfem.runs.patch.measures import plane_state_sentences
from patchfem.runs.patch.press import solve
from patchfem.runs.patch.values import values
from patchfem.runs.run import run
from patchfem.scene import loads

LENGTH, WIDTH, HEIGHT, LOAD = 12.7e-3, 12.7e-3, 6.35e-3, 115.653761996773
TEXT = (
    PIECE
    + """\
{keys}
substrate = {material}
{tables}
"""
)
STEEL = '"steel"'
RIGID = '{young = "1e12 GPa", poisson = 0.3, density = "1 kg/m^3"}'
TILT = '[contact.tilt]\nangle = "{} rad"\n'
SKINS = {
    "linear": '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\ntangential_ratio = 0.8\n',
    "exponential": '[contact.asperities]\nlaw = "exponential"\ndecay_length = "2.5 um"\n'
    'normal_stiffness = "1e11 Pa/m"\ntangential_ratio = 0.8\n',
    "hertz": '[contact.asperities]\nlaw = "hertz"\nradius = "10 um"\ndensity = "1e8 1/m^2"\n'
    'height_deviation = "0.05 um"\ntangential_ratio = 0.8\n',
}


def scene(
    tables="", keys='load = "26 lbf"\nelement_size = "0.127 mm"', material=STEEL, path="scene.toml"
):
    return loads(TEXT.format(keys=keys, material=material, tables=tables), path)


def asked(*args, **kwargs):
    """The PatchModel of a scene."""
    return build(scene(*args, **kwargs)).patch


def solved(*args, **kwargs) -> tuple:
    found = asked(*args, **kwargs)
    patch = solve(found, *make_piece_meshes(found))
    return patch, values(patch)


# ---------------------------------------------------------------------------------------------------------------- skins
@pytest.mark.parametrize("angle", [1e-5, 1e-4, 1e-3])
def test_exact_rigid_pieces_on_skins_are_the_wedges_in_closed_form(angle):
    _, found = solved(TILT.format(angle) + SKINS["exponential"], material=RIGID)
    fraction, centre = exact.wedge_on_asperities(angle, LENGTH, 2.5e-6)
    assert found["loaded_fraction"] == pytest.approx(
        fraction, rel=1e-8 + (angle * 0.127e-3 / 2.5e-6) ** 2 / 11
    )
    assert found["pressure_centre"] == pytest.approx(centre, rel=3e-4)
    # k_t follows the pressure
    assert found["tangential_stiffness"] == pytest.approx(0.8 * LOAD / 2.5e-6, rel=1e-5)
    assert found["normal_stiffness"] == pytest.approx(LOAD / 2.5e-6, rel=1e-5)
    _, found = solved(TILT.format(angle) + SKINS["linear"], material=RIGID)
    fraction, centre, _, most = exact.wedge_on_linear_foundation(angle, LOAD, LENGTH, WIDTH, 1e13)
    cell = 0.127e-3 / LENGTH
    assert found["contact_fraction"] == pytest.approx(fraction, abs=0.55 * cell)
    assert found["pressure_centre"] == pytest.approx(centre, rel=6e-4)
    assert found["pressure_peak"] == pytest.approx(most, rel=0.05 * cell / fraction)
    assert found["tangential_stiffness"] == pytest.approx(
        0.8 * 1e13 * found["contact_fraction"] * LENGTH * WIDTH, rel=1e-5
    )


@pytest.mark.share(0, 5)
@pytest.mark.parametrize("law", SKINS)
@pytest.mark.parametrize("strips", ["", '[contact.strips]\ncount = 3\nroll = "0.01 mrad"\n'])
def test_exact_normal_stiffness_is_the_slope_of_the_load_over_the_approach(law, strips):
    """Behind a linear skin the slope of the mesh jumps from node to node; over a dozen of them it is the measure."""
    tables = TILT.format(2e-5) + SKINS[law] + strips
    _, here = solved(tables)
    step = 3e-9 if law == "linear" else 1e-13
    loads_ = []
    for sign in (-1, 1):
        closing = f'[contact.approach]\ndistance = "{here["approach"] + sign * step!r} m"\n'
        loads_.append(solved(tables + closing, keys='element_size = "0.127 mm"')[1]["normal_load"])
    assert np.mean(loads_) == pytest.approx(LOAD, rel=2e-3 if law == "linear" else 1e-6)
    assert np.diff(loads_)[0] / (2 * step) == pytest.approx(
        here["normal_stiffness"], rel=5e-4 if law == "linear" else 1e-4
    )


@pytest.mark.parametrize("law", SKINS)
def test_exact_asperities_deform_in_shear_also_under_rigid_pieces(law):
    """A slow loop far inside the sticking range has the slope of the skin alone, and with [contact.shear] of both."""
    bench = (
        '[friction]\nlaw = "coulomb"\nstatic = 1e4\n[slide]\nkind = "triangle"\namplitude = "1 nm"\n'
        'speed = "1 mm/s"\n'
    )
    patch, found = solved(SKINS[law])
    crush = 1e13 if patch.skin is None else patch.skin.stiffness
    rigid = 0.8 * np.sum(crush * patch.pieces.interface.weight)
    both = found["tangential_stiffness"]
    assert both < rigid
    for tables, stiffness in (("", rigid), ("[contact.shear]\n", both)):
        found = run(scene(SKINS[law] + tables + bench), estimate=False)
        assert found.response.force.max() == pytest.approx(stiffness * 1e-9, rel=2e-4)
        assert found.measures["loop_area"].value <= 1e-9 * stiffness * 1e-18


# --------------------------------------------------------------------------------------------------------------- strips
@pytest.mark.parametrize("count", [2, 8])
def test_exact_strips_of_a_rigid_pad_on_a_linear_skin(count):
    """Below the opening roll the pressure is linear over the width: the wedge's centre times 1 - 1/count^2."""
    roll = 0.5 * exact.wedge_opening_tilt(LOAD, WIDTH, LENGTH, 1e13)
    tables = SKINS["linear"] + f'[contact.strips]\ncount = {count}\nroll = "{roll!r} rad"\n'
    patch, found = solved(tables, material=RIGID)
    centre = exact.wedge_on_linear_foundation(roll, LOAD, WIDTH, LENGTH, 1e13)[1]
    assert found["pressure_centre_lateral"] == pytest.approx(centre * (1 - 1 / count**2), rel=1e-5)
    assert found["roll_moment"] == pytest.approx(LOAD * found["pressure_centre_lateral"], rel=1e-12)
    assert found["contact_fraction"] == pytest.approx(1.0, rel=1e-12)
    weight = patch.pieces.interface.weight
    assert weight @ patch.pressure.sigma_n == pytest.approx(LOAD, rel=1e-10)


def test_exact_a_load_line_beside_the_middle_rolls_a_rigid_pad():
    """The pressure is N/A + N e y / I, the roll -N e / (k I), with I = L W^3 (1 - 1/count^2) / 12 of the strips."""
    arm = 0.8e-3
    count = 6
    tables = SKINS["linear"] + f'[contact.strips]\ncount = {count}\noffset = "{arm} m"\n'
    patch, found = solved(tables, material=RIGID)
    spread = LENGTH * WIDTH**3 / 12 * (1 - 1 / count**2)
    assert found["pressure_centre_lateral"] == pytest.approx(arm, rel=1e-9)
    assert found["roll"] == pytest.approx(-LOAD * arm / (1e13 * spread), rel=1e-5)
    outer = LOAD / (LENGTH * WIDTH) + LOAD * arm * patch.strips.offsets[-1] / spread
    assert patch.strips.pressure[-1] == pytest.approx(outer, rel=1e-4)


@pytest.mark.parametrize("count, arm", [(2, 1e-3), (6, 3e-3)])
def test_always_the_bars_of_a_free_roll_hold_the_count_of_strips(count, arm):
    tables = (
        f'[contact.crown]\nradius = "5 m"\n[contact.strips]\ncount = {{}}\noffset = "{arm} m"\n'
    )
    keys = 'load = "26 lbf"\nelement_size = "0.5 mm"'
    few, many = (run(scene(tables.format(n), keys)).measures for n in (count, 48))
    for name in ("roll", "pressure_peak", "contact_fraction", "approach"):
        assert abs(few[name].value - many[name].value) <= few[name].error + many[name].error, name
    assert few["pressure_centre_lateral"].value == pytest.approx(arm, rel=1e-9)


def test_exact_strips_without_roll_are_the_patch():
    tables = TILT.format(1e-4)
    one = solved(tables)[1]
    strips = solved(tables + "[contact.strips]\ncount = 4\n")[1]
    for name, value in one.items():
        assert strips[name] == pytest.approx(value, rel=1e-9, abs=1e-15), name
    assert strips["pressure_centre_lateral"] == pytest.approx(0.0, abs=1e-12)


# ------------------------------------------------------------------------------------------------------------- profiles
def profile(folder, x, z, name="before.csv"):
    rows = "\n".join(f"{a * 1e6:.6f},{b * 1e9:.6f}" for a, b in zip(x, z))
    (folder / name).write_text(f"x [um],z [nm]\n{rows}\n", "utf-8")
    return f'[contact.profile]\nfile = "{name}"\n'


def test_exact_a_crown_read_from_a_profile_is_the_crown(tmp_path):
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 8001)
    tables = profile(tmp_path, x, x**2 / 2 / 5.0)
    read, crown = (
        solved(part, path=tmp_path / "scene.toml")[1]
        for part in (tables, '[contact.crown]\nradius = "5 m"\n')
    )
    for name in (
        "pressure_peak",
        "contact_fraction",
        "contact_half_width",
        "normal_stiffness",
        "approach",
    ):
        assert read[name] == pytest.approx(crown[name], rel=1e-5 if name != "approach" else 5e-3), (
            name
        )


def test_the_half_width_is_that_of_the_outermost_contacts(tmp_path):
    """Two round tops 6 mm apart touch: the half width spans them with their gap, the fraction does not. The trace
    starts at 0, as a stylus file does, and is as long as the patch: that is a note."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 8001)
    tables = profile(tmp_path, x + LENGTH / 2, (np.abs(x) - 3e-3) ** 2 / 2 / 0.5)
    found = run(
        scene(tables, keys='load = "50 N"\nelement_size = "0.127 mm"', path=tmp_path / "scene.toml")
    )
    half, share = (
        found.measures[name].value for name in ("contact_half_width", "contact_fraction")
    )
    assert half == pytest.approx(3e-3 + share * LENGTH / 4, rel=1e-3) and 0 < share < 0.1
    assert any("is as long as the patch" in text for text in found.extra["notes"])
    assert not any("patch" in text for text in found.warnings)


@pytest.mark.parametrize("on", ["upper", "lower"])
def test_exact_a_stylus_trace_of_a_surface_is_its_gap_turned(tmp_path, on):
    """Peaks are material: the trace z presses as the gap -z does, bit for bit, whichever piece it was measured on."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 2001)
    z = 2e-6 * np.cos(2 * np.pi * x / 4e-3) - x**2 / 2 / 3.0
    side = f'on = "{on}"\n'
    surface = profile(tmp_path, x, z, "surface.csv") + 'heights = "surface"\n' + side
    gap = profile(tmp_path, x, -z, "gap.csv") + side
    (one, trace), (other, turned) = (
        solved(part, path=tmp_path / "scene.toml") for part in (surface, gap)
    )
    assert trace == turned and np.array_equal(one.unloaded_gap, other.unloaded_gap)
    upright = solved(profile(tmp_path, x, z, "gap.csv") + side, path=tmp_path / "scene.toml")[1]
    assert upright["pressure_peak"] > 1.1 * trace["pressure_peak"]  # it rides on its two ends


# --------------------------------------------------------------------------------------------------- pieces that differ
def meshed(folder, lower, upper) -> str:
    write_mesh(lower, folder / "pair.msh", upper)
    return 'load = "26 lbf"\nmesh = "pair.msh"'


def test_exact_pieces_of_unlike_nodes_carry_the_load_to_both_bodies(tmp_path):
    coarse, fine = (graded_grid(LENGTH, HEIGHT, LENGTH / cells) for cells in (60, 96))
    found = build(
        scene(TILT.format(1e-4), meshed(tmp_path, coarse, fine), path=tmp_path / "scene.toml")
    ).patch
    low, high = make_piece_meshes(found)
    patch = solve(found, low, high)
    assert patch.pair.joint is not None and (low.x.size, high.x.size) == (61, 97)
    forces = patch.pair.forces(patch.pressure.sigma_n * patch.pieces.interface.weight)
    for body, force in zip((low, high), forces):
        assert force.sum() == pytest.approx(LOAD, rel=1e-10) and force.size == body.x.size
        assert force @ body.x == pytest.approx(patch.pressure.moment, rel=1e-9)
    same = values(
        solve(asked(TILT.format(1e-4), 'load = "26 lbf"\nelement_size = "0.21167 mm"'), coarse)
    )
    mine = values(patch)
    for name in ("approach", "normal_stiffness", "tangential_stiffness", "pressure_centre"):
        assert mine[name] == pytest.approx(same[name], rel=0.02), name


UNLIKE = '[contact.upper]\nsubstrate = "Ti-8Al-1Mo-1V"\nheight = "{}"\n'


def test_refuses_a_mesh_whose_pieces_are_not_those_of_the_scene(tmp_path):
    grid = graded_grid(LENGTH, HEIGHT, LENGTH / 20)
    found = scene(UNLIKE.format("9 mm"), meshed(tmp_path, grid, grid), path=tmp_path / "scene.toml")
    with pytest.raises(
        PatchfemError, match=r"^0\.009 m in the scene, but 0\.00635 m in the upper"
    ) as caught:
        make_piece_meshes(build(found).patch)
    assert caught.value.key == "contact.height"
    with pytest.raises(
        PatchfemError, match=r"scene\.toml:4: contact\.height: 0\.009 m in the scene"
    ):
        run(found)
    found.path.write_text(found.text, "utf-8")
    for words in (
        ["plan", found.path, "--probe"],
        ["mesh", found.path, "-o", tmp_path / "other.msh"],
        ["cost", found.path, "--over", "element_size", "-q"],
    ):
        said = cli(*words).err
        assert (
            f"{found.path}:4: contact.height: 0.009 m" in said and said.count("scene.toml") == 1
        ), words


def test_exact_a_rounded_mesh_is_the_flat_mesh_with_the_rounding_in_its_gap(tmp_path):
    """Both faces fall away by x^2/(4 R): together the crown of radius R."""
    grid = graded_grid(LENGTH, HEIGHT, 0.127e-3)
    flat = as_piece(grid)
    depth = flat.points[:, 1]
    points = flat.points.copy()
    points[:, 1] = depth + points[:, 0] ** 2 / (4 * 5.0) * (1 - depth / HEIGHT)
    round_ = replace(flat, points=frozen_array(points))
    keys = meshed(tmp_path, round_, round_)
    found = asked("", keys, path=tmp_path / "scene.toml")
    patch = solve(found, *make_piece_meshes(found))
    x = patch.x
    assert patch.unloaded_gap == pytest.approx(x**2 / (2 * 5.0), rel=1e-9, abs=1e-18)
    mine = values(patch)
    crown = solved('[contact.crown]\nradius = "5 m"\n')[1]
    for name in ("pressure_peak", "contact_fraction", "normal_stiffness", "approach"):
        assert mine[name] == pytest.approx(crown[name], rel=1e-3), name


# ------------------------------------------------------------------------------------------------------ the chosen mesh
def test_exact_the_chosen_mesh_meets_hertz_within_its_error():
    """The contact is a hundredth of the patch, which no even mesh of that cost resolves."""
    found = asked('[contact.crown]\nradius = "0.2 m"\n', 'load = "40 N"')
    series = solve_with_coarser(found, 1e-2)
    mine = estimate_measures(*series)
    modulus = exact.combined_modulus(210e9, 0.3, 210e9, 0.3)
    half = exact.hertz_half_width(40 / WIDTH, 0.2, modulus)
    peak = exact.hertz_peak(40 / WIDTH, 0.2, modulus)
    assert series[0].x.size < 420 and half < 0.01 * LENGTH
    assert mine["pressure_peak"].value == pytest.approx(peak, rel=2e-3)
    assert mine["contact_half_width"].value == pytest.approx(half, rel=5e-3)
    assert abs(mine["contact_fraction"].value * LENGTH / 2 / half - 1) < 0.01
    for name in ("pressure_peak", "contact_fraction", "normal_stiffness"):
        assert mine[name].error <= 1e-2 * mine[name].value, name


def test_exact_the_plane_band_is_the_other_plane_state():
    found = asked(TILT.format(1e-5))
    patch = solve(found, *make_piece_meshes(found))
    [sentence] = plane_state_sentences(found, patch)
    in_stress = replace(found, pieces=replace(found.pieces, plane="stress"))
    stress = values(solve(in_stress, *make_piece_meshes(found)))
    mine = values(patch)
    assert "approach by +" + format_length(stress["approach"] - mine["approach"], 3) in sentence
    assert (
        f"normal_stiffness by {100 * (stress['normal_stiffness'] / mine['normal_stiffness'] - 1):+.2g} %"
        in sentence
    )
    wide = asked()
    wide = replace(wide, pieces=replace(wide.pieces, width=60e-3))
    assert plane_state_sentences(wide, solve(wide, *make_piece_meshes(wide))) == []


def test_always_the_bar_of_an_even_mesh_holds_the_error_of_its_rows():
    """Strips under a roll of 0.1 mrad: two finite-element programs of other elements (quadratic to quartic, graded to
    the far corners) agree on K_n = 6.93285e8 N/m, lateral centre -4.975888 mm and roll moment -0.575480 N m."""
    text = (
        COATED.replace("26 lbf", "115.65376 N").replace("0.5 mm", "{} um")
        + '[contact.strips]\ncount = 8\nroll = "0.1 mrad"\n'
    )
    truth = {
        "normal_stiffness": 6.93285e8,
        "pressure_centre_lateral": -4.975888e-3,
        "roll_moment": -0.575480,
    }
    for size in (250, 127, 100):
        found = estimate_measures(*solve_with_coarser(build(loads(text.format(size))).patch, 1e-3))
        for name, value in truth.items():
            assert (
                abs(found[name].value - value)
                <= found[name].error
                <= 60 * abs(found[name].value - value)
            ), name


def test_refuses_a_run_that_the_memory_cannot_hold():
    from patchfem.core import Missing

    found = plan(scene(keys='load = "26 lbf"\nelement_size = "0.2 um"'))
    assert any("`run` will refuse this scene" in sentence for sentence in found.verdict)
    with pytest.raises(Missing, match="GB of memory are needed"):
        run(found)


@pytest.mark.parametrize(
    "tables, keys, said",
    [
        (
            '[contact.upper]\nsubstrate = {young = "1 MPa", poisson = 0.3, density = "1 kg/m^3"}\n',
            "",
            "lowest Young",
        ),
        (
            '[contact.upper]\nsubstrate = {young = "1 GPa", poisson = 0.4995, density = "1 kg/m^3"}\n',
            "",
            "the elements become too stiff",
        ),
        ("", 'element_size = "3 mm"', "the 5 elements along the interface are too few"),
    ],
)
def test_always_what_leaves_the_model_is_said(tables, keys, said):
    found = run(scene(tables, 'load = "26 lbf"\n' + (keys or 'element_size = "0.5 mm"')))
    assert any(said in text for text in found.warnings)


@pytest.mark.parametrize(
    "shape, ends, told",
    [
        (TILT.format(1e-4), (True, False), r", from x = -6.35 to -4.47 mm \(left end\); peak"),
        (TILT.format(-1e-4), (False, True), r", from x = 4.47 to 6.35 mm \(right end\); peak"),
        (
            '[contact.crown]\nradius = "10 m"\n',
            (False, False),
            r", from x = -([\d.]+) to \1 mm; peak",
        ),
        (
            '[contact.profile]\nfile = "hollow.csv"\n',
            (True, True),
            r", from x = -6.35 to -(\S+) mm \(left end\) and from \1 to 6.35 mm \(right end\); peak",
        ),
        ("", (True, True), "^100 % of the length in contact; peak"),
    ],
    ids=["left", "right", "middle", "both", "whole"],
)
def test_exact_the_summary_states_the_places_of_the_contact(tmp_path, shape, ends, told):
    """The parts of the contact add up to its share of the length, and their outer edges lie 2 half-widths apart."""
    x = np.linspace(-6.35, 6.35, 501)
    (tmp_path / "hollow.csv").write_text(
        "x [mm],z [um]\n" + "".join(f"{place:.6f},{1 - (place / 6.35) ** 2:.9f}\n" for place in x)
    )
    path = tmp_path / "scene.toml"
    path.write_text(
        TEXT.format(
            keys='load = "26 lbf"\nelement_size = "0.0635 mm"', material=STEEL, tables=shape
        )
    )
    answer = cli("run", path, "-o", tmp_path / "out", "--no-page")
    assert answer.code == 0 and re.search(told, answer.out, re.M), answer.out[:300]
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    contact = summary["contact"]
    known = {name: one["value"] for name, one in summary["measures"].items()}
    parts = np.array(contact["stretches"])
    assert [contact["from"], contact["to"]] == pytest.approx([-LENGTH / 2, LENGTH / 2])
    assert (parts[0, 0] == contact["from"], parts[-1, 1] == contact["to"]) == ends
    assert np.diff(parts).sum() / LENGTH == pytest.approx(known["contact_fraction"], rel=1e-3)
    assert parts[-1, 1] - parts[0, 0] == pytest.approx(2 * known["contact_half_width"], rel=1e-3)


def test_refuses_a_profile_finer_than_the_mesh(tmp_path):
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 8001)
    tables = profile(tmp_path, x, 1e-7 * np.sin(2 * np.pi * x / 50e-6))
    with pytest.raises(
        PatchfemError, match=r"scene\.toml:9: contact\.profile\.file: .*rms height.*element_size"
    ):
        run(scene(tables, path=tmp_path / "scene.toml"))


def test_exact_a_patch_without_a_load_has_no_contact(tmp_path):
    path = tmp_path / "apart.toml"
    path.write_text(
        TEXT.format(keys='load = "0 N"\nelement_size = "0.5 mm"', material=STEEL, tables=""),
        "utf-8",
    )
    answer = cli("run", path, "-o", tmp_path / "out", "--json")
    assert answer.code == 0 and json.loads(answer.out)["outcome"] == "no_contact"
