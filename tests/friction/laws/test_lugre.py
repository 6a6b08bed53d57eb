"""The LuGre law: Stribeck curve, Dahl's loop, the equation itself, and one law in every run."""

from itertools import pairwise

import numpy as np
import pytest
from law_runs import LOAD, bench_along, fitted, masses, rig, shrinking
from scene_texts import COATED, DRIVE, MODE, mistakes, only
from scipy.integrate import solve_ivp
from stepped_laws import SteppedLuGre

from patchfem.scene.scene import loads

STATIC, KINETIC, STIFFNESS, SPEED = 0.31 * LOAD, 0.22 * LOAD, 1.3e7, 2e-3
DAHL = 'law = "lugre"\nstatic = 0.31\nstiffness = "1.3e7 N/m"\nstribeck_speed = "2 mm/s"\n'
LAW = DAHL + "kinetic = 0.22\n"
DAMPED = LAW + 'micro_damping = "900 N s/m"\nviscous = "300 N s/m"\n'


def limit(v):
    return KINETIC + (STATIC - KINETIC) * np.exp(-(v / SPEED)**2)


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
    a, b = bench_along(DAHL, time, slide), bench_along(bonds, time, slide)
    assert a.force == pytest.approx(b.force, abs=1e-10 * STATIC)
    top = np.abs(a.slide).max() * STIFFNESS / STATIC
    assert a.force.max() == pytest.approx(STATIC * -np.expm1(-top), rel=2e-2)  # first loading


def test_exact_straight_legs_are_the_equations():
    """At coarse steps: the stretch after every leg and the work over it, by an integration of order eight."""
    time, slide = shrinking(40)
    found, z = bench_along(DAMPED, time, slide), 0.0
    for k, (dq, dt) in enumerate(zip(np.diff(slide), np.diff(time))):
        v = dq / dt

        def rate(_, y, v=v):
            change, force = rates(y[0], v, 900, 300)
            return change, force * v

        z, work = solve_ivp(rate, (0, dt), [z, 0.0], method="DOP853", rtol=1e-12, atol=1e-18).y[:, -1]
        assert found.ledger[1, k + 1] == pytest.approx(STIFFNESS * z**2 / 2, abs=1e-10 * STATIC**2 / STIFFNESS)
        assert found.ledger[0, k + 1] - found.ledger[0, k] == pytest.approx(work, abs=1e-10 * STATIC * 1e-6)
    work, stored, dissipated, created = found.ledger
    assert work[-1] == pytest.approx(stored[-1] + dissipated[-1], rel=1e-12) and not created.any()


@pytest.mark.parametrize("law, micro, viscous", [(LAW, 0.0, 0.0), (DAMPED, 900.0, 300.0)])
def test_exact_a_bench_loop_is_the_equation(law, micro, viscous):
    """A sine slide, not its legs: at 8000 steps a cycle to 1e-6 of the static force."""
    hertz, size, time = 50.0, 5e-6, np.arange(12001) / 8000 / 50
    found = bench_along(law, time, size * np.sin(2 * np.pi * hertz * time))

    def speed(t):
        return size * 2 * np.pi * hertz * np.cos(2 * np.pi * hertz * t)

    turns, z = np.concatenate([[0.0], (np.arange(3) + 0.5) / hertz / 2, time[-1:]]), [0.0]
    out = []
    for a, b in pairwise(turns):
        inside = time[(time >= a - 1e-12) & (time < b - 1e-12)] if b < turns[-1] else time[time >= a - 1e-12]
        done = solve_ivp(lambda t, y: rates(y, speed(t))[0], (a, b), z[-1:], method="DOP853", rtol=1e-12, atol=1e-18,
                         t_eval=np.append(inside, b) if inside[-1] < b else inside)
        out.append(done.y[0][:inside.size])
        z.append(done.y[0][-1])
    truth = rates(np.concatenate(out), speed(time), micro, viscous)[1]
    inner = slice(1, -1)  # at the ends only one leg has a speed
    assert np.abs(found.force - truth)[inner].max() <= 1e-6 * STATIC
    assert np.diff(found.ledger[2]).min() >= -1e-15


def test_exact_the_compiled_bench_is_the_plain_law():
    time, slide = shrinking(60)
    found, one = bench_along(DAMPED, time, slide), np.full(1, LOAD)
    law = SteppedLuGre(0.31, 0.22, STIFFNESS / LOAD, SPEED, 900 / LOAD, 300 / LOAD)
    state = law.start(one)
    for k, (dq, dt) in enumerate(zip(np.diff(slide), np.diff(time))):
        step = law.step(state, dq, one, one, dt)
        state = step.state
        assert found.ledger[0, k + 1] - found.ledger[0, k] == pytest.approx(step.mean[0] * dq, rel=1e-8, abs=1e-18)
        assert found.ledger[1, k + 1] == pytest.approx(law.stored(state)[0], rel=1e-9, abs=1e-18)
        assert found.ledger[2, k + 1] - found.ledger[2, k] == pytest.approx(step.dissipated[0], abs=1e-14)
    assert law.traction(state)[0] == pytest.approx(found.force[-1], rel=1e-9)
    jump = law.step(law.start(one), 1e-3, one, one, 0.0)
    assert law.stored(jump.state)[0] == pytest.approx(KINETIC**2 / STIFFNESS / 2, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("law", [DAHL, DAMPED])
def test_exact_a_march_settles_on_the_harmonic_balance(law):
    marched, steady = rig(law), rig(law, "accuracy.method=harmonic")
    assert marched.outcome.value == "steady"
    for name in ("relative_displacement_amplitude", "friction_force_peak", "loop_area", "slip_amplitude"):
        a, b = marched.measures[name], steady.measures[name]
        assert abs(a.value - b.value) <= a.error + b.error + 1e-3 * abs(b.value), name
    assert marched.measures["energy_balance"].value < 1e-9
    assert marched.measures["energy_created"].value <= 1e-12 * marched.measures["energy_dissipated"].value


@pytest.mark.slow  # its loop takes 7 s to compile; always on with Bouc and Wen's law, of the same form
def test_exact_two_alike_interfaces_move_alike():
    both = masses(DAMPED, 2)
    slides, alone = both.response.extra["slides"], masses(DAMPED, 1).response.slide
    assert slides[:, 0] == pytest.approx(slides[:, 1], abs=1e-12 * np.abs(slides).max())
    assert slides[:, 0] == pytest.approx(alone, abs=1e-7 * np.abs(alone).max())


def test_exact_a_fit_finds_the_numbers_of_a_loop(tmp_path):
    time, slide = shrinking(60)
    force = bench_along(LAW, time, slide).force
    found = fitted(tmp_path, LAW.replace("0.31", "0.4").replace("0.22", "0.3"), (time, slide, force),
                   "friction.static=0.25..0.7,friction.kinetic=0.1..0.24,friction.stribeck_speed=0.5 mm/s..10 mm/s")
    assert found.keys.fit.values == pytest.approx([0.31, 0.22, 2e-3], rel=1e-5)


def test_refuses_what_the_law_cannot_do():
    scene = '[normal]\nload = "100 N"\n[friction]\n' + DAMPED + MODE + DRIVE
    for key in ("stiffness", "stribeck_speed"):
        bare = "".join(line for line in scene.splitlines(True) if not line.startswith(f"{key} ="))
        assert f"friction.{key}: missing" in only(bare)
    assert "larger than static" in only(scene, "friction.kinetic=0.4")
    assert "10 N s/m" in only(scene, "friction.viscous=3")
    assert "friction.viscous" in only(scene, "friction.viscous=-1 N s/m")
    assert "'lugre' with [contact.shear]" in only(COATED + "[contact.shear]\n[friction]\n" + DAHL + MODE + DRIVE)
    assert "'lugre' with normal.amplitude" in mistakes(scene, "normal.amplitude=1 N", "normal.frequency=3 Hz")[0]
    assert loads('[normal]\nload = "100 N"\n[friction]\n' + DAHL + MODE + DRIVE).friction.kinetic == 0.31
