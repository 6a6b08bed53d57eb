"""Effects in static patches: skins, profiles, unlike pieces, rounded pieces and the
automatic mesh."""

import re

import contact_forms as exact
import numpy as np
import pytest
from command_line import read_json, run_successfully
from scene_texts import PIECE

import patchfem as pf
from patchfem import build
from patchfem.core import PatchfemError
from patchfem.model import make_piece_meshes
from patchfem.runs import solve_with_coarser
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.patch.values import compute_static_values
from patchfem.runs.run import run
from patchfem.scene import loads

LENGTH, WIDTH, LOAD = 12.7e-3, 12.7e-3, 115.653761996773
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
def test_exact_normal_stiffness_is_derivative_of_load(law):
    """The normal stiffness agrees with a finite difference of the load over the approach. Behind a
    linear skin this slope jumps between nodes, so that the difference spans about a dozen nodes."""
    tables = TILT.format(2e-5) + SKINS[law]
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
    rigid = 0.8 * np.sum(1 / patch.pressed.layer)
    series = result["tangential_stiffness"]
    assert series < rigid
    for tables, stiffness in (("", rigid), ("[contact.shear]\n", series)):
        result = run(load_scene(SKINS[law] + tables + bench), estimate=False)
        assert result.response.force.max() == pytest.approx(stiffness * 1e-9, rel=2e-4)
        assert result.measures["loop_area"].value <= 1e-9 * stiffness * 1e-18


# ---- profiles
def write_profile(folder, x, z, name="before.csv"):
    """Write a profile and return the table that uses it."""
    rows = "\n".join(f"{a * 1e6:.6f},{b * 1e9:.6f}" for a, b in zip(x, z))
    (folder / name).write_text(f"x [um],z [nm]\n{rows}\n", "utf-8")
    return f'[contact.profile]\nfile = "{name}"\n'


# ---- the automatic mesh
def test_automatic_mesh_agrees_with_hertz():
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
def test_summary_states_contact_intervals(tmp_path, shape, ends, pattern):
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
    answer = run_successfully("run", path, "-o", tmp_path / "out", "--no-page")
    assert re.search(pattern, answer.out, re.M), answer.out[:300]
    summary = read_json(tmp_path / "out/summary.json")
    times = [effect["seconds"] for effect in summary["effects"]]
    assert 0 < max(times) <= summary["seconds"]["total"]
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


def test_exact_prescribed_rotation_has_no_error_and_no_warning():
    """The rotation of pieces of 320 mm that cannot rotate is exactly 0, so that it neither warns nor refines the mesh.

    A smaller tolerance gets a finer mesh.
    """
    steel = '{young = "210 GPa", poisson = 0.3, density = "7800 kg/m^3"}'
    text = '[contact]\nlength = "320 mm"\nheight = "160 mm"\nwidth = "10 mm"\nload = "1.2 kN"\ncrown.radius = "60 mm"\n'
    text += f"substrate = {steel}\n[accuracy]\ntolerance = "
    coarse, fine = (run(build(text + tolerance)) for tolerance in ("1e-3", "1e-4"))
    assert coarse.measures["rotation"].value == coarse.measures["rotation"].error == 0.0
    assert coarse.warnings == [] and not any("rotation" in one for one in fine.warnings)
    assert coarse.patch.x.size < fine.patch.x.size

    # The closed form for half planes; pieces of this size change its pressure by 1e-6
    peak = coarse.measures["pressure_peak"]
    modulus = 210e9 / (1 - 0.3**2) / 2
    assert abs(peak.value - np.sqrt(modulus * 1.2e5 / (np.pi * 0.06))) <= peak.error


def test_exact_approach_near_its_change_of_sign_needs_no_finer_mesh():
    """An approach of about 0 is judged by the terms of which it is the difference, as in the result, not by 1e-13 m."""
    tilted = {"contact.tilt.angle": "0.1 mrad"}
    steady, changing = (
        pf.run(pf.new("patch"), **tilted, **{"contact.load": load})
        for load in ("200 N", "283.66 N")
    )
    assert abs(changing.measures["approach"].value) < 1e-3 * abs(steady.measures["approach"].value)
    assert changing.patch.x.size < 1.2 * steady.patch.x.size and not changing.warnings
