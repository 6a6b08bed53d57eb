"""Backbones of modes with negative, zero and positive damping, for two friction laws, by harmonic balance and decay."""

from functools import cache

import numpy as np
import pytest

import patchfem as pf
from patchfem.campaigns.backbone.curves import compute_backbone
from patchfem.export import backbones, page, store

LAWS = {
    "coulomb": 'law = "coulomb"',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "20 um"',
}
AMPLITUDES = np.geomspace(1e-5, 8e-3, 5)


def make_rig(law: str, damping: float, drive: str = ""):
    """Return the Model of a block of 0.5 kg at 100 Hz with a friction limit of 30 N."""
    drive = drive or 'kind = "base"\nfrequency = "100 Hz"\nacceleration = "1 g"'
    return pf.build(f"""
[normal]
load = "100 N"
[friction]
{LAWS[law]}
static = 0.3
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = {damping}
slide = 1.0
[drive]
{drive}
cycles = 20
""")


def write_page(backbone, law: str, damping: float, folder) -> str:
    """Return the page of a backbone after writing its files into a folder."""
    source = make_rig(law, damping).source
    store.write_answer(backbones.make_backbone_answer(backbone, source), folder)
    return page.write_report(folder).read_text("utf-8")


@cache
def compute_balance(law: str, damping: float):
    """Return the backbone of a rig by harmonic balance; it is stored for several tests."""
    return compute_backbone(make_rig(law, damping), "", AMPLITUDES, ("balance",))


@pytest.mark.share(0)
@pytest.mark.parametrize("law", LAWS)
def test_exact_viscous_damping_adds_to_friction_damping(law):
    """The viscous damping of a single mode adds zeta_s f_0/f to the damping by friction.

    The motion that the backbone describes does not depend on the viscous damping, so the
    frequencies are equal.
    """
    negative, positive = (
        compute_balance(law, damping).curves["balance"] for damping in (-0.011, 0.005)
    )
    assert negative.frequency == pytest.approx(positive.frequency, rel=1e-7)
    expected = positive.damping - 0.016 * 100 / positive.frequency
    assert negative.damping == pytest.approx(expected, abs=1e-7)


@pytest.mark.long
def test_amplitude_of_largest_damping_contains_the_peak_of_a_finer_grid():
    """The interval of this amplitude contains the peak between the grid points; without a peak there is none.

    The loss 4 F (s - h) of a Jenkins element over s^2 is largest at s = 2 h, twice the amplitude of slip.
    """
    model = make_rig("elastic-plastic", 0.0)
    measures = []
    for amplitudes in (np.geomspace(1e-6, 1e-3, n) for n in (6, 31)):
        backbone = compute_backbone(model, "", amplitudes, ("balance",))
        measures.append(backbones.make_backbone_answer(backbone, model.source).quantities)
    coarse, fine = (one["amplitude_of_largest_damping"] for one in measures)
    assert coarse.value != fine.value and coarse.low < fine.low < fine.high < coarse.high
    assert 0 < measures[1]["exponent_gross"].error < 0.01

    falling = compute_backbone(model, "", np.geomspace(3e-4, 1e-3, 3), ("balance",))
    end = backbones.make_backbone_answer(falling, model.source).quantities[
        "amplitude_of_largest_damping"
    ]
    assert end.value == 3e-4 and end.low is None


@pytest.mark.long
@pytest.mark.share(0)
@pytest.mark.parametrize("law", LAWS)
def test_damping_is_zero_at_limit_cycle_of_a_run(law, tmp_path):
    """The amplitude of zero damping agrees with the unstable limit cycle of a run within 1e-4.

    The run without a drive computes the limit cycle from its own equations, without a backbone.
    """
    backbone = compute_balance(law, -0.02)
    free = pf.run(make_rig(law, -0.02, drive='kind = "free"\ndisplacement = "0.1 mm"'))
    assert backbone.flutter == pytest.approx(free.measures["flutter_amplitude"].value, rel=1e-4)
    assert "the mode gains energy" in write_page(backbone, law, -0.02, tmp_path)
