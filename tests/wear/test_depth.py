"""Implicit wear jumps: volume, shape and stability against closed forms and exact transients."""

from functools import cache

import numpy as np
import pytest
from pieces import bare, bare_pair, coated_pair, refined_middle
from scipy.linalg import expm
from wear_forms import even_wear_pressure, worn_crown_half_width, worn_pad_fraction, worn_volume

from patchfem.closed_forms.contact import hertz_half_width
from patchfem.contact.unilateral import solve_forces
from patchfem.elasticity import interface_compliance, make_piece
from patchfem.wear import WearProblem, start_wear, take_jump, wear_rates
from patchfem.wear.depth import solve_jump

LOAD, KAPPA, PATH = 116.0, 1e-14, 40e-6


def critical_jump(compliance, rate, active, held: str = "load", places=None) -> float:
    """Longest stable jump [cycles] of the explicit Euler method: 2 over the fastest rate at which pressure evens out.

    compliance (m, m) [m/N]; rate (m,) [m/N] of `rates`; active (m,) bool: nodes in contact; held: "load", "moment"
    (load and moment are given, which wants places (m,) [m]) or "approach". inf where nothing wears.
    """
    chosen = np.flatnonzero(np.asarray(active) & (np.asarray(rate) > 0))
    touching = np.flatnonzero(active)
    if not chosen.size:
        return np.inf
    stiff = np.linalg.inv(compliance[np.ix_(touching, touching)])
    if held != "approach":
        rigid = np.ones((touching.size, 1))
        if held == "moment":
            rigid = np.column_stack([rigid, np.asarray(places)[touching]])
        push = stiff @ rigid
        stiff = stiff - push @ np.linalg.solve(rigid.T @ push, push.T)
    root = np.sqrt(np.asarray(rate)[touching])
    fastest = np.linalg.eigvalsh(root[:, None] * stiff * root[None, :])[-1]
    return float(2 / fastest) if fastest > 0 else np.inf


def pressing(compliance, x, gap, load=LOAD):
    """The pieces under a load with the rotation held."""

    def press(worn, softening):
        return solve_forces(compliance + np.diag(softening), x, gap + worn, np.array([load]))[0]

    return press


@cache
def flat():
    """Flat bare blocks: (press, compliance, area, rate of even slip, critical jump)."""
    pair = bare_pair(32)
    area = pair.interface.weight
    c = np.array(pair.normal)
    rate = wear_rates(KAPPA, np.full(area.size, PATH), area)
    return (
        pressing(c, pair.interface.x, np.zeros(area.size)),
        c,
        area,
        rate,
        critical_jump(c, rate, np.ones(area.size, bool)),
    )


def evolved(asked, tolerance=1e-3, count=None):
    """(last state, number of jumps) of a whole wear run."""
    state = start_wear(asked)
    jumps = 0
    while state.cycle < asked.cycles:
        state = take_jump(asked, state, tolerance, count)
        jumps = jumps + 1
    return state, jumps


@pytest.mark.parametrize("multiple", [0.1, 1, 10, 100, 1000])
def test_exact_volume_and_no_checkerboard_at_any_jump(multiple):
    press, _, area, rate, critical = flat()
    depth = np.zeros(area.size)
    before = np.diff(press(depth, depth) / area, 2)
    for count in range(1, 11):
        depth, force = solve_jump(press, depth, rate, multiple * critical)
        volume = worn_volume(KAPPA, LOAD, PATH * multiple * critical * count)
        assert depth @ area == pytest.approx(volume, rel=1e-12)
        assert np.abs(np.diff(force / area, 2)).max() <= 2 * np.abs(before).max()
    assert force.min() > 0


def punch_transient(force, compliance, rate, cycles):
    """Return the change of depth [m] and the force [N] after some cycles of even wear while all nodes touch.

    f' = -Q diag(rate) f, with Q the stiffness at prescribed load, and depth' = diag(rate) f.
    """
    one = np.ones(rate.size)
    stiff = np.linalg.inv(compliance)
    stiff = stiff - np.outer(stiff @ one, one @ stiff) / (one @ stiff @ one)
    worn_per_force = np.diag(rate)
    matrix = np.block([[0 * stiff, worn_per_force], [0 * stiff, -stiff @ worn_per_force]])
    solution = expm(cycles * matrix) @ np.concatenate([0 * force, force])
    return solution[: rate.size], solution[rate.size :]


def test_order_two_against_the_exact_transient_of_a_punch():
    press, c, area, rate, critical = flat()
    cycles = 6 * critical
    zero = np.zeros(area.size)
    errors = []
    _, exact = punch_transient(press(zero, zero), c, rate, cycles)
    for count in (8, 16, 32):
        depth = zero
        for _ in range(count):
            depth, force = solve_jump(press, depth, rate, cycles / count)
        errors.append(np.abs(force - exact).max() / exact.max())
    assert errors[-1] < 2e-5
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)


def test_order_a_jump_grows_as_its_true_error_allows():
    """The method of order two may lengthen a jump by (tolerance / error)**(1/3), times 0.9 for safety."""
    press, c, area, rate, critical = flat()
    tolerance = 1e-7
    path = np.full(area.size, PATH)
    asked = WearProblem(press, lambda worn: path, area, KAPPA, 100 * critical)
    before = take_jump(asked, start_wear(asked), tolerance)
    for _ in range(5):
        state = take_jump(asked, before, tolerance)
        length = state.cycle - before.cycle
        exact = before.depth + punch_transient(before.force, c, rate, length)[0]
        error = np.abs(state.depth - exact).max() / state.depth.max()
        assert (0.9 * length / state.length) ** 3 == pytest.approx(error / tolerance, rel=0.01)
        before = state


def test_exact_pressure_times_path_is_even_under_uneven_slip():
    """A yawing pad: p s = constant, the classical p ~ 1/s."""
    pair = bare_pair(32)
    x = pair.interface.x
    area = pair.interface.weight
    width = pair.interface.width
    path = PATH * (1.5 + x / x[-1])
    press = pressing(np.array(pair.normal), x, 0 * x)
    rate = wear_rates(KAPPA, path, area)
    depth = 0 * x
    for _ in range(60):
        depth, force = solve_jump(press, depth, rate, 1e7)
    assert force / area == pytest.approx(
        even_wear_pressure(LOAD / width, path, area / width), rel=1e-11
    )


def test_exact_tilted_pad_on_springs():
    """Contact grows as sqrt(1/k + kappa s) until it is full; the error is at most a cell."""
    length = 10e-3
    width = 10e-3
    angle = 1e-4
    stiffness = 1e13
    count = 1000
    x = (np.arange(count) + 0.5) / count * length - length / 2
    area = np.full(count, length / count * width)
    press = pressing(np.diag(1 / (stiffness * area)), x, angle * x)
    rate = wear_rates(KAPPA, np.full(count, PATH), area)
    depth = np.zeros(count)
    cycles = 0.0
    for step in (2e5, 4e5, 8e5, 1e6):
        depth, force = solve_jump(press, depth, rate, step)
        cycles += step
        exact = worn_pad_fraction(KAPPA, LOAD / width, PATH * cycles, angle, length, stiffness)
        assert np.mean(force > 0) == pytest.approx(exact, abs=1.0 / count)
    assert exact > 0.9


def crowned(cells=100, radius=0.05):
    """Coated pieces, one of them crowned, under gross slip for 135 723 cycles."""
    pair = coated_pair(cells)
    x = pair.interface.x
    area = pair.interface.weight
    even = np.full(x.size, PATH)
    return WearProblem(
        pressing(np.array(pair.normal), x, x**2 / 2 / radius),
        lambda worn: even,
        area,
        1e-13,
        135723.0,
    )


@pytest.mark.slow
def test_always_automatic_jumps_meet_the_tolerance():
    asked = crowned()
    counts = []
    fine, _ = evolved(asked, 1e-6)
    for tolerance in (1e-2, 1e-3, 1e-4):
        state, count = evolved(asked, tolerance)
        counts.append(count)
        assert np.abs(state.depth - fine.depth).max() <= max(state.error, 1e-12 * fine.depth.max())
        assert state.error <= tolerance * state.depth.max()
        assert state.depth @ asked.area == pytest.approx(
            worn_volume(1e-13, LOAD, PATH * 135723), rel=1e-12
        )
    assert counts == sorted(counts)


def test_exact_worn_hertz_contact_at_two_paths():
    """Half-planes under gross slip. Where the worn parabola alone would be 2.207 and 3.891 wide (over Hertz' a0), an
    independent half-space program found 2.315 and 3.959, and 1.060 and 1.023 of the mean pressure."""
    width = 10e-3
    radius = 0.05
    line = 1e5
    young = 121e9
    half = hertz_half_width(line, radius, young / (1 - 0.32**2) / 2)
    grid = refined_middle(5 * half, half / 10, 40 * half, 20 * half, 1.2)
    nn, _, _ = interface_compliance(
        make_piece(grid.x, grid.depth, grid.coating_rows, bare((young, 0.32)))
    )
    x = grid.x
    area = grid.tributary_lengths() * width
    press = pressing(2 * nn / width, x, x**2 / 2 / radius, line * width)
    even = np.ones(x.size)
    for alone, wide, peak in ((2.207, 2.315, 1.060), (3.891, 3.959, 1.023)):
        path = (alone * half) ** 3 / (1.5 * radius * line)
        assert worn_crown_half_width(1.0, line, path, radius) == pytest.approx(alone * half)
        state, _ = evolved(WearProblem(press, lambda worn: even, area, 1.0, path), 3e-3)
        # an edge lies somewhere in the cell behind its last node
        found = np.ptp(x[state.force > 0]) / 2 + half / 20
        assert found / half == pytest.approx(wide, abs=0.05)
        assert (state.force / area).max() / (line / 2 / found) == pytest.approx(peak, abs=0.03)


def test_exact_wear_coefficient_zero_changes_nothing():
    asked = crowned(40)
    still, _ = evolved(WearProblem(asked.press, asked.path, asked.area, 0.0, 1000.0))
    assert not still.depth.any() and still.error == 0.0
