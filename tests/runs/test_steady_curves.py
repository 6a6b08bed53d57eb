"""Frequency response curves by the engine `harmonic`: values and errors at every point."""

import re

import numpy as np
import pytest
from scene_runs import find_sentences
from scene_texts import COULOMB, MODE, PLASTIC, POINT, SWEEP

import patchfem as pf
from patchfem.runs.rig.steady import shooting
from patchfem.runs.rig.steady.curves import COLUMN_MEASURES

STEADY = {"accuracy.method": "harmonic"}
STRONG_SWEEP = SWEEP.replace('"3 g"', '"6 g"').replace('"120 Hz"', '"138 Hz"')
G, LIMIT = 9.80665, 0.3 * 26 * 4.4482216152605
SOFT_ELEMENT = PLASTIC.replace("1 um", "20 um")


@pytest.fixture
def reduced_point_count(monkeypatch):
    """Compute curves with 13 points, refined only where they bend."""
    monkeypatch.setattr(shooting, "N_SWEEP_POINTS", 13)


@pytest.mark.share(1)
@pytest.mark.usefixtures("reduced_point_count")
@pytest.mark.parametrize("law", [COULOMB, SOFT_ELEMENT], ids=["coulomb", "elastic-plastic"])
def test_exact_point_of_curve_agrees_with_sine_run(law):
    """The first, the middle and the last point of a curve agree with runs under a sine of the same frequency."""
    curve = pf.run(POINT + law + MODE + STRONG_SWEEP, **STEADY).motion.steady.curve
    drive = '[drive]\nkind = "base"\nfrequency = "{!r} Hz"\nacceleration = "6 g"\ncycles = 10\n'
    for k in (0, len(curve["level"]) // 2, -1):
        run = pf.run(POINT + law + MODE + drive.format(float(curve["frequency"][k])), **STEADY)
        for column, name in COLUMN_MEASURES.items():
            assert curve[column][k] == pytest.approx(run.measures[name].value, rel=1e-8), (
                k,
                column,
            )


@pytest.mark.parametrize("frequency", ["407.7 Hz", "408.125 Hz"])
def test_exact_damper_that_hardly_slips_has_periodic_motion(frequency):
    """The shipped damper under ten times its load, near resonance, has the amplitude of a long run."""
    sine = f'frequency = "{frequency}"\ncycles = 3000\n'
    text = re.sub('waveform = "sweep"\nfrom .*\nto .*\nrate .*\n', sine, pf.new("damper"))
    scene = pf.load(text, **{"structure.interface[1].load": "10 kN"})
    found = {}
    for method in ("harmonic", "auto"):
        run = pf.run(scene, **{"accuracy.method": method})
        found[method] = run.measures["relative_displacement_amplitude"]
        assert run.measures["friction_force_peak"].value == pytest.approx(3e3, rel=1e-6)
    assert found["harmonic"].value == pytest.approx(found["auto"].value, rel=1e-7)


INTERLOCK = (
    POINT
    + '[friction]\nlaw = "elastic-plastic"\nstatic = 0.05\nbond_length = "20 um"\n'
    + MODE
    + '[structure.bonded]\nstiffness = "3e6 N/m"\nwavelength = "80 um"\n'
)
SINE = '[drive]\nkind = "base"\nfrequency = "{} Hz"\nacceleration = "5 g"\ncycles = {}\n'


def test_always_unstable_steady_state_is_not_converged():
    """At 200 Hz the only steady state is unstable, and a march does not settle; the outcome is
    not_converged."""
    result = pf.run(INTERLOCK + SINE.format(200, 10), **STEADY, **{"accuracy.tolerance": 1e-2})
    assert result.outcome == "not_converged" and "unstable" in result.motion.steady.regime
    assert any("is unstable" in warning and "march" in warning for warning in result.warnings)


def test_exact_number_of_steady_motions_is_stated():
    """With an interlock of 80 um three steady motions exist at 180 Hz; a warning says how many are stable."""
    steady = pf.run(INTERLOCK + SINE.format(180, 10), **STEADY)
    assert steady.outcome == "steady" and np.abs(steady.motion.steady.multipliers).max() < 1
    (sentence,) = find_sentences([*steady.warnings, *steady.notes], "3 steady motions exist")
    assert "1 of them stable" in sentence
