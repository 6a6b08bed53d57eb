"""Frequency response curves and drive levels by the engine `harmonic`: values and errors at every
point."""

import numpy as np
import pytest
from scene_texts import COATED, COULOMB, MODE, PLASTIC, POINT, SECOND, SHEAR, SWEEP

import patchfem as pf
from patchfem.response import LEVEL_MEASURES
from patchfem.runs.rig.steady import curves
from patchfem.runs.rig.steady.curves import COLUMN_MEASURES

STEADY = {"accuracy.method": "harmonic"}
STRONG_SWEEP = SWEEP.replace('"3 g"', '"6 g"').replace('"120 Hz"', '"138 Hz"')
LEVELS = '[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\nlevels = [{}]\ncycles = {}\n'
G, LIMIT = 9.80665, 0.3 * 26 * 4.4482216152605
SOFT_ELEMENT = PLASTIC.replace("1 um", "20 um")


def run_curve(text, **keys):
    """Return the curve of a scene by the harmonic engine."""
    return pf.run(text, **STEADY, **keys).extra["curve"]


def linear_response(
    frequency, rows=(1.0,), frequencies=(143.0,), zeta=(0.003,), base=(1.0,), level=3 * G
):
    """Return amplitude [m] and absolute acceleration [m/s^2] of the sum `rows` of modes without
    friction."""
    w = 2 * np.pi * np.asarray(frequency)[:, None]
    frequencies = 2 * np.pi * np.array(frequencies)
    z = -level * np.array(base) / (frequencies**2 - w**2 + 2j * np.array(zeta) * frequencies * w)
    return np.abs(z @ rows), np.abs(level - w[:, 0] ** 2 * (z @ rows))


@pytest.fixture
def reduced_point_count(monkeypatch):
    """Compute curves with 13 points, refined only where they bend."""
    monkeypatch.setattr(curves, "N_SWEEP_POINTS", 13)


@pytest.mark.usefixtures("reduced_point_count")
@pytest.mark.parametrize(
    "second_mode", ["", SECOND.replace("slide = 0.1", "slide = 0.1\nbase = 0.1")]
)
def test_exact_curve_without_friction_agrees_with_closed_form(second_mode):
    """Amplitude and acceleration of a curve without friction agree with the closed form within
    1e-8, for one and for two modes."""
    base = {"structure.mode.axial.base": "0.9"} if second_mode else {}
    curve = run_curve(MODE + second_mode + SWEEP.replace('to = "150 Hz"', 'to = "126 Hz"'), **base)
    modes = (
        {
            "rows": (1.0, 0.0),
            "frequencies": (143.0, 990.0),
            "zeta": (0.003, 0.01),
            "base": (0.9, 0.1),
        }
        if second_mode
        else {}
    )
    amplitude, acceleration = linear_response(curve["frequency"], **modes)
    assert curve["amplitude"] == pytest.approx(amplitude, rel=1e-8)
    assert curve["acceleration_peak"] == pytest.approx(acceleration, rel=1e-8)
    assert curve["acceleration_fundamental"] == pytest.approx(acceleration, rel=1e-8)
    assert np.all(curve["acceleration_distortion"] <= curve["acceleration_distortion_error"])


@pytest.mark.share(1)
@pytest.mark.usefixtures("reduced_point_count")
@pytest.mark.parametrize("law", [COULOMB, SOFT_ELEMENT], ids=["coulomb", "elastic-plastic"])
def test_exact_point_of_curve_agrees_with_sine_run(law):
    """The first, the middle and the last point of a curve agree with runs under a sine of the same frequency."""
    curve = run_curve(POINT + law + MODE + STRONG_SWEEP)
    drive = '[drive]\nkind = "base"\nfrequency = "{!r} Hz"\nacceleration = "6 g"\ncycles = 10\n'
    for k in (0, len(curve["level"]) // 2, -1):
        run = pf.run(POINT + law + MODE + drive.format(float(curve["frequency"][k])), **STEADY)
        for column, name in COLUMN_MEASURES.items():
            assert curve[column][k] == pytest.approx(run.measures[name].value, rel=1e-8), (
                k,
                column,
            )


@pytest.mark.share(1)
@pytest.mark.parametrize("law", [COULOMB, PLASTIC], ids=["coulomb", "elastic-plastic"])
def test_exact_levels_agree_with_long_exact_run(law):
    """For levels that rise from stick and fall again, every measure agrees with an exact run of 150
    cycles per level."""
    text = (
        POINT
        + law
        + MODE.replace("0.003", "0.05")
        + LEVELS.format('"3 g", "5 g", "7 g", "5 g"', 150)
    )
    steady = pf.run(text, **STEADY)
    run = pf.run(text, **{"accuracy.method": "exact"})
    steady_levels = steady.extra["levels"]
    run_levels = run.extra["levels"]
    assert [level.outcome for level in steady_levels] == ["stuck", "steady", "steady", "steady"]
    assert (
        [level.drive for level in steady_levels]
        == [level.drive for level in run_levels]
        == pytest.approx(G * np.array([3, 5, 7, 5]))
    )
    assert [level.stuck for level in steady_levels] == [level.stuck for level in run_levels]
    round_off = {"equivalent_damping": 1e-11, "loop_area": 1e-17}
    for a, b in zip(steady_levels, run_levels):
        assert (
            set(a.errors)
            == set(a.values)
            <= set(b.values)
            <= {*a.values, "secant_stiffness"} & {*LEVEL_MEASURES}
        )
        for name, value in a.values.items():
            assert value == pytest.approx(
                b.values[name], rel=1e-8, abs=round_off.get(name, 1e-10)
            ), (b.drive, name)
    # The motion at each level is unique.
    assert abs(steady.measures["level_hysteresis"].value) < 1e-12


def test_exact_onset_of_slip_agrees_with_closed_form():
    """An element slips when its spring reaches the friction limit, |q| = limit/k, in the motion of
    the stuck rig; the onset counts from a slip of 1e-3 bond lengths."""
    text = POINT + SOFT_ELEMENT + MODE + LEVELS.format('"0.2 g", "6 g"', 12) + 'onset = "slip"\n'
    onset = pf.run(text, **STEADY).measures["onset_level"]
    omega = 2 * np.pi * 143
    w = 2 * np.pi * 143
    stiffness = LIMIT / 20e-6
    receptance = 1 / abs(omega**2 + stiffness / 0.884 - w**2 + 2j * 0.003 * omega * w)
    expected = 20e-6 / receptance
    assert expected - onset.error <= onset.value <= 1.002 * expected + onset.error
    assert onset.error < 1e-3 * expected


def test_exact_level_with_unbounded_motion_grows():
    """Without damping, friction bounds the motion at resonance only up to a drive force of 4/pi
    times mu N; levels above it have the outcome grows."""
    text = POINT + COULOMB + MODE.replace("0.003", "0") + LEVELS.format('"3 g", "4.5 g", "6 g"', 12)
    run = pf.run(text, **STEADY)
    assert [level.outcome for level in run.extra["levels"]] == ["stuck", "steady", "grows"]
    assert run.outcome == "steady" and np.isnan(run.extra["curve"]["amplitude"][2])
    with_elements = pf.run(text.replace(COULOMB, PLASTIC), **STEADY)
    outcomes = [level.outcome for level in with_elements.extra["levels"]]
    assert outcomes == ["stuck", "steady", "grows"]


INTERLOCK = (
    POINT
    + '[friction]\nlaw = "elastic-plastic"\nstatic = 0.05\nbond_length = "20 um"\n'
    + MODE
    + '[structure.bonded]\nstiffness = "3e6 N/m"\nwavelength = "80 um"\n'
)
SINE = '[drive]\nkind = "base"\nfrequency = "{} Hz"\nacceleration = "5 g"\ncycles = {}\n'


def test_exact_stable_steady_state_is_chosen_from_several():
    """With an interlock of 80 um, three steady states exist at 180 Hz, with 58, 83 and 125 um. The
    harmonic balance converges to the second, which is unstable; the result is the third, the stable
    one, to which a march from rest also settles."""
    steady = pf.run(INTERLOCK + SINE.format(180, 10), **STEADY)
    march = pf.run(INTERLOCK + SINE.format(180, 400), **{"accuracy.method": "march"})
    assert steady.outcome == march.outcome == "steady"
    assert np.abs(steady.extra["multipliers"]).max() < 1
    assert any(
        "3 steady motions exist" in warning and "1 of them stable" in warning
        for warning in steady.warnings
    )
    for name in ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area"):
        steady_measure = steady.measures[name]
        march_measure = march.measures[name]
        assert (
            abs(steady_measure.value - march_measure.value)
            <= steady_measure.error + march_measure.error
        ), name


def test_always_unstable_steady_state_is_not_converged():
    """At 200 Hz the only steady state is unstable, and a march does not settle; the outcome is
    not_converged."""
    result = pf.run(INTERLOCK + SINE.format(200, 10), **STEADY)
    assert result.outcome == "not_converged" and "unstable" in result.extra["regime"]
    assert any("is unstable" in warning and "march" in warning for warning in result.warnings)
    levels = pf.run(
        INTERLOCK + LEVELS.format('"2 g", "5 g"', 12).replace("143 Hz", "200 Hz"), **STEADY
    )
    assert [level.outcome for level in levels.extra["levels"]] == ["stuck", "not_converged"]
    assert levels.outcome == "stuck" and any(
        "1 of 2 drive levels" in warning for warning in levels.warnings
    )


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "spring",
    [
        '[structure.stiffening]\ncubic = "1e15 N/m^3"\n',
        '[structure.bonded]\nstiffness = "3e6 N/m"\nwavelength = "80 um"\n',
    ],
    ids=["stiffening", "interlock"],
)
def test_exact_sheared_patch_with_nonlinear_spring_agrees_with_march(spring):
    """With [contact.shear], Coulomb's law acts as a set of springs that slip; with a nonlinear
    spring the harmonic balance agrees with a march."""
    text = (
        COATED
        + '[contact.tilt]\nangle = "0.02 mrad"\n'
        + SHEAR
        + COULOMB
        + MODE.replace("0.003", "0.05")
        + spring
    )
    steady = pf.run(text + SINE.format(143, 10), **STEADY)
    march = pf.run(
        text + SINE.format(143, 60),
        **{"accuracy.method": "march", "accuracy.steps_per_cycle": "800"},
    )
    assert steady.outcome == march.outcome == "steady"
    for name in (
        "relative_displacement_amplitude",
        "absolute_acceleration_peak",
        "absolute_acceleration_fundamental",
        "loop_area",
    ):
        steady_measure = steady.measures[name]
        march_measure = march.measures[name]
        assert (
            abs(steady_measure.value - march_measure.value)
            <= steady_measure.error + march_measure.error
            < 0.1 * steady_measure.value
        ), name
