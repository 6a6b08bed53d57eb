"""Motions of one mode side by side: the same as alone to the last bit, and as the loop that reads inside its steps."""

import numpy as np
import pytest
from march_paths import OMEGA, one_mode
from test_smooth import LOAD, MASS, ONE, SINE, THREE, element

from patchfem import compiled
from patchfem.core import BaseSine, Start
from patchfem.dynamics.smooth import lane_step, lanes, many
from patchfem.dynamics.smooth.arrays import Kept, Moving
from patchfem.dynamics.smooth.run import TURNS, Run
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.laws.stretch import points_element
from patchfem.friction.laws.tanh import Rate

LAWS = {"bonds": Bonds(0.3, 5e-6), "fresh": Bonds(0.3, 5e-5, initial=0.3), "tanh": Rate(0.3, 1e-2),
        "stiff": Rate(0.3, 1e-4)}
PERIOD = SINE.period


def test_exact_series_are_sine_and_exponential():
    from patchfem.compiled import series_kernels as series

    x = np.linspace(-20, 20, 4001)
    assert np.array([series.sine(one) for one in x]) == pytest.approx(np.sin(x), rel=0, abs=4e-16)
    x = np.array([0.0, 1e-12, 1e3 + 0.2, 1e5 + 0.3, -1e6])
    assert np.array([series.sine(one) for one in x]) == pytest.approx(np.sin(x), rel=3e-16, abs=4e-16)
    x = np.concatenate([np.linspace(-7, 70, 3001), np.geomspace(1e-15, 1, 50), [0.0, 500.0]])
    assert np.array([series.gone(one) for one in x]) == pytest.approx(-np.expm1(-x), rel=4e-15)


@pytest.mark.share(0, 1, 3)
@pytest.mark.parametrize("name", LAWS)
def test_exact_forces_without_branches_are_those_of_the_law(name):
    law = element(LAWS[name])
    kernels = compiled.load(law.kernels).module()
    num, mem, turn, none = law.numbers[None], law.memory[None], np.array([1.0, np.inf, 1.0]), np.zeros(0)
    for way in (1.0, -1.0):
        turn[0], turn[1] = way, kernels.begin(num, mem, way, none)
        four = kernels.ahead(num, mem, way)
        for slide in np.concatenate([[0.0], np.geomspace(1e-12, 1e-3, 30)]) * way:
            speed = 300 * slide
            found = kernels.along(*four, slide, speed)
            assert found == pytest.approx(kernels.rate(num, mem, turn, slide, speed, none, none), rel=1e-14,
                                           abs=1e-14 * law.limit)
        kernels.finish(num, mem, turn, 3e-5 * way, 0.0, none)


def of_eight(law, given: dict):
    """(rows of `lane_step` by name after the series and the step of its lanes, its rows) for numbers `given`."""
    rows = np.zeros((len(lane_step.ROWS), lane_step.LANES))
    at = {name: rows[row] for name, row in lane_step.ROWS.items()}
    for name, value in given.items():
        at[name][:] = value
    kernels, flat = lane_step.step_of(compiled.load(law.kernels)).module(), rows.ravel()
    kernels.series(flat)
    kernels.moved(flat)
    return at


def numbers_of(law, way: float = 1.0) -> dict:
    """The rows n0 to n3 of a law that begins to move."""
    kernels = compiled.load(law.kernels).module()
    return dict(zip(("n0", "n1", "n2", "n3"), kernels.ahead(law.numbers[None], law.memory[None], way)))


def numpy_series(kernels, given: dict, z: float, v: float):
    """Coefficients of rate and force in units of time: the twin of `lane_step`, by convolutions."""
    g, order = given, lane_step.ORDER
    y, w, force, z, v = np.zeros(order), np.zeros(order), np.zeros(order), [z], [v]
    turn = g["pace"] * g["t"] + g["phase"]
    for k in range(order):
        y[k] = g["n0"] * (g["slide"] * (v if kernels.OF_SPEED else z)[k])
        a, b, c = kernels.GROWS
        rise = b * w + c * np.convolve(w, w)[:order] + a * (np.arange(order) == 0)
        own = np.convolve(y[1:] * np.arange(1, order), rise)
        w[k] = own[k - 1] / k if k else kernels.share(y[0])
        mixed = y[k] - np.convolve(y, w)[k]
        force[k] = g["n1"] * (k == 0) + g["n2"] * w[k] + g["n3"] * mixed
        wave = g["push"] * (g["pace"] * g["unit"])**k / np.prod(np.arange(1.0, k + 1)) * np.sin(turn + k * np.pi / 2)
        slope = -g["damp"] * v[k] - g["stiff"] * z[k] - g["gain"] * force[k] - wave
        z.append(g["unit"] * v[k] / (k + 1))
        v.append(g["unit"] * slope / (k + 1))
    return np.array(v), force


@pytest.mark.share(0, 1, 3)
@pytest.mark.parametrize("name", LAWS)
def test_exact_a_series_of_eight_is_that_in_numpy(name):
    law = element(LAWS[name])
    kernels = compiled.load(law.kernels).module()
    given = {"stiff": OMEGA**2, "damp": 6e-3 * OMEGA, "gain": 0.8 / MASS, "push": SINE.acceleration, "pace": OMEGA,
             "phase": 0.3, "slide": 0.8, "t": 0.7e-3, "unit": 4e-5, "h": 3e-5, "allowed": 1e-9, **numbers_of(law)}
    starts = np.array([np.linspace(0, 4e-6, 8), np.geomspace(1e-4, 0.02, 8)])
    at = of_eight(law, given | {"z0": starts[0], "v0": starts[1]})
    for lane, (z, v) in enumerate(starts.T):
        rates, force = numpy_series(kernels, given, z, v)
        for found, wanted in ((at, rates), (at, force)):
            letter = "v" if wanted is rates else "f"
            first = 1 if wanted is rates else 0
            got = np.array([found[f"{letter}{k}"][lane] for k in range(first, len(wanted))])
            assert got == pytest.approx(wanted[first:], rel=1e-9, abs=1e-12 * abs(wanted).max())
        rates[1:] = [at[f"v{k}"][lane] for k in range(1, len(rates))]
        end, powers = 0.75, np.arange(lane_step.ORDER + 1)
        assert at["v"][lane] == pytest.approx(rates @ end**powers, rel=1e-12)
        assert at["z"][lane] == pytest.approx(z + 3e-5 * (rates / (powers + 1)) @ end**powers, rel=1e-12)


@pytest.mark.slow
def test_exact_a_step_against_tanh_alone_is_its_closed_form():
    """m v' = -F tanh(v/w): sinh(v/w) decays as exp(-F t/(m w))."""
    law, w = element(Rate(0.3, 1e-2)), 1e-2
    rate = 0.3 * LOAD / (MASS * w)
    start = np.linspace(0.2, 3.0, 8) * w
    at = of_eight(law, {"gain": 1 / MASS, "slide": 1.0, "unit": 0.25 / rate, "h": 0.2 / rate, "allowed": 1e-9,
                        "v0": start, **numbers_of(law)})
    wanted = w * np.arcsinh(np.sinh(start / w) * np.exp(-0.2))
    assert at["v"] == pytest.approx(wanted, rel=1e-13)
    assert MASS * (start**2 - at["v"]**2) / 2 == pytest.approx(at["rub"], rel=1e-11)
    assert np.all(at["defect"] < 1e-3)


def test_exact_a_step_against_fresh_bonds_alone_keeps_their_energy():
    """m v^2/2 and mu N (z - eps (1 - exp(-z/eps))) of full-grown bonds."""
    law, eps = element(LAWS["bonds"]), 5e-6
    start = np.linspace(0.01, 0.03, 8)
    at = of_eight(law, {"gain": 1 / MASS, "slide": 1.0, "unit": 1e-4, "h": 1e-4, "allowed": 1e-9, "v0": start,
                        **numbers_of(law)})
    spent = 0.3 * LOAD * (at["z"] + eps * np.expm1(-at["z"] / eps))
    assert MASS * (start**2 - at["v"]**2) / 2 == pytest.approx(spent, rel=1e-10)
    assert at["rub"] == pytest.approx(spent, rel=1e-10)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("slide", [1.0, -0.7])
def test_exact_a_lane_moves_as_the_loop_does(name, slide):
    modes = one_mode(OMEGA, 0.003, MASS)
    modes = type(modes)(modes.names, modes.omega, modes.zeta, np.array([slide]), modes.base, modes.output, MASS)
    start = Start(np.array([1e-5]), np.array([0.02]))
    beside, alone = (Run(modes, SINE, element(LAWS[name]), 12, one, start=start) for one in (1e-11, 1e-13))
    alone.swift = False
    assert beside.swift
    for run in (beside, alone):
        run.until(11.3 * PERIOD)
    size = abs(alone.kept.cycles[:2]).max()
    assert abs(beside.moving.y[0] - alone.moving.y[0]) < 1e-9 * size
    assert beside.moving.y[2:] == pytest.approx(alone.moving.y[2:], rel=1e-8)
    assert beside.kept.cycles[:2, :11] == pytest.approx(alone.kept.cycles[:2, :11], abs=1e-9 * size)
    assert beside.kept.cycles[2:, :11] == pytest.approx(alone.kept.cycles[2:, :11], abs=1e-9 * size)
    one, other = (np.concatenate(run.turns) for run in (beside, alone))
    assert len(one) == len(other) > 20
    assert np.all(abs(one - other).max(axis=0) <= 1e-7 * np.maximum(abs(other).max(axis=0), 1e-9))
    one, other = beside.book(), alone.book()
    for key in ("work_in", "viscous", "friction", "peak_stored"):
        assert one[key] == pytest.approx(other[key], rel=0.1 if key == "peak_stored" else 1e-9), key


def through(run, times):
    """The energy book [J] of a Run that ends a step at each of the times [s], and its rate [m/s] there (k,)."""
    rates = []
    for time in times:
        run.until(time)
        rates.append(run.moving.y[1])
    return run.book(), np.array(rates)


@pytest.mark.parametrize("name", LAWS)
def test_exact_the_power_of_the_drive_is_summed_on_both_sides_of_its_zeros(name):
    """Within a step |power| bends only where the drive passes zero: its rate has one sign between two reversals.

    Six Gauss points miss a bend by e(s) h^2 |slope|, at the share s of a step of h; a step ends at each zero: nothing.
    """
    zeros = PERIOD / 2 * np.arange(1, 23)
    runs = [Run(ONE, SINE, element(LAWS[name]), 12, 1e-11) for _ in range(3)]
    runs[1].swift = False
    (split, rates), (other, _) = through(runs[0], zeros), through(runs[1], zeros)
    assert split["power"] == pytest.approx(other["power"], rel=1e-9)
    runs[2].until(zeros[-1])
    shares, x, weights = np.linspace(0, 1, 1001), (1 + lane_step.NODES) / 2, lane_step.WEIGHTS / 2
    missed = abs(abs(x - shares[:, None]) @ weights - (shares**2 + (1 - shares)**2) / 2).max()
    slopes, longest = MASS * SINE.acceleration * OMEGA * abs(rates[:-1]), 1.2 / OMEGA  # TURN of `lane_kernels`
    bar = missed * longest**2 * slopes.sum() + 1e-9 * split["power"]
    assert missed < 0.01 and abs(runs[2].book()["power"] - split["power"]) <= bar < 0.01 * split["power"]


def together(runs):
    """The motions of Runs as one Moving and one Kept of many."""
    moving, kept = ([getattr(run, name) for run in runs] for name in ("moving", "kept"))
    pairs = ((Moving, moving, lanes.OF_MOVING), (Kept, kept, lanes.OF_KEPT))
    return [kind(*(getattr(parts[0], name) if name in shared else np.stack([getattr(one, name) for one in parts])
                   for name in kind._fields)) for kind, parts, shared in pairs]


@pytest.mark.share(0)
@pytest.mark.parametrize("name", ["bonds", "tanh"])
def test_exact_one_of_many_moves_as_alone_to_the_last_bit(name):
    """More motions than lanes, of other loads, lengths and tolerances."""
    def runs():
        law = LAWS[name]
        made = [law.element(load) if name == "tanh" else lanes_element(law, load) for load in np.geomspace(5, 200, 19)]
        return [Run(ONE, BaseSine(10.0 + 3 * k, OMEGA * (0.7 + 0.03 * k)), one, 20, 1e-9) for k, one in enumerate(made)]

    def lanes_element(law, load):
        return points_element(law, [1.0], [load])

    alone, group = runs(), runs()
    until = np.array([(3 + k % 5) * 1.1 / 143 for k in range(19)])
    all_of, kept = together(group)
    codes = lanes.advance(group[0].element.kernels, all_of, kept, until, np.full(19, 1e-9))
    assert not codes.any()
    for k, run in enumerate(alone):
        run.until(until[k])
        assert np.array_equal(run.moving.y, all_of.y[k]) and np.array_equal(run.moving.now, all_of.now[k])
        assert np.array_equal(run.kept.cycles, kept.cycles[k]) and np.array_equal(run.moving.mem, all_of.mem[k])


@pytest.mark.parametrize("peaks", [False, True])
def test_exact_a_call_without_room_for_turns_goes_on_where_it_ended(peaks):
    """In the lanes, and in the loop that reads inside its steps: the same motion to the last bit."""
    whole, parts = (Run(ONE, SINE, element(LAWS["bonds"]), 9, 1e-9) for _ in range(2))
    parts.kept = parts.kept._replace(turns=np.zeros((3, 9)))
    for run in (whole, parts):
        run.until(8 * PERIOD, peaks=peaks)
    one, other = np.concatenate(parts.turns), np.concatenate(whole.turns)
    np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(parts.moving.y, whole.moving.y)
    assert len(parts.turns) > 4


@pytest.mark.parametrize("turning", [0, 1.5])
def test_exact_many_that_turn_more_often_than_there_is_room_for(turning, monkeypatch):
    """Bonds that hold ring: they turn six times a cycle. Room that is made on the way changes no bit."""
    law = points_element(Bonds(0.3, 1e-6), [1.0], [92.0])
    cases = [(ONE, BaseSine(push, OMEGA), law, None) for push in (30.0, 60.0)]
    wide = many.together(cases, 60, 10, [[1e-9, 1e-9]])
    monkeypatch.setattr(many, "TURNING", turning / 60)
    monkeypatch.setattr(many, "AT_REST", 4)
    narrow = many.together(cases, 60, 10, [[1e-9, 1e-9]])
    assert not wide.lost.any() and not narrow.lost.any()
    count = int(wide.kept.tally[:, TURNS].max())
    assert count > 200 and narrow.kept.turns.shape[1] < 2 * count
    np.testing.assert_array_equal(narrow.moving.y, wide.moving.y)
    np.testing.assert_array_equal(narrow.kept.samples, wide.kept.samples)
    np.testing.assert_array_equal(narrow.kept.tally, wide.kept.tally)
    np.testing.assert_array_equal(narrow.kept.turns[:, :count], wide.kept.turns[:, :count])


@pytest.mark.parametrize("modes, law, drive, travel", [
    (THREE, LAWS["bonds"], SINE, np.inf), (ONE, Bonds(0.3, 5e-6, breakaway=0.2), SINE, np.inf),
    (ONE, LAWS["tanh"], SINE, 1e-3),
    (ONE, Bonds(0.3, 5e-6, rest_growth=10.0, slip_growth=1e-6, rest_speed=1e-4), SINE, np.inf)])
def test_always_other_motions_stay_with_the_loop(modes, law, drive, travel):
    assert not Run(modes, drive, element(law), 2, 1e-6, travel).swift


@pytest.mark.slow
def test_always_a_force_of_the_speed_is_met_without_refused_tries():
    """tanh with v_0 four thousandths of the peak speed: more than one try in two was refused."""
    run = Run(ONE, BaseSine(49.0, OMEGA * 0.98), Rate(0.3, 5e-3).element(30.0), 60, 1e-9)
    run.until(50 * PERIOD)
    done, refused = run.kept.tally[13:15]
    assert refused < 0.25 * done


def test_exact_nodes_of_a_creeping_step_are_those_of_radau():
    """Polynomials up to their degree are met, integrals at the end up to twice that, and what is stiff dies out."""
    from patchfem.dynamics.smooth import creep_kernels as creep

    n, places = creep.NODES, creep.PLACES
    powers = places[:, None]**np.arange(n + 1)
    k = np.arange(1, n + 1)
    assert creep.SLOPES @ powers[:, 1:] == pytest.approx(k * powers[1:, :-1], rel=1e-9, abs=1e-10)
    assert creep.AREAS @ powers == pytest.approx(places[1:, None] * powers[1:] / np.arange(1, n + 2), rel=1e-12)
    assert creep.POWERS @ powers == pytest.approx(np.eye(n + 1), abs=1e-9)
    butcher = np.linalg.inv(creep.SLOPES[:, 1:])  # of v' = f(t) from v = 0: the weights stand in its last row
    high = np.arange(2 * n - 1)
    assert butcher[-1] @ places[1:, None]**high == pytest.approx(1 / (high + 1), rel=1e-10)
    assert abs(1 - butcher[-1] @ np.linalg.solve(butcher, np.ones(n))) < 1e-11  # L-stable
    legendre = np.polynomial.legendre.legvander(2 * places - 1, n)
    assert creep.LAST @ legendre == pytest.approx(np.eye(n + 1)[-1], abs=1e-12)


@pytest.mark.parametrize("push", [30.0, 40.0])
def test_exact_a_motion_that_creeps_takes_few_steps_and_is_that_of_the_loop(push):
    """Held by 36 N, with lambda 3e5/s: a series that must follow it took 360 and 210 steps a cycle."""
    beside, alone = (Run(ONE, BaseSine(push, OMEGA), LAWS["stiff"].element(120.0), 6, one) for one in (1e-9, 1e-12))
    alone.swift = False
    for run in (beside, alone):
        run.until(5.3 * PERIOD)
    assert beside.kept.tally[13] < (40 if push < 36 else 120) * 5.3
    size = abs(alone.kept.cycles[:2, :5]).max()
    assert abs(beside.moving.y[0] - alone.moving.y[0]) < 1e-8 * size
    assert beside.moving.y[1] == pytest.approx(alone.moving.y[1], rel=1e-6)
    assert beside.moving.y[2:] == pytest.approx(alone.moving.y[2:], rel=1e-8)
    one, other = (np.concatenate(run.turns)[:, :5] for run in (beside, alone))
    assert len(one) == len(other) > 8
    assert np.all(abs(one - other).max(axis=0) <= 1e-7 * np.maximum(abs(other).max(axis=0), 1e-9))
