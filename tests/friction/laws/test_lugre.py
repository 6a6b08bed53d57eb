"""The LuGre law: Stribeck curve, Dahl's loop, the equation itself, and one law in every run."""

import numpy as np
import pytest
from law_runs import LOAD, bench_along, shrinking
from scipy.integrate import solve_ivp

from patchfem.compiled import load_uncompiled
from patchfem.friction import LuGre

STATIC, KINETIC, STIFFNESS, SPEED = 0.31 * LOAD, 0.22 * LOAD, 1.3e7, 2e-3
DAHL = 'law = "lugre"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nstribeck_speed = "2 mm/s"\n'
LAW = DAHL + "kinetic = 0.22\n"
DAMPED = LAW + 'micro_damping = "900 N s/m"\nviscous = "300 N s/m"\n'


def limit(v):
    return KINETIC + (STATIC - KINETIC) * np.exp(-((v / SPEED) ** 2))


def rates(z, v, micro=0.0, viscous=0.0):
    """(z', F) of the equations."""
    rate = v - STIFFNESS * np.abs(v) * z / limit(v)
    return rate, STIFFNESS * z + micro * rate + viscous * v


@pytest.mark.parametrize("speed", [1e-5, 1e-3, 2e-3, 5e-3, 0.1])
def test_exact_steady_slides_have_the_stribeck_curve(speed):
    time = np.linspace(0.0, 1e-3 / speed, 201)
    for way in (1.0, -1.0):
        found = bench_along(DAMPED, time, way * speed * time)
        assert found.force[-1] == pytest.approx(way * (limit(speed) + 300 * speed), rel=1e-12)


def test_exact_dahl_is_the_stretch_reading():
    """Without weakening and damping z relaxes over mu N/stiffness whatever the speed: eq. 2.17 with p = 1."""
    time, slide = shrinking()
    bonds = f'law = "nonlocal"\nstatic = 0.31\nbond_length = "{STATIC / STIFFNESS!r} m"\n'
    a = bench_along(DAHL, time, slide)
    b = bench_along(bonds, time, slide)
    assert a.force == pytest.approx(b.force, abs=1e-10 * STATIC)
    top = np.abs(a.slide).max() * STIFFNESS / STATIC
    assert a.force.max() == pytest.approx(STATIC * -np.expm1(-top), rel=2e-2)  # first loading


def test_exact_straight_legs_are_the_equations():
    """At coarse steps: the stretch after every leg and the work over it, by an integration of order eight."""
    time, slide = shrinking(40)
    found = bench_along(DAMPED, time, slide)
    z = 0.0
    for k, (dq, dt) in enumerate(zip(np.diff(slide), np.diff(time))):
        v = dq / dt

        def rate(_, y, v=v):
            change, force = rates(y[0], v, 900, 300)
            return change, force * v

        z, work = solve_ivp(rate, (0, dt), [z, 0.0], method="DOP853", rtol=1e-12, atol=1e-18).y[
            :, -1
        ]
        assert found.ledger[1, k + 1] == pytest.approx(
            STIFFNESS * z**2 / 2, abs=1e-10 * STATIC**2 / STIFFNESS
        )
        assert found.ledger[0, k + 1] - found.ledger[0, k] == pytest.approx(
            work, abs=1e-10 * STATIC * 1e-6
        )
    work, stored, dissipated, created = found.ledger
    assert work[-1] == pytest.approx(stored[-1] + dissipated[-1], rel=1e-12) and not created.any()


def test_exact_rate_equation_and_its_derivatives():
    """Of the kernel that the engines integrate in time, run as Python: the equations, and their central differences."""
    kernels = load_uncompiled("patchfem.friction.laws.lugre_kernels")
    law = LuGre(0.31, 0.22, STIFFNESS / LOAD, SPEED, 900 / LOAD, 300 / LOAD)
    numbers = law.element(LOAD).numbers

    def force(z, v):
        return rates(z, v, 900, 300)[1]

    for z, v in ((1e-6, 1e-3), (-2e-6, 3e-3), (5e-7, -2e-3), (-1e-6, -1e-2)):
        found = kernels.rate_equation(numbers, z, v, np.sign(v))
        by_stretch = (force(z + 1e-9, v) - force(z - 1e-9, v)) / 2e-9
        by_velocity = (force(z, v + 1e-7) - force(z, v - 1e-7)) / 2e-7
        assert found[0] == pytest.approx(force(z, v), rel=1e-12)
        assert found[1] * v == pytest.approx(rates(z, v)[0], rel=1e-12)
        assert found[2:] == pytest.approx((by_stretch, by_velocity), rel=1e-6)
