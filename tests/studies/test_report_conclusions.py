"""The ten conclusions of the report: figures of the study against closed forms."""

import numpy as np
import pytest
from study_module import make_study_fixture

import patchfem as pf

conclusions = make_study_fixture("report/conclusions.py")


def test_exact_slip_phases_and_jump_of_the_block(conclusions):
    """Slip from 42.69 to 164.09 degrees, a jump of 0.704 and the knee at 1.2792 agree with closed forms."""
    assert conclusions.phases(4.14 / 0.82802 * 1.0) == pytest.approx((42.69, 164.09), abs=0.02)
    assert conclusions.jump() == pytest.approx(
        0.7039, abs=0.02
    ) and conclusions.knee() / 4.14 == pytest.approx(1.2792, abs=1e-3)


def test_exact_lag_of_the_first_harmonic(conclusions):
    """The lag stated in conclusion 8 is that of the Fourier integral over the last cycle.

    A positive lag means that the block is behind the input.
    """
    window = conclusions.block(5.0)[0].window
    last = window.time >= window.time[-1] - 1 / 143 - 1e-12
    rotation = np.exp(-2j * np.pi * 143 * window.time[last])
    ratio = np.trapezoid(window.acceleration[last] * rotation, window.time[last]) / np.trapezoid(
        window.base_acceleration[last] * rotation, window.time[last]
    )
    assert f"lags by {-np.degrees(np.angle(ratio)):.0f} degrees" in conclusions.eighth().found


def test_always_inexpensive_conclusions_have_computed_figures(conclusions):
    """The inexpensive rows of reproduced.md and figures of the answer have the computed values."""
    text = (conclusions.FOLDER / "reproduced.md").read_text("utf-8")
    for conclusion in (
        conclusions.first,
        conclusions.fourth,
        conclusions.sixth,
        conclusions.seventh,
        conclusions.ninth,
    ):
        result = conclusion()
        assert f"| conclusion {result.number} | {result.claim} | {result.found} |" in text
    assert (
        f"begins {90 - conclusions.phases(5.0)[0]:.0f} degrees before the input's maximum"
        in conclusions.ANSWER
    )
    value = conclusions.block(8.0)[1]["relative_displacement_amplitude"]
    assert f"to {value / conclusions.MIL:.0f} mil" in conclusions.ANSWER
    omega = 2 * np.pi * 143
    force = 4 / np.pi * 4.14 * conclusions.G
    # friction as a square wave
    assert value == pytest.approx((8 * conclusions.G - force) / (2 * 0.003 * omega**2), rel=1e-3)


@pytest.mark.slow
def test_all_conclusions_have_computed_figures(conclusions):
    """Six of the ten conclusions hold fully."""
    results = conclusions.main()
    assert [conclusion.number for conclusion in results] == list(range(1, 11))
    assert [
        conclusion.number for conclusion in results if conclusion.verdict == conclusions.HOLDS
    ] == [
        1,
        3,
        5,
        7,
        8,
        10,
    ]
    assert conclusions.ANSWER.startswith(
        "Six hold fully (1, 3, 5, 7, 8, 10) and four partly. Conclusion 2:"
    )
    assert conclusions.VERDICT == ""


@pytest.mark.slow
def test_stiffening_flexures_limit_the_block_at_10_mil(conclusions):
    """A cubic stiffness as in conclusion 2 limits the amplitude at 8 g to 254 um within 1 %."""
    text = (conclusions.FOLDER / "block.toml").read_text("utf-8")
    text = text.replace('"coulomb"', '"elastic-plastic"\nbond_length = "0.243 um"')
    push = np.sqrt(8**2 - (4 * 4.14 / np.pi) ** 2) * conclusions.G * 0.8546
    text += f'[structure.stiffening]\ncubic = "{4 / 3 * push / 254e-6**3} N/m^3"\n'
    amplitude = (
        pf.run(text, **{"drive.acceleration": 8 * conclusions.G})
        .measures["relative_displacement_amplitude"]
        .value
    )
    assert amplitude == pytest.approx(254e-6, rel=0.01)
