"""Notes on stress beyond the yield strength, against Hertz's line contact: 0.558 of the peak, 0.70 half-widths deep."""

import json
import re
from math import pi
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import cli

import patchfem as pf
from patchfem.export.fields.strength import find_yielding
from patchfem.scene import MATERIALS

RADIUS, WIDTH = 14.5e-3, 10e-3
YIELD = MATERIALS["steel"].strength.strength
MODULUS = MATERIALS["steel"].young / (2 * (1 - MATERIALS["steel"].poisson ** 2))
SCENE = """\
[contact]
length = "6 mm"
width = "10 mm"
height = "6 mm"
load = "{load!r} N"
element_size = "8 um"
substrate = {substrate}
[contact.crown]
radius = "14.5 mm"
[accuracy]
tolerance = 1e-1
"""
FLAT = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "{load}"
element_size = "100 um"
substrate = "steel"
"""
OWN = '{young = "210 GPa", poisson = 0.30, density = "7850 kg/m^3"}'


def under_the_middle(depth):
    """von Mises stress over the peak pressure on the axis of Hertz's line contact, depth over its half-width."""
    root = np.hypot(1, depth)
    poisson = MATERIALS["steel"].poisson
    x = 2 * depth - (1 + 2 * depth**2) / root
    y = -1 / root
    z = poisson * (x + y)
    return np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2)


def noted(tmp_path, peak: float, substrate: str = '"steel"') -> list:
    """Notes on yielding of a crowned piece that Hertz presses to a peak pressure [Pa]."""
    load = float(peak**2 * pi * RADIUS / MODULUS * WIDTH)
    scene = tmp_path / "hertz.toml"
    scene.write_text(SCENE.format(load=load, substrate=substrate))
    assert cli("run", scene, "-o", tmp_path / "out", "--no-page", "-q").code == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    return [one for one in summary["notes"] if "yield strength" in one]


def test_exact_the_note_begins_where_hertz_reaches_the_strength(tmp_path):
    limit = YIELD / 0.558
    assert noted(tmp_path, 0.9 * limit) == []
    (told,) = noted(tmp_path, 1.1 * limit)
    stress, depth = (
        float(re.search(text, told)[1])
        for text in (r"reaches ([\d.]+) MPa", r"and ([\d.]+) um from")
    )
    half = 2 * RADIUS * 1.1 * limit / MODULUS
    depths = np.linspace(0, 2, 2001)
    deepest = depths[np.argmax(under_the_middle(depths))]
    assert (deepest, under_the_middle(deepest)) == pytest.approx((0.70, 0.558), abs=5e-3)
    # 1.021 of the half-plane's: sides 26 half-widths off, which nothing holds
    assert stress * 1e6 == pytest.approx(1.1 * limit * under_the_middle(deepest), rel=0.025)
    # half a cell; the greatest shear lies 9 um deeper
    assert depth * 1e-6 == pytest.approx(deepest * half, abs=4.5e-6)
    assert "in the steel of the" in told
    assert "the other piece exceeds its yield strength too" in told
    assert "235 MPa (EN 10025-2: minimum yield strength of S235" in told


def test_exact_a_material_of_one_s_own_has_no_strength(tmp_path):
    assert noted(tmp_path, 2 * YIELD / 0.558, OWN) == []


def test_exact_the_strength_of_the_scene_counts_for_a_material_of_its_own(tmp_path):
    own = OWN.replace("}", ', yield = "400 MPa"}')
    assert noted(tmp_path, 0.9 * 400e6 / 0.558, own) == []
    (told,) = noted(tmp_path, 1.1 * 400e6 / 0.558, own)
    assert "in the material of the" in told and "400 MPa (given in the scene)" in told


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_a_run_without_files_knows_a_lower_bound_from_the_peak(tmp_path, plane):
    """At a face under the pressure p the von Mises stress is at least that over all stresses along the face: 0.390 p in
    plane strain, 0.866 p in plane stress, by trial of 4001 of them."""
    along = np.linspace(-2, 2, 4001)
    across = MATERIALS["steel"].poisson * (along - 1) if plane == "strain" else 0.0
    least = np.sqrt(((along + 1) ** 2 + (along - across) ** 2 + (across + 1) ** 2) / 2).min()
    for share, count in ((0.98, 0), (1.04, 1)):
        peak = share * YIELD / least
        modulus = MODULUS if plane == "strain" else MATERIALS["steel"].young / 2
        load = float(peak**2 * pi * RADIUS / modulus * WIDTH)
        text = SCENE.format(load=load, substrate='"steel"')
        text = text.replace("[contact.crown]", f'plane = "{plane}"\n[contact.crown]')
        result = pf.run(pf.load(text))
        assert sum("yield strength" in one for one in result.notes) == count
    result.save(tmp_path / "out")
    (told,) = [one for one in result.notes if "yield strength" in one]
    # the stress of the mesh, which is larger, replaces the bound
    assert "the von Mises stress reaches" in told


@pytest.mark.parametrize("load, told", [("32 kN", 0), ("45 kN", 1)])
def test_exact_the_corners_of_the_held_face_do_not_count(tmp_path, load, told):
    """Flat pieces under 198 MPa, in plane strain 182 MPa by von Mises for elements of 400 to 50 um; the corners of the
    held face had 222, 241, 252 and 264 MPa with them, so the finer ones were told to yield. Under 279 MPa they do."""
    result = pf.run(FLAT.format(load=load))
    result.save(tmp_path / "out")
    assert sum("yield strength" in one for one in result.notes) == told


def test_exact_a_coating_of_the_same_metal_is_not_the_other_piece():
    """Both cells of the upper piece flow, alike: it was called two pieces, and alike places could not be compared."""
    steel = SimpleNamespace(
        name="steel",
        young=MATERIALS["steel"].young,
        poisson=MATERIALS["steel"].poisson,
        yield_=None,
    )
    piece = SimpleNamespace(substrate=steel, coating=SimpleNamespace(material=steel))
    points = np.array([[x, y] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0)])
    bodies = {
        side: {
            "points": points,
            "blocks": [np.array([[0, 2, 3, 1], [2, 4, 5, 3]])],
            "material": [False, True],
            "mises": np.full((1, 2), stress),
        }
        for side, stress in (("lower", 100e6), ("upper", 300e6))
    }
    (told,) = find_yielding(
        SimpleNamespace(pieces=SimpleNamespace(lower=piece, upper=piece)), bodies
    ).values()
    assert "300 MPa in the steel of the upper piece" in told and "other piece" not in told


@pytest.mark.slow
def test_exact_a_result_that_is_saved_twice_says_it_once(tmp_path):
    load = (600e6) ** 2 * pi * RADIUS / MODULUS * WIDTH
    result = pf.run(SCENE.format(load=load, substrate='"steel"'))
    for name in ("one", "two"):
        result.save(tmp_path / name)
    assert sum("yield strength" in one for one in result.notes) == 1
