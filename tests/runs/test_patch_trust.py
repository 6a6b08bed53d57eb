"""Errors and missing values of a static patch: unbounded pressures have no value, and errors cover
a reference."""

from __future__ import annotations

import pytest
from scene_texts import COATING, PIECE

import patchfem as pf
from patchfem.export.runs import make_quantities

RIG = PIECE + 'load = "26 lbf"\nsubstrate = "Ti-8Al-1Mo-1V"\n' + COATING
STEP = RIG + '[contact.step]\nheight = "0.1 um"\nat = "2 mm"\n'
# Contact fraction, peak pressure [Pa], normal and tangential stiffness [N/m] of an independent
# program with elements of order 5.
TILTED = {
    "0.1 mrad": (0.2193469, 8317717.0, 5.349995e8, 2.289488e8),
    "1 mrad": (0.02391931, 60.84458e6, 1.698824e8, 1.196733e8),
    "10 mrad": (0.001675519, 792.5162e6, 9.617997e7, 8.402835e7),
}
MAIN_MEASURES = ("contact_fraction", "pressure_peak", "normal_stiffness", "tangential_stiffness")


def test_always_peak_at_loaded_step_has_no_value():
    """The pressure under a sharp corner is unbounded: the result and its summary have no value and
    give the reason."""
    result = pf.run(STEP)
    peak = result.measures["pressure_peak"]
    assert peak.value is None
    assert "edge of the step" in peak.reason
    assert result.measures["normal_stiffness"].value > 0
    entry = make_quantities(result.measures)["pressure_peak"].as_json()
    assert entry["value"] is None and "edge of the step" in entry["reason"]


def test_always_peak_at_step_behind_skin_has_value():
    """A compliant skin limits the pressure at the edge of the same step, so that the peak has a value and an error."""
    skin = '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\n'
    result = pf.run(STEP + skin)
    assert result.measures["pressure_peak"].value > 0
    assert result.measures["pressure_peak"].error is not None


@pytest.mark.share(0)
@pytest.mark.parametrize("angle", TILTED)
def test_always_errors_of_tilted_patch_cover_independent_program(angle):
    """The errors of the automatic mesh of a tilted patch cover the results of an independent
    program."""
    measures = pf.run(RIG + f'[contact.tilt]\nangle = "{angle}"\n').measures
    for name, reference in zip(MAIN_MEASURES, TILTED[angle]):
        assert abs(measures[name].value - reference) <= measures[name].error + 2e-6 * reference, (
            name,
            measures[name],
        )
