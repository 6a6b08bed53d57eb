"""The rate law of equation 2.4, F = mu N tanh(v/v_0), on the bench and under the modes of a rig."""

import numpy as np
import pytest
from scene_texts import DRIVE, MODE, POINT
from scipy.integrate import quad, solve_ivp

from patchfem import plan, run
from patchfem.core import Outcome
from patchfem.friction.laws.tanh import TanhLaw

LIMIT, MASS, OMEGA = 0.3 * 115.653761996773, 0.884, 2 * np.pi * 143
LAW = POINT + '[friction]\nlaw = "tanh"\nstatic = 0.3\nreference_speed = "{} m/s"\n'
RIG = (
    LAW
    + MODE
    + DRIVE.replace("5 g", "{} m/s^2").replace("cycles = 30", "cycles = {}")
    + "[accuracy]\nsteps_per_cycle = {}\n"
)


def run_text(text):
    """Return the result of a scene text."""
    return run(plan(text))


# ---- the bench


def test_exact_force_at_constant_speed():
    """The friction ratio at constant speed equals mu tanh(v/v_0)."""
    for speed in (1e-4, 1e-3, 5e-3):
        result = run_text(
            LAW.format(1e-3)
            + f'[slide]\nkind = "constant"\nspeed = "{speed} m/s"\ndistance = "10 um"\n'
        )
        assert result.measures["friction_ratio_end"].value == pytest.approx(
            0.3 * np.tanh(speed / 1e-3), rel=1e-12
        )


@pytest.mark.parametrize("speed", [1e-4, 1e-2])
def test_order_of_sine_loop_area_is_two(speed):
    """The loop area of sinusoidal motion converges with order two to the integral of the force, within the stated error."""
    max_speed = 10e-6 * OMEGA
    angle_of_v0 = max(0.0, np.pi / 2 - speed / max_speed)  # phase at which the speed falls to v_0
    expected = (
        4
        * LIMIT
        * 10e-6
        * sum(
            quad(
                lambda p: np.tanh(max_speed * np.cos(p) / speed) * np.cos(p),
                *limits,
                epsabs=0,
                epsrel=1e-12,
            )[0]
            for limits in ((0, angle_of_v0), (angle_of_v0, np.pi / 2))
        )
    )
    errors = []
    for steps in (200, 400, 800):
        text = (
            LAW.format(speed)
            + '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
        )
        result = run_text(text + f"[accuracy]\nsteps_per_cycle = {steps}\n")
        area = result.measures["loop_area"]
        errors.append(abs(area.value / expected - 1))
        assert (
            abs(area.value - expected) <= area.error
            and result.measures["energy_balance"].value <= 1e-12
        )
    assert errors[-1] <= 2e-5
    # at 1e-4 m/s the reversal is shorter than a step, so the error of 5e-6 is not yet asymptotic
    if speed > 1e-3:
        assert 1.8 <= np.log2(errors[0] / errors[-1]) / 2 <= 2.2


def test_always_jump_and_rest_give_defined_force():
    """A displacement in zero time gives the friction limit, and rest gives zero force."""
    fraction = TanhLaw(0.3, 1e-3).limit_fraction(np.array([-1e-6, 0.0]), np.array([0.0, 1e-3]))
    assert fraction.tolist() == [-1.0, 0.0]


# ---- the rig


def reference_amplitude(speed, level, cycles):
    """Return half the peak-to-peak displacement of the last two cycles, by scipy from the equation of motion."""

    def rate(t, y):
        force = LIMIT * np.tanh(y[1] / speed)
        return [
            y[1],
            -0.006 * OMEGA * y[1] - OMEGA**2 * y[0] - force / MASS - level * np.sin(OMEGA * t),
        ]

    end = cycles * 2 * np.pi / OMEGA
    times = np.linspace(end - 4 * np.pi / OMEGA, end, 8001)
    y = solve_ivp(rate, (0, end), [0, 0], "LSODA", times, rtol=1e-10, atol=1e-16).y[0]
    return np.ptp(y) / 2


@pytest.mark.share(0)
@pytest.mark.parametrize("speed, level", [(1e-2, 49.03), (1e-3, 49.03), (1e-3, 20.0)])
def test_order_of_march_to_reference_solution(speed, level):
    """The amplitude of the march converges to the reference solution of the equation of motion."""
    expected = reference_amplitude(speed, level, 20)
    errors = []
    for steps in (400, 800, 1600):
        result = run_text(RIG.format(speed, level, 20, steps))
        amplitude = result.measures["relative_displacement_amplitude"]
        errors.append(abs(amplitude.value / expected - 1))
        assert result.measures["energy_balance"].value <= 1e-8
        assert result.outcome in (Outcome.STEADY, Outcome.TRANSIENT)
    assert errors[-1] <= 2e-4 and errors[-1] < errors[0] / 8


def test_exact_weak_drive_acts_as_viscous_damper():
    """At a hundredth of the friction limit the law acts as a viscous damper that never sticks."""
    speed = 1e-1
    level = 0.01 * LIMIT / MASS
    result = run_text(RIG.format(speed, level, 40, 800))
    damping = LIMIT / speed + 0.006 * OMEGA * MASS
    assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
        MASS * level / (damping * OMEGA), rel=3e-4
    )
    assert result.outcome is Outcome.STEADY
    assert any("never sticks" in text and "54.9 mm/s" in text for text in result.notes)
