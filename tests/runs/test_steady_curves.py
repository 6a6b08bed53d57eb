"""Frequency response curves by the engine `harmonic`: values and errors at every point."""

import re

import numpy as np
import pytest
from scene_runs import find_sentences
from scene_texts import (
    COATED,
    COULOMB,
    FORCED,
    MODE,
    NONLOCAL,
    PAIR,
    PLASTIC,
    POINT,
    SHEAR,
    SWEEP,
)

import patchfem as pf
from patchfem.core import NotConverged
from patchfem.measures.rows import AMPLITUDE
from patchfem.runs.rig.engines import choose_numerics
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


@pytest.mark.usefixtures("reduced_point_count")
def test_always_multipliers_of_patch_with_partial_slip_are_missing():
    """Of the motion of many elements only some periods are followed, so that no multipliers are known; once they were 0."""
    curve = pf.run(COATED + SHEAR + PLASTIC + MODE + STRONG_SWEEP, **STEADY).motion.steady.curve
    assert np.isfinite(curve["amplitude"]).all() and np.isnan(curve["multiplier"]).all()


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


@pytest.mark.long
def test_always_unstable_steady_state_is_not_converged():
    """At 200 Hz the only steady state is unstable, and a march does not settle; the outcome is
    not_converged."""
    result = pf.run(INTERLOCK + SINE.format(200, 10), **STEADY, **{"accuracy.tolerance": 1e-2})
    assert result.outcome == "not_converged" and "unstable" in result.motion.steady.regime
    assert any("is unstable" in warning and "march" in warning for warning in result.warnings)


@pytest.mark.long
def test_exact_number_of_steady_motions_is_stated():
    """Near 160 Hz a stiffening rig has three steady motions. For the unstable one of them the smallest stable one
    is shown, and a note says how many are stable. If the search for the others fails, it is shown itself."""
    scene = MODE + '[structure.stiffening]\ncubic = "1.4e10 N/m^3"\n' + STRONG_SWEEP
    model = pf.plan(pf.load(scene, **STEADY, **{"drive.to": "240 Hz"})).model
    finder = shooting.ShootingFinder(model, choose_numerics(model), None)
    points = finder.trace_curve(model.rig.drive.signal).points
    unstable = [point for point in points if not point.stable]
    middle = min(unstable, key=lambda point: abs(point.drive.omega - 2 * np.pi * 160))
    found = finder.compute_steady_motion(middle.drive, middle.guess)
    assert found.values[AMPLITUDE] < 0.5 * middle.values[AMPLITUDE]
    assert np.abs(found.steady.data.multipliers).max() < 1
    (sentence,) = find_sentences(found.steady.notes, "3 steady motions exist")
    assert "2 of them stable; the stable motion of smallest amplitude is shown" in sentence

    def fail(drive):
        raise NotConverged("too many steps")

    finder._list_coexisting_motions = fail
    found = finder.compute_steady_motion(middle.drive, middle.guess)
    assert found.run.outcome == "not_converged" and not found.steady.notes
    assert found.values[AMPLITUDE] == pytest.approx(middle.values[AMPLITUDE], rel=1e-6)


def test_exact_regimes_of_laws_with_memory():
    """Bonds and Iwan's law stick at a small level and slide at a large one, and Iwan's elements slip part by part between
    them; a nonlinear spring alone has no friction."""
    iwan = '[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "3e7 N/m"\nchi = -0.3\nbeta = 0.5\n'
    for law, level, regime in (
        (NONLOCAL, "0.001 g", "stuck"),
        (NONLOCAL, "20 g", "slides"),
        (iwan, "0.1 g", "stuck"),
        (iwan, "3 g", "partial slip"),
        (iwan, "20 g", "slides"),
    ):
        scene = POINT + law + MODE + SINE.format(100, 10)
        steady = pf.run(scene, **STEADY, **{"drive.acceleration": level})
        assert steady.motion.steady.regime == regime
    spring = MODE + '[structure.stiffening]\ncubic = "1e6 N/m^3"\n' + SINE.format(100, 10)
    assert pf.run(spring, **STEADY).motion.steady.regime == "no friction"


def test_measures_of_bonds_agree_with_march():
    """The measures under bonds agree within 2e-3 with those of a scene that is integrated in time for 300 cycles at 5 g."""
    scene = POINT + NONLOCAL.replace("1 um", "20 um") + MODE + SINE.format(143, 300)
    keys = {"accuracy.method": "march", "accuracy.steps_per_cycle": 1000}
    march = pf.run(scene, **keys).measures
    steady = pf.run(scene, **STEADY).measures
    for name in (
        AMPLITUDE,
        "absolute_acceleration_peak",
        "friction_force_peak",
        "slip_amplitude",
        "loop_area",
        "equivalent_stiffness",
        "equivalent_damping",
    ):
        assert steady[name].value == pytest.approx(march[name].value, rel=2e-3), name


TANH = 'law = "tanh"\nreference_speed = "5 mm/s"\n'
BOTH_SMOOTH = re.sub('law = "elastic-plastic"\n', TANH, re.sub("bond_length = .*\n", "", PAIR))
COMBINED = {
    "two interfaces": BOTH_SMOOTH + FORCED.replace("cycles = 25", "cycles = 300"),
    "rigid law and spring": POINT
    + COULOMB
    + MODE
    + '[structure.stiffening]\ncubic = "1.4e10 N/m^3"\n'
    + SINE.format(100, 300).replace('"5 g"', '"20 g"'),
}


@pytest.mark.parametrize("name", COMBINED)
def test_exact_motions_of_combined_laws_agree_with_march(name):
    """Interfaces whose laws have no piecewise solution, and Coulomb friction beside a nonlinear spring, have the amplitude
    of a march within the sum of the errors."""
    found = [
        pf.run(COMBINED[name], **{"accuracy.method": method}).measures[AMPLITUDE]
        for method in ("harmonic", "march")
    ]
    assert abs(found[0].value - found[1].value) <= found[0].error + found[1].error
    assert found[0].error < 1e-6 * found[0].value


IWAN_MODES = (
    '[normal]\nload = "100 N"\n[structure]\nmoving_mass = "0.5 kg"\n'
    + "".join(
        f'[[structure.mode]]\nname = "m{k}"\nfrequency = "{frequency} Hz"\ndamping = 0.0086\nslide = {slide}\n'
        + f"output = {slide}\nbase = {slide}\n"
        for k, (frequency, slide) in enumerate(
            ((117, 0.7), (222.3, 0.4), (327.6, 0.35), (432.9, 0.25), (538.2, 0.2))
        )
    )
    + '[friction]\nstatic = 0.339\nlaw = "iwan"\nchi = -0.478\nbeta = 0.932\nstiffness = "36.7 kN/m"\n'
)


@pytest.mark.long
def test_exact_curve_of_iwan_law_with_five_modes_agrees_with_march():
    """The curve has the amplitudes of a march of 300 cycles at its ends and at its peak within the error of the march, which
    is below 3e-5 as its law has fewer cells; all of it is stable, and the motion from which it starts is near the origin:
    corrections to forces beyond the friction limit, which would hold it far away, are refused. After 200 cycles the
    transient of the march is still 1.3e-4."""
    text = IWAN_MODES + SWEEP.replace('"3 g"', '"14 g"').replace('"120 Hz"', '"80 Hz"')
    model = pf.plan(pf.load(text, **STEADY)).model
    finder = shooting.ShootingFinder(model, choose_numerics(model), None)
    points = finder.trace_curve(model.rig.drive.signal).points
    assert all(point.stable for point in points)
    peak = max(points, key=lambda point: point.values[AMPLITUDE])
    for point in (points[0], peak, points[-1]):
        state = point.guess.motion.run.final
        assert np.abs(state.y[:5]).max() <= 2 * point.values[AMPLITUDE]
        sine = SINE.format(point.drive.omega / (2 * np.pi), 300).replace('"5 g"', '"14 g"')
        found = pf.run(IWAN_MODES + sine, **{"accuracy.method": "march"}).measures[AMPLITUDE]
        assert abs(found.value - point.values[AMPLITUDE]) <= found.error + 1e-8 * found.value
        assert found.error <= 3e-5 * found.value


def test_exact_case_whose_maxima_share_points_has_peak_of_run():
    """A flat balance has several maxima; the peak of a sweep's case is that of the drawn curve."""
    scene = pf.new("shroud")
    joint = {"structure.mode.flap.slide": 0.2598, "drive.force": "2 N"}
    run = pf.run(scene, **joint)
    sweep = pf.sweep(scene, {key: [value] for key, value in joint.items()})
    assert sweep[AMPLITUDE].item() == pytest.approx(run.measures[AMPLITUDE].value, rel=1e-5)
    assert sweep[f"{AMPLITUDE}_error"].item() < 1e-3 * sweep[AMPLITUDE].item()
