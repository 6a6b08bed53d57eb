"""Motions of `event_driven` with a closed form, to 1e-9 or better."""

import numpy as np
import pytest
from event_driven_cases import coulomb, make_bench, make_oscillator
from scipy.optimize import brentq

from patchfem.event_driven import cases, runs
from patchfem.event_driven.laws import masing
from patchfem.event_driven.records import LawNumbers, Status


def forces(motion):
    """Return times, slides and friction forces at the samples of a case with one interface."""
    n = motion.case.y.size
    return motion.rows[:, 0], motion.rows[:, 1], motion.rows[:, 1 + n]


@pytest.mark.parametrize("cycles", [200, 200.05])
def test_block_in_two_stops_has_the_amplitude_of_forty_digits(cycles):
    """Resonance with damping 0.003 and friction of 0.8 of the drive; root of the two-stop motion in 40 digits.

    The block rests in the first 0.05 cycles, which are no motion that repeats.
    """
    motion = runs.run_case(make_oscillator(coulomb(), cycles=cycles, rtol=1e-12))
    assert motion.values["relative_displacement_amplitude"] == pytest.approx(
        0.28704671337871602595, abs=1e-11
    )
    assert motion.values["slip_start_phase"] == pytest.approx(0.538622, abs=1e-6)
    assert motion.values["energy_balance"] < 1e-11


def test_harmonics_of_block_in_two_stops_have_the_accuracy_of_its_motion():
    """First and third harmonic of the acceleration of the same motion, by quadrature of its closed form over a half cycle.

    The long steps of the engine between two events once gave the third harmonic an error of 1e-7.
    """
    amplitude, zeta, limit = 0.28704671337871602595, 0.003, 0.8
    start = np.pi - np.arcsin(
        amplitude - limit
    )  # drive and spring balance friction, and then exceed it
    gain = -1 / (2j * zeta)  # response to the drive at resonance
    rate = -zeta + 1j * np.sqrt(1 - zeta**2)
    jump = -amplitude + limit - (gain * np.exp(1j * start)).imag
    slope = -(1j * gain * np.exp(1j * start)).imag
    free = jump - 1j * (slope + zeta * jump) / rate.imag

    def differentiate(t, order):
        own = free * rate**order * np.exp(rate * (t - start))
        return own.real + (1j**order * gain * np.exp(1j * t)).imag

    end = brentq(lambda t: differentiate(t, 1), start + 0.5, start + np.pi)
    assert differentiate(end, 0) - limit == pytest.approx(amplitude, abs=1e-11)
    x, weights = np.polynomial.legendre.leggauss(60)
    harmonics = []
    for order in (1, 3):
        total = -1j * np.pi / 2 * (order == 1)  # of the base
        t = start + (end - start) * (x + 1) / 2
        total += (end - start) / 2 * np.sum(weights * differentiate(t, 2) * np.exp(-1j * order * t))
        harmonics.append(abs(total) * 2 / np.pi)

    values = runs.run_case(make_oscillator(coulomb(), rtol=1e-11)).values
    assert values["absolute_acceleration_fundamental"] == pytest.approx(harmonics[0], rel=1e-10)
    distortion = harmonics[1] / harmonics[0]
    assert values["acceleration_distortion"] == pytest.approx(distortion, rel=1e-9)


@pytest.mark.parametrize("rtol, error", [(1e-7, 1e-8), (1e-12, 1e-12)])
def test_phasor_of_cycle_has_the_accuracy_of_its_motion(rtol, error):
    """Without load, the phasor of the output at resonance is that of the linear oscillator, 1/(2 zeta).

    It is the integral over a cycle by quadrature of the dense output, at a loose and at a tight tolerance of the step.
    """
    motion = runs.run_case(make_oscillator(coulomb(), load=0.0, zeta=0.5, cycles=60, rtol=rtol))
    assert motion.phasors[-1] == pytest.approx(1.0, abs=error)


def test_block_without_stops_after_200_cycles():
    """Friction of half the drive; peak at the end of 200 cycles from exact propagation between reversals."""
    motion = runs.run_case(make_oscillator(coulomb(), load=0.5, rtol=1e-12))
    assert motion.extremes[-1, 1] == pytest.approx(59.1676969670915519, rel=1e-9)
    # Slip does not start where the block turns without rest.
    assert np.isnan(motion.values["slip_start_phase"])


def test_slip_starts_where_static_friction_balances_drive_and_spring():
    """A block that rests once in a cycle and turns without rest on the other side: only the rest has a start of slip."""
    static = 0.48566
    case = make_oscillator(coulomb(1.0, 2 / 3), load=static, zeta=0.02235, omega=0.58032, cycles=60)
    motion = runs.run_case(case)
    assert 0.01 < motion.values["stick_fraction"] < 0.02
    _, rest, again, _ = motion.event_rows[-4:, 1]
    assert again == rest
    # At the release, drive and spring push with sin(phase) + rest against static friction.
    phase = motion.values["slip_start_phase"]
    assert np.sin(phase) + rest == pytest.approx(-static, abs=1e-7)


def test_free_block_stops_after_six_half_cycles():
    """Eq. 3.11: a release from 11.5 F/k rests at -0.5 F/k at the time 6 pi, exactly."""
    case = make_oscillator(
        coulomb(), load=1.0, acceleration=0.0, zeta=0.0, z=11.5, cycles=16.0, rtol=1e-12
    )
    motion = runs.run_case(case)
    assert motion.event_rows[:, 1] == pytest.approx([-9.5, 7.5, -5.5, 3.5, -1.5, -0.5], abs=1e-10)
    assert motion.event_rows[:, 0] == pytest.approx(np.pi * np.arange(1, 7), abs=1e-10)
    assert motion.final.y[0] == pytest.approx(-0.5, abs=1e-10)
    assert abs(motion.final.y[1]) < 1e-16  # round-off of the projection on the constraint


def test_rest_under_static_above_kinetic_friction_is_exact():
    """A drive below static friction moves nothing; a release below it stays where it is."""
    stuck = runs.run_case(make_oscillator(coulomb(1.0, 0.5), acceleration=0.79, cycles=100))
    assert stuck.values["relative_displacement_amplitude"] < 1e-15
    assert stuck.values["stick_fraction"] == 1.0
    held = runs.run_case(make_oscillator(coulomb(1.0, 0.5), acceleration=0.0, z=0.79, cycles=50))
    assert held.final.y[0] == pytest.approx(0.79, abs=1e-15)
    # Just above static friction, it slides under kinetic friction to the mirror image about mu_k N/k.
    released = runs.run_case(
        make_oscillator(coulomb(1.0, 0.5), acceleration=0.0, zeta=0.0, z=0.81, cycles=5)
    )
    assert released.final.y[0] == pytest.approx(2 * 0.4 - 0.81, abs=1e-9)


def test_elastic_plastic_block_decays_as_eq_3_12():
    """A released block on its spring and contact: an elastic quarter of a swing, a slip, and an elastic swing for ever."""
    law = masing.from_elements([3.0], [0.5])
    case = make_oscillator(law, load=1.5, acceleration=0.0, zeta=0.0, z=2.0, cycles=3.0, rtol=1e-12)
    samples = np.linspace(0.0, 6 * np.pi, 50)
    motion = runs.run_case(cases.Case(case.rig, case.y, case.ends, case.windows, samples, 1))
    time = motion.rows[:, 0]
    # The spring of the contact is unstretched at the start; it yields at pi/4, and the slip turns at 3 pi/4.
    swing = 1.5 + 0.5 * np.cos(2 * time)
    slip = 1.5 - np.sin(time - np.pi / 4)
    end = 0.75 - 0.25 * np.cos(2 * (time - 3 * np.pi / 4))
    exact = np.select([time < np.pi / 4, time < 3 * np.pi / 4], [swing, slip], end)
    assert motion.rows[:, 1] == pytest.approx(exact, abs=1e-10)


def triangle(amplitude: float, turns: int):
    """Return corners of a slide 0, A, -A, A, ... at unit speed."""
    slide = np.concatenate([[0.0], amplitude * (-1.0) ** np.arange(turns)])
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(slide)))]), slide


@pytest.mark.parametrize(
    ("amplitude", "chi", "beta"), [(0.3, -0.4, 0.5), (0.9, 0.3, 1.5), (1.4, -0.4, 0.5)]
)
def test_masing_loops_of_the_iwan_law(amplitude, chi, beta):
    """Loop area of Segalman's law: 4 R u^(chi + 3)/((chi + 2)(chi + 3)) below phi_max, and the plastic part above."""
    limit = 1.0
    R = limit / (1 / (chi + 2) + beta / (chi + 1))
    law = LawNumbers("masing", (chi, beta, limit, 1.0, 1, 0.0, 1.0, 0.0, limit))
    motion = runs.run_case(make_bench(law, *triangle(amplitude, 3)))
    loss = motion.values["energy_dissipated"]
    u = min(amplitude, 1.0)
    loop = 4 * R * u ** (chi + 3) / ((chi + 2) * (chi + 3)) + 4 * (amplitude - u) * limit
    if amplitude > 1:
        # Above phi_max the power law slips as a whole, and the last slider for the rest.
        loop = 4 * (limit * amplitude - R / (chi + 3) - R * beta / (chi + 1))
    first = runs.run_case(make_bench(law, *triangle(amplitude, 1))).values["energy_dissipated"]
    assert loss - first == pytest.approx(loop, rel=1e-9)


DECAY = 0.1 + 1.4 * (-0.99) ** np.arange(120)  # slide at nested reversals


@pytest.mark.parametrize(
    "slide",
    [
        (0.0, 1.0, -0.6, 0.2, -0.3, 0.1, -0.3, 0.2, -0.6, -0.9),
        (0.0, *DECAY, *1.001 * DECAY[-2::-1]),
    ],
)
def test_masing_memory_of_nested_loops(slide):
    """Inner loops close; after them the outer branch goes on as if they had not happened (Madelung's rules)."""
    stiffness = np.array([2.0, 1.0, 0.5])
    limits = np.array([0.2, 0.7, 1.2])
    law = masing.from_elements(stiffness, limits)
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(slide)))])
    # The elements one by one
    stretch, history = np.zeros(3), []
    for increment in np.diff(slide):
        stretch = np.clip(stretch + increment, -limits, limits)
        history.append(stretch @ stiffness)
    motion = runs.run_case(make_bench(law, time, np.array(slide), samples=time[1:]))
    times, _, force = forces(motion)
    by_time = dict(zip(times, force))
    assert [by_time[t] for t in time[1:]] == pytest.approx(history, abs=1e-12)


def test_directions_of_slip_follow_the_elements():
    """A turn in the elastic range is no event, but slip that goes on afterwards is: rest, +, rest, +, rest, -."""
    law = masing.from_elements([2.0, 1.0], [0.2, 0.5])
    slide = np.array([0.0, 1.0, 0.7, 1.2, 0.5])
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(slide)))])
    motion = runs.run_case(make_bench(law, time, slide, samples=[0.0]))
    directions = motion.find_directions()[:, 0]
    slides = np.interp(motion.event_rows[:, 0], time, slide)
    changes = 1 + np.flatnonzero(np.diff(directions))
    # The weakest element yields at 0.2, again where the motion turned at 1, and back from 1.2 after 2 x 0.2.
    assert directions[0] == 0
    assert directions[changes].tolist() == [1, 0, 1, 0, -1]
    assert slides[changes - 1] == pytest.approx([0.2, 1.0, 1.0, 1.2, 0.8], abs=1e-9)


@pytest.mark.parametrize("dwell", [0.05, 0.2, 1.0])
def test_bonds_heal_at_rest_and_restart(dwell):
    """Dwell of bonds (eq. 2.10) long after a steady slide, and the force F = mu N z/eps_0 of the slide after it."""
    # mu = N = eps_0 = l_k = 1, eps_k = 0.5, a_s/v_h = 10/s; at the speed of the slide there is no growth.
    numbers = (1.0, 1.0, 0.5, 1e-3, 1.0, 1e-4, 0.0)
    law = LawNumbers("bonds", numbers, (1.0, 0.5, 0.5, 0.5), (1.0, 1.0, 1.0, 1.0))
    excess = 0.5 * (1 - np.exp(-10 * dwell))
    for slide in (0.25, 1.0, 3.0):
        time = np.array([0.0, dwell, dwell + 1e-6])
        motion = runs.run_case(make_bench(law, time, np.array([0.0, 0.0, slide])))
        m, z, _, eps = motion.final.y[2:6]
        # eps = eps_k + excess exp(-x), and the solution of z' = 1 - z/eps.
        pull = 0.5 * np.exp(slide)
        grown = 0.5 * (0.5 + excess) ** 2 + (pull**2 - 0.25) / 2
        grown += 2 * excess * (pull - 0.5) + excess**2 * slide
        assert eps == pytest.approx(0.5 + excess * np.exp(-slide), rel=1e-9)
        assert z == pytest.approx(grown / (pull + excess) ** 2, rel=1e-9)
        assert m == 1.0


def test_bonds_have_the_loop_of_dahl():
    """Closed loop of bonds of constant length: areas and tip of the exact solution, F_end = tanh(A/eps)."""
    law = LawNumbers(
        "bonds", (1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0), (1.0, 0.0, 0.0, 1.0), (1.0, 1e-2, 1e-4, 1.0)
    )
    for amplitude in (0.1, 1.0, 5.0, 10.0):
        count = 2 * int(20 / amplitude) + 9
        last = runs.run_case(make_bench(law, *triangle(amplitude, count)))
        before = runs.run_case(make_bench(law, *triangle(amplitude, count - 2)))
        work = last.values["friction_work"] - before.values["friction_work"]
        assert work == pytest.approx(4 * amplitude - 4 * np.tanh(amplitude), rel=1e-9)
        # The force mu N z/eps_0 at the tip is the second state of the law.
        assert abs(last.final.y[3]) == pytest.approx(np.tanh(amplitude), rel=1e-9)


@pytest.mark.parametrize("ratio", [1.0, 1.3])
def test_force_of_bonds_that_all_break_does_not_exceed_its_limit(ratio):
    """Over a thousand bond lengths, the force of bonds is that of their last length to 1e-6, and not more."""
    growth = (1e-9, 0.1, 1e-4, 0.0) if ratio > 1 else (0.0, 1.0, 1.0, 0.0)
    law = LawNumbers("bonds", (0.3, 1.0, ratio, *growth), (1.0, 0.0, 0.0, 1.0), (1, 1e-2, 1e-4, 1))
    motion = runs.run_case(make_bench(law, *triangle(1000.0, 5)))
    peak = motion.values["friction_force_peak"]
    assert peak <= 0.3 * ratio
    assert peak == pytest.approx(0.3 * ratio, rel=1e-6)


def test_coulomb_contact_that_lifts_off_follows_the_load():
    """Sliding at constant speed under 1 + 1.5 cos t: work and open time of the positive part of the load."""
    load = cases.Load(1.0, 1.5, 1.0, 0.0)
    ends = np.array([0.0, 2 * np.pi])
    motion = runs.run_case(make_bench(coulomb(0.5), ends, ends, load=load))
    edge = np.arccos(-1 / 1.5)
    assert motion.values["friction_work"] == pytest.approx(
        0.5 * 2 * (edge + 1.5 * np.sin(edge)), rel=1e-10
    )
    assert motion.values["open_fraction"] == pytest.approx(1 - edge / np.pi, rel=1e-10)


def test_springs_that_a_falling_load_cuts_lose_their_energy_at_rest():
    """A load that falls to 0 at rest: the work mu s q^2/(2 eps) of the slide before is lost, its stretch becomes slip."""
    law = LawNumbers("pressed_springs", (0.5, 1.0), (0.0, 2.5), (2.5, 2.5))
    load = cases.Load(1.0, 1.5, 1.0, 0.0)
    for end, part in ((1.5, 0.0), (3.0, 1.0)):
        bench = make_bench(law, np.array([0.0, 0.5, end]), np.array([0.0, 0.2, 0.2]), load=load)
        values = runs.run_case(bench).values
        assert values["friction_work"] == pytest.approx(0.025, rel=1e-9)
        assert values["energy_dissipated"] == pytest.approx(part * 0.025, abs=1e-11)
        assert values["slip_amplitude"] == pytest.approx(part * 0.1, abs=1e-12)


def test_release_ends_at_the_largest_travel():
    """A growing mode reaches the stop at the time of the closed form."""
    case = make_oscillator(
        coulomb(), load=0.0, acceleration=0.0, zeta=-0.05, z=1.0, cycles=50, travel=5.0
    )
    motion = runs.run_case(case)
    assert motion.status is Status.EXCEEDS_TRAVEL
    assert abs(motion.final.y[0]) == pytest.approx(5.0, rel=1e-9)
    assert "travel" in motion.message
