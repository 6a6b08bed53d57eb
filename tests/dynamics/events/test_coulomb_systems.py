"""The exact engine for any basis, start, drive and number of interfaces: against DOP853, a Moreau march, closed forms
and the conservation of energy."""

from math import atan, cos, pi, sin, sqrt

import numpy as np
import pytest
from event_reference import march_reference, run_reference
from event_run import rows_of, run, simulate, starts
from hypothesis import given
from hypothesis import strategies as st
from modal_bases import basis_of, random_basis

from patchfem.core import (
    DriveSegment,
    InitialState,
    NotConverged,
    Outcome,
    PatchfemError,
    SineDrive,
)
from patchfem.dynamics import DRIVE_CHANGE
from patchfem.dynamics.events.event_list import RELEASE, STOP
from patchfem.dynamics.events.positions_kernels import N_COLUMNS, Column, Row
from patchfem.response import energy_balance
from patchfem.structure import drives


def start_of(rng, n):
    return InitialState(rng.normal(size=n), rng.normal(size=n))


def slides(modes, phase, tau):
    z = np.array([s.many(tau) for s in phase.modal])
    return np.asarray(modes.interfaces) @ z


# against other integrators


@pytest.mark.share(1, 2)
@pytest.mark.parametrize(
    "seed, n, faces, ratio, rigid",
    [
        (1, 3, 2, 1.0, False),
        (2, 3, 2, 0.6, False),
        (7, 2, 1, 0.8, True),
        (4, 4, 3, 1.0, True),
        (6, 4, 3, 0.7, False),
    ],
)
def test_exact_coupled_systems_against_dop853(seed, n, faces, ratio, rigid):
    rng = np.random.default_rng(seed)
    modes = random_basis(rng, n, faces, True, rigid)
    static = rng.uniform(0.2, 1.0, faces)
    drive = SineDrive(1.0, 1.2)
    begin = start_of(rng, n)
    wanted = run_reference(
        modes, drive.segments, static, ratio * static, 6 * drive.period, begin.z, begin.v
    )
    found = list(run(modes, drive, static, ratio * static, 6 * drive.period, begin))
    assert [p.directions for p in found] == [w[1] for w in wanted[:-1]] and len(found) > 10
    np.testing.assert_allclose(
        [p.time for p in found], [w[0] for w in wanted[:-1]], rtol=0, atol=1e-10
    )
    z = [[s(0.0) for s in p.modal] for p in found] + [[s(found[-1].span) for s in found[-1].modal]]
    np.testing.assert_allclose(z, [w[2] for w in wanted], rtol=0, atol=1e-11)


def test_exact_steps_and_sines_in_turn_against_dop853():
    rng = np.random.default_rng(11)
    modes = random_basis(rng, 3, 2)
    static = np.array([0.3, 0.5])
    drive = drives.PiecewiseDrive(
        (
            DriveSegment(0.0, 0.7),
            DriveSegment(4.1, 0.0, 2.0, 1.7, 0.4),
            DriveSegment(9.3),
            DriveSegment(14.0, -0.2, 1.5, 0.8, 3.0),
        ),
        5.0,
    )
    wanted = run_reference(modes, drive.segments, static, static, 25.0, np.zeros(3), np.zeros(3))
    found = list(run(modes, drive, static, static, 25.0))
    times = [w[0] for w in wanted]
    states = np.array([w[2] for w in wanted])
    assert len(found) > 12 and set(np.array([4.1, 9.3, 14.0])) <= {round(p.time, 12) for p in found}
    for t, z in zip(times[:-1], states):
        k = int(np.argmin([abs(p.time - t) for p in found]))
        assert abs(found[k].time - t) < 1e-9
        np.testing.assert_allclose([s(0.0) for s in found[k].modal], z, atol=1e-9)
    done = simulate(modes, drive, static, static, 5.0, 2)
    assert energy_balance(done.ledger) < 1e-10
    assert np.count_nonzero(done.log.kind == DRIVE_CHANGE) == 3


def test_order_dependent_interfaces_against_a_march():
    """Three interfaces between two coordinates: dependent when stuck together; a march with
    impulses closes in."""
    rng = np.random.default_rng(9)
    modes = random_basis(rng, 2, 3)
    static = rng.uniform(0.3, 1.0, 3)
    drive = SineDrive(1.0, 1.2)
    begin = start_of(rng, 2)
    done = simulate(modes, drive, static, static, 3, 3, start=begin)
    errors = []
    for steps in (500, 2000):
        t, z = march_reference(modes, drive, static, 3 * drive.period, begin.z, begin.v, steps)
        mine = np.stack(
            [np.interp(t, done.response.time, done.response.modal[:, k]) for k in range(2)], axis=1
        )
        errors.append(np.abs(z - mine).max())
    assert errors[1] < 0.005 and errors[0] / errors[1] > 2.5
    assert energy_balance(done.ledger) < 1e-10


# laws that hold for any system


@given(
    st.integers(0, 10**6),
    st.integers(1, 4),
    st.integers(1, 3),
    st.floats(0.4, 1.0),
    st.booleans(),
    st.booleans(),
)
def test_always_friction_law_and_energy(seed, n, faces, ratio, coupled, rigid):
    rng = np.random.default_rng(seed)
    modes = random_basis(rng, n, faces, coupled, rigid)
    static = rng.uniform(0.05, 1.5, faces)
    drive = SineDrive(rng.uniform(0.2, 2.0), rng.uniform(0.5, 2.0))
    begin = start_of(rng, n)
    done = simulate(modes, drive, static, ratio * static, 4, 4, start=begin)
    assert energy_balance(done.ledger) < 1e-10 and done.ledger["friction"] > 0
    speed = max(1.0, np.abs(done.response.modal_rate).max())
    for phase in run(modes, drive, static, ratio * static, 4 * drive.period, begin):
        tau = np.linspace(0, phase.span, 12)
        z = np.array([s.rate().many(tau) for s in phase.modal])
        rates = np.asarray(modes.interfaces) @ z
        for c, sign in enumerate(phase.directions):
            force = phase.forces[c].many(tau)
            assert np.all(np.abs(force) <= static[c] * (1 + 1e-9))
            if sign:
                np.testing.assert_allclose(force, sign * ratio * static[c], rtol=1e-12)
                assert np.all(sign * rates[c] >= -1e-10 * speed)
            else:
                assert np.abs(rates[c]).max() < 1e-11 * speed


def test_exact_slides_do_not_move_in_stick():
    """To the last bit, in every interface, across the events of the others."""
    rng = np.random.default_rng(5)
    modes = random_basis(rng, 4, 3)
    static = np.array([0.9, 1.1, 0.5])
    done = simulate(modes, SineDrive(1.0, 1.2), static, static, 30, 30, start=start_of(rng, 4))
    log = done.log
    extra = done.window.extra
    time = done.window.time
    assert (
        extra["slides"].shape
        == extra["forces"].shape
        == extra["slide_rates"].shape
        == (time.size, 3)
    )
    stuck = 0
    for c in range(3):
        mine = np.flatnonzero((log.interface == c) & (log.kind == STOP))
        for k in mine:
            later = np.flatnonzero((log.interface == c) & (log.time > log.time[k]))
            end = log.time[later[0]] if later.size else np.inf
            inside = (time >= log.time[k]) & (time < end)
            assert np.all(extra["slides"][inside, c] == log.slide[k])
            assert not extra["slide_rates"][inside, c].any()
            stuck += np.count_nonzero(inside)
    assert stuck > 1000
    np.testing.assert_array_equal(done.window.slide, extra["slides"][:, 0])
    assert np.all(np.abs(extra["forces"]) <= static * (1 + 1e-9))


# several interfaces at once


@pytest.mark.parametrize("joined", [False, True])
def test_exact_two_interfaces_that_stop_together(joined):
    """Two equal blocks, each on its own spring, move as one does alone; also with a third
    interface between them."""
    faces = [[1, 0], [0, 1], [1, -1]] if joined else [[1, 0], [0, 1]]
    modes = basis_of([1.0, 1.0], 0.01, faces, (1, 1), (1, 0))
    drive = SineDrive(1.0, 1.1)
    one = basis_of(1.0, 0.01)
    twin = simulate(modes, drive, 0.6, 0.6, 20, 20)
    alone = simulate(one, drive, 0.6, 0.6, 20, 20)
    np.testing.assert_allclose(twin.amplitudes, alone.amplitudes, atol=1e-13)
    np.testing.assert_allclose(
        twin.window.extra["slides"][:, 1], twin.window.extra["slides"][:, 0], atol=1e-13
    )
    first = twin.log.time[twin.log.interface == 0]
    np.testing.assert_allclose(first, alone.log.time, atol=1e-11)
    np.testing.assert_allclose(twin.log.time[twin.log.interface == 1], first, atol=1e-11)
    assert energy_balance(twin.ledger) < 1e-10
    if joined:
        assert not np.any(twin.log.interface == 2)


@pytest.mark.parametrize("middle", [0.05, 10.0])
def test_exact_three_dependent_interfaces(middle):
    """Blocks 1 and 2 on the ground and on each other: with weak friction between them they stop one after the other,
    with strong friction they move as one of both masses."""
    modes = basis_of([1.0, 1.0], 0.0, [[1, 0], [0, 1], [1, -1]], (1.0, 0.4), (1, 0))
    drive = SineDrive(1.5, 0.9)
    done = simulate(modes, drive, [0.4, 0.6, middle], [0.4, 0.6, middle], 30, 30)
    assert energy_balance(done.ledger) < 1e-10
    extra = done.window.extra
    if middle > 1:
        assert (
            np.array_equal(extra["slides"][:, 0], extra["slides"][:, 1])
            or np.abs(extra["slides"][:, 0] - extra["slides"][:, 1]).max() < 1e-14
        )
        both = simulate(basis_of(1.0, 0.0, ((1.0,),), (0.7,)), drive, 0.5, 0.5, 30, 30)
        np.testing.assert_allclose(done.amplitudes, both.amplitudes, atol=1e-12)
        np.testing.assert_allclose(done.ledger["friction"], 2 * both.ledger["friction"], rtol=1e-11)
    else:
        assert np.ptp(extra["slides"][:, 2]) > 0.01


def test_exact_dependent_stick_holds_up_to_the_sum_of_limits():
    """One coordinate, three interfaces of limits 1, 2, 3: nothing moves below 6; above, all slip
    at once."""
    modes = basis_of(1.0, 0.0, [[1.0], [1.0], [1.0]])
    limit = np.array([1.0, 2.0, 3.0])
    assert not simulate(modes, SineDrive(5.999999, 0.7), limit, limit, 3).response.slide.any()
    done = simulate(modes, SineDrive(6.5, 0.7), limit, limit, 8, 8)
    one = simulate(basis_of(1.0), SineDrive(6.5, 0.7), 6.0, 6.0, 8, 8)
    np.testing.assert_allclose(done.amplitudes, one.amplitudes, atol=1e-13)
    np.testing.assert_allclose(
        done.window.extra["forces"].sum(axis=1)[::50],
        done.window.extra["forces"].sum(axis=1)[::50].clip(-6, 6),
        atol=1e-12,
    )
    assert np.all(np.abs(done.window.extra["forces"]) <= limit * (1 + 1e-12))
    assert done.ledger["friction"] == pytest.approx(one.ledger["friction"], rel=1e-12)


@pytest.mark.parametrize("count", [7, 16])
def test_exact_many_interfaces_stop_and_slip_together(count):
    """Equal blocks: seven, more than are tried one by one, and sixteen, more than whose
    combinations are tried."""
    modes = basis_of(np.ones(count), 0.02, np.eye(count), np.ones(count), np.eye(count)[0])
    drive = SineDrive(1.0, 1.1)
    many = simulate(modes, drive, 0.5, 0.5, 6, 6)
    one = simulate(basis_of(1.0, 0.02), drive, 0.5, 0.5, 6, 6)
    np.testing.assert_allclose(many.amplitudes, one.amplitudes, atol=1e-13)
    assert np.ptp(many.window.extra["slides"], axis=1).max() < 1e-13
    assert energy_balance(many.ledger) < 1e-10


def choice_at_rest(seed, n, faces, ratio):
    """Require that accelerations agree with the signs of slip and forces with their limits, of
    faces that all rest."""
    rng = np.random.default_rng(seed)
    modes = random_basis(rng, n, faces)
    static = rng.uniform(0.1, 1.0, faces)
    z = rng.normal(size=n)
    v = np.zeros(n)
    rows = np.asarray(modes.interfaces)
    drive = drives.PiecewiseDrive((DriveSegment(0.0, 0.7, 0.5, 1.0, 0.64),), 2 * pi)
    one, first = rows_of(modes, drive, static, ratio * static, 1e-3, InitialState(z, v))
    out = one.evaluate_rows(first, np.zeros(1, np.int64), np.zeros(1))[0]
    forces = out[2 * n + 3 :: 6]
    pull = (
        -(modes.omega**2) * out[:n]
        - modes.damping_matrix @ out[n : 2 * n]
        - modes.base * out[2 * n]
    )
    accel = rows @ (pull - forces @ rows / modes.mass)
    assert np.all(np.abs(forces) <= static * (1 + 1e-9))
    ways = first[0, one._column_index(0, Column.DIRECTION) :: N_COLUMNS]
    for c, sign in enumerate(ways):
        if sign:
            assert sign * accel[c] > 0 and forces[c] == pytest.approx(
                sign * ratio * static[c], rel=1e-12
            )
        else:
            assert abs(accel[c]) < 1e-9


@given(st.integers(0, 10**6), st.integers(5, 16), st.floats(0.3, 1.0))
def test_always_interfaces_that_rest_at_once_satisfy_the_law(seed, faces, ratio):
    """Up to 16 independent interfaces; up to 8 that depend on each other, of which every
    combination is tried."""
    choice_at_rest(seed, max(8, faces) if faces > 8 or seed % 2 else 4, faces, ratio)


def test_always_a_combination_that_is_not_found_is_refused():
    """Sixteen interfaces of eight modes: a right answer, or a refusal that names the method to
    use."""
    refused = 0
    for seed in range(10):
        try:
            choice_at_rest(seed, 8, 16, 0.6)
        except NotConverged as error:
            assert 'use accuracy.method = "march"' in str(error)
            refused += 1
    assert 0 < refused < 10


# starts, drives and printed numbers

FREE = drives.make_release(2 * pi)


def test_exact_belt():
    """Mass on a spring on a belt of speed 0.1, static 1, kinetic 0.6; the belt is a coordinate
    of near endless mass."""
    tiny = 1e-8
    speed = 0.1
    modes = basis_of([1.0, 0.0], 0.0, [[1.0, -tiny]], (0, 0), (1, 0))
    begin = InitialState(np.zeros(2), np.array([speed, speed / tiny]))
    done = simulate(modes, drives.make_release(2 * pi), 1.0, 0.6, 30.0, 10, start=begin)
    releases = done.log.time[np.abs(done.log.kind) == RELEASE]
    np.testing.assert_allclose(np.diff(releases)[2:], 8 + 2 * (pi - atan(4)), atol=1e-9)
    assert 8 + 2 * (pi - atan(4)) == pytest.approx(11.6315499798, abs=1e-10)
    assert done.amplitudes[-5:, 1].max() == pytest.approx(0.6 + sqrt(0.17), abs=1e-10)
    assert done.amplitudes[-5:, 0].min() == pytest.approx(0.6 - sqrt(0.17), abs=1e-10)


@pytest.mark.parametrize(
    "d, peak", [(1.0, 0.0), (0.9999, 4.38443200739e-8), (0.99, 2.32402008463e-4)]
)
def test_exact_grazing_onset(d, peak):
    done = simulate(basis_of(1.0, 0.003), SineDrive(1.0, 1.0), d, d, 30, 30)
    assert np.abs(done.amplitudes[-1]).max() == pytest.approx(peak, rel=1e-11)


@pytest.mark.parametrize("miss", [1e-4, 1e-6, 1e-8, 1e-10])
def test_exact_first_slip_tends_to_its_law(miss):
    """9/2 (1 - D)^2; the instant of release is known to eps/(1 - D) of it: the condition number."""
    phases = list(run(basis_of(1.0, 0.003), SineDrive(1.0, 1.0), 1 - miss, 1 - miss, pi))
    stop = next(p for p in phases[1:] if p.direction == 0)
    found = abs(stop.modal[0](0.0))
    assert found == pytest.approx(4.5 * miss**2, rel=3 * sqrt(miss) + 1e-15 / miss)
    if miss == 1e-6:
        assert found == pytest.approx(4.4988e-12, rel=2e-5)


def test_exact_phase_after_a_million_cycles():
    """Stuck for a million cycles (the clock is put there), then 1.25 times the amplitude: the motion is the one from
    rest, at the same phases."""
    rate = 2 * pi * 0.37
    drive = drives.make_levels([0.5, 1.25], rate, 10**6)
    modes = basis_of(rate, 0.003)
    _, late = rows_of(modes, drive, 1.0, 1.0, 10**6 + 4, begin=10**6 - 1)
    _, early = rows_of(modes, SineDrive(1.25, rate), 1.0, 1.0, 4)
    late = late[late[:, 5] >= 10**6]
    assert len(late) == len(early)
    np.testing.assert_allclose(late[:, 6], early[:, 6], rtol=0, atol=1e-14)
    np.testing.assert_allclose(late[:, 1:3], early[:, 1:3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(late[:, 8:], early[:, 8:], rtol=0, atol=1e-14)


def test_exact_force_drive_leaves_the_frame_at_rest():
    modes = basis_of(1.0, 0.05)
    base, force = (
        simulate(modes, SineDrive(1.0, 0.8, moving), 0.5, 0.5, 20) for moving in (True, False)
    )
    np.testing.assert_array_equal(base.window.slide, force.window.slide)
    assert not force.window.base_acceleration.any()
    np.testing.assert_allclose(
        base.window.acceleration - force.window.acceleration,
        np.sin(0.8 * base.window.time),
        atol=1e-11,
    )
    assert base.acceleration == pytest.approx(np.abs(base.window.acceleration).max(), rel=1e-3)
    assert force.acceleration == pytest.approx(np.abs(force.window.acceleration).max(), rel=1e-3)


def test_table_check_9_waveform():
    done = simulate(basis_of(1.0, 0.003), SineDrive(1.0, 1.0), 0.82802, 0.82802, 200)
    stops = done.log.phase[-9:][done.log.kind[-9:] == STOP] % pi
    np.testing.assert_allclose(np.degrees(starts(done)), 42.69, atol=0.03)
    np.testing.assert_allclose(np.degrees(stops), 164.09, atol=0.03)
    w = done.window
    assert np.abs(w.slide_rate).max() == pytest.approx(0.2529, abs=1e-3)
    k = np.flatnonzero(np.abs(np.diff(w.force)) > 0.3)
    np.testing.assert_allclose(np.abs(w.force[k]), 0.8280, atol=1e-3)
    np.testing.assert_allclose(np.abs(w.force[k + 1]), 0.1241, atol=1e-3)
    np.testing.assert_allclose(np.abs(w.acceleration[k + 1] - w.acceleration[k]), 0.7039, atol=1e-3)
    assert done.loops[0].stuck_time / (w.time[-1] - w.time[0]) == pytest.approx(0.3256, abs=1e-3)


def test_refuses_a_start_beyond_the_travel():
    with pytest.raises(PatchfemError, match=r"structure\.travel"):
        simulate(
            basis_of(1.0),
            FREE,
            1.0,
            1.0,
            3,
            travel=2.0,
            start=InitialState(np.array([-3.0]), np.zeros(1)),
        )
    done = simulate(
        basis_of(1.0),
        FREE,
        0.1,
        0.1,
        3,
        travel=2.0,
        start=InitialState(np.array([1.0]), np.array([3.0])),
    )
    assert done.outcome is Outcome.EXCEEDS_TRAVEL  # 1.1 cos t + 3 sin t - 0.1 passes 2
    at = done.response.time[-1]
    assert 1.1 * cos(at) + 3 * sin(at) - 0.1 == pytest.approx(2.0, rel=1e-12) and at < 1
    assert energy_balance(done.ledger) < 1e-12


@pytest.mark.parametrize("kinetic", [1.1, -0.1])
def test_refuses_kinetic_friction_out_of_range(kinetic):
    with pytest.raises(PatchfemError, match=r"friction\.kinetic"):
        simulate(basis_of(1.0), SineDrive(1.0, 1.0), 1.0, kinetic, 3)


def test_exact_coordinates_stay_on_the_stuck_slide():
    """The coordinates move on while the interface sticks; their slide stays where it stopped,
    over 300 cycles."""
    h = sqrt(0.5)
    modes = basis_of([0.0, 1.4], 0.1, [[h, -0.6]], (-h, -0.8))
    one, rows = rows_of(modes, drives.make_levels([4.0, 0.3], 1.14, 3), 1.5, 1.5, 300)
    rows = rows[rows[:, Row.CYCLE] >= 20]
    held = rows[0, one._column_index(0, Column.SLIDE)]
    z = rows[:, Row.MOTION : Row.MOTION + 2]
    assert (
        not rows[:, one._column_index(0, Column.DIRECTION)].any()
        and np.all(rows[:, one._column_index(0, Column.SLIDE)] == held)
        and abs(held) > 0.1
    )
    assert np.abs(z @ modes.interfaces[0] - held).max() < 4e-16 * np.abs(z).max()


def test_exact_interface_without_friction_among_others():
    """Interface 0 has no friction: the run is that of the other one alone."""
    modes = basis_of([1.0, 1.7], 0.02, [[1.0, 0.4], [0.3, -1.0]], (1, 0.5), (1, 1))
    alone = basis_of([1.0, 1.7], 0.02, [[0.3, -1.0]], (1, 0.5), (1, 1))
    drive = SineDrive(1.0, 1.2)
    two = simulate(modes, drive, [0.0, 0.4], [0.0, 0.4], 20, 5)
    one = simulate(alone, drive, 0.4, 0.4, 20, 5)
    np.testing.assert_allclose(two.amplitudes, one.amplitudes, rtol=1e-13)
    np.testing.assert_allclose(two.log.time, one.log.time, rtol=1e-14)
    assert (
        set(two.log.interface) == {1}
        and two.loops[0].stuck_time == 0
        and not two.window.force.any()
    )
    away = np.abs(one.window.time[:, None] - one.log.time).min(axis=1) > 1e-9  # of the jumps
    force = np.interp(one.window.time[away], two.window.time, two.window.extra["forces"][:, 1])
    np.testing.assert_allclose(force, one.window.force[away], atol=1e-11)
    assert two.ledger["friction"] == pytest.approx(one.ledger["friction"], rel=1e-13)
