"""Curves of steady motions and levels of a drive by the engine `harmonic`: what they show at every point, with bars."""

import numpy as np
import pytest
from scene_texts import COATED, COULOMB, MODE, PLASTIC, POINT, SECOND, SHEAR, SWEEP

import patchfem as pf
from patchfem.response import LEVEL_MEASURES
from patchfem.runs.rig.steady import curves
from patchfem.runs.rig.steady.curves import COLUMN_MEASURES

STEADY = {"accuracy.method": "harmonic"}
HARD = SWEEP.replace('"3 g"', '"6 g"').replace('"120 Hz"', '"138 Hz"')
LEVELS = '[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\nlevels = [{}]\ncycles = {}\n'
G, LIMIT = 9.80665, 0.3 * 26 * 4.4482216152605
GIVES = PLASTIC.replace("1 um", "20 um")


def curve_of(text, **keys):
    return pf.run(text, **STEADY, **keys).extra["curve"]


def linear(frequency, rows=(1.0,), own=(143.0,), zeta=(0.003,), base=(1.0,), level=3 * G):
    """Amplitude [m] and absolute acceleration [m s-2] of the sum `rows` of the motions of modes without friction."""
    w = 2 * np.pi * np.asarray(frequency)[:, None]
    own = 2 * np.pi * np.array(own)
    z = -level * np.array(base) / (own**2 - w**2 + 2j * np.array(zeta) * own * w)
    return np.abs(z @ rows), np.abs(level - w[:, 0] ** 2 * (z @ rows))


@pytest.fixture
def few(monkeypatch):
    """Curves of 13 points, but where they bend."""
    monkeypatch.setattr(curves, "N_SWEEP_POINTS", 13)


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("more", ["", SECOND.replace("slide = 0.1", "slide = 0.1\nbase = 0.1")])
def test_exact_a_curve_without_friction_in_closed_form(more):
    base = {"structure.mode.axial.base": "0.9"} if more else {}
    found = curve_of(MODE + more + SWEEP.replace('to = "150 Hz"', 'to = "126 Hz"'), **base)
    given = (
        {"rows": (1.0, 0.0), "own": (143.0, 990.0), "zeta": (0.003, 0.01), "base": (0.9, 0.1)}
        if more
        else {}
    )
    size, felt = linear(found["frequency"], **given)
    assert found["amplitude"] == pytest.approx(size, rel=1e-8)
    assert found["acceleration_peak"] == pytest.approx(felt, rel=1e-8)
    assert found["acceleration_fundamental"] == pytest.approx(felt, rel=1e-8)
    assert np.all(found["acceleration_distortion"] <= found["acceleration_distortion_error"])


@pytest.mark.share(1)
@pytest.mark.usefixtures("few")
@pytest.mark.parametrize("law", [COULOMB, GIVES], ids=["coulomb", "elastic-plastic"])
def test_exact_a_point_of_a_curve_is_the_run_at_its_sine(law):
    found = curve_of(POINT + law + MODE + HARD)
    drive = '[drive]\nkind = "base"\nfrequency = "{!r} Hz"\nacceleration = "6 g"\ncycles = 10\n'
    for k in (0, len(found["level"]) // 2, -1):
        run = pf.run(POINT + law + MODE + drive.format(float(found["frequency"][k])), **STEADY)
        for column, name in COLUMN_MEASURES.items():
            assert found[column][k] == pytest.approx(run.measures[name].value, rel=1e-9), (
                k,
                column,
            )


@pytest.mark.share(1)
@pytest.mark.parametrize("law", [COULOMB, PLASTIC], ids=["coulomb", "elastic-plastic"])
def test_exact_levels_are_those_of_a_long_run(law):
    """Raised from a stuck level and lowered again: every measure of the table as an exact run of 150 cycles a level."""
    text = (
        POINT
        + law
        + MODE.replace("0.003", "0.05")
        + LEVELS.format('"3 g", "5 g", "7 g", "5 g"', 150)
    )
    steady = pf.run(text, **STEADY)
    run = pf.run(text, **{"accuracy.method": "exact"})
    ours = steady.extra["levels"]
    theirs = run.extra["levels"]
    assert [one.outcome for one in ours] == ["stuck", "steady", "steady", "steady"]
    assert (
        [one.drive for one in ours]
        == [one.drive for one in theirs]
        == pytest.approx(G * np.array([3, 5, 7, 5]))
    )
    assert [one.stuck for one in ours] == [one.stuck for one in theirs]
    round_off = {"equivalent_damping": 1e-14, "loop_area": 1e-18}
    for a, b in zip(ours, theirs):
        assert (
            set(a.errors)
            == set(a.values)
            <= set(b.values)
            <= {*a.values, "secant_stiffness"} & {*LEVEL_MEASURES}
        )
        for name, value in a.values.items():
            assert value == pytest.approx(
                b.values[name], rel=1e-8, abs=round_off.get(name, 1e-12)
            ), (b.drive, name)
    # the motion at a level is the only one
    assert abs(steady.measures["level_hysteresis"].value) < 1e-12


def test_exact_the_onset_of_slip_of_an_element_in_closed_form():
    """It slips where its spring bears the limit: |q| = limit/k in the motion that it holds as a spring; what counts is
    a slip of 1e-3 bond lengths."""
    text = POINT + GIVES + MODE + LEVELS.format('"0.2 g", "6 g"', 12) + 'onset = "slip"\n'
    found = pf.run(text, **STEADY).measures["onset_level"]
    own = 2 * np.pi * 143
    w = 2 * np.pi * 143
    stiffness = LIMIT / 20e-6
    size = 1 / abs(own**2 + stiffness / 0.884 - w**2 + 2j * 0.003 * own * w)
    first = 20e-6 / size
    assert first - found.error <= found.value <= 1.002 * first + found.error
    assert found.error < 1e-3 * first


def test_exact_a_level_without_a_bounded_motion_has_the_outcome_grows():
    """Without damping at resonance friction bounds the motion to a/mu N < 4/pi and not beyond."""
    text = POINT + COULOMB + MODE.replace("0.003", "0") + LEVELS.format('"3 g", "4.5 g", "6 g"', 12)
    run = pf.run(text, **STEADY)
    assert [one.outcome for one in run.extra["levels"]] == ["stuck", "steady", "grows"]
    assert run.outcome == "steady" and np.isnan(run.extra["curve"]["amplitude"][2])
    with_elements = pf.run(text.replace(COULOMB, PLASTIC), **STEADY)
    assert [one.outcome for one in with_elements.extra["levels"]] == [
        "stuck",
        "steady",
        "not_converged",
    ]
    assert any(
        "1 of 3 drive levels" in said and "undamped mode" in said for said in with_elements.warnings
    )


LOCKED = (
    POINT
    + '[friction]\nlaw = "elastic-plastic"\nstatic = 0.05\nbond_length = "20 um"\n'
    + MODE
    + '[structure.bonded]\nstiffness = "3e6 N/m"\nwavelength = "80 um"\n'
)
SINE = '[drive]\nkind = "base"\nfrequency = "{} Hz"\nacceleration = "5 g"\ncycles = {}\n'


def test_exact_of_several_balanced_motions_the_stable_one_is_shown():
    """Beside an interlock of 80 um three motions balance at 180 Hz, 58, 83 and 125 um, and the balance comes to the
    second one, whose disturbances grow eightfold a cycle. A march from rest comes to the third, the only one that
    lasts."""
    steady = pf.run(LOCKED + SINE.format(180, 10), **STEADY)
    march = pf.run(LOCKED + SINE.format(180, 400), **{"accuracy.method": "march"})
    assert steady.outcome == march.outcome == "steady"
    assert np.abs(steady.extra["multipliers"]).max() < 1
    assert any(
        "3 steady motions exist" in said and "1 of them stable" in said for said in steady.warnings
    )
    for name in ("relative_displacement_amplitude", "absolute_acceleration_peak", "loop_area"):
        ours = steady.measures[name]
        theirs = march.measures[name]
        assert abs(ours.value - theirs.value) <= ours.error + theirs.error, name


def test_always_a_balanced_motion_is_not_steady_where_none_lasts():
    """At 200 Hz the one motion that balances is left, and a march does not settle."""
    found = pf.run(LOCKED + SINE.format(200, 10), **STEADY)
    assert found.outcome == "not_converged" and "unstable" in found.extra["regime"]
    assert any("is unstable" in said and "march" in said for said in found.warnings)
    levels = pf.run(
        LOCKED + LEVELS.format('"2 g", "5 g"', 12).replace("143 Hz", "200 Hz"), **STEADY
    )
    assert [one.outcome for one in levels.extra["levels"]] == ["stuck", "not_converged"]
    assert levels.outcome == "stuck" and any(
        "1 of 2 drive levels" in said for said in levels.warnings
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
def test_exact_coulomb_behind_shear_balances_beside_a_spring_that_bends(spring):
    """Behind the shear of the pieces Coulomb's law is a set of springs that slip: a march ends in the balance."""
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
        ours = steady.measures[name]
        theirs = march.measures[name]
        assert abs(ours.value - theirs.value) <= ours.error + theirs.error < 0.1 * ours.value, name
