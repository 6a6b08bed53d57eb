"""Stops and releases inside a step of a march under set-valued friction: against the exact engine, events, energies."""

import numpy as np
import pytest
from event_run import simulate
from scipy.integrate import solve_ivp

from patchfem.compiled.plain import plain
from patchfem.core import BaseSine, ModalBasis
from patchfem.dynamics.contacts.arrays import Stops
from patchfem.dynamics.march import varying_load
from patchfem.dynamics.march.march import march, modal_arrays
from patchfem.dynamics.march.models import coulomb_model
from patchfem.dynamics.propagator import propagator

stops, modal = map(plain, ("patchfem.dynamics.march.stops_kernels", "patchfem.dynamics.modal_kernels"))  # as Python


def one(zeta=0.02):
    unit = np.ones(1)
    return ModalBasis(("m",), unit, zeta * unit, unit, -unit, unit, 1.0)


def some(seed, damping=False):
    """Three or four modes that share one interface, coupled by their damping or not."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 5))
    root = rng.normal(size=(n, n))
    slide = np.append(1.0, rng.uniform(0.3, 1.0, n - 1) * rng.choice([-1, 1], n - 1))
    return ModalBasis(tuple("abcd"[:n]), np.sort(rng.uniform(0.5, 6.0, n)), np.full(n, 0.02), slide,
                      rng.uniform(-1, 1, n), slide, 1.0, 0.05 * root @ root.T if damping else None)


def closes(done):
    """Gap of the energy balance over the energy that passed, and the energy that steps created [J]."""
    book = done.ledger
    miss = book["work_in"] - book["stored"] - book["viscous"] - book["friction"]
    return abs(miss) / (book["power"] + book["peak_stored"]), done.response.extra["ledger"][3, -1]


def falling(modes, drive, static, kinetic, cycles, steps):
    """Largest error of the extremes of all cycles over the largest of them, beside the exact engine, by steps."""
    truth, errors = simulate(modes, drive, static, kinetic, cycles, 2), []
    for count in steps:
        done = march(modes, drive, coulomb_model(static, kinetic), cycles, count, window=cycles)
        balance, created = closes(done)
        assert done.outcome is None and balance < 1e-11 and created == 0.0
        assert done.ledger["friction"] == pytest.approx(truth.ledger["friction"], rel=20 * cycles / count)
        errors.append(np.abs(done.amplitudes - truth.amplitudes).max() / np.abs(truth.amplitudes).max())
    return np.array(errors)


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("ratio", [1.0, 0.5, 0.2])
def test_order_two_of_kinetic_friction_below_static(ratio):
    """1 kg, 1 N/m, damping .02, 1 N at .3 rad/s against 0.8 N: .98783 at half, where it came to .84 .. .98 before."""
    errors = falling(one(), BaseSine(1.0, 0.3, False), 0.8, 0.8 * ratio, 20, (400, 1600, 6400))
    assert errors[0] < 1e-4 and np.all(errors[1:] < errors[:-1] / 6)
    assert np.log(errors[0] / errors[2]) / np.log(16) > 1.8


def test_exact_amplitude_of_kinetic_friction_at_half_of_static():
    done = march(one(), BaseSine(1.0, 0.3, False), coulomb_model(0.8, 0.4), 20, 6400, window=2)
    assert np.ptp(done.amplitudes[-2:], axis=1).mean() / 2 == pytest.approx(0.98783483, abs=2e-8)


@pytest.mark.parametrize("seed, damping, ratio", [(3, False, 0.6), (5, True, 0.3)])
def test_order_two_of_stops_and_releases_of_several_modes(seed, damping, ratio):
    errors = falling(some(seed, damping), BaseSine(1.0, 0.45), 0.1, 0.1 * ratio, 6, (400, 1600, 6400))
    assert errors[0] < 1e-4 and np.log(errors[0] / errors[2]) / np.log(16) > 1.6


def test_exact_a_slide_that_holds_has_no_speed():
    done = march(some(3), BaseSine(1.0, 0.45), coulomb_model(0.1, 0.05), 6, 400, window=6)
    r = done.response
    held = np.flatnonzero(np.diff(r.slide) == 0.0)
    assert held.size > 100 and np.abs(r.slide_rate[held + 1]).max() <= 1e-13 * np.abs(r.slide_rate).max()
    assert np.abs(r.force).max() <= 0.1 * (1 + 1e-12) and closes(done)[0] < 1e-11


def face(free, rate, start, give, static, kinetic, rest):
    """A set-valued face at the start of a step: free slide and speed, speed at the start, what a newton takes from
    slide, speed and acceleration, limits (2,) at the ends of the step, whether it rests."""
    limit = np.array([[static[0]], [kinetic[0]], [static[1]], [kinetic[1]]])
    s = Stops(np.zeros(1, np.int64), np.zeros(1, np.int64), limit, np.array(give).reshape(3, 1, 1),
              np.ones((1, 1)), np.zeros((1, 1)), np.zeros((18, 1)))
    s.field[[stops.FREE, stops.RATE, stops.START, stops.REST], 0] = free, rate, start, rest
    return s


@pytest.mark.share(0)
@pytest.mark.parametrize("count", [1000, 4000])
def test_always_a_step_takes_energy_and_no_more_than_static_friction(count):
    """Slides, speeds and friction at random, stiff or soft beside the step: where stops are found and their work is not
    below 0, work plus blow is that work, the face moves as its forces say, |mean force| <= mu_s N."""
    rng, found = np.random.default_rng(8), 0
    for _ in range(count):
        dt, share = 10 ** rng.uniform(-3, 0), 10 ** rng.uniform(-2, 2)
        beta, gamma = share * dt * dt / 2 * rng.uniform(0.1, 1.1), share * dt * rng.uniform(0.1, 1.1)
        s0, s1 = rng.uniform(0, 2, 2)
        k0, k1 = np.array([s0, s1]) * rng.choice([0.0, 0.3, 1.0])
        v = rng.choice([0.0, 1e-12, 0.1, 1.0]) * rng.normal() * share * dt
        rest = bool(rng.integers(2))
        free = (0.0 if rest else v * dt) + beta * rng.normal() * 2
        rate = (0.0 if rest else v) + gamma * rng.normal() * 2
        one = face(free, rate, v, (beta, gamma, share), (s0, s1), (k0, k1), rest)
        if not (stops.stays(one) or stops.watched(dt, one)) or not stops.met(one):
            continue
        work = stops.blows(one)
        dq, used, speed = one.field[[stops.DQ, stops.MEAN, stops.SPEED], 0]
        motion = np.array([[0.0], [rate - gamma * used]])
        end = motion[1, 0]
        lost = stops.struck(motion, 1 / share, one)
        noise = 1e-13 * (abs(used * free) + end * end / share)
        assert abs(used) <= max(s0, s1) * (1 + 1e-9) + 1e-13 * abs(free) / beta
        assert dq == pytest.approx(free - beta * used, abs=1e-13 * abs(free))
        assert work == pytest.approx(used * dq + lost, abs=1e-9 * abs(work) + noise)
        assert motion[1, 0] == pytest.approx(speed, abs=1e-12 * (abs(end) + abs(speed)))
        assert one.field[stops.WAY, 0] != 0.0 or speed == 0.0
        found += work >= 0
    assert found > 0.375 * count


def by_small_steps(v, h, s, k, gain, rest, count=5_000):
    """(slide over dt, speed, rest) of dry friction under a holding force h(x) that is a line, by plain small steps."""
    slide, x = 0.0, (np.arange(count) + 0.5) / count
    force, static, kinetic = (a + (b - a) * x for a, b in (h, s, k))
    v = 0.0 if rest else v
    for f, most, less in zip(force, static, kinetic):
        if rest and abs(f) <= most:
            continue
        way = np.sign(f) if rest else np.sign(v)
        new = v + gain / count * (f - way * less)
        rest = new * way <= 0
        new = 0.0 if rest else new
        slide, v = slide + (v + new) / 2 / count, new
    return slide, v, rest


def test_exact_slide_inside_a_step_is_that_of_small_steps():
    rng, turned = np.random.default_rng(5), 0
    for _ in range(30):
        v, gain, rest = rng.normal(), rng.uniform(0.5, 5.0), bool(rng.integers(2))
        h, s = rng.normal(size=2) * 2, rng.uniform(0.2, 1.5, 2)
        k = s * rng.uniform(0, 1)
        one = face(0.0, 0.0, v, (0.5, 1.0, gain), s, k, rest)
        v = 0.0 if rest else v
        way = np.sign(v)
        one.field[[stops.FIRST, stops.LAST, stops.SPEED, stops.WAY, stops.SLIDES], 0] = *h, v, way, abs(way)
        assert stops.followed(1.0, one)
        want = by_small_steps(v, h, s, k, gain, rest)
        assert one.field[[stops.SLIDE, stops.SPEED], 0] == pytest.approx(want[:2], abs=4e-3 * gain)
        assert (one.field[stops.WAY, 0] == 0.0) == want[2]
        turned += one.field[stops.WAY, 0] != way
    assert turned > 10


def by_events(drive, load, static, kinetic, at):
    """Slides (k,) [m] at times (k,) of the unit mass under a load in time: stick and slip of DOP853 between events."""
    def need(t, z):
        return float(drive.values(np.array([t]))[0]) - z

    t, y, end, slides = 0.0, np.zeros(2), at[-1], np.zeros(len(at))
    while t < end:
        z, way = y[0], np.sign(need(t, y[0]))
        if abs(need(t, z)) <= static * load(t) * (1 + 1e-12):
            def over(u, _, z=z):
                return abs(need(u, z)) - static * load(u)

            over.terminal, over.direction = True, 1
            stuck = solve_ivp(lambda u, _: [0.0], (t, end), [0.0], events=over, max_step=0.02, rtol=1e-11)
            slides[(at >= t) & (at <= stuck.t[-1])] = z
            t, way = stuck.t[-1], np.sign(need(stuck.t[-1], z))
            if t >= end:
                break

        def rate(u, x, way=way):
            return [x[1], need(u, x[0]) - 0.04 * x[1] - way * kinetic * load(u)]

        def stop(u, x, way=way, begun=t):
            return way * x[1] if u > begun + 1e-6 else 1.0

        stop.terminal, stop.direction = True, -1
        done = solve_ivp(rate, (t, end), [z, 0.0], "DOP853", events=stop, rtol=1e-11, atol=1e-13, max_step=0.05,
                         dense_output=True)
        inner = (at >= t) & (at <= done.t[-1])
        slides[inner] = done.sol(at[inner])[0]
        t, y = done.t[-1], np.array([done.y[0, -1], 0.0])
    return slides


@pytest.mark.slow  # Coulomb under a load in time: a loop to compile
def test_order_two_of_stops_under_a_load_in_time():
    """Kinetic friction at .4 of static on a load that swings by a half at another frequency, against events."""
    drive, errors = BaseSine(1.0, 0.6, False), []

    def load(t):
        return 0.8 + 0.4 * np.sin(1.1 * t)

    truth = by_events(drive, load, 1.0, 0.4, np.linspace(0, 3 * drive.period, 41))
    for steps in (200, 800, 3200):
        done = varying_load.march(one(), drive, None, varying_load.coulomb(1.0, 0.4), 3, steps, 3, load=load)
        balance, created = closes(done)
        assert done.outcome is None and balance < 1e-11 and created == 0.0
        errors.append(np.abs(done.response.slide[::3 * steps // 40] - truth).max() / np.abs(truth).max())
    assert errors[0] < 1e-2 and errors[1] < errors[0] / 4 and errors[2] < errors[1] / 4


@pytest.mark.parametrize("coupled", [False, True])
def test_exact_force_that_holds_at_the_end_of_a_step(coupled):
    """Against the equation of motion, integrated over a step under a constant force: the slide that stops there stays
    where the force is the one that leaves it no acceleration."""
    rng, n, drive = np.random.default_rng(4), 3, BaseSine(30.0, 70.0)
    omega, zeta, mass, used = np.array([300.0, 700.0, 1500.0]), np.array([0.02, 0.1, 0.3]), 0.7, 4.0
    slide, base = np.array([1.0, -0.6, 0.4]), np.array([0.9, 0.5, -0.3])
    damping = np.diag(2 * zeta * omega)
    if coupled:
        spread = rng.normal(size=(n, n))
        damping += 40 * spread @ spread.T
    modes = ModalBasis(tuple("abc"), omega, zeta, slide, base, slide, mass, damping=damping if coupled else None)
    prop = propagator(modes, drive, 37)
    table, at, motion = prop.tables(drive, 0, 37), 5, rng.normal(size=(2, n)) * np.array([[1e-3], [0.3]])

    def pull(t, z, v):
        return -base * float(drive.values(np.array([t]))[0]) - omega**2 * z - damping @ v

    def rates(t, state):
        return np.concatenate([state[n:], pull(t, state[:n], state[n:]) - slide * used / mass])

    end = (at + 1) * prop.dt
    done = solve_ivp(rates, (at * prop.dt, end), motion.ravel(), "DOP853", rtol=1e-12, atol=1e-16)
    z, v = done.y[:, -1].reshape(2, n).copy()
    v -= slide * (slide @ v) / (slide @ slide)
    need = slide @ pull(end, z, v) * mass / (slide @ slide)
    plant, room, out = modal_arrays(modes, prop), np.zeros((3, n)), np.zeros((2, n))
    modal.ended(motion, plant.free, plant.push, plant.dense, table, at, -slide * used / mass, out)
    assert out == pytest.approx(done.y[:, -1].reshape(2, n), rel=1e-9)
    one = face(0.0, 0.0, 0.0, (1.0, 1.0, slide @ slide / mass), (1e9, 1e9), (1.0, 1.0), True)._replace(rows=slide[None])
    there = float(drive.values(np.array([end]))[0])
    for rate in (out[1].copy(), v):  # as it moves, and brought to rest
        moved, accel = np.array([z, rate]), np.zeros(n)
        assert stops.stays_to_the_end(moved, plant, there, accel, room[1:], one)
        assert one.field[stops.FOUND, 0] == pytest.approx(need, rel=1e-9)
        assert slide @ moved[1] == pytest.approx(0.0, abs=1e-12)
