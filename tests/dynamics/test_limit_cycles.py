"""Limit cycles of negatively damped modes with friction, against closed forms and time integration
by SciPy."""

import numpy as np
import pytest
from modal_bases import make_shaken_modes
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from patchfem.core import ModalBasis
from patchfem.dynamics import LawGroup, limit_cycles
from patchfem.dynamics.harmonic.laws import Jenkins


def modal_accelerations(modes: ModalBasis, y, force: float):
    """Return the modal accelerations z'' under a friction force [N] that opposes the slide."""
    n = modes.omega.size
    return (
        -(modes.omega**2) * y[:n] - modes.damping_matrix @ y[n:] - modes.slide * force / modes.mass
    )


@pytest.mark.parametrize("zeta", [-1e-4, -0.002, -0.05, -0.3])
def test_exact_limit_cycle_of_block_agrees_with_closed_form(zeta):
    """The limit cycle of a block on rigid friction agrees with its closed form within 1e-9. Each
    half period loses 2 F/k and multiplies the amplitude by exp(pi |zeta|/sqrt(1 - zeta^2)); to
    first order the amplitude is 4 F/(pi |c| w)."""
    modes = make_shaken_modes([750.0], [zeta], [1.0], [2.0])
    force = 9.0
    [cycle] = limit_cycles.find_relay_cycles(modes, modes.slide, force, force)
    gain = np.exp(np.pi * abs(zeta) / np.sqrt(1 - zeta**2))
    friction_shift = force / (0.5 * 750.0**2)
    assert cycle.amplitude == pytest.approx(2 * friction_shift * (gain + 1) / (gain - 1), rel=1e-9)
    assert not cycle.is_stable and cycle.omega == pytest.approx(
        750.0 * np.sqrt(1 - zeta**2), rel=1e-10
    )
    assert 2 * limit_cycles.estimate_amplitude(modes, modes.slide, force, 0) == pytest.approx(
        cycle.amplitude, rel=(np.pi * zeta) ** 2
    )


def reversal_state(modes: ModalBasis, force: float, half_period: float) -> np.ndarray:
    """Return the state (2n,) at a reversal that becomes its opposite after half a period under a
    constant force.

    With E = exp(A T/2) and the equilibrium e under the force, E (y - e) + e = -y.
    """
    n = modes.omega.size
    identity = np.eye(n)
    matrix = np.block(
        [
            [np.zeros((n, n)), identity],
            [-np.diag(modes.omega**2), -np.asarray(modes.damping_matrix)],
        ]
    )
    equilibrium = np.concatenate([modes.slide * force / (modes.mass * modes.omega**2), np.zeros(n)])
    flow = expm(matrix * half_period)
    return np.linalg.solve(flow + np.eye(2 * n), (flow - np.eye(2 * n)) @ equilibrium)


@pytest.mark.parametrize("zeta", [0.02, 1.0])
def test_exact_limit_cycle_of_two_modes_agrees_with_dop853(zeta):
    """DOP853, started at a reversal of the limit cycle of two modes, reaches the opposite state
    after half a period, within 1e-8; the second mode may be critically damped."""
    modes = make_shaken_modes([750.0, 2600.0], [-0.01, zeta], [1.0, 0.7], [1.0, -0.4])
    [cycle] = limit_cycles.find_relay_cycles(modes, modes.slide, 9.0, 10.0)
    start = reversal_state(modes, 9.0, np.pi / cycle.omega)

    def slide_speed(t, y):
        return y[2:] @ modes.slide

    # the velocity is negative, so that the slide stops when it rises through zero
    slide_speed.terminal = True
    slide_speed.direction = 1.0
    run = solve_ivp(
        lambda t, y: np.concatenate([y[2:], modal_accelerations(modes, y, -9.0)]),
        (0.0, 0.02),
        start,
        "DOP853",
        events=[slide_speed],
        rtol=1e-12,
        atol=1e-15,
    )
    assert run.t[-1] == pytest.approx(np.pi / cycle.omega, rel=1e-9)
    assert run.y[:, -1] == pytest.approx(-start, rel=1e-8, abs=1e-9 * np.abs(start).max())
    output = run.y[:2].T @ modes.output
    assert cycle.amplitude == pytest.approx(np.abs(output).max(), rel=1e-4)


def test_exact_elastic_plastic_elements_have_stable_and_unstable_cycle():
    """Elastic-plastic elements have a stable and an unstable limit cycle. In an integration by
    DOP853 amplitudes near the stable cycle approach it, and amplitudes near the unstable cycle
    leave it."""
    stiffness = np.array([2e4, 1e4, 3e4])
    yield_slides = np.array([1e-4, 2e-4, 4e-4])
    modes = make_shaken_modes([750.0], [-0.01], [1.0], [1.0])
    limit = float(stiffness @ yield_slides)
    (low, high), min_amplitude = limit_cycles.find_balance_cycles(
        modes, LawGroup(modes, Jenkins(stiffness, yield_slides)), modes.slide, limit
    )
    assert min_amplitude == 0.0
    assert low.is_stable and not high.is_stable and low.amplitude < high.amplitude
    assert high.error < 1e-3 * high.amplitude and low.error < 1e-3 * low.amplitude

    def next_maximum(amplitude: float) -> float:
        """Return the next maximum of the displacement after a slide from -amplitude to
        amplitude."""
        stretches = np.minimum(yield_slides, amplitude)

        def state_derivative(t, y):
            elastic = (np.abs(y[2:]) < yield_slides) | (y[2:] * y[1] < 0)
            force = float(stiffness @ np.clip(y[2:], -yield_slides, yield_slides))
            return [y[1], *modal_accelerations(modes, y[:2], force), *(elastic * y[1])]

        def speed(t, y):
            return y[1]

        speed.terminal, state, time = True, np.array([amplitude, 0.0, *stretches]), 0.0
        for direction in (1.0, -1.0):
            speed.direction = direction
            state[1] = -direction * 1e-12
            run = solve_ivp(
                state_derivative,
                (time, time + 0.1),
                state,
                "DOP853",
                events=[speed],
                rtol=1e-9,
                atol=1e-13,
                max_step=1e-4,
            )
            state = run.y[:, -1].copy()
            time = run.t[-1]
        return state[0]

    for cycle in (low, high):
        # an offset from the cycle changes by only a few percent per period
        offset = 3 * cycle.error / cycle.amplitude + 1e-4
        above, below = (
            next_maximum(cycle.amplitude * (1 + sign * offset))
            / (cycle.amplitude * (1 + sign * offset))
            - 1
            for sign in (1, -1)
        )
        assert (above < 0 < below) if cycle.is_stable else (below < 0 < above)


def test_mode_without_friction_has_no_backbone():
    """Rigid friction that does not act on a mode gives no motion and no warning."""
    modes = make_shaken_modes([750.0], [0.003], [1.0], [2.0])
    row = np.zeros(1)
    with np.errstate(all="raise"):
        found = limit_cycles.trace_relay_backbone(modes, row, (9.0, 9.0), [1e-4], 0)
    assert found == [None]
