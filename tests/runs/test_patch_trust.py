"""What a static patch says of its own numbers: none where none is bounded, bars that hold, remedies that cure."""

from __future__ import annotations

import pytest
from scene_texts import COATING, PIECE

import patchfem as pf
from patchfem.export import summarise_run

RIG = PIECE + 'load = "26 lbf"\nsubstrate = "Ti-8Al-1Mo-1V"\n' + COATING
STEP = RIG + '[contact.step]\nheight = "0.1 um"\nat = "2 mm"\n'
# fraction, peak [Pa], normal and tangential stiffness [N/m]: elements of order 5, a program of its own
TILTED = {
    "0.1 mrad": (0.2193469, 8317717.0, 5.349995e8, 2.289488e8),
    "1 mrad": (0.02391931, 60.84458e6, 1.698824e8, 1.196733e8),
    "10 mrad": (0.001675519, 792.5162e6, 9.617997e7, 8.402835e7),
}
DECISIVE = ("contact_fraction", "pressure_peak", "normal_stiffness", "tangential_stiffness")


def test_always_null_beside_a_step_that_bears():
    """A punch with a sharp corner has no largest pressure: null with the reason, in the result and in its summary."""
    found = pf.run(STEP)
    peak = found.measures["pressure_peak"]
    assert peak.value is None
    assert "edge of the step" in peak.reason
    assert found.measures["normal_stiffness"].value > 0
    written = summarise_run(found)["measures"]["pressure_peak"]
    assert written["value"] is None and "edge of the step" in written["reason"]


def test_always_a_number_behind_a_skin():
    """A skin yields at its peaks, so the same step leaves a largest pressure."""
    skin = '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e13 Pa/m"\n'
    found = pf.run(STEP + skin)
    assert found.measures["pressure_peak"].value > 0
    assert found.measures["pressure_peak"].error is not None


@pytest.mark.share(0)
@pytest.mark.parametrize("angle", TILTED)
def test_bars_of_a_tilted_rig_patch_hold_an_independent_program(angle):
    """The patch that a motion takes, on its own chosen mesh."""
    found = pf.run(RIG + f'[contact.tilt]\nangle = "{angle}"\n').measures
    for name, truth in zip(DECISIVE, TILTED[angle]):
        assert abs(found[name].value - truth) <= found[name].error + 2e-6 * truth, (
            name,
            found[name],
        )
