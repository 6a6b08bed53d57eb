"""Limit cycles of modes of negative damping beside friction: closed forms, and integration in time by scipy."""

from dataclasses import replace

import numpy as np
import pytest
from modal_bases import basis_of
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from patchfem.core import ModalBasis
from patchfem.dynamics import LawGroup, limit_cycles
from patchfem.dynamics.harmonic.laws import Jenkins


def modes_of(omega, zeta, slide, output) -> ModalBasis:
    return basis_of(omega, zeta, slide, np.ones(len(omega)), output, 0.5)


def rates(modes: ModalBasis, y, force: float):
    """z'' of the modes under friction `force` [N] against the slide."""
    n = modes.omega.size
    return (
        -(modes.omega**2) * y[:n] - modes.damping_matrix @ y[n:] - modes.slide * force / modes.mass
    )


@pytest.mark.parametrize("zeta", [-1e-4, -0.002, -0.05, -0.3])
def test_a_block_on_rigid_friction_has_its_closed_form(zeta):
    """Every half swing loses 2 F/k and gains by exp(pi |zeta|/sqrt(1 - zeta^2)); to the first order 4 F/(pi |c| w)."""
    modes = modes_of([750.0], [zeta], [1.0], [2.0])
    force = 9.0
    [found] = limit_cycles.find_relay_cycles(modes, modes.slide, force, force)
    gain = np.exp(np.pi * abs(zeta) / np.sqrt(1 - zeta**2))
    half = force / (0.5 * 750.0**2)
    assert found.amplitude == pytest.approx(2 * half * (gain + 1) / (gain - 1), rel=1e-9)
    assert not found.is_stable and found.omega == pytest.approx(
        750.0 * np.sqrt(1 - zeta**2), rel=1e-10
    )
    assert 2 * limit_cycles.estimate_amplitude(modes, modes.slide, force, 0) == pytest.approx(
        found.amplitude, rel=(np.pi * zeta) ** 2
    )


def turning_state(modes: ModalBasis, force: float, half: float) -> np.ndarray:
    """Return the state (2n,) at a turn, after which half a period under a constant force leads to its opposite.

    With E = exp(A T/2) and the state e at rest under the force, E (y - e) + e = -y.
    """
    n = modes.omega.size
    identity = np.eye(n)
    matrix = np.block(
        [
            [np.zeros((n, n)), identity],
            [-np.diag(modes.omega**2), -np.asarray(modes.damping_matrix)],
        ]
    )
    rest = np.concatenate([modes.slide * force / (modes.mass * modes.omega**2), np.zeros(n)])
    flow = expm(matrix * half)
    return np.linalg.solve(flow + np.eye(2 * n), (flow - np.eye(2 * n)) @ rest)


def test_a_second_mode_rings_with_the_cycle():
    """The motion from the turn of the found cycle comes back with its sign turned, by DOP853 to its stop."""
    modes = modes_of([750.0, 2600.0], [-0.01, 0.02], [1.0, 0.7], [1.0, -0.4])
    [found] = limit_cycles.find_relay_cycles(modes, modes.slide, 9.0, 10.0)
    start = turning_state(modes, 9.0, np.pi / found.omega)

    def stops(t, y):
        return y[2:] @ modes.slide

    # it slides down
    stops.terminal = True
    stops.direction = 1.0
    run = solve_ivp(
        lambda t, y: np.concatenate([y[2:], rates(modes, y, -9.0)]),
        (0.0, 0.02),
        start,
        "DOP853",
        events=[stops],
        rtol=1e-12,
        atol=1e-15,
    )
    assert run.t[-1] == pytest.approx(np.pi / found.omega, rel=1e-9)
    assert run.y[:, -1] == pytest.approx(-start, rel=1e-8, abs=1e-9 * np.abs(start).max())
    output = run.y[:2].T @ modes.output
    assert found.amplitude == pytest.approx(np.abs(output).max(), rel=1e-4)


@pytest.mark.parametrize("ratio", [2.999, 3.0001, 5.0])
def test_resonances_of_a_mode_without_damping_are_no_cycles(ratio):
    """The equation of the half period changes its sign where an odd harmonic meets such a mode, and has no zero there:
    one cycle is found, near that of the first mode alone, or none where the second one would hold the slide."""
    modes = modes_of([750.0, 750.0 * ratio], [-0.01, 0.0], [1.0, 0.02], [1.0, 0.0])
    alone = limit_cycles.find_relay_cycles(
        modes_of([750.0], [-0.01], [1.0], [1.0]), np.ones(1), 9.0, 9.0
    )[0]
    for one in limit_cycles.find_relay_cycles(modes, modes.slide, 9.0, 9.0):
        half = np.pi / one.omega
        state = turning_state(modes, 9.0, half)
        largest_speed = np.abs(modes.slide) @ np.abs(state[:2]) / half
        assert abs(modes.slide @ state[2:]) < 1e-8 * largest_speed
        assert one.amplitude == pytest.approx(alone.amplitude, rel=0.05)


def test_a_cycle_that_would_hold_on_the_way_is_none():
    modes = modes_of([750.0], [-0.3], [1.0], [1.0])
    assert limit_cycles.find_relay_cycles(modes, modes.slide, 9.0, 30.0) == []


def test_elastic_plastic_elements_have_a_cycle_that_lasts_and_one_that_does_not():
    """A cycle of DOP853 from both amplitudes repeats; around them the swing is drawn to one and away from the other."""
    stiffness = np.array([2e4, 1e4, 3e4])
    yields = np.array([1e-4, 2e-4, 4e-4])
    modes = modes_of([750.0], [-0.01], [1.0], [1.0])
    limit = float(stiffness @ yields)
    (low, high), least = limit_cycles.find_balance_cycles(
        modes, LawGroup(modes, Jenkins(stiffness, yields)), modes.slide, limit
    )
    assert least == 0.0
    assert low.is_stable and not high.is_stable and low.amplitude < high.amplitude
    assert high.error < 1e-3 * high.amplitude and low.error < 1e-3 * low.amplitude

    def swing(amplitude: float) -> float:
        """The next largest displacement of a swing that has slid from -amplitude to amplitude."""
        stretches = np.minimum(yields, amplitude)

        def along(t, y):
            held = (np.abs(y[2:]) < yields) | (y[2:] * y[1] < 0)
            force = float(stiffness @ np.clip(y[2:], -yields, yields))
            return [y[1], *rates(modes, y[:2], force), *(held * y[1])]

        def stops(t, y):
            return y[1]

        stops.terminal, state, at = True, np.array([amplitude, 0.0, *stretches]), 0.0
        for direction in (1.0, -1.0):
            stops.direction = direction
            state[1] = -direction * 1e-12
            run = solve_ivp(
                along,
                (at, at + 0.1),
                state,
                "DOP853",
                events=[stops],
                rtol=1e-9,
                atol=1e-13,
                max_step=2e-5,
            )
            state = run.y[:, -1].copy()
            at = run.t[-1]
        return state[0]

    for cycle in (low, high):
        # the cycle gives back a few percent of what it is off by
        bar = 3 * cycle.error / cycle.amplitude + 1e-4
        above, below = (
            swing(cycle.amplitude * (1 + way * bar)) / (cycle.amplitude * (1 + way * bar)) - 1
            for way in (1, -1)
        )
        assert (above < 0 < below) if cycle.is_stable else (below < 0 < above)


def test_exact_the_backbone_of_rigid_friction_has_its_closed_form():
    """At an amplitude A a block that loses h = F/k at every swing wants the gain G = (A/h + 1)/(A/h - 1) from each:
    pi z/sqrt(1 - z^2) = ln G for the net ratio -z, over the frequency of the damped block."""
    modes = modes_of([750.0], [0.003], [1.0], [2.0])
    force = 9.0
    zeta = 0.003
    h = force / (0.5 * 750.0**2)
    places = h * np.array([3.0, 10.0, 200.0])
    gain = np.log((places + h) / (places - h))
    net = gain / np.hypot(np.pi, gain)
    omega = 750.0 * np.sqrt(1 - net**2)
    found = limit_cycles.trace_relay_backbone(modes, modes.slide, (force, force), 2 * places, 0)
    assert [one.omega for one, _ in found] == pytest.approx(omega, rel=1e-8)
    assert [ratio for _, ratio in found] == pytest.approx((net + zeta) * 750.0 / omega, rel=1e-7)
    # it holds
    assert limit_cycles.trace_relay_backbone(
        modes, modes.slide, (force, 4 * force), [2.4 * h], 0
    ) == [None]
    with np.errstate(all="raise"):  # a mode that friction does not act on
        assert limit_cycles.trace_relay_backbone(
            modes, 0 * modes.slide, (force, force), [h, 2 * h], 0
        ) == [None, None]


def test_the_backbone_of_two_modes_is_the_cycle_of_its_damping():
    """Lifted by the found ratio, the rig has a limit cycle of the amplitude that was asked for."""
    modes = modes_of([750.0, 2600.0], [0.003, 0.02], [1.0, 0.7], [1.0, -0.4])
    [(cycle, ratio)] = limit_cycles.trace_relay_backbone(modes, modes.slide, (9.0, 9.0), [4e-4], 0)
    lifted = replace(modes, damping=modes.damping_matrix - 2 * ratio * cycle.omega * np.eye(2))
    again = limit_cycles.find_relay_cycles(lifted, modes.slide, 9.0, 9.0)
    assert min(abs(one.amplitude / 4e-4 - 1) for one in again) < 1e-8
