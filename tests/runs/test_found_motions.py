"""Motions whose outcome, window or bar was false: against independent programs and what the words mean."""

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
TRUE = (  # scene, measure, truth: DOP853 from reversal to reversal at 3e-14, or a march of 4000 steps a cycle
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
def once(name: str):
    return pf.run(load(FOUND / f"{name}.toml"))


@pytest.mark.share(*range(2, len(TRUE)))  # Bouc and Wen: a loop to compile for these alone
@pytest.mark.parametrize(("name", "measure", "truth", "digit"), TRUE)
def test_exact_the_bar_holds_an_independent_program(name, measure, truth, digit):
    found = once(name).measures[measure]
    assert abs(found.value - truth) <= found.error + digit
    assert found.error <= (2 / 128 if measure == "stick_fraction" else 1e-2 * truth)


def test_always_a_motion_that_nothing_bounds_has_no_steady_amplitude():
    result = pf.run(load(FOUND / "harmonic_unbounded.toml"))
    assert result.outcome is Outcome.GROWS
    assert all(one.error is None for one in result.measures.values())
    assert {name for name, one in result.measures.items() if one.value is not None} == {
        "normal_load"
    }
    assert "no bounded motion" in result.measures["relative_displacement_amplitude"].reason
    assert not any("estimated error" in text for text in result.warnings)


def test_always_what_slides_for_ever_under_a_step_has_no_bar():
    drive = 'kind = "force"\nwaveform = "step"\nforce = "5 N"\ncycles = 40'
    result = pf.run(
        load(
            RIG.format(
                law='law = "elastic-plastic"\nbond_length = "1 um"',
                frequency=0,
                method="",
                drive=drive,
            )
        )
    )
    assert result.outcome is Outcome.GROWS
    assert all(one.error is None for one in result.measures.values())


@pytest.mark.parametrize(
    ("drift", "outcome"),
    [
        (0.0, Outcome.STEADY),
        (0.9e-11, Outcome.STEADY),
        (-6e-9, Outcome.TRANSIENT),
        (3.1e-11, Outcome.TRANSIENT),
    ],
)
@pytest.mark.parametrize("sine", [True, False])
def test_always_a_motion_that_drifts_is_not_steady(drift, outcome, sine):
    """The amplitude of 18.6 nm stays; a drift of the tolerance, 1e-3 of it, and of the floor of 1e-11 m is none."""
    sizes = np.full(6, 18.6e-9)
    measures = {
        "relative_displacement_amplitude": Measure(18.6e-9, "m", 1e-12, 1e-10),
        "drift_per_cycle": Measure(drift, "m", 1e-13, 1e-11),
    }
    drive = (
        SineDrive(1e-3, 1e3)
        if sine
        else SimpleNamespace(
            segments=(SimpleNamespace(amplitude=0.0, constant=0.0),), period=1e-3, acceleration=1e-3
        )
    )
    raw = SimpleNamespace(
        outcome=None,
        window=SimpleNamespace(time=np.linspace(0, 6e-3, 7)),
        amplitudes=sizes,
        extremes=None,
        steady=(None, None),
        bounded=False,
    )
    assert settling.classify(sizes, 1e-3) is Outcome.STEADY
    if not sine:
        drive = pf.build(
            load(
                RIG.format(
                    law='law = "coulomb"',
                    frequency=143,
                    method="",
                    drive='kind = "free"\ndisplacement = "1 mm"\ncycles = 9',
                )
            )
        ).rig.drive.signal
    assert judge_outcome(raw, measures, 1e-3, drive)[0] is outcome


@pytest.mark.parametrize(("level", "said"), [("0.2 g", True), ("40 g", False)])
def test_always_a_joint_that_never_slips_as_a_whole_has_more_than_one_steady_motion(level, said):
    """Its held part keeps the mean force of its past: from a push of 2 um aside the march keeps one that is not 0."""
    law = 'law = "iwan"\nstiffness = "1e7 N/m"\nchi = -0.5\nbeta = 0.5'
    drive = f'kind = "base"\nfrequency = "120 Hz"\nacceleration = "{level}"\ncycles = 20'
    text = RIG.format(law=law, frequency=120, drive=drive, method='method = "harmonic"')
    found = pf.run(load(text.replace('load = "10 N"', 'load = "100 N"')))
    assert any("the steady motion is therefore not unique" in note for note in found.notes) == said


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("stop", "outcome"), [('travel = "5 mm"\n', "exceeds_travel"), ("", "grows")]
)
def test_always_a_step_beyond_the_barrier_of_a_softening_spring_ends_the_run_before_it(
    stop, outcome
):
    """Its force over a step is cubic in what the step moves: one across the barrier ended at 1e160 m."""
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
