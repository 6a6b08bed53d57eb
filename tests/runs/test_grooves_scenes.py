"""Scenes with [normal.grooves] and [contact.grooves]: loops in closed form, plans, refusals and
outcomes."""

import numpy as np
import pytest
from scene_texts import BLOCK

import patchfem as pf
from patchfem import SceneError
from patchfem.core import Outcome
from patchfem.scene import loads

GROOVES = 'grooves = {wavelength = "80 um", amplitude = "7.5 um"}'
GROOVED_POINT = f"""
[normal]
load = "115 N"
{GROOVES}
[friction]
law = "coulomb"
static = 0.4
"""
BENCH = (
    GROOVED_POINT
    + """
[slide]
kind = "triangle"
amplitude = "30 um"
speed = "1 mm/s"
"""
)
RIG = (
    GROOVED_POINT
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


def remove_grooves(text):
    """Return a scene without its grooves."""
    return text.replace(GROOVES, "")


def run_with_keys(text, **keys):
    """Return the result of a scene with some keys replaced."""
    return pf.run(loads(text, sets=[f"{key}={value}" for key, value in keys.items()]))


def measure_value(result, name):
    """Return the value of a measure."""
    return result.measures[name].value


def groove_loop_area(load, mu, amplitude, reach):
    """Return the area of the loop of slow sliding between +-reach: N times the integral of the
    difference of the two friction limits."""
    q = np.linspace(-reach, reach, 200_001)
    t = amplitude * WAVE * np.sin(WAVE * q)
    return load * np.trapezoid((t + mu) / (1 - mu * t) - (t - mu) / (1 + mu * t), q)


@pytest.mark.parametrize("reach", [30e-6, 200e-6])
def test_exact_slow_sliding_loop_agrees_with_closed_form(reach):
    """Area and peak force of a slow friction loop over grooves agree with the closed form, and its energies balance."""
    result = run_with_keys(BENCH, **{"slide.amplitude": f"{reach} m"})
    assert measure_value(result, "loop_area") == pytest.approx(
        groove_loop_area(115, 0.4, 7.5e-6, reach), rel=1e-9
    )
    assert measure_value(result, "energy_dissipated") == pytest.approx(
        measure_value(result, "friction_work"), rel=1e-9
    )
    assert (
        measure_value(result, "energy_balance") < 1e-12
        and measure_value(result, "work_check") < 1e-3
    )
    slope = 7.5e-6 * WAVE
    assert measure_value(result, "friction_force_peak") == pytest.approx(
        115 * (slope + 0.4) / (1 - 0.4 * slope), rel=1e-3
    )


def test_exact_breakaway_on_grooves_uses_static_coefficient():
    """The friction force is N tan(slope angle + friction angle): with the static coefficient at the
    start, on a falling slope, and with the kinetic coefficient in the loop."""
    result = run_with_keys(BENCH, **{"friction.kinetic": "0.3"})
    assert measure_value(result, "loop_area") == pytest.approx(
        groove_loop_area(115, 0.3, 7.5e-6, 30e-6), rel=1e-9
    )
    slope_angle = np.arctan(7.5e-6 * WAVE * np.sin(-0.3))
    first_micron = BENCH.replace(
        'kind = "triangle"\namplitude = "30 um"', 'kind = "constant"\ndistance = "1 um"'
    )
    result = run_with_keys(
        first_micron, **{"friction.kinetic": "0.1", "normal.grooves.phase": "0.3 rad"}
    )
    assert measure_value(result, "friction_force_peak") == pytest.approx(
        115 * np.tan(slope_angle + np.arctan(0.4)), rel=1e-9
    )


def test_exact_rig_on_grooves_slips_with_kinetic_coefficient():
    """A rig on grooves with a slope of 1e-12 agrees with the exact engine without grooves."""
    grooved = run_with_keys(
        RIG,
        **{"friction.kinetic": "0.3", "normal.grooves.amplitude": "1e-11 um", "drive.cycles": "10"},
    )
    ungrooved = run_with_keys(
        remove_grooves(RIG), **{"friction.kinetic": "0.3", "drive.cycles": "10"}
    )
    assert grooved.extra["engine"] == ungrooved.extra["engine"] == "hybrid"
    for name in ("friction_work", "loop_area", "relative_displacement_amplitude"):
        assert measure_value(grooved, name) == pytest.approx(
            measure_value(ungrooved, name), rel=1e-5
        )


def test_exact_tanh_loop_on_grooves_agrees_with_limits():
    """Far above the speed v_0 the loop is that of Coulomb's law; far below it is that of a dashpot
    along the slope, c ds/dt with c = mu N/v_0."""
    tanh_bench = BENCH.replace('law = "coulomb"', 'law = "tanh"\nreference_speed = "1 um/s"')
    assert measure_value(run_with_keys(tanh_bench), "loop_area") == pytest.approx(
        groove_loop_area(115, 0.4, 7.5e-6, 30e-6), rel=1e-9
    )
    viscous = run_with_keys(tanh_bench.replace('"1 um/s"', '"1000 m/s"'))
    q = np.linspace(-30e-6, 30e-6, 20_001)
    t = 7.5e-6 * WAVE * np.sin(WAVE * q)
    dashpot = 115 * 0.4 / 1000 * 1e-3 * np.trapezoid(2 * (1 + t**2) ** 1.5, q)
    assert measure_value(viscous, "loop_area") == pytest.approx(dashpot, rel=1e-6)


@pytest.mark.parametrize("law", ["elastic-plastic", "nonlocal"])
def test_always_hysteretic_laws_on_grooves_close_energy_balance(law):
    """The energy balance closes for laws with memory along the slope; with bonds far shorter than a
    groove, the loop is that of Coulomb's law."""

    def format_law(base_text, length):
        return base_text.replace('law = "coulomb"', f'law = "{law}"\nbond_length = "{length}"')

    result = run_with_keys(format_law(BENCH, "0.1 um"), **{"accuracy.steps_per_cycle": "4000"})
    assert (
        measure_value(result, "energy_balance") < 1e-10
        and measure_value(result, "work_check") < 1e-3
    )
    assert measure_value(result, "loop_area") == pytest.approx(
        groove_loop_area(115, 0.4, 7.5e-6, 30e-6), rel=0.01
    )
    assert measure_value(result, "friction_work") - measure_value(
        result, "energy_stored"
    ) == pytest.approx(measure_value(result, "energy_dissipated"), rel=1e-9)
    result = run_with_keys(
        format_law(RIG, "1 um"),
        **{"normal.grooves.lifted_mass": "0.3 kg", "accuracy.steps_per_cycle": "400"},
    )
    assert (
        measure_value(result, "energy_balance") < 1e-10
        and measure_value(result, "work_check") < 2e-3
    )


def test_refuses_normal_motion_with_grooves():
    """A mode with normal motion is not supported with grooves."""
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
    ("text", "sets", "key", "message"),
    [
        (
            BENCH,
            ["friction.static=2"],
            "normal.grooves.amplitude",
            "on which the pieces lock with static = 2",
        ),
        (
            RIG,
            ["friction.law=convolution", "friction.bond_length=1 um"],
            "friction.law",
            "with [normal.grooves] is not supported yet; use law 'coulomb'",
        ),
        (
            RIG,
            ["friction.law=nonlocal", "friction.bond_length=1 um", "accuracy.quadrature=direct"],
            "accuracy.quadrature",
            "'direct' with [normal.grooves]",
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
def test_refuses_keys_incompatible_with_grooves(text, sets, key, message):
    """Keys that are not supported with grooves are refused with a message that names them."""
    with pytest.raises(SceneError) as error:
        loads(text, sets=sets)
    assert any(f" {key}: " in line and message in line for line in error.value.mistakes), (
        error.value.mistakes
    )


def test_refuses_grooves_in_static_patch_or_unsuitable_shear():
    """Grooves need a sliding motion; with [contact.shear], the law tanh and a holder spring are refused."""
    patch = BLOCK + GROOVES
    with pytest.raises(SceneError, match=r"contact\.grooves: .*needs a sliding motion"):
        loads(patch)
    sheared = BENCH.replace(f'[normal]\nload = "115 N"\n{GROOVES}', patch + "\n[contact.shear]")
    with pytest.raises(SceneError, match=r"friction\.law: 'tanh' with \[contact\.shear\]"):
        loads(sheared.replace('law = "coulomb"', 'law = "tanh"\nreference_speed = "1 mm/s"'))
    sheared = sheared.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"')
    with pytest.raises(
        SceneError,
        match=r"contact\.holder\.tangential_stiffness: not supported yet with "
        r"\[contact\.grooves\]",
    ):
        loads(sheared + '\n[contact.holder]\ntangential_stiffness = "1e7 N/m"')


LEAVING_KEYS = {
    "normal.grooves.lifted_mass": "1.5 kg",
    "drive.acceleration": "60 g",
    "normal.load": "60 N",
    "structure.moving_mass": "8 kg",
}


@pytest.mark.parametrize("law", ['law = "coulomb"', 'law = "tanh"\nreference_speed = "5 mm/s"'])
def test_exact_energy_balance_ends_with_exceeded_travel(law):
    """The energy sums end with the sample that exceeds the travel, wherever it lies in a block of
    steps."""
    text = RIG.replace('law = "coulomb"', law).replace(
        "moving_mass", 'travel = "0.08 mm"\nmoving_mass'
    )
    for level in ("9 g", "12 g"):
        result = run_with_keys(text, **{"drive.acceleration": level})
        assert result.outcome is Outcome.EXCEEDS_TRAVEL
        assert (
            measure_value(result, "energy_balance") < 1e-9
            and measure_value(result, "work_check") < 5e-3
        )


@pytest.mark.parametrize(
    "text",
    [
        RIG,
        RIG.replace('law = "coulomb"', 'law = "elastic-plastic"\nbond_length = "1 um"'),
        RIG.replace("steps_per_cycle = 100", 'method = "harmonic"'),
    ],
    ids=["exact", "march", "repeated"],
)
def test_always_lifted_mass_leaving_grooves_is_outcome(text):
    """In every engine the outcome is `leaves_grooves`; a note states the instant, and no warning
    calls it a failed solution."""
    result = run_with_keys(text, **LEAVING_KEYS)
    assert result.outcome is Outcome.LEAVES_GROOVES
    assert "left their grooves" in result.outcome.sentence
    assert any("leaves the grooves at" in item for item in result.notes)
    assert not any("leaves the grooves" in item or "residual" in item for item in result.warnings)
    assert all(
        item.error is not None for item in result.measures.values() if item.value is not None
    )
    load = result.response.extra["normal_load"]
    assert load.min() <= 0.05 * load.max()
