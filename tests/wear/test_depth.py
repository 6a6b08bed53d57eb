"""Implicit wear steps: worn volume, shape and stability against closed forms and exact
transients."""

from functools import cache

import numpy as np
import pytest
from contact_forms import hertz_half_width
from pieces import make_bare_layers, make_bare_pair, make_refined_grid
from pressed import solve_forces
from scipy.linalg import expm
from wear_forms import uniform_wear_pressure, worn_crown_half_width, worn_pad_fraction

from patchfem.elasticity import Piece, interface_compliance
from patchfem.wear import WearProblem, make_initial_wear_state, take_jump, wear_rates
from patchfem.wear.depth import solve_jump

LOAD, KAPPA, PATH = 116.0, 1e-14, 40e-6


def stiffness_at_load(compliance):
    """Return the stiffness (m, m) [N/m] of a compliance while all nodes touch and the total force stays the same."""
    stiff = np.linalg.inv(compliance)
    forces = stiff.sum(axis=1)
    return stiff - np.outer(forces, forces) / forces.sum()


def critical_step(compliance, rate) -> float:
    """Return the longest stable step of the explicit Euler method [cycles]: 2 / the fastest rate of
    the pressure."""
    root_rate = np.sqrt(rate)
    rates = np.linalg.eigvalsh(root_rate[:, None] * stiffness_at_load(compliance) * root_rate)
    return float(2 / rates[-1])


def make_contact_solver(compliance, x, gap, load=LOAD):
    """Return a function that solves the contact under a normal load without rotation."""

    def press(worn, softening):
        return solve_forces(compliance + np.diag(softening), x, gap + worn, np.array([load]))[0]

    return press


@cache
def flat_contact():
    """Return contact solver, compliance, areas, wear rates and critical step of two flat uncoated
    blocks."""
    pair = make_bare_pair()
    area = pair.interface.weight
    c = np.array(pair.normal)
    rate = wear_rates(KAPPA, np.full(area.size, PATH), area)
    return (
        make_contact_solver(c, pair.interface.x, np.zeros(area.size)),
        c,
        area,
        rate,
        critical_step(c, rate),
    )


def run_wear(problem, tolerance=1e-3):
    """Return the last state and the number of steps of a complete wear run."""
    state = make_initial_wear_state(problem)
    jumps = 0
    while state.cycle < problem.cycles:
        state = take_jump(problem, state, tolerance)
        jumps = jumps + 1
    return state, jumps


@pytest.mark.parametrize("multiple", [0.1, 10, 1000])
def test_exact_volume_without_pressure_oscillation_at_any_step(multiple):
    """The worn volume is exact within 1e-12 and the pressure does not oscillate from node to node,
    for steps up to 1000 times the explicit stability limit."""
    press, _, area, rate, critical = flat_contact()
    depth = np.zeros(area.size)
    before = np.diff(press(depth, depth) / area, 2)
    for count in range(1, 11):
        depth, force = solve_jump(press, depth, rate, multiple * critical)
        volume = KAPPA * LOAD * PATH * multiple * critical * count
        assert depth @ area == pytest.approx(volume, rel=1e-12, abs=0)
        assert np.abs(np.diff(force / area, 2)).max() <= 2 * np.abs(before).max()
    assert force.min() > 0


def punch_transient(force, compliance, rate, cycles):
    """Return the change of depth [m] and the force [N] after some cycles of wear under a uniform
    slide.

    All nodes touch. The equations are f' = -Q diag(rate) f, with Q the stiffness at prescribed
    load, and depth' = diag(rate) f; the matrix exponential solves them.
    """
    stiff = stiffness_at_load(compliance)
    worn_per_force = np.diag(rate)
    matrix = np.block([[0 * stiff, worn_per_force], [0 * stiff, -stiff @ worn_per_force]])
    solution = expm(cycles * matrix) @ np.concatenate([0 * force, force])
    return solution[: rate.size], solution[rate.size :]


def test_order_two_for_transient_of_punch():
    """The pressure of a wearing punch converges with order two to the exact transient."""
    press, c, area, rate, critical = flat_contact()
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


def test_exact_steady_pressure_is_inverse_to_sliding_distance():
    """Under a non-uniform sliding distance s the pressure of a yawing pad tends to the classical p
    ~ 1/s, within 1e-11."""
    pair = make_bare_pair()
    x = pair.interface.x
    area = pair.interface.weight
    width = pair.interface.width
    path = PATH * (1.5 + x / x[-1])
    press = make_contact_solver(np.array(pair.normal), x, 0 * x)
    rate = wear_rates(KAPPA, path, area)
    depth = 0 * x
    for _ in range(60):
        depth, force = solve_jump(press, depth, rate, 1e7)
    assert force / area == pytest.approx(
        uniform_wear_pressure(LOAD / width, path, area / width), rel=1e-11
    )


def test_exact_contact_fraction_of_tilted_pad_on_springs():
    """The contact of a tilted pad on springs grows as sqrt(1/k + kappa s) until it is full, within
    one cell."""
    length = 10e-3
    width = 10e-3
    angle = 1e-4
    stiffness = 1e13
    count = 1000
    x = (np.arange(count) + 0.5) / count * length - length / 2
    area = np.full(count, length / count * width)
    press = make_contact_solver(np.diag(1 / (stiffness * area)), x, angle * x)
    rate = wear_rates(KAPPA, np.full(count, PATH), area)
    depth = np.zeros(count)
    cycles = 0.0
    for step in (2e5, 4e5, 8e5, 1e6):
        depth, force = solve_jump(press, depth, rate, step)
        cycles += step
        exact = worn_pad_fraction(KAPPA, LOAD / width, PATH * cycles, angle, length, stiffness)
        assert np.mean(force > 0) == pytest.approx(exact, abs=1.0 / count)
    assert exact > 0.9


def test_exact_worn_hertz_contact_agrees_with_half_space_program():
    """The worn Hertz contact in gross slip agrees with an independent half-space program at two
    sliding distances. Relative to the Hertz half-width, that program gave 2.315 and 3.959 (2.207
    and 3.891 for the worn parabola alone), and peaks of 1.060 and 1.023 of the mean pressure."""
    width = 10e-3
    radius = 0.05
    line_load = 1e5
    young = 121e9
    hertz_width = hertz_half_width(line_load, radius, young / (1 - 0.32**2) / 2)
    mesh = make_refined_grid(
        5 * hertz_width, hertz_width / 10, 40 * hertz_width, 20 * hertz_width, 1.2
    )
    nn, _, _ = interface_compliance(Piece(mesh, make_bare_layers((young, 0.32))))
    x = mesh.x
    area = mesh.tributary_lengths() * width
    press = make_contact_solver(2 * nn / width, x, x**2 / 2 / radius, line_load * width)
    uniform_path = np.ones(x.size)
    for parabola_width, expected_width, expected_peak in (
        (2.207, 2.315, 1.060),
        (3.891, 3.959, 1.023),
    ):
        path = (parabola_width * hertz_width) ** 3 / (1.5 * radius * line_load)
        assert worn_crown_half_width(1.0, line_load, path, radius) == pytest.approx(
            parabola_width * hertz_width
        )
        state, _ = run_wear(WearProblem(press, lambda worn: uniform_path, area, 1.0, path), 3e-3)
        # the edge of the contact lies inside the element next to the last node in contact
        width_found = np.ptp(x[state.force > 0]) / 2 + hertz_width / 20
        assert width_found / hertz_width == pytest.approx(expected_width, abs=0.05)
        assert (state.force / area).max() / (line_load / 2 / width_found) == pytest.approx(
            expected_peak, abs=0.03
        )
