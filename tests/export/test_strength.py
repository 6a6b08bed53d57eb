"""Notes on yielding, compared with Hertz's line contact: 0.558 of the peak pressure, 0.70 half-widths deep."""

import re
from math import pi

import numpy as np
import pytest
from command_line import read_json, run_successfully

import patchfem as pf
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
element_size = "16 um"
substrate = "steel"
[contact.crown]
radius = "14.5 mm"
[accuracy]
tolerance = 1e-1
"""


def mises_below_centre(depth):
    """Return the von Mises stress over the peak pressure on the axis of Hertz's line contact.

    The depth is given over the half-width of the contact.
    """
    root = np.hypot(1, depth)
    poisson = MATERIALS["steel"].poisson
    x = 2 * depth - (1 + 2 * depth**2) / root
    y = -1 / root
    z = poisson * (x + y)
    return np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2)


def find_yield_notes(tmp_path, peak: float) -> list:
    """Return the notes on yielding of a crowned piece under a peak pressure [Pa] of Hertz."""
    load = float(peak**2 * pi * RADIUS / MODULUS * WIDTH)
    scene = tmp_path / "hertz.toml"
    scene.write_text(SCENE.format(load=load))
    run_successfully("run", scene, "-o", tmp_path / "out", "--no-page", "-q")
    summary = read_json(tmp_path / "out/summary.json")
    return [note for note in summary["notes"] if "yield strength" in note]


def test_yield_note_agrees_with_hertz(tmp_path):
    """The note on yielding appears where Hertz's stress reaches the yield strength.

    Its stress agrees within 2.5 %, and its depth within half a cell.
    """
    limit = YIELD / 0.558
    assert find_yield_notes(tmp_path, 0.9 * limit) == []
    (note,) = find_yield_notes(tmp_path, 1.1 * limit)
    stress, depth = (
        float(re.search(text, note)[1])
        for text in (r"reaches ([\d.]+) MPa", r"and ([\d.]+) um from")
    )
    half_width = 2 * RADIUS * 1.1 * limit / MODULUS
    depths = np.linspace(0, 2, 2001)
    depth_of_maximum = depths[np.argmax(mises_below_centre(depths))]
    assert (depth_of_maximum, mises_below_centre(depth_of_maximum)) == pytest.approx(
        (0.70, 0.558), abs=5e-3
    )
    # 1.021 times the stress of a half-plane, because the free sides are 26 half-widths away
    assert stress * 1e6 == pytest.approx(
        1.1 * limit * mises_below_centre(depth_of_maximum), rel=0.025
    )
    # within half a cell; the largest shear stress lies 9 um deeper
    assert depth * 1e-6 == pytest.approx(depth_of_maximum * half_width, abs=8.5e-6)
    assert "in the steel of the" in note
    assert "the other piece exceeds its yield strength too" in note
    assert "235 MPa (EN 10025-2: minimum yield strength of S235" in note


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_yield_bound_from_peak_pressure(tmp_path, plane):
    """A result that is not saved has a note on yielding from a lower bound of the von Mises stress.

    Under the pressure p the bound is 0.390 p in plane strain and 0.866 p in plane stress, the minimum over stresses
    along the face.
    """
    stress_along = np.linspace(-2, 2, 4001)
    stress_across = MATERIALS["steel"].poisson * (stress_along - 1) if plane == "strain" else 0.0
    min_ratio = np.sqrt(
        ((stress_along + 1) ** 2 + (stress_along - stress_across) ** 2 + (stress_across + 1) ** 2)
        / 2
    ).min()
    for factor, count in ((0.98, 0), (1.04, 1)):
        peak = factor * YIELD / min_ratio
        modulus = MODULUS if plane == "strain" else MATERIALS["steel"].young / 2
        load = float(peak**2 * pi * RADIUS / modulus * WIDTH)
        text = SCENE.format(load=load)
        text = text.replace("[contact.crown]", f'plane = "{plane}"\n[contact.crown]')
        result = pf.run(pf.load(text))
        assert sum("yield strength" in note for note in result.notes) == count
    result.save(tmp_path / "out")
    (told,) = [note for note in result.notes if "yield strength" in note]
    # the stress of the mesh is larger and replaces the bound
    assert "the von Mises stress reaches" in told
