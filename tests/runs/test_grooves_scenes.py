"""Scenes with [normal.grooves] and [contact.grooves]: loops by their closed form, plans, refusals, nothing unasked."""

import numpy as np
import pytest
from scene_texts import BLOCK

import patchfem as pf
from patchfem import SceneError
from patchfem.core import Outcome
from patchfem.scene import loads

GROOVES = 'grooves = {wavelength = "80 um", amplitude = "7.5 um"}'
PRESSED = f"""
[normal]
load = "115 N"
{GROOVES}
[friction]
law = "coulomb"
static = 0.4
"""
BENCH = (
    PRESSED
    + """
[slide]
kind = "triangle"
amplitude = "30 um"
speed = "1 mm/s"
"""
)
RIG = (
    PRESSED
    + """
[structure]
moving_mass = "1.2 kg"
mode = [{name = "axial", frequency = "143 Hz", damping = 0.003, slide = 1.0}]
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 30
[accuracy]
steps_per_cycle = 100
"""
)
PIECES = f'\n{BLOCK}element_size = "1 mm"\n'
WAVE = 2 * np.pi / 80e-6


def flat(text):
    return text.replace(GROOVES, "")


def run(text, **keys):
    return pf.run(loads(text, sets=[f"{key}={value}" for key, value in keys.items()]))


def value(result, name):
    return result.measures[name].value


def area(load, mu, amplitude, reach):
    """Loop of a slow slide between +-reach: N times the integral of the two limits' difference."""
    q = np.linspace(-reach, reach, 200_001)
    t = amplitude * WAVE * np.sin(WAVE * q)
    return load * np.trapezoid((t + mu) / (1 - mu * t) - (t - mu) / (1 + mu * t), q)


@pytest.mark.parametrize("reach", [30e-6, 200e-6])
def test_exact_the_loop_of_a_slow_slide(reach):
    found = run(BENCH, **{"slide.amplitude": f"{reach} m"})
    assert value(found, "loop_area") == pytest.approx(area(115, 0.4, 7.5e-6, reach), rel=1e-9)
    assert value(found, "energy_dissipated") == pytest.approx(
        value(found, "friction_work"), rel=1e-9
    )
    assert value(found, "energy_balance") < 1e-12 and value(found, "work_check") < 1e-3
    steep = 7.5e-6 * WAVE
    assert value(found, "friction_force_peak") == pytest.approx(
        115 * (steep + 0.4) / (1 - 0.4 * steep), rel=1e-3
    )


def test_exact_a_slow_slide_breaks_away_and_goes_on_by_coefficients_of_their_own():
    """F/N = tan(flank + angle of friction): the static one at the start, on a flank that falls, then the kinetic."""
    found = run(BENCH, **{"friction.kinetic": "0.3"})
    assert value(found, "loop_area") == pytest.approx(area(115, 0.3, 7.5e-6, 30e-6), rel=1e-9)
    flank = np.arctan(7.5e-6 * WAVE * np.sin(-0.3))
    short = BENCH.replace(
        'kind = "triangle"\namplitude = "30 um"', 'kind = "constant"\ndistance = "1 um"'
    )
    found = run(short, **{"friction.kinetic": "0.1", "normal.grooves.phase": "0.3 rad"})
    assert value(found, "friction_force_peak") == pytest.approx(
        115 * np.tan(flank + np.arctan(0.4)), rel=1e-9
    )


def test_exact_a_rig_slips_by_the_kinetic_coefficient():
    """Flanks of a slope of 1e-12 and the exact engine without grooves."""
    there = run(
        RIG,
        **{"friction.kinetic": "0.3", "normal.grooves.amplitude": "1e-11 um", "drive.cycles": "10"},
    )
    here = run(flat(RIG), **{"friction.kinetic": "0.3", "drive.cycles": "10"})
    assert there.extra["engine"] == "march" and here.extra["engine"] != "march"
    for name in ("friction_work", "loop_area", "relative_displacement_amplitude"):
        assert value(there, name) == pytest.approx(value(here, name), rel=1e-5)


def test_exact_a_slow_slide_of_a_force_that_follows_the_speed():
    """Far above v_0 it is Coulomb's; far below v_0 it is a dashpot along the flank: c ds/dt with c = mu N/v_0."""
    rate = BENCH.replace('law = "coulomb"', 'law = "tanh"\nreference_speed = "1 um/s"')
    assert value(run(rate), "loop_area") == pytest.approx(area(115, 0.4, 7.5e-6, 30e-6), rel=1e-9)
    slow = run(rate.replace('"1 um/s"', '"1000 m/s"'))
    q = np.linspace(-30e-6, 30e-6, 20_001)
    t = 7.5e-6 * WAVE * np.sin(WAVE * q)
    dashpot = 115 * 0.4 / 1000 * 1e-3 * np.trapezoid(2 * (1 + t**2) ** 1.5, q)
    assert value(slow, "loop_area") == pytest.approx(dashpot, rel=1e-6)


@pytest.mark.parametrize("law", ["elastic-plastic", "nonlocal"])
def test_always_a_law_with_memory_acts_along_the_flank(law):
    """Books close; with bonds far shorter than the flank the loop of a slow slide is Coulomb's."""

    def text(of, length):
        return of.replace('law = "coulomb"', f'law = "{law}"\nbond_length = "{length}"')

    found = run(text(BENCH, "0.1 um"), **{"accuracy.steps_per_cycle": "4000"})
    assert value(found, "energy_balance") < 1e-10 and value(found, "work_check") < 1e-3
    assert value(found, "loop_area") == pytest.approx(area(115, 0.4, 7.5e-6, 30e-6), rel=0.01)
    assert value(found, "friction_work") - value(found, "energy_stored") == pytest.approx(
        value(found, "energy_dissipated"), rel=1e-9
    )
    found = run(
        text(RIG, "1 um"),
        **{"normal.grooves.lifted_mass": "0.3 kg", "accuracy.steps_per_cycle": "400"},
    )
    assert value(found, "energy_balance") < 1e-10 and value(found, "work_check") < 2e-3


def test_exact_a_patch_under_a_rigid_slide_is_the_point():
    pieces = PIECES + GROOVES
    point = f'[normal]\nload = "115 N"\n{GROOVES}'
    for text, names in (
        (RIG, ("relative_displacement_amplitude", "loop_area")),
        (BENCH, ("loop_area",)),
    ):
        there, here = (
            run(one, **{"accuracy.steps_per_cycle": "40"})
            for one in (text.replace(point, pieces), text)
        )
        for name in names:
            assert value(there, name) == pytest.approx(value(here, name), rel=1e-8)


@pytest.mark.parametrize("text", [BENCH, RIG])
def test_exact_flat_grooves_are_the_law_itself(text):
    """Amplitude 0 gives every number of the scene without grooves."""
    there = run(text, **{"normal.grooves.amplitude": "0 um"})
    here = run(flat(text))
    assert {name: one.value for name, one in there.measures.items()} == {
        name: one.value for name, one in here.measures.items()
    }


def test_refuses_heave_over_grooves():
    text = (
        RIG.replace("[normal]", PIECES)
        .replace('load = "115 N"\ngrooves', "grooves")
        .replace("slide = 1.0}", "slide = 1.0, normal = 0.1}")
    )
    with pytest.raises(
        SceneError, match=r"structure\.mode\.\S+: not supported yet with \[contact\.grooves\]"
    ):
        loads(text)


@pytest.mark.parametrize(
    ("text", "sets", "key", "words"),
    [
        (
            BENCH,
            ["friction.static=2"],
            "normal.grooves.amplitude",
            "on which the pieces lock with static = 2",
        ),
        (BENCH, ["friction.static=2"], "normal.grooves.amplitude", "= 6.3662e-06 m is needed"),
        (
            RIG,
            ["accuracy.method=exact"],
            "accuracy.method",
            "no exact solution exists with [normal.grooves]",
        ),
        (
            RIG,
            ["friction.law=convolution", "friction.bond_length=1 um"],
            "friction.law",
            "with [normal.grooves] is not supported yet; use law 'coulomb'",
        ),
        (
            RIG,
            ["friction.law=nonlocal", "friction.bond_length=1 um", "friction.order=2"],
            "friction.order",
            "with [normal.grooves]",
        ),
        (
            RIG,
            ["friction.law=nonlocal", "friction.bond_length=1 um", "accuracy.quadrature=direct"],
            "accuracy.quadrature",
            "'direct' with [normal.grooves]",
        ),
        (
            RIG,
            ["structure.bonded.stiffness=1e5 N/m", "structure.bonded.wavelength=80 um"],
            "structure.bonded.wavelength",
            "with [normal.grooves]",
        ),
        (
            BENCH,
            ["wear.coefficient=1e-14 m^2/N", "wear.cycles=1000"],
            "wear",
            "with [normal.grooves]; a [normal] contact has no area",
        ),
        (BENCH, ["normal.grooves.amplitude=-1 um"], "normal.grooves.amplitude", ""),
    ],
)
def test_refuses_what_grooves_cannot_stand_beside(text, sets, key, words):
    with pytest.raises(SceneError) as told:
        loads(text, sets=sets)
    assert any(f" {key}: " in line and words in line for line in told.value.mistakes), (
        told.value.mistakes
    )


def test_refuses_grooves_under_a_static_patch_and_soft_pieces():
    patch = BLOCK + GROOVES
    with pytest.raises(SceneError, match=r"contact\.grooves: .*needs a sliding motion"):
        loads(patch)
    soft = BENCH.replace(f'[normal]\nload = "115 N"\n{GROOVES}', patch + "\n[contact.shear]")
    with pytest.raises(SceneError, match=r"friction\.law: 'tanh' with \[contact\.shear\]"):
        loads(soft.replace('law = "coulomb"', 'law = "tanh"\nreference_speed = "1 mm/s"'))
    soft = soft.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"')
    with pytest.raises(
        SceneError,
        match=r"contact\.holder\.tangential_stiffness: not supported yet with "
        r"\[contact\.grooves\]",
    ):
        loads(soft + '\n[contact.holder]\ntangential_stiffness = "1e7 N/m"')


LEAVES = {
    "normal.grooves.lifted_mass": "1.5 kg",
    "drive.acceleration": "60 g",
    "normal.load": "60 N",
    "structure.moving_mass": "8 kg",
}


@pytest.mark.parametrize("law", ['law = "coulomb"', 'law = "tanh"\nreference_speed = "5 mm/s"'])
def test_exact_the_books_end_with_the_sample_that_exceeds_the_travel(law):
    """The sums are those of the last sample, wherever travel is exceeded within what is marched at once."""
    limit = RIG.replace('law = "coulomb"', law).replace(
        "moving_mass", 'travel = "0.08 mm"\nmoving_mass'
    )
    for level in ("9 g", "10 g", "12 g"):
        found = run(limit, **{"drive.acceleration": level})
        assert found.outcome is Outcome.EXCEEDS_TRAVEL
        assert value(found, "energy_balance") < 1e-9 and value(found, "work_check") < 5e-3


@pytest.mark.parametrize(
    "text",
    [
        RIG,
        RIG.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"'),
        RIG.replace("steps_per_cycle = 100", 'method = "harmonic"'),
    ],
    ids=["exact", "march", "repeated"],
)
def test_always_a_lifted_mass_that_leaves_its_grooves_is_an_outcome(text):
    """In every engine; the moment stands in a note, no warning calls it a solve that failed."""
    found = run(text, **LEAVES)
    assert found.outcome is Outcome.LEAVES_GROOVES
    assert "left their grooves" in found.outcome.sentence
    assert any("leaves the grooves at" in one for one in found.notes)
    assert not any("leaves the grooves" in one or "residual" in one for one in found.warnings)
    assert all(one.error is not None for one in found.measures.values() if one.value is not None)
    load = found.response.extra["normal_load"]
    assert load.min() <= 0.05 * load.max()
