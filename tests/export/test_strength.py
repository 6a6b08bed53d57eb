"""Notes on stress beyond the yield strength, against Hertz's line contact: 0.558 of the peak, 0.70 half-widths deep."""

import json
import re

import pytest
from command_line import cli

import patchfem as pf
from patchfem.scene.keys.materials import MATERIALS, YIELD

RADIUS, WIDTH = 14.5e-3, 10e-3
MODULUS = MATERIALS["steel"].young / (2 * (1 - MATERIALS["steel"].poisson**2))
SCENE = """\
[contact]
length = "6 mm"
width = "10 mm"
height = "6 mm"
load = "{load!r} N"
element_size = "15 um"
substrate = {substrate}
[contact.crown]
radius = "14.5 mm"
[accuracy]
tolerance = 1e-1
"""
OWN = '{young = "210 GPa", poisson = 0.30, density = "7850 kg/m^3"}'


def noted(tmp_path, peak: float, substrate: str = '"steel"') -> list:
    """Notes on yielding of a crowned piece that Hertz presses to a peak pressure [Pa]."""
    load = float(peak**2 * 3.141592653589793 * RADIUS / MODULUS * WIDTH)
    scene = tmp_path / "hertz.toml"
    scene.write_text(SCENE.format(load=load, substrate=substrate))
    assert cli("run", scene, "-o", tmp_path / "out", "--no-page", "-q").code == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    return [one for one in summary["notes"] if "yield strength" in one]


def test_exact_the_note_begins_where_hertz_reaches_the_strength(tmp_path):
    limit = YIELD["steel"].strength / 0.558
    assert noted(tmp_path, 0.9 * limit) == []
    (told,) = noted(tmp_path, 1.1 * limit)
    stress, depth = (float(re.search(text, told)[1]) for text in (r"reaches ([\d.]+) MPa", r"and ([\d.]+) um from"))
    half = 2 * RADIUS * 1.1 * limit / MODULUS
    assert stress * 1e6 == pytest.approx(0.558 * 1.1 * limit, rel=0.04)
    assert depth * 1e-6 == pytest.approx(0.70 * half, rel=0.2)  # the stress is flat there, the cells 0.13 half-widths
    assert "in the steel of the" in told and "which the other piece passes too" in told
    assert "235 MPa (EN 10025-2: minimum of S235" in told


def test_exact_a_material_of_one_s_own_has_no_strength(tmp_path):
    assert noted(tmp_path, 2 * YIELD["steel"].strength / 0.558, OWN) == []


def test_always_strengths_belong_to_materials_and_name_their_source():
    for name, one in YIELD.items():
        assert name in MATERIALS and 1e-4 < one.strength / MATERIALS[name].young < 1e-2 and one.source.endswith(".")
    assert not {"WC-Co", "WC-Co sintered", "alumina"} & YIELD.keys()  # they break before they flow


def test_exact_a_result_that_is_saved_twice_says_it_once(tmp_path):
    load = (600e6)**2 * 3.141592653589793 * RADIUS / MODULUS * WIDTH
    result = pf.run(SCENE.format(load=load, substrate='"steel"'))
    for name in ("one", "two"):
        result.save(tmp_path / name)
    assert sum("yield strength" in one for one in result.notes) == 1
