"""Scenes with [normal.grooves] and [contact.grooves]: loops in closed form, plans, refusals and
outcomes."""

import numpy as np
import pytest
from scene_texts import GROOVED, SLIDE, STRUCTURE
from scipy.integrate import cumulative_trapezoid

import patchfem as pf
from patchfem.core import Outcome

BENCH = GROOVED + SLIDE.replace("10 um", "30 um").replace("5 mm/s", "1 mm/s")
RIG = GROOVED + STRUCTURE + "[accuracy]\nsteps_per_cycle = 100\n"
WAVE = 2 * np.pi / 80e-6


def groove_loop_area(mu, reach):
    """Return the area of the loop of slow sliding between +-reach under 115 N: N times the integral of the
    difference of the two friction limits."""
    q = np.linspace(-reach, reach, 200_001)
    t = 7.5e-6 * WAVE * np.sin(WAVE * q)
    return 115 * np.trapezoid((t + mu) / (1 - mu * t) - (t - mu) / (1 + mu * t), q)


@pytest.mark.parametrize("reach", [30e-6, 200e-6])
def test_slow_sliding_loop_agrees_with_closed_form(reach):
    """Area and peak force of a slow friction loop over grooves agree with the closed form, and its energies balance."""
    result = pf.run(BENCH, **{"slide.amplitude": f"{reach} m"})
    assert result.measures["loop_area"].value == pytest.approx(
        groove_loop_area(0.4, reach), rel=1e-9
    )
    assert result.measures["energy_dissipated"].value == pytest.approx(
        result.measures["friction_work"].value, rel=1e-9
    )
    assert (
        result.measures["energy_balance"].value < 1e-12
        and result.measures["work_check"].value < 1e-3
    )
    slope = 7.5e-6 * WAVE
    assert result.measures["friction_force_peak"].value == pytest.approx(
        115 * (slope + 0.4) / (1 - 0.4 * slope), rel=1e-3
    )


def test_exact_breakaway_on_grooves_uses_static_coefficient():
    """The friction force is N tan(slope angle + friction angle): with the static coefficient at the
    start, on a falling slope, and with the kinetic coefficient in the loop."""
    result = pf.run(BENCH, **{"friction.kinetic": "0.3"})
    assert result.measures["loop_area"].value == pytest.approx(
        groove_loop_area(0.3, 30e-6), rel=1e-9
    )
    slope_angle = np.arctan(7.5e-6 * WAVE * np.sin(-0.3))
    first_micron = BENCH.replace(
        'kind = "triangle"\namplitude = "30 um"', 'kind = "constant"\ndistance = "1 um"'
    )
    result = pf.run(first_micron, **{"friction.kinetic": "0.1", "normal.grooves.phase": "0.3 rad"})
    assert result.measures["friction_force_peak"].value == pytest.approx(
        115 * np.tan(slope_angle + np.arctan(0.4)), rel=1e-9
    )


def test_exact_tanh_loop_on_grooves_agrees_with_limits():
    """Far above the speed v_0 the loop is that of Coulomb's law; far below it is that of a dashpot
    along the slope, c ds/dt with c = mu N/v_0."""
    tanh_bench = BENCH.replace('law = "coulomb"', 'law = "tanh"\nreference_speed = "1 um/s"')
    assert pf.run(tanh_bench).measures["loop_area"].value == pytest.approx(
        groove_loop_area(0.4, 30e-6), rel=1e-9
    )
    viscous = pf.run(tanh_bench.replace('"1 um/s"', '"1000 m/s"'))
    q = np.linspace(-30e-6, 30e-6, 20_001)
    t = 7.5e-6 * WAVE * np.sin(WAVE * q)
    dashpot = 115 * 0.4 / 1000 * 1e-3 * np.trapezoid(2 * (1 + t**2) ** 1.5, q)
    assert viscous.measures["loop_area"].value == pytest.approx(dashpot, rel=1e-6)


LEAVING_KEYS = {
    "normal.grooves.lifted_mass": "1.5 kg",
    "drive.acceleration": "60 g",
    "normal.load": "60 N",
    "structure.moving_mass": "8 kg",
}


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
    result = pf.run(text, **LEAVING_KEYS)
    assert result.outcome is Outcome.LEAVES_GROOVES
    assert "left their grooves" in result.outcome.sentence
    assert any("leaves the grooves at" in item for item in result.notes)
    assert not any("leaves the grooves" in item or "residual" in item for item in result.warnings)
    assert all(
        item.error is not None for item in result.measures.values() if item.value is not None
    )
    response = result.response
    load = response.extra["normal_load"]
    assert load.min() <= 0.05 * load.max()
    # the impulse of the load beyond the static one is the vertical momentum of the lifted mass
    impulse = cumulative_trapezoid(load - 60, response.time, initial=0)
    momentum = 1.5 * 7.5e-6 * WAVE * np.sin(WAVE * response.slide) * response.slide_rate
    np.testing.assert_allclose(impulse, momentum - momentum[0], 0, 0.15 * momentum.max())
