"""Motions whose outcome, window or error was wrong in an earlier version agree with independent
programs."""

from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import patchfem as pf
from patchfem import load
from patchfem.core import Measure, Outcome, SineDrive
from patchfem.response import judge_outcome, settling

FOUND = Path(__file__).parent / "found"
# Scene, measure, reference and its uncertainty; the references are from DOP853 between reversals
# (tolerance 3e-14) or from a march of 4000 steps per cycle.
REFERENCES = (
    ("peak_bouc_wen_53", "friction_force_peak", 20.594500409, 3e-8),
    ("peak_bouc_wen_53", "absolute_acceleration_peak", 217.5187442529, 1e-8),
    ("tanh_levels_114", "absolute_acceleration_peak", 664.244, 9e-3),
    ("shear_bonds_14", "stick_fraction", 0.00377, 1.4e-3),
    ("ep_stiff_1e6", "relative_displacement_amplitude", 0.7365597, 1e-7),
)
RIG = """
[normal]
load = "10 N"
[friction]
{law}
static = 0.3
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "one"
frequency = "{frequency} Hz"
damping = 0.01
slide = 1.0
[drive]
{drive}
[accuracy]
tolerance = 1e-2
{method}
"""


@cache
def run_scene(name: str):
    """Return the result of a scene of the folder `found`, computed once."""
    return pf.run(load(FOUND / f"{name}.toml"))


# The Bouc-Wen scenes would compile a loop that no other test needs.
@pytest.mark.share(*range(2, len(REFERENCES)))
@pytest.mark.parametrize(("name", "measure", "reference", "round_off"), REFERENCES)
def test_exact_measure_agrees_with_independent_program(name, measure, reference, round_off):
    """A measure agrees with an independent program within its error, which meets the tolerance."""
    result = run_scene(name).measures[measure]
    assert abs(result.value - reference) <= result.error + round_off
    assert result.error <= (2 / 128 if measure == "stick_fraction" else 1e-2 * reference)


def test_always_unbounded_motion_has_no_steady_amplitude():
    """A rig whose motion is unbounded grows: it has no measures except for the normal load, and each gives a reason."""
    result = pf.run(load(FOUND / "harmonic_unbounded.toml"))
    assert result.outcome is Outcome.GROWS
    assert all(measure.error is None for measure in result.measures.values())
    assert {name for name, measure in result.measures.items() if measure.value is not None} == {
        "normal_load"
    }
    assert "no bounded motion" in result.measures["relative_displacement_amplitude"].reason
    assert not any("estimated error" in text for text in result.warnings)


@pytest.mark.parametrize(
    ("drift", "outcome"),
    [
        (0.0, Outcome.STEADY),
        (0.9e-11, Outcome.STEADY),
        (-6e-9, Outcome.TRANSIENT),
        (3.1e-11, Outcome.TRANSIENT),
    ],
)
def test_always_drifting_motion_is_not_steady(drift, outcome):
    """A motion with a constant amplitude of 18.6 nm is steady only if its drift per cycle is below
    the tolerance (1e-3 of the amplitude) and the floor of 1e-11 m."""
    amplitudes = np.full(6, 18.6e-9)
    measures = {
        "relative_displacement_amplitude": Measure(18.6e-9, "m", 1e-12, 1e-10),
        "drift_per_cycle": Measure(drift, "m", 1e-13, 1e-11),
    }
    response = SimpleNamespace(
        outcome=None,
        window=SimpleNamespace(time=np.linspace(0, 6e-3, 7)),
        amplitudes=amplitudes,
        extremes=None,
        steady=(None, None),
        bounded=False,
    )
    assert settling.classify(amplitudes, 1e-3) is Outcome.STEADY
    assert judge_outcome(response, measures, 1e-3, SineDrive(1e-3, 1e3))[0] is outcome


@pytest.mark.parametrize(("level", "has_note"), [("0.2 g", True), ("40 g", False)])
def test_always_partial_slip_gives_note_about_uniqueness(level, has_note):
    """A joint that never slips completely has several steady states, because its stuck part keeps
    the mean force of its history; a note says so."""
    law = 'law = "iwan"\nstiffness = "1e7 N/m"\nchi = -0.5\nbeta = 0.5'
    drive = f'kind = "base"\nfrequency = "120 Hz"\nacceleration = "{level}"\ncycles = 20'
    text = RIG.format(law=law, frequency=120, drive=drive, method='method = "harmonic"')
    result = pf.run(load(text.replace('load = "10 N"', 'load = "100 N"')))
    assert (
        any("the steady motion is therefore not unique" in note for note in result.notes)
        == has_note
    )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("stop", "outcome"), [('travel = "5 mm"\n', "exceeds_travel"), ("", "grows")]
)
def test_always_softening_spring_ends_run_at_potential_barrier(stop, outcome):
    """A run ends before a step crosses the potential barrier of a softening spring; the cubic force
    beyond it led to 1e160 m."""
    text = RIG.format(
        law='law = "coulomb"',
        frequency=143.0,
        method="",
        drive='kind = "base"\nfrequency = "143 Hz"\nacceleration = "60 g"\ncycles = 20',
    )
    text = (
        text.replace("[structure]\n", f"[structure]\n{stop}")
        + '[structure.stiffening]\ncubic = "-1e14 N/m^3"\n'
    )
    result = pf.run(load(text))
    assert result.outcome.value == outcome
    assert result.measures["relative_displacement_amplitude"].value < 0.05
    assert any("softening spring" in text for text in result.warnings)
