"""The sum over bonds for every order and both readings: closed forms, a sum by hand, orders and bounds."""

from dataclasses import fields

import numpy as np
import pytest
from friction_paths import lower_pressure, pulled, sum_by_hand, triangle, upper_pressure, walk

from patchfem.friction import Bonds, Quadrature
from patchfem.friction.bonds.strips import Strips

ONE = upper_pressure([1.0, 0.25])
GROWTH = {"ratio": 0.6, "rest_growth": 0.3, "slip_growth": 0.4, "rest_speed": 1e-2}


def random_path(seed, count, size=0.7):
    return np.concatenate([[0], np.cumsum(np.random.default_rng(seed).normal(0, size, count))])


# ---- closed strips


@pytest.mark.parametrize("order", [-0.5, 0.0, 0.5, 1.0, 2.0, 3.7])
@pytest.mark.parametrize("initial", [0.0, 1.0])
def test_exact_printed_law_on_random_paths(order, initial):
    """Incomplete-gamma strips against 2.17 summed by hand; orders below one keep a kink at R = 0 in the hand sum."""
    law = Bonds(1.0, 1.0, order, "report", initial=initial)
    path = random_path(4, 40)
    run = pulled(Quadrature(law, tail=0.0), path, ONE)
    within = {-0.5: 0.05, 0.5: 1e-4}.get(order, 1e-8 if order == 3.7 else 1e-12)
    assert run.traction[-1] == pytest.approx(sum_by_hand(law, path, ONE), abs=within)


@pytest.mark.parametrize("pressure", [ONE, lower_pressure(np.linspace(-2, 2, 5), 5.0, 1.5)])
@pytest.mark.parametrize("reading, order", [("report", 0.0), ("report", 2.0), ("stretch", 1.0)])
def test_exact_pressure_on_either_piece(reading, order, pressure):
    law = Bonds(1.0, 1.0, order, reading, initial=0.5)
    path = random_path(5, 40)
    run = pulled(Quadrature(law, tail=0.0), path, pressure)
    assert run.traction[-1] == pytest.approx(sum_by_hand(law, path, pressure), abs=1e-12)


@pytest.mark.parametrize("reading", ["report", "stretch"])
def test_exact_bare_places_hold_only_the_bonds_formed_since(reading):
    """Pressure 1, then 0 at two points for one step: there the rest of the path starts anew, without a cohort."""
    law = Bonds(1.0, 1.0, 1.0, reading)
    path = np.concatenate([np.linspace(0, 2, 9), np.linspace(2, 1.2, 5)[1:]])
    table = np.ones((path.size, 3))
    table[8, 1:] = 0.0

    engine = Quadrature(law, tail=0.0)
    state = engine.start(table[0])
    for k, dq in enumerate(np.diff(path)):
        state = engine.step(state, dq, table[k], table[k + 1], 1.0).state
    after = sum_by_hand(
        Bonds(1.0, 1.0, 1.0, reading, initial=0.0), path[9:], upper_pressure([1.0])
    )[0]
    first = sum_by_hand(
        Bonds(1.0, 1.0, 1.0, reading, initial=0.0), path[8:10], upper_pressure([1.0])
    )[0]
    # the strip that starts on the bare place forms at the mean of its ends: half density
    strip = (
        sum_by_hand(Bonds(1.0, 1.0, 1.0, reading, initial=0.0), path[8:], upper_pressure([1.0]))[0]
        - after
    )
    tau = engine.traction(state)
    assert tau[0] == pytest.approx(sum_by_hand(law, path, upper_pressure([1.0]))[0], abs=1e-13)
    assert tau[1:] == pytest.approx(np.full(2, after + strip / 2), abs=1e-13) and first < 0


# ---- Gauss strips


@pytest.mark.parametrize("order", [2.0, 3.0])
def test_exact_gauss_strips_of_smooth_orders(order):
    path = np.concatenate([np.linspace(0, 3, 13), np.linspace(3, 1, 9)[1:]])
    law = Bonds(1.0, 1.0, order, "stretch", initial=0.3)
    run = pulled(Quadrature(law, tail=0.0), path, ONE)
    assert run.traction[-1] == pytest.approx(sum_by_hand(law, path, ONE), abs=1e-11)


@pytest.mark.parametrize("order", [-0.5, 0.0, 1.0, 2.0])
def test_exact_printed_law_with_growing_bonds_at_steps_of_any_length(order):
    """Every bond grows its own length from zero: 2.10 at constant speed is exact inside a strip."""
    law = Bonds(1.0, 1.0, order, "report", initial=0.0, **GROWTH)
    for parts in (1, 2, 4):
        path = triangle(1.0, 1, 8 * parts)[: 20 * parts + 1]
        run = pulled(Quadrature(law, tail=0.0), path, ONE, dt=0.4 / parts)
        found = run.traction[-1, 0]
        wanted = sum_by_hand(law, path, ONE, 0.4 / parts)[0]
        assert found == pytest.approx(wanted, abs=2e-6 if order > -0.5 else 1e-4)


def columns(part) -> list:
    """Return the arrays of a field of the bonds, which may be nested named tuples."""
    if not isinstance(part, tuple):
        return [part]
    return [column for inner in part for column in columns(inner)]


@pytest.mark.share(0, 2, 4, 7, 9)
@pytest.mark.parametrize(
    "reading, order, growth",
    [
        ("report", 0.0, {}),
        ("report", 1.0, GROWTH),
        ("stretch", 0.5, {}),
        ("stretch", 1.0, GROWTH),
        ("stretch", 2.0, GROWTH),
    ],
)
@pytest.mark.parametrize("tail", [0.0, 1e-2])
def test_exact_bonds_that_are_only_carried_are_those_of_a_step(reading, order, growth, tail):
    law = Quadrature(Bonds(0.4, 1.0, order, reading, **growth), tail)
    pressure = lower_pressure(np.zeros(3), 5.0, 0.5)
    path = np.concatenate([random_path(6, 12, 0.4), [0.0, 0.0, 30.0]])
    stepped = walk(law, path, pressure, 0.3)
    carried = pulled(law, path, pressure, 0.3)
    assert np.array_equal(stepped.traction, carried.traction)
    for each in fields(Strips):
        one, two = (columns(getattr(run.state, each.name)) for run in (stepped, carried))
        assert len(one) == len(two)
        assert all(np.array_equal(a, b) for a, b in zip(one, two)), each.name


# ---- cut-off


@pytest.mark.share(0, 2, 3)
@pytest.mark.parametrize(
    "reading, order, growth",
    [
        ("report", 0.0, {}),
        ("report", 2.0, {}),
        ("stretch", 1.0, {}),
        ("stretch", 1.0, GROWTH),
        ("stretch", 2.0, {}),
        ("report", 1.0, GROWTH),
    ],
)
def test_always_the_cut_off_loses_less_than_its_bound(reading, order, growth):
    law = Bonds(0.4, 1.0, order, reading, **growth)
    path = np.concatenate(
        [random_path(6, 150, 0.4), random_path(6, 151, 0.4)[-1] + np.linspace(0.2, 20, 100)]
    )
    whole = pulled(Quadrature(law, 0.0), path, ONE, 0.3)
    for tail in (1e-2, 1e-5):
        cut = pulled(Quadrature(law, tail), path, ONE, 0.3)
        assert cut.state.n_dropped > 0 and len(cut.state.pressure) < len(whole.state.pressure)
        gap = np.abs(cut.traction - whole.traction).max()
        assert gap <= tail * 0.4 * 1.0
        if reading == "report" and not growth:
            assert gap > 0


# ---- far ends


@pytest.mark.share(0, 3, 4, 6, 9)
@pytest.mark.parametrize(
    "reading, order",
    [("report", -0.5), ("report", 0.0), ("report", 2.0), ("stretch", 0.0), ("stretch", 2.0)],
)
@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_exact_rest_and_long_steps(reading, order, growth):
    law = Bonds(1.0, 1.0, order, reading, **growth)
    path = np.array([0.0, 0.0, 0.3, 0.3, 1e3, 1e3])
    run = walk(Quadrature(law), path, ONE, 1.0)
    assert np.isfinite(np.concatenate([run.mean, run.traction])).all()
    assert not run.traction[0].any()
    # as printed, loaded bonds heal at rest and the force moves by itself
    if reading == "stretch" or not growth:
        assert run.traction[3] == pytest.approx(run.traction[4], rel=1e-12)
        assert run.mean[4] == pytest.approx(run.traction[4], rel=1e-12)
    if not growth:
        assert run.traction[4] == pytest.approx([1.0, 0.25], rel=1e-3)
        assert run.traction[2] == pytest.approx(run.traction[1], rel=1e-14)


def test_exact_a_dwell_does_not_count_as_growth_of_the_next_strip():
    law = Bonds(
        1.0,
        1.0,
        1.0,
        "report",
        ratio=0.5,
        rest_growth=0.1,
        slip_growth=0.2,
        rest_speed=1e-2,
        initial=0.0,
    )
    path = np.concatenate([np.linspace(0, 2, 41), [2.0, 2.05]])
    times = np.append(np.full(40, 0.5), [1.0, 0.5])
    got = pulled(Quadrature(law, tail=0.0), path, upper_pressure([1.0]), times).traction[-1, 0]
    assert got == pytest.approx(sum_by_hand(law, path, upper_pressure([1.0]), times)[0], abs=2e-4)
