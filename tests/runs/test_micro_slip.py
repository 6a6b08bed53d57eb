"""Benches in micro-slip: loop area and stiffness against an independent program, and the effect of
the tolerance."""

import re

import numpy as np
import pytest
from scene_texts import COATED, COULOMB, DRIVE, MODE, SHEAR

import patchfem as pf
from patchfem.scene import loads

# Crowned steel pieces; the slide amplitude is 1/40 of that of complete slip.
CROWNED = """
[contact]
length = "39.833 mm"
width = "28.02 mm"
height = "15.225 mm"
load = "5592.8 N"
substrate = "steel"
[contact.crown]
radius = "231.16 m"
"""
SLIDING_BENCH = (
    CROWNED
    + """
[contact.shear]
[friction]
law = "coulomb"
static = 0.359
[slide]
kind = "sine"
amplitude = "7.8188e-08 m"
frequency = "10 Hz"
cycles = 2
"""
)
REFERENCE_LOOP = 1.84e-9  # Loop area [J] of an independent finite-element program, within 1 %.
TOLERANCES = ("1e-2", "1e-3")


@pytest.fixture(scope="module")
def results_by_tolerance():
    """Return tolerance -> result of the bench."""
    return {
        tolerance: pf.run(loads(SLIDING_BENCH, "slid.toml", [f"accuracy.tolerance={tolerance}"]))
        for tolerance in TOLERANCES
    }


def test_always_micro_slip_loop_agrees_with_independent_program(results_by_tolerance):
    """The loop area agrees with an independent program. A mesh that was not refined at the slip
    zone gave 4.25e-9 +- 1.0e-9 J at the default tolerance."""
    for tolerance, result in results_by_tolerance.items():
        loop = result.measures["loop_area"]
        assert abs(loop.value - REFERENCE_LOOP) <= loop.error + 0.01 * REFERENCE_LOOP, tolerance
        assert loop.error <= 0.1 * REFERENCE_LOOP, tolerance


def test_always_static_measures_agree_with_static_patch(results_by_tolerance):
    """The static measures of a bench agree with those of the static patch within the sum of their errors, and meet the
    tolerance, although its mesh has shorter cells in the zones of slip."""
    at_rest = pf.run(loads(CROWNED, "at rest.toml")).measures
    sliding = results_by_tolerance["1e-3"].measures
    for name in ("tangential_stiffness", "normal_stiffness", "pressure_peak", "approach"):
        error = at_rest[name].error + sliding[name].error
        assert abs(sliding[name].value - at_rest[name].value) <= error, name
        assert sliding[name].error_ratio(1e-3) <= 1, name


def test_exact_static_measures_of_bench_without_zones_of_slip_are_those_of_static_patch():
    """The mesh of a bench whose pieces do not slip part by part is that of the static patch, and so are its measures."""
    at_rest = pf.run(loads(CROWNED, "at rest.toml")).measures
    bench = pf.run(loads(SLIDING_BENCH.replace("[contact.shear]", ""), "rigid.toml")).measures
    assert len(at_rest) > 10
    for name, measure in at_rest.items():
        assert bench[name].value == pytest.approx(measure.value, rel=1e-12), name
        assert bench[name].error == pytest.approx(measure.error, rel=1e-9), name


def test_stuck_flat_joint_has_no_loop_area():
    """Below the first yield of a flat joint nothing slips: the loop area is zero, and the mesh is
    not refined at a slip zone."""
    flat = re.sub(r"\[contact.crown\]\nradius.*\n", "", SLIDING_BENCH)
    result = pf.run(loads(flat, "flat.toml"))
    assert result.measures["loop_area"].value == pytest.approx(0.0, abs=1e-18)
    assert result.measures["equivalent_stiffness"].value == pytest.approx(
        result.measures["tangential_stiffness"].value, rel=1e-3
    )


def test_status_agrees_with_traction_and_slip():
    """Under Coulomb friction a node slips where its traction is at the limit, up to both ends of the zones of slip,
    and its slip changes only there, from the first frame on."""
    scene = SLIDING_BENCH.replace("7.8188e-08", "6e-07").replace("cycles = 2", "cycles = 1")
    fields = pf.run(loads(scene, "slid.toml")).fields
    loaded = fields["normal_stress"] > 0
    at_limit = np.abs(fields["shear_stress"]) > 0.359 * (1 - 1e-9) * fields["normal_stress"]
    slips = fields["status"] == 2
    change = np.abs(np.diff(fields["slip"], axis=0, prepend=0.0))
    assert 0 < slips[1].sum() < slips.max(axis=0).sum() < loaded[0].sum()
    np.testing.assert_array_equal(slips, at_limit & loaded)
    np.testing.assert_array_equal(slips, (change > 1e-6 * change.max()) & loaded)


@pytest.mark.parametrize(
    "law, amplitude, tolerance",
    [("elastic-plastic", 0, 1e-15), ("elastic-plastic", 1e-6, 1e-8), ("nonlocal", 0, 1e-8)],
)
def test_slip_is_slide_less_stretch_of_bonds_and_pieces(law, amplitude, tolerance):
    """The slip of a node is the slide less the stretch of its bonds and the elastic displacement under all tractions,
    without grooves and over low ones."""
    scene = SLIDING_BENCH.replace("7.8188e-08", "2e-06").replace("cycles = 2", "cycles = 1")
    scene = scene.replace('"coulomb"', f'"{law}"\nbond_length = "0.1 um"')
    if amplitude:
        scene += f'[contact.grooves]\nwavelength = "80 um"\namplitude = "{amplitude} um"\n'
    result = pf.run(scene)
    patch, fields = result.patch, result.fields
    traction, pressure = fields["shear_stress"], fields["normal_stress"]
    loaded = pressure > 0
    stretch = 1e-7 * traction / np.where(loaded, 0.359 * pressure, 1.0)
    bend = (traction * patch.pieces.interface.weight) @ patch.slip_compliance.T
    slip = fields["holder_slide"][:, None] - stretch - bend
    np.testing.assert_allclose(fields["slip"][loaded], slip[loaded], rtol=0, atol=tolerance)
    assert np.abs(slip[loaded]).max() > 1e-6


def test_status_of_first_frame_in_rig_agrees_with_traction():
    """The first frame of a motion after earlier cycles has no slip to compare with: a node slips whose traction is at the
    limit."""
    scene = COATED + '[contact.crown]\nradius = "1 m"\n' + SHEAR + COULOMB + MODE + DRIVE
    fields = pf.run(scene, **{"drive.acceleration": "2 g", "accuracy.tolerance": 1e-2}).fields
    traction, pressure, status = (
        fields[name][1] for name in ("shear_stress", "normal_stress", "status")
    )
    at_limit = (np.abs(traction) > 0.3 * (1 - 1e-9) * pressure) & (pressure > 0)
    np.testing.assert_array_equal(status == 2, at_limit)
    assert 0 < at_limit.sum() < (pressure > 0).sum()
