"""The LuGre law: Stribeck curve, Dahl's loop, and the rate equation."""

import numpy as np
import pytest
from law_runs import LOAD, run_bench_along_path, shrinking_sine
from scipy.integrate import solve_ivp

STATIC, KINETIC, STIFFNESS, SPEED = 0.31 * LOAD, 0.22 * LOAD, 1.3e7, 2e-3
DAHL = 'law = "lugre"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nstribeck_speed = "2 mm/s"\n'
LAW = DAHL + "kinetic = 0.22\n"
DAMPED = LAW + 'micro_damping = "900 N s/m"\nviscous = "300 N s/m"\n'


def stribeck_limit(v):
    """Return the steady friction force at a velocity (Stribeck curve)."""
    return KINETIC + (STATIC - KINETIC) * np.exp(-((v / SPEED) ** 2))


def rate_and_force(z, v, micro_damping=0.0, viscous=0.0):
    """Return the rate of the bristle deflection and the friction force."""
    rate = v - STIFFNESS * np.abs(v) * z / stribeck_limit(v)
    return rate, STIFFNESS * z + micro_damping * rate + viscous * v


@pytest.mark.parametrize("speed", [1e-5, 2e-3, 0.1])
def test_exact_steady_sliding_follows_stribeck_curve(speed):
    """The force in steady sliding is the Stribeck curve plus the viscous force, in both directions."""
    time = np.linspace(0.0, 1e-3 / speed, 201)
    for direction in (1.0, -1.0):
        result = run_bench_along_path(DAMPED, time, direction * speed * time)
        assert result.force[-1] == pytest.approx(
            direction * (stribeck_limit(speed) + 300 * speed), rel=1e-12
        )


def test_exact_bench_steps_agree_with_rate_equation():
    """Stored energy and work of each coarse bench step agree with an integration of order eight."""
    time, slide = shrinking_sine(40)
    result = run_bench_along_path(DAMPED, time, slide)
    z = 0.0
    for k, (dq, dt) in enumerate(zip(np.diff(slide), np.diff(time))):
        v = dq / dt

        def rate(_, y, v=v):
            change, force = rate_and_force(y[0], v, 900, 300)
            return change, force * v

        z, work = solve_ivp(rate, (0, dt), [z, 0.0], method="DOP853", rtol=1e-12, atol=1e-18).y[
            :, -1
        ]
        assert result.ledger[1, k + 1] == pytest.approx(
            STIFFNESS * z**2 / 2, abs=1e-10 * STATIC**2 / STIFFNESS
        )
        assert result.ledger[0, k + 1] - result.ledger[0, k] == pytest.approx(
            work, abs=1e-10 * STATIC * 1e-6
        )
    work, stored, dissipated, created = result.ledger
    assert work[-1] == pytest.approx(stored[-1] + dissipated[-1], rel=1e-12) and not created.any()
