"""Effects in static patches: skins, strips, profiles, unlike pieces, rounded pieces and the
automatic mesh."""

import json
import re

import numpy as np
import pytest
from command_line import run_cli
from scene_texts import COATED, COATING, PIECE

from patchfem import build
from patchfem.closed_forms import contact as exact
from patchfem.core import PatchfemError
from patchfem.mesh import graded_grid, write_mesh
from patchfem.model import make_piece_meshes
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values
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


def load_scene(
    tables="", keys='load = "26 lbf"\nelement_size = "0.127 mm"', material=STEEL, path="scene.toml"
):
    """Return the scene of a patch with tables, keys and a material."""
    return loads(TEXT.format(keys=keys, material=material, tables=tables), path)


def build_patch_model(*args, **kwargs):
    """Return the PatchModel of a scene."""
    return build(load_scene(*args, **kwargs)).patch


def solve_patch(*args, **kwargs) -> tuple:
    """Return the solved patch of a scene and its values."""
    model = build_patch_model(*args, **kwargs)
    patch = solve_patch_contact(model, condense(model, *make_piece_meshes(model)))
    return patch, compute_static_values(patch)


# ---- skins
@pytest.mark.parametrize("angle", [1e-5, 1e-3])
def test_exact_rigid_wedges_on_skins_agree_with_closed_forms(angle):
    """Contact fraction, pressure centre, peak and stiffnesses of rigid wedges on exponential and
    linear skins agree with the closed forms."""
    _, patch_values = solve_patch(TILT.format(angle) + SKINS["exponential"], material=RIGID)
    fraction, centre = exact.wedge_on_asperities(angle, LENGTH, 2.5e-6)
    assert patch_values["loaded_fraction"] == pytest.approx(
        fraction, rel=1e-8 + (angle * 0.127e-3 / 2.5e-6) ** 2 / 11
    )
    assert patch_values["pressure_centre"] == pytest.approx(centre, rel=3e-4)
    # The tangential stiffness is proportional to the pressure.
    assert patch_values["tangential_stiffness"] == pytest.approx(0.8 * LOAD / 2.5e-6, rel=1e-5)
    assert patch_values["normal_stiffness"] == pytest.approx(LOAD / 2.5e-6, rel=1e-5)
    _, patch_values = solve_patch(TILT.format(angle) + SKINS["linear"], material=RIGID)
    fraction, centre, _, peak = exact.wedge_on_linear_foundation(angle, LOAD, LENGTH, WIDTH, 1e13)
    cell = 0.127e-3 / LENGTH
    assert patch_values["contact_fraction"] == pytest.approx(fraction, abs=0.55 * cell)
    assert patch_values["pressure_centre"] == pytest.approx(centre, rel=6e-4)
    assert patch_values["pressure_peak"] == pytest.approx(peak, rel=0.05 * cell / fraction)
    assert patch_values["tangential_stiffness"] == pytest.approx(
        0.8 * 1e13 * patch_values["contact_fraction"] * LENGTH * WIDTH, rel=1e-5
    )


@pytest.mark.share(0, 5)
@pytest.mark.parametrize("law", SKINS)
@pytest.mark.parametrize("strips", ["", '[contact.strips]\ncount = 3\nroll = "0.01 mrad"\n'])
def test_exact_normal_stiffness_is_derivative_of_load(law, strips):
    """The normal stiffness agrees with a finite difference of the load over the approach. Behind a
    linear skin this slope jumps between nodes, so that the difference spans about a dozen nodes."""
    tables = TILT.format(2e-5) + SKINS[law] + strips
    _, patch_values = solve_patch(tables)
    step = 3e-9 if law == "linear" else 1e-13
    loads_around = []
    for sign in (-1, 1):
        approach_table = (
            f'[contact.approach]\ndistance = "{patch_values["approach"] + sign * step!r} m"\n'
        )
        loads_around.append(
            solve_patch(tables + approach_table, keys='element_size = "0.127 mm"')[1]["normal_load"]
        )
    assert np.mean(loads_around) == pytest.approx(LOAD, rel=2e-3 if law == "linear" else 1e-6)
    assert np.diff(loads_around)[0] / (2 * step) == pytest.approx(
        patch_values["normal_stiffness"], rel=5e-4 if law == "linear" else 1e-4
    )


@pytest.mark.parametrize("law", ["linear", "hertz"])
def test_exact_sticking_loop_has_stiffness_of_skin(law):
    """The slope of a small sticking loop is the shear stiffness of the skin, and with
    [contact.shear] that of skin and pieces in series."""
    bench = (
        '[friction]\nlaw = "coulomb"\nstatic = 1e4\n[slide]\nkind = "triangle"\namplitude = "1 nm"\n'
        'speed = "1 mm/s"\n'
    )
    patch, result = solve_patch(SKINS[law])
    normal_stiffness = patch.state.stiffness
    rigid = 0.8 * np.sum(normal_stiffness * patch.pieces.interface.weight)
    series = result["tangential_stiffness"]
    assert series < rigid
    for tables, stiffness in (("", rigid), ("[contact.shear]\n", series)):
        result = run(load_scene(SKINS[law] + tables + bench), estimate=False)
        assert result.response.force.max() == pytest.approx(stiffness * 1e-9, rel=2e-4)
        assert result.measures["loop_area"].value <= 1e-9 * stiffness * 1e-18


# ---- strips
def test_exact_rolled_rigid_strips_agree_with_closed_form():
    """Below the roll angle that opens the contact, the pressure is linear over the width; the
    lateral centre is that of a wedge times 1 - 1/count^2."""
    roll = 0.5 * exact.wedge_opening_tilt(LOAD, WIDTH, LENGTH, 1e13)
    tables = SKINS["linear"] + f'[contact.strips]\ncount = 2\nroll = "{roll!r} rad"\n'
    patch, patch_values = solve_patch(tables, material=RIGID)
    centre = exact.wedge_on_linear_foundation(roll, LOAD, WIDTH, LENGTH, 1e13)[1]
    assert patch_values["pressure_centre_lateral"] == pytest.approx(centre * (1 - 1 / 4), rel=1e-5)
    assert patch_values["roll_moment"] == pytest.approx(
        LOAD * patch_values["pressure_centre_lateral"], rel=1e-12
    )
    assert patch_values["contact_fraction"] == pytest.approx(1.0, rel=1e-12)
    weight = patch.pieces.interface.weight
    assert weight @ patch.pressure.sigma_n == pytest.approx(LOAD, rel=1e-10)


def test_always_errors_of_free_roll_cover_strip_count():
    """The errors of a patch that can roll cover the result with 48 strips."""
    tables = '[contact.crown]\nradius = "5 m"\n[contact.strips]\ncount = {}\noffset = "1 mm"\n'
    keys = 'load = "26 lbf"\nelement_size = "0.5 mm"'
    coarse, fine = (run(load_scene(tables.format(n), keys)).measures for n in (2, 48))
    for name in ("roll", "pressure_peak", "contact_fraction", "approach"):
        assert (
            abs(coarse[name].value - fine[name].value) <= coarse[name].error + fine[name].error
        ), name
    assert coarse["pressure_centre_lateral"].value == pytest.approx(1e-3, rel=1e-9)


def test_exact_strips_without_roll_agree_with_single_patch():
    """Four strips without roll have the values of the single patch."""
    tables = TILT.format(1e-4)
    single = solve_patch(tables)[1]
    strips = solve_patch(tables + "[contact.strips]\ncount = 4\n")[1]
    for name, value in single.items():
        assert strips[name] == pytest.approx(value, rel=1e-9, abs=1e-15), name
    assert strips["pressure_centre_lateral"] == pytest.approx(0.0, abs=1e-12)


# ---- profiles
def write_profile(folder, x, z, name="before.csv"):
    """Write a profile and return the table that uses it."""
    rows = "\n".join(f"{a * 1e6:.6f},{b * 1e9:.6f}" for a, b in zip(x, z))
    (folder / name).write_text(f"x [um],z [nm]\n{rows}\n", "utf-8")
    return f'[contact.profile]\nfile = "{name}"\n'


def test_exact_half_width_spans_outermost_contacts(tmp_path):
    """Two round peaks 6 mm apart touch: the half-width spans both contacts and the gap between
    them, the contact fraction only the contacts. A trace that starts at 0 and is as long as the
    patch gives a note."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 8001)
    tables = write_profile(tmp_path, x + LENGTH / 2, (np.abs(x) - 3e-3) ** 2 / 2 / 0.5)
    result = run(
        load_scene(
            tables, keys='load = "50 N"\nelement_size = "0.127 mm"', path=tmp_path / "scene.toml"
        )
    )
    half, fraction = (
        result.measures[name].value for name in ("contact_half_width", "contact_fraction")
    )
    assert half == pytest.approx(3e-3 + fraction * LENGTH / 4, rel=1e-3) and 0 < fraction < 0.1
    assert any("is as long as the patch" in text for text in result.extra["notes"])
    assert not any("as long as the patch" in text for text in result.warnings)


def test_exact_surface_trace_agrees_with_inverted_gap(tmp_path):
    """Peaks of a trace are material: a trace z gives the result of the gap -z to the last bit."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 2001)
    z = 2e-6 * np.cos(2 * np.pi * x / 4e-3) - x**2 / 2 / 3.0
    side = 'on = "lower"\n'
    surface = write_profile(tmp_path, x, z, "surface.csv") + 'heights = "surface"\n' + side
    gap = write_profile(tmp_path, x, -z, "gap.csv") + side
    (surface_patch, surface_values), (gap_patch, gap_values) = (
        solve_patch(table, path=tmp_path / "scene.toml") for table in (surface, gap)
    )
    assert surface_values == gap_values and np.array_equal(
        surface_patch.unloaded_gap, gap_patch.unloaded_gap
    )
    upright = solve_patch(
        write_profile(tmp_path, x, z, "gap.csv") + side, path=tmp_path / "scene.toml"
    )[1]
    # The inverted trace is in contact at its two ends.
    assert upright["pressure_peak"] > 1.1 * surface_values["pressure_peak"]


# ---- pieces that differ
def write_pair_mesh(folder, lower, upper) -> str:
    """Write the meshes of both pieces and return the keys that use the file."""
    write_mesh(lower, folder / "pair.msh", upper)
    return 'load = "26 lbf"\nmesh = "pair.msh"'


def test_exact_unlike_meshes_transfer_load_to_both_pieces(tmp_path):
    """Two pieces with unlike nodes both receive the load and its moment; the values agree with like meshes within 2 %."""
    coarse, fine = (graded_grid(LENGTH, HEIGHT, LENGTH / cells) for cells in (60, 96))
    model = build(
        load_scene(
            TILT.format(1e-4), write_pair_mesh(tmp_path, coarse, fine), path=tmp_path / "scene.toml"
        )
    ).patch
    lower, upper = make_piece_meshes(model)
    patch = solve_patch_contact(model, condense(model, lower, upper))
    assert patch.pair.joint is not None and (lower.x.size, upper.x.size) == (61, 97)
    forces = patch.pair.forces(patch.pressure.sigma_n * patch.pieces.interface.weight)
    for body, force in zip((lower, upper), forces):
        assert force.sum() == pytest.approx(LOAD, rel=1e-10) and force.size == body.x.size
        assert force @ body.x == pytest.approx(patch.pressure.moment, rel=1e-9)
    like_model = build_patch_model(
        TILT.format(1e-4), 'load = "26 lbf"\nelement_size = "0.21167 mm"'
    )
    like_meshes = compute_static_values(
        solve_patch_contact(like_model, condense(like_model, coarse))
    )
    unlike_meshes = compute_static_values(patch)
    for name in ("approach", "normal_stiffness", "tangential_stiffness", "pressure_centre"):
        assert unlike_meshes[name] == pytest.approx(like_meshes[name], rel=0.02), name


UNLIKE = '[contact.upper]\nsubstrate = "Ti-8Al-1Mo-1V"\nheight = "{}"\n'


def test_refuses_mesh_with_other_dimensions_than_scene(tmp_path):
    """A mesh file whose piece has another height than the scene is refused with the line of the key, by every command."""
    grid = graded_grid(LENGTH, HEIGHT, LENGTH / 20)
    faulty_scene = load_scene(
        UNLIKE.format("9 mm"), write_pair_mesh(tmp_path, grid, grid), path=tmp_path / "scene.toml"
    )
    with pytest.raises(
        PatchfemError, match=r"^0\.009 m in the scene, but 0\.00635 m in the upper"
    ) as caught:
        make_piece_meshes(build(faulty_scene).patch)
    assert caught.value.key == "contact.height"
    with pytest.raises(
        PatchfemError, match=r"scene\.toml:4: contact\.height: 0\.009 m in the scene"
    ):
        run(faulty_scene)
    faulty_scene.path.write_text(faulty_scene.text, "utf-8")
    for command in (
        ["plan", faulty_scene.path, "--probe"],
        ["cost", faulty_scene.path, "--over", "element_size", "-q"],
    ):
        message = run_cli(*command).err
        assert (
            f"{faulty_scene.path}:4: contact.height: 0.009 m" in message
            and message.count("scene.toml") == 1
        ), command


CONVERGING = {
    "approach": 1.3,
    "normal_stiffness": 1.3,
    "tangential_stiffness": 1.3,
    "moment": 1.3,
    "pressure_peak": 0.5,
}  # measure: smallest order of convergence; the stress is singular at the far corners and at the coating


def test_exact_element_size_converges_to_value_of_automatic_mesh():
    """With half the element size, errors and stated errors fall with the order of the singularity at the far corners."""
    tables = COATING + TILT.format(2e-5)
    keys = 'load = "2 kN"\n'
    reference = solve_with_coarser(build_patch_model(tables, keys), 1e-4)[0].measures
    errors, stated = [], []
    for cells in (48, 96, 192):
        pinned = build_patch_model(tables, f'{keys}element_size = "{12.7 / cells} mm"')
        measures = solve_with_coarser(pinned, 1e-3)[0].measures
        errors.append(
            {name: abs(measures[name].value - reference[name].value) for name in CONVERGING}
        )
        stated.append({name: measures[name].error for name in CONVERGING})
        for name in CONVERGING:
            assert errors[-1][name] <= stated[-1][name] + reference[name].error, (cells, name)
    for name, order in CONVERGING.items():
        assert errors[2][name] <= errors[0][name] / 4**order + reference[name].error, name
        assert stated[2][name] <= stated[0][name] / 4, name


# ---- the automatic mesh
def test_exact_automatic_mesh_agrees_with_hertz():
    """The automatic mesh resolves a contact of 1 % of the length, which no uniform mesh of the same
    cost does."""
    model = build_patch_model('[contact.crown]\nradius = "0.2 m"\n', 'load = "40 N"')
    patch, *_ = solve_with_coarser(model, 1e-2)
    measures = patch.measures
    modulus = exact.combined_modulus(210e9, 0.3, 210e9, 0.3)
    half = exact.hertz_half_width(40 / WIDTH, 0.2, modulus)
    peak = exact.hertz_peak(40 / WIDTH, 0.2, modulus)
    assert patch.x.size < 420 and half < 0.01 * LENGTH
    assert measures["pressure_peak"].value == pytest.approx(peak, rel=2e-3)
    assert measures["contact_half_width"].value == pytest.approx(half, rel=5e-3)
    assert abs(measures["contact_fraction"].value * LENGTH / 2 / half - 1) < 0.01
    for name in ("pressure_peak", "contact_fraction", "normal_stiffness"):
        assert measures[name].error <= 1e-2 * measures[name].value, name


def test_always_errors_of_uniform_mesh_cover_reference():
    """The errors on uniform meshes cover the reference for strips under a roll of 0.1 mrad, and are
    at most 60 times the true error.

    The reference comes from two finite-element programs (elements of order 2 to 4, refined at the
    corners) that agree on K_n = 6.93285e8 N/m, lateral centre -4.975888 mm and roll moment
    -0.575480 N m.
    """
    text = (
        COATED.replace("26 lbf", "115.65376 N").replace("0.5 mm", "{} um")
        + '[contact.strips]\ncount = 8\nroll = "0.1 mrad"\n'
    )
    reference = {
        "normal_stiffness": 6.93285e8,
        "pressure_centre_lateral": -4.975888e-3,
        "roll_moment": -0.575480,
    }
    for size in (250, 127, 100):
        model = build(loads(text.format(size)))
        measures = solve_with_coarser(model.patch, 1e-3)[0].measures
        for name, value in reference.items():
            assert (
                abs(measures[name].value - value)
                <= measures[name].error
                <= 60 * abs(measures[name].value - value)
            ), name


@pytest.mark.parametrize(
    "tables, keys, message",
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
def test_always_scene_outside_model_gives_warning(tables, keys, message):
    """Very soft or nearly incompressible pieces, and meshes of few elements, give a warning."""
    result = run(load_scene(tables, 'load = "26 lbf"\n' + (keys or 'element_size = "0.5 mm"')))
    assert any(message in text for text in result.warnings)


@pytest.mark.parametrize(
    "shape, ends, pattern",
    [
        (TILT.format(-1e-4), (False, True), r"length in contact \(x = 4.4\d+ to 6.35 mm\), peak"),
        (
            '[contact.profile]\nfile = "hollow.csv"\n',
            (True, True),
            r"length in contact \(x = -6.35 to -(\S+) and \1 to 6.35 mm\), peak",
        ),
    ],
    ids=["right", "both"],
)
def test_exact_summary_states_contact_intervals(tmp_path, shape, ends, pattern):
    """The lengths of the contact intervals add up to the contact fraction, and their outer ends are
    two half-widths apart."""
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
    answer = run_cli("run", path, "-o", tmp_path / "out", "--no-page")
    assert answer.code == 0 and re.search(pattern, answer.out, re.M), answer.out[:300]
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    contact = summary["contact"]
    measures = {name: measure["value"] for name, measure in summary["measures"].items()}
    intervals = np.array(contact["stretches"])
    assert [contact["from"], contact["to"]] == pytest.approx([-LENGTH / 2, LENGTH / 2])
    assert (intervals[0, 0] == contact["from"], intervals[-1, 1] == contact["to"]) == ends
    assert np.diff(intervals).sum() / LENGTH == pytest.approx(
        measures["contact_fraction"], rel=1e-3
    )
    assert intervals[-1, 1] - intervals[0, 0] == pytest.approx(
        2 * measures["contact_half_width"], rel=1e-3
    )


def test_refuses_profile_with_waves_finer_than_mesh(tmp_path):
    """A profile with waves shorter than the elements is refused with the line of its key."""
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 8001)
    tables = write_profile(tmp_path, x, 1e-7 * np.sin(2 * np.pi * x / 50e-6))
    with pytest.raises(
        PatchfemError, match=r"scene\.toml:9: contact\.profile\.file: .*rms height.*element_size"
    ):
        run(load_scene(tables, path=tmp_path / "scene.toml"))
